"""Slip of a wheel against the train: its size, its events, and what it cannot tell apart."""

import numpy as np
import pytest

from tdacoustic.errors import AnalysisError
from tdacoustic.speed import SpeedProfile, pulses_doubt, relative_excess, wheel_slip

T = np.arange(0.0, 60.0, 0.05)
METRES = np.pi * 1.05112 / (104 / 31)
"""Way a turn of the motor: the reference drive's wheel and ratio."""


def train(speed, times=T, **options):
    return SpeedProfile("gps", None, "m/s", times, speed, **options)


def motor(speed, times=T, **options):
    return SpeedProfile("tacho", "motor", "1/s", times, speed / METRES, **options)


def spins(t, at, width, height):
    return height * np.exp(-0.5 * ((t - at) / width) ** 2)


def test_creep_spin_and_slide_come_back(conformance):
    v = 5.0 + 0.4 * T
    true = 0.006 + spins(T, 20.0, 0.5, 0.08) - spins(T, 45.0, 0.4, 0.05)
    found = wheel_slip(train(v), motor(v * (1.0 + true)), METRES)
    conformance(
        "slip, largest error",
        0.0,
        float(np.max(np.abs(found.slip - true))),
        1e-12,
        "1",
        "known input: wheel and train of known slip",
    )
    conformance("usual slip", 0.006, found.usual, 1e-4, "1", "known input: wheel and train of known slip")
    assert [event.kind for event in found.events] == ["slip", "slide"]
    up, down = found.events
    # Above 2 % of a bell of 8 %: 1.67 standard deviations on each side.
    assert up.first_s == pytest.approx(20.0 - 0.5 * np.sqrt(2 * np.log(4)), abs=0.06)
    assert (up.peak, down.peak) == (pytest.approx(0.08, abs=1e-3), pytest.approx(-0.05, abs=1e-3))
    assert found.notes == () and found.error is None


def test_the_mean_slip_of_a_steady_run_is_its_mesh_excess():
    """One definition: of the mesh of 31 teeth, and of the wheel."""
    v = np.full(T.size, 20.0 / 3.6)
    turning = motor(v * 1.0123)
    found = wheel_slip(train(v), turning, METRES)
    calculated = 31 * v[0] / METRES
    assert found.usual == pytest.approx(relative_excess(31 * turning.mean, calculated), abs=1e-12)


def test_a_worn_wheel_is_a_usual_slip_and_no_event():
    v = 5.0 + 0.4 * T
    found = wheel_slip(train(v), motor(v / 0.97), METRES)
    assert found.usual == pytest.approx(1 / 0.97 - 1) and found.events == ()


def test_standstill_and_unknown_spans_are_left_out_and_said():
    v = np.maximum(0.0, T - 20.0) * 0.5
    shaft = motor(v)
    found = wheel_slip(train(v, unknown=((40.0, 42.0, "no pulses"),)), shaft, METRES)
    assert np.isfinite(found.slip).all() and found.times_s.min() >= 22.0
    assert not np.any((found.times_s > 40.0) & (found.times_s < 42.0))
    assert "left out" in found.notes[0]


def test_a_train_speed_that_comes_late_looks_like_slip_and_is_named(conformance):
    v = 5.0 + 3.0 * np.sin(0.2 * T)
    late = 5.0 + 3.0 * np.sin(0.2 * (T - 0.3))
    found = wheel_slip(train(late), motor(v), METRES)
    conformance("delay of the train speed", 0.3, found.like_delay_s, 0.02, "s", "known input: a train speed 0.3 s late")


def test_errors_of_both_speeds_add_up():
    v = np.full(T.size, 10.0)
    found = wheel_slip(train(v, error=0.03 * np.ones(T.size)), motor(v, error=0.04 * np.ones(T.size) / METRES), METRES)
    assert np.allclose(found.error, 0.005)


def test_a_coarse_train_speed_is_said():
    times = np.arange(0.0, 60.0, 1.0)
    found = wheel_slip(train(5.0 + 0.1 * times, times), motor(5.0 + 0.1 * T), METRES)
    assert "a value each 1 s" in found.notes[-1]


def test_what_gives_no_slip_is_refused():
    v = np.full(T.size, 0.5)
    with pytest.raises(AnalysisError, match=r"no slip between 'gps' and 'tacho': at no instant"):
        wheel_slip(train(v), motor(v), METRES)
    with pytest.raises(AnalysisError, match="'tacho' in 1/s and 'gps' in m/s"):
        wheel_slip(motor(v), train(v), METRES)


@pytest.mark.parametrize(
    ("ratio", "pulses", "fit"), [(0.5, 60, 30), (2.02, 1, 2), (1.2, 20, 24), (1 / 3, 60, 20), (0.96, 20, None)]
)
def test_a_wrong_number_of_pulses_is_suspected(ratio, pulses, fit):
    said = pulses_doubt(20.0 * ratio, 20.0, pulses)
    assert said is None if fit is None else f"pulses_per_rev = {fit:g} would fit, not {pulses}" in said


def test_a_ratio_that_no_wheel_has_is_said():
    assert "no number of pulses near 100 explains it" in pulses_doubt(27.3, 20.0, 100)


def test_a_profile_says_nothing_of_times_that_it_does_not_know():
    profile = train(np.linspace(5.0, 10.0, 11), np.arange(11.0), unknown=((3.0, 5.0, "lost"),))
    got = profile.speed_at([-1.0, -0.4, 2.5, 3.0, 4.0, 5.0, 10.4, 11.0])
    assert np.array_equal(np.isnan(got), [True, False, False, False, True, False, False, True])
    assert got[2] == pytest.approx(6.25)

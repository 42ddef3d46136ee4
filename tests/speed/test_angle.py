"""The angle of a shaft: exact where it can be, quiet where the tacho is not, and honest about what it does not know."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tdacoustic.errors import AnalysisError
from tdacoustic.speed import ShaftAngle, SpeedProfile

PULSES = 20


def edges_of_a_run_up(first_hz, sweep, count, pulses=PULSES):
    """Instants at which a shaft of constant acceleration has turned by whole pulses."""
    turns = np.arange(count) / pulses
    if sweep == 0.0:
        return turns / first_hz
    return (-first_hz + np.sqrt(first_hz**2 + 2.0 * sweep * turns)) / sweep


@given(st.floats(0.0, 50.0), st.floats(0.01, 20.0))
def test_a_constant_acceleration_is_exact_also_from_standstill(first_hz, sweep):
    angle = ShaftAngle.from_edges(edges_of_a_run_up(first_hz, sweep, 400), PULSES)
    assert not angle.breaks
    times = np.linspace(angle.first_s, angle.last_s, 3001)
    truth = first_hz * times + 0.5 * sweep * times**2
    assert np.max(np.abs(angle.turns_at(times) - truth)) < 1e-11 * max(1.0, truth[-1])
    assert np.allclose(angle.speed_hz_at(times), first_hz + sweep * times, rtol=1e-7, atol=1e-7)
    # Where the speed is zero the instant is as ill defined as the root of the angle's rounding: 1e-8.
    assert np.max(np.abs(angle.times_at(truth[:-1]) - times[:-1])) < 1e-7


def test_a_jerk_leaves_the_stated_error(conformance):
    jerk, step = 6.0, 0.1
    nodes = np.arange(0.0, 10.0 + step / 2, step)
    angle = ShaftAngle(nodes, 5.0 * nodes + jerk * nodes**3 / 6.0)
    times = np.linspace(1.0, 9.0, 20001)
    error = np.max(np.abs(angle.turns_at(times) - (5.0 * times + jerk * times**3 / 6.0)))
    # A Hermite cubic whose slopes are too steep by J h²/6 at both ends: s(1-s)(1-2s) J h³/6, 0.0160 J h³ at most.
    largest = jerk * step**3 / (36.0 * math.sqrt(3.0))
    ratio = error / (jerk * step**3)
    conformance(
        "angle between nodes under a jerk, largest error over J h³",
        0.01604,
        ratio,
        2e-4,
        "1",
        "analytic: error of a Hermite cubic with slopes J h²/6 too steep",
    )
    assert error <= largest * (1.0 + 1e-6)


def test_scatter_of_the_edges_is_not_amplified(conformance):
    rng = np.random.default_rng(3)
    speed, scatter = 20.0, 1e-5
    edges = np.arange(20000) / (PULSES * speed) + scatter * rng.standard_normal(20000)
    angle = ShaftAngle.from_edges(edges, PULSES)
    times = np.linspace(1.0, angle.last_s - 1.0, 400001)
    rms = np.std(angle.turns_at(times) - speed * times)
    at_edges = np.std(angle.turns - speed * angle.times_s)
    assert rms < at_edges * 1.01
    middle = 0.5 * (edges[1:] + edges[:-1])
    between = np.std(angle.turns_at(middle) - speed * middle)
    # Weights -1/16, 9/16, 9/16, -1/16: sqrt(164)/16.
    conformance(
        "angle between scattered edges, over that at the edges",
        0.8004,
        between / at_edges,
        0.02,
        "1",
        "analytic: weights of a Hermite cubic on independent scatter",
    )
    slope = np.std(angle.slopes_hz - speed) / (at_edges * PULSES * speed)
    conformance(
        "speed at scattered edges, over e/h",
        0.7071,
        slope,
        0.02,
        "1",
        "analytic: weights of a Hermite cubic on independent scatter",
    )


@pytest.mark.parametrize("scatter", [1e-6, 1e-5, 1e-4])
def test_smoothing_by_the_known_scatter_keeps_the_acceleration(scatter):
    rng = np.random.default_rng(5)
    edges = edges_of_a_run_up(10.0, 3.0, 4000) + scatter * rng.standard_normal(4000)
    raw = ShaftAngle.from_edges(edges, PULSES)
    smooth = ShaftAngle.from_edges(edges, PULSES, edge_scatter_s=scatter)
    times = np.linspace(0.2, raw.last_s - 0.2, 50001)
    truth, speed = 10.0 * times + 1.5 * times**2, 10.0 + 3.0 * times
    assert np.std(smooth.turns_at(times) - truth) < 0.2 * np.std(raw.turns_at(times) - truth)
    assert np.std(smooth.speed_hz_at(times) - speed) < 0.01 * np.std(raw.speed_hz_at(times) - speed)
    assert any("smoothed" in note for note in smooth.notes)


def test_smoothing_keeps_a_torsional_wobble_that_is_larger_than_the_scatter():
    speed, scatter, wobble = 25.0, 2e-6, 2e-3
    grid = np.arange(0.0, 20.0, 1e-4)
    turns = speed * grid + wobble * np.sin(2.0 * np.pi * 4.0 * grid)
    edges = np.interp(np.arange(1, int(turns[-1] * PULSES)) / PULSES, turns, grid)
    edges += scatter * np.random.default_rng(1).standard_normal(edges.size)
    angle = ShaftAngle.from_edges(edges, PULSES, edge_scatter_s=scatter)
    times = np.linspace(1.0, 18.0, 20001)
    apart = angle.turns_at(times) + 1 / PULSES - np.interp(times, grid, turns)
    assert np.std(apart - apart.mean()) < 0.02 * wobble / math.sqrt(2.0)


def test_outside_of_its_span_it_is_not_known():
    angle = ShaftAngle([1.0, 2.0, 3.0], [0.0, 10.0, 20.0])
    assert (angle.first_s, angle.last_s) == (1.0, 3.0)
    assert np.isnan(angle.turns_at([0.999, 3.001])).all() and np.isnan(angle.speed_hz_at([0.0, 4.0])).all()
    assert np.isnan(angle.times_at([-0.1, 20.1])).all()
    assert angle.turns_at([1.0, 3.0]).tolist() == [0.0, 20.0]


def test_another_shaft_turns_by_its_ratio():
    angle = ShaftAngle.from_edges(edges_of_a_run_up(5.0, 1.0, 100), PULSES, "motor")
    wheel = angle.at_ratio(31.0 / 104.0, "wheelset")
    assert wheel.shaft == "wheelset"
    times = np.linspace(0.1, 0.8, 7)
    assert np.allclose(wheel.turns_at(times), angle.turns_at(times) * 31.0 / 104.0, rtol=1e-13)
    assert np.allclose(wheel.speed_hz_at(times), angle.speed_hz_at(times) * 31.0 / 104.0, rtol=1e-13)
    with pytest.raises(AnalysisError, match="ratio of a shaft must be > 0, got 0"):
        angle.at_ratio(0.0)


def test_a_tacho_that_is_silent_for_a_while_leaves_a_break():
    edges = np.concatenate((np.arange(100) * 0.01, 3.0 + np.arange(80) * 0.01))
    angle = ShaftAngle.from_edges(edges, 10)
    assert angle.breaks == ((0.99, 3.0),)
    assert angle.notes == ("no tacho edge from 0.990 s to 3.000 s",)
    assert np.isnan(angle.turns_at([1.5, 2.9])).all() and np.isfinite(angle.turns_at([0.99, 3.0, 3.5])).all()
    first, second = angle.stretches()
    assert (first.first_s, first.last_s, second.first_s) == (0.0, 0.99, 3.0)
    assert not first.breaks and np.allclose(second.speed_hz_at([3.2, 3.5]), 10.0)


def test_a_tacho_that_stops_halfway_ends_the_angle():
    angle = ShaftAngle.from_edges(np.arange(100) * 0.01, 10)
    assert angle.last_s == pytest.approx(0.99)
    assert np.isnan(angle.turns_at(5.0))


def profile(speed, step_s=0.1, symbol="1/s"):
    speed = np.asarray(speed, dtype=np.float64)
    return SpeedProfile("n", "motor", symbol, np.arange(speed.size) * step_s, speed)


def test_a_speed_linear_between_its_instants_is_integrated_exactly():
    angle = ShaftAngle.from_profile(profile([10.0, 12.0, 12.0, 6.0]))
    assert angle.turns.tolist() == pytest.approx([0.0, 1.1, 2.3, 3.2])
    assert angle.speed_hz_at([0.05, 0.25]).tolist() == pytest.approx([11.0, 9.0])
    assert float(angle.turns_at(0.25)) == pytest.approx(2.3 + 0.05 * 10.5)


def test_standstill_and_reversal_are_breaks_that_are_named():
    speed = np.concatenate((np.linspace(10.0, -10.0, 51), np.zeros(20), np.linspace(0.0, 10.0, 30)))
    angle = ShaftAngle.from_profile(profile(speed))
    assert [round(value, 6) for pair in angle.breaks for value in pair] == [2.3, 2.7, 5.0, 7.3]
    assert "turns backwards from 2.700 s to 5.000 s" in angle.notes
    assert len(angle.stretches()) == 3
    assert np.isnan(angle.turns_at([2.5, 6.0])).all()
    assert np.all(np.diff(angle.turns) > 0.0)


def test_a_shaft_that_stands_has_no_angle():
    with pytest.raises(AnalysisError, match=r"channel 'n': the shaft never turns by 0.5 Hz or more"):
        ShaftAngle.from_profile(profile(np.full(10, 0.1)))


def test_a_train_speed_needs_the_turns_per_metre():
    with pytest.raises(AnalysisError, match="a speed in m/s; an angle needs turns_per_unit"):
        ShaftAngle.from_profile(profile(np.full(10, 20.0), symbol="m/s"))
    wheel = ShaftAngle.from_profile(profile(np.full(10, 20.0), symbol="m/s"), 1.0 / (math.pi * 1.05))
    assert wheel.speed_hz_at(0.3) == pytest.approx(20.0 / (math.pi * 1.05))


@pytest.mark.parametrize(
    ("times", "turns", "message"),
    [
        ([0.0, 1.0], [0.0, 1.0], "at least 3 nodes"),
        ([0.0, 1.0, 1.0], [0.0, 1.0, 2.0], "must increase: turns 1 at 1 s, then 2 at 1 s"),
        ([0.0, 1.0, 2.0], [0.0, 1.0, 0.5], "must increase"),
        ([0.0, 1.0, 2.0], [0.0, math.nan, 2.0], "no numbers"),
    ],
)
def test_nodes_that_make_no_angle_are_refused(times, turns, message):
    with pytest.raises(AnalysisError, match=message):
        ShaftAngle(times, turns, "motor")


def test_too_few_edges_are_refused():
    with pytest.raises(AnalysisError, match="2 tacho edges are too few for an angle"):
        ShaftAngle.from_edges([0.0, 1.0], 1)
    with pytest.raises(AnalysisError, match="pulses_per_rev must be > 0, got 0"):
        ShaftAngle.from_edges([0.0, 1.0, 2.0], 0)

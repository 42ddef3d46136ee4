"""Tacho pulses: instants to a fraction of a sample, mending, and the speed that comes of it."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tdacoustic.errors import AnalysisError
from tdacoustic.speed import EdgeFinder, LevelFinder, SpeedProfile, clean_edges, speed_from_edges

PUT_IN = "known input: tacho pulses of a known run-up"

RATE = 51200.0


def pulse_train(turns, pulses_per_rev, low=0.0, high=5.0, rise=0.06):
    """A pulse a tooth, with flanks of a finite length in angle, each beginning at a whole tooth."""
    phase = np.mod(turns * pulses_per_rev, 1.0)
    shape = np.clip(np.minimum(phase / rise, (0.5 + rise - phase) / rise), 0.0, 1.0)
    return low + (high - low) * shape


def edges_of(x, rate=RATE, cuts=()):
    levels = LevelFinder(round(rate))
    levels.take(x)
    finder = EdgeFinder(*levels.result(), rate)
    for piece in np.split(x, cuts):
        finder.take(piece)
    return finder.result()


def test_edges_of_a_run_up_are_found_to_a_fraction_of_a_sample(conformance):
    t = np.arange(int(10 * RATE)) / RATE
    pulses, rise = 20, 0.06
    # 12 to 28 rev/s: a tooth lasts 91 samples or more, its flank 5; the flank is straight but for the acceleration.
    x = pulse_train(12.0 * t + 0.8 * t**2, pulses, rise=rise)
    found = edges_of(x)
    turns = (np.arange(1, found.size + 1) - 1 + 0.7 * rise) / pulses  # the upper threshold lies at 0.7 of the height
    turns += math.floor(found[0] * 12.0 * pulses) / pulses
    truth = (-12.0 + np.sqrt(144.0 + 3.2 * turns)) / 1.6
    conformance(
        "instant of a tacho edge in a run-up, largest error", 0.0, float(np.max(np.abs(found - truth)) * RATE), 0.01,
        "samples", PUT_IN,
    )  # fmt: skip
    times, speed = speed_from_edges(found, pulses, 10.0)
    # A value is the mean over its interval: exact for a constant acceleration, but for half a tooth of bending.
    conformance(
        "speed of a run-up, largest relative error",
        0.0,
        float(np.max(np.abs(speed / (12.0 + 1.6 * times) - 1.0))),
        1e-4,
        "1",
        PUT_IN,
    )


def test_noise_on_the_pulses_makes_no_edges():
    t = np.arange(int(10 * RATE)) / RATE
    x = pulse_train(20.0 * t, 20) + 0.25 * np.random.default_rng(1).standard_normal(t.size)  # 5 % of the height
    edges = clean_edges(edges_of(x))
    assert (edges.missing, edges.double) == (0, 0)
    assert edges.times_s.size in (4000, 3999)
    _, speed = speed_from_edges(edges.times_s, 20, 10.0)
    assert np.max(np.abs(speed / 20.0 - 1.0)) < 1e-3  # 1 sample of scatter over 50 ms is 4e-4


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(0, 4000), max_size=10).map(sorted))
def test_any_cut_into_blocks_gives_the_same_edges(cuts):
    x = pulse_train(np.arange(4000) / 150.3, 1, rise=0.1) + 0.1 * np.random.default_rng(2).standard_normal(4000)
    x[1000:1003] = np.nan
    assert np.array_equal(edges_of(x, 1000.0), edges_of(x, 1000.0, cuts))


@pytest.mark.parametrize("part", [0.005, 0.01, 0.02, 0.05])
@pytest.mark.parametrize("seed", range(5))
def test_missing_and_double_pulses_are_counted_and_mended(part, seed):
    rng = np.random.default_rng(seed)
    turns = np.arange(4000) / 20.0
    truth = (-12.0 + np.sqrt(144.0 + 3.2 * turns)) / 1.6
    truth = truth + rng.normal(0.0, 2e-5, truth.size)  # a sample at 51.2 kHz
    # Neither at the very ends nor two faults within three teeth, where "exactly" has no meaning.
    places = rng.permutation(np.arange(5, 3990, 4))[: 2 * round(part * truth.size)]
    lost, doubled = places[::2], places[1::2]
    extra = truth[doubled] + rng.uniform(0.1, 0.45, doubled.size) * (truth[doubled + 1] - truth[doubled])
    edges = np.sort(np.concatenate((np.delete(truth, lost), extra)))
    mended = clean_edges(edges)
    assert (mended.missing, mended.double) == (lost.size, doubled.size)
    times, speed = speed_from_edges(mended.times_s, 20, truth[-1])
    exact = 12.0 + 1.6 * times
    assert np.max(np.abs(speed / exact - 1.0)) < 0.02  # a wrong one of two edges shifts one value of 50 ms
    assert np.sqrt(np.mean((speed / exact - 1.0) ** 2)) < 0.002


def test_several_pulses_missing_in_a_row_are_put_in():
    truth = np.arange(500) * 0.01
    mended = clean_edges(np.delete(truth, [100, 101, 102, 300, 301]))
    assert (mended.missing, mended.double) == (5, 0)
    assert np.allclose(mended.times_s, truth, atol=1e-12)


def test_a_start_from_standstill_is_not_mended():
    edges = clean_edges(np.sqrt(2.0 * np.arange(400) / 20.0 / 0.5))
    assert (edges.missing, edges.double) == (0, 0)


def test_edges_in_order_stay_untouched():
    truth = np.cumsum(np.random.default_rng(3).uniform(0.008, 0.012, 1000))
    mended = clean_edges(truth)
    assert np.array_equal(mended.times_s, truth)


@pytest.mark.parametrize("count", range(5))
def test_too_few_pulses_are_refused(count):
    edges = clean_edges(np.arange(count) * 0.1)
    assert edges.times_s.size == count
    with pytest.raises(AnalysisError, match=f"{count} tacho pulses are too few for a speed; it takes at least 5"):
        speed_from_edges(edges.times_s, 1, 1.0)


def test_a_standing_tacho_has_two_equal_levels():
    levels = LevelFinder(100)
    levels.take(np.full(1000, 2.5))
    assert levels.result() == (2.5, 2.5)
    short = LevelFinder(5000)
    short.take(np.full(1000, 2.5))
    assert short.result() == (2.5, 2.5)
    nothing = LevelFinder(100)
    nothing.take(np.full(1000, np.nan))
    low, high = nothing.result()
    assert not high > low


def test_the_levels_are_those_of_the_stretches_that_move():
    t = np.arange(20 * 1000) / 1000.0
    x = pulse_train(7.0 * t, 1, low=-1.0, high=4.0)
    x[:8000] = -1.0  # stands for eight seconds
    x[12000] = 9.0  # and one disturbance
    levels = LevelFinder(1000)
    levels.take(x)
    assert levels.result() == (-1.0, 4.0)


def test_one_great_disturbance_does_not_decide_the_levels():
    t = np.arange(20 * 1000) / 1000.0
    x = pulse_train(7.0 * t, 1)
    x[12000] = 30.0
    levels = LevelFinder(1000)
    levels.take(x)
    assert levels.result() == (0.0, 5.0)


def test_constant_is_what_varies_less_than_the_tolerance():
    speed = np.linspace(20.0, 21.0, 101)
    profile = SpeedProfile("tacho", "motor", "1/s", np.arange(101.0), speed)
    assert profile.mean == pytest.approx(20.5)
    assert profile.variation == pytest.approx(0.9 / 20.5)
    assert profile.is_constant(0.05) and not profile.is_constant(0.04)


@pytest.mark.parametrize(("si_symbol", "scatter"), [("1/s", 0.0), ("1/s", 0.02), ("m/s", 0.02)])
def test_a_standstill_is_constant(si_symbol, scatter):
    speed = scatter * np.random.default_rng(4).standard_normal(200)
    assert SpeedProfile("speed", None, si_symbol, np.arange(200.0), speed).is_constant(0.03)

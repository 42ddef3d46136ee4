"""A speed channel is averaged over intervals; what is no number is left out."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tdacoustic.speed import SpeedChannelMeter


def averaged(x, rate, cuts=(), **options):
    meter = SpeedChannelMeter(rate, **options)
    for piece in np.split(np.asarray(x, dtype=float), cuts):
        meter.take(piece)
    return meter.result()


def test_a_value_is_the_mean_at_the_middle_of_its_interval():
    rate = 1000.0
    t = np.arange(10000) / rate
    times, speed = averaged(12.0 + 1.6 * t, rate)
    assert times.size == 200
    assert np.allclose(speed, 12.0 + 1.6 * times, atol=1e-9)  # a straight line: mean and middle agree to rounding


def test_a_slow_channel_keeps_its_own_instants():
    times, speed = averaged([5.0, 6.0, 7.0], 10.0)
    assert np.allclose(times, [0.0, 0.1, 0.2]) and speed.tolist() == [5.0, 6.0, 7.0]


def test_intervals_with_missing_values_are_left_out():
    x = np.full(1000, 7.0)
    x[120:130] = np.nan
    times, speed = averaged(x, 1000.0)
    assert times.size == 19 and set(speed) == {7.0}
    assert not np.any(np.isclose(times, 0.1245))
    times, speed = averaged(np.full(1000, np.nan), 1000.0)
    assert times.size == speed.size == 0


def test_a_record_shorter_than_an_interval_gives_one_value():
    times, speed = averaged([1.0, 2.0, 3.0], 1000.0)
    assert speed.tolist() == [2.0] and times[0] == pytest.approx(0.001)


@given(st.lists(st.integers(0, 1000), max_size=6).map(sorted))
def test_any_cut_into_blocks_gives_the_same_values(cuts):
    x = np.random.default_rng(1).standard_normal(1000)
    for whole, pieces in zip(averaged(x, 777.7), averaged(x, 777.7, cuts), strict=True):
        assert np.array_equal(whole, pieces)


def test_the_error_is_no_less_than_that_of_rounding():
    """A straight line in steps of 0.1: its means hardly scatter, and yet lie up to half a step off."""
    meter = SpeedChannelMeter(100.0)
    meter.take(np.round(10.0 + 0.02 * np.arange(2000) / 100.0, 1))
    error = meter.profile("s", None, "m/s").error
    assert error.min() == pytest.approx(0.1 / np.sqrt(12.0), rel=1e-6)


def test_a_channel_that_never_changes_tells_no_error():
    meter = SpeedChannelMeter(100.0)
    meter.take(np.full(2000, 7.3))
    assert meter.profile("s", None, "m/s").error is None

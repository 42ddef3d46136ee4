"""Patterns whose correlation, range and direction are known."""

import math

import numpy as np
import pytest

from tdacoustic.drive import Directivity
from tdacoustic.drive.levels import CIRCLE_DEG
from tdacoustic.drive.patterns import least_alike, pattern_of, pattern_pairs

ANGLE = np.array(CIRCLE_DEG)


def around(value, levels, sweep="speed"):
    return Directivity(sweep, value, ANGLE, np.asarray(levels, dtype=float))


def lobes(depth, turned_deg=0.0, count=1, level=80.0):
    return level + depth * np.cos(count * np.radians(ANGLE - turned_deg))


@pytest.mark.parametrize(
    ("other", "correlation"),
    [
        (lobes(1.0, level=60.0), 1.0),  # height and depth do not matter
        (lobes(3.0, 180.0), -1.0),
        (lobes(3.0, 90.0), 0.0),
        (lobes(3.0, 60.0), 0.5),  # of two cosines of one period: the cosine of the turn
        (lobes(3.0, 0.0, 2), 0.0),
    ],
)
def test_correlation_of_cosines(other, correlation):
    (pair,) = pattern_pairs([around(20.0, lobes(3.0)), around(30.0, other)])
    assert pair.correlation == pytest.approx(correlation, abs=1e-12)  # 72 samples of a cosine are exact
    assert (pair.first, pair.second, pair.both_shaped) == (20.0, 30.0, True)


def test_the_difference_of_two_shapes_is_that_of_their_depths():
    (pair,) = pattern_pairs([around(20.0, lobes(3.0)), around(30.0, lobes(1.0, level=95.0))])
    assert pair.difference_db == pytest.approx(2.0 / math.sqrt(2.0), abs=1e-12)  # rms of a cosine of 2 dB


def test_numbers_of_a_pattern():
    found = pattern_of(around(20.0, lobes(3.0, 270.0)))
    assert (found.loudest_deg, found.quietest_deg) == (270.0, 90.0)
    assert (found.loudest_db, found.quietest_db, found.range_db) == pytest.approx((83.0, 77.0, 6.0), abs=1e-12)
    half = np.where(ANGLE < 180.0, 80.0, 90.0)  # mean of 1e8 and 1e9
    assert pattern_of(around(20.0, half)).mean_db == pytest.approx(10.0 * math.log10(0.5 * (1e8 + 1e9)), abs=1e-9)


def test_a_level_that_is_the_same_all_around_has_no_direction_and_no_correlation():
    flat, shaped = around(20.0, lobes(0.001)), around(30.0, lobes(3.0))
    assert math.isnan(pattern_of(flat).loudest_deg)
    (pair,) = pattern_pairs([flat, shaped])
    assert math.isnan(pair.correlation)
    assert not pair.both_shaped


def test_silence_is_left_out_and_sweeps_are_not_mixed():
    silent = around(20.0, np.full(72, math.nan))
    helix = around(4.0, lobes(3.0), "helix")
    assert math.isnan(pattern_of(silent).mean_db)
    assert pattern_pairs([silent, around(30.0, lobes(3.0)), helix]) == ()


def test_the_least_alike_of_several():
    rows = np.array([lobes(3.0), lobes(2.0, 60.0), lobes(2.0, 30.0), lobes(0.1, 180.0), np.full(72, math.nan)])
    with np.errstate(invalid="ignore"):
        assert least_alike(rows) == pytest.approx(0.5, abs=1e-12)  # the flat one and the silent one do not count
        assert math.isnan(least_alike(rows[3:]))

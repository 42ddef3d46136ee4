"""Patterns whose correlation, range and direction are known."""

import math
import warnings

import numpy as np
import pytest

from tdacoustic.drive import Directivity, DriveModel
from tdacoustic.drive.doubts import circle_doubts
from tdacoustic.drive.levels import CIRCLE_DEG, LevelAt
from tdacoustic.drive.patterns import least_alike, pattern_of, pattern_pairs, range_db
from tdacoustic.drive.prediction import DriveSound

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
    assert least_alike(rows) == pytest.approx(0.5, abs=1e-12)  # the flat one and the silent one do not count
    assert math.isnan(least_alike(rows[3:]))


def test_silence_makes_neither_a_number_nor_a_warning():
    """A direction without sound is minus infinity; no sound at all is NaN."""
    rows = np.array([lobes(3.0), np.full(72, -math.inf), lobes(2.0, 60.0), np.full(72, math.nan)])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert least_alike(rows) == pytest.approx(0.5, abs=1e-12)
        assert math.isnan(least_alike(rows[1:]))
        assert all(math.isnan(range_db(row)) for row in rows[1::2])
        assert math.isnan(pattern_of(around(20.0, rows[1])).range_db)
        assert pattern_pairs([around(20.0, rows[0]), around(30.0, rows[1])]) == ()


# ------------------------------------------------------------------ node planes


def sound_with(level_db, condition="1"):
    return DriveSound(condition, (), (LevelAt("4 m", "total", "Z", level_db),), ())


def test_a_circle_in_a_node_plane_is_told(reference):
    """At 12 m the sphere's mean is that at 4 m less 20 lg 3 = 9.54 dB; the circle's is taken in energy."""
    sphere_db = 90.0 - 20.0 * math.log10(3.0)
    half = np.where(ANGLE < 180.0, sphere_db - 13.0, sphere_db - 60.0)  # half of the energy: 3.01 dB less
    arounds = [
        around(20.0, np.full(72, sphere_db - 5.9)),
        around(30.0, np.full(72, sphere_db - 6.1)),
        around(40.0, half),
        around(50.0, np.full(72, math.nan)),
        around(4.0, np.full(72, sphere_db - 20.0), "helix"),
    ]
    sounds = [sound_with(90.0, name) for name in ("1", "2", "3", "4", "4, 4°")]
    (doubt,) = circle_doubts(reference, sounds, arounds)
    assert doubt.startswith(
        "conditions 2 (6 dB), 3 (16 dB); helix angle 4° (20 dB): the mean level on the circle at 12 m"
    )
    assert list(circle_doubts(reference, sounds[:1], arounds[:1])) == []
    silent = [sound_with(None)]
    assert list(circle_doubts(reference, silent, [around(20.0, np.full(72, math.nan))])) == []


def test_point_sources_have_no_node_plane(reference):
    prediction = DriveModel(reference).evaluate()
    sounds = [*prediction.sound, *(case.sound for case in prediction.helix)]
    assert list(circle_doubts(reference, sounds, prediction.directivity)) == []

"""Shapes of made-up series: margins by hand, from their definitions."""

import math

import numpy as np
import pytest

from tdacoustic.studies.shapes import direction_margin, extreme_margin, shape_margin, shape_of, span_margin

EXACT = 1e-12
"""Sums and differences of a few decibels."""


@pytest.mark.parametrize(
    ("shape", "series", "margin"),
    [
        ("rises_then_falls", [81.3, 84.2, 88.0, 77.3], 2.9 + 0.5),  # the least of its rises; 6.7 and 10.7 in all
        ("rises_then_falls", [60.0, 62.0, 70.0, 69.0, 59.0], 1.0 + 0.5),
        ("rises_then_falls", [70.8, 85.6, 85.0, 92.8, 93.7, 88.5], 0.5 - 0.6),  # the dip from the second to the third
        ("rises_then_falls", [60.0, 70.0, 64.0, 68.0, 62.0], 0.5 - 4.0),  # the bump after the peak is the smaller flaw
        ("rises_then_falls", [62.0, 68.0, 64.0, 70.0, 60.0], 0.5 - 4.0),  # and so is the dip before it
        ("rises_then_falls", [60.0, 60.8, 60.0], 0.8 - 0.5),
        ("rises_then_falls", [60.0, 62.0, 64.0, 70.0], 64.0 - 70.0 - 0.5),  # never falls: by how much it would have to
        ("rises_then_falls", [70.0, 64.0, 62.0, 60.0], 64.0 - 70.0 - 0.5),
        ("rises_then_falls", [60.0, 60.0, 60.0], -0.5),
        ("flat_or_rises_then_falls", [80.0, 80.2, 76.0, 70.0], 0.2 + 0.5),
        ("flat_or_rises_then_falls", [80.0, 79.8, 76.0, 70.0], -0.2 + 0.5),
        ("flat_or_rises_then_falls", [80.0, 78.0, 76.0, 70.0], -2.0 + 0.5),
        ("flat_or_rises_then_falls", [81.2, 79.9, 81.2, 80.0], 0.5 - 1.3),  # up again is not flat
        ("rises", [60.0, 62.0, 61.8], 0.5 - 0.2),
        ("rises", [60.0, 62.0, 65.0], 2.0 + 0.5),
        ("rises", [60.0, 64.0, 62.0, 65.0], 0.5 - 2.0),
        ("rises", [60.0, 60.2], 0.2 - 0.5),
        ("falls", [65.0, 62.0, 60.0], 2.0 + 0.5),
        ("falls", [65.0, 62.0, 63.0, 60.0], 0.5 - 1.0),
        ("falls", [60.0, 62.0, 65.0], -5.5),
        ("flat", [60.0, 60.3, 60.1], 0.5 - 0.3),
        ("flat", [60.0, 63.0], -2.5),
    ],
)
def test_margins_by_hand(shape, series, margin):
    assert float(shape_margin(shape, np.array(series), 0.5)) == pytest.approx(margin, abs=EXACT)


def test_rows_at_once_are_rows_one_by_one():
    rows = np.random.default_rng(1).normal(80.0, 3.0, (5, 4, 6))
    for shape in ("rises", "falls", "flat", "rises_then_falls", "flat_or_rises_then_falls"):
        found = shape_margin(shape, rows, 0.5)
        assert found.shape == (5, 4)
        assert found[2, 3] == pytest.approx(float(shape_margin(shape, rows[2, 3], 0.5)), abs=EXACT)


def test_a_series_with_a_gap_or_too_short_has_no_shape():
    for shape, series in (
        ("rises", [80.0]),
        ("rises_then_falls", [80.0, 81.0]),
        ("flat", []),
        ("falls", [80.0, math.nan]),
    ):
        assert math.isnan(float(shape_margin(shape, np.array(series), 0.5)))
    assert math.isnan(float(shape_margin("rises_then_falls", np.array([80.0, math.nan, 70.0]), 0.5)))


def test_the_shape_of_a_series_by_the_same_margins():
    for shape, series in (
        ("rises", [60.0, 62.0, 61.8, 63.0]),
        ("falls", [65.0, 62.0]),
        ("flat", [60.0, 60.3, 60.1]),
        ("rises_then_falls", [60.0, 64.0, 62.0]),
        (None, [64.0, 60.0, 64.0]),
        (None, [60.0, math.nan, 62.0]),
        (None, [60.0]),
    ):
        assert shape_of(np.array(series), 0.5) == shape


def test_where_the_extremes_are():
    series, at = np.array([70.0, 85.0, 88.0, 77.0]), np.array([False, True, True, False])
    assert float(extreme_margin(series, at, True, 0.0)) == pytest.approx(11.0, abs=EXACT)
    assert float(extreme_margin(series, ~at, False, 0.0)) == pytest.approx(15.0, abs=EXACT)
    assert float(extreme_margin(series, ~at, True, 0.0)) == pytest.approx(-11.0, abs=EXACT)
    tie = np.array([80.0, 80.0])
    assert float(extreme_margin(tie, np.array([True, False]), True, 0.0)) == 0.0  # a tie counts as being there
    assert math.isnan(float(extreme_margin(series, np.zeros(4, dtype=bool), True, 0.0)))
    assert math.isnan(float(extreme_margin(np.array([math.nan, 80.0]), np.array([True, False]), True, 0.0)))


def test_spans_and_directions():
    assert float(span_margin(np.array([77.3, 81.3, 88.0]), 10.0, 2.0)) == pytest.approx(2.0 - 0.7, abs=EXACT)
    assert math.isnan(float(span_margin(np.array([80.0]), 10.0, 2.0)))
    assert float(direction_margin(np.array([350.0, 10.0, 5.0]), 0.0, 22.5)) == pytest.approx(12.5, abs=EXACT)
    assert float(direction_margin(np.array([180.0]), 0.0, 22.5)) == pytest.approx(-157.5, abs=EXACT)
    assert math.isnan(float(direction_margin(np.array([math.nan]), 0.0, 22.5)))

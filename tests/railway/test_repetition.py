"""Runs, spread, rounding, positions, and the printed budget of annex G."""

import math

import pytest

from tdacoustic.errors import AnalysisError
from tdacoustic.railway import (
    ISO_3095_2013,
    ISO_3095_2025,
    decisive,
    expanded_uncertainty_db,
    repetition,
    rounded_db,
    unit_level_db,
)
from tdacoustic.railway.repetition import END_POSITION_LENGTH_M
from tdacoustic.railway.rules import ISO_3381_2021, STANDARDS

TABLE_G2 = (  # correction and standard uncertainty of each input, dB: ISO 3095:2013, table G.2 (phonometry)
    (0.0, 0.14), (0.0, 0.04), (0.0, 0.06), (0.105, 0.06), (0.0, 0.25), (0.0, 0.25), (0.0, 0.46), (0.0, 0.14),
    (0.06, 0.03), (0.0, 0.35), (0.0, 0.06), (0.515, 0.30), (0.0, 0.29),
)  # fmt: skip


def test_the_printed_budget(conformance):
    got = expanded_uncertainty_db(55.0, [row[0] for row in TABLE_G2], [row[1] for row in TABLE_G2])
    source = "standard: ISO 3095:2013, table G.2, as quoted by the program phonometry"
    conformance("level of the printed budget of uncertainty", 55.68, got.level_db, 0.005 + 1e-9, "dB", source)
    conformance("standard uncertainty", 0.83, got.standard_db, 0.005, "dB", source)
    conformance("expanded uncertainty", 1.66, got.expanded_db, 0.01, "dB", source)


def test_the_tolerance_of_the_distance_is_that_of_table_g1(conformance):
    # Half-widths of table G.1: 0.23 dB at 7.5 m and 0.07 dB at 25 m; 20 lg of the tolerance that the rules hold.
    tolerance = ISO_3095_2013.value("position_tolerance_m")
    for distance, half_width in ((7.5, 0.23), (25.0, 0.07)):
        got = 20.0 * math.log10(1.0 + tolerance / distance)
        conformance(
            f"half-width of the distance's tolerance at {distance:g} m",
            half_width,
            got,
            0.005,
            "dB",
            "standard: ISO 3095:2013, table G.1, as quoted by the program phonometry",
        )


def test_three_runs_are_averaged_and_rounded():
    # phonometry's example: left 81.3, 82.1, 81.6 gives 82; right 80.4, 80.9, 81.2 gives 81; the louder side counts.
    left, right = repetition([81.3, 82.1, 81.6], ISO_3095_2013), repetition([80.4, 80.9, 81.2], ISO_3095_2013)
    assert (left.reported_db, right.reported_db, left.valid) == (82, 81, True)
    assert decisive({"left": left, "right": right}) == ("left", 82)
    assert left.spread_db == pytest.approx(0.8)


def test_a_half_goes_up_also_from_below():
    assert rounded_db((70.1 + 70.3 + 71.1) / 3.0) == 71  # binary arithmetic gives 70.49999...
    assert [rounded_db(level) for level in (80.49, 80.5, 80.51, -0.5)] == [80, 81, 81, 0]


def test_runs_too_far_apart_are_not_valid_and_the_odd_one_is_named():
    got = repetition([80.0, 80.4, 84.0], ISO_3095_2013)
    assert not got.valid and got.reported_db is None and got.outliers == (2,)
    assert got.reason == "runs lie 4.0 dB apart, 3 dB are allowed: more runs are needed"
    assert repetition([80.0, 81.5, 83.0], ISO_3095_2013).valid  # exactly 3 dB
    assert repetition([80.1, 81.0, 83.1], ISO_3095_2013).valid  # 3.0 dB in decimals, more in binary
    assert "[not verified against the standard's text]" in repetition([80.0, 80.0, 85.0], ISO_3095_2025).reason
    assert decisive({"a": got}) is None


def test_too_few_runs():
    got = repetition([80.0, 81.0], ISO_3095_2013)
    assert not got.valid and got.reason == "2 of at least 3 runs" and got.mean_db == 80.5
    nothing = repetition([], ISO_3381_2021)
    assert nothing.reason == "no run with a level" and nothing.mean_db is None


def test_a_units_level_weighs_positions_by_their_length():
    assert unit_level_db([60.0, 60.0], [4.0, 11.0]) == pytest.approx(60.0)
    one_part = unit_level_db([70.0, -200.0], [4.0, 12.0])
    assert one_part == pytest.approx(70.0 + 10.0 * math.log10(0.25))
    assert pytest.approx(11.78, abs=0.001) == END_POSITION_LENGTH_M
    with pytest.raises(AnalysisError, match="a length above zero for each level"):
        unit_level_db([60.0], [])


def test_editions_by_name():
    assert sorted(STANDARDS) == ["ISO 3095:2013", "ISO 3095:2025", "ISO 3381:2021"]

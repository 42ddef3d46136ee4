"""Middle, scatter and what stands out, against numbers worked out by hand; levels and verdicts together."""

import datetime
import itertools
import math
import random
import statistics

import pytest
from made_up_results import calibration, fitted, level, made_result, model, quality, stated, verdict

from tdacoustic.gathering import compared, open_result, read_result
from tdacoustic.gathering.identity import identified
from tdacoustic.gathering.levels import band_medians, level_points, year_medians
from tdacoustic.gathering.robust import FALSE_ALARM, spread_of, threshold
from tdacoustic.gathering.speed_bands import band_at, band_width
from tdacoustic.gathering.verdicts import tallies

pytest.importorskip("pyarrow", reason="tables of results are read with pyarrow")


def read(folder, **keys):
    return read_result(open_result(made_result(folder, **keys))).kept


# ---------------------------------------------------------------- whose, and when


@pytest.mark.parametrize(
    ("meta", "started", "expected"),
    [
        ({}, "", ("", None, None, "")),
        ({"train": "185 042"}, "", ("185 042", None, None, "")),
        ({"TRAIN-NUMBER": "7"}, "", ("7", None, None, "")),
        ({"Locomotive": "E", "Vehicle": "V"}, "", ("V", None, None, "")),
        ({"trains": "no", "my train": "no"}, "", ("", None, None, "")),
        ({"Date": "2024-05-01"}, "", ("", datetime.date(2024, 5, 1), 2024, "meta")),
        ({"date": "2024-05-01 23:30:00+02:00"}, "", ("", datetime.date(2024, 5, 1), 2024, "meta")),
        ({"date": "2024-05"}, "", ("", None, 2024, "meta")),
        ({"year": "2019"}, "2024-05-01T10:00:00", ("", None, 2019, "meta")),
        ({"date": "2021-03-04", "year": "2019"}, "", ("", datetime.date(2021, 3, 4), 2021, "meta")),
        ({}, "2024-05-01T10:00:00.25Z", ("", datetime.date(2024, 5, 1), 2024, "log")),
        ({"date": "1.5.2024"}, "", ("", None, None, "")),
        ({"date": "05/01/24"}, "2023-01-01T00:00:00", ("", datetime.date(2023, 1, 1), 2023, "log")),
        ({"date": "2024-02-30"}, "", ("", None, None, "")),
        ({"date": "20240501"}, "", ("", None, None, "")),
        ({"date": "2024-W18-3"}, "", ("", None, None, "")),
        ({"year": "24"}, "", ("", None, None, "")),
        ({"year": "0000"}, "", ("", None, None, "")),
        ({}, "yesterday", ("", None, None, "")),
        ({}, "0001-01-01T00:00:00+14:00", ("", None, None, "")),
    ],
)
def test_train_and_date_are_what_is_said_and_nothing_else(meta, started, expected):
    found = identified(meta, started)
    assert (found.train, found.date, found.year, found.date_from) == expected


def test_other_keys_can_be_named_and_what_cannot_be_read_is_noted():
    found = identified({"Zug": "4711", "train": "x", "Datum": "2020-01-02"}, "", "zug", "DATUM")
    assert (found.train, found.date) == ("4711", datetime.date(2020, 1, 2))
    assert "'1.5.2024'" in identified({"date": "1.5.2024"}, "").note


def test_a_start_is_known_in_utc_only_where_its_offset_is():
    assert identified({}, "2024-05-01T01:00:00+02:00").started == datetime.datetime(
        2024, 4, 30, 23, tzinfo=datetime.UTC
    )
    assert identified({}, "2024-05-01T01:00:00").started is None


# ---------------------------------------------------------------- robust statistics


def test_median_and_scatter_by_hand(conformance):
    """Of 80, 81, 82, 84, 95: median 82; distances 2, 1, 0, 2, 13: median 2; scatter 1.4826 times 2."""
    spread = spread_of([95.0, 80.0, 84.0, 81.0, 82.0], 0.3)
    assert (spread.n, spread.median, spread.mad) == (5, 82.0, 2.0)
    conformance(
        "scatter by the median deviation", 2.9652, spread.scatter, 1e-9, "dB", "analytic: 1.4826 times 2, by hand"
    )
    assert spread.distance(95.0) == pytest.approx(13.0 / 2.9652)


def test_median_and_scatter_of_an_even_number_by_hand():
    """Of 1, 2, 4, 10: median 3; distances 2, 1, 1, 7: median 1.5."""
    spread = spread_of([10.0, 1.0, 4.0, 2.0], 0.0)
    assert (spread.median, spread.mad) == (3.0, 1.5)


def test_equal_values_have_the_floor_as_scatter_and_never_divide_by_nothing():
    assert spread_of([80.0] * 9 + [80.5], 0.3).scatter == 0.3
    nothing = spread_of([80.0] * 9 + [99.0], 0.0)
    assert nothing.distance(99.0) == 0.0
    assert not nothing.stands_out(99.0)


def test_nothing_stands_out_of_four_values():
    assert not spread_of([1.0, 1.0, 1.0, 1e9], 0.1).stands_out(1e9)
    assert threshold(4) == math.inf


@pytest.mark.parametrize("n", [5, 7, 9, 10, 15, 20, 40])
def test_chance_makes_something_stand_out_in_one_group_of_a_hundred_at_most(n):
    """By simulation of normal values; 0.0135 is three standard errors above 0.01 in 8000 groups, and a bit."""
    chance = random.Random(n)
    groups = 8000
    alarms = 0
    for _ in range(groups):
        values = [chance.gauss(0.0, 1.0) for _ in range(n)]
        middle = statistics.median(values)
        scatter = 1.4826 * statistics.median(abs(value - middle) for value in values)
        alarms += max(abs(value - middle) for value in values) > threshold(n) * scatter
    assert 0.3 * FALSE_ALARM < alarms / groups < 0.0135


# ---------------------------------------------------------------- bands


def test_usual_test_speeds_are_never_on_an_edge():
    for width in (5.0, 10.0, 20.0, 40.0):
        for speed in range(10, 301, 10):
            band = band_at(speed, width)
            assert band.low < speed < band.high
            assert band_at(speed - 0.5, width) == band == band_at(speed + 0.5, width)
    assert band_at(0.0, 10.0).low == 0.0


def test_bands_tile_without_gap_or_overlap():
    for width in (5.0, 10.0, 20.0):
        bands = sorted({band_at(0.1 * number, width) for number in range(3000)})
        assert bands[0].low == 0.0
        assert all(left.high == right.low for left, right in itertools.pairwise(bands))


def test_bands_get_wider_when_there_are_many():
    assert band_width([20, 30, 40], 3) == 10.0
    assert band_width(range(10, 90, 10), 4) == 20.0


# ---------------------------------------------------------------- levels at 4 m


def test_the_4_m_level_is_the_energy_mean_over_runs_and_near_receivers_by_hand(tmp_path):
    """80 and 83 dB: 10 lg((1e8 + 1.99526e8) / 2) = 81.754 dB. Another distance, role or bad channel is not in it."""
    rows = [
        level("60", 60.0, 80.0, run="60a"),
        level("60", 60.2, 83.0, run="60b", distance_m=4.19),
        level("60", 60.0, 99.0, run="60a", channel="far", distance_m=4.21),
        level("60", 60.0, 99.0, run="60a", channel="near", role="near_field"),
        level("60", 60.0, 99.0, run="60a", channel="unknown", distance_m=None),
        level("60", 60.0, 99.0, run="60c"),
        level("60", 60.0, 99.0, run="60d"),
    ]
    checks = [quality("60c", "mic", "clipping", "bad"), quality("60d", None, "speed", "bad"), quality("60a")]
    kept = read(tmp_path / "r", levels=rows, dominance=[verdict("60", 60.1)], quality=checks)
    (row,) = kept.conditions
    assert row.level_4m_db == pytest.approx(81.754, abs=5e-4)
    assert (row.levels, row.train_speed_km_h, row.level_from, row.speed_from) == (2, 60.1, "recorded", "run")
    assert (kept.runs, kept.runs_bad, kept.runs_warned) == (3, 2, 0)


def test_the_weakest_correction_is_the_levels(tmp_path):
    rows = [level("a", 30.0, 80.0), level("a", 30.0, 80.0, run="b", correction="impossible")]
    kept = read(tmp_path / "r", levels=rows, dominance=[verdict("a", 30.0)])
    assert kept.conditions[0].correction == "impossible"


def test_stated_levels_stand_apart_and_are_printed_in_a_synthetic_campaign(tmp_path):
    keys = {"levels": [level("3", 40.0, 85.0), stated(1, "3", 88.3)], "dominance": [verdict("3", 40.0)]}
    rows = read(tmp_path / "r", origin="synthetic", **keys).conditions
    assert [(row.level_from, row.level_origin, row.dominant) for row in rows] == [
        ("recorded", "synthetic", "motor"),
        ("stated", "printed", ""),
    ]
    assert rows[1].level_4m_db == 88.3


def test_a_stated_level_has_the_speed_of_the_fleets_condition_of_that_name(tmp_path):
    keys = {"levels": [stated(1, "3", 88.3)], "dominance": [verdict("3", None, "undecided", None)]}
    (row,) = read(tmp_path / "r", origin="printed", conditions=[model("3", 40.0, 84.6)], **keys).conditions
    assert (row.train_speed_km_h, row.speed_from, row.model_4m_db, row.mode) == (40.0, "fleet", 84.6, "traction")


def test_medians_over_speed_and_years_by_hand(tmp_path):
    results = []
    for number, (year, value) in enumerate(
        [("2019", 80.0), ("2019", 82.0), ("2019", 90.0), ("2021", 84.0), ("", 85.0)]
    ):
        meta = {"year": year} if year else {"note": ""}
        keys = {"levels": [level("a", 39.0 + number, value)], "dominance": [verdict("a", 39.0 + number)]}
        results.append(read(tmp_path / str(number), name=str(number), meta=meta, **keys))
    points = level_points(results, "measured")
    (band,) = band_medians(points, 10.0)
    assert (band.level_db, band.speed_km_h, band.n, band.band.words) == (84.0, 41.0, 5, "35–45")
    assert (band.low_db, band.high_db) == pytest.approx(
        (80.8, 88.0)
    )  # tenths between 5 values: 0.4 of a step from the end
    assert year_medians(points) == [(2019.5, 82.0), (2021.5, 84.0)]
    assert level_points(results, "synthetic") == []


# ---------------------------------------------------------------- what stands out


def campaigns(folder, values, **keys):
    """Results with one level each at 40 km/h."""
    return [
        read(
            folder / f"{keys.get('name', 'c')}{i}",
            levels=[level("a", 40.0, value)],
            dominance=[verdict("a", 40.0)],
            **{**keys, "name": f"{keys.get('name', 'c')}{i}"},
        )
        for i, value in enumerate(values)
    ]


PLAIN = [84.0, 85.0, 85.5, 86.0, 84.5, 85.2, 84.8, 85.9, 84.2, 85.7]
"""Median 85.1, distances 1.1 0.1 0.4 0.9 0.6 0.1 0.3 0.8 0.9 0.6: median 0.6, scatter 0.8896 dB."""


def test_a_planted_level_is_found_and_no_other(tmp_path):
    results = campaigns(tmp_path, [*PLAIN, 97.0])
    found = compared(results)
    assert (found.groups, found.values, found.small_groups) == (1, 11, 0)
    (outlier,) = found.outliers
    assert outlier.result is results[-1]
    assert outlier.spread.median == 85.2  # the sixth of eleven
    assert outlier.distance == pytest.approx((97.0 - 85.2) / (1.4826 * 0.7), rel=1e-9)


def test_a_group_without_one_has_none(tmp_path):
    assert compared(campaigns(tmp_path, PLAIN)).outliers == ()


def test_origins_fleets_speeds_and_modes_are_never_mixed(tmp_path):
    """A level that stands out of the measured ones may be usual of synthetic ones, at another speed or mode."""
    results = campaigns(tmp_path / "m", PLAIN)
    others = [
        *campaigns(tmp_path / "s", [97.0] * 3, origin="synthetic", name="s"),
        *campaigns(tmp_path / "f", [97.0] * 3, fleet="Fleet B", name="f"),
        *campaigns(tmp_path / "n", [97.0] * 3, fleet="", name="n"),
        read(tmp_path / "v", name="v", levels=[level("a", 46.0, 97.0)], dominance=[verdict("a", 46.0)]),
        read(
            tmp_path / "b",
            name="b",
            levels=[level("a", 40.0, 97.0)],
            dominance=[verdict("a", 40.0)],
            conditions=[model("a", 40.0, mode="brake")],
        ),
        read(tmp_path / "p", name="p", levels=[stated(1, "a", 97.0)], dominance=[verdict("a", 40.0)]),
        read(
            tmp_path / "i",
            name="i",
            levels=[level("a", 40.0, 97.0, correction="impossible")],
            dominance=[verdict("a", 40.0)],
        ),
    ]
    found = compared([*results, *others])
    assert found.outliers == ()
    assert (found.groups, found.values, found.small_groups, found.without_fleet) == (1, 10, 4, 3)


def of_parameter(folder, number, **keys):
    files = {"calibration.json": calibration({"masuda.constant_db": fitted(**keys)}, keys.pop("doubts", ()))}
    return read(folder / str(number), name=f"c{number}", files=files)


def test_a_planted_parameter_is_found_unless_its_own_interval_holds_the_median(tmp_path):
    usual = [of_parameter(tmp_path / "u", i, value=v, low=v - 1, high=v + 1) for i, v in enumerate(PLAIN)]
    sure = of_parameter(tmp_path / "x", 1, value=99.0, low=97.0, high=101.0)
    unsure = of_parameter(tmp_path / "x", 2, value=98.0, low=80.0, high=120.0)
    found = compared([*usual, sure, unsure])
    assert [outlier.result for outlier in found.outliers] == [sure]


def test_values_on_a_bound_or_undetermined_do_not_count(tmp_path):
    usual = [of_parameter(tmp_path / "u", i, value=v, low=v - 1, high=v + 1) for i, v in enumerate(PLAIN)]
    stuck = [of_parameter(tmp_path / "s", i, value=60.0) for i in range(9)]
    open_ended = [of_parameter(tmp_path / "o", i, value=20.0, low=10.0) for i in range(9)]
    tied = [of_parameter(tmp_path / "t", i, value=20.0, low=19.0, high=21.0, expression="a * 2") for i in range(9)]
    found = compared([*usual, *stuck, *open_ended, *tied])
    assert (found.groups, found.values, found.left_out_parameters) == (1, 10, 18)
    states = [result.parameters[0].state for result in (usual[0], stuck[0], open_ended[0], tied[0])]
    assert states == ["determined", "on a bound", "undetermined", "tied"]


def test_a_calibrations_own_word_puts_a_value_on_its_bound_and_doubts_are_of_their_parameter(tmp_path):
    doubts = [
        "masuda.constant_db ended on its bound 60: the optimum may lie beyond it",
        "masuda.constant_db_more is something else",
        "masuda.constant_db and motor.gain are correlated by +0.98: each hides the other",
    ]
    files = {"calibration.json": calibration({"masuda.constant_db": fitted(59.998, 59.0, 59.999)}, doubts)}
    (value,) = read(tmp_path / "r", files=files).parameters
    assert value.state == "on a bound"
    assert value.doubt == f"{doubts[0]}; {doubts[2]}"


# ---------------------------------------------------------------- verdicts


def test_verdicts_are_counted_by_speed_and_what_says_nothing_is_none(tmp_path):
    rows = [
        [verdict("a", 20.0, "motor", 0.95), verdict("b", 60.0, "gearbox", 0.99), verdict("c", None, "motor", 0.99)],
        [
            verdict("a", 21.0, "motor", 0.99),
            verdict("b", 60.0, "undecided", 0.6),
            verdict("d", 80.0, "undecided", None),
        ],
    ]
    results = [read(tmp_path / str(i), name=str(i), dominance=held) for i, held in enumerate(rows)]
    found = {band.words: tally for band, tally in tallies(results, 10.0).items()}
    assert list(found) == ["15–25", "55–65"]
    assert (found["15–25"].words, found["15–25"].confidence, found["15–25"].majority) == (
        (("motor", 2),),
        (0.95, 0.99),
        "motor",
    )
    assert (found["55–65"].words, found["55–65"].majority) == ((("gearbox", 1), ("undecided", 1)), "")

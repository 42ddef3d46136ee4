"""The study of contributions over coherence: whether its record is of these sources, and what it must hold."""

import pytest
from studies import study_module

RERUN = "python tests/evidence/contributions_study.py"
BOTH = pytest.mark.parametrize("seeds", ["three_states", "held_out"])


@pytest.fixture(scope="module")
def study():
    with study_module("contributions_study", "../contributions") as module:
        yield module


@pytest.fixture(scope="module")
def record(study):
    return study.record()


def test_the_record_is_of_these_sources(study, record):
    assert record["sources_sha256"] == study.sources(), f"the record is stale: {RERUN}"


@BOTH
def test_the_flag_is_raised_before_the_error_exceeds_three_decibels(record, conformance, seeds):
    """Of contributions stated as known, 0.1 to 0.99 of coherence, one in a hundred at most; plain paths beside them."""
    table = record[seeds]
    wrong = sum(row["ok_over_3_db"] for row in table) / sum(row["ok"] * row["n"] for row in table)
    conformance(
        f"share of the contributions stated as known that are off by more than 3 dB, {seeds}",
        0.0,
        wrong,
        0.01,
        "1",
        "known input: simulated drives, tests/evidence/contributions_study.py",
    )
    for row in table:
        if row["ok"] > 0.05:
            what = f"{row['kind']}, coherence {row['asked']:g}, 95 % of the errors, {seeds}"
            conformance(
                what,
                0.0,
                row["ok_95_db"],
                1.5,
                "dB",
                "known input: simulated drives, tests/evidence/contributions_study.py",
                "half of the 3 dB beyond which a contribution counts as wrong",
            )
        if row["coherence"] > 0.85:
            assert row["plain_95_db"] > 10.0
        if row["coherence"] > 0.98:
            assert row["ok"] == 0.0


@BOTH
def test_intervals_of_what_is_known_hold_the_truth(record, seeds):
    """95 % of them, over all drives; bands of one drive are not independent."""
    table = [row for row in record[seeds] if row["ok_inside"] is not None]
    inside = sum(row["ok_inside"] * row["ok"] * row["n"] for row in table) / sum(row["ok"] * row["n"] for row in table)
    assert 0.92 < inside < 0.99


@BOTH
def test_what_is_known_is_of_use(record, seeds):
    for row in record[seeds]:
        if row["coherence"] < 0.35:
            assert row["ok"] > 0.5, (row["kind"], row["coherence"])


def test_states_that_tell_nothing_claim_next_to_nothing(record):
    for table in ("one_state", "alike_states"):
        for row in record[table]:
            assert row["ok"] < 0.06
            assert row["ok_over_3_db"] == 0


def test_a_single_source_is_nobodys(record):
    for row in record["one_source"].values():
        assert row["ok"] == 0.0
        assert row["refused"] > 0.95


def test_a_source_without_a_reference_is_held_as_far_as_stated(record):
    """At 20 dB below the references nothing is wrong; at 10 dB little; as strong as they are, no flag can tell."""
    assert record["unreferenced"]["-20 dB"]["ok_over_3_db"] == 0
    tenth = record["unreferenced"]["-10 dB"]
    assert tenth["ok_over_3_db"] < 0.03 * tenth["ok"] * tenth["n"]
    assert record["unreferenced"]["0 dB"]["ok_over_3_db"] > 0


def test_noise_that_is_known_is_taken_off(record):
    half, high = record["rules"]["0.5"], record["rules"]["0.95"]
    assert half["noise_floor"]["ok_median_db"] < 0.5 * half["none"]["ok_median_db"]
    assert half["noise_floor"]["ok_inside"] > 0.9 > half["none"]["ok_inside"]
    assert high["noise_floor"]["ok"] == 0.0

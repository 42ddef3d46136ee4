"""The study of speed from lines: whether its record is of these sources, what it must hold, and a few seeds again."""

import pytest
from studies import study_module

RERUN = "python tests/evidence/tacholess_study.py --rows rows.jsonl --record"


@pytest.fixture(scope="module")
def study():
    with study_module("tacholess_study") as module:
        yield module


@pytest.fixture(scope="module")
def record(study):
    return study.record()


def test_the_record_is_of_these_sources(study, record):
    assert record["sources_sha256"] == study.sources(), f"the record is stale: {RERUN}"


@pytest.mark.parametrize("start", ["unknown", "known"])
def test_speeds_that_are_found_are_right(record, start, conformance):
    """200 run-ups nobody looked at when the thresholds were set."""
    got = record[start]
    assert got["runs"] == 200
    source = "known input: 200 run-ups of known speed, tests/evidence/tacholess_study.py"
    wrong = got["wrong_harmonic"] / got["found"]
    few = "chance of a few among 200 runs"
    conformance(f"share of wrong harmonics, start {start}", 0.0, wrong, 0.02, "1", source, few)
    conformance(f"rms speed error, all runs, start {start}", 0.0, got["rms_all"], 0.003, "1", source)
    conformance(f"rms speed error, median run, start {start}", 0.0, got["rms_median"], 5e-4, "1", source)
    refused = "a run whose speed cannot be told is left out, by design: one in five at most"
    share = got["found"] / got["runs"]
    conformance(f"share of runs whose speed is found, start {start}", 1.0, share, 0.2, "1", source, refused)


@pytest.mark.parametrize("start", ["unknown", "known"])
def test_a_confidence_promises_no_more_than_it_keeps(record, start):
    """Of the frames of each class at least as many are right as its lower end says, less 0.05 for chance."""
    for low, _, frames, right in record[start]["confidence"]:
        assert frames > 100 and right >= low - 0.05


def test_a_silent_drive_has_no_speed(record):
    """40 runs with tones, resonances and floor, and no order."""
    assert record["silent"]["runs"] == 40 and record["silent"]["found"] <= 1


def test_a_plain_tracker_does_worse(record):
    plain = record["plain"]
    assert plain["wrong_harmonic"] > 5 * max(1, plain["same_runs_wrong_harmonic"])


@pytest.mark.parametrize("seed", [3000, 3001, 3002])
def test_a_few_seeds_again(study, seed):
    """The harmonic is right, and the error of the record's order (its largest run is 1e-2)."""
    run = study.run_up(seed)
    for got in study.read_twice(run, seed).values():
        scores = study.scored(run, got)
        assert scores["found"] and not scores["harmonic"] and scores["rms"] < 5e-3

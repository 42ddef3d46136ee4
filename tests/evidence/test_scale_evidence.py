"""The study of scale: whether its record is of these sources, what it must hold, and a few campaigns again."""

import sys

import pytest
from studies import study_module

RERUN = "python tests/evidence/scale_study.py --campaigns 200 --kills 50 --record"


@pytest.fixture(scope="module")
def study():
    with study_module("scale_study") as module:
        yield module


@pytest.fixture(scope="module")
def record(study):
    return study.record()


@pytest.fixture(scope="module")
def found(record):
    return record["results"]


def test_the_record_is_of_these_sources(study, record):
    assert record["schema"] == study.SCHEMA and record["commit"] and record["versions"]["numpy"]
    assert record["sources_sha256"] == study.sources(), f"the record is stale: {RERUN}"


def test_the_record_is_of_several_campaigns_and_kills(found):
    assert found["campaigns"] >= 200 and found["killed"]["parent"] + found["killed"]["worker"] >= 50
    assert min(found["killed"]["parent"], found["killed"]["worker"]) >= 10


@pytest.mark.parametrize("workers", ["1", "2"])
def test_nothing_is_done_twice(found, workers):
    part = found["workers"][workers]
    assert part["second_of_first"] <= 0.02
    assert part["unchanged"] == found["campaigns"] and part["same_files_after"]
    assert found["workers"]["2"]["again_computed"] == 0


def test_memory_is_bounded(study, found):
    from tdacoustic.workflows.run_many_workers import WORKER_BYTES

    for part in found["workers"].values():
        assert part["peak_mib"]["worker"] and max(part["peak_mib"]["worker"]) << 20 <= WORKER_BYTES
        assert max(part["peak_mib"]["parent"]) <= 256


def assert_nothing_is_lost(told, n_campaigns):
    assert told["files"] > 5 * n_campaigns and told["files_that_differ"] == [] and told["keys_that_differ"] == 0
    assert told["unchanged_at_the_end"] == n_campaigns and told["code_at_the_end"] == 0


def assert_that_run_alone(told, n_campaigns):
    assert told["code"] == 0 and told["campaigns_done"] == 1 and told["campaigns_unchanged"] == n_campaigns - 1
    assert 0 < told["steps_that_rest_on_the_log"] == told["steps_computed"] < told["steps_of_the_campaign"]
    assert told["the_same_steps"]


def test_nothing_is_lost(found):
    assert_nothing_is_lost(found["killed"], found["campaigns"])
    assert found["one_and_more_workers_differ_in"] == 0


def test_one_byte_costs_what_rests_on_it(found):
    assert_that_run_alone(found["changed"], found["campaigns"])


def test_the_documents_have_the_figures_of_the_record(study, record):
    with study_module("scale_words") as words:
        for name, paths in words.PLACES.items():
            for path in paths:
                text = path.read_text(encoding="utf-8")
                assert words.with_table(text, name, record) == text, f"{path.name}: {RERUN}"


@pytest.fixture(scope="module")
def again(study, tmp_path_factory):
    if not sys.platform.startswith("linux"):
        pytest.skip("looks at processes through /proc")
    scratch = tmp_path_factory.mktemp("scale").resolve()
    study.make_campaigns(scratch / "campaigns", 3)
    return scratch, study.timed(scratch, 2)


def test_a_few_campaigns_again(again):
    _, part = again
    assert part["unchanged"] == 3 and part["again_computed"] == 0 and part["same_files_after"]
    assert part["steps_computed"] >= part["steps_kept"] > 0
    assert 1 <= len(part["peak_mib"]["worker"]) <= 3  # two workers, and the tracker of what they share


def test_a_few_kills_again(study, again):
    scratch, part = again
    told = study.killed(scratch, 2, scratch / "workers-2", max(0.5, part["first_s"] / 3.0))
    assert told["parent"] + told["worker"] == 2
    assert_nothing_is_lost(told, 3)


def test_one_byte_again(study, again):
    scratch, _ = again
    assert_that_run_alone(study.changed(scratch, scratch / "workers-2"), 3)


def test_the_store_is_measured(study, tmp_path):
    part = study.measured_store(tmp_path / "store", 300, 30)
    assert part["files"] == 300 and part["is_there_us"] > 0.0
    assert study.measured_notes(tmp_path / "notes", 50, 10)["look_up_us"] > 0.0
    assert study.measured_book(100)["bytes_of_one"] > 100
    assert study.measured_sweep(tmp_path / "one", 50, 5)["sweep_us"] > 0.0


def test_a_result_is_found_up_to_date(study, again):
    assert study.measured_checks(again[0] / "workers-2") > 0.0

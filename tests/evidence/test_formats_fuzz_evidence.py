"""The record of the longer fuzzing: well-formed, of these sources, and without an ending that nobody answered for."""

import pytest
from studies import study_module

RERUN = "python tests/evidence/formats_fuzz.py --seconds 120 --only {}"


@pytest.fixture(scope="module")
def study():
    with study_module("formats_fuzz") as module:
        yield module


@pytest.fixture(scope="module")
def found(study):
    return study.record()


def formats():
    from tdacoustic.formats import FORMATS

    return [row.name for row in FORMATS]


def test_the_record_is_well_formed(study, found):
    assert found["schema"] == study.SCHEMA and found["commit"] and found["versions"]["atheris"] != "absent"
    for name, row in found["formats"].items():
        assert set(row) == {
            "seeds", "seconds", "executions", "coverage", "features", "corpus", "peak_rss_mb", "slowest_unit_s",
            "endings", "sources_sha256",
        }, name  # fmt: skip
        assert row["executions"] > 1000 and row["coverage"] > 50 and row["corpus"] >= row["seeds"] - 1, name
        peak_mb = study.MOST_MB + 100 if row["endings"] else 400  # what ended a run had all that it was let have
        assert row["peak_rss_mb"] < peak_mb and row["slowest_unit_s"] <= study.MOST_S, name
    for row in found["fixed"]:
        assert set(row) == {"format", "defect", "mended"}


@pytest.mark.parametrize("name", formats())
def test_the_record_is_of_these_sources(study, found, name):
    if name == "dewesoft" and name not in found["formats"]:
        pytest.skip("nothing but Dewesoft writes its files: there is nothing to begin with")
    assert name in found["formats"], f"never fuzzed: {RERUN.format(name)}"
    assert found["formats"][name]["sources_sha256"] == study.sources_of(name), f"stale: {RERUN.format(name)}"


@pytest.mark.parametrize("name", formats())
def test_no_exception_of_ours_ended_a_run(found, name):
    """What is left are the ends that C libraries make: those are in README.md with their figures."""
    endings = found["formats"].get(name, {"endings": {}})["endings"]
    assert not [words for words in endings if not words.startswith("libFuzzer: ")], endings

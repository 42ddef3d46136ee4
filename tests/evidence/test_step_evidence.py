"""The STEP study: whether its record is of these sources, and what it must hold."""

import pytest
from studies import study_module

RERUN = "python tests/evidence/step_study.py"


@pytest.fixture(scope="module")
def study():
    with study_module("step_study", "housing") as module:
        yield module


@pytest.fixture(scope="module")
def record(study):
    return study.record()


def test_the_record_is_of_these_sources(study, record):
    """Who changes a module of STEP files runs the study again."""
    assert record["sources_sha256"] == study.sources(), f"the record is stale: {RERUN}"


def test_a_step_housing_that_is_the_parametric_box_has_its_modes(record):
    """Within 1 %: both grids come from above, each within 0.8 % of a finer one (housing_record.json)."""
    assert record["natural_modes"]["box"] == pytest.approx(record["natural_modes"]["step"], abs=1)
    assert record["modes_off_percent"]["worst"] < 1.0
    assert record["modes_off_percent"]["median"] < 0.3


def test_and_its_levels(record):
    """Within 0.5 dB of the mean over the 4 m surface, condition by condition and path by path."""
    assert len(record["conditions"]) == 6
    for state in record["conditions"]:
        for path, off in state["off_db"].items():
            assert off is None or abs(off) < 0.5, (state["condition"], path)
    assert record["fine_axis_off_db"]["rms"] < 0.5

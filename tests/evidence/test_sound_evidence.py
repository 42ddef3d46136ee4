"""The study of the drive's sound: whether its record is of these sources, and what it must hold."""

from pathlib import Path

import numpy as np
import pytest
from studies import study_module

HERE = Path(__file__).parent
RERUN = "python tests/evidence/sound_study.py"


@pytest.fixture(scope="module")
def study():
    with study_module("sound_study") as module:
        yield module


@pytest.fixture(scope="module")
def record(study):
    return study.record()


def test_the_record_is_of_these_sources(study, record):
    assert record["sources_sha256"] == study.sources(), f"the record is stale: {RERUN}"


def test_levels_over_elements_a_wavelength(study, record):
    """Physics.md, section 8: 7.5 elements a wavelength stay within 0.35 dB, 11 within 0.1 dB."""
    rows = {row["elements_per_wavelength"]: row for row in record["elements"]}
    finest = rows[study.ELEMENTS[-1]]
    for elements, band in ((7.5, 0.35), (11.0, 0.1)):
        for path in study.PATHS:
            apart = study.largest(rows[elements][path], finest[path])
            assert abs(apart) <= band, f"{path} at 4 m, {elements:g} elements a wavelength, worst condition"


def test_levels_over_the_number_of_modes(study, record):
    kept = next(row for row in record["modes"] if row["corrected"])
    apart = {
        row["reach"]: study.largest(row["structure"], kept["structure"])
        for row in record["modes"]
        if not row["corrected"]
    }
    assert apart[1.2] < 0.5
    assert apart[1.2] <= apart[0.8]


def test_vectors_are_what_direct_solutions_give(record):
    assert len(record["direct"]) > 10
    apart = np.array([row["db"] - row["direct"] for row in record["direct"]])
    assert float(np.abs(apart).max()) <= 0.2

"""The study of a plate's transmission loss: whether its record is of these sources, and what it must hold."""

import numpy as np
import pytest
from studies import study_module

RERUN = "python tests/evidence/cavity_study.py"


@pytest.fixture(scope="module")
def study():
    with study_module("cavity_study") as module:
        yield module


@pytest.fixture(scope="module")
def record(study):
    return study.record()


def test_the_record_is_of_these_sources(study, record):
    assert record["sources_sha256"] == study.sources(), f"the record is stale: {RERUN}"


def test_a_limp_wall_follows_the_mass_law(record, conformance):
    """One of this size, in each band; and without end at field incidence, where small walls lie above it."""
    found, finite = np.array(record["limp_db"]), np.array(record["limp_finite_db"])
    worst = float(np.abs(found - finite).max())
    conformance(
        "sound reduction of a limp wall, 250 to 1000 Hz, worst band",
        0.0,
        worst,
        1.0,
        "dB",
        "analytic: mass law of a limp wall of this size, plane waves",
        "few modes of a small cavity in a band: its field is not diffuse",
    )
    octaves = np.log2(np.array(record["bands_hz"][: len(found)]))
    slope = float(np.polyfit(octaves, found, 1)[0])
    own = float(np.polyfit(octaves, finite, 1)[0])
    conformance(
        "sound reduction of a limp wall, rise",
        own,
        slope,
        0.5,
        "dB/octave",
        "analytic: mass law of a limp wall of this size, plane waves",
    )
    above = found - np.array(record["limp_infinite_db"])
    assert above.min() > 0.0 and above.max() < 3.0


def test_steel_has_its_dip_at_coincidence(record, conformance):
    """12 mm: c²/(2π) √(m/D) = 997 Hz; above it the infinite plate's law, rising by some 9 dB an octave."""
    bands, found = np.array(record["bands_hz"]), np.array(record["steel_db"])
    conformance(
        "dip of the sound reduction of 12 mm of steel",
        1000.0,
        float(bands[found.argmin()]),
        1.0,
        "Hz",
        "analytic: coincidence at c²/(2 pi) sqrt(m/D) = 997 Hz, its third octave",
    )
    assert record["coincidence_hz"] == pytest.approx(996.9, abs=0.1)
    above = bands > 1500.0
    worst = float(np.abs(found - np.array(record["steel_infinite_db"]))[above].max())
    conformance(
        "sound reduction of 12 mm of steel, 1600 and 2000 Hz, worst",
        0.0,
        worst,
        0.5,
        "dB",
        "analytic: thin infinite plate at field incidence",
    )
    limp = np.array(record["limp_db"])
    assert found[bands == 1000.0][0] < limp[-1] - 15.0

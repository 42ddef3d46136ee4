"""Fleets that these tests share."""

from pathlib import Path

import pytest

from tdacoustic.fleet import load_fleet

CALIBRATION = Path(__file__).resolve().parents[2] / "calibration"


@pytest.fixture(scope="session")
def reference():
    return load_fleet(CALIBRATION / "reference-drive")

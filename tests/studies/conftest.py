"""Fleets that these tests share."""

import pytest
from plain_fleets import plain_fleet

from tdacoustic.fleet import load_fleet


@pytest.fixture(scope="session")
def reference():
    return load_fleet(plain_fleet("reference-drive"))

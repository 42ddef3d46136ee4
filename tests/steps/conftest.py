"""The steps that these tests run, on the import path: a spawned worker has to find them."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # for sample_steps: pytest's importlib mode adds no folder

from tdacoustic.steps import Store


@pytest.fixture
def store(tmp_path):
    return Store(tmp_path / "store")

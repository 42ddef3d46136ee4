"""Where the real recordings are, and the makers of small logs on the import path."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # for log_makers: pytest's importlib mode adds no folder


@pytest.fixture
def recordings() -> Path:
    folder = Path(__file__).parents[3] / "shared" / "recordings"
    if not folder.is_dir():
        pytest.skip("the real recordings are not beside this checkout")
    return folder

import os
import shutil
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # for guides: pytest's importlib mode adds no folder


@pytest.fixture(scope="session")
def store(tmp_path_factory):
    """A store of intermediate results, as on a fresh machine; skips where there is no bash to run a guide."""
    if os.name != "posix" or shutil.which("bash") is None:
        pytest.skip("the guides' commands are run by bash, which is not here")
    return tmp_path_factory.mktemp("store")

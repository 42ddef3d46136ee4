"""Studies of tests/evidence as modules: they stand outside of any package."""

import importlib
import sys
from contextlib import contextmanager
from pathlib import Path

HERE = Path(__file__).parent


@contextmanager
def study_module(name, *beside):
    """Import a module of tests/evidence, with other folders of the tests on the import path while it is used."""
    folders = [str(HERE / folder) for folder in ("evidence", *beside)]
    sys.path[:0] = folders
    try:
        yield importlib.import_module(name)
    finally:
        for folder in folders:
            sys.path.remove(folder)

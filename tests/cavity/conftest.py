"""The walls of these tests on the import path."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # for cavity_walls: pytest's importlib mode adds no folder

"""The boxes and plates of these tests on the import path."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # for reference_housing, plates: pytest's importlib mode adds no folder

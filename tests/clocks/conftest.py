"""The maker of two recorders on the import path."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # for two_recorders: pytest's importlib mode adds no folder

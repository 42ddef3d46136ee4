"""The makers of small campaigns on the import path."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # for small_campaigns: pytest's importlib mode adds no folder

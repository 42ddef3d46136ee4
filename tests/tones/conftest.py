"""The printed examples and the made-up signals on the import path."""

import sys
from pathlib import Path

sys.path.insert(
    0, str(Path(__file__).parent)
)  # for printed_examples, tones_in_noise: pytest's importlib mode adds none

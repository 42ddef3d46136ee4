"""One row a way in which a log is broken, and what has to come of it.

Each format's rows stand in ``faults_<format>.py`` beside this file, as ``FAULTS``.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

NOT_HELD = -1.0


@dataclass(frozen=True)
class Fault:
    """A broken log.

    Parameters
    ----------
    name : str
        What is broken, in words; unique within its format.
    make : callable
        Writes the log into a folder and returns its path.
    outcome : str
        ``"refused"``: a `FormatError` (or kin) when scanned or read. ``"flagged"``: read, with a flag on the log or on
        a channel. ``"read"``: read as if nothing were wrong, because nothing that matters is.
    says : str
        Regular expression that the error's message, or one of the flags, has to match. Empty for ``"read"``.
    values : ndarray, shape (channels, n), or None
        What reading has to give, where it is not refused; None where only the outcome is held.
    tolerance : float
        Largest difference of a value, NaN equal to NaN.
    rate_hz : float or None
        Sampling rate that every channel has to have, None where it must not be known; `NOT_HELD` where either will do.
    """

    name: str
    make: Callable[[Path], Path]
    outcome: Literal["refused", "flagged", "read"]
    says: str = ""
    values: np.ndarray | None = None
    tolerance: float = 0.0
    rate_hz: float | None = NOT_HELD

"""The running median along the lines of a map: what a line is beside."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

__all__ = ["beside"]

Array = NDArray[np.float64]

EVERY: Final = 10
"""Lines between two medians; those between are straight."""


def beside(level: Array, width: int = 41) -> Array:
    """Return the running median along the last axis, of the same shape; the ends are held.

    Parameters
    ----------
    level : ndarray, shape (n_rows, n_lines)
    width : int
        Lines of a median, odd.

    Examples
    --------
    >>> level = np.zeros((1, 100)); level[0, 50] = 20.0
    >>> float(beside(level, 9).max())
    0.0
    """
    half, count = width // 2, level.shape[1]
    padded = np.pad(level, ((0, 0), (half, half)), mode="edge")
    at = np.unique(np.append(np.arange(0, count, EVERY), count - 1))
    windows = np.lib.stride_tricks.sliding_window_view(padded, width, axis=1)[:, at]
    medians = np.partition(windows, half, axis=2)[..., half]  # a third of the time of np.median
    medians[np.isnan(windows).any(axis=2)] = np.nan
    place = np.arange(count)
    return np.array([np.interp(place, at, row) for row in medians])

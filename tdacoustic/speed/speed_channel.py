"""Speed from a channel that carries it as a value."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["SpeedChannelMeter"]

Array = NDArray[np.float64]


class SpeedChannelMeter:
    """Averages a speed channel over intervals, block by block.

    Parameters
    ----------
    sample_rate_hz : float
    interval_s : float
        Time between two values of the result.
    """

    def __init__(self, sample_rate_hz: float, interval_s: float = 0.05) -> None:
        self._rate_hz = sample_rate_hz
        self._size = max(1, round(interval_s * sample_rate_hz))
        self._pending = np.zeros(0)
        self._means: list[Array] = []

    def take(self, values: Array) -> None:
        """Add samples, shape (n,), in order."""
        data = np.concatenate((self._pending, values))
        whole = data.size - data.size % self._size
        if whole:
            self._means.append(data[:whole].reshape(-1, self._size).mean(axis=1))
        self._pending = data[whole:]

    def result(self) -> tuple[Array, Array]:
        """Return times after the first sample in s, and the mean speed around each; intervals with NaN left out."""
        means = np.concatenate(self._means) if self._means else np.zeros(0)
        size = self._size
        if means.size == 0 and self._pending.size:
            size, means = self._pending.size, np.array([self._pending.mean()])
        times = (np.arange(means.size, dtype=np.float64) * size + 0.5 * (size - 1)) / self._rate_hz
        finite = np.isfinite(means)
        return times[finite], np.asarray(means[finite], dtype=np.float64)

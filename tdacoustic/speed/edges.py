"""Edges of tacho pulses: levels of the pulse train, and the instants at which it crosses them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["EdgeFinder", "LevelFinder"]

Array = NDArray[np.float64]

HYSTERESIS = 0.2
"""Distance of the two thresholds from the middle, over the pulse height."""


class LevelFinder:
    """Finds the low and the high level of a pulse train: medians of the extremes of short stretches.

    Parameters
    ----------
    stretch : int
        Samples of a stretch; longer than a pulse interval.
    """

    def __init__(self, stretch: int) -> None:
        self._stretch = stretch
        self._pending = np.zeros(0)
        self._low: list[Array] = []
        self._high: list[Array] = []

    def take(self, values: Array) -> None:
        """Add samples, shape (n,), in order."""
        data = np.concatenate((self._pending, values))
        whole = data.size - data.size % self._stretch
        if whole:
            pieces = data[:whole].reshape(-1, self._stretch)
            self._low.append(pieces.min(axis=1))
            self._high.append(pieces.max(axis=1))
        self._pending = data[whole:]

    def result(self) -> tuple[float, float]:
        """Return low and high level."""
        if not self._low:
            if not self._pending.size:
                return 0.0, 0.0
            return float(self._pending.min()), float(self._pending.max())
        low, high = np.concatenate(self._low), np.concatenate(self._high)
        height = high - low
        known = np.isfinite(height)
        if not known.any():
            return float("nan"), float("nan")
        low, high, height = low[known], high[known], height[known]
        moving = height >= 0.5 * _weighted_median(height)
        return float(np.median(low[moving])), float(np.median(high[moving]))


def _weighted_median(values: Array) -> float:
    """Median of positive values by their own weight: neither many near zero nor one huge one decide it."""
    ordered = np.sort(values)
    below = np.cumsum(ordered)
    return float(ordered[np.searchsorted(below, 0.5 * below[-1])])


class EdgeFinder:
    """Finds the edges of one direction between two levels, to a fraction of a sample, block by block.

    A rising edge counts when the signal comes from below the lower threshold to the
    upper one; its instant is the straight line's crossing of the upper threshold.
    A falling one is that of the signal turned upside down.

    Parameters
    ----------
    low, high : float
        Levels of the pulse train.
    sample_rate_hz : float
    falling : bool
        Whether falling edges are looked for instead of rising ones.
    """

    def __init__(self, low: float, high: float, sample_rate_hz: float, falling: bool = False) -> None:
        self._falling = falling
        if falling:
            low, high = -high, -low
        middle, height = 0.5 * (low + high), high - low
        self._lower, self._upper = middle - HYSTERESIS * height, middle + HYSTERESIS * height
        self._rate_hz = sample_rate_hz
        self._seen = 0
        self._last = np.nan
        self._armed = False
        self._edges: list[Array] = []

    def take(self, values: Array) -> None:
        """Add samples, shape (n,), in order."""
        if self._falling:
            values = -values
        data = np.concatenate(([self._last], values))
        state = np.where(data >= self._upper, 1, np.where(data <= self._lower, -1, 0)).astype(np.int8)
        marked = np.flatnonzero(state)
        states = np.concatenate(([-1 if self._armed else 1], state[marked]))
        rising = marked[(states[1:] == 1) & (states[:-1] == -1)]
        rising = rising[rising > 0]
        before, after = data[rising - 1], data[rising]
        with np.errstate(invalid="ignore", divide="ignore"):
            fraction = np.clip(np.nan_to_num((self._upper - before) / (after - before)), 0.0, 1.0)
        self._edges.append((self._seen + rising - 2 + fraction) / self._rate_hz)
        self._armed = bool(states[-1] == -1)
        self._last = float(values[-1]) if values.size else self._last
        self._seen += values.size

    def result(self) -> Array:
        """Return the instants of the edges in s after the first sample."""
        return np.concatenate(self._edges) if self._edges else np.zeros(0)

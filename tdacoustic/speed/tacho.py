"""Speed from tacho pulses: edges, mending of missing and double pulses, speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from tdacoustic.errors import AnalysisError

__all__ = ["CleanEdges", "EdgeFinder", "LevelFinder", "clean_edges", "speed_from_edges"]

Array = NDArray[np.float64]

HYSTERESIS = 0.2
"""Distance of the two thresholds from the middle, over the pulse height."""
DOUBLE_BELOW = 0.6
"""An interval shorter than this part of its neighbours' median has an edge too many."""
MISSING_ABOVE = 1.5
"""An interval longer than this multiple of its neighbours' median has edges too few."""
NEIGHBOURS = 31
"""Intervals of the running median."""


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
    """Finds rising edges between two levels, to a fraction of a sample, block by block.

    An edge counts when the signal comes from below the lower threshold to the
    upper one; its instant is the straight line's crossing of the upper threshold.

    Parameters
    ----------
    low, high : float
        Levels of the pulse train.
    sample_rate_hz : float
    """

    def __init__(self, low: float, high: float, sample_rate_hz: float) -> None:
        middle, height = 0.5 * (low + high), high - low
        self._lower, self._upper = middle - HYSTERESIS * height, middle + HYSTERESIS * height
        self._rate_hz = sample_rate_hz
        self._seen = 0
        self._last = np.nan
        self._armed = False
        self._edges: list[Array] = []

    def take(self, values: Array) -> None:
        """Add samples, shape (n,), in order."""
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


@dataclass(frozen=True)
class CleanEdges:
    """Edges after mending.

    Parameters
    ----------
    times_s : ndarray
        All edges, put-in ones included.
    missing, double : int
        Edges put in, and edges taken out.
    """

    times_s: Array
    missing: int
    double: int


def _relative_intervals(edges: Array) -> Array:
    intervals = np.diff(edges)
    median = ndimage.median_filter(intervals, size=min(NEIGHBOURS, intervals.size), mode="nearest")
    return intervals / median


def clean_edges(edges: Array) -> CleanEdges:
    """Take out double edges and put in missing ones, judged by the neighbours' median interval.

    Parameters
    ----------
    edges : ndarray, shape (n,)
        Instants in s, rising.

    Returns
    -------
    CleanEdges
    """
    edges = np.asarray(edges, dtype=np.float64)
    double = 0
    while edges.size > 3:
        ratio = _relative_intervals(edges)
        short = np.flatnonzero(ratio < DOUBLE_BELOW)
        if short.size == 0:
            break
        first = short[np.concatenate(([True], np.diff(short) > 1))]
        remove = []
        for interval in first:  # of the two edges, drop the one that leaves the evener intervals
            start = max(0, int(interval) - 4)
            near, at = edges[start : interval + 6], int(interval) - start
            remove.append(interval + 1 if _unevenness(near, at + 1) <= _unevenness(near, at) else interval)
        double += len(remove)
        edges = np.delete(edges, remove)
    if edges.size <= 3:
        return CleanEdges(edges, 0, double)
    ratio = _relative_intervals(edges)
    gaps = np.flatnonzero(ratio > MISSING_ABOVE)
    put_in = [np.linspace(edges[gap], edges[gap + 1], round(float(ratio[gap])) + 1)[1:-1] for gap in gaps]
    missing = sum(piece.size for piece in put_in)
    return CleanEdges(np.sort(np.concatenate([edges, *put_in])), missing, double)


def _unevenness(edges: Array, dropped: int) -> float:
    """Spread of the intervals if one edge is dropped."""
    return float(np.std(np.diff(np.delete(edges, dropped))))


def speed_from_edges(edges: Array, pulses_per_rev: float, duration_s: float) -> tuple[Array, Array]:
    """Return the speed of a shaft over time.

    The angle between edges is interpolated on a grid of at least four pulses
    (and 50 ms) and differentiated, so that a value is the mean over its interval.

    Parameters
    ----------
    edges : ndarray, shape (n,)
        Instants in s.
    pulses_per_rev : float
    duration_s : float
        Length of the record; bounds the number of values.

    Returns
    -------
    times_s, speed : ndarray
        Middle of each interval, and revolutions per second.

    Raises
    ------
    AnalysisError
        Fewer than five edges.
    """
    if edges.size < 5:
        raise AnalysisError(f"{edges.size} tacho pulses are too few for a speed; it takes at least 5")
    typical = float(np.median(np.diff(edges)))
    interval = max(0.05, 4.0 * typical, duration_s / 20000.0)
    count = max(1, int((edges[-1] - edges[0]) / interval))
    grid = np.linspace(edges[0], edges[-1], count + 1)
    turns = np.interp(grid, edges, np.arange(edges.size) / pulses_per_rev)
    return 0.5 * (grid[1:] + grid[:-1]), np.diff(turns) / np.diff(grid)

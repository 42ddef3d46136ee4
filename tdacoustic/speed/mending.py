"""Mending of tacho edges: double ones taken out, missing ones put in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

__all__ = ["CleanEdges", "clean_edges"]

Array = NDArray[np.float64]

DOUBLE_BELOW = 0.6
"""An interval shorter than this part of its neighbours' median has an edge too many."""
MISSING_ABOVE = 1.5
"""An interval longer than this multiple of its neighbours' median has edges too few."""
NEIGHBOURS = 31
"""Intervals of the running median."""


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

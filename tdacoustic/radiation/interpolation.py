"""Between the frequencies at which a sound field was computed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.errors import RadiationError

__all__ = ["POINTS", "frequency_nodes", "lagrange", "spread_nodes"]

Real = NDArray[np.float64]

POINTS: Final = 8
"""Neighbouring frequencies that a value in between is made of."""

_FIRST_GAP_HZ: Final = 15.0
_GROWTH: Final = 0.35
_LAST_GAP: Final = 0.3


def frequency_nodes(lowest_hz: float, highest_hz: float, step_hz: float, dense_hz: float = 0.0) -> Real:
    """Return frequencies to compute a field at: at most a step apart, denser at both ends.

    At the lower end fields follow powers of the frequency; at the upper one a polynomial has neighbours on one side
    only. Below a frequency half the step is taken: where a body is as large as a wave its waves around the edges
    interfere within less than ways across it would say.

    Parameters
    ----------
    lowest_hz, highest_hz, step_hz, dense_hz : float

    Examples
    --------
    >>> nodes = frequency_nodes(20.0, 1500.0, 70.0)
    >>> len(nodes), float(nodes[0]), float(nodes[-1]), bool(np.diff(nodes).max() <= 70.0)
    (26, 20.0, 1500.0, True)
    """
    if not 0.0 < lowest_hz < highest_hz:
        raise RadiationError(f"there is no frequency between {lowest_hz:g} and {highest_hz:g} Hz")
    nodes = [lowest_hz]
    while nodes[-1] < highest_hz:
        gaps = (
            step_hz * min(max(0.5, nodes[-1] / dense_hz - 0.5), 1.0) if dense_hz else step_hz,
            _FIRST_GAP_HZ + _GROWTH * (nodes[-1] - lowest_hz),
            _LAST_GAP * step_hz + _GROWTH * (highest_hz - nodes[-1]),
        )
        nodes.append(nodes[-1] + min(gaps))
    stretch = (highest_hz - lowest_hz) / (nodes[-1] - lowest_hz)
    found = lowest_hz + stretch * (np.array(nodes) - lowest_hz)
    found[-1] = highest_hz
    return found


def spread_nodes(nodes: ArrayLike, parts: int = 2) -> Real:
    """Return the nodes and points that cut each gap between them into equal parts."""
    ends = np.asarray(nodes, dtype=np.float64)
    places = np.arange((len(ends) - 1) * parts + 1) / parts
    return np.asarray(np.interp(places, np.arange(len(ends)), ends))


def lagrange(nodes: ArrayLike, place: float, points: int = POINTS) -> tuple[slice, Real]:
    """Return which nodes make a value between them, and their weights.

    Parameters
    ----------
    nodes : array_like
        Ascending.
    place : float
        Between the first and the last.
    points : int

    Returns
    -------
    some : slice
    weights : ndarray

    Raises
    ------
    RadiationError
        The place is outside.

    Examples
    --------
    >>> some, weights = lagrange(range(20), 9.5)
    >>> some, round(float(weights @ (np.arange(20.0) ** 3)[some]), 9)
    (slice(6, 14, None), 857.375)
    """
    held = np.asarray(nodes, dtype=np.float64)
    if not held[0] <= place <= held[-1]:
        raise RadiationError(f"{place:g} is not between {held[0]:g} and {held[-1]:g}")
    count = min(points, len(held))
    first = int(np.clip(np.searchsorted(held, place) - count // 2, 0, len(held) - count))
    some = slice(first, first + count)
    near = held[some]
    apart = near[:, None] - near[None]
    np.fill_diagonal(apart, 1.0)
    ratio = (place - near[None]) / apart
    np.fill_diagonal(ratio, 1.0)
    return some, np.asarray(ratio.prod(axis=1))


def weighted_sum(values: Sequence[NDArray[Any]], weights: Real) -> NDArray[Any]:
    """Return the sum of arrays times weights; where they differ in length the short ones end in zeros."""
    longest = max(values, key=len)
    total = np.zeros_like(longest)
    for value, weight in zip(values, weights, strict=True):
        total[: len(value)] += longest.dtype.type(weight) * value
    return total

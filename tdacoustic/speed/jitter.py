"""Scatter of the instants of tacho edges: how much there is, what it does to the speed, and smoothing against it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

__all__ = ["bandwidth_for", "edge_jitter_s", "smoothed_speed", "smoothed_speed_error", "speed_error"]

Array = NDArray[np.float64]

GAUSS_3DB: Final = math.sqrt(math.log(2.0)) / (2.0 * math.pi)
"""Half-power frequency of a Gaussian smoother times its standard deviation."""
THIRD: Final = 20.0
"""1 + 9 + 9 + 1: variance of a third difference over that of independent values."""
ENOUGH: Final = 12
"""Edges from which on a scatter is estimated."""
MOST_POINTS: Final = 2**22
"""Of the even grid that is smoothed."""
REACH: Final = 6.0
"""Standard deviations to which the smoother reaches."""


def edge_jitter_s(pieces: Sequence[Array], turns: Sequence[Array]) -> float:
    """Return the standard deviation of the instants of edges about a smooth motion, in s; NaN of too few edges.

    The third differences of the time over the angle vanish for a constant acceleration; their median magnitude is that
    of the scatter alone. Edges that scatter about a smooth motion independently of each other are assumed.

    Parameters
    ----------
    pieces, turns : sequence of ndarray
        Instants of each stretch of edges and the turns at them (which teeth need not divide evenly).
    """
    found = []
    for edges, angle in zip(pieces, turns, strict=True):
        if edges.size < ENOUGH:
            continue
        pace = np.gradient(edges, angle)
        even = np.linspace(angle[0], angle[-1], angle.size)
        moved = edges + (even - angle) * pace  # what uneven teeth do is taken off
        third = np.diff(moved, 3)
        # What a changing acceleration leaves is the same for neighbours, and goes with their median.
        found.append(third - ndimage.median_filter(third, size=min(31, third.size), mode="nearest"))
    if not found:
        return float("nan")
    return float(1.4826 * np.median(np.abs(np.concatenate(found))) / math.sqrt(THIRD))


def speed_error(jitter_s: float, interval_s: Array | float) -> Array | float:
    """Return the relative standard error of a mean speed between two edges `interval_s` apart."""
    return math.sqrt(2.0) * jitter_s / interval_s


def smoothed_speed_error(jitter_s: float, pulse_interval_s: float, bandwidth_hz: float) -> float:
    """Return the relative standard error of a speed smoothed to a bandwidth (half power).

    Edges of independent scatter are angle noise of density jitter² · interval; differentiated and passed through a
    Gaussian of standard deviation s they leave jitter² · interval / (4 √π s³).
    """
    spread = GAUSS_3DB / bandwidth_hz
    return jitter_s * math.sqrt(pulse_interval_s / (4.0 * math.sqrt(math.pi) * spread**3))


def bandwidth_for(jitter_s: float, pulse_interval_s: float, wanted: float) -> float:
    """Return the bandwidth in Hz at which `smoothed_speed_error` is `wanted`."""
    spread = (jitter_s**2 * pulse_interval_s / (4.0 * math.sqrt(math.pi) * wanted**2)) ** (1.0 / 3.0)
    return GAUSS_3DB / spread


def smoothed_speed(edges: Array, turns: Array, bandwidth_hz: float, times_s: Array) -> Array:
    """Return the speed at instants, smoothed by a Gaussian of a half-power bandwidth.

    The angle goes on beyond both ends as the parabola of the nearest stretch has it, so that a constant acceleration
    stays exact there too; the scatter there is some four times that inside.

    Parameters
    ----------
    edges, turns : ndarray, shape (n,)
        Instants and angle.
    bandwidth_hz : float
    times_s : ndarray, shape (m,)
        Within the edges.
    """
    spread = GAUSS_3DB / bandwidth_hz
    length = float(edges[-1] - edges[0])
    step = max(min(float(np.median(np.diff(edges))), spread / 4.0), length / MOST_POINTS)
    even = np.arange(edges[0], edges[-1] + 0.5 * step, step)
    angle = np.interp(even, edges, turns)
    pad = math.ceil(REACH * spread / step)
    reach = min(2.0 * REACH * spread, length)
    ahead, behind = (
        _parabola(edges, turns, instant, reach)(instant + side * step * np.arange(1, pad + 1))
        for instant, side in ((float(even[0]), -1.0), (float(even[-1]), 1.0))
    )
    padded = np.concatenate((ahead[::-1], angle, behind))
    slope = ndimage.gaussian_filter1d(padded, spread / step, order=1, mode="nearest", truncate=REACH) / step
    return np.asarray(np.interp(times_s, even, slope[pad : pad + even.size]))


def _parabola(edges: Array, turns: Array, at: float, reach: float) -> np.polynomial.Polynomial:
    near = np.abs(edges - at) <= reach
    order = min(2, int(near.sum()) - 1)
    return np.polynomial.Polynomial.fit(edges[near], turns[near], max(order, 0))

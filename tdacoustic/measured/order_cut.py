"""The level of one order over a run-up, cut out of the powers of its segments.

An order is followed by its known frequency alone, order times speed; proper tracking resamples over the angle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from tdacoustic.measured.record_scatter import band_energy
from tdacoustic.spectra import FramePlan

__all__ = ["OrderCut", "OrderLevel", "cut_order", "level_at", "segment_spans_s", "speeds_of"]

Array = NDArray[np.float64]

GUARD_LINES: Final = 2.0
"""Half width of the main lobe of a Hann window, in lines: 99.95 % of a tone's energy lie in it."""

SIDE_LINES: Final = 12
"""Lines on each side of the band from which the floor is taken."""

PROMINENCE_DB: Final = 6.0
"""Band over floor from which on the floor can be taken off, as ISO 3744 has it for background noise."""

MOST_SPEEDS: Final = 10
SPEED_STEP: Final = 0.02
"""Distance of neighbouring speeds at least, relative."""
SPEED_REACH: Final = 0.03
"""Segments whose speed differs by no more stand for a speed: within it a run counts as steady."""


@dataclass(frozen=True)
class OrderCut:
    """An order in each segment of a run-up.

    Parameters
    ----------
    speed_hz : ndarray, shape (n,)
        Mean over the segment.
    low_hz, high_hz : ndarray, shape (n,)
        Band in which the order lies: its travel in the segment, and the main lobe of the window on both sides.
    mean_square, floor_mean_square : ndarray, shape (n,)
        In the band, and what the floor has in it; unit².
    """

    speed_hz: Array
    low_hz: Array
    high_hz: Array
    mean_square: Array
    floor_mean_square: Array


@dataclass(frozen=True)
class OrderLevel:
    """An order around one speed.

    Parameters
    ----------
    mean_square : float
        Without the floor; unit².
    error : float
        Its standard error from the scatter of the segments, 0 of one alone; a change of the order over the speeds that
        were taken together is part of it.
    speed_hz : float
        Mean over the segments.
    half_width_hz : float
        Of the widest band that was cut.
    segments : int
    stands_out : bool
        Whether band and floor differ by 6 dB or more.
    """

    mean_square: float
    error: float
    speed_hz: float
    half_width_hz: float
    segments: int
    stands_out: bool


def segment_spans_s(plan: FramePlan) -> tuple[Array, Array]:
    """Return beginning and end of each segment after the record's start, each of shape (n_segments,)."""
    segment = np.arange(plan.n_frames) * plan.n_segments // plan.n_frames
    first = np.searchsorted(segment, np.arange(plan.n_segments), side="left")
    last = np.searchsorted(segment, np.arange(plan.n_segments), side="right") - 1
    return first * plan.hop / plan.sample_rate_hz, (last * plan.hop + plan.frame_length) / plan.sample_rate_hz


def cut_order(
    density: NDArray[np.floating],
    frames: NDArray[np.integer],
    resolution_hz: float,
    order: float,
    speed_hz: Array,
) -> OrderCut:
    """Cut an order out of the powers of a run-up's segments.

    The floor is the median of the lines beside the band, put on the scale of the mean as a chi-squared estimate of the
    segment's frames. Segments without frames, and those whose band does not lie between the third line and the last,
    are NaN in the mean squares.

    Parameters
    ----------
    density : ndarray, shape (n_segments, n_frequencies)
        Mean square per Hz, Hann window.
    frames : ndarray of int, shape (n_segments,)
    resolution_hz : float
        Line spacing.
    order : float
        Of the shaft whose speed is given.
    speed_hz : ndarray, shape (n_segments, n_instants)
        Speed over the span of each segment, in turns per second.
    """
    low = order * speed_hz.min(axis=1) - GUARD_LINES * resolution_hz
    high = order * speed_hz.max(axis=1) + GUARD_LINES * resolution_hz
    inside = (frames > 0) & (low > 1.5 * resolution_hz) & (high < (density.shape[1] - 1) * resolution_hz)
    mean_square, floor = np.full(low.size, np.nan), np.full(low.size, np.nan)
    mean_square[inside] = band_energy(density[inside], resolution_hz, low[inside], high[inside])
    for index in np.flatnonzero(inside):
        beside = _beside(density[index], resolution_hz, low[index], high[index])
        freedom = 2.0 * float(frames[index])
        floor[index] = float(np.median(beside)) * freedom / stats.chi2.median(freedom) * (high[index] - low[index])
    return OrderCut(speed_hz.mean(axis=1), low, high, mean_square, floor)


def _beside(density: NDArray[np.floating], resolution_hz: float, low_hz: float, high_hz: float) -> Array:
    """Lines on both sides of a band; not the first two, which the window spoils."""
    below, above = int(np.floor(low_hz / resolution_hz)), int(np.ceil(high_hz / resolution_hz))
    left, right = density[max(2, below - SIDE_LINES + 1) : below + 1], density[above : above + SIDE_LINES]
    return np.concatenate((left, right)).astype(np.float64)


def speeds_of(lowest_hz: float, highest_hz: float) -> tuple[Array, Array]:
    """Return speeds evenly spread over a range, ten at most, and how far from each its segments may lie.

    Speeds lie 2 % apart or more; a segment belongs to the nearest one alone, and to none from which it differs by more
    than 3 %.

    Parameters
    ----------
    lowest_hz, highest_hz : float
        Speeds in turns per second that the run-up covers.

    Returns
    -------
    (ndarray, ndarray), each of shape (n,)

    Examples
    --------
    >>> speeds, reach = speeds_of(10.0, 30.0)
    >>> speeds
    array([11., 13., 15., 17., 19., 21., 23., 25., 27., 29.])
    >>> round(float(reach[0]), 2)
    0.33
    """
    middle = 0.5 * (lowest_hz + highest_hz)
    number = int(min(MOST_SPEEDS, max(1.0, (highest_hz - lowest_hz) / (SPEED_STEP * middle))))
    step = (highest_hz - lowest_hz) / number
    speeds = lowest_hz + step * (np.arange(number, dtype=np.float64) + 0.5)
    return speeds, np.minimum(0.5 * step, SPEED_REACH * speeds)


def level_at(cut: OrderCut, speed_hz: float, reach_hz: float) -> OrderLevel | None:
    """Return an order around a speed, the mean over its segments less the floor; None where there is no segment.

    Parameters
    ----------
    cut : OrderCut
    speed_hz, reach_hz : float
        Segments whose mean speed differs by no more than the reach are taken.
    """
    chosen = (np.abs(cut.speed_hz - speed_hz) <= reach_hz) & np.isfinite(cut.mean_square)
    count = int(chosen.sum())
    if not count:
        return None
    energy, floor = cut.mean_square[chosen], float(cut.floor_mean_square[chosen].mean())
    mean = float(energy.mean())
    error = float(np.std(energy, ddof=1)) / math.sqrt(count) if count > 1 else 0.0
    return OrderLevel(
        mean_square=mean - floor,
        error=error,
        speed_hz=float(cut.speed_hz[chosen].mean()),
        half_width_hz=0.5 * float((cut.high_hz - cut.low_hz)[chosen].max()),
        segments=count,
        stands_out=mean > 0.0 and mean >= 10.0 ** (0.1 * PROMINENCE_DB) * floor,
    )

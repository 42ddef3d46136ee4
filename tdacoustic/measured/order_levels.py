"""Cuts as levels over classes of speed, in orders of the reference shaft, with every doubt in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tdacoustic.measured.order_results import OrderLevels
from tdacoustic.orders import FrequencyCurve, NamedOrder, OrderCut
from tdacoustic.orders.order_cut import STEADY

__all__ = ["crossings", "levels_of_cut", "levels_out_of_reach"]

Array = NDArray[np.float64]


def levels_of_cut(
    cut: OrderCut, order: NamedOrder, curves: Sequence[FrequencyCurve], edges_hz: Sequence[float]
) -> OrderLevels:
    """Return a cut as levels over the speed of the reference shaft.

    Parameters
    ----------
    cut : OrderCut
        Over the angle of the reference shaft, rows by speed.
    order : NamedOrder
    curves : sequence of FrequencyCurve
        Whose coming into the band is a doubt too.
    edges_hz : sequence of float
        Of the classes of speed.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        floor = np.where(cut.floor > 0.0, cut.floor, np.nan)  # 0: no lines beside the band, as its reason says
        out = cut.stands_out & np.isfinite(floor)
        level = np.where(out, cut.line_mean_square, cut.mean_square)
        steady = out & ((cut.steadiness >= STEADY) | (cut.n_frames == 1))
    speeds, edges = cut.speeds_hz, np.asarray(edges_hz)
    half = 0.5 * cut.bandwidth + 2.0 * cut.resolution  # the band and a main lobe beside it
    row = np.clip(np.searchsorted(edges, speeds, side="right") - 1, 0, edges.size - 2)
    if edges.size == 2:  # one class that holds a steady run, and more
        low, high = speeds, speeds
    else:
        low, high = edges[row], edges[row + 1]
    halves = np.full(speeds.size, half)
    crossed = [crossings(curve, order, low, high, halves) for curve in curves]
    reasons = [
        "; ".join(part for part in (own, *(words[row] for words in crossed)) if part)
        for row, own in enumerate(cut.reasons)
    ]
    return OrderLevels(
        order=order,
        method="cut",
        requested_bandwidth=cut.requested_bandwidth,
        bandwidth=np.full(speeds.size, cut.bandwidth),
        speeds_hz=speeds,
        mean_square=level,
        error=cut.error,
        floor=floor,
        phase_rad=np.where(steady, np.angle(cut.amplitude), np.nan),
        phase_error_rad=np.where(steady, cut.phase_error_rad, np.nan),
        steadiness=cut.steadiness,
        reasons=tuple(reasons),
    )


def crossings(curve: FrequencyCurve, order: NamedOrder, lowest_hz: Array, highest_hz: Array, half: Array) -> list[str]:
    """Return words for each class of speed in which a line that is no order comes into the band, else nothing.

    Parameters
    ----------
    curve : FrequencyCurve
    order : NamedOrder
    lowest_hz, highest_hz : ndarray, shape (n,)
        Of each class.
    half : ndarray, shape (n,)
        Half width of the band and what else is too near, in orders of the reference shaft.
    """
    speeds = np.linspace(lowest_hz, highest_hz, 5)
    apart = curve.frequency_hz_at(speeds) / speeds - order.order
    near = np.abs(np.where(np.isfinite(apart), apart, np.inf)).min(axis=0) < half
    crosses = (apart < 0.0).any(axis=0) & (apart > 0.0).any(axis=0)
    return [f"{curve.name} within the band" if inside else "" for inside in near | crosses]


def levels_out_of_reach(order: NamedOrder, bandwidth: float, speed_hz: float, why: str) -> OrderLevels:
    """Return an order that could not be cut at all: one row without a value, with the reason.

    Parameters
    ----------
    order : NamedOrder
    bandwidth : float
        Requested, in orders of the reference shaft.
    speed_hz : float
        Lowest of the run, at which it is still out of reach.
    why : str
    """
    missing = np.full(1, np.nan)
    return OrderLevels(
        order=order,
        method="cut",
        requested_bandwidth=bandwidth,
        bandwidth=missing,
        speeds_hz=np.full(1, speed_hz),
        mean_square=missing,
        error=missing,
        floor=missing,
        phase_rad=missing,
        phase_error_rad=missing,
        steadiness=missing,
        reasons=(f"no value: {why}",),
    )

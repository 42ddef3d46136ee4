"""Orders that stand out of a map and that nobody named."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.orders.baseline import beside
from tdacoustic.orders.order_map import OrderMap

__all__ = ["find_orders", "order_strengths"]

Array = NDArray[np.float64]

RISE_DB: Final = 6.0
"""Of an order over the median of the lines beside it, as for a cut."""
ROWS: Final = 0.4
"""Part of the rows in which it has to rise so far (assumed). A line that is fixed in Hz, or a resonance, moves over the
orders from row to row and rises at one of them in few rows alone."""
BESIDE: Final = 41
"""Lines of the running median."""
LOWEST_LINE: Final = 6
"""Of an order that is looked for: below, the flank of what is slower than a turn looks like one."""
LOWEST_BAND: Final = 4
"""Line at which the band of a known order may begin: below, it meets its own mirror image."""
FEWEST_ROWS: Final = 4
WHOLE: Final = 0.2
"""Of a line: an order this near to a whole number is taken for it."""


def find_orders(order_map: OrderMap, known: Sequence[float], apart: float, most: int = 6) -> tuple[float, ...]:
    """Return the orders that stand out of a map over speed and are not known, by order.

    An order counts where it is a peak along the axis that rises 6 dB over the lines beside it in four of ten rows. Of
    each channel the strongest are taken; those of several channels that are closer than `apart` are one.

    Parameters
    ----------
    order_map : OrderMap
        Domain ``order``.
    known : sequence of float
        Orders, of the same shaft.
    apart : float
        In orders; what is closer to a known one is that one.
    most : int
        Of each channel.

    Raises
    ------
    AnalysisError
        A map of another domain.
    """
    from scipy import signal

    if order_map.domain != "order":
        raise AnalysisError(f"orders are looked for in a map over orders, got {order_map.domain!r}")
    found: list[tuple[float, float]] = []
    for power, frames in zip(order_map.mean_square, order_map.n_frames, strict=True):
        rows = np.flatnonzero(frames > 0)
        if rows.size < FEWEST_ROWS or order_map.axis.size < BESIDE:
            continue
        level = 10.0 * np.log10(np.maximum(power[rows].astype(np.float64), 1e-300))
        rise = level - beside(level, BESIDE)
        margin = BESIDE // 2 * order_map.resolution  # at the end of the axis there is nothing to rise over
        held = order_map.axis[None] + margin <= order_map.highest[rows, None]
        middle = _quantile(np.where(held, rise, np.nan), 1.0 - ROWS)
        peaks, _ = signal.find_peaks(middle, height=RISE_DB, distance=max(1, round(0.5 * apart / order_map.resolution)))
        peaks = peaks[peaks >= LOWEST_LINE]
        mean = np.nanmean(np.where(held, power[rows], np.nan)[:, peaks], axis=0) if peaks.size else np.zeros(0)
        total = float(np.sum(mean)) or 1.0
        of_channel = [
            (float(mean[index]) / total, _refined(order_map, middle, int(peak))) for index, peak in enumerate(peaks)
        ]
        free = [item for item in of_channel if all(abs(item[1] - other) >= apart for other in known)]
        found += sorted(free, reverse=True)[:most]
    return tuple(sorted(_merged(found, apart)))


def _quantile(rise: Array, share: float) -> Array:
    """Value of each column that a share of its numbers lie below; 0 where it has too few."""
    count = np.isfinite(rise).sum(axis=0)
    at = np.clip(np.ceil(share * count).astype(int) - 1, 0, rise.shape[0] - 1)
    found = np.take_along_axis(np.sort(rise, axis=0), at[None], axis=0)[0]
    return np.where(count >= FEWEST_ROWS, found, 0.0)


def _refined(order_map: OrderMap, rise: Array, peak: int) -> float:
    """Order of a peak between the lines, by the parabola through the levels of three."""
    resolution = order_map.resolution
    if not 0 < peak < rise.size - 1:
        return peak * resolution
    left, middle, right = rise[peak - 1 : peak + 2]
    bend = left - 2.0 * middle + right
    order = (peak + (0.5 * (left - right) / bend if bend < 0.0 else 0.0)) * resolution
    whole = round(order)
    return float(whole) if whole > 0 and abs(order - whole) < WHOLE * resolution else float(order)


def _merged(found: Sequence[tuple[float, float]], apart: float) -> list[float]:
    """Orders of all channels, the strongest of each neighbourhood."""
    kept: list[float] = []
    for _, order in sorted(found, reverse=True):
        if all(abs(order - other) >= apart for other in kept):
            kept.append(order)
    return kept


def order_strengths(order_map: OrderMap, orders: Sequence[float], bandwidth: float) -> Array:
    """Return how strong orders are beside each other, shape (n_orders,).

    Of each channel the energy mean over the rows, less the floor beside the order, as a share of that of all orders;
    then the mean over the channels. An order that stands out nowhere has 0.

    Parameters
    ----------
    order_map : OrderMap
        Domain ``order``.
    orders : sequence of float
    bandwidth : float
        In orders.
    """
    strengths = np.zeros((len(orders), order_map.mean_square.shape[0]))
    for index, order in enumerate(orders):
        if order - 0.5 * bandwidth < LOWEST_BAND * order_map.resolution:
            continue
        band = order_map.band(order - 0.5 * bandwidth, order + 0.5 * bandwidth)
        below = order_map.band(max(0.0, order - 1.5 * bandwidth), order - 0.5 * bandwidth)
        above = order_map.band(order + 0.5 * bandwidth, order + 1.5 * bandwidth)
        with np.errstate(invalid="ignore"):
            floor = np.fmin(below, above)
            out = np.where((order <= order_map.highest) & (band >= 10.0 ** (0.1 * RISE_DB) * floor), band - floor, 0.0)
        strengths[index] = np.nan_to_num(out).mean(axis=1)
    total = strengths.sum(axis=0)
    return np.asarray((strengths / np.where(total > 0.0, total, 1.0)).mean(axis=1))

"""Families of sidebands around an order, and the modulation that they tell of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.orders.order_cut import OrderCut

__all__ = ["SidebandFamily", "sideband_families", "sideband_orders"]

Array = NDArray[np.float64]

SAME: Final = 1e-6
"""Orders this near are the same."""


@dataclass(frozen=True)
class SidebandFamily:
    """Sidebands of one carrier, spaced by one order, in one channel, over rows.

    Parameters
    ----------
    carrier, spacing : float
        Orders.
    channel : int
    times_s, speeds_hz : ndarray, shape (n_rows,)
    pairs : ndarray of int, shape (n_rows,)
        Pairs, counted from the carrier outwards, of which both stand 6 dB or more above the floor.
    power_ratio : ndarray, shape (n_rows,)
        Mean square of all sidebands that stand out, over the carrier's.
    amplitude_depth : ndarray, shape (n_rows,)
        Depth m of the modulation (1 + m cos) by the spacing itself, from the first pair.
    phase_depth_rad : ndarray, shape (n_rows,)
        Index β of the modulation cos(... + β cos), for small β.
    reasons : tuple of str, one a row
        Why depths are missing or doubtful; NaN with a reason alone.
    """

    carrier: float
    spacing: float
    channel: int
    times_s: Array
    speeds_hz: Array
    pairs: NDArray[np.int64]
    power_ratio: Array
    amplitude_depth: Array
    phase_depth_rad: Array
    reasons: tuple[str, ...]


def sideband_orders(carriers: Sequence[float], spacings: Sequence[float], count: int = 3) -> tuple[float, ...]:
    """Return all orders that families need, increasing and each once: carriers, and so many sidebands on each side.

    Examples
    --------
    >>> sideband_orders([20.0], [1.0], 2)
    (18.0, 19.0, 20.0, 21.0, 22.0)
    """
    wanted = {
        round(carrier + number * spacing, 6)
        for carrier in carriers
        for spacing in spacings
        for number in range(-count, count + 1)
        if carrier + number * spacing > 0.0
    }
    return tuple(sorted(wanted))


def sideband_families(
    cuts: Sequence[OrderCut], carriers: Sequence[float], spacings: Sequence[float], count: int = 3
) -> tuple[SidebandFamily, ...]:
    """Return the families that cuts along `sideband_orders` hold, for each carrier, spacing and channel.

    Amplitude and phase modulation are told apart by the phases of the first pair, a₊/a₀ and a₋/a₀:
    ``m = |a₊/a₀ + conj(a₋/a₀)|``, ``β = |a₊/a₀ - conj(a₋/a₀)|``. Both need mean amplitudes of steady phase.

    Parameters
    ----------
    cuts : sequence of OrderCut
        With phases against the angle's zero; of one meter.
    carriers, spacings : sequence of float
    count : int
        Sidebands on each side.

    Raises
    ------
    AnalysisError
        A carrier that was not cut.
    """
    channels = sorted({cut.channel for cut in cuts})
    return tuple(
        _family([cut for cut in cuts if cut.channel == channel], carrier, spacing, count)
        for carrier in carriers
        for spacing in spacings
        for channel in channels
    )


def _find(cuts: Sequence[OrderCut], order: float) -> OrderCut | None:
    return next((cut for cut in cuts if abs(cut.order - order) < SAME), None)


def _family(cuts: Sequence[OrderCut], carrier: float, spacing: float, count: int) -> SidebandFamily:
    middle = _find(cuts, carrier)
    if middle is None:
        raise AnalysisError(f"carrier {carrier:g} is not among the orders that were cut")
    rows = middle.speeds_hz.size
    pairs, power, unbroken = np.zeros(rows, dtype=np.int64), np.zeros(rows), np.ones(rows, dtype=bool)
    for number in range(1, count + 1):
        both = np.ones(rows, dtype=bool)
        for side in (_find(cuts, carrier - number * spacing), _find(cuts, carrier + number * spacing)):
            out = np.zeros(rows, dtype=bool) if side is None else side.stands_out
            both &= out
            if side is not None:
                power += np.where(out, np.nan_to_num(side.line_mean_square), 0.0)
        unbroken &= both
        pairs += unbroken
    depth, index, reasons = _modulation(middle, _find(cuts, carrier - spacing), _find(cuts, carrier + spacing))
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.where(middle.stands_out, power / middle.line_mean_square, np.nan)
    return SidebandFamily(
        carrier=carrier,
        spacing=spacing,
        channel=middle.channel,
        times_s=middle.times_s,
        speeds_hz=middle.speeds_hz,
        pairs=pairs,
        power_ratio=ratio,
        amplitude_depth=depth,
        phase_depth_rad=index,
        reasons=reasons,
    )


def _modulation(
    middle: OrderCut, below: OrderCut | None, above: OrderCut | None
) -> tuple[Array, Array, tuple[str, ...]]:
    rows = middle.speeds_hz.size
    missing = np.full(rows, np.nan)
    if below is None or above is None:
        return missing, missing.copy(), ("no value: a sideband of the first pair was not cut",) * rows
    reasons = []
    good = np.zeros(rows, dtype=bool)
    for row in range(rows):
        if not middle.stands_out[row]:
            reasons.append("no value: the carrier does not stand out")
        elif not (np.isfinite(below.amplitude[row]) and np.isfinite(above.amplitude[row])):
            reasons.append("no value: a sideband of the first pair has none")
        else:
            good[row] = True
            weak = not (below.stands_out[row] and above.stands_out[row])
            unsteady = min(cut.steadiness[row] for cut in (middle, below, above)) < 0.5
            reasons.append(
                "the first pair does not stand out: an upper bound" if weak else "unsteady phases" if unsteady else ""
            )
    with np.errstate(invalid="ignore", divide="ignore"):
        up, down = above.amplitude / middle.amplitude, np.conj(below.amplitude / middle.amplitude)
    return np.where(good, np.abs(up + down), np.nan), np.where(good, np.abs(up - down), np.nan), tuple(reasons)

"""Lines that stay in Hz while the speed changes, found in a map over frequency, and where they hide an order."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.orders.baseline import beside
from tdacoustic.orders.order_cut import OrderCut
from tdacoustic.orders.order_map import OrderMap

__all__ = ["FixedLine", "find_fixed_lines"]

Array = NDArray[np.float64]

LINE_RISE_DB: Final = 6.0
"""Of a line that is fixed in Hz, over the lines beside it, in the middle of all rows."""
LINE_ROWS: Final = 0.8
"""Part of the rows in which such a line stands out, at least."""
STEADY_SHARE: Final = 0.45
"""Scatter of a line's level over that of noise in as many averages, at most, for a tone (assumed: in the mean a tone
that stands 12 dB over the noise has 0.35 and one of 15 dB 0.25, noise through a narrow resonance 0.7 to 2)."""
STEADY_ROWS: Final = 12
"""Rows that the scatter is taken from, at least (assumed)."""
HIDDEN_DB: Final = 2.0
"""By which a tone may raise an order's level before that level says nothing of the order (assumed)."""
LARGEST_SMEAR: Final = 2.0
"""Bandwidths over which a tone is followed as the speed changes within a frame; what spreads further is weak."""


@dataclass(frozen=True)
class FixedLine:
    """One line that is fixed in Hz.

    Parameters
    ----------
    frequency_hz : float
    rise_db : float
        Over the lines beside it, in the middle of the rows.
    rows_out, rows : int
        Rows in which it stands out, and rows in which no order covers it.
    speeds_hz, mean_square : ndarray, shape (rows,)
        Of those rows: the slow course over the speed, unit², of a tone at `frequency_hz`.
    steady : bool
        Whether the level scatters far less than noise does: a tone that is there by itself. Noise that a narrow
        resonance lets through makes a line as well, but one that scatters.
    """

    frequency_hz: float
    rise_db: float
    rows_out: int
    rows: int
    speeds_hz: Array
    mean_square: Array
    steady: bool

    def hides(self, cut: OrderCut) -> NDArray[np.bool_]:
        """Return the rows of a cut whose level may be the line's rather than the order's, shape (n_rows,).

        The line is within the cut's band, or comes there as the speed changes within a frame; and the order, at best
        in phase with it, is not strong enough to be told within 2 dB. Where an order stands far above the line, as in
        a resonance, it hides nothing.

        Parameters
        ----------
        cut : OrderCut
            Of the same channel.
        """
        speeds = np.asarray(cut.speeds_hz, dtype=np.float64)
        if speeds.size < 2:
            return np.zeros(speeds.shape, dtype=bool)
        with np.errstate(divide="ignore", invalid="ignore"):
            sweep = np.abs(np.gradient(speeds) / np.gradient(cut.times_s))
            smear = cut.order * sweep * 0.5 / (cut.resolution * speeds**2)  # half a frame's change of speed
        smear = np.fmin(smear, LARGEST_SMEAR * cut.bandwidth)  # fmin: where classes were met at one time in the mean
        near = np.abs(self.frequency_hz / speeds - cut.order) < cut.bandwidth + smear
        share = (1.0 + 1.0 / (10.0 ** (0.05 * HIDDEN_DB) - 1.0)) ** 2  # (a + b)² over b² where (a + b)² / a² is 2 dB
        line = np.interp(speeds, self.speeds_hz, self.mean_square)
        with np.errstate(invalid="ignore"):
            return np.asarray(near & (cut.mean_square < share * line))


def find_fixed_lines(frequency_map: OrderMap, channel: int, cuts: Sequence[OrderCut]) -> tuple[FixedLine, ...]:
    """Return lines that stand out at one frequency in most rows, are narrow, and that no order explains.

    A line stands 6 dB above the lines beside it in four of five rows, and 6 dB above what is a main lobe away.

    Parameters
    ----------
    frequency_map : OrderMap
        Domain ``frequency``, over classes of speed.
    channel : int
    cuts : sequence of OrderCut
        Orders whose cells of the map are left out.
    """
    level = 10.0 * np.log10(np.maximum(frequency_map.mean_square[channel].astype(np.float64), 1e-300))
    usable = frequency_map.n_frames[channel] > 0
    level, speeds = level[usable], frequency_map.speeds_hz[usable]
    if level.shape[0] < 3:
        return ()
    rise = level - beside(level)
    owned = np.zeros(rise.shape, dtype=bool)
    for order in {cut.order for cut in cuts}:
        owned |= np.abs(frequency_map.axis - order * speeds[:, None]) < 3.0 * frequency_map.resolution
    rise = np.where(owned, np.nan, rise)
    averages = frequency_map.averages[channel][usable]
    found = []
    for peak, middle in _peaks(rise, math.ceil(frequency_map.frames.main_lobe_lines) + 1):
        place = _between(middle, peak)
        free = np.isfinite(rise[:, peak])
        course = _course(level[free, peak])
        # With its neighbours: a tone that wanders between them is as steady as one that stays.
        around = 10.0 * np.log10(np.sum(10.0 ** (0.1 * level[free, peak - 1 : peak + 2]), axis=1))
        response = np.abs(frequency_map.frames.line_transform(np.array([0.0, peak - place]))) ** 2
        found.append(
            FixedLine(
                frequency_hz=place * frequency_map.resolution,
                rise_db=float(middle[peak]),
                rows_out=int(np.sum(rise[free, peak] >= LINE_RISE_DB)),
                rows=int(free.sum()),
                speeds_hz=speeds[free],
                mean_square=10.0 ** (0.1 * course) * response[0] / response[1],
                steady=_is_steady(around - _course(around), averages[free]),
            )
        )
    return tuple(found)


def _peaks(rise: Array, lobe: int) -> list[tuple[int, Array]]:
    """Lines that stand out in most rows, each with the middle of all rows."""
    from scipy import signal

    rows = np.isfinite(rise).sum(axis=0)
    with np.errstate(invalid="ignore"):
        out = np.sum(rise >= LINE_RISE_DB, axis=0)
    free = rows >= 3
    middle = np.zeros(rise.shape[1])
    ordered = np.sort(rise[:, free], axis=0)  # what is no number comes last
    middle[free] = np.take_along_axis(ordered, (rows[free] // 2)[None], axis=0)[0]
    peaks, _ = signal.find_peaks(middle, height=LINE_RISE_DB, distance=4)
    peaks = peaks[peaks > lobe + 1]  # below: what is slower than the frames are long, and its flank
    sides = np.array([max(middle[max(0, peak - lobe)], middle[min(middle.size - 1, peak + lobe)]) for peak in peaks])
    if peaks.size:  # as narrow as the window makes it
        peaks = peaks[middle[peaks] - sides >= LINE_RISE_DB]
    return [(peak, middle) for peak in peaks[out[peaks] >= LINE_ROWS * rows[peaks]].tolist()]


def _course(level: Array) -> Array:
    """Slow course of levels, without what orders that nobody cut do as they pass, and what rings from row to row."""
    from scipy import ndimage

    return np.asarray(ndimage.median_filter(level, size=max(STEADY_ROWS, level.size // 4) | 1, mode="nearest"))


def _is_steady(apart: Array, averages: Array) -> bool:
    """Whether levels scatter about their slow course, in dB, by far less than those of noise.

    The mean square of n independent averages of noise is a χ² of 2 n degrees of freedom: its level has a standard
    deviation of ``10 / ln 10 sqrt(ψ'(n))`` dB.
    """
    from scipy import special

    if apart.size < STEADY_ROWS:
        return False
    expected = 10.0 / math.log(10.0) * np.sqrt(special.polygamma(1, np.maximum(averages, 1.0)))
    scatter = 1.4826 * float(np.median(np.abs(apart) / expected))  # the deviation of a normal number
    return scatter <= STEADY_SHARE


def _between(middle: Array, peak: int) -> float:
    """Place of a peak between the lines, by the parabola through three levels."""
    left, top, right = (float(value) for value in middle[max(0, peak - 1) : peak + 2])
    bend = left - 2.0 * top + right
    return peak + (0.5 * (left - right) / bend if bend < 0.0 else 0.0)

"""Third octaves whose level a far stronger line nearby decides, through the skirts of the filter.

Class 1 of IEC 61260-1 leaves open how far a filter falls below its pass-band: beside a strong line two analysers,
both in order, may show a band 12 dB apart.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tdacoustic.lines import Line
from tdacoustic.spectra import SegmentPowers

__all__ = ["BANDS_BESIDE", "LINE_OVER_BAND_DB", "beside_lines", "beside_moving_lines"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

LINE_OVER_BAND_DB, BANDS_BESIDE = 15.0, 3
"""A band within three bands of a line this much stronger depends on the filter's skirts (analysers differ by 12 dB)."""

PEAK_OVER_DB = 10.0
"""A peak of a segment's spectrum this far over the median on each side of it is narrow: a line [assumed]."""
PEAK_REACH = 4
"""Lines on each side of a peak that its energy lies in: the window's main lobe, and what the speed moves it by in a
segment [assumed]."""
SIDE_LINES = 12
"""Lines beyond, on each side, that the median is taken over. A peak with fewer below it is not judged: with lines of
8 Hz no line below 128 Hz flags a band in a run-up."""


def beside_lines(centre_hz: Array, mean_square: Array, lines: Sequence[Line]) -> Flags:
    """Return which bands lie beside a far stronger line of a steady run.

    Parameters
    ----------
    centre_hz, mean_square : ndarray, shape (n_bands,)
        Exact centres, and the level of the whole record.
    lines : sequence of Line
    """
    number = _number(centre_hz)
    dependent = np.zeros(number.size, dtype=np.bool_)
    for line in lines:
        own = round(10.0 * math.log10(line.frequency_hz / 1000.0))
        weak = line.rms**2 > mean_square * 10.0 ** (0.1 * LINE_OVER_BAND_DB)
        dependent |= weak & (np.abs(number - own) <= BANDS_BESIDE) & (number != own)
    return dependent


def beside_moving_lines(centre_hz: Array, mean_square: Array, powers: SegmentPowers, index: int) -> Flags:
    """Return which bands lie beside far stronger lines of a run-up, where lines travel through bands.

    In each segment the strongest narrow peak of each band counts as a line. Averaged over the record as the band's own
    level is, what such lines have within three bands on both sides is held against the level of the band: the rule
    for a steady run, with lines that are in a neighbouring band for a part of the time.

    Parameters
    ----------
    centre_hz, mean_square : ndarray, shape (n_bands,)
    powers : SegmentPowers
    index : int
        Of the channel.
    """
    number = _number(centre_hz)
    held = powers.frames[index] > 0
    density = powers.density[index, held]
    frames = powers.frames[index, held].astype(np.float64)
    if density.shape[0] == 0:
        return np.zeros(number.size, dtype=np.bool_)
    peaks = np.array([_narrow_peak(density, powers.plan.resolution_hz, centre) for centre in centre_hz])
    mean = peaks @ frames / frames.sum()
    beside = np.abs(number[:, None] - number[None, :])
    around = np.where((beside > 0) & (beside <= BANDS_BESIDE), mean[None, :], 0.0).sum(axis=1)
    return np.asarray(around > mean_square * 10.0 ** (0.1 * LINE_OVER_BAND_DB))


def _number(centre_hz: Array) -> Array:
    """Bands counted from that of 1 kHz."""
    return np.asarray(np.round(10.0 * np.log10(centre_hz / 1000.0)))


def _narrow_peak(density: NDArray[np.float32], resolution_hz: float, centre_hz: float) -> Array:
    """Mean square of the strongest narrow peak of a band in each segment; 0 where none is narrow.

    Narrow against both sides: on a steep slope of noise one of them is as high as the peak.
    """
    n = density.shape[1]
    low = max(1, math.ceil(centre_hz * 10.0**-0.05 / resolution_hz))
    high = min(n, math.floor(centre_hz * 10.0**0.05 / resolution_hz) + 1)
    if high <= low:  # narrower than the spectrum's lines: one line, the nearest
        low = min(max(1, round(centre_hz / resolution_hz)), n - 1)
        high = low + 1
    peak = low + np.argmax(density[:, low:high], axis=1)
    reach = PEAK_REACH + SIDE_LINES
    places = peak[:, None] + np.arange(-reach, reach + 1)
    around = np.take_along_axis(density, np.clip(places, 0, n - 1), axis=1).astype(np.float64)
    sides = np.median(around[:, :SIDE_LINES], axis=1), np.median(around[:, -SIDE_LINES:], axis=1)
    floor = np.maximum(*sides)
    lobe = around[:, SIDE_LINES:-SIDE_LINES]
    narrow = (places[:, 0] >= 1) & (places[:, -1] < n)
    narrow &= lobe[:, PEAK_REACH] >= lobe.max(axis=1)  # not the flank of a neighbour
    narrow &= lobe[:, PEAK_REACH] > floor * 10.0 ** (0.1 * PEAK_OVER_DB)
    energy = (lobe.sum(axis=1) - floor * lobe.shape[1]) * resolution_hz
    return np.where(narrow, np.maximum(energy, 0.0), 0.0)

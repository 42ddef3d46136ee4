"""Finding lines in a spectrum."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import signal, stats

from tdacoustic.lines.floor import local_floor
from tdacoustic.spectra import Spectrum

__all__ = ["Line", "find_lines"]

Array = NDArray[np.float64]

LOWEST_HZ = 5.0
"""No lines are sought below (sensor drift, wind, handling)."""
FALSE_ALARMS = 0.02
"""Lines expected by chance in one spectrum of noise alone."""
MAIN_LOBE = 2
"""Half width of the window's main lobe, in lines of the spectrum."""
HANN_SECOND_MOMENT = 1.0 / 3.0
"""Second moment of the power of a Hann main lobe, in lines² of the spectrum."""
SCALLOPING_DB = 1.43
"""Largest loss of a Hann window between two lines."""
FREQUENCY_VARIANCE = (0.096, 1.03)
"""Variance of the interpolated frequency, in lines², is ``(a / s + b / s²) / averages`` with s the power over
the floor: fitted to simulations at 50 % overlap, s from 4 to 10000; a test holds it."""


BROAD = 0.2
"""A peak whose neighbours beyond its main lobe hold more than this part of its power is broad."""
WIDEST = 64
"""Half width at which a broad peak is no longer widened, in lines of the spectrum."""


@dataclass(frozen=True)
class Line:
    """One line of a spectrum.

    Parameters
    ----------
    frequency_hz : float
    frequency_error_hz : float
        One standard deviation.
    rms : float
        Of the sinusoid, corrected for window and interpolation, floor taken off.
    prominence_db : float
        Level of the sinusoid minus that of the floor in one noise bandwidth.
    width_hz : float
        Rms width beyond that of the window; 0 for a steady line. A narrow resonance
        that noise excites shows as one line, and this tells it from a sinusoid.
    """

    frequency_hz: float
    frequency_error_hz: float
    rms: float
    prominence_db: float
    width_hz: float


def _thresholds(spectrum: Spectrum, prominence_db: float) -> tuple[float, float]:
    """Return the least height over the floor and over the valleys beside a peak, both in dB."""
    freedom = 2.0 * spectrum.averages
    rate = FALSE_ALARMS / max(1, spectrum.density.size)
    chance_db = 10.0 * math.log10(stats.chi2.isf(rate, freedom) / freedom)
    scatter_db = 4.34 / math.sqrt(spectrum.averages)
    wanted_db = 10.0 * math.log10(1.0 + 10.0 ** (0.1 * (prominence_db - SCALLOPING_DB))) - 2.0 * scatter_db
    valley_db = max(3.0, 3.5 * scatter_db)
    return max(chance_db, wanted_db), min(valley_db, max(chance_db, 3.0))


def _interpolated_offset(excess: Array, peak: int) -> float:
    """Distance of a sinusoid from the peak line, in lines, from the ratio of the two highest (Hann)."""
    left, right = excess[peak - 1], excess[peak + 1]
    side = 1.0 if right >= left else -1.0
    ratio = math.sqrt(max(left, right, 0.0) / excess[peak])
    return side * float(np.clip((2.0 * ratio - 1.0) / (ratio + 1.0), -0.5, 0.5))


def _reach(excess: Array, peak: int, least: int, scatter: float) -> int:
    """Half width of a peak: widened while most of the lines just beyond still belong to it, and not to the scatter."""
    limit = max(BROAD * float(excess[peak]), scatter)
    for reach in range(least, WIDEST):
        left = excess[max(0, peak - reach - 3) : max(0, peak - reach)]
        right = excess[peak + reach + 1 : peak + reach + 4]
        beside = np.concatenate((left, right))
        if beside.size == 0 or float(np.median(beside)) <= limit:
            return reach
    return max(least, WIDEST)


def _measure(spectrum: Spectrum, floor: Array, peak: int, reach: int) -> Line | None:
    """Measure the line around a peak; `reach` lines to each side belong to it."""
    density = spectrum.density
    low, high = max(1, peak - reach), min(density.size - 1, peak + reach + 1)
    excess = np.clip(density - floor, 0.0, None)
    region = np.arange(low, high)
    weights = excess[region]
    power = float(np.sum(density[region] - floor[region])) * spectrum.resolution_hz
    if power <= 0.0 or excess[peak] <= 0.0:
        return None
    centroid = float(region @ weights / weights.sum())
    second_moment = float((region - centroid) ** 2 @ weights / weights.sum())
    extra = max(0.0, second_moment - HANN_SECOND_MOMENT)
    smeared = reach > MAIN_LOBE and extra > HANN_SECOND_MOMENT
    offset = centroid - peak if smeared else _interpolated_offset(excess, peak)
    over_floor = power / (float(floor[peak]) * spectrum.noise_bandwidth_hz)
    linear, quadratic = FREQUENCY_VARIANCE
    variance = (linear / over_floor + quadratic / over_floor**2) / spectrum.averages
    if smeared:
        variance += extra / spectrum.averages
    return Line(
        frequency_hz=(peak + offset) * spectrum.resolution_hz,
        frequency_error_hz=math.sqrt(variance) * spectrum.resolution_hz,
        rms=math.sqrt(power),
        prominence_db=10.0 * math.log10(over_floor),
        width_hz=math.sqrt(extra) * spectrum.resolution_hz if smeared else 0.0,
    )


def find_lines(spectrum: Spectrum, prominence_db: float = 4.0, speed_scatter: float = 0.0) -> tuple[Line, ...]:
    """Find the lines of a spectrum.

    A line is a peak that stands over the local floor by more than chance and
    more than `prominence_db`, and over the valleys beside it by more than the
    scatter of the estimate, so that the flank of a strong line or the ragged
    top of a broad one gives no second line.

    Parameters
    ----------
    spectrum : Spectrum
    prominence_db : float
        Least prominence (see `Line`).
    speed_scatter : float
        Relative standard deviation of the speed within the run: a line that
        follows the speed may be that much smeared.

    Returns
    -------
    tuple of Line
        By frequency.
    """
    floor = local_floor(spectrum)
    if spectrum.density.size < 2 * MAIN_LOBE + 3 or not np.all(np.isfinite(spectrum.density)):
        return ()
    height_db, valley_db = _thresholds(spectrum, prominence_db)
    over_db = 10.0 * np.log10(np.maximum(spectrum.density, floor * 1e-3) / floor)
    peaks, _ = signal.find_peaks(over_db, height=height_db, prominence=valley_db)
    lowest = max(MAIN_LOBE + 1, math.ceil(LOWEST_HZ / spectrum.resolution_hz))
    peaks = peaks[(peaks >= lowest) & (peaks < spectrum.density.size - MAIN_LOBE - 1)]
    excess = np.clip(spectrum.density - floor, 0.0, None)
    taken = np.zeros(spectrum.density.size, dtype=bool)
    lines = []
    for peak in peaks[np.argsort(-over_db[peaks])]:
        smear = math.ceil(2.5 * speed_scatter * peak)
        if taken[peak]:
            continue
        reach = _reach(excess, int(peak), MAIN_LOBE + smear, float(floor[peak]) / math.sqrt(spectrum.averages))
        line = _measure(spectrum, floor, int(peak), reach)
        if line is not None and line.prominence_db >= prominence_db:
            lines.append(line)
            taken[max(0, peak - reach) : peak + reach + 1] = True
    return tuple(sorted(lines, key=lambda line: line.frequency_hz))

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

WANDER_SIGMAS = 1.5
"""Widening of a line by the speed that is believed, over the speed's own standard deviation."""
WANDER_CORRELATION = 0.25
"""Over the variance of the mean of as many independent values; a test on wandering speeds holds it."""

BROAD = 0.1
"""A peak whose neighbours beyond its main lobe hold more than this part of its power is broad."""
WIDEST = 64
"""Half width at which a broad peak is no longer widened, in lines of the spectrum."""
SHOULDER = 12
"""Width of the floor beside a peak that it must stand over, at least, in lines of the spectrum."""
BUMP_SIGMAS, BLIND_BUMP_SIGMAS = 3.5, 4.1
"""Standard deviations by which a smeared line stands over the bands beside it: about `FALSE_ALARMS` a spectrum; more
where its width is not known."""
WIDEST_SMEAR = 0.0125
"""Half width within which a smear is sought where the speed is not known: 2.5 times 0.5 % [assumed]."""
STRONG_DB = 10.0
"""Height of lines that tell their smear."""
GUARD = 2.5
"""Width beside a line in which no smeared line is sought, in smears."""
HANN_CORRELATION = 1.94
"""Variance of a sum over neighbouring lines of a Hann window, over that of as many independent ones."""
NOISE_BANDWIDTH_LINES = 1.5
"""Of a Hann window, in lines of the spectrum."""
SKIRT_PULL = 0.2
"""Error of a line's frequency, in lines of the spectrum, over the amplitude of a stronger line's skirt beside its own:
0.1 in the mean over phases and distances in simulations, more where these stay the same from frame to frame."""
SKIRT_PART = 0.1
"""Part of the floor from which on the skirt of a stronger line hides what only a sum over many lines would show
[assumed]."""
UNKNOWN_SCATTER = (0.0015, 0.004)
"""Relative smears at which lines are sought where nothing says how much the speed moved [assumed]."""


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
    """Distance of a sinusoid from the peak line, in lines: its ratio to each neighbour (Hann), by their power."""
    offset, weight = 0.0, 0.0
    for side, power in ((-1.0, float(excess[peak - 1])), (1.0, float(excess[peak + 1]))):
        ratio = math.sqrt(max(power, 0.0) / excess[peak])
        offset += power * side * (2.0 * ratio - 1.0) / (ratio + 1.0)
        weight += power
    return float(np.clip(offset / weight, -0.5, 0.5)) if weight > 0.0 else 0.0


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


def _measure(
    spectrum: Spectrum, floor: Array, skirts: Array, peak: int, own: tuple[int, int], speed_scatter: float
) -> Line | None:
    """Measure the line around a peak, of lines `own` of the spectrum (the second not included).

    What the skirts of stronger lines have there is taken off as the floor is. Where the speed wandered, a line that
    followed it is a little wider than the window even if no smear is seen, and its frequency is only as sure as the
    mean over the wander.
    """
    density, below = spectrum.density, floor + skirts
    excess = np.clip(density - below, 0.0, None)
    region = np.arange(*own)
    weights = excess[region]
    power = float(np.sum(density[region] - below[region])) * spectrum.resolution_hz
    if power <= 0.0 or excess[peak] <= 0.0:
        return None
    centroid = float(region @ weights / weights.sum())
    second_moment = float((region - centroid) ** 2 @ weights / weights.sum())
    extra = max(0.0, second_moment - HANN_SECOND_MOMENT)
    smeared = region.size > 2 * MAIN_LOBE + 1 and extra > HANN_SECOND_MOMENT
    offset = centroid - peak if smeared else _interpolated_offset(excess, peak)
    over_floor = power / (float(floor[peak]) * spectrum.noise_bandwidth_hz)
    linear, quadratic = FREQUENCY_VARIANCE
    variance = (linear / over_floor + quadratic / over_floor**2) / spectrum.averages
    wander = extra if smeared else min(extra, (WANDER_SIGMAS * speed_scatter * peak) ** 2)
    variance += WANDER_CORRELATION * wander / spectrum.averages
    variance += SKIRT_PULL**2 * float(skirts[peak]) * spectrum.resolution_hz / power
    return Line(
        frequency_hz=(peak + offset) * spectrum.resolution_hz,
        frequency_error_hz=math.sqrt(variance) * spectrum.resolution_hz,
        rms=math.sqrt(power),
        prominence_db=10.0 * math.log10(over_floor),
        width_hz=math.sqrt(extra) * spectrum.resolution_hz if smeared else 0.0,
    )


def _is_smeared(excess: Array, scatter: Array, peak: int, smear: int) -> bool:
    """Whether a peak of a run with a moving speed is broader than a window's lobe: most of its power lies beyond."""
    low, high = max(1, peak - MAIN_LOBE - smear), min(excess.size, peak + MAIN_LOBE + smear + 1)
    lobe = float(excess[peak - MAIN_LOBE : peak + MAIN_LOBE + 1].sum())
    whole = float(excess[low:high].sum())
    doubt = 1.4 * float(np.sqrt(np.sum(scatter[low:high] ** 2)))
    return whole - lobe > max(0.2 * whole, 2.0 * doubt)


def _recentred(excess: Array, peak: int, smear: int) -> int:
    """Centre of a smeared line; its highest peak may stand at its edge, where the speed turned."""
    centre = peak
    for _ in range(6):
        low, high = max(1, centre - smear), min(excess.size, centre + smear + 1)
        weights = np.clip(excess[low:high], 0.0, None)
        moved = round(float(np.arange(low, high) @ weights / weights.sum())) if weights.sum() > 0.0 else centre
        if moved == centre:
            break
        centre = moved
    return centre


def _smear_of_lines(difference: Array, over_db: Array, peaks: NDArray[np.int64]) -> float:
    """Relative smear that several strong lines share; 0 where they do not: then nothing tells smear from neighbours."""
    found, seen = [], np.zeros(difference.size, dtype=bool)
    for peak in map(int, peaks[np.argsort(-over_db[peaks])]):
        half = math.ceil(WIDEST_SMEAR * peak)
        low, high = max(1, peak - half), min(difference.size, peak + half + 1)
        if over_db[peak] < STRONG_DB or seen[peak] or half <= 2 * MAIN_LOBE:
            continue
        seen[low:high] = True
        centre = _recentred(difference, peak, half)
        low, high = max(1, centre - half), min(difference.size, centre + half + 1)
        seen[low:high] = True
        weights = np.clip(difference[low:high], 0.0, None)
        weights[weights < 0.02 * weights.max()] = 0.0
        moment = float((np.arange(low, high) - centre) ** 2 @ weights / weights.sum()) - HANN_SECOND_MOMENT
        lobe = float(weights[max(0, peak - MAIN_LOBE - low) : peak + MAIN_LOBE + 1 - low].sum() / weights.sum())
        if abs(centre - peak) <= half and lobe < 0.8 and moment > 1.0:
            found.append(math.sqrt(moment) / centre)
    if len(found) < 2:
        return 0.0
    middle = float(np.median(found))
    shared = [value for value in found if middle / 1.6 <= value <= 1.6 * middle]
    return float(np.median(shared)) if len(shared) >= 2 else 0.0


def _guarded(taken: NDArray[np.bool_], density: Array, floor: Array, relative: float) -> NDArray[np.bool_]:
    """Lines with what lies beside them: twice the smear, and skirts until these reach the floor."""
    guarded = taken.copy()
    edges = np.flatnonzero(np.diff(taken.astype(np.int8)))
    for edge in map(int, edges):
        side = -1 if taken[edge + 1] else 1
        far = max(SHOULDER // 2, math.ceil(GUARD * relative * edge))
        end = edge + side * far
        while 3 < end < density.size - 4 and np.median(density[end - 3 : end + 4] / floor[end - 3 : end + 4]) > 2.0:
            end += side
        low, high = sorted((edge, end))
        guarded[max(0, low) : high + 1] = True
    return guarded


def _broad_bumps(
    spectrum: Spectrum, floor: Array, taken: NDArray[np.bool_], relative: float, least_sigmas: float
) -> list[tuple[int, int]]:
    """Places and half widths where a band of a smeared line's width stands over the bands beside it, the surest first.

    A line that follows a moving speed may stand nowhere above the scatter of single lines, and yet
    clearly above it in the sum over its width.
    """
    n = floor.size
    at = np.arange(n)
    half = np.ceil(1.5 * relative * at).astype(int)
    low, high = at - half, at + half + 1
    side = 2 * np.maximum(half, SHOULDER // 2)
    reach = half + side
    usable = (half >= MAIN_LOBE) & (at - reach > 0) & (at + reach + 1 < n) & (at * spectrum.resolution_hz > LOWEST_HZ)
    places = at[usable]
    if places.size == 0:
        return []
    ratio = np.where(taken, 1.0, spectrum.density / floor)
    total = np.concatenate(([0.0], np.cumsum(ratio)))
    flat = np.concatenate(([0.0], np.cumsum(np.minimum(ratio, 3.0))))
    low, high, reach, half, side = low[usable], high[usable], reach[usable], half[usable], side[usable]
    left = (flat[low] - flat[places - reach]) / (low - places + reach)
    right = (flat[places + reach + 1] - flat[high]) / (places + reach + 1 - high)
    beside = np.maximum(1.0, 0.5 * (left + right))
    core = high - low
    scatter = beside * np.sqrt(HANN_CORRELATION * core * (1.0 + core / (2.0 * side)) / spectrum.averages)
    sure = (total[high] - total[low] - core * beside) / scatter
    blocked = np.concatenate(([0], np.cumsum(taken)))
    sure[blocked[high] - blocked[low] > 0] = 0.0
    widths, of_width = np.unique(core, return_inverse=True)
    sure /= _heavy_tail(2.0 * spectrum.averages * widths / HANN_CORRELATION, least_sigmas)[of_width]
    found: list[tuple[int, int]] = []
    for index in np.argsort(-sure):
        if sure[index] < least_sigmas:
            break
        place, width = int(places[index]), int(half[index])
        if all(abs(place - other) > 2 * max(width, reached) for other, reached in found):
            found.append((place, width))
    return found


def _heavy_tail(freedom: Array, sigmas: float) -> Array:
    """By how much a sum of powers exceeds, in its own standard deviations, what a normal number does as rarely."""
    chance = float(stats.norm.sf(sigmas))
    return np.asarray((stats.chi2.isf(chance, freedom) - freedom) / np.sqrt(2.0 * freedom) / sigmas)


def _skirt(line: Line, n_lines: int, resolution_hz: float) -> Array:
    """Density of a sinusoid beyond its main lobe, shape (n_lines,): the envelope of a Hann window's side lobes."""
    distance = np.abs(np.arange(n_lines) - line.frequency_hz / resolution_hz)
    distance = np.maximum(distance, MAIN_LOBE)
    envelope = 1.0 / (math.pi * distance * (distance**2 - 1.0)) ** 2
    return line.rms**2 / (NOISE_BANDWIDTH_LINES * resolution_hz) * envelope


def find_lines(spectrum: Spectrum, prominence_db: float = 4.0, speed_scatter: float = 0.0) -> tuple[Line, ...]:
    """Find the lines of a spectrum.

    A line is a peak that stands over the local floor by more than chance and
    more than `prominence_db`, and over the valleys beside it by more than the
    scatter of the estimate, so that the flank of a strong line or the ragged
    top of a broad one gives no second line; nor does the top of a resonance,
    which does not stand over what lies right beside it. Then a line that the
    speed smears, so that it stands out only in the sum over its width.

    Parameters
    ----------
    spectrum : Spectrum
    prominence_db : float
        Least prominence (see `Line`).
    speed_scatter : float
        Relative standard deviation of the speed within the run: a line that
        follows the speed may be that much smeared. 0 where it is not known: then
        the smear that strong lines share, or else `UNKNOWN_SCATTER`.

    Returns
    -------
    tuple of Line
        By frequency.
    """
    density, floor = spectrum.density, local_floor(spectrum)
    if density.size < 2 * MAIN_LOBE + 3 or not np.all(np.isfinite(density)):
        return ()
    height_db, valley_db = _thresholds(spectrum, prominence_db)
    over_db = 10.0 * np.log10(np.maximum(density, floor * 1e-3) / floor)
    peaks, _ = signal.find_peaks(over_db, height=height_db, prominence=valley_db)
    lowest = max(MAIN_LOBE + 1, math.ceil(LOWEST_HZ / spectrum.resolution_hz))
    peaks = peaks[(peaks >= lowest) & (peaks < density.size - MAIN_LOBE - 1)]
    if speed_scatter == 0.0:
        speed_scatter = _smear_of_lines(density - floor, over_db, peaks)
    search = _Search(spectrum, floor, prominence_db, speed_scatter)
    for peak in map(int, peaks[np.argsort(-over_db[peaks])]):
        search.take_peak(peak, height_db)
    least_sigmas = BUMP_SIGMAS if speed_scatter > 0.0 else BLIND_BUMP_SIGMAS
    for relative in (speed_scatter,) if speed_scatter > 0.0 else UNKNOWN_SCATTER:
        search.take_bumps(relative, least_sigmas)
    return tuple(sorted(search.lines, key=lambda line: line.frequency_hz))


class _Search:
    """The lines of a spectrum found so far, and which of its frequencies they fill."""

    def __init__(self, spectrum: Spectrum, floor: Array, prominence_db: float, speed_scatter: float) -> None:
        self._spectrum, self._floor, self._prominence_db = spectrum, floor, prominence_db
        self._difference = spectrum.density - floor
        self._scatter = floor / math.sqrt(spectrum.averages)
        freedom = 2.0 * spectrum.averages
        self._mean_over_median = freedom / float(stats.chi2.median(freedom))
        self._taken = np.zeros(floor.size, dtype=bool)
        self._skirts = np.zeros(floor.size)
        self._speed_scatter = speed_scatter
        self.lines: list[Line] = []

    def take_peak(self, peak: int, height_db: float) -> None:
        """Take a peak that no stronger line has filled, as broad as the speed or its own shape makes it."""
        if self._taken[peak] or self._is_skirt(peak, height_db):
            return
        smear = math.ceil(2.5 * self._speed_scatter * peak)
        if smear > 1 and _is_smeared(self._difference, self._scatter, peak, smear):
            centre = _recentred(self._difference, peak, smear)
            self._take(centre, MAIN_LOBE + max(smear, abs(centre - peak)), height_db)
        else:
            excess = np.clip(self._difference - self._skirts, 0.0, None)
            self._take(peak, _reach(excess, peak, MAIN_LOBE + min(smear, 1), float(self._scatter[peak])), height_db)

    def take_bumps(self, relative: float, least_sigmas: float) -> None:
        """Take lines that stand out only in the sum over a relative smear."""
        guarded = _guarded(self._taken, self._spectrum.density, self._floor, relative)
        guarded |= self._skirts > SKIRT_PART * self._floor
        for place, half in _broad_bumps(self._spectrum, self._floor, guarded, relative, least_sigmas):
            self._take(_recentred(self._difference, place, half), half + MAIN_LOBE, 0.0)

    def _take(self, centre: int, reach: int, least_db: float) -> None:
        """Measure and keep a line, unless it is too weak or the top of a resonance."""
        if self._taken[centre]:
            return
        density = self._spectrum.density
        low, high = self._own(centre, reach)
        line = _measure(self._spectrum, self._floor, self._skirts, centre, (low, high), self._speed_scatter)
        beside = self._beside(low, high)
        over_beside_db = 10.0 * math.log10(float(density[low:high].max()) / beside) if beside > 0.0 else math.inf
        if line is not None and line.prominence_db >= self._prominence_db and over_beside_db >= least_db:
            self.lines.append(line)
            self._taken[low:high] = True
            self._skirts += _skirt(line, density.size, self._spectrum.resolution_hz)

    def _own(self, centre: int, reach: int) -> tuple[int, int]:
        """Lines of the spectrum within reach that no stronger line has, as (first, last + 1)."""
        low, high = max(1, centre - reach), min(self._taken.size - 1, centre + reach + 1)
        left, right = np.flatnonzero(self._taken[low:centre]), np.flatnonzero(self._taken[centre:high])
        return (low + int(left[-1]) + 1 if left.size else low), (centre + int(right[0]) if right.size else high)

    def _is_skirt(self, peak: int, height_db: float) -> bool:
        """Whether the skirts of stronger lines and the floor, in phase by chance, are a peak without any line."""
        chance = math.sqrt(10.0 ** (0.1 * height_db) * self._floor[peak])
        return bool(math.sqrt(self._spectrum.density[peak]) < math.sqrt(self._skirts[peak]) + chance)

    def _beside(self, low: int, high: int) -> float:
        """Floor right beside `low` to `high`: the median of the quieter side, lines left out; 0 where none is free."""
        density, width = self._spectrum.density, SHOULDER + (high - low)
        sides = []
        for start, end in ((max(1, low - width), low), (high, min(density.size, high + width))):
            free = density[start:end][~self._taken[start:end]]
            if free.size >= SHOULDER // 2:
                sides.append(float(np.median(free)))
        return min(sides, default=0.0) * self._mean_over_median

"""A straight line through delays over time, robust, with errors that hold where neighbours err alike."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from tdacoustic.clocks.delays import Delays
from tdacoustic.clocks.relation import ResidualDelays

__all__ = ["DelayLine", "fit_line"]

Array = NDArray[np.float64]

BIWEIGHT: Final = 6.0
"""Residuals beyond so many standard deviations count nothing."""
GAUSSIAN: Final = 1.13
"""By which weighting outliers down makes the variance of normal residuals too small."""
ROUNDS: Final = 20
MOST_GROUPS: Final = 24
WINDOWS_PER_GROUP: Final = 3
LEAST_FOR_SCALE: Final = 8
DOUBTFUL: Final = 1e-3
"""Probability below which groups scatter more than their windows explain."""


@dataclass(frozen=True)
class DelayLine:
    """``delay(t) = delay_s + slope (t - time_s)``.

    Parameters
    ----------
    time_s : float
        Where both errors are independent.
    delay_s, slope, delay_error_s, slope_error : float
    wander_s : float
        Root mean square of the groups' residuals beyond their scatter; 0 where they scatter no more than they should.
    n_used : int
    groups : ResidualDelays
    """

    time_s: float
    delay_s: float
    slope: float
    delay_error_s: float
    slope_error: float
    wander_s: float
    n_used: int
    groups: ResidualDelays

    def error_at(self, time_s: float) -> float:
        """Return the standard error of the line at an instant."""
        return float(np.hypot(self.delay_error_s, self.slope_error * (time_s - self.time_s)))


def fit_line(delays: Delays) -> DelayLine:
    """Fit a line to delays by their errors; outliers count less, then nothing.

    Parameters
    ----------
    delays : Delays
        Of two windows at least.
    """
    times, values, errors = delays.times_s, delays.delays_s, delays.errors_s
    floor = 0.1 * float(np.median(errors))
    errors = np.maximum(errors, floor)
    robust = np.ones(times.size)
    scale = 1.0
    for _ in range(ROUNDS):
        weights = robust / errors**2
        centre, level, slope = _weighted(times, values, weights)
        standard = (values - level - slope * (times - centre)) / errors
        if times.size >= LEAST_FOR_SCALE:
            scale = max(0.3, float(np.median(np.abs(standard))) * 1.4826)
        robust = np.clip(1.0 - (standard / (BIWEIGHT * scale)) ** 2, 0.0, None) ** 2
    weights = robust / errors**2
    centre, level, slope = _weighted(times, values, weights)
    kept = robust > 0.0
    n_used = int(np.count_nonzero(kept))
    residual = values - level - slope * (times - centre)
    spread = local = 1.0
    if n_used >= LEAST_FOR_SCALE:
        weighted = float(np.sum((robust * residual**2 / errors**2)[kept]) / np.sum(robust))
        spread = float(np.sqrt(weighted * GAUSSIAN * n_used / (n_used - 2)))
        # neighbours differ by scatter alone, whatever a clock does slowly
        steps = np.diff((residual / errors)[kept][np.argsort(times[kept])])
        local = min(spread, float(np.sqrt(0.5 * np.mean(steps**2))))
    groups, ratio, doubtful = _groups(times[kept], residual[kept], errors[kept] * local)
    total = float(np.sum(weights))
    lever = float(np.sum(weights * (times - centre) ** 2))
    factor = max(spread, local * np.sqrt(ratio)) if doubtful else spread
    jackknifed = _jackknife(times[kept], values[kept], weights[kept], centre)
    rms = float(np.sqrt(np.average(groups.delays_s**2, weights=groups.errors_s**-2.0)))
    wander_s = rms * float(np.sqrt(max(0.0, 1.0 - 1.0 / ratio))) if doubtful else 0.0
    return DelayLine(
        centre,
        level,
        slope,
        max(factor / np.sqrt(total), jackknifed[0]),
        max(factor / np.sqrt(lever), jackknifed[1]) if lever > 0.0 else np.inf,
        wander_s,
        n_used,
        groups,
    )


def _jackknife(times: Array, values: Array, weights: Array, centre: float) -> tuple[float, float]:
    """Standard errors of level and slope by leaving out one group of neighbours after another."""
    parts = np.array_split(np.argsort(times), min(MOST_GROUPS, times.size))
    if len(parts) < LEAST_FOR_SCALE:
        return 0.0, 0.0
    found = []
    for part in parts:
        left = np.ones(times.size, dtype=bool)
        left[part] = False
        middle, level, slope = _weighted(times[left], values[left], weights[left])
        found.append((level + slope * (centre - middle), slope))
    spread = np.sqrt(len(parts) - 1.0) * np.std(np.array(found), axis=0)
    return float(spread[0]), float(spread[1])


def _weighted(times: Array, values: Array, weights: Array) -> tuple[float, float, float]:
    total = float(np.sum(weights))
    centre = float(np.sum(weights * times) / total)
    level = float(np.sum(weights * values) / total)
    lever = float(np.sum(weights * (times - centre) ** 2))
    slope = float(np.sum(weights * (times - centre) * values)) / lever if lever > 0.0 else 0.0
    return centre, level, slope


def _groups(times: Array, residual: Array, errors: Array) -> tuple[ResidualDelays, float, bool]:
    """Means of neighbouring windows, their chi-square by degree of freedom, and whether chance explains it."""
    n_groups = max(1, min(MOST_GROUPS, times.size // WINDOWS_PER_GROUP))
    parts = np.array_split(np.argsort(times), n_groups)
    weights = [1.0 / errors[part] ** 2 for part in parts]
    when = np.array([np.average(times[part], weights=w) for part, w in zip(parts, weights, strict=True)])
    mean = np.array([np.average(residual[part], weights=w) for part, w in zip(parts, weights, strict=True)])
    error = np.array([1.0 / np.sqrt(np.sum(w)) for w in weights])
    held = ResidualDelays(when, mean, error)
    freedom = n_groups - 2
    if freedom < 2:
        return held, 1.0, False
    chi_square = float(np.sum((mean / error) ** 2))
    return held, max(1.0, chi_square / freedom), bool(stats.chi2.sf(chi_square, freedom) < DOUBTFUL)

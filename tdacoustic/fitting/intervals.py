"""Intervals of fitted parameters by profile likelihood, through lmfit."""

from __future__ import annotations

import math
from typing import Final, TypeAlias

import numpy as np

from tdacoustic.fitting.least_squares import fit
from tdacoustic.fitting.loss import Residuals
from tdacoustic.fitting.optimum import Fit
from tdacoustic.fitting.parameters import FreeParameter

__all__ = ["ProfileInterval", "profile_intervals", "quantile_of"]

_STEPS: Final = 40
_CLOSE: Final = 2e-3
_NO_MODEL: Final = 1e30

ProfileInterval: TypeAlias = tuple[float | None, float | None]
"""Lower and upper end; None where the bound comes before the end of the interval."""


def quantile_of(level: float, freedom: float | None = None) -> float:
    """Return how many standard errors an interval reaches to each side.

    Parameters
    ----------
    level : float
        Between 0 and 1.
    freedom : float, optional
        Degrees of freedom from which the scatter was taken (Student's t). Default: it is known.

    Examples
    --------
    >>> round(quantile_of(0.95), 3), round(quantile_of(0.95, 4), 3)
    (1.96, 2.776)
    """
    from scipy.stats import norm, t

    place = 0.5 * (1.0 + level)
    return float(norm.ppf(place) if freedom is None else t.ppf(place, freedom))


def profile_intervals(
    residuals: Residuals, found: Fit, level: float = 0.95, freedom: float | None = None
) -> dict[str, ProfileInterval]:
    """Return the profile-likelihood interval of each moved parameter that is determined, in its own unit.

    An end is where the chi square, minimised over the other parameters, has risen by the square of the quantile (times
    the misfit's variance where the data's standard deviations are not known). Unlike a standard error it is right where
    the model bends and where a bound is near.

    Parameters
    ----------
    residuals : callable
        Those of the fit.
    found : Fit
    level : float
    freedom : float, optional
        See `quantile_of`.
    """
    scale = 1.0 if found.known_sigma or found.n_free < 1 else found.chi_square / found.n_free
    rise = quantile_of(level, freedom) ** 2 * scale
    errors = found.inner_errors() or {}
    return {
        parameter.name: (
            _end(residuals, found, parameter, -1.0, rise, errors),
            _end(residuals, found, parameter, 1.0, rise, errors),
        )
        for parameter in found.moved
        if parameter.name in errors
    }


def _end(
    residuals: Residuals,
    found: Fit,
    parameter: FreeParameter,
    direction: float,
    rise: float,
    errors: dict[str, float],
) -> float | None:
    from scipy.optimize import brentq

    best = parameter.inner(found.values[parameter.name])
    limit = parameter.inner(parameter.low if direction < 0.0 else parameter.high)
    step = errors[parameter.name] * math.sqrt(rise) or 0.1 * max(abs(best), 1.0)

    def above(place: float) -> float:
        """Zero at the end of the interval, and close to a straight line towards it."""
        if place == best:
            return -math.sqrt(rise)
        risen = _profile(residuals, found, parameter, place) - found.chi_square
        return math.sqrt(max(risen, 0.0)) - math.sqrt(rise)

    inside, outside = best, best + direction * step
    for _ in range(_STEPS):
        outside = min(outside, limit) if direction > 0.0 else max(outside, limit)
        if outside == inside:
            return None
        if above(outside) >= 0.0:
            end = brentq(above, inside, outside, xtol=_CLOSE * abs(outside - best), maxiter=_STEPS)
            return parameter.outer(float(end))
        if outside == limit or not math.isfinite(outside):
            return None
        inside, outside = outside, best + 1.6 * (outside - best)
    return None


def _profile(residuals: Residuals, found: Fit, held: FreeParameter, place: float) -> float:
    """Chi square minimised over all parameters but one, with its prior's part for the place it is held at."""
    value = held.outer(place)
    others = [
        p.fixed_at(value) if p.name == held.name else p.starting_at(found.values[p.name]) for p in found.parameters
    ]
    if not np.isfinite(residuals({**found.values, held.name: value})).all():
        return _NO_MODEL
    of_prior = 0.0 if held.prior is None else ((place - held.prior[0]) / held.prior[1]) ** 2
    again = fit(residuals, others, loss=found.loss, known_sigma=found.known_sigma, polish=False)
    return again.chi_square + of_prior

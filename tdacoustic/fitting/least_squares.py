"""Weighted least squares from several starts, through lmfit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FittingError
from tdacoustic.fitting.derivatives import STEP, jacobian_of
from tdacoustic.fitting.loss import Loss, Objective, Residuals, finite
from tdacoustic.fitting.optimum import RANK, Fit
from tdacoustic.fitting.parameters import FreeParameter, lmfit_parameters, values_of
from tdacoustic.fitting.starts import best_starts, spread_starts

if TYPE_CHECKING:
    import lmfit

__all__ = ["fit"]

Real = NDArray[np.float64]

Optimum: TypeAlias = tuple[float, dict[str, float]]
"""Chi square, or what a loss makes of it, and the values."""

BETTER: Final = 1e-6
"""Relative difference of chi square from which one optimum is better than another."""

NOTHING: Final = 1e-9
"""Change of weighted residuals that is round-off."""

SAME_MINIMUM: Final = 0.05
"""Distance of two optima over the bounds (or the values) below which they are one."""

_POLISHING: Final = 10


def fit(
    residuals: Residuals,
    parameters: Sequence[FreeParameter],
    starts: int = 1,
    loss: Loss = "linear",
    known_sigma: bool = True,
    seed: int = 0,
    polish: bool = True,
    resolution: float = RANK,
    step: float = STEP,
) -> Fit:
    """Minimise the sum of squared weighted residuals.

    Parameters
    ----------
    residuals : callable
        From values by name to residuals over their standard deviations.
    parameters : sequence of FreeParameter
    starts : int
        The initial values, and starts spread over the bounds, of which the search goes on from the best `REFINED`;
        parameters without bounds start where they are.
    loss : str
        ``"linear"``, or one of scipy's robust losses.
    known_sigma : bool
        Whether the residuals' standard deviations are known; else errors are scaled with the misfit.
    seed : int
        Of the spread of starts.
    polish : bool
        Whether the last digits are wanted.
    resolution : float
        See `Fit`.
    step : float
        Of the differences of the Jacobian, relative to a value on the scale of the fit.

    Raises
    ------
    FittingError
        Nothing can be fitted: a residual that is no number at the start, or fewer residuals than the fit can use.
    """
    held = tuple(parameters)
    objective = Objective(residuals, held, loss)
    n_data = _checked(residuals, held)
    begun = best_starts(objective, held, spread_starts(held, starts, seed))
    unseen = _unseen(objective, held, begun[:2]) if starts > 1 else frozenset()
    searched = tuple(replace(p, fixed=True, prior=None) if p.name in unseen else p for p in held)
    begun = [{**start, **{name: begun[0][name] for name in unseen}} for start in begun]
    optima = [_minimised(objective, searched, start, polish) for start in begun]
    optima = [found for found in optima if math.isfinite(found[0])]
    if not optima:
        raise FittingError("no start of the fit ended in an optimum")
    ranked = _ranked(optima)
    best = ranked[0]
    jacobian = jacobian_of(objective.rows, held, best[1], step)
    if loss != "linear":
        jacobian = jacobian * np.sqrt(objective.weights(objective.rows(best[1])))[:, None]
    jacobian[:, [p.name in unseen for p in held if p.is_moved]] = 0.0  # but for round-off it is
    others = _distinct(held, ranked)
    return Fit(held, best[1], best[0], n_data, jacobian, others, known_sigma, loss, resolution)


def _unseen(
    objective: Objective, parameters: tuple[FreeParameter, ...], starts: list[dict[str, float]]
) -> frozenset[str]:
    """Names of parameters that change nothing between their bounds, seen from some starts.

    Round-off must not move them.
    """
    found = set()
    for parameter in parameters:
        if not parameter.is_moved or parameter.prior is not None or not math.isfinite(parameter.width):
            continue
        ends = parameter.inner(parameter.low), parameter.inner(parameter.high)
        changes = []
        for start in starts:
            rows = [
                finite(
                    objective.rows(values_of(parameters, lmfit_parameters(parameters, {**start, parameter.name: end})))
                )
                for end in ends
            ]
            changes.append(float(np.abs(rows[1] - rows[0]).max(initial=0.0)))
            if changes[-1] <= NOTHING:  # a curve could come back to where it was
                middle = {**start, parameter.name: 0.5 * (ends[0] + ends[1])}
                between = finite(objective.rows(values_of(parameters, lmfit_parameters(parameters, middle))))
                changes[-1] = float(np.abs(between - rows[0]).max(initial=0.0))
        if max(changes) <= NOTHING:
            found.add(parameter.name)
    return frozenset(found)


def _ranked(optima: list[Optimum]) -> list[Optimum]:
    """Optima by their cost; that of the initial values first where no other is better by more than round-off.

    What the data do not see then stays where it was.
    """
    first = optima[0]
    ranked = sorted(optima, key=lambda found: found[0])
    if ranked[0][0] < first[0] - BETTER * (1.0 + first[0]):
        return ranked
    return [first, *(found for found in ranked if found is not first)]


def _checked(residuals: Residuals, parameters: tuple[FreeParameter, ...]) -> int:
    start = residuals(values_of(parameters, lmfit_parameters(parameters)))
    if start.size == 0:
        raise FittingError("there are no data to fit to")
    if not np.isfinite(start).all():
        raise FittingError("the model gives no number for some of the data at the initial values")
    return int(start.size)


def _minimised(
    objective: Objective, parameters: tuple[FreeParameter, ...], start: dict[str, float], polish: bool
) -> Optimum:
    """Return chi square and values of the optimum that a start ends in.

    Bounds and robust losses go to the trust-region method; without them Levenberg and Marquardt's is tried too.
    """
    import lmfit

    made = lmfit_parameters(parameters, start)

    def residual(found: lmfit.Parameters) -> Real:
        return finite(objective.rows(values_of(parameters, found)))

    if not any(parameter.is_moved for parameter in parameters):
        values = values_of(parameters, made)
        return objective.cost(values), values
    close = 1e-8 if _has_bounds(parameters) else 1e-12  # what is bounded is costly, and polished afterwards
    options: dict[str, Any] = {"xtol": close, "ftol": close, "gtol": close, "calc_covar": False, "x_scale": "jac"}
    with np.errstate(invalid="ignore", divide="ignore"):  # of a singular covariance, which is not lmfit's to judge
        ends = [lmfit.minimize(residual, made, method="least_squares", loss=objective.scipy_loss, **options)]
    moved = sum(parameter.is_moved for parameter in parameters)
    if objective.loss == "linear" and residual(made).size >= moved and not _has_bounds(parameters):
        ends.append(lmfit.minimize(residual, made, method="leastsq", xtol=1e-14, ftol=1e-14, calc_covar=False))
    found = [values_of(parameters, end.params) for end in ends]
    optima = [(objective.cost(values), values) for values in found]
    best = min(optima, key=lambda optimum: optimum[0])
    return _polished(objective, parameters, best) if objective.loss == "linear" and polish else best


def _polished(objective: Objective, parameters: tuple[FreeParameter, ...], optimum: Optimum) -> Optimum:
    """Take Gauss-Newton steps with central differences, which carry more digits than those of the search."""
    moved = [parameter for parameter in parameters if parameter.is_moved]
    for _ in range(_POLISHING):
        chi_square, values = optimum
        jacobian = jacobian_of(objective.rows, parameters, values)
        norms = np.linalg.norm(jacobian, axis=0)
        if not np.isfinite(jacobian).all() or not norms.all():
            break
        step = np.linalg.lstsq(jacobian / norms, -objective.rows(values), rcond=RANK)[0] / norms
        inner = {p.name: p.inner(values[p.name]) + float(d) for p, d in zip(moved, step, strict=True)}
        if any(not p.inner(p.low) <= inner[p.name] <= p.inner(p.high) for p in moved):
            break
        trial = values_of(parameters, lmfit_parameters(parameters, inner))
        reached = objective.cost(trial)
        if not reached <= chi_square * (1.0 + 1e-13):
            break
        optimum = (reached, trial)
        if all(abs(d) <= 1e-12 * max(abs(inner[p.name]), 1e-300) for p, d in zip(moved, step, strict=True)):
            break
    return optimum


def _has_bounds(parameters: tuple[FreeParameter, ...]) -> bool:
    return any(p.is_moved and (math.isfinite(p.inner(p.low)) or math.isfinite(p.inner(p.high))) for p in parameters)


def _distinct(parameters: tuple[FreeParameter, ...], optima: list[Optimum]) -> tuple[Optimum, ...]:
    kept = [optima[0]]
    for found in optima[1:]:
        if all(_apart(parameters, found[1], other[1]) for other in kept):
            kept.append(found)
    return tuple(kept[1:])


def _apart(parameters: tuple[FreeParameter, ...], first: dict[str, float], second: dict[str, float]) -> bool:
    for parameter in parameters:
        if not parameter.is_moved:
            continue
        a, b = parameter.inner(first[parameter.name]), parameter.inner(second[parameter.name])
        width = parameter.width
        if abs(a - b) > SAME_MINIMUM * (width if math.isfinite(width) else max(abs(a), abs(b), 1e-12)):
            return True
    return False

"""Weighted least squares from several starts, through lmfit, and what the optimum can and cannot tell."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FittingError
from tdacoustic.fitting.parameters import FreeParameter, lmfit_parameters, values_of

if TYPE_CHECKING:
    import lmfit

__all__ = ["Fit", "Loss", "Residuals", "fit"]

Real = NDArray[np.float64]
Residuals: TypeAlias = Callable[[Mapping[str, float]], Real]
"""From values by name to residuals over their standard deviations."""

Loss = Literal["linear", "soft_l1", "huber", "cauchy", "arctan"]

SAME_MINIMUM: Final = 0.05
"""Distance of two optima over the bounds (or the values) below which they are one."""

RANK: Final = 1e-10
"""Singular value of the Jacobian, its columns of length one, over the largest, below which a direction is not seen."""

REFINED: Final = 4
"""Starts from which the search goes on."""

_NO_NUMBER: Final = 1e50
_POLISHING: Final = 10


@dataclass(frozen=True)
class Fit:
    """An optimum and its neighbourhood.

    Parameters
    ----------
    parameters : tuple of FreeParameter
        Moved or given by an expression.
    values : dict of str to float
    chi_square : float
        Sum of squared weighted residuals, those of priors too.
    n_data : int
        Residuals without priors.
    jacobian : ndarray, shape (residuals, moved)
        Of the weighted residuals by the moved parameters on the scale of the fit, priors' rows last.
    minima : tuple of (float, dict)
        Other optima that starts ended in, with their chi square, better ones first; the best one is left out.
    known_sigma : bool
        Whether the standard deviations of the data are known; else errors are scaled with the misfit.
    """

    parameters: tuple[FreeParameter, ...]
    values: dict[str, float]
    chi_square: float
    n_data: int
    jacobian: Real
    minima: tuple[tuple[float, dict[str, float]], ...]
    known_sigma: bool

    @property
    def moved(self) -> tuple[FreeParameter, ...]:
        """Parameters that the fit moved."""
        return tuple(parameter for parameter in self.parameters if parameter.is_moved)

    @property
    def n_free(self) -> int:
        """Data less moved parameters without a prior; may be below one."""
        return self.n_data - sum(parameter.prior is None for parameter in self.moved)

    @property
    def singular_values(self) -> Real:
        """Of the data's part of the Jacobian with columns of length one, largest first.

        A parameter that moves no datum has a column of zeros, and adds a zero.
        """
        if not self.moved:
            return np.zeros(0)
        seen = self.jacobian[: self.n_data]
        norms = np.linalg.norm(seen, axis=0)
        return np.asarray(np.linalg.svd(seen / np.where(norms > 0.0, norms, 1.0), compute_uv=False))

    @property
    def rank(self) -> int:
        """Directions that the data see."""
        values = self.singular_values
        return int((values > RANK * max(values.max(initial=0.0), 1e-300)).sum())

    @property
    def covariance(self) -> Real | None:
        """Of the moved parameters on the scale of the fit; None where it cannot be had."""
        if not self.moved:
            return np.zeros((0, 0))
        norms = np.linalg.norm(self.jacobian, axis=0)
        if not np.isfinite(self.jacobian).all() or not norms.all():
            return None
        _, values, directions = np.linalg.svd(self.jacobian / norms, full_matrices=False)
        if len(values) < len(self.moved) or values[-1] <= RANK * values[0]:
            return None
        scale = 1.0
        if not self.known_sigma:
            if self.n_free < 1:
                return None
            scale = self.chi_square / self.n_free
        return np.asarray(scale * (directions.T / values**2) @ directions / np.outer(norms, norms))

    def inner_errors(self) -> dict[str, float] | None:
        """Standard errors on the scale of the fit by name; None where they cannot be had."""
        covariance = self.covariance
        if covariance is None:
            return None
        return {p.name: math.sqrt(max(c, 0.0)) for p, c in zip(self.moved, np.diag(covariance), strict=True)}

    def standard_errors(self) -> dict[str, float] | None:
        """Standard errors in the values' own units, by name; of a logarithmic parameter to first order."""
        errors = self.inner_errors()
        if errors is None:
            return None
        return {p.name: errors[p.name] * (self.values[p.name] if p.scale == "log" else 1.0) for p in self.moved}

    def correlation(self) -> Real | None:
        """Correlation of the moved parameters; None where it cannot be had."""
        covariance = self.covariance
        if covariance is None:
            return None
        errors = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
        return np.asarray(covariance / np.outer(errors, errors))


def fit(
    residuals: Residuals,
    parameters: Sequence[FreeParameter],
    starts: int = 1,
    loss: Loss = "linear",
    known_sigma: bool = True,
    seed: int = 0,
    polish: bool = True,
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

    Raises
    ------
    FittingError
        Nothing can be fitted: a residual that is no number at the start, or fewer residuals than the fit can use.
    """
    held = tuple(parameters)
    weighted = _with_priors(residuals, held)
    n_data = _checked(residuals, held)
    begun = _best(weighted, held, _starts(held, starts, seed))
    optima = [_minimised(weighted, held, start, loss, polish) for start in begun]
    optima = sorted((found for found in optima if math.isfinite(found[0])), key=lambda found: found[0])
    if not optima:
        raise FittingError("no start of the fit ended in an optimum")
    best = optima[0]
    jacobian = _jacobian(weighted, held, best[1])
    others = _distinct(held, optima)
    return Fit(held, best[1], best[0], n_data, jacobian, others, known_sigma)


def _checked(residuals: Residuals, parameters: tuple[FreeParameter, ...]) -> int:
    start = residuals(values_of(parameters, lmfit_parameters(parameters)))
    if start.size == 0:
        raise FittingError("there are no data to fit to")
    if not np.isfinite(start).all():
        raise FittingError("the model gives no number for some of the data at the initial values")
    return int(start.size)


def _with_priors(residuals: Residuals, parameters: tuple[FreeParameter, ...]) -> Residuals:
    held = [(parameter, *parameter.prior) for parameter in parameters if parameter.prior is not None]

    def weighted(values: Mapping[str, float]) -> Real:
        from_priors = [(parameter.inner(values[parameter.name]) - mean) / sigma for parameter, mean, sigma in held]
        return np.concatenate([residuals(values), from_priors])

    return weighted


def _starts(parameters: tuple[FreeParameter, ...], n_starts: int, seed: int) -> list[dict[str, float]]:
    """Starts on the scale of the fit: the initial values, then a low-discrepancy spread over finite bounds."""
    initial = {parameter.name: parameter.inner(parameter.initial) for parameter in parameters}
    bounded = [p for p in parameters if p.is_moved and math.isfinite(p.inner(p.low)) and math.isfinite(p.inner(p.high))]
    if n_starts <= 1 or not bounded:
        return [initial]
    from scipy.stats import qmc

    spread = qmc.Halton(len(bounded), seed=seed).random(n_starts - 1)
    found = [initial]
    for row in spread:
        place = {
            p.name: p.inner(p.low) + float(part) * (p.inner(p.high) - p.inner(p.low))
            for p, part in zip(bounded, row, strict=True)
        }
        found.append({**initial, **place})
    return found


def _best(
    weighted: Residuals, parameters: tuple[FreeParameter, ...], starts: list[dict[str, float]]
) -> list[dict[str, float]]:
    """Return the initial values and the best of the other starts."""
    if len(starts) <= REFINED:
        return starts
    first, *others = starts

    def misfit(start: dict[str, float]) -> float:
        return float((_finite(weighted(values_of(parameters, lmfit_parameters(parameters, start)))) ** 2).sum())

    return [first, *sorted(others, key=misfit)[: REFINED - 1]]


def _minimised(
    weighted: Residuals, parameters: tuple[FreeParameter, ...], start: dict[str, float], loss: Loss, polish: bool
) -> tuple[float, dict[str, float]]:
    """Return chi square and values of the optimum that a start ends in.

    Bounds and robust losses go to the trust-region method; without them Levenberg and Marquardt's is tried too.
    """
    import lmfit

    made = lmfit_parameters(parameters, start)

    def residual(found: lmfit.Parameters) -> Real:
        return _finite(weighted(values_of(parameters, found)))

    if not any(parameter.is_moved for parameter in parameters):
        return float((residual(made) ** 2).sum()), values_of(parameters, made)
    close = 1e-8 if _has_bounds(parameters) else 1e-12  # what is bounded is costly, and polished afterwards
    options: dict[str, Any] = {"xtol": close, "ftol": close, "gtol": close, "calc_covar": False}
    with np.errstate(invalid="ignore", divide="ignore"):  # of a singular covariance, which is not lmfit's to judge
        ends = [lmfit.minimize(residual, made, method="least_squares", loss=loss, x_scale="jac", **options)]
    moved = sum(parameter.is_moved for parameter in parameters)
    if loss == "linear" and residual(made).size >= moved and not _has_bounds(parameters):
        ends.append(lmfit.minimize(residual, made, method="leastsq", xtol=1e-14, ftol=1e-14, calc_covar=False))
    found = [values_of(parameters, end.params) for end in ends]
    optima = [(float((_finite(weighted(values)) ** 2).sum()), values) for values in found]
    best = min(optima, key=lambda optimum: optimum[0])
    return _polished(weighted, parameters, best) if loss == "linear" and polish else best


def _finite(residuals: Real) -> Real:
    """What is no number is a misfit that no optimum has."""
    return np.where(np.isfinite(residuals), residuals, _NO_NUMBER)


def _polished(
    weighted: Residuals, parameters: tuple[FreeParameter, ...], optimum: tuple[float, dict[str, float]]
) -> tuple[float, dict[str, float]]:
    """Take Gauss-Newton steps with central differences, which carry more digits than those of the search."""
    moved = [parameter for parameter in parameters if parameter.is_moved]
    for _ in range(_POLISHING):
        chi_square, values = optimum
        jacobian = _jacobian(weighted, parameters, values)
        norms = np.linalg.norm(jacobian, axis=0)
        if not np.isfinite(jacobian).all() or not norms.all():
            break
        step = np.linalg.lstsq(jacobian / norms, -weighted(values), rcond=RANK)[0] / norms
        inner = {p.name: p.inner(values[p.name]) + float(d) for p, d in zip(moved, step, strict=True)}
        if any(not p.inner(p.low) <= inner[p.name] <= p.inner(p.high) for p in moved):
            break
        trial = values_of(parameters, lmfit_parameters(parameters, inner))
        reached = float((_finite(weighted(trial)) ** 2).sum())
        if not reached <= chi_square * (1.0 + 1e-13):
            break
        optimum = (reached, trial)
        if all(abs(d) <= 1e-12 * max(abs(inner[p.name]), 1e-300) for p, d in zip(moved, step, strict=True)):
            break
    return optimum


def _has_bounds(parameters: tuple[FreeParameter, ...]) -> bool:
    return any(p.is_moved and (math.isfinite(p.inner(p.low)) or math.isfinite(p.inner(p.high))) for p in parameters)


def _jacobian(weighted: Residuals, parameters: tuple[FreeParameter, ...], values: dict[str, float]) -> Real:
    """Central differences on the scale of the fit; one-sided at a bound."""
    moved = [parameter for parameter in parameters if parameter.is_moved]
    columns = []
    for parameter in moved:
        place = parameter.inner(values[parameter.name])
        step = 1e-5 * (abs(place) or 1e-3)
        low, high = parameter.inner(parameter.low), parameter.inner(parameter.high)
        below, above = max(place - step, low), min(place + step, high)
        sides = []
        for side in (below, above):
            shifted = {**values, parameter.name: parameter.outer(side)}
            sides.append(weighted(_with_expressions(parameters, shifted)))
        columns.append((sides[1] - sides[0]) / (above - below))
    return np.stack(columns, axis=1) if columns else np.zeros((weighted(values).size, 0))


def _with_expressions(parameters: tuple[FreeParameter, ...], values: dict[str, float]) -> dict[str, float]:
    if all(parameter.is_moved for parameter in parameters):
        return values
    inner = {p.name: p.inner(values[p.name]) for p in parameters if p.is_moved}
    return values_of(parameters, lmfit_parameters(parameters, inner))


def _distinct(
    parameters: tuple[FreeParameter, ...], optima: list[tuple[float, dict[str, float]]]
) -> tuple[tuple[float, dict[str, float]], ...]:
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
        width = parameter.inner(parameter.high) - parameter.inner(parameter.low)
        if abs(a - b) > SAME_MINIMUM * (width if math.isfinite(width) else max(abs(a), abs(b), 1e-12)):
            return True
    return False

"""An optimum and its neighbourhood: rank, covariance, errors, correlation."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.fitting.derivatives import jacobian_of, with_expressions
from tdacoustic.fitting.loss import Loss
from tdacoustic.fitting.parameters import FreeParameter

__all__ = ["RANK", "Fit"]

Real = NDArray[np.float64]

RANK: Final = 1e-10
"""Singular value of the Jacobian, its columns of length one, over the largest, below which a direction is not seen: for
models that are exact to the last digits; others state theirs."""

_IN_THE_BLIND: Final = 1e-3
"""Part that a parameter has in a direction that nothing determines from which it is not determined either."""


@dataclass(frozen=True)
class Fit:
    """An optimum and its neighbourhood.

    Parameters
    ----------
    parameters : tuple of FreeParameter
        Moved or given by an expression.
    values : dict of str to float
    chi_square : float
        Sum of squared weighted residuals, those of priors too; of a robust loss, what it makes of them.
    n_data : int
        Residuals without priors.
    jacobian : ndarray, shape (residuals, moved)
        Of the weighted residuals by the moved parameters on the scale of the fit, priors' rows last; of a robust loss,
        each row times the root of its weight.
    minima : tuple of (float, dict)
        Other optima that starts ended in, with their chi square, better ones first; the best one is left out.
    known_sigma : bool
        Whether the standard deviations of the data are known; else errors are scaled with the misfit.
    loss : str
    resolution : float
        Singular value over the largest below which a direction is not seen.
    """

    parameters: tuple[FreeParameter, ...]
    values: dict[str, float]
    chi_square: float
    n_data: int
    jacobian: Real
    minima: tuple[tuple[float, dict[str, float]], ...]
    known_sigma: bool
    loss: Loss = "linear"
    resolution: float = RANK

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
        return _singular_values(self.jacobian[: self.n_data])

    @property
    def rank(self) -> int:
        """Directions that the data see."""
        values = self.singular_values
        return int((values > self.resolution * max(values.max(initial=0.0), 1e-300)).sum())

    @property
    def is_left_open(self) -> bool:
        """Whether the data do not see a direction among the parameters that have no prior."""
        columns = [index for index, parameter in enumerate(self.moved) if parameter.prior is None]
        values = _singular_values(self.jacobian[: self.n_data, columns])
        return bool(
            values.size < len(columns) or (values <= self.resolution * max(values.max(initial=0.0), 1e-300)).any()
        )

    @property
    def condition_number(self) -> float | None:
        """Largest over smallest of `singular_values`; None where one is zero."""
        values = self.singular_values
        return float(values[0] / values[-1]) if values.size and values[-1] > 0.0 else None

    @property
    def covariance(self) -> Real | None:
        """Of the moved parameters on the scale of the fit; NaN for those that nothing determines.

        None where that is all of them, or where errors are to be scaled with a misfit that has no degrees of freedom.
        """
        if not self.moved:
            return np.zeros((0, 0))
        seen = self._seen
        if seen is None or (not self.known_sigma and self.n_free < 1):
            return None
        covariance, blind = seen
        undetermined = np.abs(blind).max(axis=0, initial=0.0) > _IN_THE_BLIND
        if undetermined.all():
            return None
        covariance = covariance * (1.0 if self.known_sigma else self.chi_square / self.n_free)
        covariance[undetermined, :] = np.nan
        covariance[:, undetermined] = np.nan
        return covariance

    @property
    def _seen(self) -> tuple[Real, Real] | None:
        """Covariance within what data and priors see, and the directions that they do not, shape (blind, moved)."""
        if not np.isfinite(self.jacobian).all():
            return None
        norms = np.linalg.norm(self.jacobian, axis=0)
        norms = np.where(norms > 0.0, norms, 1.0)
        _, values, directions = np.linalg.svd(self.jacobian / norms, full_matrices=True)
        values = np.concatenate([values, np.zeros(len(directions) - len(values))])
        held = values > self.resolution * max(float(values.max(initial=0.0)), 1e-300)
        within = directions[held]
        covariance = (within.T / values[held] ** 2) @ within / np.outer(norms, norms)
        return np.asarray(covariance), np.asarray(directions[~held])

    def at(self, inner: Mapping[str, float]) -> dict[str, float]:
        """Return all values where the moved parameters stand at a place on the scale of the fit, expressions too."""
        moved = {p.name: p.outer(inner[p.name]) for p in self.moved}
        return with_expressions(self.parameters, {**self.values, **moved})

    def inner_errors(self) -> dict[str, float] | None:
        """Standard errors on the scale of the fit, by name, of what is determined; None where nothing is."""
        covariance = self.covariance
        if covariance is None:
            return None
        diagonal = zip(self.moved, np.diag(covariance), strict=True)
        return {p.name: math.sqrt(max(c, 0.0)) for p, c in diagonal if not math.isnan(c)}

    def standard_errors(self) -> dict[str, float] | None:
        """Standard errors in the values' own units, by name; of a logarithmic parameter to first order."""
        errors = self.inner_errors()
        if errors is None:
            return None
        scales = {p.name: self.values[p.name] if p.scale == "log" else 1.0 for p in self.moved}
        return {name: error * scales[name] for name, error in errors.items()}

    def error_of(self, function: Callable[[Mapping[str, float]], float]) -> float | None:
        """Standard error of a number that depends on the values, to first order; None where it cannot be had."""
        seen = self._seen
        if seen is None or (not self.known_sigma and self.n_free < 1):
            return None
        covariance, blind = seen
        slopes = jacobian_of(lambda values: np.array([function(values)]), self.parameters, self.values, 1e-3)[0]
        if not np.isfinite(slopes).all():
            return None
        norms = np.linalg.norm(self.jacobian, axis=0)
        scaled = slopes / np.where(norms > 0.0, norms, 1.0)
        if np.abs(blind @ scaled).max(initial=0.0) > _IN_THE_BLIND * max(float(np.linalg.norm(scaled)), 1e-300):
            return None
        scale = 1.0 if self.known_sigma else self.chi_square / self.n_free
        return math.sqrt(max(scale * float(slopes @ covariance @ slopes), 0.0))

    def correlation(self) -> Real | None:
        """Correlation of the moved parameters, NaN for those that nothing determines; None where there is none."""
        covariance = self.covariance
        if covariance is None:
            return None
        errors = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
        return np.asarray(covariance / np.outer(errors, errors))


def _singular_values(jacobian: Real) -> Real:
    if not jacobian.size:
        return np.zeros(0)
    norms = np.linalg.norm(jacobian, axis=0)
    return np.asarray(np.linalg.svd(jacobian / np.where(norms > 0.0, norms, 1.0), compute_uv=False))

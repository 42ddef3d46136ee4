"""How a fit weighs its residuals: plain squares, robust losses, priors."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tdacoustic.fitting.parameters import FreeParameter

__all__ = ["Loss", "Objective", "Residuals", "finite"]

Real = NDArray[np.float64]
Residuals: TypeAlias = Callable[[Mapping[str, float]], Real]
"""From values by name to residuals over their standard deviations."""

Loss = Literal["linear", "soft_l1", "huber", "cauchy", "arctan"]

_NO_NUMBER: Final = 1e50


def finite(residuals: Real) -> Real:
    """Return residuals in which what is no number is a misfit that no optimum has."""
    return np.where(np.isfinite(residuals), residuals, _NO_NUMBER)


class Objective:
    """What a fit makes small: residuals as a loss sees them, and the squares of the priors' residuals.

    Parameters
    ----------
    residuals : callable
        Of the data.
    parameters : sequence of FreeParameter
        Priors count as they are, whatever the loss: they are no data that could be outlying.
    loss : str
    """

    def __init__(self, residuals: Residuals, parameters: Sequence[FreeParameter], loss: Loss = "linear") -> None:
        self.loss = loss
        self._residuals = residuals
        self._priors = [(parameter, *parameter.prior) for parameter in parameters if parameter.prior is not None]

    def rows(self, values: Mapping[str, float]) -> Real:
        """Return the residuals of the data, then those of the priors."""
        of_priors = [(p.inner(values[p.name]) - mean) / sigma for p, mean, sigma in self._priors]
        return np.concatenate([self._residuals(values), of_priors])

    def cost(self, values: Mapping[str, float]) -> float:
        """Return chi square, or what a robust loss makes of it."""
        square = finite(self.rows(values)) ** 2
        n_data = square.size - len(self._priors)
        return float(_rho(square[:n_data], self.loss)[0].sum() + square[n_data:].sum())

    def weights(self, rows: Real) -> Real:
        """Return what weight each row keeps: the derivative of the loss by the squared residual."""
        weights = np.ones_like(rows)
        n_data = rows.size - len(self._priors)
        weights[:n_data] = _rho(rows[:n_data] ** 2, self.loss)[1]
        return weights

    @property
    def scipy_loss(self) -> str | Callable[[Real], Real]:
        """The loss as `scipy.optimize.least_squares` takes it."""
        if self.loss == "linear" or not self._priors:
            return self.loss

        def of_rows(square: Real) -> Real:
            made = np.stack([square, np.ones_like(square), np.zeros_like(square)])
            n_data = square.size - len(self._priors)
            made[:, :n_data] = _rho(square[:n_data], self.loss)
            return made

        return of_rows


def _rho(square: Real, loss: Loss) -> Any:
    """A loss of squared residuals with its first and second derivative, shape (3, n)."""
    z = square
    if loss == "linear":
        return np.stack([z, np.ones_like(z), np.zeros_like(z)])
    if loss == "soft_l1":
        root = np.sqrt(1.0 + z)
        return np.stack([2.0 * (root - 1.0), 1.0 / root, -0.5 / root**3])
    if loss == "huber":
        root = np.sqrt(np.maximum(z, 1.0))
        inside = z <= 1.0
        return np.stack([np.where(inside, z, 2.0 * root - 1.0), 1.0 / root, np.where(inside, 0.0, -0.5 / root**3)])
    if loss == "cauchy":
        return np.stack([np.log1p(z), 1.0 / (1.0 + z), -1.0 / (1.0 + z) ** 2])
    return np.stack([np.arctan(z), 1.0 / (1.0 + z**2), -2.0 * z / (1.0 + z**2) ** 2])

"""How a fit weighs its residuals: plain squares, robust losses, priors."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tdacoustic.fitting.parameters import FreeParameter

__all__ = ["Loss", "Residuals", "cost_of", "finite", "weight_of", "with_priors"]

Real = NDArray[np.float64]
Residuals: TypeAlias = Callable[[Mapping[str, float]], Real]
"""From values by name to residuals over their standard deviations."""

Loss = Literal["linear", "soft_l1", "huber", "cauchy", "arctan"]

_NO_NUMBER: Final = 1e50


def cost_of(residuals: Real, loss: Loss = "linear") -> float:
    """Return the sum of squared residuals as a loss sees them; what is no number is a misfit that no optimum has."""
    square = finite(residuals) ** 2
    if loss == "linear":
        return float(square.sum())
    if loss == "soft_l1":
        return float((2.0 * (np.sqrt(1.0 + square) - 1.0)).sum())
    if loss == "huber":
        return float(np.where(square <= 1.0, square, 2.0 * np.sqrt(square) - 1.0).sum())
    return float((np.log1p(square) if loss == "cauchy" else np.arctan(square)).sum())


def weight_of(residuals: Real, loss: Loss) -> Real:
    """Derivative of a robust loss by the squared residual: what weight a datum keeps."""
    square = residuals**2
    weights = {
        "soft_l1": 1.0 / np.sqrt(1.0 + square),
        "huber": 1.0 / np.sqrt(np.maximum(square, 1.0)),
        "cauchy": 1.0 / (1.0 + square),
        "arctan": 1.0 / (1.0 + square**2),
    }
    return np.asarray(weights[loss])


def finite(residuals: Real) -> Real:
    """What is no number is a misfit that no optimum has."""
    return np.where(np.isfinite(residuals), residuals, _NO_NUMBER)


def with_priors(residuals: Residuals, parameters: Sequence[FreeParameter]) -> Residuals:
    """Return residuals with those of the parameters' priors after them."""
    held = [(parameter, *parameter.prior) for parameter in parameters if parameter.prior is not None]

    def weighted(values: Mapping[str, float]) -> Real:
        from_priors = [(parameter.inner(values[parameter.name]) - mean) / sigma for parameter, mean, sigma in held]
        return np.concatenate([residuals(values), from_priors])

    return weighted

"""Derivatives of weighted residuals by the parameters that a fit moves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.fitting.loss import Residuals
from tdacoustic.fitting.parameters import FreeParameter, lmfit_parameters, values_of

__all__ = ["STEP", "jacobian_of", "with_expressions"]

Real = NDArray[np.float64]

STEP: Final = 1e-5
"""Of the differences, relative: for models that are exact to the last digits; others state theirs."""


def jacobian_of(
    weighted: Residuals, parameters: Sequence[FreeParameter], values: dict[str, float], relative_step: float = STEP
) -> Real:
    """Return central differences on the scale of the fit, shape (residuals, moved).

    One-sided at a bound and beside values for which there are no residuals; zero where these are on both sides.
    """
    moved = [parameter for parameter in parameters if parameter.is_moved]
    columns: list[Real] = []
    here = weighted(values)
    for parameter in moved:
        place = parameter.inner(values[parameter.name])
        size = parameter.width if math.isfinite(parameter.width) else abs(place)
        step = relative_step * (size or 1e-3)
        low, high = parameter.inner(parameter.low), parameter.inner(parameter.high)
        below, above = max(place - step, low), min(place + step, high)
        found = []
        for side in (below, above):
            shifted = {**values, parameter.name: parameter.outer(side)}
            rows = weighted(with_expressions(parameters, shifted))
            found.append((side, rows) if np.isfinite(rows).all() else (place, here))
        (first, low_rows), (second, high_rows) = found
        columns.append((high_rows - low_rows) / (second - first) if second > first else np.zeros_like(here))
    return np.stack(columns, axis=1) if columns else np.zeros((here.size, 0))


def with_expressions(parameters: Sequence[FreeParameter], values: dict[str, float]) -> dict[str, float]:
    """Return values in which those that follow from others by an expression fit them again."""
    if all(parameter.is_moved for parameter in parameters):
        return values
    inner = {p.name: p.inner(values[p.name]) for p in parameters if p.is_moved}
    return values_of(parameters, lmfit_parameters(parameters, inner))

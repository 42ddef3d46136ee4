"""The model's levels over one or two parameters of the gears, computed at nodes and interpolated between them.

A motion of the gears costs a millisecond, and a calibration asks for thousands. Over a damping or a stiffness the
levels are smooth: cubic splines through a few nodes hold them within some hundredths of a decibel, and midpoints of the
nodes prove it or refuse it.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tdacoustic.fitting.parameters import FreeParameter

__all__ = ["TOLERANCE_DB", "Response", "response_of"]

Real = NDArray[np.float64]
Levels: TypeAlias = Callable[[Mapping[str, float]], Real]

TOLERANCE_DB: Final = 0.05
"""Largest difference at midpoints of nodes that is taken; half the spacing brings it below a hundredth."""

HOPELESS_DB: Final = 20.0 * TOLERANCE_DB
"""Difference from which finer nodes are not tried: the levels jump or bend."""

_INTERVALS: Final = ((8, 16, 32), (8, 16))
"""Intervals tried, of one parameter and of two."""

_CHECKED_CELLS: Final = 24


@dataclass(frozen=True)
class Response:
    """Levels interpolated over one or two parameters.

    Parameters
    ----------
    parameters : tuple of FreeParameter
    splines : tuple
        One of all levels over one parameter, or one of each level over two.
    error_db : float
        Largest difference at the checked midpoints, before the last refinement.
    """

    parameters: tuple[FreeParameter, ...]
    splines: tuple[Any, ...]
    error_db: float

    def __call__(self, values: Mapping[str, float]) -> Real | None:
        """Return the levels, shape (n,); None outside of the bounds and where a value is missing."""
        if any(parameter.name not in values for parameter in self.parameters):
            return None
        place = [parameter.inner(values[parameter.name]) for parameter in self.parameters]
        for inner, parameter in zip(place, self.parameters, strict=True):
            if not parameter.inner(parameter.low) <= inner <= parameter.inner(parameter.high):
                return None
        if len(place) == 1:
            return np.asarray(self.splines[0](place[0]))
        return np.array([spline.ev(*place) for spline in self.splines])


def response_of(levels: Levels, parameters: Sequence[FreeParameter]) -> Response | None:
    """Return the levels over the bounds of one or two parameters; None where splines do not hold them.

    Parameters
    ----------
    levels : callable
        From values by name to levels in dB, shape (n,).
    parameters : sequence of FreeParameter
        With finite bounds.
    """
    held = tuple(parameters)
    if not 1 <= len(held) <= 2:
        return None
    before: Response | None = None
    for intervals in _INTERVALS[len(held) - 1]:
        axes = [np.linspace(p.inner(p.low), p.inner(p.high), intervals + 1) for p in held]
        known = np.array([levels(_values(held, place)) for place in itertools.product(*axes)])
        if not np.isfinite(known).all():
            return None
        splines = _splines(axes, known.reshape(*(axis.size for axis in axes), -1))
        if len(held) == 1:
            if before is not None:
                checked = np.array([before(_values(held, (place,))) for place in axes[0][1::2]])
                error_db = float(np.abs(checked - known[1::2]).max(initial=0.0))
                if error_db <= TOLERANCE_DB:
                    return Response(held, splines, error_db)
                if error_db > HOPELESS_DB:
                    return None
            before = Response(held, splines, np.inf)
        else:
            found = Response(held, splines, np.inf)
            error_db = _worst_of_cells(levels, found, axes)
            if error_db <= TOLERANCE_DB:
                return Response(held, splines, error_db)
    return None


def _values(parameters: Sequence[FreeParameter], place: Sequence[float]) -> dict[str, float]:
    """Values at a place; at the bounds exactly, whatever exp(log(x)) makes of them."""
    return {p.name: min(max(p.outer(float(inner)), p.low), p.high) for p, inner in zip(parameters, place, strict=True)}


def _splines(axes: Sequence[Real], known: Real) -> tuple[Any, ...]:
    from scipy.interpolate import CubicSpline, RectBivariateSpline

    if len(axes) == 1:
        return (CubicSpline(axes[0], known),)
    return tuple(RectBivariateSpline(*axes, known[..., index], s=0) for index in range(known.shape[-1]))


def _worst_of_cells(levels: Levels, found: Response, axes: Sequence[Real]) -> float:
    """Largest difference at the centres of some cells, spread over all of them."""
    from scipy.stats import qmc

    spread = qmc.Halton(2, seed=0).random(_CHECKED_CELLS)
    worst = 0.0
    for row in spread:
        place = []
        for part, axis in zip(row, axes, strict=True):
            cell = min(int(part * (axis.size - 1)), axis.size - 2)
            place.append(0.5 * float(axis[cell] + axis[cell + 1]))
        values = _values(found.parameters, place)
        interpolated = found(values)
        assert interpolated is not None
        worst = max(worst, float(np.abs(interpolated - levels(values)).max(initial=0.0)))
    return worst

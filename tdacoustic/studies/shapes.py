"""What a series of levels looks like, as a margin: how far it is from losing, or from having, a shape."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

__all__ = ["LEAST_VALUES", "direction_margin", "extreme_margin", "shape_margin", "shape_of", "span_margin"]

Real = NDArray[np.float64]

LEAST_VALUES: Final = {"rises": 2, "falls": 2, "flat": 2, "rises_then_falls": 3, "flat_or_rises_then_falls": 3}
"""Values that a series must have at least to have a shape."""

_NAMED: Final = ("flat", "rises", "falls", "rises_then_falls")
"""Shapes that `shape_of` looks for, in this order."""


def shape_margin(shape: str, values: Real, tolerance: float) -> Real:
    """Return by how much series have a shape: zero or above where they have it, below by what they lack.

    With first, last, largest and smallest value of a series and its tolerance t, the margin is the least of

    - ``rises``: last - first - t; t + least step;
    - ``falls``: the same of the series times -1;
    - ``rises_then_falls``: peak - first - t; peak - last - t; t + least step up to the peak; t + least step down from
      it; the peak is that of the values between first and last for which this is most;
    - ``flat_or_rises_then_falls``: the same with peak - first + t;
    - ``flat``: t - (largest - smallest).

    A step is from one value to any later one, so that the least step up is below zero by the largest dip.

    Parameters
    ----------
    shape : str
    values : ndarray, shape (..., n)
        In order.
    tolerance : float

    Returns
    -------
    ndarray, shape (...)
        NaN of a series with a gap, or with fewer values than `LEAST_VALUES`.
    """
    if values.shape[-1] < LEAST_VALUES[shape]:
        return np.full(values.shape[:-1], np.nan)
    first, last = values[..., 0], values[..., -1]
    if shape == "flat":
        return np.asarray(tolerance - (values.max(axis=-1) - values.min(axis=-1)))
    if shape == "falls":
        first, last, values = -first, -last, -values
    up = _least_steps(values)
    if shape in ("rises", "falls"):
        return _least(last - first - tolerance, tolerance + up[..., -1])
    after_first = tolerance if shape == "flat_or_rises_then_falls" else -tolerance
    down = _least_steps(values[..., ::-1])[..., ::-1]
    between = values[..., 1:-1]
    peaks = _least(
        between - first[..., None] + after_first,
        between - last[..., None] - tolerance,
        tolerance + up[..., :-1],
        tolerance + down[..., 1:],
    )
    return np.asarray(peaks.max(axis=-1))


def _least_steps(values: Real) -> Real:
    """Least step from a value to a later one, up to each value but the first, shape (..., n - 1)."""
    steps = values[..., 1:] - np.maximum.accumulate(values, axis=-1)[..., :-1]
    return np.asarray(np.minimum.accumulate(steps, axis=-1))


def shape_of(values: Real, tolerance: float) -> str | None:
    """Return the shape of one series by the margins of `shape_margin`; None of another one, or where it has a gap.

    Parameters
    ----------
    values : ndarray, shape (n,)
        In order.
    tolerance : float

    Examples
    --------
    >>> shape_of(np.array([60.0, 64.0, 62.0]), 0.5), shape_of(np.array([64.0, 60.0, 64.0]), 0.5)
    ('rises_then_falls', None)
    """
    return next((shape for shape in _NAMED if float(shape_margin(shape, values, tolerance)) >= 0.0), None)


def extreme_margin(values: Real, at: NDArray[np.bool_], highest: bool, tolerance: float) -> Real:
    """Return by how much the highest (lowest) value stands at one of some places: its lead over the others.

    Parameters
    ----------
    values : ndarray, shape (..., n)
    at : ndarray of bool, shape (n,)
        Some, and not all.
    highest : bool
    tolerance : float
        By which another one may lead.

    Returns
    -------
    ndarray, shape (...)
        NaN of a series with a gap.
    """
    if not at.any() or at.all():
        return np.full(values.shape[:-1], np.nan)
    of = values if highest else -values
    lead = of[..., at].max(axis=-1) - of[..., ~at].max(axis=-1)
    return np.asarray(np.where(np.isfinite(values).all(axis=-1), lead + tolerance, np.nan))


def span_margin(values: Real, span: float, tolerance: float) -> Real:
    """Return by how much the span from least to most is within a tolerance of a stated one."""
    if values.shape[-1] < 2:
        return np.full(values.shape[:-1], np.nan)
    return np.asarray(tolerance - np.abs(values.max(axis=-1) - values.min(axis=-1) - span))


def direction_margin(values_deg: Real, direction_deg: float, tolerance: float) -> Real:
    """Return by how much directions are within a tolerance of a stated one, that which is farthest off.

    Parameters
    ----------
    values_deg : ndarray, shape (..., n)
    direction_deg, tolerance : float

    Returns
    -------
    ndarray, shape (...)
    """
    if not values_deg.shape[-1]:
        return np.full(values_deg.shape[:-1], np.nan)
    off = np.abs((values_deg - direction_deg + 180.0) % 360.0 - 180.0)
    return np.asarray(tolerance - off.max(axis=-1))


def _least(*parts: Real) -> Real:
    return np.asarray(np.min(np.stack(parts), axis=0))

"""The pressure anywhere inside a box: of a source, and of walls that move.

Both are series over the functions along two axes with an end along the third. That of walls takes the normal of the
wall. That of a source takes the axis along which the point is farthest from it, where the series falls off as
exp(-κ times that distance); close to the source, where it would need too many terms, its own field in free space is
taken out and the smooth rest is read from both sides.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.cavity.box import BoxInterior, across, functions
from tdacoustic.cavity.modes import CavityError
from tdacoustic.housing.solid_grid import PANELS

__all__ = ["pressure_of_source", "pressure_of_walls"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Point = tuple[float, float, float]

_CLOSE_M = 0.02
"""Distance along the farthest axis below which the source's own field is taken out."""

_AT_SOURCE_M = 1e-4
_SMALL = 14.0
"""Exponent at which a series ends: exp(-14) = 1e-6."""

_AT_ONCE = 2_000_000
"""Values of a block."""


def pressure_of_source(
    interior: BoxInterior,
    points_m: ArrayLike,
    source_m: Point,
    wave_number_rad_m: complex,
) -> Complex:
    """Return the pressure of a source of 1 Pa at 1 m in free space between rigid walls, shape (points,), in Pa.

    Parameters
    ----------
    interior : BoxInterior
    points_m : array_like, shape (points, 3)
        From the middle of the box, in the air or on the walls.
    source_m : (float, float, float)
    wave_number_rad_m : complex
        Of the air with its losses, the root of `CavityModes.squared_wave_number`.

    Raises
    ------
    CavityError
        A point outside, or at the source itself.
    """
    points = _inside(interior, points_m)
    apart = points - np.asarray(source_m)
    distance = np.linalg.norm(apart, axis=1)
    if (distance < _AT_SOURCE_M).any():
        raise CavityError(f"a point is at the source at {source_m} m itself, where the pressure has no end")
    farthest = np.abs(apart).max(axis=1)
    square = complex(wave_number_rad_m) ** 2
    found = np.empty(len(points), dtype=np.complex128)
    far = farthest >= _CLOSE_M
    found[far] = _series(interior, points[far], source_m, square)
    close = np.flatnonzero(~far)
    if close.size:
        root = np.sqrt(square)
        root = root if root.imag <= 0.0 else -root
        beside = apart[close] * (_CLOSE_M / farthest[close])[:, None]
        way = np.linalg.norm(beside, axis=1)
        direct = np.exp(-1j * root * way) / way
        ahead, behind = (
            _series(interior, np.asarray(source_m) + sign * beside, source_m, square) - direct for sign in (1.0, -1.0)
        )
        rest = 0.5 * (ahead + behind) + 0.5 * (ahead - behind) * distance[close] / way
        found[close] = np.exp(-1j * root * distance[close]) / distance[close] + rest
    return found


def pressure_of_walls(
    interior: BoxInterior,
    points_m: ArrayLike,
    velocities: ArrayLike,
    frequency_hz: float,
    wave_number_rad_m: complex,
    density_kg_m3: float,
) -> Complex:
    """Return the pressure of moving walls, shape (points,), in Pa.

    Parameters
    ----------
    interior : BoxInterior
    points_m : array_like, shape (points, 3)
        From the middle of the box, in the air or on the walls.
    velocities : array_like of complex, shape (wall modes,)
        Modal velocities in m √kg / s.
    frequency_hz : float
    wave_number_rad_m : complex
        As of `pressure_of_source`.
    density_kg_m3 : float

    Raises
    ------
    CavityError
        A point outside.
    """
    points = _inside(interior, points_m)
    moving = np.asarray(velocities, dtype=np.complex128)
    square = complex(wave_number_rad_m) ** 2
    found = np.zeros(len(points), dtype=np.complex128)
    for (name, sign), wall in zip(PANELS, interior.walls, strict=True):
        axis = "xyz".index(name)
        first, second = across(axis)
        sizes = interior.size_m[first], interior.size_m[second]
        waves = np.tensordot(moving, wall, axes=1) / (sizes[0] * sizes[1])
        kappa = _kappa(interior, (first, second), waves.shape, square)
        length = interior.size_m[axis]
        waves = waves / (kappa * (1.0 - np.exp(-2.0 * kappa * length)))
        block = max(1, _AT_ONCE // waves.size)
        for start in range(0, len(points), block):
            some = points[start : start + block]
            away = (0.5 * length - sign * some[:, axis])[:, None, None]
            over = np.exp(-kappa * away) * (1.0 + np.exp(-2.0 * kappa * (length - away))) * waves
            along = functions(waves.shape[0], some[:, first], sizes[0])
            up = functions(waves.shape[1], some[:, second], sizes[1])
            found[start : start + block] += np.einsum("ap,pab,bp->p", along, over, up, optimize=True)
    return found * (-2j * math.pi * frequency_hz * density_kg_m3)


def _inside(interior: BoxInterior, points_m: ArrayLike) -> Real:
    points = np.asarray(points_m, dtype=np.float64).reshape(-1, 3)
    outside = (np.abs(points) > 0.5 * np.asarray(interior.size_m) + 1e-9).any(axis=1)
    if outside.any():
        raise CavityError(
            f"the point {tuple(points[outside][0].tolist())} m is not in the cavity of {interior.size_m} m"
        )
    return points


def _kappa(interior: BoxInterior, axes: tuple[int, int], counts: Sequence[int], square: complex) -> Complex:
    """Return κ = √(k_t² - k²), its real part not below zero, for the first functions along two axes."""
    one, other = (
        (np.arange(count) * math.pi / interior.size_m[axis]) ** 2 for axis, count in zip(axes, counts, strict=True)
    )
    return np.asarray(np.sqrt(one[:, None] + other[None, :] - square + 0j))


def _series(interior: BoxInterior, points: Real, source_m: Point, square: complex) -> Complex:
    """Return 4π times Green's function of the rigid box at points, from the axis that each is farthest along."""
    apart = np.abs(points - np.asarray(source_m))
    axes = apart.argmax(axis=1)
    reaches = np.round(2.0 * np.log2(apart.max(axis=1, initial=1e-9)))  # points of about one distance together
    found = np.empty(len(points), dtype=np.complex128)
    for axis in range(3):
        for reach in np.unique(reaches[axes == axis]):
            some = np.flatnonzero((axes == axis) & (reaches == reach))
            found[some] = _series_along(interior, points[some], source_m, square, axis)
    return found


def _series_along(interior: BoxInterior, points: Real, source_m: Point, square: complex, axis: int) -> Complex:
    first, second = across(axis)
    sizes = interior.size_m[first], interior.size_m[second]
    length = interior.size_m[axis]
    nearest = float(np.abs(points[:, axis] - source_m[axis]).min())
    reach = math.hypot(_SMALL / nearest, abs(np.sqrt(square)))
    counts = [math.floor(reach * size / math.pi) + 2 for size in sizes]
    kappa = _kappa(interior, (first, second), counts, square)
    kept = np.nonzero((kappa**2).real <= (_SMALL / nearest) ** 2)
    kappa = kappa[kept]
    at_source = [
        functions(n, [source_m[k]], size)[:, 0] for n, k, size in zip(counts, (first, second), sizes, strict=True)
    ]
    strength = at_source[0][kept[0]] * at_source[1][kept[1]] / (1.0 - np.exp(-2.0 * kappa * length)) / (2.0 * kappa)
    found = np.empty(len(points), dtype=np.complex128)
    block = max(1, _AT_ONCE // kappa.size)
    for start in range(0, len(points), block):
        some = points[start : start + block]
        here, there = some[:, axis] + 0.5 * length, source_m[axis] + 0.5 * length
        low, high = np.minimum(here, there)[:, None], np.maximum(here, there)[:, None]
        ends = (1.0 + np.exp(-2.0 * kappa * low)) * (1.0 + np.exp(-2.0 * kappa * (length - high)))
        waves = np.exp(-kappa * (high - low)) * ends * strength
        along = [functions(n, some[:, k], size) for n, k, size in zip(counts, (first, second), sizes, strict=True)]
        found[start : start + block] = (waves * along[0][kept[0]].T * along[1][kept[1]].T).sum(axis=1)
    return found * (4.0 * math.pi / (sizes[0] * sizes[1]))

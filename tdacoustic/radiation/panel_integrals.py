"""Matrices of a surface's integrals, for each parity of the field; and what is too near the surface for them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import RadiationError
from tdacoustic.radiation.surfaces import Surface

__all__ = ["assembled", "place", "refuse_near"]

Real = NDArray[np.float64]
Complex = NDArray[np.complexfloating[Any, Any]]

_FINE = 3.0271
"""A panel nearer than this many of its diameters is integrated finely, a farther one by one point (measured on spheres
and boxes: 2 loses on spheres, 4 to 9 gain nothing). No round number, so that rounding does not decide on a regular
grid: there it would part what mirror planes and the whole grid give by 1e-3."""

_TOO_NEAR = 0.75
"""Receivers and sources must be this many diameters of a panel from its centre: a triangle's corner may be 2/3."""


def assembled(
    surface: Surface,
    points_m: Real,
    directions: Real,
    wave_number_rad_m: float,
    coupling_m: float,
    ground_m: float | None,
    kind: type[np.complexfloating[Any, Any]],
    on_panels: bool,
) -> tuple[Complex, Complex]:
    """Return the weights A and B of `panel_kernels`, added over reflections with the signs of each parity.

    A reflected panel seen from a point is the panel seen from the reflected point, so it is the points that are
    reflected, at the mirror planes and at the ground.

    Parameters
    ----------
    surface : Surface
    points_m, directions : ndarray
        (points, 3).
    wave_number_rad_m, coupling_m : float
    ground_m : float or None
    kind : type
        complex64 or complex128, of what is returned; the integrals are of double precision.
    on_panels : bool
        The points are the centres of the given part's panels.

    Returns
    -------
    tuple of ndarray
        Each (parities, points, panels of the part).
    """
    from tdacoustic.radiation.panel_kernels import assemble

    mirrors, n = surface.mirrors, len(surface.panels)
    points = mirrors.reflected(points_m)
    turned = mirrors.signs[:, None, :] * directions
    group = np.arange(mirrors.count)
    if ground_m is not None:
        down = np.array([1.0, 1.0, -1.0])
        points = np.concatenate((points, points * down + [0.0, 0.0, 2.0 * ground_m]))
        turned, group = np.concatenate((turned, turned * down)), np.concatenate((group, group))
    pressure = np.empty((mirrors.count, len(points_m), n, 2), dtype=kind(0).real.dtype)
    velocity = np.empty_like(pressure)
    assemble(
        _blocks(surface), surface.corners_m[:n], surface.normals[:n], np.ascontiguousarray(points),
        np.ascontiguousarray(turned), group, mirrors.parities, wave_number_rad_m, coupling_m, on_panels,
        pressure, velocity,
    )  # fmt: skip
    return pressure.view(kind)[..., 0], velocity.view(kind)[..., 0]


def _blocks(surface: Surface) -> Real:
    """Return the part's panels as the kernels want them, the last block filled up with such of no area far away."""
    from tdacoustic.radiation.panel_kernels import BLOCK, ROWS

    n = len(surface.panels)
    numbers = np.zeros((ROWS, -(-n // BLOCK) * BLOCK))
    numbers[0] = 1e3 * float(np.abs(surface.corners_m).max())
    numbers[0:3, :n] = surface.centres_m[:n].T
    numbers[3:6, :n] = surface.normals[:n].T
    numbers[6, :n] = surface.areas_m2[:n]
    numbers[7, :n] = (_FINE * surface.diameters_m[:n]) ** 2
    return np.ascontiguousarray(numbers.reshape(ROWS, -1, BLOCK).transpose(1, 0, 2)).ravel()


def refuse_near(surface: Surface, name: str, points_m: Real) -> None:
    """Raise if a point is in the body, on it, or nearer to it than a panel.

    Parameters
    ----------
    surface : Surface
    name : str
        What the points are.
    points_m : ndarray
        (n, 3).

    Raises
    ------
    RadiationError
        Naming the first such point.
    """
    from tdacoustic.radiation.panel_kernels import nearest_and_angle

    reach = float(surface.diameters_m.max())
    low, high = surface.corners_m.min(axis=(0, 1)) - reach, surface.corners_m.max(axis=(0, 1)) + reach
    close = np.flatnonzero(((points_m >= low) & (points_m <= high)).all(axis=1))
    nearest, angle = np.empty(len(close)), np.empty(len(close))
    nearest_and_angle(
        np.ascontiguousarray(surface.triangles_m),
        surface.centres_m,
        surface.diameters_m,
        points_m[close],
        nearest,
        angle,
    )
    for index, ratio, filled in zip(close, nearest, angle, strict=True):
        if filled > 3.0 * math.pi:  # on the surface it is half of the 4π within
            raise RadiationError(f"{name} {index} at {place(points_m[index])} is inside the body")
        if ratio < _TOO_NEAR:
            raise RadiationError(
                f"{name} {index} at {place(points_m[index])} is on the body or nearer to it than a panel of its grid "
                f"({reach:.3g} m across)"
            )


def place(point_m: Real) -> str:
    """Return a point's coordinates in words."""
    return "({:.4g}, {:.4g}, {:.4g}) m".format(*point_m)

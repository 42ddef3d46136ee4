"""Grids of panels on boxes and spheres."""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import RadiationError
from tdacoustic.radiation.surfaces import Axis, Mirrors, Surface

__all__ = ["box_surface", "sphere_surface"]

Point = tuple[float, float, float]
Real = NDArray[np.float64]


def box_surface(
    size_m: Point,
    largest_panel_m: float,
    mirror_planes: tuple[Axis, ...] = ("x", "y", "z"),
    centre_m: Point = (0.0, 0.0, 0.0),
    edge_panel: float = 1.0,
) -> Surface:
    """Return the surface of a box in nearly square panels.

    Parameters
    ----------
    size_m : (float, float, float)
        Length of the edges along x, y, z.
    largest_panel_m : float
        No panel's side is longer.
    mirror_planes : tuple of {"x", "y", "z"}
        Planes through the box's centre by which the grid is made of its part; the panels' corners lie on them.
    centre_m : (float, float, float)
    edge_panel : float
        Size of the panels at the box's edges against those in the middle of its sides; 1 makes all equal. Sizes grow
        geometrically from the edges over the first quarter of a side, and the number of panels grows accordingly.

    Raises
    ------
    RadiationError
        A size that is not above zero, or an `edge_panel` outside 0.05 to 1.

    Examples
    --------
    >>> box = box_surface((0.45, 1.0, 0.9), 0.075)
    >>> box.n_panels, len(box.panels), round(float(box.areas_m2.sum()), 9)
    (648, 81, 3.51)
    """
    if not (len(size_m) == 3 and all(math.isfinite(edge) and edge > 0.0 for edge in size_m)):
        raise RadiationError(f"size of the box must be three numbers > 0 m, got {size_m!r}")
    if not (math.isfinite(largest_panel_m) and largest_panel_m > 0.0):
        raise RadiationError(f"largest_panel_m must be > 0, got {largest_panel_m!r}")
    if not 0.05 <= edge_panel <= 1.0:
        raise RadiationError(f"edge_panel must be 0.05 to 1 of the panels in the middle, got {edge_panel!r}")
    mirrors = Mirrors(mirror_planes, centre_m)
    ticks = [_ticks(0.5 * edge, largest_panel_m, edge_panel) for edge in size_m]
    whole = [np.concatenate((-half[:0:-1], half)) for half in ticks]
    lines = [half if axis in mirror_planes else both for axis, half, both in zip("xyz", ticks, whole, strict=True)]
    corners = []
    for axis, side in itertools.product(range(3), (1.0, -1.0)):
        if side < 0.0 and "xyz"[axis] in mirror_planes:
            continue
        corners.append(_face(axis, side, lines))
    points = np.concatenate(corners).reshape(-1, 3) + np.asarray(centre_m)
    return Surface(points, np.arange(len(points)).reshape(-1, 4), mirrors)


def _ticks(half_m: float, largest_m: float, edge_panel: float) -> Real:
    """Return the panels' borders from a box's centre plane to its side: 0 to `half_m`."""
    if edge_panel == 1.0:
        return np.linspace(0.0, half_m, math.ceil(half_m / largest_m - 1e-9) + 1)
    density = _graded(np.linspace(0.0, 1.0, 4001), edge_panel)
    places = np.concatenate(([0.0], np.cumsum(0.5 * (density[1:] + density[:-1])))) / 4000.0
    count = math.ceil(half_m * places[-1] / largest_m - 1e-9)
    borders = np.interp(np.arange(count + 1) / count * places[-1], places, np.linspace(0.0, half_m, 4001))
    borders[-1] = half_m
    return np.asarray(borders)


def _graded(place: Real, edge_panel: float) -> Real:
    """Return panels per length, 1 in the inner half and 1 / `edge_panel` at the side (`place` = 1)."""
    return np.asarray(edge_panel ** -np.clip(2.0 * place - 1.0, 0.0, 1.0))


def _face(axis: int, side: float, lines: list[Real]) -> Real:
    """Return the corners (panels, 4, 3) of the face normal to an axis, counter-clockwise seen from outside."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    u, v = np.meshgrid(lines[first], lines[second], indexing="ij")
    points = np.empty((*u.shape, 3))
    points[..., first], points[..., second], points[..., axis] = u, v, side * lines[axis][-1]
    corners = np.stack((points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]), axis=2).reshape(-1, 4, 3)
    return corners if side > 0.0 else corners[:, ::-1]


def sphere_surface(
    radius_m: float,
    panels_per_quarter: int,
    mirror_planes: tuple[Axis, ...] = ("x", "y", "z"),
    centre_m: Point = (0.0, 0.0, 0.0),
) -> Surface:
    """Return a sphere as an equiangular cube blown up, of the sphere's volume.

    Parameters
    ----------
    radius_m : float
    panels_per_quarter : int
        m, along a quarter of a great circle from the middle of one side of the cube to the next: half a side has m / 2,
        so that it is even. The sphere has 6 m² panels.
    mirror_planes : tuple of {"x", "y", "z"}
        Planes through its centre by which the grid is made of its part.
    centre_m : (float, float, float)

    Examples
    --------
    >>> sphere_surface(1.0, 10).n_panels
    600
    """
    if not (math.isfinite(radius_m) and radius_m > 0.0):
        raise RadiationError(f"radius must be > 0 m, got {radius_m!r}")
    if panels_per_quarter < 2 or panels_per_quarter % 2:
        raise RadiationError(f"panels_per_quarter must be even and > 0, got {panels_per_quarter!r}")
    angles = np.linspace(0.0, 0.25 * math.pi, panels_per_quarter // 2 + 1)
    half = np.tan(angles)
    half[-1] = 1.0
    whole = np.concatenate((-half[:0:-1], half))
    lines = [half if axis in mirror_planes else whole for axis in "xyz"]
    corners = np.concatenate(
        [
            _face(axis, side, lines)
            for axis, side in itertools.product(range(3), (1.0, -1.0))
            if side > 0.0 or "xyz"[axis] not in mirror_planes
        ]
    )
    points = corners.reshape(-1, 3)
    points = points / np.linalg.norm(points, axis=1)[:, None]
    names = np.arange(len(points)).reshape(-1, 4)
    volume = Surface(points, names, Mirrors(mirror_planes)).volume_m3
    points = points * radius_m * (4.0 / 3.0 * math.pi / volume) ** (1.0 / 3.0) + np.asarray(centre_m)
    return Surface(points, names, Mirrors(mirror_planes, centre_m))

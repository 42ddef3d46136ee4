"""Panels on the outside of a solid, of its part beyond the mirror planes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tdacoustic.housing.box import HousingError
from tdacoustic.housing.step_file.panelling import panels_of
from tdacoustic.housing.step_file.solid import Planes
from tdacoustic.housing.step_file.surface_grid import SurfaceGrid, outer_part, surface_grid

__all__ = ["OuterPanels", "outer_panels"]

Real = NDArray[np.float64]
Whole = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class OuterPanels:
    """Flat panels on an outer surface.

    Parameters
    ----------
    size_m : float
        Of the panels, as it was asked for.
    vertices_m : ndarray, shape (n, 3)
        In the file's axes.
    panels : ndarray of int, shape (m, 4)
        Counter-clockwise seen from outside; -1 behind three corners.
    planes_m : tuple of (str, float)
        Mirror planes: the panels are those on their positive side.
    """

    size_m: float
    vertices_m: Real
    panels: Whole
    planes_m: Planes


def outer_panels(whole: Any, size_m: float, planes_m: Planes) -> OuterPanels:
    """Return the panels of a solid.

    Parameters
    ----------
    whole : netgen.occ.TopoDS_Shape
    size_m : float
    planes_m : tuple of (str, float)

    Raises
    ------
    HousingError
        Netgen makes no grid.
    """
    axes = [("xyz".index(name), at) for name, at in planes_m]
    grid = surface_grid(_cut(whole, axes), size_m, squares=True)
    kept = ~grid.between
    middles = np.array([grid.points_m[row[row >= 0]].mean(axis=0) for row in grid.cells])
    for axis, at in axes:
        kept &= middles[:, axis] > at + 1e-6
    part = grid.only(kept)
    part = part.only(outer_part(part))
    for axis, at in axes:
        near = np.abs(part.points_m[:, axis] - at) < 1e-6
        part.points_m[near, axis] = at
    points, panels = panels_of(part.points_m, part.cells, size_m, tuple(axes))
    return OuterPanels(size_m, points, panels, planes_m)


def _cut(whole: Any, axes: Sequence[tuple[int, float]]) -> Any:
    """Return the part of a solid on the positive sides of planes."""
    from netgen.occ import Box, Pnt

    if not axes:
        return whole
    (low, high) = whole.bounding_box
    corner = [low[k] - 0.1 for k in range(3)]
    for axis, at in axes:
        corner[axis] = at
    part = whole * Box(Pnt(*corner), Pnt(*(high[k] + 0.1 for k in range(3))))
    wanted = whole.mass / 2 ** len(axes)
    if not 0.2 * wanted < part.mass < 1.8 * wanted:
        raise HousingError("OpenCASCADE cannot cut it at its planes of symmetry: heal it in the CAD program")
    return part


def only_outside(grid: SurfaceGrid) -> SurfaceGrid:
    """Return the outer cells of a grid at the air."""
    at_air = grid.only(~grid.between)
    return at_air.only(outer_part(at_air))

"""Netgen's grids on the surface of a solid, and what they tell of it."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.housing.box import HousingError
from tdacoustic.housing.step_file.triangles import Skin, connected, crossing, free_edges

__all__ = ["SurfaceGrid", "cells_of", "check_sound", "outer_part", "surface_grid"]

Real = NDArray[np.float64]
Whole = NDArray[np.int64]

_WAYS: Final = ({"grading": 0.3}, {"grading": 0.5}, {"grading": 0.2}, {"grading": 0.3, "delaunay2d": False})
"""What Netgen is asked for in turn, with smaller edges each time, until it meshes every face."""

_SHRINK: Final = 0.8

_SAME_VOLUME: Final = 0.03
"""How far the volume in a grid may be off that of the solid it is of: flat triangles on curved faces."""


@dataclass(frozen=True, eq=False)
class SurfaceGrid:
    """Triangles and quadrilaterals on the faces of a solid.

    Parameters
    ----------
    points_m : ndarray, shape (n, 3)
    cells : ndarray of int, shape (m, 4)
        Corners, counter-clockwise seen from outside of the solid; -1 behind three.
    faces : ndarray of int, shape (m,)
        Numbers of the solid's faces.
    between : ndarray of bool, shape (m,)
        Cells between two solids that are glued together; the others are at the air.
    """

    points_m: Real
    cells: Whole
    faces: Whole
    between: NDArray[np.bool_]

    @property
    def skin(self) -> Skin:
        """The same in triangles."""
        square = self.cells[:, 3] >= 0
        return Skin(self.points_m, np.concatenate([self.cells[:, :3], self.cells[square][:, [0, 2, 3]]]))

    def only(self, kept: NDArray[np.bool_]) -> SurfaceGrid:
        """Return some of the cells, with the points that they use."""
        cells = self.cells[kept]
        used, numbers = np.unique(cells[cells >= 0], return_inverse=True)
        again = np.full(cells.shape, -1, dtype=np.int64)
        again[cells >= 0] = numbers
        return SurfaceGrid(self.points_m[used], again, self.faces[kept], self.between[kept])


def surface_grid(shape: Any, edge_m: float, squares: bool = False) -> SurfaceGrid:
    """Return a grid on all faces of a solid.

    Parameters
    ----------
    shape : netgen.occ.TopoDS_Shape
        In metres.
    edge_m : float
    squares : bool
        Mostly quadrilaterals.

    Returns
    -------
    SurfaceGrid
        Closed, unless Netgen makes no closed one; `check_sound` tells.

    Raises
    ------
    HousingError
        Netgen leaves faces out.
    """
    from netgen.meshing import MeshingStep, NgException
    from netgen.occ import OCCException, OCCGeometry

    faces = list({hash(face): face for face in shape.faces}.values())  # glued solids share some
    left, open_grid = list(range(len(faces))), None
    for attempt, (quadrilaterals, way) in enumerate(itertools.product((True, False) if squares else (False,), _WAYS)):
        try:
            made = OCCGeometry(shape).GenerateMesh(
                maxh=edge_m * _SHRINK ** (attempt % len(_WAYS)),
                perfstepsend=MeshingStep.MESHSURFACE,
                quad_dominated=quadrilaterals,
                closeedgefac=None,
                **way,
            )
        except (NgException, OCCException, RuntimeError):
            continue
        grid = cells_of(made)
        left = sorted(set(range(len(faces))) - set(grid.faces.tolist()))
        if left:
            continue
        if not len(free_edges(grid.only(~grid.between).skin.triangles)):
            return grid
        open_grid = grid
    if open_grid is not None:
        return open_grid
    low, high = faces[left[0]].bounding_box
    where = ", ".join(f"{n} {a:.4g} to {b:.4g} m" for n, a, b in zip("xyz", low, high, strict=True))
    raise HousingError(
        f"Netgen makes no grid on {len(left)} of its {len(faces)} faces, the first over {where}: repair or simplify "
        "them"
    )


def cells_of(made: Any) -> SurfaceGrid:
    """Return the surface's cells of a grid of Netgen, turned to the outside of their solids.

    Parameters
    ----------
    made : netgen.meshing.Mesh
        Of one solid or of several glued together.
    """
    points = np.asarray(made.Coordinates(), dtype=np.float64).copy()
    cells = np.full((len(made.Elements2D()), 4), -1, dtype=np.int64)
    faces = np.empty(len(cells), dtype=np.int64)
    for number, element in enumerate(made.Elements2D()):
        corners = [vertex.nr - 1 for vertex in element.vertices]
        cells[number, : len(corners)] = corners
        faces[number] = element.index - 1
    count = int(faces.max()) + 1
    sides = np.array([[made.FaceDescriptor(n + 1).domin, made.FaceDescriptor(n + 1).domout] for n in range(count)])
    turned = sides[faces, 0] == 0
    square = cells[:, 3] >= 0
    cells[turned & ~square, :3] = cells[turned & ~square, 2::-1]
    cells[turned & square] = cells[turned & square, ::-1]
    return SurfaceGrid(points, cells, faces, np.asarray(sides.min(axis=1) > 0)[faces])


def outer_part(grid: SurfaceGrid) -> NDArray[np.bool_]:
    """Return which cells belong to the outermost of the connected parts of a grid: the one of the largest extent."""
    parts = connected(grid.cells, len(grid.points_m))
    corner = grid.points_m[grid.cells[:, :3]].mean(axis=1)
    sizes = [np.ptp(corner[parts == part], axis=0).sum() for part in range(parts.max() + 1)]
    return np.asarray(parts == int(np.argmax(sizes)))


def check_sound(grid: SurfaceGrid, volume_m3: float) -> None:
    """Raise for a surface that is not closed, cuts itself or encloses another volume than its solid.

    Parameters
    ----------
    grid : SurfaceGrid
    volume_m3 : float
        Of the solid as OpenCASCADE has it.

    Raises
    ------
    HousingError
    """
    skin = grid.skin
    edges = free_edges(skin.triangles)
    if len(edges):
        raise HousingError(
            "its surface is not closed, or more than two faces meet at one edge, "
            f"{_at(skin.points_m[edges[0]].mean(axis=0))}: heal it in the CAD program"
        )
    cut = crossing(skin)
    if cut is not None:
        raise HousingError(f"its surface cuts itself {_at(cut)}: heal it in the CAD program")
    outer = grid.only(outer_part(grid)).skin
    others = grid.only(~outer_part(grid))
    if not outer.volume_m3 > 0.0:
        raise HousingError("its solid is inside out: heal it in the CAD program, or export it anew")
    if len(others.cells):
        parts = connected(others.cells, len(others.points_m))
        for first in np.unique(parts, return_index=True)[1]:
            place = others.points_m[others.cells[first, 0]]
            if float(outer.winding(place)[0]) < 0.5:
                raise HousingError(f"a part of its surface lies outside of the rest, {_at(place)}: it is damaged")
    if abs(skin.volume_m3 - volume_m3) > _SAME_VOLUME * abs(volume_m3):
        raise HousingError(
            f"its faces enclose {1e3 * skin.volume_m3:.4g} litres of material and OpenCASCADE finds "
            f"{1e3 * volume_m3:.4g}: its surface is damaged; heal it in the CAD program"
        )


def _at(place: Real) -> str:
    return "near x = {:.4g}, y = {:.4g}, z = {:.4g} m".format(*place)

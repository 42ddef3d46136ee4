"""Solid grids of thin walls: panels of right prisms, joined by blocks along the edges of the box.

A panel is a flat grid extruded through its thickness. It ends where its neighbours begin: the beams along the twelve
edges are rows of hexahedra, the eight corners single ones. So no cell is slanted, and the welded edges, whose turning
decides the first modes, are resolved: with prisms mitred along the edges instead, 100 mm wide, modes came out up to
10 % too high. For the same reason bands as wide as a panel is thick follow its edges and both sides of its seats' rims:
quadrilaterals, so that a low order is enough across them.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.housing.box import SEAT_PLACES, Box, HousingError
from tdacoustic.housing.plane_grid import Disc, Faces, PlaneGrid, edge_points, plane_grid, rectangle

__all__ = ["BOX_PARTS", "PANELS", "SolidGrid", "box_grid", "extruded", "joined"]

Real = NDArray[np.float64]
Whole = NDArray[np.int64]

BOX_PARTS: Final = ("shell", *(f"{shaft}_{side}" for shaft, side in SEAT_PLACES), "hanger")
"""Parts of the box that a grid tells apart; the seats in the order of `SEAT_PLACES`."""

PANELS: Final = (("y", 1), ("y", -1), ("x", 1), ("x", -1), ("z", 1), ("z", -1))
"""Axis and sign of the outward normals of the panels, in their order everywhere."""

_SAME_POINT_M: Final = 1e-7

_CUBE: Final = np.array(
    [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]
)
"""Corners of a hexahedron in Netgen's order."""


@dataclass(frozen=True)
class SolidGrid:
    """Prisms and hexahedra.

    Parameters
    ----------
    points_m : ndarray, shape (n, 3)
    cells : ndarray of int, shape (m, 8)
        Corners of a face, counter-clockwise seen from the inside of the cell's other face, then those opposite; a prism
        has six and then -1.
    parts : ndarray of int, shape (m,)
        Indices into `part_names`.
    part_names : tuple of str
    faces : ndarray of int, shape (k, 4)
        Faces of the boundary that results are wanted on, or that are held; -1 behind three corners.
    face_parts : ndarray of int, shape (k,)
        Indices into `face_names`.
    face_names : tuple of str
    across : ndarray of int, shape (e, 2)
        Edges of cells that are about as short as a wall is thick: through it, or across a narrow band.
    joints : ndarray of bool, shape (m,)
        Cells at welded edges and seats, where the field through the thickness is not that of a plate.
    """

    points_m: Real
    cells: Whole
    parts: Whole
    part_names: tuple[str, ...]
    faces: Whole
    face_parts: Whole
    face_names: tuple[str, ...]
    across: Whole
    joints: NDArray[np.bool_]


@dataclass(frozen=True)
class Piece:
    """Cells, faces and edges by the coordinates of their corners; NaN where a prism or a triangle has fewer.

    Parameters
    ----------
    cells_m : ndarray, shape (m, 8, 3)
    parts : ndarray of int, shape (m,)
    faces_m : ndarray, shape (k, 4, 3)
    face_parts : ndarray of int, shape (k,)
    across_m : ndarray, shape (e, 2, 3)
    joints : ndarray of bool, shape (m,)
    """

    cells_m: Real
    parts: Whole
    faces_m: Real
    face_parts: Whole
    across_m: Real
    joints: NDArray[np.bool_]


def joined(pieces: list[Piece], part_names: tuple[str, ...], face_names: tuple[str, ...]) -> SolidGrid:
    """Return one grid of pieces; points at the same place become one."""
    cells, faces, across = (
        np.concatenate([getattr(piece, name) for piece in pieces]) for name in ("cells_m", "faces_m", "across_m")
    )
    every = np.concatenate([cells.reshape(-1, 3), faces.reshape(-1, 3), across.reshape(-1, 3)])
    there = ~np.isnan(every[:, 0])
    merged = _merged(every[there])
    _, kept = np.unique(merged, return_index=True)
    number = np.full(len(every), -1, dtype=np.int64)
    number[there] = merged
    ends = np.cumsum([cells.size // 3, faces.size // 3])
    of_cells, of_faces, of_across = np.split(number, ends)
    return SolidGrid(
        every[there][kept],
        of_cells.reshape(-1, 8),
        np.concatenate([piece.parts for piece in pieces]),
        part_names,
        of_faces.reshape(-1, 4),
        np.concatenate([piece.face_parts for piece in pieces]),
        face_names,
        np.unique(np.sort(of_across.reshape(-1, 2), axis=1), axis=0),
        np.concatenate([piece.joints for piece in pieces]),
    )


def _merged(points_m: Real) -> Whole:
    """Return the numbers of points, the same for those at the same place.

    By their distances: rounded coordinates part where rounding errors lie on two sides of a half, and a grid that is
    cut along an edge still gives modes.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    pairs = KDTree(points_m).query_pairs(_SAME_POINT_M, output_type="ndarray")
    links = coo_array((np.ones(len(pairs)), tuple(pairs.T)), shape=(len(points_m), len(points_m)))
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)


def extruded(flat: PlaneGrid, low_m: Real, high_m: Real, parts: Whole, face_part: int) -> Piece:
    """Return prisms and hexahedra between two layers of a flat grid's points; the faces are those of the high layer.

    Parameters
    ----------
    flat : PlaneGrid
    low_m, high_m : ndarray, shape (n, 3)
        The points of both layers; the cells turn counter-clockwise seen from beyond the high one.
    parts : ndarray of int, shape (m,)
    face_part : int
        Negative: no faces.
    """
    low, high = (_corners(layer, flat.cells) for layer in (low_m, high_m))
    cells = np.full((len(flat.cells), 8, 3), np.nan)
    triangle = flat.cells[:, 3] < 0
    cells[triangle, :3], cells[triangle, 3:6] = low[triangle, :3], high[triangle, :3]
    cells[~triangle, :4], cells[~triangle, 4:] = low[~triangle], high[~triangle]
    used = np.unique(flat.cells[flat.cells >= 0])
    faces = high if face_part >= 0 else high[:0]
    across = [np.stack([low_m[used], high_m[used]], axis=1), low_m[flat.narrow], high_m[flat.narrow]]
    return Piece(cells, parts, faces, np.full(len(faces), face_part), np.concatenate(across), flat.joints | (parts > 0))


def _corners(points_m: Real, cells: Whole) -> Real:
    """Return the coordinates of cells' corners, NaN where there is none."""
    return np.where(cells[..., None] >= 0, points_m[cells], np.nan)


def _turned(flat: PlaneGrid) -> PlaneGrid:
    """Return the grid with its cells the other way round."""
    cells = flat.cells.copy()
    triangle = cells[:, 3] < 0
    cells[triangle, :3] = cells[triangle, 2::-1]
    cells[~triangle] = cells[~triangle, ::-1]
    return replace(flat, cells=cells)


def _discs(box: Box, axis: str, sign: int) -> tuple[list[Disc], list[int]]:
    """Return the discs in a panel, by its own two coordinates, and the parts that they are."""
    if axis == "y":
        side = "left" if sign > 0 else "right"
        discs = [(seat.centre_m, seat.radius_m) for seat in box.seats]
        return discs, [BOX_PARTS.index(f"{seat.shaft}_{side}") for seat in box.seats]
    behind = -1 if box.seats[0].centre_m[0] <= box.seats[1].centre_m[0] else 1
    if axis == "x" and sign == behind:
        return [((0.0, 0.0), box.hanger_radius_m)], [BOX_PARTS.index("hanger")]
    return [], []


def _band(box: Box, number: int) -> float:
    """Return the width of the bands of a panel: its thickness, or less where seats leave little room."""
    normal = "xyz".index(PANELS[number][0])
    gaps = [min(box.extent_m)]
    if PANELS[number][0] == "y":
        one, other = box.seats
        gaps.append(math.dist(one.centre_m, other.centre_m) - one.radius_m - other.radius_m)
        for seat in box.seats:
            for axis, place in zip((0, 2), seat.centre_m, strict=True):
                gaps.append(0.5 * box.extent_m[axis] - box.thickness_m[axis] - abs(place) - seat.radius_m)
    return min(box.thickness_m[normal], min(gaps) / 4.0)


def _panel(box: Box, number: int, edge_m: float, faces: Faces) -> list[Piece]:
    """Return a panel between the edges, and what its seats have beyond its thickness."""
    axis, sign = PANELS[number]
    normal = "xyz".index(axis)
    first, second = (other for other in range(3) if other != normal)
    clear = [size - 2.0 * thick for size, thick in zip(box.extent_m, box.thickness_m, strict=True)]
    discs, names = _discs(box, axis, sign)
    outline, band = rectangle(clear[first], clear[second], edge_m), _band(box, number)
    flat = plane_grid(outline, discs, edge_m, faces, band, band if axis == "y" else 0.0)
    outwards = sign * np.cross(np.eye(3)[first], np.eye(3)[second])[normal] > 0.0
    flat = flat if outwards else _turned(flat)

    def layer(depth_m: float) -> Real:
        points = np.empty((len(flat.points_m), 3))
        points[:, first], points[:, second] = flat.points_m.T
        points[:, normal] = sign * (0.5 * box.extent_m[normal] - depth_m)
        return points

    parts = np.array([0, *names])[flat.parts]
    inner = layer(box.thickness_m[normal])
    pieces = [extruded(flat, inner, layer(0.0), parts, number)]
    for seat, part in zip(box.seats if axis == "y" else (), names, strict=False):
        of_it = parts == part
        disc = replace(flat, cells=flat.cells[of_it], parts=flat.parts[of_it], joints=flat.joints[of_it])
        pieces.append(extruded(disc, layer(seat.thickness_m), inner, parts[of_it], -1))
    return pieces


def _blocks(box: Box, edge_m: float) -> tuple[Real, Real]:
    """Return the lowest and highest corners of the blocks along edges and at corners, shape (blocks, 3) each."""
    half, thick = 0.5 * np.array(box.extent_m), np.array(box.thickness_m)
    walls = [[(-size, -size + t), (size - t, size)] for size, t in zip(half, thick, strict=True)]
    rows = list(itertools.product(*walls))
    for axis in range(3):
        clear = half[axis] - thick[axis]
        cuts = np.linspace(-clear, clear, edge_points(2.0 * clear, edge_m) + 1)
        beams = [list(itertools.pairwise(cuts)) if other == axis else walls[other] for other in range(3)]
        rows += list(itertools.product(*beams))
    ends = np.array(rows)
    return ends[..., 0], ends[..., 1]


def _frame(box: Box, edge_m: float) -> Piece:
    """Return the blocks along the edges and at the corners of the box."""
    half, thick = 0.5 * np.array(box.extent_m), np.array(box.thickness_m)
    lows, highs = _blocks(box, edge_m)
    cells = np.where(_CUBE[None] > 0, highs[:, None], lows[:, None])
    faces, panels = [], []
    for number, (axis, sign) in enumerate(PANELS):
        normal = "xyz".index(axis)
        outside = np.abs((highs if sign > 0 else lows)[:, normal] - sign * half[normal]) < _SAME_POINT_M
        faces.append(cells[outside][:, _around(normal, sign)])
        panels.append(np.full(outside.sum(), number))
    edges = [(i, j) for i, j in itertools.combinations(range(8), 2) if np.abs(_CUBE[i] - _CUBE[j]).sum() == 2]
    sides = cells[:, np.array(edges)].reshape(-1, 2, 3)
    length = np.abs(sides[:, 1] - sides[:, 0])
    thin = length.max(axis=1) < 1.001 * thick[length.argmax(axis=1)]
    none = np.zeros(len(cells), dtype=np.int64)
    return Piece(cells, none, np.concatenate(faces), np.concatenate(panels), sides[thin], none == 0)


def _around(normal: int, sign: int) -> list[int]:
    """Return the corners of a hexahedron's face, counter-clockwise seen from outside."""
    first, second = (normal + 1) % 3, (normal + 2) % 3
    turn = [(-1, -1), (1, -1), (1, 1), (-1, 1)][::sign]
    return [
        next(k for k, c in enumerate(_CUBE) if c[normal] == sign and (c[first], c[second]) == place) for place in turn
    ]


def box_grid(box: Box, edge_m: float, faces: Faces = "triangles") -> SolidGrid:
    """Return the solid grid of a box.

    Parameters
    ----------
    box : Box
    edge_m : float
        Length of edges along the panels, about; shortened to 0.4 of it where Netgen needs it to keep the outlines.
    faces : {"triangles", "quadrilaterals"}
        Of the panels: prisms, or hexahedra with some prisms between them.

    Returns
    -------
    SolidGrid
        With `BOX_PARTS` as parts and the outer surface as faces, by the panels' numbers in `PANELS`.

    Raises
    ------
    MissingPackageError
        NGSolve is not installed.
    HousingError
        No grid that keeps the panels' outlines.
    """
    names = tuple(f"{axis}{'+' if sign > 0 else '-'}" for axis, sign in PANELS)
    for edge in edge_m * np.linspace(1.0, 0.4, 7):
        try:
            pieces = [piece for number in range(len(PANELS)) for piece in _panel(box, number, edge, faces)]
        except HousingError as refused:
            last = refused
            continue
        return joined([*pieces, _frame(box, edge)], BOX_PARTS, names)
    raise last

"""Flat grids of triangles or quadrilaterals by Netgen, with discs embedded."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import MissingPackageError
from tdacoustic.housing.box import HousingError

__all__ = ["Disc", "Faces", "PlaneGrid", "circle", "edge_points", "plane_grid", "rectangle"]

Real = NDArray[np.float64]
Whole = NDArray[np.int64]

Faces = Literal["triangles", "quadrilaterals"]
Disc = tuple[tuple[float, float], float]
"""Centre and radius."""

_LONGEST: Final = 1.3
"""Largest edge inside over edge on the outline: Netgen then leaves the outline's points as they are."""

BANDED = 99
_GRADING: Final = 2.0
"""How fast cells may grow (Netgen's parameter); below, short edges of a disc cut the outline's edges next to it."""


@dataclass(frozen=True)
class PlaneGrid:
    """A flat grid.

    Parameters
    ----------
    points_m : ndarray, shape (n, 2)
    cells : ndarray of int, shape (m, 4)
        Corners, counter-clockwise; -1 in the last column of a triangle.
    parts : ndarray of int, shape (m,)
        0 outside of all discs, else the number of the disc, from 1.
    joints : ndarray of bool, shape (m,)
        Cells of the narrow bands along the outline and on both sides of the discs' rims.
    narrow : ndarray of int, shape (e, 2)
        Edges that run across these bands.
    """

    points_m: Real
    cells: Whole
    parts: Whole
    joints: NDArray[np.bool_]
    narrow: Whole


def edge_points(length_m: float, edge_m: float) -> int:
    """Return into how many pieces a straight side is cut."""
    return max(2, math.ceil(length_m / edge_m - 1e-9))


def rectangle(width_m: float, height_m: float, edge_m: float) -> Real:
    """Return the outline of a rectangle around the origin, cut into edges, counter-clockwise, shape (n, 2)."""
    across, up = edge_points(width_m, edge_m), edge_points(height_m, edge_m)
    x = width_m * (np.arange(across) / across - 0.5)
    y = height_m * (np.arange(up) / up - 0.5)
    low, right = np.full(across, -0.5 * height_m), np.full(up, 0.5 * width_m)
    return np.column_stack([np.concatenate([x, right, -x, -right]), np.concatenate([low, y, -low, -y])])


def circle(disc: Disc, edge_m: float) -> Real:
    """Return a polygon of the disc's area, counter-clockwise, shape (n, 2); n is a multiple of 4, at least 12."""
    (x, y), radius = disc
    number = max(12, 4 * math.ceil(0.5 * math.pi * radius / edge_m))
    step = 2.0 * math.pi / number
    angles = step * np.arange(number)
    equal = radius * math.sqrt(step / math.sin(step))
    return np.column_stack([x + equal * np.cos(angles), y + equal * np.sin(angles)])


def plane_grid(
    outline_m: Real,
    discs: Sequence[Disc],
    edge_m: float,
    faces: Faces = "triangles",
    band_m: float = 0.0,
    rim_band_m: float = 0.0,
) -> PlaneGrid:
    """Return the grid inside an outline whose points it keeps; discs are embedded as polygons of equal area.

    Parameters
    ----------
    outline_m : ndarray, shape (n, 2)
        Corners and points between them, counter-clockwise.
    discs : sequence of ((x, y), radius)
        Apart from each other and from the outline.
    edge_m : float
        Length of edges, about.
    faces : {"triangles", "quadrilaterals"}
        Quadrilaterals leave some triangles.
    band_m : float
        Width of a band of quadrilaterals along the inside of the outline, which must be a rectangle around the origin
        then; 0: none.
    rim_band_m : float
        Of one on each side of the discs' rims; 0: none.

    Raises
    ------
    MissingPackageError
        NGSolve, which brings Netgen, is not installed.
    HousingError
        Netgen did not keep the points that it was given; other lengths of edges may do.
    """
    loops, bands, regions = _loops(outline_m, discs, edge_m, band_m, rim_band_m)
    starts = np.cumsum([0, *(len(loop) for loop in loops)])
    numbers = [np.arange(start, end) for start, end in itertools.pairwise(starts)]
    points, cells, parts = _netgen_cells(loops, numbers, regions, edge_m, faces)
    every = [(cells, parts, np.zeros(len(cells), dtype=bool))]
    narrow = [np.empty((0, 2), dtype=np.int64)]
    for outer, inner, part in bands:
        strip = _strip(numbers[outer], numbers[inner])
        every.append((strip, np.full(len(strip), part), np.ones(len(strip), dtype=bool)))
        narrow.append(np.column_stack([numbers[outer], numbers[inner]]))
    cells, parts, joints = (np.concatenate(column) for column in zip(*every, strict=True))
    return PlaneGrid(np.vstack([*loops, points]), cells, parts, joints, np.concatenate(narrow))


Loops = tuple[list[Real], list[tuple[int, int, int]], list[tuple[int, int, int]]]


def _loops(outline_m: Real, discs: Sequence[Disc], edge_m: float, band_m: float, rim_band_m: float) -> Loops:
    """Return loops of points, bands (outer loop, inner loop, part) and Netgen's borders (loop, inside, outside).

    Netgen's domains are numbered from 1, the parts from 0; 0 on a side of a border is no domain of Netgen's.
    """
    loops, bands = [outline_m], []
    if band_m:
        half = np.abs(outline_m).max(axis=0)
        loops.append(outline_m - np.sign(outline_m) * band_m * (np.abs(outline_m) > half * (1.0 - 1e-9)))
        bands.append((0, 1, 0))
    regions = [(len(loops) - 1, 1, 0)]
    for part, ((x, y), radius) in enumerate(discs, start=1):
        first = len(loops)
        rim = circle(((x, y), radius), edge_m)
        widths = (rim_band_m, 0.0, -rim_band_m) if rim_band_m else (0.0,)
        loops += [(x, y) + (rim - (x, y)) * (1.0 + width / radius) for width in widths]
        if rim_band_m:
            bands += [(first, first + 1, 0), (first + 1, first + 2, part)]
            regions += [(first, 0, 1), (first + 2, part + 1, 0)]
        else:
            regions.append((first, part + 1, 1))
    return loops, bands, regions


def _netgen_cells(
    loops: list[Real], numbers: list[Whole], regions: list[tuple[int, int, int]], edge_m: float, faces: Faces
) -> tuple[Real, Whole, Whole]:
    """Return further points, and cells and parts between the loops."""
    try:
        from netgen.geom2d import SplineGeometry
        from netgen.meshing import NgException
    except ImportError:
        raise missing_ngsolve() from None
    geometry = SplineGeometry()
    for loop, inside, outside in regions:
        corners = [geometry.AppendPoint(float(x), float(y)) for x, y in loops[loop]]
        for start, end in zip(corners, corners[1:] + corners[:1], strict=True):
            geometry.Append(["line", start, end], leftdomain=inside, rightdomain=outside)
    given = np.concatenate([numbers[loop] for loop, _, _ in regions])
    try:
        grid = geometry.GenerateMesh(maxh=_LONGEST * edge_m, grading=_GRADING, quad_dominated=faces == "quadrilaterals")
    except NgException:
        grid = None
    if grid is None or len(grid.Elements1D()) != len(given):
        raise HousingError(f"Netgen makes no grid of a panel that keeps its outline, with edges of {edge_m:g} m")
    points = np.array([point.p[:2] for point in grid.Points()])
    every = sum(len(loop) for loop in loops)
    known = np.concatenate([given, np.arange(every, every + len(points) - len(given))])
    elements = grid.Elements2D()
    cells = np.full((len(elements), 4), -1, dtype=np.int64)
    for row, element in zip(cells, elements, strict=True):
        corners = [vertex.nr - 1 for vertex in element.vertices]
        row[: len(corners)] = known[corners]
    return points[len(given) :], cells, np.array([element.index - 1 for element in elements], dtype=np.int64)


def _strip(outer: Whole, inner: Whole) -> Whole:
    """Return the quadrilaterals between two loops of as many points."""
    return np.column_stack([outer, np.roll(outer, -1), np.roll(inner, -1), inner])


def missing_ngsolve() -> MissingPackageError:
    """Return the error that says how to install NGSolve."""
    return MissingPackageError(
        'the modes of a housing need the package ngsolve, which is not installed: pip install "tdacoustic[housing]"'
    )

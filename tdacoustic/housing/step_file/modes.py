"""From a STEP file to modes: grid, matrices, natural modes, static correction, and velocities of the outer panels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.housing.box import HousingError
from tdacoustic.housing.box_modes import MODES_BEYOND
from tdacoustic.housing.eigenmodes import natural_modes, residual_modes
from tdacoustic.housing.elasticity import Structure
from tdacoustic.housing.response import SeatResponse
from tdacoustic.housing.step_file.isolation import run_apart
from tdacoustic.housing.step_file.outer_panels import OuterPanels, outer_panels
from tdacoustic.housing.step_file.solid import Planes, SolidHousing, SolidWish
from tdacoustic.housing.step_file.survey import surveyed
from tdacoustic.housing.step_file.tetrahedra import (
    EDGES_A_WAVE,
    ORDER,
    OUTER,
    bending_wave_m,
    solid_structure,
    tetrahedra,
)
from tdacoustic.housing.step_file.text import check_text
from tdacoustic.housing.step_file.triangles import Skin
from tdacoustic.housing.surface import lagrange_at, lattice, read_only

__all__ = ["SolidModes", "SolidPanels", "solid_modes"]

Real = NDArray[np.float64]

MOST_S: Final = 5400.0
MOST_BYTES: Final = 24_000_000_000
"""Bounds of the computation [assumed]: ten times what the largest grid that is taken needs in time, twice in memory."""


@dataclass(frozen=True)
class SolidPanels:
    """Flat panels on the outside, and what they do in each mode.

    Parameters
    ----------
    size_m : float
    vertices_m : ndarray, shape (n, 3)
        In the file's axes.
    panels : ndarray of int, shape (m, 4)
        Those on the positive sides of the mirror planes, counter-clockwise from outside; -1 behind three corners.
    planes_m : tuple of (str, float)
    velocities : ndarray of float32, shape (m times reflections, modes)
        Mean velocity along the outward normal per modal velocity in 1/√kg, by reflections as of
        `tdacoustic.radiation.surfaces.Mirrors.signs`.
    """

    size_m: float
    vertices_m: Real
    panels: NDArray[np.int64]
    planes_m: Planes
    velocities: NDArray[np.float32]

    def __post_init__(self) -> None:
        read_only(self)


@dataclass(frozen=True)
class SolidModes(SeatResponse):
    """Modes of a solid with a modal mass of 1 kg, as `HousingModes` of a box.

    Parameters
    ----------
    highest_hz : float
        Responses are good up to here.
    natural : int
        Number of natural modes; the others are the static correction.
    frequency_hz : ndarray, shape (modes,)
    seats : ndarray, shape (modes, 4, 3)
        Mean displacement of each seat by `SEAT_PLACES` along x, y, z of the drive frame, in 1/√kg.
    mass_kg : float
    unknowns : int
        Of the finite elements.
    grids : tuple of SolidPanels
        From coarse to fine.
    """

    highest_hz: float
    natural: int
    frequency_hz: Real
    seats: Real
    mass_kg: float
    unknowns: int
    grids: tuple[SolidPanels, ...]

    def __post_init__(self) -> None:
        number = len(self.frequency_hz)
        if self.seats.shape != (number, 4, 3) or any(grid.velocities.shape[1] != number for grid in self.grids):
            raise HousingError(f"{number} modes need seats of shape {(number, 4, 3)}, got {self.seats.shape}")
        if not (np.isfinite(self.frequency_hz).all() and (np.asarray(self.frequency_hz) > 0.0).all()):
            raise HousingError("frequency_hz of modes must be > 0")
        read_only(self)

    @property
    def own_loss_factor(self) -> float:
        """That of steel plates [assumed]; a fleet states its own."""
        return 0.02

    def panels_of(self, size_m: float) -> SolidPanels:
        """Return the panels of a size that was asked for.

        Raises
        ------
        HousingError
            There are none.
        """
        for grid in self.grids:
            if math.isclose(grid.size_m, size_m, rel_tol=1e-6):
                return grid
        raise HousingError(f"there are no panels of {size_m:g} m")


def solid_modes(path: Path, wish: SolidWish, highest_hz: float, sizes_m: Sequence[float]) -> SolidModes:
    """Return the modes of a STEP file's solid for responses up to a frequency, computed in a process of its own.

    Parameters
    ----------
    path : Path
    wish : SolidWish
    highest_hz : float
    sizes_m : sequence of float
        Of the panels wanted.

    Raises
    ------
    HousingError
        The file cannot be a housing, or cannot be computed.
    MissingPackageError
        NGSolve is not installed.
    """
    check_text(path.read_bytes())
    arguments = (path, wish, highest_hz, tuple(sizes_m))
    found = run_apart(f"{__name__}:_modes", arguments, "computing its modes", MOST_S, MOST_BYTES)
    assert isinstance(found, SolidModes)
    return found


def _modes(path: Path, wish: SolidWish, highest_hz: float, sizes_m: tuple[float, ...]) -> SolidModes:
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1):
        found = surveyed(path, wish)
        whole, housing = found.seating.whole, found.housing
        panels = [outer_panels(whole, size, housing.planes_m) for size in sizes_m]
        reach = MODES_BEYOND * highest_hz
        edge = min(bending_wave_m(housing, wish, reach) / EDGES_A_WAVE, 0.4 * min(housing.extent_m))
        structure = solid_structure(tetrahedra(whole, housing, edge), housing, wish)
        frequency, vectors = natural_modes(structure, reach, _expected(housing, wish, reach))
        further, residual = residual_modes(structure, frequency, vectors)
        every = np.vstack([vectors, residual])
        outside = _Outside(structure, every)
        return SolidModes(
            highest_hz,
            len(frequency),
            np.concatenate([frequency, further]),
            (every @ structure.loads.T).reshape(-1, 4, 3),
            structure.mass_kg,
            structure.unknowns,
            tuple(outside.moved(held) for held in panels),
        )


def _expected(housing: SolidHousing, wish: SolidWish, highest_hz: float) -> int:
    """Return about how many modes there are: plates of the outer surface (`box_modes.expected_modes`), edges aside."""
    wave = 2.0 * math.pi / bending_wave_m(housing, wish, highest_hz)
    return math.ceil(0.7 * housing.area_m2 * wave**2 / (4.0 * math.pi)) + 12


class _Outside:
    """The displacements on the outer boundary of a grid, and what panels there get of them.

    On a curved triangle a displacement is a polynomial in the triangle's own coordinates, so its values at the lattice
    of the elements' order keep it without loss.
    """

    def __init__(self, structure: Structure, vectors: Real) -> None:
        import ngsolve

        nodes = lattice(ORDER)
        places = (nodes / ORDER)[:, :2].tolist()  # NGSolve's own coordinates are the shares of the first two corners
        rule = ngsolve.IntegrationRule(points=[tuple(place) for place in places], weights=[1.0] * len(places))
        where = structure.grid.MapToAllElements(rule, structure.grid.Boundaries(OUTER))
        self.nodes = len(places)
        self.points = np.asarray(ngsolve.CF((ngsolve.x, ngsolve.y, ngsolve.z))(where)).reshape(-1, 3)
        field = ngsolve.GridFunction(structure.space)
        self.values = np.empty((len(vectors), len(self.points), 3), dtype=np.float32)
        for vector, out in zip(vectors, self.values, strict=True):
            field.vec.FV().NumPy()[:] = vector
            out[:] = np.asarray(field(where)).reshape(-1, 3)

    @cached_property
    def _fine(self) -> tuple[Skin, Any]:
        """The boundary in flat triangles between lattice nodes, and these triangles' corners in shares of their own."""
        nodes = lattice(ORDER)
        numbers = {tuple(node): number for number, node in enumerate(nodes.tolist())}
        small = []
        for a, b, c in nodes.tolist():
            if a > 0:
                small.append([numbers[a, b, c], numbers[a - 1, b + 1, c], numbers[a - 1, b, c + 1]])
            if a > 0 and b > 0:
                small.append([numbers[a, b, c], numbers[a - 1, b, c + 1], numbers[a, b - 1, c + 1]])
        owners = np.arange(0, len(self.points), self.nodes)
        triangles = (owners[:, None, None] + np.array(small)[None]).reshape(-1, 3)
        return Skin(self.points, triangles), np.array(small)

    def _weights(self, points: Real) -> tuple[NDArray[np.int64], Real]:
        """Return nodes and weights whose sum of products with values is the field at the boundary's closest points."""
        skin, small = self._fine
        _, chosen, within = skin.closest(points)
        element, which = np.divmod(chosen, len(small))
        shares = np.einsum("nc,nck->nk", within, lattice(ORDER)[small[which]] / ORDER)
        return element[:, None] * self.nodes + np.arange(self.nodes), lagrange_at(shares, ORDER)

    def moved(self, held: OuterPanels) -> SolidPanels:
        """Return panels with their mean velocities along their normals."""
        from scipy.sparse import coo_array

        corners = _all_corners(held)
        points, shares, owner = _quadrature(corners)
        area = 0.5 * np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
        normals = area / np.linalg.norm(area, axis=1)[:, None]
        nodes, weights = self._weights(points)
        weights = weights * shares[:, None]
        rows = np.repeat(owner, self.nodes)
        found = np.zeros((len(corners), len(self.values)))
        for axis in range(3):
            turned = (weights * normals[owner, axis][:, None]).ravel()
            picked = coo_array((turned, (rows, nodes.ravel())), shape=(len(corners), len(self.points))).tocsr()
            found += picked @ self.values[:, :, axis].T
        return SolidPanels(held.size_m, held.vertices_m, held.panels, held.planes_m, found.astype(np.float32))


def _all_corners(held: OuterPanels) -> Real:
    """Return the corners (panels, 4, 3) of all panels, by reflections; triangles repeat the last."""
    panels = held.panels.copy()
    panels[:, 3] = np.where(panels[:, 3] < 0, panels[:, 2], panels[:, 3])
    found = [held.vertices_m[panels]]
    for name, at in reversed(held.planes_m):  # the last plane's sign changes fastest
        axis = "xyz".index(name)
        mirrored = []
        for corners in found:
            other = corners.copy()
            other[..., axis] = 2.0 * at - other[..., axis]
            triangle = (panels[:, 2] == panels[:, 3])[:, None, None]
            turned = np.where(triangle, other[:, [0, 2, 1, 1]], other[:, [0, 3, 2, 1]])
            mirrored.append(turned)
        found = found + mirrored
    return np.concatenate(found)


def _quadrature(corners: Real) -> tuple[Real, Real, NDArray[np.int64]]:
    """Return points on panels, their parts of the panel's area, and the panels' numbers.

    Three by three points of Gauss on the square that a panel is the image of; a triangle's last two corners are one.
    """
    ends, shares = np.polynomial.legendre.leggauss(3)
    points, parts = [], []
    for (u, of_u), (v, of_v) in (
        (a, b) for a in zip(ends, shares, strict=True) for b in zip(ends, shares, strict=True)
    ):
        of = 0.25 * np.array([(1 - u) * (1 - v), (1 + u) * (1 - v), (1 + u) * (1 + v), (1 - u) * (1 + v)])
        along_u = 0.25 * np.array([-(1 - v), 1 - v, 1 + v, -(1 + v)])
        along_v = 0.25 * np.array([-(1 - u), -(1 + u), 1 + u, 1 - u])
        points.append(np.einsum("c,pcd->pd", of, corners))
        stretch = np.cross(np.einsum("c,pcd->pd", along_u, corners), np.einsum("c,pcd->pd", along_v, corners))
        parts.append(of_u * of_v * np.linalg.norm(stretch, axis=1))
    whole = np.stack(parts)
    whole /= whole.sum(axis=0)
    return np.concatenate(points), whole.ravel(), np.tile(np.arange(len(corners)), len(points))

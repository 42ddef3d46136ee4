"""From a box to its modes: grid, matrices, natural modes, static correction, samples."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.housing.box import Box, HousingError
from tdacoustic.housing.eigenmodes import natural_modes, residual_modes
from tdacoustic.housing.elasticity import ORDER, Structure, structure_of
from tdacoustic.housing.modes import HousingModes
from tdacoustic.housing.solid_grid import BOX_PARTS, SolidGrid, box_grid
from tdacoustic.housing.surface import PanelNodes, panel_nodes

__all__ = ["MODES_BEYOND", "box_structure", "edge_for", "expected_modes", "housing_modes"]

MODES_BEYOND: Final = 1.2
"""Natural modes are computed up to this times the highest frequency; the static correction stands for the rest."""

_EDGES_A_WAVE: Final = 2.0
"""Edges of the grid a bending wave of the thinnest panel, at the highest natural mode; order 4."""


def _bending_wave_number(box: Box, thickness_m: float, frequency_hz: float) -> float:
    """Return k of free bending waves on a thin plate (Kirchhoff)."""
    rigidity = box.modulus_pa * thickness_m**2 / (12.0 * (1.0 - box.poisson**2) * box.density_kg_m3)
    return math.sqrt(2.0 * math.pi * frequency_hz / math.sqrt(rigidity))


def expected_modes(box: Box, highest_hz: float) -> int:
    """Return about how many natural modes there are up to a frequency.

    Each panel, less its seats, counts N = A k²/(4π) - P k/(4π) (Weyl and Courant; P the perimeter, simply supported);
    the reference housing has as many within 3 % at 3 kHz, to which some are added.

    Parameters
    ----------
    box : Box
    highest_hz : float
    """
    number = 6.0
    for normal, thickness in enumerate(box.thickness_m):
        first, second = (size for axis, size in enumerate(box.extent_m) if axis != normal)
        seats = sum(math.pi * seat.radius_m**2 for seat in box.seats) if normal == 1 else 0.0
        wave = _bending_wave_number(box, thickness, highest_hz)
        panel = ((first * second - seats) * wave**2 - 2.0 * (first + second) * wave) / (4.0 * math.pi)
        number += 2.0 * max(panel, 0.0)
    return math.ceil(1.05 * number) + 6


def edge_for(box: Box, highest_hz: float) -> float:
    """Return the length of the grid's edges that modes up to a frequency need."""
    wave = 2.0 * math.pi / _bending_wave_number(box, min(box.thickness_m), highest_hz)
    return min(wave / _EDGES_A_WAVE, 0.4 * min(box.extent_m))


def box_structure(box: Box, grid: SolidGrid, order: int = ORDER) -> Structure:
    """Return the matrices of a box on its springs; its loads are unit forces on the seats, by seat and direction.

    Parameters
    ----------
    box : Box
    grid : SolidGrid
        Of the box (`solid_grid.box_grid`).
    order : int

    Raises
    ------
    MissingPackageError
        NGSolve is not installed.
    """
    seats = BOX_PARTS[1:-1]
    springs = {part: box.seats[number // 2].stiffness_n_per_m for number, part in enumerate(seats)}
    return structure_of(
        grid,
        box.modulus_pa,
        box.poisson,
        box.density_kg_m3,
        springs | {"hanger": box.hanger_stiffness_n_per_m},
        loaded=seats,
        order=order,
    )


def housing_modes(
    box: Box, highest_hz: float = 3000.0, *, edge_m: float | None = None, order: int = ORDER
) -> HousingModes:
    """Return the modes of a box for responses up to a frequency.

    Natural modes up to `MODES_BEYOND` times that frequency, and the static correction for forces at the seats.

    Parameters
    ----------
    box : Box
    highest_hz : float
        Up to which responses are wanted.
    edge_m : float, optional
        Edges of the grid; default from the bending waves (`edge_for`).
    order : int
        Of the elements along the walls, at least 2; below 4 thin walls come out too stiff.

    Raises
    ------
    HousingError
        A frequency or an edge that is not above zero, or an order below 2.
    MissingPackageError
        NGSolve is not installed.
    """
    if not (math.isfinite(highest_hz) and highest_hz > 0.0):
        raise HousingError(f"highest_hz must be > 0, got {highest_hz!r}")
    if edge_m is not None and not (math.isfinite(edge_m) and edge_m > 0.0):
        raise HousingError(f"edge_m must be > 0, got {edge_m!r}")
    if order < 2:
        raise HousingError(f"order must be at least 2, got {order!r}")
    reach = MODES_BEYOND * highest_hz
    grid = box_grid(box, edge_for(box, reach) if edge_m is None else edge_m)
    structure = box_structure(box, grid, order)
    frequency, vectors = natural_modes(structure, reach, expected_modes(box, reach))
    further, residual = residual_modes(structure, frequency, vectors)
    every = np.vstack([vectors, residual])
    surface, outward = _sampled(grid, structure, every, order)
    return HousingModes(
        box,
        highest_hz,
        len(frequency),
        np.concatenate([frequency, further]),
        (every @ structure.loads.T).reshape(-1, 4, 3),
        surface,
        outward,
        structure.mass_kg,
    )


def _sampled(
    grid: SolidGrid, structure: Structure, vectors: NDArray[np.float64], order: int
) -> tuple[PanelNodes, NDArray[np.float64]]:
    """Return the nodes of the outer surface and the outward displacements of vectors there.

    Prisms are kept without loss. On the quadrilaterals of edges and narrow bands, cut into two triangles, a field that
    is of high order both ways is interpolated.
    """
    import ngsolve

    square = grid.faces[:, 3] >= 0
    corners = np.concatenate([grid.faces[:, :3], grid.faces[square][:, [0, 2, 3]]])
    panels = np.concatenate([grid.face_parts, grid.face_parts[square]])
    surface = panel_nodes(grid.points_m[corners], panels, order)
    places = structure.grid(*surface.points_m.T)
    field = ngsolve.GridFunction(structure.space)
    outward = np.empty((len(vectors), len(surface.points_m)))
    for vector, out in zip(vectors, outward, strict=True):
        field.vec.FV().NumPy()[:] = vector
        out[:] = np.einsum("nd,nd->n", np.asarray(field(places)), surface.normals)
    return surface, outward

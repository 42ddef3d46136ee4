"""Plates as solid grids, for comparison with tables."""

import math

import numpy as np

from tdacoustic.housing.eigenmodes import natural_modes
from tdacoustic.housing.elasticity import structure_of
from tdacoustic.housing.plane_grid import plane_grid
from tdacoustic.housing.solid_grid import Piece, extruded, joined

MODULUS_PA, DENSITY_KG_M3 = 210e9, 7850.0
HELD = 1e16
"""N/m over a rim: a thousand times what a plate of 5 mm has through its own thickness."""

RIMS = ("rim x", "rim y")


def rigidity(thickness_m, poisson):
    return MODULUS_PA * thickness_m**3 / (12.0 * (1.0 - poisson**2))


def hertz(parameter, length_m, thickness_m, poisson=0.3):
    """Frequency of the tables' λ² = ω a² √(ρ h / D)."""
    per_area = DENSITY_KG_M3 * thickness_m
    return parameter / (2.0 * math.pi * length_m**2) * math.sqrt(rigidity(thickness_m, poisson) / per_area)


def plate_modes(
    outline_m,
    thickness_m,
    edge_m,
    highest_hz,
    springs,
    faces="triangles",
    order=4,
    poisson=0.3,
    expected=16,
    band_m=0.0,
):
    """Natural frequencies of a plate; springs by "plate", "rim x" and "rim y" (rims with that normal)."""
    structure = plate_structure(outline_m, thickness_m, edge_m, springs, faces, order, poisson, band_m)
    found, _ = natural_modes(structure, highest_hz, expected)
    return found


def plate_structure(
    outline_m, thickness_m, edge_m, springs, faces="triangles", order=4, poisson=0.3, band_m=0.0, held=None
):
    """Matrices of a plate; its loads are unit forces on the whole of it. Only rims through `held` points, if given."""
    flat = plane_grid(outline_m, [], edge_m, faces, band_m)
    low, high = (np.column_stack([flat.points_m, np.full(len(flat.points_m), z)]) for z in (0.0, thickness_m))
    plate = extruded(flat, low, high, np.zeros(len(flat.cells), dtype=np.int64), 2)
    start, end = np.arange(len(outline_m)), np.roll(np.arange(len(outline_m)), -1)
    rims = np.stack([low[start], low[end], high[end], high[start]], axis=1)
    along = np.abs(outline_m[end] - outline_m[start])
    if held is not None:
        chosen = held(0.5 * (outline_m[end] + outline_m[start]))
        rims, along = rims[chosen], along[chosen]
    rim = Piece(
        np.empty((0, 8, 3)),
        np.empty(0, dtype=np.int64),
        rims,
        (along[:, 0] > along[:, 1]).astype(np.int64),
        np.empty((0, 2, 3)),
        np.empty(0, dtype=bool),
    )
    grid = joined([plate, rim], ("plate",), (*RIMS, "top"))
    return structure_of(grid, MODULUS_PA, poisson, DENSITY_KG_M3, springs, loaded=("plate",), order=order)

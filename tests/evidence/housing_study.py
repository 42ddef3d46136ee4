"""The reference housing's modes and responses against tetrahedra, finer grids and direct solutions."""

from __future__ import annotations

import hashlib
import json
import math
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from reference_housing import reference_box

HERE = Path(__file__).resolve().parent
RECORD = HERE / "housing_record.json"
HIGHEST_HZ = 1500.0

TETRAHEDRA = ((0.15, 0.03, 3, 1030.0, 60), (0.15, 0.03, 4, 1030.0, 60), (0.15, 0.03, 5, 520.0, 32))
"""Edges in m far from the inner edges and along them, order, highest frequency in Hz, modes asked for."""

GRIDS = ((1.4, 4), (1.0, 4), (0.7, 4), (1.0, 3), (1.4, 5))
"""Edges over those that `edge_for` gives, and order."""

FINEST = (0.7, 5, 3, 5)
"""The same of the grid they are held against, and its orders through walls and joints."""

RESPONSE_HZ = (150.0, 475.0, 700.0, 1000.0, 1250.0, 1500.0)
POINTS = 1500
"""Of the outer surface, drawn evenly over its area, that a rms velocity is taken of."""


def digest(paths: Iterable[Path]) -> str:
    """Return the SHA-256 of files; the ends of lines do not count."""
    held = hashlib.sha256()
    for path in paths:
        text = path.read_text(encoding="utf-8")  # universal newlines: CRLF is read as LF
        held.update(f"{path.parent.name}/{path.name}\n{text}\n".encode())
    return held.hexdigest()


def source_files() -> list[Path]:
    """The program's modules that the study rests on, itself and the reference housing."""
    import tdacoustic.housing

    own = [Path(__file__).resolve(), HERE.parent / "housing" / "reference_housing.py"]
    return [*sorted(Path(tdacoustic.housing.__file__).parent.glob("*.py")), *own]


def sources() -> str:
    """Return the stamp of our side."""
    return digest(source_files())


def tetrahedra_sources() -> str:
    """Return the stamp of the tetrahedra, which take a box and nothing else from the program."""
    box = reference_box()
    text = (HERE / "housing_tetrahedra.py").read_text(encoding="utf-8")
    return hashlib.sha256(f"{text}\n{box}\n{TETRAHEDRA}".encode()).hexdigest()


def record() -> dict[str, Any]:
    """Return what was recorded."""
    return dict(json.loads(RECORD.read_text(encoding="utf-8")))


# ---------------------------------------------------------------- modes


def tetrahedra(case: tuple[float, float, int, float, int]) -> dict[str, Any]:
    """Return the modes of unstructured tetrahedra."""
    from housing_tetrahedra import frequencies_hz

    edge_m, joint_edge_m, order, highest_hz, number = case
    start = time.process_time()
    found = frequencies_hz(reference_box(), highest_hz, number, edge_m, joint_edge_m, order)
    found["frequency_hz"] = np.round(found["frequency_hz"], 4).tolist()
    what = {"edge_m": edge_m, "joint_edge_m": joint_edge_m, "order": order, "highest_hz": highest_hz}
    return {**what, **found, "cpu_s": round(time.process_time() - start, 1)}


def grid_modes(factor: float, order: int, through: int | None = None, joints: int | None = None) -> dict[str, Any]:
    """Return the modes of our own grid."""
    import tdacoustic.housing.elasticity as elasticity
    from tdacoustic.housing.box_modes import MODES_BEYOND, box_structure, edge_for, expected_modes
    from tdacoustic.housing.eigenmodes import natural_modes
    from tdacoustic.housing.solid_grid import box_grid

    box, before = reference_box(), (elasticity.THROUGH, elasticity.THROUGH_JOINTS)
    start = time.process_time()
    try:
        elasticity.THROUGH, elasticity.THROUGH_JOINTS = through or before[0], joints or before[1]
        structure = box_structure(box, box_grid(box, factor * edge_for(box, MODES_BEYOND * HIGHEST_HZ)), order)
        found, _ = natural_modes(structure, 1.03 * HIGHEST_HZ, expected_modes(box, 1.03 * HIGHEST_HZ))
    finally:
        elasticity.THROUGH, elasticity.THROUGH_JOINTS = before
    return {
        "edges_over_ours": factor,
        "order": order,
        "order_through": through or before[0],
        "order_through_joints": joints or before[1],
        "unknowns": structure.unknowns,
        "frequency_hz": np.round(found, 4).tolist(),
        "cpu_s": round(time.process_time() - start, 1),
    }


def apart(ours_hz: list[float], theirs_hz: list[float], highest_hz: float, first: int | None = None) -> dict[str, Any]:
    """Return ours over theirs less 1 in percent, mode by mode from the lowest up to a frequency."""
    theirs = np.array(theirs_hz)
    number = min(int((theirs < highest_hz).sum()), len(ours_hz), first or len(theirs))
    off = 100.0 * (np.array(ours_hz[:number]) / theirs[:number] - 1.0)
    return {
        "modes": number,
        "median_percent": round(float(np.median(off)), 3),
        "worst_percent": round(float(off[np.abs(off).argmax()]), 3),
        "near_percent": {
            f"{at:g} Hz": round(float(off[np.abs(theirs[:number] - at).argmin()]), 3)
            for at in (500.0, 1000.0, 1500.0)
            if at < theirs[number - 1] + 20.0
        },
    }


# ---------------------------------------------------------------- responses


def surface_points(number: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points spread by chance evenly over the outer surface, and outward normals, shape (number, 3)."""
    rng = np.random.default_rng(20261122)
    half = 0.5 * np.array(reference_box().extent_m)
    areas = np.array([math.prod(half) / half[axis] for axis in range(3)])
    axes = rng.choice(3, size=number, p=areas / areas.sum())
    normals = np.zeros((number, 3))
    normals[np.arange(number), axes] = rng.choice([-1.0, 1.0], size=number)
    points = rng.uniform(-0.999, 0.999, (number, 3)) * half
    return np.where(normals != 0.0, normals * half, points), normals


def complex_forms(structure: Any) -> tuple[Any, Any, Any]:
    """Return K and M written anew on a complex space of the same orders, and its space."""
    import ngsolve as ng

    box, grid, real = reference_box(), structure.grid, structure.space
    space = ng.H1(grid, order=real.globalorder, dim=3, complex=True)
    for kind in (ng.VERTEX, ng.EDGE, ng.FACE, ng.CELL):
        for node in grid.nodes(kind):
            space.SetOrder(ng.NodeId(kind, node.nr), real.GetOrder(ng.NodeId(kind, node.nr)))
    space.UpdateDofTables()
    u, v = space.TnT()
    strain = 0.5 * (ng.Grad(u) + ng.Grad(u).trans)
    shear = box.modulus_pa / (2.0 * (1.0 + box.poisson))
    bulk_like = 2.0 * shear * box.poisson / (1.0 - 2.0 * box.poisson)
    stress = 2.0 * shear * strain + bulk_like * ng.Trace(strain) * ng.Id(3)
    stiffness = ng.BilinearForm(space, symmetric=True)
    stiffness += ng.InnerProduct(stress, ng.Grad(v)) * ng.dx
    held = {f"{seat.shaft}_{side}": seat.stiffness_n_per_m for seat in box.seats for side in ("left", "right")}
    for name, springs in (held | {"hanger": box.hanger_stiffness_n_per_m}).items():
        volume = ng.Integrate(1.0, grid, definedon=grid.Materials(name))
        for axis, spring in enumerate(springs):
            stiffness += spring / volume * u[axis] * v[axis] * ng.dx(definedon=grid.Materials(name))
    mass = ng.BilinearForm(space, symmetric=True)
    mass += box.density_kg_m3 * u * v * ng.dx
    stiffness.Assemble()
    mass.Assemble()
    return stiffness.mat, mass.mat, space


def direct_velocities(structure: Any, forms: Any, frequency_hz: float, places: Any, normals: np.ndarray) -> np.ndarray:
    """Return outward velocities under each unit load from K (1 + jη) - ω² M solved, shape (loads, points)."""
    import ngsolve as ng

    stiffness, mass, space = forms
    omega = 2.0 * math.pi * frequency_hz
    matrix = stiffness.CreateMatrix()
    matrix.AsVector().data = (
        1.0 + 1j * reference_box().loss_factor
    ) * stiffness.AsVector() - omega**2 * mass.AsVector()
    inverse = matrix.Inverse(space.FreeDofs(), inverse="sparsecholesky")
    found, load = stiffness.CreateColVector(), stiffness.CreateColVector()
    field = ng.GridFunction(structure.space)  # a complex field of three directions cannot be evaluated at points
    rows = []
    for unit in structure.loads:
        load.FV().NumPy()[:] = unit
        found.data = inverse * load
        left = load.CreateVector()
        left.data = load - matrix * found
        found.data += inverse * left
        outward = []
        for part in (found.FV().NumPy().real, found.FV().NumPy().imag):
            field.vec.FV().NumPy()[:] = part
            outward.append(np.einsum("nd,nd->n", np.asarray(field(places)).reshape(-1, 3), normals))
        rows.append(1j * omega * (outward[0] + 1j * outward[1]))
    return np.array(rows)


def responses() -> list[dict[str, Any]]:
    """Return by how much modal responses miss direct ones, by highest natural mode, correction and frequency."""
    from tdacoustic.housing.box_modes import MODES_BEYOND, _sampled, box_structure, edge_for, expected_modes
    from tdacoustic.housing.eigenmodes import natural_modes, residual_modes
    from tdacoustic.housing.modes import HousingModes
    from tdacoustic.housing.solid_grid import box_grid

    box, reach = reference_box(), MODES_BEYOND * HIGHEST_HZ
    grid = box_grid(box, edge_for(box, reach))
    structure = box_structure(box, grid)
    frequency, vectors = natural_modes(structure, reach, expected_modes(box, reach))
    points, normals = surface_points(POINTS)
    forms, places = complex_forms(structure), structure.grid(*points.T)
    direct = {at: direct_velocities(structure, forms, at, places, normals) for at in RESPONSE_HZ}
    unit = np.eye(12).reshape(12, 4, 3).transpose(1, 2, 0)
    rows = []
    for beyond in (0.7, 1.0, MODES_BEYOND):
        kept = int((frequency <= beyond * HIGHEST_HZ).sum())
        further, residual = residual_modes(structure, frequency[:kept], vectors[:kept])
        every = np.vstack([vectors[:kept], residual])
        surface, outward = _sampled(grid, structure, every, 4)
        seats = (every @ structure.loads.T).reshape(-1, 4, 3)
        hz = np.concatenate([frequency[:kept], further])
        modes = HousingModes(box, HIGHEST_HZ, kept, hz, seats, surface, outward, structure.mass_kg)
        at_points = modes.normal_at(points, normals)
        for corrected, number in ((True, len(hz)), (False, kept)):
            for at, exact in direct.items():
                velocity = modes.response(np.full(12, at), unit)[:number].T @ at_points[:number]
                rows.append({"modes_up_to_hz": beyond * HIGHEST_HZ, "natural_modes": kept, "corrected": corrected})
                rows[-1] |= {"frequency_hz": at, **misses(velocity, exact)}
    return rows


def misses(found: np.ndarray, exact: np.ndarray) -> dict[str, float]:
    """Return how far rms velocities over the surface are apart, and the rms of the difference, of all loads."""
    rms = [np.sqrt((np.abs(part) ** 2).mean(axis=1)) for part in (found, exact, found - exact)]
    level = 20.0 * np.log10(rms[0] / rms[1])
    return {
        "worst_level_db": round(float(level[np.abs(level).argmax()]), 4),
        "mean_level_db": round(float(level.mean()), 4),
        "worst_difference_percent": round(100.0 * float((rms[2] / rms[1]).max()), 4),
    }

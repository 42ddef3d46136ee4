"""Our boundary elements on the cases of `radiation_cases`: beside other codes, over their grids, and in energy."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from radiation_cases import (
    BOX_M,
    CASES,
    FAR,
    IMPEDANCE_PA_S_M,
    RADIUS_M,
    SOURCE_M,
    SPEED_M_S,
    Case,
    ball,
    ball_pressures,
    hashed,
    plate,
    receivers,
)

from tdacoustic.radiation.boundary_elements import ExteriorProblem
from tdacoustic.radiation.grids import box_surface, sphere_surface
from tdacoustic.radiation.sphere_rules import SphereRule
from tdacoustic.radiation.surfaces import Surface

HERE = Path(__file__).parent
RECORD = HERE / "radiation_record.json"
MODULES = ("surfaces", "grids", "panel_kernels", "panel_integrals", "mirror_threads", "boundary_elements")
DENSITIES = (7.5, 15.0)
"""Of our grids beside other codes, in panels a wavelength."""

COARSEST_M = BOX_M[1] / 6.0
"""Longest panel that the program makes on this box, however long the wave (`radiation.box_in_air`)."""

SWEEP, FINEST = (5.0, 6.0, 7.5, 9.0, 11.0, 15.0), 24.0
SWEEP_HZ = (700.0, 1000.0)
PATTERNS = ((1, 1), (2, 1), (1, 2), (3, 1), (3, 2), (2, 3), (4, 2), (4, 3), (5, 3), (6, 4))
ENERGIES = ((200.0, 30.0), (525.0, 15.0), (1000.0, 15.0))
"""Frequencies in Hz, and panels a wavelength: at 200 Hz the half waves are shorter than that of sound."""

REACH_M = 0.71
"""From the centre of the box to its corners."""

QUIET_DB = 10.0
"""Receivers further below the mean are left out of the worst level difference: there a level is a zero's."""

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)


def sources() -> str:
    """Return the SHA-256 of the modules that our side rests on."""
    import tdacoustic.radiation

    folder = Path(tdacoustic.radiation.__file__).parent
    return hashed([*(folder / f"{name}.py" for name in MODULES), HERE / "radiation_cases.py", Path(__file__)])


def fields_sources() -> str:
    """Return the SHA-256 of what the fields of other codes rest on."""
    names = ("radiation_cases", "radiation_bempp", "radiation_ngsolve", "radiation_fields")
    return hashed([HERE / f"{name}.py" for name in names])


def panel_means(surface: Surface, velocity: Callable[[Real], Real]) -> Real:
    """Return a velocity's mean over each panel, by 5 x 5 points: (panels,)."""
    u, v = (0.5 + 0.5 * part.ravel() for part in np.meshgrid(_NODES, _NODES))
    weights = 0.25 * np.outer(_WEIGHTS, _WEIGHTS).ravel()
    shape = np.stack(((1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v))
    points = np.einsum("cq,pci->pqi", shape, surface.corners_m)
    return np.asarray(velocity(points.reshape(-1, 3)).reshape(len(points), -1) @ weights)


def plate_means(surface: Surface, patterns: tuple[tuple[int, int], ...]) -> Real:
    """Return plate patterns on the panel y+ of the box: (panels, patterns)."""
    moving = surface.normals[:, 1] > 0.5
    means = [panel_means(surface, lambda x, two=two: plate(x[:, 0], x[:, 2], two)) for two in patterns]
    return np.asarray(np.stack(means, axis=1) * moving[:, None])


def problem(case: Case, density: float, precision: Literal["single", "double"] = "single") -> ExteriorProblem:
    """Return our problem with so many panels a wavelength."""
    side = 2.0 * math.pi / case.wave_number_rad_m / density
    if case.body == "box":
        surface = box_surface(BOX_M, side)
    else:
        quarter = 2
        while sphere_surface(RADIUS_M, quarter).longest_side_m > side:
            quarter += 2
        surface = sphere_surface(RADIUS_M, quarter)
    return ExteriorProblem(surface, case.wave_number_rad_m, IMPEDANCE_PA_S_M, precision=precision)


def pressures(case: Case, density: float) -> tuple[Complex, int]:
    """Return our pressures of a case at the receivers, and the number of panels."""
    ours, points = problem(case, density), receivers()
    if case.what == "scattering":
        arm = np.linalg.norm(points - SOURCE_M, axis=1)
        direct = np.exp(-1j * case.wave_number_rad_m * arm) / arm
        return ours.scattered([SOURCE_M], points)[:, 0] - direct, ours.surface.n_panels
    if case.body == "sphere":
        velocity = panel_means(ours.surface, ball)[:, None]
    else:
        velocity = plate_means(ours.surface, ((3, 2),))
    return ours.transfer(points, velocity)[:, 0], ours.surface.n_panels


def l2_percent(found: Complex, reference: Complex) -> float:
    """Return the relative difference in the mean square, in %."""
    return 100.0 * float(np.linalg.norm(found - reference) / np.linalg.norm(reference))


def compared(found: Complex, reference: Complex) -> dict[str, float]:
    """Return how much our pressures at the receivers differ from those of another code."""
    square, other = np.abs(found) ** 2, np.abs(reference) ** 2
    level = 10.0 * np.log10(square / other)
    far, near = slice(None, FAR), slice(FAR, None)
    loud = other[far] > 10.0 ** (-0.1 * QUIET_DB) * other[far].mean()
    figures = {
        "l2_at_4_m_percent": l2_percent(found[far], reference[far]),
        "l2_at_1_m_percent": l2_percent(found[near], reference[near]),
        "mean_level_at_4_m_db": 10.0 * math.log10(square[far].mean() / other[far].mean()),
        "worst_level_at_4_m_db": float(np.abs(level[far]).max()),
        "worst_loud_level_at_4_m_db": float(np.abs(level[far][loud]).max()),
    }
    return {name: round(value, 4) for name, value in figures.items()}


def as_numbers(field: Complex) -> list[list[float]]:
    """Return complex numbers for a record."""
    return [[float(f"{value.real:.6g}"), float(f"{value.imag:.6g}")] for value in field]


def as_field(numbers: list[list[float]]) -> Complex:
    """Return what `as_numbers` was given."""
    return np.asarray(numbers) @ [1.0, 1j]


def others(case: Case, fields: dict[str, Any]) -> dict[str, Complex]:
    """Return the reference pressures of a case: of other codes, and of the sphere's series."""
    found = {code: as_field(result["pressures_pa"]) for code, result in fields.get(case.name, {}).items()}
    if case.body == "sphere":
        found["series"] = ball_pressures(receivers(), case.wave_number_rad_m)
    return found


def comparison(case: Case, density: float, fields: dict[str, Any]) -> list[dict[str, Any]]:
    """Return our differences from each reference of a case."""
    found, panels = pressures(case, density)
    row = {"case": case.name, "panels_per_wavelength": density, "panels": panels}
    return [{**row, "reference": name, **compared(found, other)} for name, other in others(case, fields).items()]


def densities(case: Case) -> tuple[float, ...]:
    """Return the panels a wavelength of a case, with the program's own where it makes more than 15 of them."""
    least = 2.0 * math.pi / case.wave_number_rad_m / COARSEST_M
    return (*DENSITIES, round(least, 2)) if case.body == "box" and least > DENSITIES[-1] else DENSITIES


def comparisons(fields: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Return all of them."""
    for case in CASES:
        for density in densities(case):
            yield from comparison(case, density, fields)


def between_others(fields: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Return how the references differ from each other, the first of them from each other one."""
    for case in CASES:
        (first, field), *rest = others(case, fields).items()
        for name, other in rest:
            yield {"case": case.name, "code": first, "reference": name, **compared(field, other)}


def levels_at_4_m_db(frequency_hz: float, density: float) -> tuple[Real, int]:
    """Return the mean level at 4 m of each pattern, re 20 uPa at 1 m/s rms, and the number of panels."""
    wave_number = 2.0 * math.pi * frequency_hz / SPEED_M_S
    surface = box_surface(BOX_M, 2.0 * math.pi / wave_number / density)
    ours = ExteriorProblem(surface, wave_number, IMPEDANCE_PA_S_M, least_panels_per_wavelength=4.9)
    rule = SphereRule(4.0, 2 * math.ceil(wave_number * REACH_M) + 2)
    found = ours.transfer(rule.points_m, plate_means(surface, PATTERNS))
    return 10.0 * np.log10(rule.mean_square(found) / 4e-10), surface.n_panels


def convergence(frequency_hz: float) -> list[dict[str, Any]]:
    """Return the levels over the density, against the finest grid."""
    finest, panels = levels_at_4_m_db(frequency_hz, FINEST)
    rows = []
    for density in SWEEP:
        levels, count = levels_at_4_m_db(frequency_hz, density)
        off = {f"{m} x {n}": round(float(value), 4) for (m, n), value in zip(PATTERNS, levels - finest, strict=True)}
        row = {"frequency_hz": frequency_hz, "panels_per_wavelength": density, "panels": count}
        rows.append({**row, "finest_panels": panels, "worst_db": max(map(abs, off.values())), "off_db": off})
    return rows


def energy(frequency_hz: float, density: float) -> list[dict[str, Any]]:
    """Return sound powers of the box, in double precision: through 4 m, 12 m and out of its surface."""
    case = next(case for case in CASES if case.name == f"panel of the box, 3 x 2 half waves, {frequency_hz:g} Hz")
    ours = problem(case, density, "double")
    surface = ours.surface
    motions = {
        "all sides alike": np.ones(surface.n_panels),
        "one side as a piston": (surface.normals[:, 1] > 0.5).astype(float),
        "one side, 1 x 1 half waves": plate_means(surface, ((1, 1),))[:, 0],
        "one side, 3 x 2 half waves": plate_means(surface, ((3, 2),))[:, 0],
    }
    velocity = np.stack(list(motions.values()), axis=1)
    degree = 2 * math.ceil(case.wave_number_rad_m * REACH_M) + 6
    through = []
    for radius in (4.0, 12.0):
        rule = SphereRule(radius, degree)
        through.append(rule.sound_power_w(ours.transfer(rule.points_m, velocity), IMPEDANCE_PA_S_M))
    areas = surface.areas_m2[:, None]
    out = (np.real(ours.pressures(velocity) * velocity.conj()) * areas).sum(axis=0)
    efficiency = through[1] / (IMPEDANCE_PA_S_M * (np.abs(velocity) ** 2 * areas).sum(axis=0))
    rows = []
    for index, name in enumerate(motions):
        near, far, given = through[0][index], through[1][index], out[index]
        row = {
            "frequency_hz": frequency_hz,
            "panels": surface.n_panels,
            "motion": name,
            "efficiency": round(float(efficiency[index]), 4),
        }
        row["through_4_m_over_12_m_db"] = round(10.0 * math.log10(near / far), 4)
        row["out_of_surface_over_12_m_db"] = round(10.0 * math.log10(given / far), 4)
        rows.append(row)
    return rows


def ours(fields: dict[str, Any]) -> dict[str, Any]:
    """Return all rows of our side."""
    return {
        "comparisons": list(comparisons(fields)),
        "between_others": list(between_others(fields)),
        "convergence": [row for frequency in SWEEP_HZ for row in convergence(frequency)],
        "energy": [row for at in ENERGIES for row in energy(*at)],
    }


def record() -> dict[str, Any]:
    """Return what was recorded."""
    return dict(json.loads(RECORD.read_text(encoding="utf-8")))

"""The cases computed by bempp-cl and ngsolve.bem, on a grid and on a coarser one, whose difference is their own error.

Imports both; ten minutes on two cores.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import radiation_bempp
import radiation_ngsolve
from numpy.typing import NDArray
from radiation_cases import CASES, HALF_WAVES, SOURCE_M, Case, ball, plate, receivers

Complex = NDArray[np.complex128]

BEMPP_SPHERES = {2.0: (3, 4), 6.0: (3, 4)}
"""Levels of the sphere's grid over ka."""

BEMPP_BOXES = {200.0: (0.09, 0.06), 525.0: (0.065, 0.045), 1000.0: (0.045, 0.033), 1500.0: (0.036, 0.028)}
"""Size of the box's triangles in m, over the frequency."""

NGSOLVE_BOXES = {525.0: ((0.2, 3), (0.14, 3)), 1000.0: ((0.2, 4), (0.14, 4))}
"""Size in m and order of polynomials."""


def _of(cases: list[Case], vibrating: Callable[[], Complex], scattered: Callable[[], Complex]) -> dict[str, Complex]:
    return {case.name: vibrating() if case.what == "vibrating" else scattered() for case in cases}


def _bempp(cases: list[Case], grid: Any) -> tuple[Any, dict[str, Complex]]:
    body = radiation_bempp.Body(grid, cases[0].wave_number_rad_m)
    velocity = ball if cases[0].body == "sphere" else lambda x: plate(x[:, 0], x[:, 2])
    points = receivers()
    return body, _of(cases, lambda: body.vibrating(velocity, points), lambda: body.scattered(SOURCE_M, points))


def _ngsolve(cases: list[Case], grid: Any, order: int) -> tuple[Any, dict[str, Complex]]:
    body = radiation_ngsolve.Body(grid, order, cases[0].wave_number_rad_m)
    points = receivers()
    return body, _of(cases, lambda: body.vibrating(HALF_WAVES, points), lambda: body.scattered(SOURCE_M, points))


def _runs() -> Iterator[tuple[str, list[Case], list[Callable[[], tuple[Any, dict[str, Complex]]]]]]:
    """Return the code, the cases of one body and frequency, and its computations from coarse to fine."""
    for ka, levels in BEMPP_SPHERES.items():
        cases = [case for case in CASES if case.name == f"sphere, ka = {ka:g}"]
        grids = [lambda level=level: radiation_bempp.sphere_grid(level) for level in levels]
        yield radiation_bempp.NAME, cases, [lambda g=g, c=cases: _bempp(c, g()) for g in grids]
    for frequency, sizes in BEMPP_BOXES.items():
        cases = [case for case in CASES if case.name.endswith(f", {frequency:g} Hz")]
        yield (
            radiation_bempp.NAME,
            cases,
            [lambda s=size, c=cases: _bempp(c, radiation_bempp.box_grid(s)) for size in sizes],
        )
    for frequency, grids in NGSOLVE_BOXES.items():
        cases = [case for case in CASES if case.name.endswith(f", {frequency:g} Hz")]
        yield (
            radiation_ngsolve.NAME,
            cases,
            [lambda s=size, o=order, c=cases: _ngsolve(c, radiation_ngsolve.box_grid(s), o) for size, order in grids],
        )


def computed() -> dict[str, dict[str, Any]]:
    """Return each case's result of each code."""
    from radiation_study import as_numbers, compared

    found: dict[str, dict[str, Any]] = {}
    for code, cases, runs in _runs():
        start = time.perf_counter()
        (coarse_body, coarse), (body, fine) = (run() for run in runs)
        for case in cases:
            found.setdefault(case.name, {})[code] = {
                "triangles": body.elements,
                "unknowns": body.unknowns,
                "coarser_triangles": coarse_body.elements,
                "coarser_unknowns": coarse_body.unknowns,
                "coarser_against_this": compared(coarse[case.name], fine[case.name]),
                "pressures_pa": as_numbers(fine[case.name]),
            }
        print(f"{code}, {cases[0].name}: {body.unknowns} unknowns, {time.perf_counter() - start:.0f} s", flush=True)
    return found

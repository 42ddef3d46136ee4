"""Time and error of our boundary elements beside bempp-cl and ngsolve.bem, as ratios measured in one run.

``python tests/benchmarks/bench_radiation.py [repeats]`` in an environment with bempp-cl and ngsolve (one core:
``taskset -c 0``; some six minutes, two of them bempp-cl's compilation, which is not counted). The case is the panel of
the reference box with 3 x 2 half waves: assembling, factoring, solving for one velocity, 58 receivers. Errors are of
the mean square at 50 receivers at 4 m, against the finest field of bempp-cl in `radiation_record.json`; its own error,
by the record, is the least that can be told. Each grid of another code stands beside our coarsest grid that is no
worse. Ours is given the mirror planes of the box, as the program does, and not; the others know none. They are Python
libraries for general problems with dense matrices of linear (bempp-cl) or higher (ngsolve.bem) elements in Galerkin's
way; their fast methods, which pay for many more elements, are left out.
"""

# ruff: noqa: E402 - threads are limited before numpy is imported

from __future__ import annotations

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import math
import platform
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "evidence"))

import radiation_study as study
from figures import note, processor
from radiation_cases import BOX_M, FAR, HALF_WAVES, IMPEDANCE_PA_S_M, PANELS, Case, plate, receivers

from tdacoustic.radiation.boundary_elements import ExteriorProblem
from tdacoustic.radiation.grids import box_surface

CASES = PANELS[1:3]
DENSITIES = (6.0, 7.5, 9.0, 11.0, 13.0, 15.0, 18.0, 22.0, 27.0, 33.0)
"""Of our grids, in panels a wavelength."""

BEMPP_SIZES = {PANELS[1].name: (0.16, 0.12, 0.09), PANELS[2].name: (0.09, 0.06)}
NGSOLVE_GRIDS = {PANELS[1].name: ((0.3, 3), (0.2, 3)), PANELS[2].name: ((0.2, 3), (0.2, 4))}
"""Size of the triangles in m, order of the polynomials."""


@dataclass(frozen=True)
class Timed:
    """One computation of a case."""

    what: str
    unknowns: int
    seconds: float
    error_percent: float

    def row(self, other: str = "") -> str:
        return f"| {self.what} | {self.unknowns} | {self.seconds:.3g} | {self.error_percent:.2f} | {other} |"


def timed(function: Callable[[], Any], repeats: int) -> tuple[float, Any]:
    """Return the median seconds of a call, and what it returned last."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        found = function()
        times.append(time.perf_counter() - start)
    return statistics.median(times), found


# ---------------------------------------------------------------- beside other boundary elements


def ours(case: Case, density: float, planes: tuple[Any, ...]) -> tuple[np.ndarray, int]:
    """Return our pressures and the number of panels; the grid is part of it."""
    surface = box_surface(BOX_M, 2.0 * math.pi / case.wave_number_rad_m / density, planes)
    problem = ExteriorProblem(surface, case.wave_number_rad_m, IMPEDANCE_PA_S_M)
    return problem.transfer(receivers(), study.plate_means(surface, (HALF_WAVES,)))[:, 0], surface.n_panels


def by_bempp(case: Case, size_m: float) -> tuple[np.ndarray, int]:
    """Return the pressures of bempp-cl and its unknowns."""
    import radiation_bempp

    body = radiation_bempp.Body(radiation_bempp.box_grid(size_m), case.wave_number_rad_m)
    return body.vibrating(lambda x: plate(x[:, 0], x[:, 2]), receivers()), body.unknowns


def by_ngsolve(case: Case, size_m: float, order: int) -> tuple[np.ndarray, int]:
    """Return the pressures of ngsolve.bem and its unknowns."""
    import radiation_ngsolve

    body = radiation_ngsolve.Body(radiation_ngsolve.box_grid(size_m), order, case.wave_number_rad_m)
    return body.vibrating(HALF_WAVES, receivers()), body.unknowns


def measured(what: str, truth: np.ndarray, function: Callable[[], tuple[np.ndarray, int]], repeats: int) -> Timed:
    """Return time and error of a computation."""
    seconds, (found, unknowns) = timed(function, repeats)
    return Timed(what, unknowns, seconds, study.l2_percent(found[:FAR], truth[:FAR]))


def other_codes(case: Case, truth: np.ndarray) -> Iterator[Timed]:
    """Return each grid of the other codes, once."""
    for size in BEMPP_SIZES[case.name]:
        yield measured(f"bempp-cl, {size:g} m", truth, partial(by_bempp, case, size), 1)
    for size, order in NGSOLVE_GRIDS[case.name]:
        what = f"ngsolve.bem, {size:g} m, order {order}"
        yield measured(what, truth, partial(by_ngsolve, case, size, order), 1)


def against_other_codes(repeats: int) -> None:
    """Print each grid of another code, our coarsest that is no worse, and how many times quicker it is."""
    by_bempp(CASES[0], 0.3)  # compiles
    by_ngsolve(CASES[0], 0.5, 1)
    fields = study.record()["fields"]["cases"]
    for case in CASES:
        recorded = fields[case.name]["bempp-cl"]
        truth, own = study.as_field(recorded["pressures_pa"]), recorded["coarser_against_this"]["l2_at_4_m_percent"]
        print(f"\n{case.name}; the reference differs from a coarser one by {own:.2f} %\n")
        print("| way | unknowns | s | error, % | times ours |")
        print("|---|---|---|---|---|")
        grids = {planes: our_grids(case, truth, planes, repeats) for planes in (("x", "y", "z"), ())}
        for other in other_codes(case, truth):
            print(other.row())
            for planes, found in grids.items():
                equal = next((grid for grid in found if grid.error_percent <= other.error_percent), None)
                if equal is None:
                    print(f"| ours, {'with' if planes else 'no'} mirror planes: no grid here is as good | | | | |")
                else:
                    print(equal.row(f"{other.seconds / equal.seconds:.0f}"), flush=True)
                    what = f"boundary elements, {case.name}, {'with' if planes else 'no'} mirror planes"
                    note(what, equal.seconds, "s", f"{other.what}, error {other.error_percent:.1f} %", other.seconds)


def our_grids(case: Case, truth: np.ndarray, planes: tuple[Any, ...], repeats: int) -> list[Timed]:
    """Return our grids from coarse to fine; without mirror planes as far as they take a second or so."""
    name = f"ours, {'with' if planes else 'no'} mirror planes"
    ours(case, DENSITIES[0], planes)
    return [
        measured(f"{name}, {density:g} a wavelength", truth, partial(ours, case, density, planes), repeats)
        for density in DENSITIES
        if planes or density <= 15.0
    ]


PARTS: tuple[Callable[[int], None], ...] = (against_other_codes,)


def main(repeats: int = 3) -> None:
    """Print the tables."""
    libraries = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "numba", "bempp-cl", "ngsolve"))
    threads = os.environ["NUMBA_NUM_THREADS"]
    print(f"Ours: medians of {repeats} calls; other codes once; {threads} thread(s) of {os.cpu_count()} cores")
    print(f"load {os.getloadavg()[0]:.1f} at the start")
    print(f"Python {platform.python_version()}, {libraries}; {platform.machine()} {processor()}")
    for part in PARTS:
        part(repeats)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))

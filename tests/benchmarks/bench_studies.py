"""Points a second of a design study: in batches of the store, one by one, and in two processes; ratios of one run.

``python tests/benchmarks/bench_studies.py [points] [rounds]`` (five minutes). The drive of
``calibration/crrc-freight`` with point sources and six conditions. One by one is what a script does: the fleet with a
point's values, a `DriveModel` of it, its levels on the surface. In batches is the study as `tdacoustic predict` runs
it, each round in a fresh store, so that keys, files and records are paid for; then once more, all found. The ways take
turns in each round, and a ratio is taken within its round.

Designs: a Latin hypercube over four parameters of the gears, in which no two points have the same motion; Saltelli's
over two of the gears and two of the sound, in which many do; a grid over one of each.

The parts of a point are timed too: what could be gained at most by solving many points' balances as one stacked array.
"""

# ruff: noqa: E402 - threads are limited before numpy is imported

from __future__ import annotations

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import platform
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[1]), str(Path(__file__).resolve().parent)]

from figures import note
from plain_fleets import plain_fleet

from tdacoustic.drive import Condition, DriveModel, conditions_of, gear_unit_of
from tdacoustic.fleet import Fleet, load_fleet
from tdacoustic.fleet.design_sweep import DesignSweep, Range
from tdacoustic.gears import balanced_state
from tdacoustic.steps import Store
from tdacoustic.studies.design_sweeps import fleet_at
from tdacoustic.studies.designs import Assignments, points_of
from tdacoustic.workflows.studies import _swept

GEARS = {
    "gear_dynamics.mesh_damping_ratio": Range(0.02, 0.2, "log"),
    "gear_pair.1.transmission_error_um.1": Range(1.0, 10.0),
    "gear_pair.1.face_width_mm": Range(100.0, 140.0),
    "gear_dynamics.bearing_damping_ratio": Range(0.01, 0.1, "log"),
}
SOUND = {"masuda.constant_db": Range(18.0, 26.0), "model.motor_gain_db": Range(-3.0, 3.0)}


def designs(points: int) -> dict[str, DesignSweep]:
    """Return the designs, about as many points each."""
    some = dict(list(GEARS.items())[:2])
    base = 1 << max(4, round(np.log2(points / 6)))
    side = round(points**0.5)
    grid = {
        "gear_dynamics.mesh_damping_ratio": tuple(np.geomspace(0.02, 0.2, side).tolist()),
        "masuda.constant_db": tuple(np.linspace(18.0, 26.0, side).tolist()),
    }
    return {
        "hypercube": DesignSweep(
            name="hypercube", sampling="latin_hypercube", points=points, parameters=tuple(GEARS.items())
        ),
        "Saltelli": DesignSweep(
            name="Saltelli", sampling="saltelli", base_points=base, parameters=tuple({**some, **SOUND}.items())
        ),
        "grid": DesignSweep(name="grid", parameters=tuple(grid.items())),
    }


def one_by_one(fleet: Fleet, conditions: tuple[Condition, ...], points: tuple[Assignments, ...]) -> np.ndarray:
    """Return the level of each point in each condition, asked for as a script would."""
    found = []
    for point in points:
        model = DriveModel(fleet_at(fleet, point))
        sounds = (model.sound_of(model.gears(condition)) for condition in conditions)
        found.append([sound.level_db(model.field.surface.name) for sound in sounds])
    return np.array(found, dtype=float)


def in_batches(
    fleet: Fleet, conditions: tuple[Condition, ...], sweep: DesignSweep, store: Store, jobs: int
) -> np.ndarray:
    """Return the same of a study."""
    found, _ = _swept(sweep, fleet, None, conditions, store, None, jobs)
    return found.of("spl_4m_db")


def timed(work: Callable[[], np.ndarray]) -> tuple[float, np.ndarray]:
    start = time.perf_counter()
    found = work()
    return time.perf_counter() - start, found


def compare(name: str, fleet: Fleet, sweep: DesignSweep, rounds: int) -> None:
    """Print a design's rows."""
    conditions, points = conditions_of(fleet), points_of(sweep)
    ways: dict[str, list[float]] = {"one by one": [], "batches": [], "found again": [], "batches, 2 processes": []}
    for _ in range(rounds):
        with tempfile.TemporaryDirectory() as folder:
            one, two = Store(Path(folder) / "one"), Store(Path(folder) / "two")
            work: dict[str, Callable[[], np.ndarray]] = {
                "one by one": lambda: one_by_one(fleet, conditions, points),
                "batches": lambda one=one: in_batches(fleet, conditions, sweep, one, 1),
                "found again": lambda one=one: in_batches(fleet, conditions, sweep, one, 1),
                "batches, 2 processes": lambda two=two: in_batches(fleet, conditions, sweep, two, 2),
            }
            levels = {}
            for way, do in work.items():
                taken, levels[way] = timed(do)
                ways[way].append(taken)
        same = levels["batches"]
        assert np.array_equal(same, levels["found again"]) and np.array_equal(same, levels["batches, 2 processes"])
        assert np.allclose(same, levels["one by one"], rtol=0.0, atol=1e-9)
    for way, times in ways.items():
        ratios = [base / taken for base, taken in zip(ways["one by one"], times, strict=True)]
        rate = len(points) / statistics.median(times)
        spread = f"{statistics.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f})"
        print(f"| {name}, {len(points)} points | {way} | {rate:.0f} | {spread} |", flush=True)
        if way.startswith("batches"):
            theirs = len(points) / statistics.median(ways["one by one"])
            note(f"design study, {name}: {way}", rate, "points/s", "one by one", theirs, ratios)


def parts(fleet: Fleet, count: int = 60) -> None:
    """Print where a point's time goes, and what stacking the linear systems would save."""
    conditions = conditions_of(fleet)
    sweep = designs(count)["hypercube"]
    points = points_of(sweep)
    fleets = [fleet_at(fleet, point) for point in points]
    units = [gear_unit_of(one) for one in fleets]
    asked = [
        (unit.system, unit.mesh_hz(held.motor_hz), unit.pinion_torque_n_m(held.torque_n_m))
        for unit in units
        for held in conditions
    ]
    balance = import_module("tdacoustic.gears.harmonic_balance")
    steady = import_module("tdacoustic.gears.steady_state")
    forces = [system.mean_force_n(torque) for system, _, torque in asked]
    whole = list(zip(asked, forces, strict=True))
    solutions = [balance.periodic_solution(system, mesh, force) for (system, mesh, _), force in whole]
    sizes = [2 * solution.n_harmonics + 1 for solution in solutions]
    rng = np.random.default_rng(1)
    alike = rng.normal(size=(sizes.count(max(sizes, key=sizes.count)), *(2 * (max(sizes, key=sizes.count),))))
    rows: dict[str, Callable[[], object]] = {
        "the fleet with its gears": lambda: [fleet_at(fleet, point) for point in points],
        "motions": lambda: [balanced_state(*one) for one in asked],
        "of these, the balance": lambda: [balance.periodic_solution(s, m, f) for (s, m, _), f in whole],
        "of these, stability": lambda: [steady._judged(s, one) for (s, *_), one in zip(asked, solutions, strict=True)],
        "all": lambda: one_by_one(fleet, conditions, points),
    }
    print("\n| part of a point | ms |")
    print("|---|---|")
    for name, do in rows.items():
        taken = min(timed(do)[0] for _ in range(3))  # type: ignore[arg-type]
        print(f"| {name} | {1e3 * taken / count:.2f} |")
    each = min(timed(lambda: [np.linalg.solve(one, one[0]) for one in alike])[0] for _ in range(5))  # type: ignore
    stacked = min(timed(lambda: np.linalg.solve(alike, alike[:, 0, :, None]))[0] for _ in range(5))
    print(
        f"\n{len(alike)} linear systems of {alike.shape[-1]} unknowns: one by one {1e3 * each:.2f} ms, stacked ", end=""
    )
    print(f"{1e3 * stacked:.2f} ms, {each / stacked:.2f} times quicker; all of a point's are ", end="")
    print(f"{1e3 * each / len(alike) * len(conditions):.2f} ms of it")


def main(points: int = 600, rounds: int = 3) -> None:
    """Print the tables."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, range(os.cpu_count() or 1))  # whoever started this may have left it one core
    fleet = load_fleet(plain_fleet("crrc-freight"))
    libraries = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "numba"))
    print(f"{len(conditions_of(fleet))} conditions; median of {rounds} rounds; {os.cpu_count()} cores")
    print(f"Python {platform.python_version()}, {libraries}; {platform.machine()}\n")
    one_by_one(fleet, conditions_of(fleet), points_of(designs(20)["hypercube"]))  # imports and compiled kernels
    print("| design | way | points a second | times as quick as one by one (over the rounds) |")
    print("|---|---|---|---|")
    for name, sweep in designs(points).items():
        compare(name, fleet, sweep, rounds)
    parts(fleet)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))

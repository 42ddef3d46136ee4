"""Time and error of a gear pair's steady state beside scipy's integrators, as ratios measured in one run.

``python tests/benchmarks/bench_gears.py [repeats]`` (one core: ``taskset -c 0``; five minutes). Errors are the largest
difference of δ over one mesh period to a converged integration (16 times finer steps, until every transient is below
1e-9), over the peak to peak. scipy integrates the eight printed equations, written in numpy as a user would, from rest
at the static deflection, over the fewest mesh periods that reach the error of the balance, at the tolerance for which
that takes the least time: a choice that only who knows the answer can make.

Budget: 1 ms in contact, 2 ms with Floquet multipliers, 30 ms with separation, 1000 times faster than RK45.
"""

# ruff: noqa: E402 - threads are limited before numpy is imported

from __future__ import annotations

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import math
import platform
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "gears"))

from figures import note, processor
from reference_drive import RATED_TORQUE_N_M, reference_system

from tdacoustic.gears import GearSystem, SteadyState, steady_state
from tdacoustic.gears.harmonic_balance import HarmonicSolution, balance, periodic_solution
from tdacoustic.gears.integration import TimeSolution, integrate, settle

CASES = {
    "condition 3, 349.94 Hz, 5913 N m": (349.94, RATED_TORQUE_N_M),
    "condition 5, 524.9 Hz, 5913 N m": (524.9, RATED_TORQUE_N_M),
    "condition 6, 1001.3 Hz, 5913 N m": (1001.3, RATED_TORQUE_N_M),
    "separating, 524.9 Hz, 200 N m": (524.9, 200.0),
    "separating, 1200 Hz, 500 N m": (1200.0, 500.0),
}
HARMONICS = (8, 16, 32, 64, 128, 256)
TOLERANCES = (1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7, 1e-7, 1e-8)
SPEEDS_HZ, TORQUES_N_M = np.arange(400.0, 1501.0, 50.0), (-2000.0, -1000.0, -500.0, -200.0, 150.0, 300.0, 700.0, 1500.0)


class Plain:
    """The printed equations as a user would write them: numpy, all eight coordinates."""

    def __init__(self, system: GearSystem, mesh_hz: float, torque: float) -> None:
        self.s, self.f = system, mesh_hz
        self.M, self.C, self.K = system.mass_matrix, system.damping_matrix, system.stiffness_matrix
        self.V, (r1, r2) = system.direction_vector, system.base_radii_m
        self.T = np.array([0.0, 0.0, 0.0, torque, 0.0, 0.0, 0.0, torque * r2 / r1])
        self.alpha, self.beta = system.contact_lines.transverse_contact_ratio, system.contact_lines.overlap_ratio
        self.cm = system.mesh_damping_n_s_per_m

    def stiffness(self, turns: float) -> float:
        t = turns % 1.0 + np.arange(math.ceil(self.alpha + self.beta))
        lines = np.clip(np.minimum(t, self.alpha + self.beta - t) / min(self.alpha, self.beta), 0.0, 1.0)
        return float(self.s.mesh_stiffness_n_per_m * lines.sum() / max(self.alpha, self.beta))

    def rates(self, t: float, y: np.ndarray) -> np.ndarray:
        x, v, b = y[:8], y[8:], self.s.half_backlash_m
        gap = self.V @ x - self.s.transmission_error_m[0] * math.sin(2.0 * math.pi * self.f * t)
        tau = gap - b if gap > b else gap + b if gap < -b else 0.0
        force = self.cm * (self.V @ v) + self.stiffness(self.f * t) * tau
        return np.concatenate([v, (self.T - self.C * v - self.K * x - self.V * force) / self.M])

    def rest(self) -> np.ndarray:
        """Static deflection with the mesh at its mean stiffness; the rotation is divided evenly."""
        s, torque, (r1, r2) = self.s, self.T[3], self.s.base_radii_m
        force = torque / (r1 * math.cos(s.base_helix_angle_rad))
        y = np.zeros(16)
        held = self.K > 0.0
        y[:8][held] = -self.V[held] * force / self.K[held]
        delta = force / s.mesh_stiffness_n_per_m + math.copysign(s.half_backlash_m, force)
        rotation = (delta - self.V @ y[:8]) / math.cos(s.base_helix_angle_rad)
        y[3], y[7] = 0.5 * rotation / r1, 0.5 * rotation / r2
        return y

    def solve(self, method: str, tolerance: float, periods: int, samples: int, kept: int = 1) -> np.ndarray:
        """Return δ at `samples` times of each of the last `kept` periods, shape (kept, samples)."""
        times = np.arange((periods - kept) * samples, periods * samples + 1) / (samples * self.f)
        size = np.abs(self.rest()[:8]).max()
        scale = np.concatenate([np.full(8, size), np.full(8, 2.0 * np.pi * self.f * size)])
        absolute = 0.1 * tolerance * scale
        found = solve_ivp(self.rates, (0.0, times[-1]), self.rest(), method, times, rtol=tolerance, atol=absolute)
        return (self.V @ found.y[:8])[:-1].reshape(kept, samples)


def timed(function: Callable[[], object], repeats: int) -> float:
    """Median seconds of a call."""
    function()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


@dataclass(frozen=True)
class Case:
    """A condition with its steady state and the truth, one period of the motion."""

    name: str
    system: GearSystem
    mesh_hz: float
    torque: float
    force: float
    state: SteadyState
    truth: np.ndarray

    @classmethod
    def of(cls, name: str, mesh_hz: float, torque: float) -> Case:
        system = reference_system()
        state = steady_state(system, mesh_hz, torque)
        steps, held = integrate(system, mesh_hz, torque, 1).displacement_m.size, state.state
        for _ in range(math.ceil(math.log(1e-9) / math.log(state.floquet_max))):
            fine = integrate(system, mesh_hz, torque, 1, held, 16 * steps)
            held = fine.state
        truth = fine.displacement_m[0, ::16]
        return cls(name, system, mesh_hz, torque, system.mean_force_n(torque), state, truth)

    def periodic(self) -> HarmonicSolution:
        solution = periodic_solution(self.system, self.mesh_hz, self.force, self.start)
        assert solution is not None
        return solution

    def balance(self, harmonics: int) -> HarmonicSolution | None:
        return balance(self.system, self.mesh_hz, self.force, harmonics, self.start)

    @property
    def start(self) -> np.ndarray | None:
        """Where teeth separate: the solution itself, so that single solutions can be timed; else none is needed."""
        return np.fft.rfft(self.state.waveform_m[0], norm="forward") if self.state.separates else None

    def steady_state(self) -> SteadyState:
        return steady_state(self.system, self.mesh_hz, self.torque)

    def settle(self) -> TimeSolution:
        return settle(self.system, self.mesh_hz, self.torque)

    def errors_of(self, deltas: np.ndarray) -> np.ndarray:
        return np.abs(deltas - self.truth).max(axis=-1) / np.ptp(self.truth)

    def error_of(self, solution: HarmonicSolution) -> float:
        finer = math.ceil(2 * solution.displacement_m.size / self.truth.size)
        return float(self.errors_of(solution.displacement_at(finer * self.truth.size)[::finer]))


def cheapest(case: Case, method: str, target: float) -> tuple[float, float, int, float] | None:
    """Return (seconds, error, periods, tolerance) of the quickest way below an error; the three loosest that can."""
    plain, found = Plain(case.system, case.mesh_hz, case.torque), []
    most, samples = 2 * math.ceil(math.log(1e-5) / math.log(case.state.floquet_max)), case.truth.size
    for tolerance in TOLERANCES:
        errors = case.errors_of(plain.solve(method, tolerance, most, samples, most))
        reached = np.flatnonzero(errors <= target)
        if reached.size:
            periods = int(reached[0]) + 1
            seconds = timed(partial(plain.solve, method, tolerance, periods, samples), 3)
            found.append((seconds, float(errors[reached[0]]), periods, tolerance))
        if len(found) == 3:
            break
    return min(found) if found else None


def against_scipy(cases: list[Case], repeats: int) -> None:
    print("| case | way | ms | error | periods | rtol | over the balance | over the steady state |")
    print("|---|---|---|---|---|---|---|---|")
    for case in cases:
        solution, whole = case.periodic(), timed(case.steady_state, 10 * repeats)
        error, name, bare = case.error_of(solution), f"{case.name}, N = {solution.n_harmonics}", None
        if not case.state.separates:
            bare = timed(case.periodic, 10 * repeats)
            print(f"| {name} | balance | {1e3 * bare:.2f} | {error:.1e} | | | 1 | |")
            name = ""
        print(f"| {name} | steady state: with multipliers | {1e3 * whole:.2f} | {error:.1e} | | | | 1 |")
        settled, taken = case.settle(), timed(case.settle, repeats)
        off = float(case.errors_of(settled.displacement_m[0]))
        row = f"{1e3 * taken:.1f} | {off:.1e} | {settled.periods} | | {ratios(taken, bare, whole)}"
        print(f"| | our integration, compiled | {row} |")
        if bare is not None:
            note(f"gears, {case.name}: steady state in contact", 1e3 * bare, "ms", budget=1.0)
        kind = "with multipliers" if bare is not None else "teeth separate"
        budget = 2.0 if bare is not None else 30.0
        for method in ("RK45", "LSODA"):
            found = cheapest(case, method, error)
            if found is None:
                print(f"| | scipy {method} | does not reach it | | | {TOLERANCES[-1]:g} | | |")
                continue
            taken, off, periods, tolerance = found
            row = f"{1e3 * taken:.0f} | {off:.1e} | {periods} | {tolerance:g} | {ratios(taken, bare, whole)}"
            print(f"| | scipy {method} | {row} |", flush=True)
            name = f"gears, {case.name}: steady state, {kind}"
            against = f"scipy {method}, same error"
            note(name, 1e3 * whole, "ms", against, 1e3 * taken, budget=budget)


def ratios(taken: float, bare: float | None, whole: float) -> str:
    """Return times over that of the balance, where it was timed alone, and over that of the steady state."""
    return f"{'' if bare is None else round(taken / bare)} | {taken / whole:.0f}"


def over_harmonics(cases: list[Case], repeats: int) -> None:
    print("\n| N | " + " | ".join(f"{case.name}: ms, error, own estimate" for case in cases) + " |")
    print("|---|" + "---|" * len(cases))
    for n in HARMONICS:
        cells = []
        for case in cases:
            found = case.balance(n)
            if found is None:
                cells.append("none found")
                continue
            taken = timed(partial(case.balance, n), 3 * repeats)
            cells.append(f"{1e3 * taken:.2f}, {case.error_of(found):.1e}, {found.tail:.1e}")
        print(f"| {n} | " + " | ".join(cells) + " |")


def with_separation() -> None:
    """All separating conditions of a grid: the time of each, by what the motion turns out to be."""
    system = reference_system()
    kinds: dict[str, list[float]] = {"repeats each mesh period": [], "repeats after several": [], "does not repeat": []}
    for torque in TORQUES_N_M:
        for mesh_hz in SPEEDS_HZ:
            start = time.perf_counter()
            state = steady_state(system, float(mesh_hz), torque)
            taken = time.perf_counter() - start
            if state.separates:
                names = list(kinds)
                kind = names[2] if state.repeats_after is None else names[0 if state.repeats_after == 1 else 1]
                kinds[kind].append(1e3 * taken)
    print("\n| separating motion that | conditions | median, ms | 90 % below | longest |")
    print("|---|---|---|---|---|")
    for kind, times in kinds.items():
        if times:
            p50, p90 = np.percentile(times, (50, 90))
            print(f"| {kind} | {len(times)} | {p50:.1f} | {p90:.1f} | {max(times):.1f} |")


def main(repeats: int = 20) -> None:
    """Print the tables."""
    libraries = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "numba"))
    print(f"Reference drive; medians of {repeats} calls and more; one core of {os.cpu_count()}")
    print(f"Python {platform.python_version()}, {libraries}; {platform.machine()} {processor()}\n")
    cases = [Case.of(name, *condition) for name, condition in CASES.items()]
    against_scipy(cases, repeats)
    over_harmonics(cases, repeats)
    with_separation()


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))

"""Time of a calibration and of a prediction, and how the same fit fares with scipy's RK45 for a model.

``python tests/benchmarks/bench_calibration.py [repeats]`` (one core: ``taskset -c 0``; about four minutes). The drive
is that of the calibration study, and its levels are those of tests/evidence/drive_levels.py with a fixed scatter.

Budget: 0.5 s for a calibration of two parameters on six conditions, 0.1 s for a prediction of six speeds and four
helix angles.

RK45 integrates the eight printed equations in plain Python (quicker here than in numpy) from rest at the static
deflection. In each condition it is given, with hindsight, the tolerance and the fewest mesh periods that bring the
level within 0.01 dB of the converged one, and keep it there; the program's levels are closer. Its fit is a single
`least_squares` from one start; levels of a damping ratio that was integrated already are kept for it, so that the
constant costs nothing. A calibration of the program does more: starts spread over the bounds, intervals at two levels,
each condition left out, the next measurement, doubts.
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
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS / "evidence"), str(TESTS / "gears")]

import drive_levels as plain
from calibration_study import BEARINGS, CONSTANT, DAMPING, GAIN, Truth
from figures import note, processor
from printed_equations import direction, rates

import tdacoustic as td
from tdacoustic.drive import Receiver
from tdacoustic.fitting.calibration import calibrate_fleet
from tdacoustic.fitting.free import free_parameter
from tdacoustic.fitting.levels import LevelModel
from tdacoustic.fitting.measured_level import MeasuredLevel
from tdacoustic.fitting.settings import FitSettings

TRUTH = Truth.draw(8)
SCATTER_DB = 0.5
NUMBERS = (3, 6, 12, 24)
FREE = ((DAMPING,), (CONSTANT, DAMPING), (CONSTANT, DAMPING, GAIN), (CONSTANT, DAMPING, BEARINGS))
TOLERANCES = (3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5)
CLOSE_DB = 0.01
SAMPLES = 200
LONG_S = 5.0


def timed(function: Callable[[], object], repeats: int) -> float:
    """Median seconds of a call; the first one is not counted, but where it takes long there is no other."""
    start = time.perf_counter()
    function()
    times = [time.perf_counter() - start]
    if times[0] > LONG_S:
        return times[0]
    times.clear()
    for _ in range(repeats):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def fleet_of(truth: Truth, free: Sequence[str], speeds: Sequence[float] | None = None) -> td.Fleet:
    """The fleet that the program is given, with other speeds where they are given."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "fleet.toml"
        path.write_text(truth.fleet_text(free), encoding="utf-8")
        fleet = td.load_fleet(path)
    return fleet if speeds is None else fleet.replaced({"operation.train_speed_km_h": tuple(speeds)})


def data_of(fleet: td.Fleet, levels_db: Sequence[float]) -> list[MeasuredLevel]:
    place = Receiver("4 m", 4.0)
    return [
        MeasuredLevel(condition, place, float(level), SCATTER_DB, "Z", "synthetic", "benchmark")
        for condition, level in zip(td.DriveModel(fleet).conditions, levels_db, strict=True)
    ]


def scattered(levels_db: Sequence[float]) -> np.ndarray:
    return np.asarray(levels_db) + SCATTER_DB * np.random.default_rng(5).standard_normal(len(levels_db))


class WithRK45:
    """The levels as a user would compute them, with the least work that reaches an error."""

    def __init__(self, truth: Truth, close_db: Sequence[float]) -> None:
        self.drive = truth.drive()
        self.pair = plain.geometry(self.drive.numbers["gear_pair"][0])
        operation = self.drive.numbers["operation"]
        self.torque = plain.bare(operation["torque_n_m"])
        diameter = 1e-3 * plain.bare(self.drive.numbers["train"]["wheel_diameter_mm"])
        speeds = plain.bare(operation["train_speed_km_h"])
        self.turns_hz = [speed / 3.6 / (math.pi * diameter) * self.pair.ratio for speed in speeds]
        self.teeth = plain.bare(self.drive.numbers["gear_pair"][0]["teeth"])[0]
        self.kept: dict[float, list[float]] = {}
        self.seconds = 0.0
        self.ways = [self.cheapest(hz * self.teeth, close) for hz, close in zip(self.turns_hz, close_db, strict=True)]

    def system(self, damping: float) -> SimpleNamespace:
        return plain.gears(replace(self.drive, mesh_damping_ratio=damping), self.pair)

    def march(self, mesh_hz: float, damping: float, rtol: float, periods: int, kept: int = 1) -> np.ndarray:
        """Peak to peak of δ in each of the last periods."""
        system = self.system(damping)
        times = np.arange((periods - kept) * SAMPLES, periods * SAMPLES + 1) / (SAMPLES * mesh_hz)
        size = np.abs(plain.rest(system, self.torque)[:8]).max()
        scale = np.concatenate([np.full(8, size), np.full(8, 2.0 * math.pi * mesh_hz * size)])
        found = solve_ivp(
            rates(system, mesh_hz, self.torque), (0.0, times[-1]), plain.rest(system, self.torque), "RK45", times,
            rtol=rtol, atol=0.1 * rtol * scale,
        )  # fmt: skip
        delta = direction(system) @ found.y[:8]
        return np.array([np.ptp(delta[n * SAMPLES : (n + 1) * SAMPLES + 1]) for n in range(kept)])

    def cheapest(self, mesh_hz: float, close_db: float) -> tuple[float, int]:
        """Tolerance and periods that take the least time at the true damping and stay within an error from there on."""
        damping = self.drive.mesh_damping_ratio
        exact, most = plain.swing_m(self.system(damping), mesh_hz, self.torque), math.ceil(0.15 * mesh_hz)
        found = []
        for rtol in TOLERANCES:
            errors = np.abs(20.0 * np.log10(self.march(mesh_hz, damping, rtol, most, most) / exact))
            wrong = np.flatnonzero(errors > close_db)
            periods = int(wrong[-1]) + 2 if wrong.size else 1
            if periods <= most:
                start = time.perf_counter()
                self.march(mesh_hz, damping, rtol, periods)
                found.append((time.perf_counter() - start, rtol, periods))
            if len(found) == 3:
                break
        return min(found)[1:]

    def mesh_at_4_m_db(self, damping: float) -> list[float]:
        """Meshing noise in each condition for a constant of 0 dB."""
        if damping not in self.kept:
            start = time.perf_counter()
            levels = []
            for turns_hz, (rtol, periods) in zip(self.turns_hz, self.ways, strict=True):
                swing_um = 1e6 * float(self.march(turns_hz * self.teeth, damping, rtol, periods)[0])
                omega = 2.0 * math.pi * turns_hz
                speed, power_kw = omega * self.pair.pitch_radius_m, omega * self.torque / 1e3
                levels.append(plain.masuda_db(self.pair, speed, power_kw, swing_um, 0.0) - 20.0 * math.log10(4.0))
            self.seconds += time.perf_counter() - start
            self.kept[damping] = levels
        return self.kept[damping]

    def levels_db(self, constant_db: float, damping: float) -> np.ndarray:
        mesh = 10.0 ** ((constant_db + np.array(self.mesh_at_4_m_db(damping))) / 10.0)
        powers = [10.0 ** ((line + self.drive.motor_gain_db) / 10.0) for line in self.drive.motor_lines_db]
        return np.asarray(10.0 * np.log10(mesh + sum(powers) / (4.0 * math.pi * 16.0)))

    def fit(self, levels_db: np.ndarray) -> Any:
        def residuals(place: np.ndarray) -> np.ndarray:
            return (self.levels_db(place[0], math.exp(place[1])) - levels_db) / SCATTER_DB

        bounds = ([-100.0, math.log(0.005)], [100.0, math.log(0.5)])
        # Steps of the differences that are large beside what a loose tolerance leaves.
        return least_squares(residuals, [20.0, math.log(0.05)], bounds=bounds, x_scale=[1.0, 0.1], diff_step=1e-2)


class Counted(LevelModel):
    """Counts how often the gears are computed in all conditions."""

    computed: set[Any]

    def _motion(self, fleet: Any, values: Any) -> Any:
        found = super()._motion(fleet, values)
        self.computed = set(self._computed.motions)
        return found


def against_rk45(repeats: int, levels_db: Sequence[float]) -> None:
    fleet = fleet_of(TRUTH, (CONSTANT, DAMPING))
    measured = scattered(levels_db)
    data = data_of(fleet, measured)
    free = [free_parameter(fleet, key) for key in (CONSTANT, DAMPING)]
    settings = FitSettings(model_sigma_db=0.0)
    whole = timed(lambda: calibrate_fleet(fleet, data, free, settings), repeats)
    known = LevelModel(fleet, data)
    again = timed(lambda: calibrate_fleet(fleet, data, free, settings, model=known.with_data(data)), repeats)
    found = calibrate_fleet(fleet, data, free, settings)

    counted = Counted(fleet, data)
    calibrate_fleet(fleet, data, free, settings, model=counted)
    places = iter(np.exp(np.linspace(math.log(0.01), math.log(0.3), 5000)))
    model = LevelModel(fleet, data)
    forward = timed(lambda: model.levels_db({DAMPING: float(next(places))}), 20 * repeats)
    errors = np.abs(model.levels_db({CONSTANT: TRUTH.constant_db, DAMPING: TRUTH.mesh_damping_ratio}) - levels_db)

    user = WithRK45(TRUTH, np.maximum(CLOSE_DB, errors))
    reached = np.abs(user.levels_db(TRUTH.constant_db, TRUTH.mesh_damping_ratio) - levels_db).max()
    rk45 = timed(lambda: (user.kept.clear(), user.mesh_at_4_m_db(0.06)), 3)
    user.kept.clear()
    start = time.perf_counter()
    fitted = user.fit(measured)
    plain_fit = time.perf_counter() - start
    n_plain, n_ours = len(user.kept), len(counted.computed)

    def own() -> Any:
        held = LevelModel(fleet, data)

        def residuals(place: np.ndarray) -> np.ndarray:
            values = {CONSTANT: float(place[0]), DAMPING: float(np.exp(place[1]))}
            return (held.levels_db(values) - measured) / SCATTER_DB

        bounds = ([-100.0, math.log(0.005)], [100.0, math.log(0.5)])
        return least_squares(residuals, [20.0, math.log(0.05)], bounds=bounds, x_scale=[1.0, 0.1], diff_step=1e-2)

    same = timed(own, repeats)
    same_place = own().x
    constant, damping = (parameter.value for parameter in found.parameters)
    ways = ", ".join(f"{rtol:g}/{periods}" for rtol, periods in user.ways)
    print("| six conditions | ms | error, dB | over the program |\n|---|---|---|---|")
    print(f"| levels, gears computed, the program | {1e3 * forward:.1f} | {errors.max():.1e} | 1 |")
    print(f"| levels, RK45 (rtol/periods: {ways}) | {1e3 * rk45:.0f} | {reached:.1e} | {rk45 / forward:.0f} |")
    print("\n| fit of two parameters | s | gears computed at | constant, damping | over the program |")
    print("|---|---|---|---|---|")
    print(f"| calibration, whole (budget 0.5) | {whole:.2f} | {n_ours} dampings | {constant:.3f}, {damping:.5f} | 1 |")
    print(f"| the same once more with other levels | {again:.2f} | 0 dampings | | |")
    place = f"{same_place[0]:.3f}, {math.exp(same_place[1]):.5f}"
    print(f"| one plain least_squares, the program's levels | {same:.3f} | {n_plain} dampings | {place} | 1 |")
    place = f"{fitted.x[0]:.3f}, {math.exp(fitted.x[1]):.5f}"
    ratio = f"{plain_fit / same:.0f} ({plain_fit / whole:.0f} of the whole calibration)"
    print(f"| one plain least_squares, RK45's levels, run | {plain_fit:.1f} | {n_plain} dampings | {place} | {ratio} |")
    print(
        f"| what the calibration computes, by RK45, {n_ours} x {rk45:.1f} s, not run | {n_ours * rk45:.0f} | "
        f"{n_ours} dampings | | {n_ours * rk45 / whole:.0f} |",
        flush=True,
    )
    note("levels of six conditions from the gears", 1e3 * forward, "ms", "the same by RK45, same error", 1e3 * rk45)
    note(
        "calibration, two parameters on six conditions", whole, "s", "one least_squares on RK45", plain_fit, budget=0.5
    )
    note("one plain fit with the program's levels", same, "s", "the same fit on RK45", plain_fit)


def growth(repeats: int) -> None:
    print("\n| conditions | " + " | ".join(", ".join(_short(key) for key in free) + ": s" for free in FREE) + " |")
    print("|---|" + "---|" * len(FREE))
    settings = FitSettings(model_sigma_db=0.0)
    for number in NUMBERS:
        speeds = [round(float(speed), 3) for speed in np.linspace(20.0, 114.455, number)]
        cells = []
        for keys in FREE:
            fleet = fleet_of(TRUTH, keys, speeds)
            empty = data_of(fleet, [0.0] * number)
            true = LevelModel(fleet, empty).levels_db({key: TRUTH.value(key) for key in keys})
            data = data_of(fleet, scattered(true))
            free = [free_parameter(fleet, key) for key in keys]
            taken = timed(lambda f=fleet, d=data, p=free: calibrate_fleet(f, d, p, settings), max(1, repeats // 2))
            cells.append(f"{taken:.2f}")
        print(f"| {number} | " + " | ".join(cells) + " |", flush=True)


def prediction(repeats: int) -> None:
    fleet = fleet_of(TRUTH, ())
    helix = fleet.get("operation.helix_angle_deg").value
    taken = timed(lambda: td.DriveModel(fleet).evaluate(), 3 * repeats)
    number = len(td.DriveModel(fleet).conditions)
    print(f"\n| prediction of {number} speeds and {len(helix)} helix angles (budget 0.1) | {taken:.3f} s |\n|---|---|")
    note(f"prediction of {number} speeds and {len(helix)} helix angles", taken, "s", budget=0.1)


def _short(key: str) -> str:
    return {CONSTANT: "constant", DAMPING: "mesh damping", GAIN: "motor gain", BEARINGS: "bearing damping"}[key]


def main(repeats: int = 7) -> None:
    """Print the tables."""
    libraries = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "numba", "lmfit"))
    print(f"Medians of {repeats} calls, the first not counted; one core of {os.cpu_count()}")
    print(f"Python {platform.python_version()}, {libraries}; {platform.machine()} {processor()}\n")
    levels_db = plain.levels_at_4_m_db(TRUTH.drive())
    against_rk45(repeats, levels_db)
    growth(repeats)
    prediction(repeats)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))

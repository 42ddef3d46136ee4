"""What transfer vectors cost and save: the housing's sound by them beside a direct solve of each condition.

    PYTHONPATH=. python tests/benchmarks/bench_housing.py [--highest-hz 1500] [--store DIR]

Both sides are this program's boundary elements with the same modes, forces, grids and receivers (mean over the 4 m
sphere and 72 points at 12 m), so the ratios are those of the method alone. The direct side solves each line of each
condition on the grid for its frequency. The paper's ten cases are six speeds and four helix angles. Times are
wall-clock with one thread, except the one-off, which uses all cores as the program does; run on an otherwise idle
machine. Without --store the one-off starts from nothing.
"""

from __future__ import annotations

import argparse
import platform
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from figures import note
from threadpoolctl import threadpool_limits

import tdacoustic as td
from tdacoustic.drive import DriveModel, GearState, HousingSound, StructureSource
from tdacoustic.drive.housing_steps import panel_velocities
from tdacoustic.radiation.boundary_elements import ExteriorProblem
from tdacoustic.radiation.multipoles import degree_for
from tdacoustic.radiation.sphere_rules import SphereRule
from tdacoustic.radiation.transfer_vectors import grid_hz_for
from tdacoustic.steps import Store
from tdacoustic.workflows.housing_sound import housing_sound

REFERENCE = Path(__file__).resolve().parents[2] / "calibration" / "reference-drive"


def timed(function: Callable[[], object]) -> float:
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


def directly(model: DriveModel, housing: HousingSound, source: StructureSource) -> float:
    """Level at 4 m of one line, solved for it alone; around the circle too."""
    frequency, body = source.frequency_hz, housing.body
    surface = body.surface(grid_hz_for(frequency, housing.range_hz[1]))
    velocity = (panel_velocities(housing.modes, surface, body.position_m) @ source.velocities)[:, None]
    wave = body.wave_number_rad_m(frequency)
    problem = ExteriorProblem(surface, wave, body.impedance_pa_s_m, body.ground_m)
    rule = SphereRule(model.field.surface.distance_m, 2 * degree_for(wave, body.radius_m))
    places = np.concatenate([rule.points_m, [receiver.position_m for receiver in model.field.circle]])
    pressures = problem.transfer(places, velocity, way="direct")[:, 0]
    return 10.0 * float(np.log10(0.5 * rule.mean_square(pressures[: len(rule.points_m)]) / 4e-10))


def by_vectors(model: DriveModel, state: GearState) -> float:
    """Level at 4 m of all lines of a condition; around the circle too."""
    sound = model.sound_of(state)
    model.field.around_db(sound.sources)
    return float(sound.level_db(model.field.surface.name, "structure") or np.nan)


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    asked.add_argument("--highest-hz", type=float, default=1500.0)
    asked.add_argument("--store", type=Path)
    options = asked.parse_args()
    fleet = td.load_fleet(REFERENCE).replaced(
        {"radiation.max_frequency_hz": options.highest_hz, "model.gear_path": "structure"}
    )
    with tempfile.TemporaryDirectory() as empty:
        store = Store(options.store or empty)
        kept: list[HousingSound] = []
        once = timed(lambda: kept.append(housing_sound(fleet, store)[0]))
        again = timed(lambda: kept.append(housing_sound(fleet, store)[0]))
        records = dict(housing_sound(fleet, store)[1])
    housing = kept[-1]
    model = DriveModel(fleet, housing=housing)
    versions = f"python {platform.python_version()}, numpy {np.__version__}, {platform.machine()}"
    print(f"{versions}, to {options.highest_hz:g} Hz")
    steps: dict[str, float] = {}
    for record in records.values():
        steps[record.step] = steps.get(record.step, 0.0) + record.wall_s
    shares = ", ".join(f"{name} {spent:.1f}" for name, spent in steps.items())
    print(f"one-off {once:.1f} s, of it by step (sums over processes): {shares}")
    print(f"looked up again {again:.2f} s")
    with threadpool_limits(limits=1):
        prediction = model.evaluate()
        evaluation = statistics.median(timed(model.evaluate) for _ in range(7))
        cases = [*prediction.conditions, *(case.gears for case in prediction.helix)]
        print("case                  lines   vectors ms     direct s     ratio   difference dB")
        fast_total = slow_total = 0.0
        for state in cases:
            lines = model.field.structure_sources(state.forces)
            levels: list[float] = []
            fast = statistics.median(timed(lambda state=state: by_vectors(model, state)) for _ in range(5))
            slow = timed(lambda lines=lines, levels=levels: levels.extend(directly(model, housing, s) for s in lines))
            direct_db = 10.0 * np.log10(np.sum(10.0 ** (0.1 * np.array(levels))))
            apart = by_vectors(model, state) - direct_db
            name = f"{state.condition.name}"
            print(f"{name:20s} {len(lines):6d} {1e3 * fast:12.2f} {slow:12.2f} {slow / fast:9.0f} {apart:15.3f}")
            fast_total, slow_total = fast_total + fast, slow_total + slow
    print(f"six speeds and four helix angles, gears and all tables' numbers included: {1e3 * evaluation:.0f} ms")
    print(f"online, ten cases: {slow_total:.1f} s / {1e3 * fast_total:.1f} ms = {slow_total / fast_total:.0f} times")
    direct = "direct boundary elements, the same grid"
    note("housing's sound by transfer vectors, ten cases", 1e3 * fast_total, "ms", direct, 1e3 * slow_total)
    top = f"to {options.highest_hz:g} Hz"
    budget = {1500.0: 60.0, 3000.0: 300.0}.get(options.highest_hz)
    note(f"the same with the one-off, {top}", once + evaluation, "s", direct, slow_total)
    note(f"one-off: modes and transfer vectors {top}, from an empty store", once, "s", budget=budget)
    print(
        f"end to end, ten cases with the one-off: {slow_total:.1f} s / {once + evaluation:.1f} s = "
        f"{slow_total / (once + evaluation):.2f} times (modes are on the right side alone)"
    )


if __name__ == "__main__":
    main()

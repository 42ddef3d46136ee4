"""How often a true change lies in its interval: many campaigns from a truth that shares nothing with the analysis.

``python tests/evidence/what_if_study.py [campaigns]`` prints the table; 40 campaigns of each kind take two minutes.

The truth is `drive_levels`: the printed equations marched in time, Masuda's level and the motor's lines written out. A
campaign has the six conditions of the reference drive; the model's scatter, 4 dB, is drawn for each path by itself
("apart") or once for both ("alike"), and 0.3 dB of measurement on top. The motor's gain and Masuda's constant are
fitted, in a second set the mesh damping ratio too. Looked at are 10 dB less of the motor and of the meshing noise.
"""

from __future__ import annotations

import os
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent), str(HERE.parent / "gears"), str(HERE.parents[1])]

import drive_levels  # noqa: E402
import numpy as np  # noqa: E402
from plain_fleets import plain_fleet  # noqa: E402

from tdacoustic.drive import DriveModel, Receiver  # noqa: E402
from tdacoustic.drive.what_if import what_if_answer  # noqa: E402
from tdacoustic.fitting.calibration import calibrate_fleet, free_parameter  # noqa: E402
from tdacoustic.fitting.levels import LevelModel  # noqa: E402
from tdacoustic.fitting.measured_level import MeasuredLevel  # noqa: E402
from tdacoustic.fitting.settings import FitSettings  # noqa: E402
from tdacoustic.fitting.what_if import WhatIfPlaces, what_if_intervals  # noqa: E402
from tdacoustic.fleet import Fleet, load_fleet  # noqa: E402

CONSTANT, GAIN, DAMPING = "masuda.constant_db", "model.motor_gain_db", "gear_dynamics.mesh_damping_ratio"
LINES_DB = (104.0, 100.0)
SCATTER_DB, LEVEL_SIGMA_DB = 4.0, 0.3
TRUE_DAMPING, TRUE_GAIN_DB = 0.08, -1.0
SURFACE = "4 m"


def fleet_of_the_study() -> Fleet:
    text = plain_fleet("reference-drive").read_text(encoding="utf-8")
    start = text.index("[housing]")
    motor = "".join(
        f'[[motor.excitation]]\nname = "line {number}"\nfixed_hz = {600 * number}\nsound_power_level_db = {level}\n'
        for number, level in enumerate(LINES_DB, 1)
    )
    path = Path(tempfile.mkdtemp()) / "fleet.toml"
    path.write_text(f"{text[:start]}{motor}\n{text[start:]}", encoding="utf-8")
    return load_fleet(path)


def energy_sum(*levels_db):
    return 10.0 * np.log10(sum(10.0 ** (0.1 * np.asarray(level)) for level in levels_db))


def study(
    fleet: Fleet, truth_db: np.ndarray, keys: tuple[str, ...], campaigns: int, seed: int
) -> dict[str, list[bool]]:
    """Whether each true change and level lies in its interval; `truth_db` has a row for the motor, then the mesh."""
    drive = DriveModel(fleet)
    conditions = drive.conditions
    empty = [
        MeasuredLevel(c, Receiver(SURFACE, 4.0), 0.0, LEVEL_SIGMA_DB, "Z", "synthetic", "study") for c in conditions
    ]
    model = LevelModel(fleet, empty)
    free = [free_parameter(fleet, key) for key in keys]
    random = np.random.default_rng(seed)
    names = ("apart: change", "apart: fit alone", "alike: change", "alike: fit alone", "level")
    held: dict[str, list[bool]] = {name: [] for name in names}
    for number in range(2 * campaigns):
        kind = ("apart", "alike")[number % 2]
        errors = SCATTER_DB * random.standard_normal(truth_db.shape)
        paths_db = truth_db + (errors if kind == "apart" else errors[:1])
        measured = energy_sum(*paths_db) + LEVEL_SIGMA_DB * random.standard_normal(len(conditions))
        data = [replace(datum, level_db=float(level)) for datum, level in zip(empty, measured, strict=True)]
        own = model.with_data(data)
        found = calibrate_fleet(fleet, data, free, FitSettings(SCATTER_DB, starts=2), model=own)
        fitted = DriveModel(found.fleet)
        sounds = [fitted.sound_of(fitted.gears(condition)) for condition in conditions]
        answer = what_if_answer(fitted, conditions, sounds)
        answer = what_if_intervals(answer, found, own, WhatIfPlaces(conditions, (fitted.field.surface,), None, {}))
        for index, condition in enumerate(conditions):
            for path, name in enumerate(("motor", "mesh")):
                level = answer.level(condition.name, f"{name} 10 dB less", SURFACE)
                after = float(energy_sum(*(paths_db[:, index] - 10.0 * (np.arange(2) == path))))
                change = after - float(energy_sum(*paths_db[:, index]))
                held[f"{kind}: change"].append(level.change_95_db[0] <= change <= level.change_95_db[1])
                held[f"{kind}: fit alone"].append(level.fit_95_db[0] <= change <= level.fit_95_db[1])
                held["level"].append(level.level_95_db[0] <= after <= level.level_95_db[1])
    return held


def main(campaigns: int) -> None:
    fleet = fleet_of_the_study()
    true = drive_levels.TrueDrive(masuda_constant_db=0.0, mesh_damping_ratio=TRUE_DAMPING)
    mesh = np.array(drive_levels.levels_at_4_m_db(true))
    motor = energy_sum(*LINES_DB) + TRUE_GAIN_DB - 10.0 * np.log10(4.0 * np.pi * 4.0**2)
    truth_db = np.stack([np.full_like(mesh, motor), mesh])
    known = fleet.replaced({DAMPING: TRUE_DAMPING})
    for of, keys in ((known, (CONSTANT, GAIN)), (fleet, (CONSTANT, GAIN, DAMPING))):
        print(f"{campaigns} campaigns of each kind, fitted: {', '.join(keys)}")
        for name, cases in study(of, truth_db, keys, campaigns, seed=len(keys)).items():
            print(f"  {name:18s} {np.mean(cases):.3f} of {len(cases)}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 40)

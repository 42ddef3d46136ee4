"""A fleet whose levels motor and meshing share, and levels of its model with other values."""

from dataclasses import replace

import numpy as np
import pytest
from plain_fleets import plain_fleet

import tdacoustic as td
from tdacoustic.drive import Receiver
from tdacoustic.fitting.levels import LevelModel
from tdacoustic.fitting.measured_level import MeasuredLevel

CONSTANT, DAMPING, GAIN = "masuda.constant_db", "gear_dynamics.mesh_damping_ratio", "model.motor_gain_db"
MOTOR = """
[[motor.excitation]]
name = "low"
fixed_hz = 600
sound_power_level_db = 104
[[motor.excitation]]
name = "high"
fixed_hz = 1200
sound_power_level_db = 100
"""


@pytest.fixture(scope="session")
def shared_fleet(tmp_path_factory):
    """The reference drive with two constant tones of the motor: 82.4 dB of it at 4 m."""
    text = plain_fleet("reference-drive").read_text(encoding="utf-8")
    path = tmp_path_factory.mktemp("fleet") / "fleet.toml"
    assert "[motor]" in text
    start = text.index("[housing]") if "[housing]" in text else len(text)
    path.write_text(text[:start] + MOTOR + "\n" + text[start:], encoding="utf-8")
    return td.load_fleet(path)


@pytest.fixture(scope="session")
def levels_of(shared_fleet):
    """Make data of some conditions of the fleet with other values, and scatter where it is asked for."""

    def made(values, conditions=range(6), sigma_db=0.3, scatter_db=0.0, seed=0, **changes):
        known = td.DriveModel(shared_fleet).conditions
        places = [known[index] for index in conditions]
        empty = [
            MeasuredLevel(place, Receiver("4 m", 4.0), 0.0, sigma_db, "Z", "synthetic", "made", **changes)
            for place in places
        ]
        levels = LevelModel(shared_fleet, empty).levels_db(values)
        levels = levels + scatter_db * np.random.default_rng(seed).standard_normal(levels.size)
        return [replace(datum, level_db=float(level)) for datum, level in zip(empty, levels, strict=True)]

    return made

"""Step: a sweep of speed in one direction, kept because rattling gears take seconds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from tdacoustic.drive.conditions import torque_at
from tdacoustic.drive.model import DriveModel
from tdacoustic.fleet import Fleet, Kinematics
from tdacoustic.gears import Branch, GearSystem, branch_of_sweep
from tdacoustic.steps import Step, Task
from tdacoustic.steps.progress import tell_progress

__all__ = ["SWEEP", "SweepSettings", "sweep_speeds_km_h", "sweep_tasks"]

SPEEDS: Final = 150
SLOWEST, FASTEST = 0.05, 1.25
"""Range of a sweep, in parts of the fastest condition's speed."""


@dataclass(frozen=True)
class SweepSettings:
    """What a sweep depends on.

    Parameters
    ----------
    system : GearSystem
    mesh_hz, torque_n_m : tuple of float
        Speeds in the order in which they are passed, and the pinion's torque at them.
    """

    system: GearSystem
    mesh_hz: tuple[float, ...]
    torque_n_m: tuple[float, ...]


def _sweep(settings: SweepSettings) -> Branch:
    n_speeds = len(settings.mesh_hz)
    return branch_of_sweep(
        settings.system, settings.mesh_hz, settings.torque_n_m, lambda done: tell_progress(done / n_speeds)
    )


SWEEP: Final = Step("gear-sweep", 1, _sweep, "Speed sweep of the gears")


def sweep_speeds_km_h(fleet: Fleet, fastest_km_h: float) -> tuple[float, ...]:
    """Return the train speeds of a sweep, ascending; a torque table is not left.

    Parameters
    ----------
    fleet : Fleet
    fastest_km_h : float
        Of the conditions.
    """
    low, high = SLOWEST * fastest_km_h, FASTEST * fastest_km_h
    table = fleet.operation.torque_table
    if fleet.operation.torque.value == "table" and table is not None:
        low, high = max(low, table.value[0][0]), min(high, table.value[-1][0])
    return tuple(float(speed) for speed in np.linspace(low, high, SPEEDS))


def sweep_tasks(model: DriveModel, speeds_km_h: tuple[float, ...]) -> tuple[Task, Task]:
    """Return the tasks of the sweep up and of the sweep down.

    Parameters
    ----------
    model : DriveModel
    speeds_km_h : tuple of float
        Ascending.
    """
    kinematics, unit = Kinematics.of(model.fleet), model.unit
    mesh_hz = tuple(unit.mesh_hz(kinematics.motor_hz_at_km_h(speed)) for speed in speeds_km_h)
    torques = tuple(unit.pinion_torque_n_m(torque_at(model.fleet, speed)) for speed in speeds_km_h)
    up = SweepSettings(unit.system, mesh_hz, torques)
    down = SweepSettings(unit.system, mesh_hz[::-1], torques[::-1])
    return SWEEP.task("up", up), SWEEP.task("down", down)

"""The conditions a drive is computed for: speed, torque, mode."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from tdacoustic.errors import FleetError
from tdacoustic.fleet import Fleet, Kinematics

__all__ = ["WHEEL_DRIVES", "Condition", "conditions_of", "followed", "torque_at"]

WHEEL_DRIVES: Final = frozenset({"brake", "coast", "hauled"})
"""Modes in which the wheelset drives the motor, so that the other flanks of the teeth carry."""


@dataclass(frozen=True)
class Condition:
    """One state of operation.

    Parameters
    ----------
    name : str
    train_speed_km_h : float
    motor_hz : float
        Turns of the motor per second.
    torque_n_m : float
        Of one motor, signed: above zero the motor drives the wheelset.
    mode : str
        ``"traction"``, ``"brake"``, ``"coast"`` or ``"hauled"``.
    """

    name: str
    train_speed_km_h: float
    motor_hz: float
    torque_n_m: float
    mode: str

    @property
    def power_w(self) -> float:
        """Of one motor, signed."""
        return 2.0 * math.pi * self.motor_hz * self.torque_n_m


def conditions_of(fleet: Fleet) -> tuple[Condition, ...]:
    """Return the conditions of ``[operation]``.

    Raises
    ------
    FleetError
        The fleet names no speeds, or its torque law lacks what it needs.
    """
    speeds: tuple[float, ...] = fleet.get("operation.train_speed_km_h").value
    kinematics = Kinematics.of(fleet)
    mode = fleet.operation.mode.value
    return tuple(
        Condition(name, speed, kinematics.motor_hz_at_km_h(speed), torque_at(fleet, speed), mode)
        for name, speed in zip(fleet.operation.names, speeds, strict=True)
    )


def followed(condition: Condition, before: Fleet, after: Fleet) -> Condition:
    """Return a condition with the speed and torque that a changed fleet gives it, where the fleet gave them before.

    The train's speed stays; what runs state of torque or turns stays too. With the torque goes the mode.

    Parameters
    ----------
    condition : Condition
    before, after : Fleet
    """
    speed = condition.train_speed_km_h
    motor_hz, torque_n_m = condition.motor_hz, condition.torque_n_m
    if math.isclose(Kinematics.of(before).motor_hz_at_km_h(speed), motor_hz, rel_tol=1e-9):
        motor_hz = Kinematics.of(after).motor_hz_at_km_h(speed)
    mode = condition.mode
    try:
        of_law = math.isclose(torque_at(before, speed), torque_n_m, rel_tol=1e-9)
    except FleetError:  # there is no law: the runs state their torques
        of_law = False
    if of_law and mode == before.operation.mode.value:
        torque_n_m, mode = torque_at(after, speed), after.operation.mode.value
    return replace(condition, motor_hz=motor_hz, torque_n_m=torque_n_m, mode=mode)


def torque_at(fleet: Fleet, train_speed_km_h: float) -> float:
    """Return the torque of one motor in N m by the fleet's torque law, signed by its mode.

    ``"constant"``: as stated. ``"constant_power"``: P/ω. ``"running_resistance"``: the drive's resistance at the rim
    of the wheel, a + b V + c V², carried to the motor. ``"table"``: linear between its rows. Where the wheelset drives
    (brake, coast, hauled) a torque that is stated without its sign is taken as one against the motor.

    Parameters
    ----------
    fleet : Fleet
    train_speed_km_h : float

    Raises
    ------
    FleetError
        The law lacks what it needs, or its table does not reach the speed.
    """
    operation = fleet.operation
    law = operation.torque.value
    if law == "constant":
        torque = fleet.number("operation.torque_n_m")
    elif law == "constant_power":
        turns_hz = Kinematics.of(fleet).motor_hz_at_km_h(train_speed_km_h)
        torque = fleet.number("operation.power_kw") / (2.0 * math.pi * turns_hz)
    elif law == "running_resistance":
        torque = _of_resistance(fleet, train_speed_km_h)
    else:
        torque = _of_table(fleet, train_speed_km_h)
    return -abs(torque) if operation.mode.value in WHEEL_DRIVES else torque


def _of_resistance(fleet: Fleet, train_speed_km_h: float) -> float:
    a, b, c = fleet.numbers("operation.resistance_n")
    at_rim_n = a + b * train_speed_km_h + c * train_speed_km_h**2
    return at_rim_n * 0.5 * fleet.train.wheel_diameter_m / Kinematics.of(fleet).ratio


def _of_table(fleet: Fleet, train_speed_km_h: float) -> float:
    rows: tuple[tuple[float, float], ...] = fleet.get("operation.torque_table").value
    speeds, torques = zip(*rows, strict=True)
    if not speeds[0] <= train_speed_km_h <= speeds[-1]:
        raise FleetError(
            f"{fleet.path}: [operation]: torque_table reaches from {speeds[0]:g} to {speeds[-1]:g} km/h and has no "
            f"torque at {train_speed_km_h:g} km/h"
        )
    return float(np.interp(train_speed_km_h, speeds, torques))

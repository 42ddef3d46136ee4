"""What turns how fast: train, wheelset, shafts, motor, teeth (physics.md section 1).

Slip between wheel and rail, and tooth or shaft deformation, are neglected: a
measured mesh frequency may lie a percent or two beside the calculated one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from tdacoustic.errors import FleetError
from tdacoustic.fleet.excitations import Excitation, mesh_excitations, motor_excitations, shaft_excitations
from tdacoustic.fleet.fleet import Fleet
from tdacoustic.fleet.motor import Motor

__all__ = ["GearStage", "Kinematics", "mesh_orders", "shaft_orders", "supply_hz", "total_ratio", "wheel_hz"]

_KM_H: Final = 1.0 / 3.6


def wheel_hz(train_speed_m_s: float, wheel_diameter_m: float) -> float:
    """Return the turns of the wheelset per second, V / (π D) (physics.md section 1).

    Examples
    --------
    >>> round(wheel_hz(20 / 3.6, 1.05112), 4)
    1.6824
    """
    return train_speed_m_s / (math.pi * wheel_diameter_m)


def total_ratio(teeth: Sequence[tuple[int, int]]) -> float:
    """Return the turns of the motor for one of the wheelset, z2/z1 of each stage multiplied (physics.md section 1).

    Examples
    --------
    >>> round(total_ratio([(31, 104)]), 5)
    3.35484
    """
    return math.prod(driven / driving for driving, driven in teeth)


def shaft_orders(teeth: Sequence[tuple[int, int]]) -> tuple[float, ...]:
    """Return the turns of each shaft for one of the motor: 1, then each intermediate shaft, last the wheelset.

    Examples
    --------
    >>> shaft_orders([(20, 40), (25, 50)])
    (1.0, 0.5, 0.25)
    """
    orders = [1.0]
    for driving, driven in teeth:
        orders.append(orders[-1] * driving / driven)
    return tuple(orders)


def mesh_orders(teeth: Sequence[tuple[int, int]]) -> tuple[float, ...]:
    """Return the tooth meshes of each stage for one turn of the motor.

    Those of the first are its driving teeth; those of the second are its driving teeth times
    the turns of the shaft they sit on, z1' z1/z2.

    Examples
    --------
    >>> mesh_orders([(20, 40), (25, 50)])
    (20.0, 12.5)
    """
    return tuple(driving * order for (driving, _), order in zip(teeth, shaft_orders(teeth), strict=False))


def supply_hz(motor_hz: float, pole_pairs: int, slip: float) -> float:
    """Return the frequency that the motor is fed with, p n / (1 - s) (physics.md section 5).

    Examples
    --------
    >>> supply_hz(30.0, 2, 0.0)
    60.0
    """
    return pole_pairs * motor_hz / (1.0 - slip)


@dataclass(frozen=True)
class GearStage:
    """A gear pair as kinematics sees it.

    Parameters
    ----------
    name : str
    teeth : (int, int)
        Driving, driven.
    """

    name: str
    teeth: tuple[int, int]


@dataclass(frozen=True)
class Kinematics:
    """The speeds and frequencies of a drive; speeds are magnitudes.

    Parameters
    ----------
    wheel_diameter_m : float
    stages : tuple of GearStage
        From the motor to the wheelset.
    motor : Motor or None
        For what the inverter and the supply do.

    Raises
    ------
    FleetError
        A wheel diameter that is not above zero, or no stage.

    Examples
    --------
    >>> drive = Kinematics(1.05112, (GearStage("1", (31, 104)),))
    >>> motor_hz = drive.motor_hz_at_km_h(20.0)
    >>> round(60 * motor_hz, 2), round(drive.mesh_hz(motor_hz)["1"], 2)
    (338.65, 174.97)
    """

    wheel_diameter_m: float
    stages: tuple[GearStage, ...]
    motor: Motor | None = None

    def __post_init__(self) -> None:
        if not (math.isfinite(self.wheel_diameter_m) and self.wheel_diameter_m > 0.0):
            raise FleetError(f"wheel_diameter_m must be > 0, got {self.wheel_diameter_m!r}")
        if not self.stages:
            raise FleetError("a drive needs at least one gear pair, got none")

    @classmethod
    def of(cls, fleet: Fleet, wheel_diameter_mm: float | None = None) -> Kinematics:
        """Return the kinematics of a fleet.

        Parameters
        ----------
        fleet : Fleet
        wheel_diameter_mm : float, optional
            As worn, where a run states it. Default: the fleet's.
        """
        diameter_m = fleet.train.wheel_diameter_m if wheel_diameter_mm is None else 1e-3 * wheel_diameter_mm
        return cls(diameter_m, tuple(GearStage(pair.name, pair.teeth.value) for pair in fleet.gear_pair), fleet.motor)

    @property
    def teeth(self) -> tuple[tuple[int, int], ...]:
        """Driving and driven teeth of each stage."""
        return tuple(stage.teeth for stage in self.stages)

    @property
    def ratio(self) -> float:
        """Turns of the motor for one of the wheelset."""
        return total_ratio(self.teeth)

    @property
    def shaft_orders(self) -> tuple[float, ...]:
        """Turns of each shaft for one of the motor: the motor's, the intermediate ones', the wheelset's."""
        return shaft_orders(self.teeth)

    @property
    def wheelset_order(self) -> float:
        """Turns of the wheelset for one of the motor."""
        return self.shaft_orders[-1]

    @property
    def mesh_orders(self) -> dict[str, float]:
        """Tooth meshes for one turn of the motor, by the pair's name."""
        return dict(zip((stage.name for stage in self.stages), mesh_orders(self.teeth), strict=True))

    def wheel_hz(self, train_speed_m_s: float) -> float:
        """Turns of the wheelset per second at a train speed."""
        return wheel_hz(train_speed_m_s, self.wheel_diameter_m)

    def motor_hz(self, train_speed_m_s: float) -> float:
        """Turns of the motor per second at a train speed, V / (π D) · z2/z1 (physics.md section 1)."""
        return self.wheel_hz(train_speed_m_s) * self.ratio

    def motor_hz_of_wheel(self, wheel_hz: float) -> float:
        """Turns of the motor per second for those of the wheelset."""
        return wheel_hz * self.ratio

    def wheel_hz_of_motor(self, motor_hz: float) -> float:
        """Turns of the wheelset per second for those of the motor."""
        return motor_hz / self.ratio

    def train_speed_m_s(self, motor_hz: float) -> float:
        """Train speed for turns of the motor per second."""
        return self.wheel_hz_of_motor(motor_hz) * math.pi * self.wheel_diameter_m

    def motor_hz_at_km_h(self, train_speed_km_h: float) -> float:
        """Turns of the motor per second at a train speed in km/h."""
        return self.motor_hz(train_speed_km_h * _KM_H)

    def train_speed_km_h(self, motor_hz: float) -> float:
        """Train speed in km/h for turns of the motor per second."""
        return self.train_speed_m_s(motor_hz) / _KM_H

    def mesh_hz(self, motor_hz: float) -> dict[str, float]:
        """Mesh frequency of each pair, by its name."""
        return {name: order * motor_hz for name, order in self.mesh_orders.items()}

    def carrier_hz(self, motor_hz: float) -> float | None:
        """Carrier of the inverter at a motor speed; None where it has none, or none is named.

        A table over motor speed says nothing outside of its speeds: see `Motor.carrier_hz_at`.
        """
        return None if self.motor is None else self.motor.carrier_hz_at(60.0 * motor_hz)

    def supply_hz(self, motor_hz: float) -> float | None:
        """Frequency of the motor's supply; None where the fleet lacks ``pole_pairs`` or ``slip``."""
        if self.motor is None or self.motor.pole_pairs is None or self.motor.slip is None:
            return None
        return supply_hz(motor_hz, self.motor.pole_pairs.value, self.motor.slip.value)

    def excitations(self, motor_hz: float, highest_hz: float) -> tuple[Excitation, ...]:
        """Return every excitation that is expected at a motor speed.

        Mesh harmonics of each pair, low harmonics of the motor's shaft and of the wheelset, and what
        ``[[motor.excitation]]`` names; where it names nothing and there is a carrier, the carrier's harmonics
        1 to 6. Intermediate shafts are left out; `shaft_orders` has them.

        Parameters
        ----------
        motor_hz : float
            Turns of the motor per second, zero or above.
        highest_hz : float
            Higher ones are left out, as are those at or below zero.

        Returns
        -------
        tuple of Excitation
            By frequency.

        Raises
        ------
        FleetError
            A negative motor speed, or a highest frequency that is not a number above zero.
        """
        if not (math.isfinite(motor_hz) and motor_hz >= 0.0):
            raise FleetError(f"motor_hz must be >= 0, got {motor_hz!r}")
        if not (math.isfinite(highest_hz) and highest_hz > 0.0):
            raise FleetError(f"highest_hz must be > 0, got {highest_hz!r}")
        found = [
            *mesh_excitations(self.mesh_orders, motor_hz, highest_hz),
            *shaft_excitations(self.wheelset_order, motor_hz),
        ]
        if self.motor is not None:
            found += motor_excitations(self.motor, motor_hz, self.carrier_hz(motor_hz), self.supply_hz(motor_hz))
        return tuple(sorted((e for e in found if 0.0 < e.frequency_hz <= highest_hz), key=lambda e: e.frequency_hz))

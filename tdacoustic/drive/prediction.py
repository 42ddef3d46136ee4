"""What the model of a drive says."""

from __future__ import annotations

from dataclasses import dataclass

from tdacoustic.drive.conditions import Condition
from tdacoustic.drive.gear_unit import GearUnit
from tdacoustic.gears import BearingForces, Branch, SteadyState

__all__ = ["GearState", "HelixCase", "Prediction", "SpeedSweep"]


@dataclass(frozen=True)
class GearState:
    """The gears in one condition.

    Parameters
    ----------
    condition : Condition
    mesh_hz : float
    steady : SteadyState
    forces : BearingForces
    masuda_db : float or None
        Equation (8) at 1 m, in the reading of ``[masuda]``: dB, or dB(A) where its weighting is "A". None without
        power.
    """

    condition: Condition
    mesh_hz: float
    steady: SteadyState
    forces: BearingForces
    masuda_db: float | None


@dataclass(frozen=True)
class HelixCase:
    """One helix angle of the helix sweep; rack, teeth, shifts and face width stay.

    Parameters
    ----------
    helix_angle_deg : float
    unit : GearUnit
    gears : GearState
    """

    helix_angle_deg: float
    unit: GearUnit
    gears: GearState


@dataclass(frozen=True)
class SpeedSweep:
    """The gears while the train gets slowly faster, and slowly slower, under the fleet's torque law.

    Parameters
    ----------
    train_speed_km_h : tuple of float
        Ascending.
    up, down : Branch
        The second in descending order.
    """

    train_speed_km_h: tuple[float, ...]
    up: Branch
    down: Branch


@dataclass(frozen=True)
class Prediction:
    """The modelled side of a fleet.

    Parameters
    ----------
    unit : GearUnit
    conditions : tuple of GearState
        In the order of ``[operation]``.
    helix : tuple of HelixCase
        At the fastest condition; empty where the fleet names no angles.
    sweep : SpeedSweep or None
    doubts : tuple of str
        What the reader must know before using the numbers.
    """

    unit: GearUnit
    conditions: tuple[GearState, ...]
    helix: tuple[HelixCase, ...]
    sweep: SpeedSweep | None
    doubts: tuple[str, ...]

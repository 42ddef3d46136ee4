"""What the model of a drive says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive.conditions import Condition
from tdacoustic.drive.coupling import Coupling
from tdacoustic.drive.gear_unit import GearUnit
from tdacoustic.drive.insertion_loss import InsertionLoss
from tdacoustic.drive.levels import LevelAt
from tdacoustic.drive.near_field import NearField
from tdacoustic.drive.sources import SoundSource
from tdacoustic.gears import BearingForces, Branch, SteadyState
from tdacoustic.radiation import overall_level_db

__all__ = ["Directivity", "DriveSound", "GearState", "HelixCase", "HousingFacts", "Prediction", "SpeedSweep"]


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
class DriveSound:
    """The drive's sound in one condition.

    Parameters
    ----------
    condition : str
    sources : tuple of SoundSource
        Tones of the motor, the meshing noise, and the housing's tones where it is computed.
    levels : tuple of LevelAt
        Of each path and of the total, on the surface of ``[radiation] sphere_radius_m`` and at each receiver.
    surface_db : tuple of float
        Level of each source on that surface.
    """

    condition: str
    sources: tuple[SoundSource, ...]
    levels: tuple[LevelAt, ...]
    surface_db: tuple[float, ...] = ()

    def level_db(self, receiver: str, path: str = "total", weighting: str = "Z") -> float | None:
        """Return one of the levels; None of a path without sound."""
        for level in self.levels:
            if (level.receiver, level.path, level.weighting) == (receiver, path, weighting):
                return level.level_db
        return None

    def sound_power_level_db(self, path: str) -> float | None:
        """Return that of all tones of a path together, re 1 pW; None of a silent one."""
        return overall_level_db([s.sound_power_level_db for s in self.sources if s.path == path])


@dataclass(frozen=True)
class Directivity:
    """The total level around the circle of ``[radiation] circle_radius_m``, in the plane z = 0.

    Parameters
    ----------
    sweep : {"speed", "helix"}
    value : float
        Train speed in km/h, or helix angle in degrees.
    angle_deg, level_db : ndarray, shape (72,)
        From x towards y, every 5°; NaN of no sound.
    """

    sweep: Literal["speed", "helix"]
    value: float
    angle_deg: NDArray[np.float64]
    level_db: NDArray[np.float64]


@dataclass(frozen=True)
class HousingFacts:
    """What the sound of a housing was computed with.

    Parameters
    ----------
    mass_kg : float
        Of the housing's finite elements.
    mode_hz : ndarray, shape (modes,)
        Natural frequencies; the static correction comes on top.
    corrections : int
        Number of shapes of the static correction.
    range_hz : (float, float)
        Where the transfer vectors hold; bearing forces beyond make no sound here.
    left_share : (float, float)
        Part of the pinion's and of the wheel's bearing force that the bearing at +y takes.
    position_m, mesh_m : (float, float, float)
        Of the housing's middle and of the mesh's free source, in the drive frame.
    motor_m : (float, float, float) or None
        Of the motor's sources; None of a motor without sound.
    inside_m : (float, float, float) or None
        Of the mesh's source inside the housing, in the drive frame; None of one that is not there.
    step_file : str or None
        Name of the file that the housing is from; None of a parametric box.
    notes : tuple of str
        What was done to the solid of that file, in whole sentences.
    """

    mass_kg: float
    mode_hz: NDArray[np.float64]
    corrections: int
    range_hz: tuple[float, float]
    left_share: tuple[float, float]
    position_m: tuple[float, float, float]
    mesh_m: tuple[float, float, float]
    motor_m: tuple[float, float, float] | None
    inside_m: tuple[float, float, float] | None = None
    step_file: str | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class HelixCase:
    """One helix angle of the helix sweep; rack, teeth, shifts and face width stay.

    Parameters
    ----------
    helix_angle_deg : float
    unit : GearUnit
    gears : GearState
    sound : DriveSound
    """

    helix_angle_deg: float
    unit: GearUnit
    gears: GearState
    sound: DriveSound


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
    sound : tuple of DriveSound
        Of each of them.
    surface : str
        Name of the surface among the receivers, as ``"4 m"``.
    directivity : tuple of Directivity
        Of each condition and helix angle.
    helix : tuple of HelixCase
        At the fastest condition; the fleet's own angle where it names none.
    sweep : SpeedSweep or None
    doubts : tuple of str
        What the reader must know before using the numbers.
    housing : HousingFacts or None
        None of a field of point sources.
    maps : tuple of NearField
        Of the conditions of ``[radiation] map_conditions``.
    coupling : Coupling or None
        One-way against two-way coupling of gears and housing; None without a housing.
    insertion_loss : InsertionLoss or None
        Of the housing, whatever the placement of Masuda's source; None without a housing.
    """

    unit: GearUnit
    conditions: tuple[GearState, ...]
    sound: tuple[DriveSound, ...]
    surface: str
    directivity: tuple[Directivity, ...]
    helix: tuple[HelixCase, ...]
    sweep: SpeedSweep | None
    doubts: tuple[str, ...]
    housing: HousingFacts | None = None
    maps: tuple[NearField, ...] = ()
    coupling: Coupling | None = None
    insertion_loss: InsertionLoss | None = None

    def sound_of(self, condition: str) -> DriveSound | None:
        """Return the drive's sound in a condition, or None where it was not computed."""
        return next((sound for sound in self.sound if sound.condition == condition), None)

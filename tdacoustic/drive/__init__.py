"""The drive model: a fleet and conditions in, a prediction out."""

from tdacoustic.drive.conditions import Condition, conditions_of, torque_at
from tdacoustic.drive.gear_unit import GearUnit, gear_unit_of
from tdacoustic.drive.housing_field import HousingField, HousingSound
from tdacoustic.drive.levels import LevelAt, Receiver
from tdacoustic.drive.model import DriveModel
from tdacoustic.drive.near_field import NearField, pattern_correlation
from tdacoustic.drive.prediction import (
    Directivity,
    DriveSound,
    GearState,
    HelixCase,
    HousingFacts,
    Prediction,
    SpeedSweep,
)
from tdacoustic.drive.sources import SoundSource, StructureSource
from tdacoustic.housing import HousingError

__all__ = [
    "Condition",
    "Directivity",
    "DriveModel",
    "DriveSound",
    "GearState",
    "GearUnit",
    "HelixCase",
    "HousingError",
    "HousingFacts",
    "HousingField",
    "HousingSound",
    "LevelAt",
    "NearField",
    "Prediction",
    "Receiver",
    "SoundSource",
    "SpeedSweep",
    "StructureSource",
    "conditions_of",
    "gear_unit_of",
    "pattern_correlation",
    "torque_at",
]

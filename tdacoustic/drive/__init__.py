"""The drive model: a fleet and conditions in, a prediction out."""

from tdacoustic.drive.conditions import Condition, conditions_of, torque_at
from tdacoustic.drive.gear_unit import GearUnit, gear_unit_of
from tdacoustic.drive.model import DriveModel
from tdacoustic.drive.prediction import GearState, HelixCase, Prediction, SpeedSweep

__all__ = [
    "Condition",
    "DriveModel",
    "GearState",
    "GearUnit",
    "HelixCase",
    "Prediction",
    "SpeedSweep",
    "conditions_of",
    "gear_unit_of",
    "torque_at",
]

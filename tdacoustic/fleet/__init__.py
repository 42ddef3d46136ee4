"""``fleet.toml`` as checked, frozen models whose parameters know their origin, and the drive's kinematics."""

from tdacoustic.fleet.excitations import Excitation
from tdacoustic.fleet.fleet import Fleet, StatedParameter
from tdacoustic.fleet.gear_dynamics import GearDynamics
from tdacoustic.fleet.gear_pair import GearPair
from tdacoustic.fleet.housing import Housing, HousingSeat, Material
from tdacoustic.fleet.kinematics import GearStage, Kinematics
from tdacoustic.fleet.load import load_fleet
from tdacoustic.fleet.masuda import Masuda
from tdacoustic.fleet.model import Model
from tdacoustic.fleet.motor import Motor, MotorExcitation
from tdacoustic.fleet.operation import Operation
from tdacoustic.fleet.parameter import Parameter
from tdacoustic.fleet.radiation import Radiation
from tdacoustic.fleet.sections import SCHEMA
from tdacoustic.fleet.train import Train
from tdacoustic.fleet.what_if import WhatIf
from tdacoustic.fleet.write import fleet_toml

__all__ = [
    "SCHEMA",
    "Excitation",
    "Fleet",
    "GearDynamics",
    "GearPair",
    "GearStage",
    "Housing",
    "HousingSeat",
    "Kinematics",
    "Masuda",
    "Material",
    "Model",
    "Motor",
    "MotorExcitation",
    "Operation",
    "Parameter",
    "Radiation",
    "StatedParameter",
    "Train",
    "WhatIf",
    "fleet_toml",
    "load_fleet",
]

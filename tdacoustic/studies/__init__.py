"""Studies of a drive model: design sweeps, sensitivities, and another source's numbers and features beside its own."""

from tdacoustic.studies.cases import QUANTITIES, Case, CaseModel, CaseValues
from tdacoustic.studies.changed_fleet import conditions_under
from tdacoustic.studies.checks import (
    FeatureCheck,
    Findings,
    Influence,
    Move,
    ReferenceCheck,
    check_feature,
    check_reference,
)
from tdacoustic.studies.design_sweeps import SweepResult
from tdacoustic.studies.designs import points_of
from tdacoustic.studies.responses import Responses
from tdacoustic.studies.result import Studies
from tdacoustic.studies.sensitivity import PATHS, Sensitivity, sensitivity_of
from tdacoustic.studies.sweep_sensitivity import LevelInStudy, SweepSensitivity, sweep_sensitivity_of
from tdacoustic.studies.variations import LeftOut, Variation, variations_of

__all__ = [
    "PATHS",
    "QUANTITIES",
    "Case",
    "CaseModel",
    "CaseValues",
    "FeatureCheck",
    "Findings",
    "Influence",
    "LeftOut",
    "LevelInStudy",
    "Move",
    "ReferenceCheck",
    "Responses",
    "Sensitivity",
    "Studies",
    "SweepResult",
    "SweepSensitivity",
    "Variation",
    "check_feature",
    "check_reference",
    "conditions_under",
    "points_of",
    "sensitivity_of",
    "sweep_sensitivity_of",
    "variations_of",
]

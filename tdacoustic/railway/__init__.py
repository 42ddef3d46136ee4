"""The quantities of ISO 3095 and ISO 3381 that logs allow, and why the others are not to be had."""

from tdacoustic.railway.conditions import Conditions, Finding
from tdacoustic.railway.measures import (
    PositionResult,
    RailwayMeasures,
    RunQuantity,
    UnitResult,
    repeated,
    unit_results,
)
from tdacoustic.railway.quantities import (
    Passage,
    Quantity,
    braking,
    constant_speed,
    pass_by,
    starting,
    stationary,
    transit_exposure,
)
from tdacoustic.railway.repetition import (
    Repetition,
    Uncertainty,
    decisive,
    expanded_uncertainty_db,
    repetition,
    rounded_db,
    unit_level_db,
)
from tdacoustic.railway.rules import ISO_3095_2013, ISO_3095_2025, ISO_3381_2021, STANDARDS, UNVERIFIED, Rule, Standard

__all__ = [
    "ISO_3095_2013",
    "ISO_3095_2025",
    "ISO_3381_2021",
    "STANDARDS",
    "UNVERIFIED",
    "Conditions",
    "Finding",
    "Passage",
    "PositionResult",
    "Quantity",
    "RailwayMeasures",
    "Repetition",
    "Rule",
    "RunQuantity",
    "Standard",
    "Uncertainty",
    "UnitResult",
    "braking",
    "constant_speed",
    "decisive",
    "expanded_uncertainty_db",
    "pass_by",
    "repeated",
    "repetition",
    "rounded_db",
    "starting",
    "stationary",
    "transit_exposure",
    "unit_level_db",
    "unit_results",
]

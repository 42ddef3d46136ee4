"""What the studies of a prediction found."""

from __future__ import annotations

from dataclasses import dataclass

from tdacoustic.studies.checks import FeatureCheck, ReferenceCheck
from tdacoustic.studies.design_sweeps import SweepResult
from tdacoustic.studies.responses import Responses
from tdacoustic.studies.sensitivity import Sensitivity
from tdacoustic.studies.sweep_sensitivity import SweepSensitivity

__all__ = ["Studies"]


@dataclass(frozen=True)
class Studies:
    """What the studies of a prediction found.

    Parameters
    ----------
    responses : Responses or None
        None where nothing was studied.
    sensitivity : Sensitivity or None
    references : tuple of ReferenceCheck
    features : tuple of FeatureCheck
    sweeps : tuple of SweepResult
    sweep_sensitivities : tuple of SweepSensitivity
        Of those sweeps that go over ranges.
    """

    responses: Responses | None = None
    sensitivity: Sensitivity | None = None
    references: tuple[ReferenceCheck, ...] = ()
    features: tuple[FeatureCheck, ...] = ()
    sweeps: tuple[SweepResult, ...] = ()
    sweep_sensitivities: tuple[SweepSensitivity, ...] = ()

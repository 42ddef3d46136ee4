"""``fleet.toml`` section by section, under the file's own keys."""

from __future__ import annotations

from typing import Annotated, Any, Final

from pydantic import Field

from tdacoustic.fleet.design_sweep import DesignSweep
from tdacoustic.fleet.gear_dynamics import GearDynamics
from tdacoustic.fleet.gear_pair import GearPair
from tdacoustic.fleet.housing import Housing
from tdacoustic.fleet.masuda import Masuda
from tdacoustic.fleet.model import Model
from tdacoustic.fleet.motor import Motor
from tdacoustic.fleet.operation import Operation
from tdacoustic.fleet.radiation import Radiation
from tdacoustic.fleet.studies import Feature, Reference
from tdacoustic.fleet.train import Train
from tdacoustic.fleet.what_if import WhatIf
from tdacoustic.toml_models import Table, Text

__all__ = ["SCHEMA", "SECTIONS", "STUDIES", "FleetFile"]

SCHEMA: Final = "tdacoustic-fleet/1"
"""What ``schema`` has to say."""


class FleetFile(Table):
    """``fleet.toml`` (``schema`` is checked before)."""

    name: Text | None = None
    meta: dict[str, Any] = Field(default_factory=dict)
    train: Train
    gear_pair: Annotated[tuple[GearPair, ...], Field(min_length=1)]
    gear_dynamics: GearDynamics | None = None
    operation: Operation = Operation()
    masuda: Masuda = Masuda()
    model: Model = Model()
    motor: Motor | None = None
    housing: Housing | None = None
    radiation: Radiation = Radiation()
    sweep: tuple[DesignSweep, ...] = ()
    reference: tuple[Reference, ...] = ()
    feature: tuple[Feature, ...] = ()
    what_if: tuple[WhatIf, ...] = ()


STUDIES: Final = ("sweep", "reference", "feature", "what_if")
"""Tables of what is asked of the model; they hold no parameters."""

SECTIONS: Final = tuple(name for name in FleetFile.model_fields if name not in ("name", "meta", *STUDIES))
"""Names of the sections, in the order of the file."""

"""``[[what_if]]``: changes of the drive whose levels are wanted beside those of the drive as it is."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal, TypeAlias

from pydantic import AfterValidator, Field, PlainValidator, model_validator

from tdacoustic.fleet.keys import flat_keys
from tdacoustic.toml_models import Name, Table, each_once, shown

__all__ = ["OFF", "Changes", "WhatIf"]

OFF: Final = "off"

LARGEST_DB: Final = 100.0
"""Change of a source in dB that may be stated; to leave it out is ``"off"``."""

Value: TypeAlias = float | tuple["Value", ...]
Changes: TypeAlias = tuple[tuple[str, Any], ...]
"""Dotted keys of the fleet with their new values."""


def _change_db(value: Any) -> Any:
    if value == OFF:
        return OFF
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f'must be a change in dB, below 0 for quieter, or "off", got {shown(value)}')
    if abs(value) > LARGEST_DB:
        raise ValueError(f'must be from -{LARGEST_DB:g} to {LARGEST_DB:g} dB, or "off", got {value:g}')
    return float(value)


def _changes(value: Any) -> Changes:
    """A table of dotted keys; keys without quotes come as tables in tables and mean the same."""
    if isinstance(value, Mapping):
        if not value:
            raise ValueError(
                'must name a key with its new value, as { "masuda.constant_db" = 20 }, got an empty table; leave it '
                "out where no parameter changes"
            )
        pairs = flat_keys(value)
        for key, new in pairs:
            if not _is_numeric(new):
                raise ValueError(f"{key} must be a number or a list of numbers, got {shown(new)}")
        return pairs
    if isinstance(value, tuple) and all(isinstance(pair, tuple) and len(pair) == 2 for pair in value):
        return value  # as it was made here before
    raise ValueError(f"must be a table of keys of the fleet and their values, got {shown(value)}")


def _is_numeric(value: Any) -> bool:
    if isinstance(value, tuple):
        return bool(value) and all(_is_numeric(entry) for entry in value)
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


Change = Annotated[float | Literal["off"], PlainValidator(_change_db)]


class WhatIf(Table):
    """One ``[[what_if]]``.

    Parameters
    ----------
    name : str
    motor_db, structure_db, mesh_db : float or "off", optional
        Change of the level of a path in dB, below zero for quieter; ``"off"`` leaves the path out. The paths are those
        of ``predictions.csv``: the motor's tones, what the bearing forces make the housing radiate, Masuda's meshing
        noise of the gear unit.
    parameters : tuple of (str, value)
        Keys of the fleet with other values, as ``{ "gear_dynamics.mesh_damping_ratio" = 0.1 }``.
    conditions : tuple of str
        Default: all.
    """

    name: Name
    motor_db: Change | None = None
    structure_db: Change | None = None
    mesh_db: Change | None = None
    parameters: Annotated[Changes, PlainValidator(_changes)] = ()
    conditions: Annotated[tuple[Name, ...], AfterValidator(each_once), Field(min_length=1)] | None = None

    @model_validator(mode="after")
    def _changes_something(self) -> WhatIf:
        if not self.parameters and self.motor_db is None and self.structure_db is None and self.mesh_db is None:
            raise ValueError("names no change: motor_db, structure_db, mesh_db or parameters is needed")
        return self

    def gain_db(self, path: str) -> float:
        """Return the change of a path in dB; minus infinity of one that is left out.

        Examples
        --------
        >>> WhatIf(name="quiet motor", motor_db=-10).gain_db("motor")
        -10.0
        """
        stated = {"motor": self.motor_db, "structure": self.structure_db, "mesh": self.mesh_db}[path]
        return 0.0 if stated is None else -math.inf if stated == OFF else float(stated)

    @property
    def stated_paths(self) -> tuple[str, ...]:
        """Paths of which a change is stated."""
        held = {"motor": self.motor_db, "structure": self.structure_db, "mesh": self.mesh_db}
        return tuple(path for path, change in held.items() if change is not None)

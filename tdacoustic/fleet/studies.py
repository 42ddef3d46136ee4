"""``[[reference]]`` and ``[[feature]]``: numbers and shapes of another source beside the model's.

Like ``[[sweep]]`` they hold no parameters of the drive.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Final, Literal

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from tdacoustic.toml_models import Name, Table, Text, each_once

__all__ = [
    "FLAT_DB",
    "NEEDS_AT",
    "NEEDS_VALUE",
    "Feature",
    "Over",
    "Quantity",
    "Reference",
    "Shape",
]

Quantity = Literal[
    "spl_4m_db",
    "structure_spl_4m_db",
    "mesh_spl_4m_db",
    "motor_spl_4m_db",
    "masuda_spl_1m_db",
    "dte_pp_um",
    "mesh_frequency_hz",
    "pinion_force_x_n",
    "pinion_force_y_n",
    "pinion_force_z_n",
    "wheel_force_x_n",
    "wheel_force_y_n",
    "wheel_force_z_n",
    "loudest_deg",
    "range_12m_db",
    "pattern",
]
"""What a number or feature can be of, by the columns of the tables; forces are peak amplitudes at the mesh frequency,
``pattern`` is the shape of the level around the drive."""

Over = Literal["conditions", "helix"]
"""Along which values go: conditions by speed, or helix angles."""

Shape = Literal[
    "rises",
    "falls",
    "rises_then_falls",
    "flat_or_rises_then_falls",
    "flat",
    "highest_at",
    "lowest_at",
    "span",
    "above",
    "toward",
    "alike",
]
"""What a feature says of its values."""

NEEDS_AT: Final = ("highest_at", "lowest_at")
NEEDS_VALUE: Final = ("span", "toward", "alike")
_TOLERANCE: Final = {"toward": 22.5, "alike": 0.0, "above": 0.0, "highest_at": 0.0, "lowest_at": 0.0, "span": 2.0}
"""Usual tolerances [assumed], degrees of a direction and dB of a span; of the other shapes `FLAT_DB`."""
FLAT_DB: Final = 0.5
"""Within which values count as level [assumed]."""
_NEAR_DB: Final = 1.0
"""Within which two numbers count as the same [assumed]."""


def _names(value: Any) -> Any:
    return value if isinstance(value, tuple) else (value,)


def _places(value: Any) -> Any:
    if not isinstance(value, tuple):
        return value
    return tuple(f"{one:g}" if isinstance(one, float) and math.isfinite(one) else one for one in value)


Names = Annotated[tuple[Name, ...], BeforeValidator(_names), Field(min_length=1), AfterValidator(each_once)]
"""One name or a list of them."""

Places = Annotated[tuple[Name, ...], BeforeValidator(_places), AfterValidator(each_once)]
"""Names of conditions, or helix angles as numbers."""


class Reference(Table):
    """One ``[[reference]]``: a number of another source beside the model's.

    Parameters
    ----------
    quantity : str
    condition : tuple of str
        In the file a name, or a list where the source leaves open which of some it is: the nearest one then counts.
    helix_angle_deg : float or None
        Instead of a condition: of the helix sweep.
    value : float
        In the unit of the quantity.
    kind : {"model", "measured"}
        Whether another model gave the number, or a measurement.
    tolerance : float or None
        In dB (degrees of a direction). Default `tolerated`.
    origin : str
    """

    quantity: Quantity
    condition: Names | None = None
    helix_angle_deg: float | None = None
    value: float
    kind: Literal["model", "measured"] = "model"
    tolerance: Annotated[float, Field(ge=0.0)] | None = None
    origin: Text

    @property
    def tolerated(self) -> float:
        """The tolerance, where the file gives none the usual one: 1 dB, 22.5°."""
        usual = _TOLERANCE["toward"] if self.quantity == "loudest_deg" else _NEAR_DB
        return usual if self.tolerance is None else self.tolerance

    @model_validator(mode="after")
    def _consistent(self) -> Reference:
        if (self.condition is None) == (self.helix_angle_deg is None):
            raise ValueError("one of condition and helix_angle_deg must be given, and not both")
        if self.quantity == "pattern":
            raise ValueError("quantity 'pattern' has no value to refer to; [[feature]] compares patterns")
        if self.quantity.endswith(("_um", "_n", "_hz")) and self.value <= 0.0:
            raise ValueError(f"value must be > 0 for {self.quantity}, got {self.value:g}")
        return self


class Feature(Table):
    """One ``[[feature]]``: what another source says of the shape of a series of values.

    Parameters
    ----------
    name : str
        Unique; default made of quantity, shape and what it goes over.
    quantity : str
    over : {"conditions", "helix"}
    shape : str
        ``rises``, ``falls``, ``rises_then_falls``, ``flat_or_rises_then_falls``, ``flat``; ``highest_at`` and
        ``lowest_at`` one of `at`; ``span``: from least to most, `value`; ``above`` each of `than` everywhere;
        ``toward`` the direction `value` in degrees everywhere; ``alike``: patterns that correlate by `value` at least.
    at : tuple of str
        Conditions, or helix angles in degrees.
    than : tuple of str
        Quantities that `quantity` is above of.
    value : float or None
    tolerance : float or None
        In dB (degrees for ``toward``). Default `tolerated`.
    origin : str
    """

    name: Name = ""
    quantity: Quantity
    over: Over = "conditions"
    shape: Shape
    at: Places = ()
    than: Annotated[tuple[Quantity, ...], AfterValidator(each_once)] = ()
    value: float | None = None
    tolerance: Annotated[float, Field(ge=0.0)] | None = None
    origin: Text

    @property
    def tolerated(self) -> float:
        """The tolerance, where the file gives none the usual one: 0.5 dB of a shape, 2 dB of a span, 22.5°."""
        return _TOLERANCE.get(self.shape, FLAT_DB) if self.tolerance is None else self.tolerance

    @property
    def label(self) -> str:
        """Its name, or one made of what it says."""
        where = "over the conditions" if self.over == "conditions" else "over the helix angles"
        return self.name or f"{self.quantity} {self.shape.replace('_', ' ')} {where}"

    @model_validator(mode="after")
    def _consistent(self) -> Feature:
        needs = {"at": NEEDS_AT, "value": NEEDS_VALUE, "than": ("above",)}
        given = {key for key in needs if getattr(self, key) not in ((), None)}
        wanted = {key for key, shapes in needs.items() if self.shape in shapes}
        wrong = {"needs": wanted - given, "has no use for": given - wanted}
        told = [f"{verb} {' and '.join(key for key in needs if key in keys)}" for verb, keys in wrong.items() if keys]
        if told:
            raise ValueError(f"shape = {self.shape!r} {' and '.join(told)}")
        if self.shape == "span" and self.value is not None and self.value <= 0.0:
            raise ValueError(f"value must be > 0 for shape = 'span', got {self.value:g}")
        if (self.quantity == "pattern") != (self.shape == "alike"):
            raise ValueError("quantity 'pattern' and shape 'alike' go together")
        if (self.quantity == "loudest_deg") != (self.shape == "toward"):
            raise ValueError("quantity 'loudest_deg' and shape 'toward' go together")
        if self.shape == "alike" and not (self.value is not None and -1.0 <= self.value <= 1.0):
            raise ValueError(f"value must be from -1 to 1 for shape = 'alike', got {self.value}")
        kinds = {_kind_of(name) for name in (self.quantity, *self.than)}
        if len(kinds) > 1 or {"pattern", "loudest_deg"} & set(self.than):
            raise ValueError("than must name quantities of one kind with quantity")
        return self


def _kind_of(quantity: str) -> str:
    return quantity.rpartition("_")[2]

"""``[[channel]]``: what was measured where, under which name."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from tdacoustic.campaign.railway import Place, place_problem
from tdacoustic.campaign.scale import Scale, full_scale_of
from tdacoustic.toml_models import Name, NonNegative, Positive, Table, Text
from tdacoustic.units import parse_sensitivity, parse_unit

__all__ = ["CampaignChannel", "Component", "Quantity", "Role"]

Component = Literal["motor", "gearbox", "wheelset", "bogie", "body", "air", "shaft"]
"""Where a sensor sits."""

Role = Literal["receiver", "near_field", "reference"]
"""What a microphone is for."""

Quantity = Literal[
    "acceleration",
    "sound_pressure",
    "speed",
    "torque",
    "current",
    "voltage",
    "force",
    "temperature",
    "tacho",
    "other",
]
"""What a channel measures; the same words as `tdacoustic.units.QUANTITIES`."""

_MICROPHONES_ROLES: Final = ("receiver", "near_field")


def _source(value: Any) -> str | int:
    if isinstance(value, str) and value.strip():
        return value
    if isinstance(value, int) and not isinstance(value, bool) and value >= 1:
        return value
    raise ValueError(f"must be the name in the log or its index from 1, got {value!r}")


def _unit(text: str) -> str:
    parse_unit(text)
    return text


def _sensitivity(text: str) -> str:
    parse_sensitivity(text)
    return text


def _full_scale(text: str) -> str:
    full_scale_of(text)
    return text


class CampaignChannel(Table):
    """One ``[[channel]]``.

    Parameters
    ----------
    name : str
        Unique; the name in every table.
    source : str or int
        Name in the log, or index from 1. Default: the name.
    log : int or None
        Which log of a run, from 1; needed only where the source is in more than one.
    component : str or None
        One of `Component`. Default: ``"air"`` for a sound pressure.
    drive : str
        Which drive (axle) of the vehicle.
    role : str or None
        One of `Role`; a receiver or near-field channel is a sound pressure.
    quantity : str or None
        One of `Quantity`. Default: what sensitivity, full scale or unit imply, else what the log says.
    unit : str or None
        Default: what the log says.
    sensitivity : str or None
        As ``"10.2 mV/(m/s^2)"``, for electrical signals.
    full_scale : str or None
        As ``"20 Pa"``, for numbers that are fractions of a full scale.
    sensor : str or None
        Serial number in the campaign's sensor database, which then gives the sensitivity.
    direction : str or None
        As ``"z"``.
    position_m : (float, float, float) or None
        In the drive's frame: x along travel, y to the left, z up, origin at the drive's centre.
    distance_m : float or None
        Of a microphone from the drive's centre.
    height_above_rail_m : float or None
    side : str or None
    place : str or None
        Where a microphone is, for the railway standards: ``"wayside"``, ``"vehicle"`` or ``"interior"``. Of a wayside
        one `distance_m` counts from the track's centreline, along which the drive's centre passes.
    height_above_floor_m : float or None
        Of a microphone inside.
    stands_for_m : float or None
        Length of a standing unit that a wayside microphone stands for.
    shaft : str or None
        ``"motor"`` or ``"wheelset"``, of a speed or a tacho.
    pulses_per_rev : float or None
        Of a tacho, which needs it. Without `quantity` it makes the channel a tacho.
    """

    name: Name
    source: Annotated[str | int, BeforeValidator(_source)] = ""
    log: Annotated[int, Field(ge=1)] | None = None
    component: Component | None = None
    drive: Name = "1"
    role: Role | None = None
    quantity: Quantity | None = None
    unit: Annotated[Text, AfterValidator(_unit)] | None = None
    sensitivity: Annotated[str, AfterValidator(_sensitivity)] | None = None
    full_scale: Annotated[str, AfterValidator(_full_scale)] | None = None
    sensor: Text | None = None
    direction: Text | None = None
    position_m: tuple[float, float, float] | None = None
    distance_m: NonNegative | None = None
    height_above_rail_m: float | None = None
    side: Text | None = None
    place: Place | None = None
    height_above_floor_m: NonNegative | None = None
    stands_for_m: Positive | None = None
    shaft: Literal["motor", "wheelset"] | None = None
    pulses_per_rev: Positive | None = None

    @property
    def scale(self) -> Scale:
        """What the channel's numbers mean, as far as the campaign says."""
        quantity: str | None = self.quantity
        if quantity is None and self.role in _MICROPHONES_ROLES:
            quantity = "sound_pressure"
        if quantity is None and self.pulses_per_rev is not None:
            quantity = "tacho"
        return Scale(quantity, self.unit, self.sensitivity, self.full_scale)

    @model_validator(mode="after")
    def _complete(self) -> CampaignChannel:
        if self.source == "":
            object.__setattr__(self, "source", self.name)  # frozen only from here on
        if self.quantity == "tacho" and self.pulses_per_rev is None:
            raise ValueError("a tacho needs pulses_per_rev, which is missing")
        if self.pulses_per_rev is not None and self.quantity not in (None, "tacho", "speed"):
            raise ValueError(
                f"pulses_per_rev = {self.pulses_per_rev:g} is of a tacho, but quantity is {self.quantity!r}"
            )
        if self.shaft is not None and self.quantity not in (None, "tacho", "speed"):
            raise ValueError(f"shaft = {self.shaft!r} is of a speed or tacho, but quantity is {self.quantity!r}")
        if self.role in _MICROPHONES_ROLES and self.quantity not in (None, "sound_pressure"):
            raise ValueError(f"role {self.role!r} is of a microphone, but quantity is {self.quantity!r}")
        scale = self.scale
        scale.check()
        misplaced = place_problem(self, scale.stated_quantity())
        if misplaced is not None:
            raise ValueError(misplaced)
        if self.component is None and scale.stated_quantity() == "sound_pressure":
            object.__setattr__(self, "component", "air")
        return self

"""The recipe of a synthetic campaign: what `synthesis.toml` may say, checked.

Every dimensional key carries its unit. Levels are re 20 uPa (sound pressure) and
re 1 um/s² (acceleration), densities in the same decibels per hertz.
"""

from __future__ import annotations

import datetime
import itertools
from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, field_validator, model_validator

__all__ = [
    "REFERENCES",
    "SCHEMA",
    "BackgroundRecipe",
    "ChannelRecipe",
    "ConditionRecipe",
    "GearPair",
    "Hump",
    "Kinematics",
    "LineRecipe",
    "PathRecipe",
    "Recipe",
]

SCHEMA: Final = "tdacoustic-synthesis/1"

REFERENCES: Final = {"acceleration": 1e-6, "sound_pressure": 20e-6}
"""References of levels: m/s² and Pa (ISO 1683)."""

_UNITS: Final = {"acceleration": "m/s^2", "sound_pressure": "Pa", "speed": "rpm", "tacho": "V"}

Name = Annotated[str, StringConstraints(pattern=r"^[^\W_][\w .#/()\-]*$", max_length=64)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Component = Literal["motor", "gearbox", "wheelset", "bogie", "body", "air", "shaft"]
Targets = dict[str, Finite]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)


class GearPair(_Strict):
    """One gear pair; several stand in series, from the motor to the wheelset."""

    name: Name = "1"
    teeth: tuple[Annotated[int, Field(ge=5)], Annotated[int, Field(ge=5)]]


class Kinematics(_Strict):
    """What ties the motor's speed to the train's.

    `speed_wander` is the relative rms of a slow random variation of speed, band-limited to
    `wander_bandwidth_hz`. `mesh_excess` is by how much the shafts, and so the mesh, run ahead of what the train's speed
    and the wheel's diameter give (creep, a worn wheel, a wrong speed reading: the cause is not modelled).
    """

    wheel_diameter_mm: Positive
    gear_pair: Annotated[list[GearPair], Field(min_length=1)]
    speed_wander: Annotated[float, Field(ge=0, le=0.02)] = 0.0
    wander_bandwidth_hz: Positive = 0.5
    mesh_excess: Annotated[float, Field(ge=-0.05, le=0.05)] = 0.0

    @property
    def ratio(self) -> float:
        """Motor revolutions per wheel revolution."""
        ratio = 1.0
        for pair in self.gear_pair:
            ratio *= pair.teeth[1] / pair.teeth[0]
        return ratio


class Hump(_Strict):
    """A resonance on a floor: a Lorentzian of half-power width `width_hz`, `height_db` over the floor at its top."""

    frequency_hz: Positive
    width_hz: Positive
    height_db: Annotated[float, Field(gt=0, le=80)]


class Resonance(_Strict):
    """A resonance that all of a channel passes: a filter of one degree of freedom.

    It is 0 dB far away and `height_db` at its top; `width_hz` is the half-power width of the part above 1.
    """

    frequency_hz: Positive
    width_hz: Positive
    height_db: Annotated[float, Field(gt=0, le=60)]


class Slip(_Strict):
    """A loss of adhesion: the shafts run ahead by up to `peak` of their speed, or fall behind where it is negative."""

    from_s: Annotated[float, Field(ge=0)]
    to_s: Positive
    peak: Annotated[float, Field(gt=-0.9, le=2.0)]

    @model_validator(mode="after")
    def _rises(self) -> Slip:
        if self.to_s <= self.from_s:
            raise ValueError(f"to_s must lie after from_s, got {self.from_s:g} and {self.to_s:g}")
        return self


class ChannelRecipe(_Strict):
    """One channel of the logs.

    `floor` is the channel's own broadband: points (Hz, dB re the quantity's reference, per Hz), straight lines between
    them over log frequency, the end values beyond. `gain_db` is what this sensor reads above all that the recipe says
    (a livelier spot). `resonance` shapes all that the channel holds, and what paths lead on from it where the channel
    is its component's first. A speed channel tells the turns of its shaft in rpm, or with ``shaft = "train"`` the
    train's speed in km/h, without any slip. `bits` overrides the campaign's.
    """

    name: Name
    quantity: Literal["acceleration", "sound_pressure", "speed", "tacho"]
    component: Component
    unit: str | None = None
    role: Literal["receiver", "near_field", "reference"] | None = None
    drive: str | None = None
    direction: str | None = None
    position_m: tuple[Finite, Finite, Finite] | None = None
    distance_m: Positive | None = None
    height_above_rail_m: Finite | None = None
    side: Literal["left", "right"] | None = None
    bits: Annotated[int, Field(ge=4, le=31)] | None = None
    gain_db: Finite = 0.0
    floor: list[tuple[Positive, Finite]] = []
    hump: list[Hump] = []
    resonance: list[Resonance] = []
    shaft: Literal["motor", "wheelset", "train"] = "motor"
    pulses_per_rev: Annotated[int, Field(ge=1)] | None = None
    pulse_height_v: Positive = 5.0
    pulse_rise_s: Positive | None = None
    pulse_duty: Annotated[float, Field(gt=0.05, lt=0.95)] = 0.5
    missing_pulses: Annotated[int, Field(ge=0)] = 0
    double_pulses: Annotated[int, Field(ge=0)] = 0
    decimation: Annotated[int, Field(ge=1)] = 1

    @property
    def is_signal(self) -> bool:
        """Whether the channel carries vibration or sound (and not a speed)."""
        return self.quantity in REFERENCES

    @property
    def reference(self) -> float:
        """Reference of the channel's levels in its SI unit."""
        return REFERENCES[self.quantity]

    @property
    def stored_unit(self) -> str:
        """Unit that the log states."""
        return "km/h" if self.quantity == "speed" and self.shaft == "train" else _UNITS[self.quantity]

    @model_validator(mode="after")
    def _fits_its_quantity(self) -> ChannelRecipe:
        if self.unit is not None and self.unit != self.stored_unit:
            raise ValueError(f"unit of a {self.quantity} channel must be {self.stored_unit!r}, got {self.unit!r}")
        if self.is_signal and not self.floor:
            raise ValueError("floor is missing: points [[Hz, dB per Hz], ...]")
        frequencies = [point[0] for point in self.floor]
        if any(after <= before for before, after in itertools.pairwise(frequencies)):
            raise ValueError(f"the frequencies of floor must rise, got {frequencies}")
        if not self.is_signal and (self.floor or self.hump or self.resonance or self.gain_db):
            raise ValueError(
                f"floor, hump, resonance and gain_db are for vibration and sound, not for a {self.quantity} channel"
            )
        if self.shaft == "train" and self.quantity != "speed":
            raise ValueError(f"shaft = 'train' is of a speed channel, not of a {self.quantity} channel")
        if self.quantity == "tacho" and self.pulses_per_rev is None:
            raise ValueError("pulses_per_rev is missing")
        if self.decimation != 1 and self.quantity != "speed":
            raise ValueError("decimation is for speed channels only")
        return self


class LineRecipe(_Strict):
    """One spectral line: what its frequency follows, who owns it, and how strong it is where.

    Its frequency is the sum of what is given: ``frequency_hz`` + ``carrier`` x the condition's ``carrier_hz`` +
    ``order`` x the shaft's turns + ``mesh`` x the mesh frequency of `gear_pair`. The first two stand still, the others
    follow the shafts through every wander.

    `level_db` is the line's rms level, `prominence_db` its level over the channel's own floor in one
    ``prominence_bandwidth_hz``. Either is one number (for all channels of the source's component; for any other source
    all microphones) or a table of channels, roles or components. Channels that are not named get the line by the
    recipe's paths alone.
    """

    source: Literal["motor", "gearbox", "wheelset", "bogie", "body", "air", "shaft", "other", "mains", "decoy"]
    name: Name | None = None
    frequency_hz: Finite | None = None
    carrier: Finite | None = None
    order: Finite | None = None
    shaft: Literal["motor", "wheelset"] = "motor"
    mesh: Annotated[int, Field(ge=1)] | None = None
    gear_pair: str | None = None
    level_db: Finite | Targets | None = None
    prominence_db: Finite | Targets | None = None
    phase_deg: Finite | None = None

    @model_validator(mode="after")
    def _is_complete(self) -> LineRecipe:
        if self.frequency_hz is None and self.carrier is None and self.order is None and self.mesh is None:
            raise ValueError("one of frequency_hz, carrier, order and mesh must be given")
        if (self.level_db is None) == (self.prominence_db is None):
            raise ValueError("exactly one of level_db and prominence_db must be given")
        return self


class PathRecipe(_Strict):
    """A way by which one component's vibration reaches other channels: cross-talk, or radiation to a microphone.

    `gain_db` is the level in the channel minus the level in the component's first channel, each re its own reference;
    `broadband_gain_db` the same for that channel's broadband (left out: only lines pass). The coherence at one
    frequency between both ends is `coherence` (magnitude squared, of what passes); the rest is independent, for lines a
    slow random variation within `coherence_bandwidth_hz`. `delay_s` turns the phase; each line is turned by a random
    angle of its own too, unless ``phase = "path"``: then lines and broadband take one and the same linear path, as long
    as both gains are equal.
    """

    source: Component = Field(alias="from")
    to: str
    gain_db: Finite
    broadband_gain_db: Finite | None = None
    delay_s: Annotated[float, Field(ge=0, le=1)] = 0.0
    phase: Literal["line", "path"] = "line"
    coherence: Annotated[float, Field(ge=0, le=1)] = 1.0
    coherence_bandwidth_hz: Positive = 0.5


class ConditionRecipe(_Strict):
    """One operating condition: its speed, its lines, its levels.

    With `train_speed_end_km_h` the speed runs from one to the other over the run. `level_db` prescribes the overall
    unweighted level of channels within ``level_band_hz``: the broadband is scaled to it, or, where `line_fraction`
    is given too, the lines to that part of the energy and the broadband to the rest. `floor_gain_db` shifts floors.
    `slip` lets the shafts run ahead of the train for a while.
    """

    name: Name
    train_speed_km_h: Annotated[float, Field(ge=0)]
    train_speed_end_km_h: Positive | None = None
    speed_profile: Literal["linear", "smooth"] = "linear"
    slip: list[Slip] = []
    duration_s: Positive | None = None
    mesh_excess: Annotated[float, Field(ge=-0.05, le=0.05)] | None = None
    carrier_hz: Positive | None = None
    mode: Literal["traction", "brake", "coast", "hauled"] | None = None
    torque_n_m: Finite | None = None
    runs: Annotated[int, Field(ge=1, le=999)] = 1
    repeat_sigma_db: Annotated[float, Field(ge=0, le=10)] = 0.0
    floor_gain_db: Targets = {}
    level_db: Targets = {}
    line_fraction: dict[str, Annotated[float, Field(gt=0, lt=1)]] = {}
    line: list[LineRecipe] = []

    @property
    def is_run_up(self) -> bool:
        """Whether the speed is meant to change."""
        return self.train_speed_end_km_h is not None and self.train_speed_end_km_h != self.train_speed_km_h


class BackgroundRecipe(_Strict):
    """A run with the drive at rest: floors lowered by `floor_gain_db`, the mains' and its own lines only."""

    name: Name = "background"
    duration_s: Positive | None = None
    floor_gain_db: Targets | Finite = -12.0
    line: list[LineRecipe] = []


class Recipe(_Strict):
    """A whole synthetic campaign."""

    schema_: Literal["tdacoustic-synthesis/1"] = Field(alias="schema")
    name: Annotated[str, StringConstraints(min_length=1)]
    seed: Annotated[int, Field(ge=0)] = 0
    sample_rate_hz: Positive
    duration_s: Positive
    bits: Annotated[int, Field(ge=4, le=31)] = 16
    format: Literal["hdf5"] = "hdf5"
    start_time: datetime.datetime | None = None
    fleet: str | None = None
    level_band_hz: tuple[Positive, Positive] | None = None
    prominence_bandwidth_hz: Positive = 1.5
    meta: dict[str, Any] = {}
    analysis: dict[str, Any] = {}
    kinematics: Kinematics
    channel: Annotated[list[ChannelRecipe], Field(min_length=1)]
    path: list[PathRecipe] = []
    line: list[LineRecipe] = []
    condition: Annotated[list[ConditionRecipe], Field(min_length=1)]
    background: BackgroundRecipe | None = None

    @field_validator("level_band_hz")
    @classmethod
    def _band_rises(cls, band: tuple[float, float] | None) -> tuple[float, float] | None:
        if band is not None and band[1] <= band[0]:
            raise ValueError(f"level_band_hz must rise, got {list(band)}")
        return band

    @property
    def band_hz(self) -> tuple[float, float]:
        """Band of the prescribed overall levels: from the recipe, else 20 Hz to 0.4 of the rate."""
        return self.level_band_hz or (20.0, 0.4 * self.sample_rate_hz)

    @property
    def signal_channels(self) -> list[ChannelRecipe]:
        """Channels of vibration and sound."""
        return [channel for channel in self.channel if channel.is_signal]

    def targets(self, key: str) -> list[ChannelRecipe]:
        """Channels of vibration or sound that a channel's name, a role or a component means; empty where none."""
        by_name = [channel for channel in self.signal_channels if channel.name == key]
        by_role = [channel for channel in self.signal_channels if channel.role == key]
        return by_name or by_role or [channel for channel in self.signal_channels if channel.component == key]

    def per_channel(self, table: dict[str, float]) -> dict[str, float]:
        """Spread a table of targets over channels; a channel's name outranks its role, a role its component."""

        def rank(key: str) -> int:
            if any(channel.name == key for channel in self.signal_channels):
                return 2
            return 1 if any(channel.role == key for channel in self.signal_channels) else 0

        spread: dict[str, float] = {}
        for key in sorted(table, key=rank):
            spread.update({channel.name: table[key] for channel in self.targets(key)})
        return spread

    def channel_levels(self, line: LineRecipe) -> dict[str, float]:
        """`level_db` or `prominence_db` of a line as a number per channel."""
        value = line.level_db if line.level_db is not None else line.prominence_db
        if isinstance(value, dict):
            return self.per_channel(value)
        assert value is not None
        own = self.targets(line.source) if line.source != "other" else []
        channels = own or [channel for channel in self.signal_channels if channel.quantity == "sound_pressure"]
        return {channel.name: value for channel in channels}

"""Measured levels, and the model that a fit holds against them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive import Condition, DriveModel, DriveSound, GearUnit, Receiver
from tdacoustic.errors import FittingError
from tdacoustic.fleet import Fleet

__all__ = ["SILENCE_DB", "LevelModel", "MeasuredLevel"]

DYNAMIC = ("train.", "gear_pair.", "gear_dynamics.", "operation.", "model.gear_pair")
"""Parameters that change the motion of the gears; of others only the sound is computed anew."""

SILENCE_DB = -200.0

Motion: TypeAlias = tuple[float, float]
"""Peak-to-peak transmission error and static compression in m: all that the meshing noise depends on."""


@dataclass(frozen=True)
class MeasuredLevel:
    """A level that the model is held against.

    Parameters
    ----------
    condition : Condition
    receiver : Receiver
    level_db : float
    sigma_db : float
        One standard deviation of the measurement, above zero.
    weighting : {"Z", "A"}
    origin : {"measured", "synthetic", "printed"}
    source : str
        Where it comes from, in words.
    """

    condition: Condition
    receiver: Receiver
    level_db: float
    sigma_db: float
    weighting: Literal["Z", "A"]
    origin: str
    source: str

    def __post_init__(self) -> None:
        if not (math.isfinite(self.sigma_db) and self.sigma_db > 0.0):
            raise FittingError(
                f"condition {self.condition.name}: the level's standard deviation must be > 0 dB, got {self.sigma_db!r}"
            )
        if not math.isfinite(self.level_db):
            raise FittingError(f"condition {self.condition.name}: the level must be a number, got {self.level_db!r}")


class LevelModel:
    """The levels of a fleet's model at measured places, as a function of some of its parameters.

    What the gears do is kept for parameters that it was computed for, so that those which only change the sound cost
    nothing.

    Parameters
    ----------
    fleet : Fleet
    data : sequence of MeasuredLevel
    """

    def __init__(self, fleet: Fleet, data: Sequence[MeasuredLevel]) -> None:
        self.fleet = fleet
        self.data = tuple(data)
        self.conditions = tuple({d.condition.name: d.condition for d in data}.values())
        self._receivers = {
            name: tuple({d.receiver.name: d.receiver for d in data if d.condition.name == name}.values())
            for name in (condition.name for condition in self.conditions)
        }
        self._motions: dict[tuple[tuple[str, float], ...], tuple[GearUnit, tuple[Motion, ...]]] = {}

    def sounds(self, values: Mapping[str, float]) -> tuple[DriveSound, ...]:
        """Return the drive's sound in each condition, with all contributions, for values of parameters by key."""
        fleet = self.fleet.replaced(values) if values else self.fleet
        unit, motions = self._motion(fleet, values)
        model = DriveModel(fleet, unit)
        return tuple(
            model.sound(condition, model.masuda_db(condition, *motion), self._receivers[condition.name])
            for condition, motion in zip(self.conditions, motions, strict=True)
        )

    def levels_db(self, values: Mapping[str, float]) -> NDArray[np.float64]:
        """Return the total level for each datum, shape (n,); silence is -200 dB."""
        sounds = {sound.condition: sound for sound in self.sounds(values)}
        found = [sounds[d.condition.name].level_db(d.receiver.name, "total", d.weighting) for d in self.data]
        return np.array([SILENCE_DB if level is None else level for level in found])

    def _motion(self, fleet: Fleet, values: Mapping[str, float]) -> tuple[GearUnit, tuple[Motion, ...]]:
        key = tuple(sorted((name, value) for name, value in values.items() if name.startswith(DYNAMIC)))
        if key not in self._motions:
            model = DriveModel(fleet)
            states = [model.motion(condition) for condition in self.conditions]
            motions = tuple((state.dte_pp_m, state.static_compression_m) for state in states)
            self._motions[key] = (model.unit, motions)
        return self._motions[key]

    def without(self, condition: str) -> LevelModel:
        """Return the model of the data of all other conditions; what is known of the gears goes along."""
        left = LevelModel(self.fleet, _others(self.data, condition))
        kept = [index for index, held in enumerate(self.conditions) if held.name != condition]
        left._motions = {
            key: (unit, tuple(states[index] for index in kept)) for key, (unit, states) in self._motions.items()
        }
        return left


def _others(data: Iterable[MeasuredLevel], condition: str) -> list[MeasuredLevel]:
    return [datum for datum in data if datum.condition.name != condition]

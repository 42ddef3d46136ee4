"""The levels of a drive's model as a function of its parameters: what a fit holds against measured ones."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive import (
    Condition,
    DriveModel,
    DriveSound,
    GearUnit,
    HousingSound,
    Receiver,
    SoundSource,
)
from tdacoustic.drive.conditions import followed
from tdacoustic.drive.levels import Path, paths_of_total
from tdacoustic.errors import FittingError, TdacousticError
from tdacoustic.fitting.measured_level import OFFSET, MeasuredLevel, offset_name
from tdacoustic.fitting.parameters import FreeParameter
from tdacoustic.fitting.response import Response, response_of
from tdacoustic.fleet import Fleet
from tdacoustic.gears import BearingForces, bearing_forces
from tdacoustic.radiation import overall_level_db

__all__ = ["SILENCE_DB", "LevelModel"]

Real = NDArray[np.float64]

DYNAMIC: Final = ("train.", "gear_pair.", "gear_dynamics.", "operation.")
"""Parameters that change the motion of the gears."""

OF_FOUNDATION: Final = ("housing.",)
"""Parameters that change it too where gears and housing are coupled both ways."""

OF_MOTOR: Final = ("motor.",)
"""Parameters that change nothing at the gears but what the motor radiates."""

OF_GEARS: Final = ("gear_dynamics.", "masuda.", "housing.")
"""Parameters that change nothing of the motor."""

GAINS: Final[Mapping[str, Path]] = {
    "masuda.constant_db": "mesh",
    "model.structure_gain_db": "structure",
    "model.motor_gain_db": "motor",
}
"""Parameters that add to the level of a path as they stand: nothing is computed anew for them."""

SILENCE_DB: Final = -200.0

Motion: TypeAlias = tuple[float, float, BearingForces | None]
"""Peak-to-peak transmission error and static compression in m, all that the meshing noise depends on; the forces where
the total adds what the housing makes of them."""

Values: TypeAlias = Mapping[str, float]
Key: TypeAlias = tuple[tuple[str, float], ...]


@dataclass
class _Computed:
    """What is known already, shared by models of other levels at the same places."""

    motions: dict[Key, tuple[GearUnit, tuple[Motion, ...]]] = field(default_factory=dict)
    parts: dict[tuple[str, Key], Real] = field(default_factory=dict)
    responses: dict[tuple[FreeParameter, ...], Response | None] = field(default_factory=dict)
    failures: list[str] = field(default_factory=list)


class LevelModel:
    """The levels of a fleet's model at measured places, as a function of some of its parameters.

    What the gears do is kept for parameters that it was computed for, so that those which only change the sound cost
    nothing. `prepare` interpolates over one or two parameters of the gears. Values for which the model cannot be
    computed give NaN, and `failures` says why.

    Parameters
    ----------
    fleet : Fleet
    data : sequence of MeasuredLevel
        Speed or torque of a condition that are those of the fleet's kinematics or torque law follow these.
    housing : HousingSound, optional
        The housing's transfer vectors, with all receivers of the data, where the fleet's method needs them.
    """

    def __init__(self, fleet: Fleet, data: Sequence[MeasuredLevel], housing: HousingSound | None = None) -> None:
        self.fleet = fleet
        self.housing = housing
        self.data = tuple(data)
        self.conditions = tuple(dict.fromkeys(datum.condition for datum in data))
        self._places = tuple(datum.place for datum in data)
        self._computed = _Computed()
        self._response: Response | None = None
        self._with_forces = "structure" in paths_of_total(fleet)
        self._gains = {key: float(fleet.get(key).value) for key in GAINS}

    def with_data(self, data: Sequence[MeasuredLevel]) -> LevelModel:
        """Return the model of other levels at the same places; everything computed is shared.

        Raises
        ------
        FittingError
            The places are others.
        """
        if tuple(datum.place for datum in data) != self._places:
            raise FittingError("levels of other conditions or receivers need a model of their own")
        made = LevelModel(self.fleet, data, self.housing)
        made._computed, made._response = self._computed, self._response
        return made

    @property
    def failures(self) -> tuple[str, ...]:
        """Why the model could not be computed somewhere, one line a place."""
        return tuple(self._computed.failures)

    def levels_db(self, values: Values, exact: bool = False) -> Real:
        """Return the total level for each datum, shape (n,); silence is -200 dB, NaN what cannot be computed.

        Parameters
        ----------
        values : mapping of str to float
            By key of the fleet; a `level_offset_db` of a campaign; other names without a dot are not looked at.
        exact : bool
            Whether the gears are to be computed where `prepare` would interpolate.
        """
        of_fleet, levels, gain = self._paths(values, exact)
        total = 10.0 * np.log10(sum(10.0 ** (0.1 * (level + gain[path])) for path, level in levels.items()))
        if len(of_fleet) < len(values):
            total = total + np.array([values.get(offset_name(datum.campaign), 0.0) for datum in self.data])
        return np.where(np.max(list(levels.values()), axis=0) <= SILENCE_DB, SILENCE_DB, total)

    def paths_db(self, values: Values, exact: bool = False) -> dict[Path, Real]:
        """Return the level of each path for each datum, shape (n,): minus infinity of one that the total does not add.

        Silence is minus infinity too, NaN what cannot be computed.

        Parameters
        ----------
        values, exact
            As of `levels_db`; offsets of campaigns are none of the drive.
        """
        _, levels, gain = self._paths(values, exact)
        return {path: np.where(level <= SILENCE_DB, -math.inf, level + gain[path]) for path, level in levels.items()}

    def _paths(self, values: Values, exact: bool) -> tuple[dict[str, float], dict[Path, Real], dict[Path, float]]:
        """Values of the fleet, levels of the paths with the fleet's own gains, and what the values add to these."""
        of_fleet = {name: value for name, value in values.items() if "." in name and not name.startswith(OFFSET)}
        gain = {part: values.get(key, self._gains[key]) - self._gains[key] for key, part in GAINS.items()}
        mesh, structure = np.split(self._gears_db(of_fleet, exact), 2)
        return of_fleet, {"motor": self._part("motor", of_fleet), "mesh": mesh, "structure": structure}, gain

    def sounds(self, values: Values) -> tuple[DriveSound, ...]:
        """Return the drive's sound in each condition, with all contributions, for values of parameters by key."""
        fleet = self._fleet(values)
        unit, motions = self._motion(fleet, values)
        model = DriveModel(fleet, unit, self.housing)
        held = zip(self.conditions, self._conditions(fleet, values), motions, strict=True)
        return tuple(
            model.sound(
                condition,
                model.masuda_db(condition, dte_m, static_m),
                self._receivers(known),
                model.gears(condition).forces if forces is None else forces,
            )
            for known, condition, (dte_m, static_m, forces) in held
        )

    def prepare(self, free: Sequence[FreeParameter]) -> float | None:
        """Interpolate over the parameters of the gears among those that a fit moves, where there are one or two.

        Parameters
        ----------
        free : sequence of FreeParameter

        Returns
        -------
        float or None
            Largest difference at checked places in dB; None where nothing is interpolated.
        """
        of_gears = tuple(p for p in free if "." in p.name and p.name not in GAINS and not p.name.startswith(OF_MOTOR))
        of_gears = tuple(p for p in of_gears if not p.name.startswith(("model.", OFFSET)))
        bounded = all(p.is_moved and math.isfinite(p.inner(p.low)) and math.isfinite(p.inner(p.high)) for p in of_gears)
        self._response = None
        if not bounded or not 1 <= len(of_gears) <= 2:
            return None
        plain = tuple(replace(p, initial=p.low, prior=None) for p in of_gears)
        known = self._computed.responses
        if plain not in known:
            known[plain] = response_of(lambda values: self._part("gears", values), plain)
        self._response = known[plain]
        return None if self._response is None else self._response.error_db

    def _gears_db(self, values: Values, exact: bool) -> Real:
        if self._response is not None and not exact:
            found = self._response(values)
            if found is not None:
                return found
        return self._part("gears", values)

    def _part(self, part: Literal["motor", "gears"], values: Values) -> Real:
        """Return the level of the motor, or of mesh and structure one after the other, with the fleet's own gains."""
        others = ("model.", *(OF_GEARS if part == "motor" else OF_MOTOR))
        kept = {name: value for name, value in values.items() if name not in GAINS and not name.startswith(others)}
        key = (part, tuple(sorted(kept.items())))
        found = self._computed.parts.get(key)
        if found is None:
            try:
                found = self._heard(part, kept)
            except TdacousticError as error:
                if not kept:
                    raise
                self._computed.failures.append(str(error).removeprefix(f"{self.fleet.path}: "))
                found = np.full(len(self.data) * (1 if part == "motor" else 2), math.nan)
            found.flags.writeable = False
            self._computed.parts[key] = found
        return found

    def _heard(self, part: Literal["motor", "gears"], values: Values) -> Real:
        fleet = self._fleet(values)
        conditions = self._conditions(fleet, values)
        if part == "motor":
            of_gears = any(name.startswith(DYNAMIC) for name in values)
            model = DriveModel(fleet, None if of_gears else self._motion(self.fleet, {})[0], self.housing)
            return self._at_data(model, [model.motor_sources(condition) for condition in conditions])
        unit, motions = self._motion(fleet, values)
        model = DriveModel(fleet, unit, self.housing)
        mesh, structure = [], []
        for condition, (dte_m, static_m, forces) in zip(conditions, motions, strict=True):
            mesh.append(model.gear_sources(condition, model.masuda_db(condition, dte_m, static_m)))
            structure.append(model.field.structure_sources(forces))
        return np.concatenate([self._at_data(model, mesh), self._at_data(model, structure)])

    def _at_data(self, model: DriveModel, of_conditions: Sequence[Sequence[SoundSource]]) -> Real:
        """Return the level of the conditions' sources for each datum."""
        sources = dict(zip(self.conditions, of_conditions, strict=True))
        return np.array([_level_db(model, sources[datum.condition], datum) for datum in self.data])

    def _fleet(self, values: Values) -> Fleet:
        of_fleet = {name: value for name, value in values.items() if "." in name and not name.startswith(OFFSET)}
        return self.fleet.replaced(of_fleet) if of_fleet else self.fleet

    def _conditions(self, fleet: Fleet, values: Values) -> tuple[Condition, ...]:
        """The conditions with the speed and torque that a changed fleet gives them, where it gave them before."""
        if not any(name.startswith(("train.", "operation.", "gear_pair.")) for name in values):
            return self.conditions
        return tuple(followed(condition, self.fleet, fleet) for condition in self.conditions)

    def _receivers(self, condition: Condition) -> tuple[Receiver, ...]:
        return tuple(dict.fromkeys(datum.receiver for datum in self.data if datum.condition == condition))

    def _motion(self, fleet: Fleet, values: Values) -> tuple[GearUnit, tuple[Motion, ...]]:
        dynamic = (*DYNAMIC, *OF_FOUNDATION) if self.fleet.model.coupling.value == "two_way" else DYNAMIC
        key = tuple(sorted((name, value) for name, value in values.items() if name.startswith(dynamic)))
        known = self._computed.motions
        if key not in known:
            model = DriveModel(fleet, None, self.housing)
            states = [model.motion(condition) for condition in self._conditions(fleet, values)]
            forces = [bearing_forces(model.unit.system, state) if self._with_forces else None for state in states]
            held = zip(states, forces, strict=True)
            known[key] = model.unit, tuple((s.dte_pp_m, s.static_compression_m, of) for s, of in held)
        return known[key]


def _level_db(model: DriveModel, sources: Sequence[SoundSource], datum: MeasuredLevel) -> float:
    heard = [source for source in sources if source.path in model.field.adds and datum.hears(source.frequency_hz)]
    level = overall_level_db(model.field.received_db(heard, datum.receiver, datum.weighting))
    return SILENCE_DB if level is None else level

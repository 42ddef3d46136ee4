"""What a fleet's model gives in each condition and at each helix angle, as one row of numbers a case."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive import (
    Condition,
    DriveModel,
    GearState,
    GearUnit,
    HousingSound,
    Receiver,
    StructureSource,
    gear_unit_of,
)
from tdacoustic.drive.levels import CIRCLE_DEG
from tdacoustic.drive.patterns import FLAT_DB, least_alike, range_db
from tdacoustic.drive.sources import SoundSource
from tdacoustic.errors import FleetError
from tdacoustic.fleet import Fleet
from tdacoustic.fleet.studies import Quantity
from tdacoustic.gears import DIRECTIONS, GEARS, SteadyState, balanced_state
from tdacoustic.radiation import overall_level_db
from tdacoustic.studies.changed_fleet import conditions_under, housing_signature, reseated

__all__ = ["QUANTITIES", "Case", "CaseModel", "CaseValues"]

Real = NDArray[np.float64]

QUANTITIES: Final[tuple[str, ...]] = tuple(name for name in get_args(Quantity) if name != "pattern")
"""Columns of `CaseValues`, in the unit that each names."""

_COLUMN: Final = {name: place for place, name in enumerate(QUANTITIES)}
_PATHS: Final = ("structure", "mesh", "motor")
_OF_POINT_SOURCES: Final = ("radiation", "train", "housing", "masuda.placement", "masuda.position_m")
"""What it may depend on how a point source of some frequency and place is heard."""

_MOST_MOTIONS: Final = 1000
"""Motions of changed fleets that are kept, 60 kB each."""


@dataclass(frozen=True)
class Case:
    """A condition, or a helix angle at the fastest one.

    Parameters
    ----------
    over : {"conditions", "helix"}
    name : str
        Of the condition; the helix angle in degrees as text.
    value : float
        Train speed in km/h; helix angle in degrees.
    """

    over: Literal["conditions", "helix"]
    name: str
    value: float


@dataclass(frozen=True, eq=False)
class CaseValues:
    """What the model gives in several cases.

    Parameters
    ----------
    cases : tuple of Case
    values : ndarray, shape (cases, quantities)
        By `QUANTITIES`; NaN of what there is not.
    alike : ndarray, shape (2,)
        Lowest correlation of the patterns over the conditions and over the helix angles; see `least_alike`.
    """

    cases: tuple[Case, ...]
    values: Real
    alike: Real


@dataclass(frozen=True)
class _Known:
    """What is known of the fleet as it is, to be taken where a changed one has the same.

    Parameters
    ----------
    motions : dict
        By gears, mesh frequency and torque.
    transfers : dict
        Of point sources by place and frequency.
    """

    motions: dict[object, SteadyState] = field(default_factory=dict)
    transfers: dict[object, Real] = field(default_factory=dict)


class _NotBalanced(FleetError):
    """A motion that the harmonic balance does not find."""


class _Model(DriveModel):
    """A drive model that takes what it can from what is known.

    Parameters
    ----------
    keep : bool
        Whether what it finds becomes known.
    keep_motions : bool
        Whether its motions become known.
    same_air : bool
        Whether point sources are heard as in the fleet as it is.
    integrate : bool
        Whether motions that the balance does not find are integrated in time.
    """

    def __init__(
        self,
        fleet: Fleet,
        unit: GearUnit,
        housing: HousingSound | None,
        known: _Known,
        keep: bool = False,
        same_air: bool = True,
        integrate: bool = True,
        keep_motions: bool = False,
    ) -> None:
        super().__init__(fleet, unit, housing)
        self._known, self._keep, self._same_air, self._integrate = known, keep, same_air, integrate
        self._keep_motions = keep or keep_motions

    def motion(self, condition: Condition, unit: GearUnit | None = None) -> SteadyState:
        unit = self._moved(unit)
        key = (unit.system, unit.mesh_hz(condition.motor_hz), unit.pinion_torque_n_m(condition.torque_n_m))
        known = {} if unit.system.foundation is not None else self._known.motions  # a housing is no part of the key
        found = known.get(key)
        if found is None:
            found = super().motion(condition, unit) if self._integrate else balanced_state(*key)
            if found is None:
                raise _NotBalanced(f"{self.fleet.path}: condition {condition.name}: the balance finds no stable motion")
            if self._keep_motions and len(known) < _MOST_MOTIONS:
                known[key] = found
        return found

    def state(self, condition: Condition, unit: GearUnit | None = None) -> GearState | None:
        """Return the gears in a condition; None where they would have to be integrated, which is not wanted."""
        try:
            return self.gears(condition, unit)
        except _NotBalanced:
            return None

    def received_db(self, sources: Sequence[SoundSource], receivers: Sequence[Receiver]) -> Real:
        """Return the level of each source at each receiver, shape (sources, receivers)."""
        found = np.empty((len(sources), len(receivers)))
        for row, source in zip(found, sources, strict=True):
            row[:] = source.sound_power_level_db + self._transfer_db(source, receivers)
            if self.fleet.radiation.air_absorption.value:
                row -= self.field.absorbed_db(source, receivers)
        return found

    def _transfer_db(self, source: SoundSource, receivers: Sequence[Receiver]) -> Real:
        if isinstance(source, StructureSource) or not self._same_air:
            return self.field.transfer_db(source, receivers)
        key = (source.path, source.frequency_hz, source.position_m, len(receivers), receivers[0])
        found = self._known.transfers.get(key)
        if found is None:
            found = self.field.transfer_db(source, receivers)
            if self._keep:
                self._known.transfers[key] = found
        return found


class CaseModel:
    """The model of a fleet, to be asked for its values with other parameters again and again.

    Parameters
    ----------
    fleet : Fleet
    housing : HousingSound or None
        Of the fleet; none of point sources.
    conditions : sequence of Condition
        Of the fleet, from its ``[operation]`` or a campaign's.
    helix : bool
        Whether the helix angles of ``[operation]`` are wanted too.
    integrate : bool
        Whether motions of the fleet as it is are integrated in time where the balance finds none.
    keep : bool
        Whether motions of changed fleets are kept: many of a study's points have the same gears.

    Attributes
    ----------
    fleet : Fleet
    base : CaseValues
        With the fleet as it is.

    Raises
    ------
    FleetError
        No such drive can be.
    """

    def __init__(
        self,
        fleet: Fleet,
        housing: HousingSound | None,
        conditions: Sequence[Condition],
        helix: bool = True,
        integrate: bool = True,
        keep: bool = False,
    ) -> None:
        self.fleet = fleet
        self._housing, self._conditions, self._with_helix = housing, tuple(conditions), helix
        self._keep = keep
        self._known = _Known()
        self._unit = gear_unit_of(fleet)
        self._helix = self._helix_units(fleet)
        self._signature = housing_signature(fleet)
        model = _Model(fleet, self._unit, housing, self._known, keep=True, integrate=integrate)
        self.base = self._values(model, self._helix, self._conditions)

    def needs_vectors(self, changed: Fleet) -> bool:
        """Whether a changed fleet asks for modes or transfer vectors of its own."""
        return housing_signature(changed) != self._signature

    def values(self, changed: Fleet, helix_angle_deg: float | None = None, integrate: bool = True) -> CaseValues:
        """Return the values of a changed fleet whose transfer vectors are the same.

        Parameters
        ----------
        changed : Fleet
        helix_angle_deg : float, optional
            Of the conditions' gears, as in the helix sweep: the centre distance follows, the housing stays.
        integrate : bool
            Whether motions that the harmonic balance does not find, of gears that rattle, are integrated in time, which
            takes seconds each. Without, such a case has no values.

        Raises
        ------
        FleetError
            No such drive can be.
        """
        same_gears = changed.gear_pair == self.fleet.gear_pair and changed.gear_dynamics == self.fleet.gear_dynamics
        unit, helix = (self._unit, self._helix) if same_gears else (gear_unit_of(changed), self._helix_units(changed))
        if helix_angle_deg is not None:
            unit = gear_unit_of(changed, math.radians(helix_angle_deg))
        conditions = self._conditions
        if not (same_gears and changed.train == self.fleet.train and changed.operation == self.fleet.operation):
            conditions = conditions_under(self.fleet, changed, conditions)
        housing = None if self._housing is None else reseated(self._housing, self.fleet, changed, unit)
        same_air = all(attrgetter(name)(changed) == attrgetter(name)(self.fleet) for name in _OF_POINT_SOURCES)
        asked = {"same_air": same_air, "integrate": integrate, "keep_motions": self._keep}
        model = _Model(changed, unit, housing, self._known, **asked)
        return self._values(model, helix, conditions)

    def _values(
        self, model: _Model, helix: tuple[tuple[float, GearUnit], ...], conditions: tuple[Condition, ...]
    ) -> CaseValues:
        cases = [Case("conditions", held.name, held.train_speed_km_h) for held in conditions]
        states = [model.state(held) for held in conditions]
        if helix:
            fastest = max(conditions, key=lambda held: held.motor_hz)
            cases += [Case("helix", f"{angle:g}", angle) for angle, _ in helix]
            states += [model.state(fastest, of_angle) for _, of_angle in helix]
        values = np.full((len(cases), len(QUANTITIES)), math.nan)
        patterns = np.full((len(cases), len(CIRCLE_DEG)), math.nan)
        for row, pattern, state in zip(values, patterns, states, strict=True):
            if state is None:
                continue
            sources = self._sources(model, state)
            _fill(row, model, state, sources)
            pattern[:] = _around_db(model, sources)
            _fill_around(row, pattern)
        return CaseValues(tuple(cases), values, _alike(cases, states, patterns))

    def _helix_units(self, fleet: Fleet) -> tuple[tuple[float, GearUnit], ...]:
        stated = fleet.operation.helix_angle_deg
        angles: tuple[float, ...] = stated.value if stated is not None and self._with_helix else ()
        return tuple((angle, gear_unit_of(fleet, math.radians(angle))) for angle in angles)

    @staticmethod
    def _sources(model: _Model, state: GearState) -> tuple[SoundSource, ...]:
        structure = model.field.structure_sources(state.forces)
        return (
            *model.motor_sources(state.condition),
            *model.gear_sources(state.condition, state.masuda_db),
            *structure,
        )


def _alike(cases: Sequence[Case], states: Sequence[GearState | None], patterns: Real) -> Real:
    """Lowest correlation over the conditions and over the helix angles; NaN where one of them has no values."""
    found = np.full(2, math.nan)
    for side, over in enumerate(("conditions", "helix")):
        held = [number for number, case in enumerate(cases) if case.over == over]
        if held and all(states[number] is not None for number in held):
            found[side] = least_alike(patterns[held])
    return found


def _around_db(model: _Model, sources: Sequence[SoundSource]) -> Real:
    """Total level around the circle; NaN of no sound, minus infinity where none arrives."""
    held = [source for source in sources if source.path in model.field.adds]
    if not held:
        return np.full(len(CIRCLE_DEG), math.nan)
    energy = np.sum(10.0 ** (0.1 * model.received_db(held, model.field.circle)), axis=0)
    with np.errstate(divide="ignore"):
        return np.asarray(10.0 * np.log10(energy))


def _fill(row: Real, model: _Model, state: GearState, sources: Sequence[SoundSource]) -> None:
    """Levels, motion and forces of a case into its row."""
    received = model.received_db(sources, (model.field.surface,))[:, 0].tolist()
    by_path = {path: [v for s, v in zip(sources, received, strict=True) if s.path == path] for path in _PATHS}
    total = [level for path in model.field.adds for level in by_path[path]]
    levels = {"spl_4m_db": overall_level_db(total)}
    levels |= {f"{path}_spl_4m_db": overall_level_db(by_path[path]) for path in _PATHS}
    numbers = {**levels, "masuda_spl_1m_db": state.masuda_db, "mesh_frequency_hz": state.mesh_hz}
    numbers["dte_pp_um"] = 1e6 * state.steady.dte_pp_m
    first = np.flatnonzero(state.forces.harmonic == 1.0)
    for gear, of_gear in zip(GEARS, state.forces.amplitude_n, strict=True):
        for direction, amplitude in zip(DIRECTIONS, of_gear, strict=True):
            force = float(abs(amplitude[first[0]])) if len(first) else None
            numbers[f"{gear}_force_{direction}_n"] = force
    for name, number in numbers.items():
        if number is not None:
            row[_COLUMN[name]] = number


def _fill_around(row: Real, pattern: Real) -> None:
    row[_COLUMN["range_12m_db"]] = range_db(pattern)
    if range_db(pattern) >= FLAT_DB:
        row[_COLUMN["loudest_deg"]] = CIRCLE_DEG[int(pattern.argmax())]

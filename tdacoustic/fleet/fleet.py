"""A fleet: the drive that a campaign measured or a model computes, every parameter with its origin."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ValidationError

from tdacoustic.errors import FleetError
from tdacoustic.fleet.design_sweep import DesignSweep
from tdacoustic.fleet.entries import entry_at, split_entry, with_entry
from tdacoustic.fleet.gear_dynamics import GearDynamics
from tdacoustic.fleet.gear_pair import GearPair
from tdacoustic.fleet.housing import Housing
from tdacoustic.fleet.masuda import Masuda
from tdacoustic.fleet.messages import fleet_error, key_problem, problem_lines, table_of
from tdacoustic.fleet.model import Model
from tdacoustic.fleet.motor import Motor
from tdacoustic.fleet.operation import Operation
from tdacoustic.fleet.parameter import Parameter
from tdacoustic.fleet.radiation import Radiation
from tdacoustic.fleet.sections import SECTIONS, STUDIES, FleetFile
from tdacoustic.fleet.si import si_value
from tdacoustic.fleet.studies import Feature, Reference
from tdacoustic.fleet.study_problems import study_problems
from tdacoustic.fleet.train import Train
from tdacoustic.fleet.what_if import WhatIf
from tdacoustic.fleet.what_if_problems import what_if_problems
from tdacoustic.toml_models import Table, frozen, meta_lines

__all__ = ["Fleet", "StatedParameter"]


class StatedParameter(NamedTuple):
    """One parameter under its dotted key, for the report.

    Parameters
    ----------
    key : str
        As ``"masuda.constant_db"`` or ``"gear_pair.1.face_width_mm"``.
    value : object
        In the unit that the key names.
    origin : str
    stderr : float or None
    """

    key: str
    value: Any
    origin: str
    stderr: float | None


@dataclass(frozen=True)
class Fleet:
    """A fleet file, checked and complete.

    Parameters
    ----------
    path : Path
        Of the file; two fleets from two places can be equal.
    name : str
        Default: the folder's name.
    train : Train
    gear_pair : tuple of GearPair
        In series, from the motor to the wheelset; each with its name.
    gear_dynamics : GearDynamics or None
    operation : Operation
    masuda : Masuda
    model : Model
    motor : Motor or None
    housing : Housing or None
    radiation : Radiation
    meta : tuple of (str, str)
        ``[meta]`` in words.
    sweep : tuple of DesignSweep
    reference : tuple of Reference
    feature : tuple of Feature
    what_if : tuple of WhatIf
    """

    path: Path = field(compare=False)
    name: str
    train: Train
    gear_pair: tuple[GearPair, ...]
    gear_dynamics: GearDynamics | None
    operation: Operation
    masuda: Masuda
    model: Model
    motor: Motor | None
    housing: Housing | None
    radiation: Radiation
    meta: tuple[tuple[str, str], ...] = ()
    sweep: tuple[DesignSweep, ...] = ()
    reference: tuple[Reference, ...] = ()
    feature: tuple[Feature, ...] = ()
    what_if: tuple[WhatIf, ...] = ()

    @classmethod
    def of_tables(cls, path: Path, raw: Mapping[str, Any]) -> Fleet:
        """Check the tables of a file, ``schema`` taken out and lists as tuples.

        Raises
        ------
        FleetError
            Something in them is wrong; the message names file, table and key.
        """
        try:
            file = FleetFile.model_validate(dict(raw))
        except ValidationError as error:
            raise fleet_error(path, problem_lines(error.errors(include_url=False), raw)) from None
        pairs = tuple(
            pair if pair.name else pair.model_copy(update={"name": str(number)})
            for number, pair in enumerate(file.gear_pair, 1)
        )
        sections = {name: getattr(file, name) for name in SECTIONS if name != "gear_pair"}
        meta = tuple(meta_lines(file.meta))
        asked = {name: getattr(file, name) for name in STUDIES}
        fleet = cls(path, file.name or path.parent.name or path.stem, gear_pair=pairs, meta=meta, **sections, **asked)
        problems = list(fleet._contradictions())
        if problems:
            raise fleet_error(path, problems)
        return fleet

    def _contradictions(self) -> Iterator[str]:
        names = [pair.name for pair in self.gear_pair]
        for number, name in enumerate(names, 1):
            if name in names[: number - 1]:
                yield f"[[gear_pair]] {number}: the name {name!r} stands twice, also at {names.index(name) + 1}"
        if self.model.gear_pair is not None and self.model.gear_pair not in names:
            yield f"[model]: gear_pair must be one of {', '.join(names)}, got {self.model.gear_pair!r}"
        if self.model.coupling.value == "two_way" and self.radiation.method.value != "boundary_elements":
            yield (
                '[model]: coupling = "two_way" needs [radiation] method = "boundary_elements", got '
                f'"{self.radiation.method.value}": without it no housing is computed'
            )
        yield from study_problems(self)
        yield from what_if_problems(self)

    @property
    def folder(self) -> Path:
        """The folder that paths of the fleet file are relative to."""
        return self.path.parent

    @property
    def step_path(self) -> Path | None:
        """Where the housing's STEP file is, or None where none is named."""
        if self.housing is None or self.housing.step_file is None:
            return None
        return self.folder / self.housing.step_file.value.replace("\\", "/")

    @property
    def modelled_pair(self) -> GearPair:
        """The pair that the gear model computes: ``[model] gear_pair``, by default the first."""
        return self.gear_pair[self.modelled_pair_number - 1]

    @property
    def modelled_pair_number(self) -> int:
        """Position of `modelled_pair` from 1, as dotted keys have it."""
        names = [pair.name for pair in self.gear_pair]
        return 1 if self.model.gear_pair is None else names.index(self.model.gear_pair) + 1

    def parameters(self) -> Iterator[StatedParameter]:
        """Yield every parameter that the fleet has, defaults too, in the order of the sections."""
        for name in SECTIONS:
            for key, parameter in _parameters(getattr(self, name), name):
                yield StatedParameter(key, parameter.value, parameter.origin, parameter.stderr)

    def get(self, key: str) -> Parameter[Any]:
        """Return the parameter of a dotted key.

        Entries of ``[[gear_pair]]``, ``[[motor.excitation]]`` and ``[[housing.seat]]`` are counted from 1.

        Parameters
        ----------
        key : str
            As ``"masuda.constant_db"`` or ``"gear_pair.1.face_width_mm"``.

        Raises
        ------
        FleetError
            No fleet has such a key, or this one's file does not give it.
        """
        problem = key_problem(key)
        if problem is not None:
            raise FleetError(f"{self.path}: {problem}")
        found: Any = self
        for part in key.split("."):
            if isinstance(found, tuple):
                number = int(part)
                if number > len(found):
                    raise FleetError(f"{self.path}: {key}: there are {len(found)} {table_of(key)}, not {number}")
                found = found[number - 1]
            elif found is not None:
                found = getattr(found, part)
        if found is None:
            raise FleetError(
                f"{self.path}: {table_of(key)}: {key.rpartition('.')[2]} is missing, and it is needed here"
            )
        assert isinstance(found, Parameter)
        return found

    def value_of(self, key: str) -> Any:
        """Return the value of a parameter, or of an entry of one, in the unit that its key names.

        Parameters
        ----------
        key : str
            As for `get`, or with the number of an entry after it: ``"gear_dynamics.mass_kg.2"``.

        Raises
        ------
        FleetError
            As `get`; or there is no such entry.
        """
        whole, place = split_entry(key)
        value = entry_at(self.get(whole).value, place)
        if value is None:
            raise FleetError(f"{self.path}: {key}: {whole} has no such entry")
        return value

    def number(self, key: str) -> float:
        """Return a parameter in SI units.

        The unit is taken from the key: ``_mm _um _deg _km_h _kw _gpa _degc _percent`` are converted (to m, rad, m/s,
        W, Pa, K, 1), others are SI or free of a unit already.

        Raises
        ------
        FleetError
            As `get`; or it is no single number.
        """
        value = si_value(key, self.get(key).value)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise FleetError(f"{self.path}: {key} is no single number")
        return value

    def numbers(self, key: str) -> tuple[float, ...]:
        """Return a list of numbers in SI units; see `number`.

        Raises
        ------
        FleetError
            As `get`; or it is no list of numbers.
        """
        value = si_value(key, self.get(key).value)
        if not isinstance(value, tuple) or not all(isinstance(entry, int | float) for entry in value):
            raise FleetError(f"{self.path}: {key} is no list of numbers")
        return value

    def replaced(
        self, values: Mapping[str, Any], *, stderr: Mapping[str, float] | None = None, origin: str = "calibrated"
    ) -> Fleet:
        """Return a copy with other values, checked like a file.

        Parameters
        ----------
        values : mapping of str to object
            By dotted key, in the unit that the key names. A key whose file leaves it out is added. With a number after
            it, as in ``"gear_dynamics.mass_kg.2"``, one entry is replaced, and its standard deviation stands in the
            origin of the whole.
        stderr : mapping of str to float, optional
            One standard deviation of some of them.
        origin : str
            Of all of them.

        Raises
        ------
        FleetError
            An unknown key, or a value that a file could not have either.
        """
        deviations = dict(stderr or {})
        foreign = [key for key in deviations if key not in values]
        if foreign:
            raise FleetError(f"{self.path}: stderr of {', '.join(foreign)}, which is not replaced")
        raw: dict[str, Any] = {name: _raw(getattr(self, name)) for name in SECTIONS if getattr(self, name) is not None}
        entries = {key: split_entry(key) for key in values}
        for key, value in values.items():
            whole, place = entries[key]
            problem = key_problem(whole)
            if problem is not None:
                raise FleetError(f"{self.path}: {problem}")
            if not place:
                self._set(raw, key, {"value": frozen(value), "origin": origin, "stderr": deviations.get(key)})
        for whole in dict.fromkeys(whole for whole, place in entries.values() if place):
            changes = {key: place for key, (of, place) in entries.items() if of == whole and place}
            self._set(raw, whole, self._with_entries(whole, changes, values, deviations, origin))
        changed = Fleet.of_tables(self.path, {"name": self.name, **raw})
        return replace(changed, meta=self.meta, **{name: getattr(self, name) for name in STUDIES})

    def _with_entries(
        self,
        whole: str,
        changes: Mapping[str, tuple[int, ...]],
        values: Mapping[str, Any],
        deviations: Mapping[str, float],
        origin: str,
    ) -> dict[str, Any]:
        """A parameter with some of its entries replaced, as a file would have it."""
        held = self.get(whole)
        value = held.value
        told = []
        for key, place in changes.items():
            self.value_of(key)
            value = with_entry(value, place, frozen(values[key]))
            number = ".".join(str(index + 1) for index in place)
            told.append(f"entry {number} {origin}" + (f" ± {deviations[key]:.3g}" if key in deviations else ""))
        return {"value": value, "origin": "; ".join([held.origin, *told]), "stderr": None}

    def _set(self, raw: dict[str, Any], key: str, parameter: dict[str, Any]) -> None:
        *tables, last = key.split(".")
        place: Any = raw
        for part in tables:
            if isinstance(place, tuple):
                if int(part) > len(place):
                    raise FleetError(f"{self.path}: {key}: there are {len(place)} {table_of(key)}, not {part}")
                place = place[int(part) - 1]
            else:
                place = place.setdefault(part, () if part in ("gear_pair", "excitation", "seat") else {})
        place[last] = parameter


def _parameters(found: Any, key: str) -> Iterator[tuple[str, Parameter[Any]]]:
    if isinstance(found, Parameter):
        yield key, found
    elif isinstance(found, Table):
        for name in type(found).model_fields:
            yield from _parameters(getattr(found, name), f"{key}.{name}")
    elif isinstance(found, tuple) and found and isinstance(found[0], Table):
        for number, entry in enumerate(found, 1):
            yield from _parameters(entry, f"{key}.{number}")


def _raw(found: Any) -> Any:
    """Return a section as a file would have it; parameters stay as they are."""
    if isinstance(found, Table):
        entries = {name: getattr(found, name) for name in type(found).model_fields}
        return {name: _raw(entry) for name, entry in entries.items() if entry is not None}
    if isinstance(found, tuple) and found and isinstance(found[0], Table):
        return tuple(_raw(entry) for entry in found)
    return found

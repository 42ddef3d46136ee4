"""What is wrong in a fleet file, each in one line that names table, key, value and what is allowed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, get_args, get_origin

from pydantic import BaseModel
from pydantic_core import ErrorDetails

from tdacoustic.errors import FleetError
from tdacoustic.fleet.design_sweep import DesignSweep
from tdacoustic.fleet.gear_dynamics import GearDynamics
from tdacoustic.fleet.gear_pair import GearPair
from tdacoustic.fleet.housing import Housing, HousingSeat, Material
from tdacoustic.fleet.masuda import Masuda
from tdacoustic.fleet.model import Model
from tdacoustic.fleet.motor import Motor, MotorExcitation
from tdacoustic.fleet.operation import Operation
from tdacoustic.fleet.parameter import PARAMETER_KEYS, Parameter
from tdacoustic.fleet.radiation import Radiation
from tdacoustic.fleet.sections import FleetFile
from tdacoustic.fleet.studies import Feature, Reference
from tdacoustic.fleet.train import Train
from tdacoustic.fleet.what_if import WhatIf
from tdacoustic.toml_models import TOP_LEVEL, Vocabulary, file_error, joined, nearest, problem_words, shown

__all__ = ["VOCABULARY", "fleet_error", "key_problem", "problem_lines", "table_of"]

_ARRAYS: Final[Mapping[str, type[BaseModel]]] = MappingProxyType(
    {
        "gear_pair": GearPair,
        "motor.excitation": MotorExcitation,
        "housing.seat": HousingSeat,
        "sweep": DesignSweep,
        "reference": Reference,
        "feature": Feature,
        "what_if": WhatIf,
    }
)
_TABLES: Final[Mapping[str, type[BaseModel]]] = MappingProxyType(
    {
        "train": Train,
        "gear_dynamics": GearDynamics,
        "operation": Operation,
        "masuda": Masuda,
        "model": Model,
        "motor": Motor,
        "housing": Housing,
        "housing.material": Material,
        "radiation": Radiation,
    }
)
VOCABULARY: Final = Vocabulary(
    MappingProxyType(
        {
            TOP_LEVEL: ("schema", *FleetFile.model_fields),
            **{f"[[{name}]]": tuple(model.model_fields) for name, model in _ARRAYS.items()},
            **{f"[{name}]": tuple(model.model_fields) for name, model in _TABLES.items()},
        }
    )
)
"""The keys of ``fleet.toml``."""


def _table_parts(parts: Sequence[int | str]) -> tuple[str, int]:
    """Return the innermost table that a location begins with, without its index, and how many parts lead to it."""
    found, used = "", 0
    for length in range(1, len(parts) + 1):
        words = [part for part in parts[:length] if isinstance(part, str)]
        name = ".".join(words)
        is_table = name in _TABLES and length == len(words)
        is_entry = name in _ARRAYS and length == len(words) + 1 and isinstance(parts[length - 1], int)
        if is_table or is_entry:
            found, used = name, length
    return found, used


def _bracketed(name: str) -> str:
    return f"[[{name}]]" if name in _ARRAYS else f"[{name}]"


def _place(raw: Mapping[str, Any], loc: Sequence[int | str], of_table: bool) -> tuple[str, str, list[Any]]:
    """Return where a location stands in words, its table, and what of it is inside the table.

    With `of_table` the location can be a table as a whole, otherwise it is a key of one.
    """
    name, used = _table_parts(loc if of_table else loc[:-1])
    if not name:
        return "", TOP_LEVEL, list(loc)
    table = _bracketed(name)
    if name in _TABLES:
        return table, table, list(loc[used:])
    entry: Any = raw
    for part in loc[:used]:
        entry = entry[part]
    label = entry.get("name") if isinstance(entry, Mapping) else None
    last = loc[used - 1]
    number = last + 1 if isinstance(last, int) else last
    where = f"{table} {shown(label)}" if isinstance(label, str) and label else f"{table} {number}"
    return where, table, list(loc[used:])


def problem_lines(errors: Sequence[ErrorDetails], raw: Mapping[str, Any]) -> list[str]:
    """Return each problem in one line, once.

    Parameters
    ----------
    errors : sequence of ErrorDetails
        From pydantic.
    raw : mapping
        What was validated.
    """
    # a list whose entries are wrong is also too short of right ones, which says nothing new
    told = [e for e in errors if e["type"] != "too_short" or len(e["input"]) < e["ctx"]["min_length"]]
    return list(dict.fromkeys(_problem_line(error, raw) for error in told))


def _problem_line(error: ErrorDetails, raw: Mapping[str, Any]) -> str:
    where, table, inside = _place(raw, error["loc"], error["type"] == "value_error")
    key = str(inside[0]) if inside else ""
    rest = inside[1:]
    if rest and isinstance(rest[0], str) and rest[0] != "value":
        return joined(where, _parameter_words(error, key, rest[0]))
    if rest == ["value"] and error["type"] == "missing":
        return joined(where, f"{key} is a table without value; write {key} = {{ value = ..., origin = '...' }}")
    entries = [part for part in rest if isinstance(part, int)]
    if entries:
        if error["type"] == "missing":
            return joined(where, f"{key} has too few entries, {entries[-1]}")
        key = f"{key}, {', '.join(f'entry {number + 1}' for number in entries)},"
    return joined(where, problem_words(error, key, table, VOCABULARY))


def _parameter_words(error: ErrorDetails, key: str, inner: str) -> str:
    if error["type"] == "extra_forbidden":
        near = nearest(inner, PARAMETER_KEYS)
        known = ", ".join(PARAMETER_KEYS)
        said = f"unknown key {shown(inner)} in {key} = {{ ... }}; the nearest known key is "
        return said + (f"{near!r}" if near is not None else f"one of {known}")
    return problem_words(error, f"{inner} of {key}", TOP_LEVEL, VOCABULARY)


def fleet_error(path: Path, problems: Sequence[str]) -> FleetError:
    """Return the error for a fleet file; see `file_error`."""
    return file_error(FleetError, path, problems)


def _parts(key: str) -> list[int | str]:
    return [int(part) - 1 if part.isdecimal() else part for part in key.split(".")]


def table_of(key: str) -> str:
    """Return the table that a dotted key is in, as messages call it.

    Examples
    --------
    >>> table_of("gear_pair.1.face_width_mm"), table_of("masuda.constant_db")
    ('[[gear_pair]]', '[masuda]')
    """
    name, _ = _table_parts(_parts(key)[:-1])
    return _bracketed(name) if name else TOP_LEVEL


@cache  # asked for at each look at a parameter
def _parameter_names(model: type[BaseModel]) -> list[str]:
    """Return the keys of a table that hold a `Parameter`, not a name or a table."""
    kinds = {name: (field.annotation, *get_args(field.annotation)) for name, field in model.model_fields.items()}
    return [name for name, found in kinds.items() if any(get_origin(kind) is Parameter for kind in found)]


def key_problem(key: str) -> str | None:
    """Say why a dotted key is none that a fleet could have, or return None.

    Examples
    --------
    >>> key_problem("masuda.constant_db") is None
    True
    >>> key_problem("masuda.constant")
    "unknown parameter 'masuda.constant'; the nearest known one is 'masuda.constant_db'"
    """
    parts = _parts(key)
    name, used = _table_parts(parts[:-1])
    model = _TABLES.get(name) or _ARRAYS.get(name)
    inside = parts[used:]
    counted = all(not isinstance(part, int) or part >= 0 for part in parts)
    if model is not None and len(inside) == 1 and counted and str(inside[0]) in _parameter_names(model):
        return None
    known = [
        f"{table}.1.{field}" if table in _ARRAYS else f"{table}.{field}"
        for table, tables_model in (*_TABLES.items(), *_ARRAYS.items())
        for field in _parameter_names(tables_model)
    ]
    return f"unknown parameter {key!r}; the nearest known one is {nearest(key, known)!r}"

"""From a `Fleet` to the text of a file that loads to an equal one."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from tdacoustic.fleet.design_sweep import DesignSweep, Range
from tdacoustic.fleet.fleet import Fleet
from tdacoustic.fleet.parameter import ASSUMED, Parameter
from tdacoustic.fleet.sections import SCHEMA, SECTIONS, STUDIES
from tdacoustic.fleet.what_if import WhatIf
from tdacoustic.toml_models import Table

__all__ = ["fleet_toml"]


def fleet_toml(fleet: Fleet) -> str:
    """Return the text of a fleet file.

    Every parameter stands in it, defaults too, so that the file means the same
    when a default changes; comments of the file that was read are not kept. A path
    to a STEP file is written as it was, relative to the file's own folder.

    Parameters
    ----------
    fleet : Fleet

    Returns
    -------
    str
        It loads to an equal fleet.
    """
    lines = [f"schema = {_text(SCHEMA)}", f"name = {_text(fleet.name)}"]
    if fleet.meta:
        lines += ["", "[meta]", *(f"{_text(key)} = {_text(value)}" for key, value in fleet.meta)]
    for name in (*SECTIONS, *STUDIES):
        section = getattr(fleet, name)
        for entry in section if isinstance(section, tuple) else () if section is None else (section,):
            lines += _table(entry, f"[[{name}]]" if isinstance(section, tuple) else f"[{name}]", name)
    return "\n".join(lines) + "\n"


def _table(table: Table, header: str, name: str) -> Iterator[str]:
    yield ""
    yield header
    inner: list[str] = []
    for key in type(table).model_fields:
        value = getattr(table, key)
        if isinstance(value, Table):
            inner += _table(value, f"[{name}.{key}]", f"{name}.{key}")
        elif isinstance(value, tuple) and value and isinstance(value[0], Table):
            for entry in value:
                inner += _table(entry, f"[[{name}.{key}]]", f"{name}.{key}")
        elif isinstance(value, Parameter):
            yield f"{key} = {_parameter(value)}"
        elif isinstance(table, DesignSweep | WhatIf) and key == "parameters" and value:
            yield f"{key} = {{ {', '.join(f'{_text(of)} = {_value(values)}' for of, values in value)} }}"
        elif value not in (None, (), ""):
            yield f"{key} = {_value(value)}"
    yield from inner


def _parameter(parameter: Parameter[Any]) -> str:
    value = _value(parameter.value)
    if parameter.origin == ASSUMED and parameter.stderr is None:
        return value
    entries = [f"value = {value}", f"origin = {_text(parameter.origin)}"]
    if parameter.stderr is not None:
        entries.append(f"stderr = {_value(parameter.stderr)}")
    return f"{{ {', '.join(entries)} }}"


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any) -> str:
    if isinstance(value, Range):
        scale = "" if value.scale == "linear" else f", scale = {_text(value.scale)}"
        return f"{{ from = {_value(value.low)}, to = {_value(value.high)}{scale} }}"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, int):
        return str(int(value))
    if isinstance(value, float):
        short = f"{value:g}"
        return short if float(short) == value else repr(float(value))
    return f"[{', '.join(_value(entry) for entry in value)}]"

"""What pydantic found wrong, each in one line that names the thing, the value and what is allowed."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from pydantic import BaseModel
from pydantic_core import ErrorDetails

from tdacoustic.campaign.channels import CampaignChannel
from tdacoustic.campaign.judgements import Exclude, Level, Override
from tdacoustic.campaign.model import CampaignFile
from tdacoustic.campaign.runs import CampaignRun
from tdacoustic.campaign.settings import AnalysisSettings, CalibrationSettings
from tdacoustic.errors import CampaignError

__all__ = ["MAX_LINES", "campaign_error", "problem_line", "shown", "unknown_key"]

MAX_LINES: Final = 10
"""Problems that one message lists in full."""

_ARRAYS: Final[Mapping[str, type[BaseModel]]] = MappingProxyType(
    {"channel": CampaignChannel, "run": CampaignRun, "level": Level, "exclude": Exclude, "override": Override}
)
_TABLES: Final[Mapping[str, type[BaseModel]]] = MappingProxyType(
    {"analysis": AnalysisSettings, "calibration": CalibrationSettings}
)

_KEYS: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {
        "the top level": ("schema", *CampaignFile.model_fields),
        **{f"[[{name}]]": tuple(model.model_fields) for name, model in _ARRAYS.items()},
        **{f"[{name}]": tuple(model.model_fields) for name, model in _TABLES.items()},
    }
)

_KINDS: Final[Mapping[str, str]] = MappingProxyType(
    {
        "float_type": "a number",
        "finite_number": "a finite number",
        "int_type": "a whole number",
        "string_type": "text in quotes",
        "bool_type": "true or false",
        "tuple_type": "a list in [ ]",
        "dict_type": "a table",
        "model_type": "a table",
    }
)

_MAX_SHOWN: Final = 80


def shown(value: Any) -> str:
    """Return a value as TOML would have it, shortened.

    Examples
    --------
    >>> shown((1, True, "a"))
    "[1, true, 'a']"
    """
    if isinstance(value, bool):
        text = "true" if value else "false"
    elif isinstance(value, tuple | list):
        text = f"[{', '.join(shown(item) for item in value[:8])}{', ...' if len(value) > 8 else ''}]"
    elif isinstance(value, dict):
        text = "a table"
    else:
        text = repr(value)
    return text if len(text) <= _MAX_SHOWN else text[: _MAX_SHOWN - 4] + " ..."


def _nearest(key: str, known: Sequence[str], cutoff: float) -> str | None:
    by_lower = {name.lower(): name for name in known}
    found = difflib.get_close_matches(key.lower(), by_lower, n=1, cutoff=cutoff)
    return by_lower[found[0]] if found else None


def unknown_key(key: str, table: str) -> str:
    """Say that a key is not known in a table, and which known key is nearest, there or elsewhere.

    Parameters
    ----------
    key : str
    table : str
        As ``"[[channel]]"``, ``"[analysis]"`` or ``"the top level"``.

    Examples
    --------
    >>> unknown_key("sensitivty", "[[channel]]")
    "unknown key 'sensitivty' in [[channel]]; the nearest known key is 'sensitivity'"
    >>> unknown_key("pulses_per_rev", "[[run]]")
    "unknown key 'pulses_per_rev' in [[run]]; it belongs in [[channel]]"
    """
    said = f"unknown key {shown(key)} {'at' if table == 'the top level' else 'in'} {table}; "
    here = _KEYS[table]
    homes = [place for place, keys in _KEYS.items() if key in keys]
    if homes:
        return said + f"it belongs in {' or '.join(homes)}"
    near = _nearest(key, here, 0.6)
    if near is None:
        for place, keys in _KEYS.items():
            elsewhere = _nearest(key, keys, 0.75)
            if elsewhere is not None:
                return said + f"the nearest known key is {elsewhere!r} in {place}"
        near = _nearest(key, here, 0.0) or here[0]
        return said + f"the nearest known key is {near!r}; known are {', '.join(here)}"
    return said + f"the nearest known key is {near!r}"


def _place(raw: Mapping[str, Any], loc: Sequence[int | str], labels: Mapping[int, str]) -> tuple[str, str, list[Any]]:
    """Return where a location stands in words, its table, and what of it is inside the table."""
    head = loc[0] if loc else ""
    if head in _ARRAYS and len(loc) >= 2 and isinstance(loc[1], int):
        index = loc[1]
        entry = raw[str(head)][index]
        entry = entry if isinstance(entry, dict) else {}
        name, condition = entry.get("name"), entry.get("condition")
        if head in ("channel", "run") and isinstance(name, str | int):
            where = f"{head} {shown(str(name))}"
        elif condition is not None:
            where = f"{head} {index + 1} (condition {shown(condition)})"
        else:
            where = f"{head} {index + 1}"
        if head == "run" and index in labels:
            where = f"{labels[index]} ({where})" if name is not None else labels[index]
        return where, f"[[{head}]]", list(loc[2:])
    if head in _TABLES and len(loc) >= 2:
        return f"[{head}]", f"[{head}]", list(loc[1:])
    return "", "the top level", list(loc)


def _words(error: ErrorDetails, key: str, table: str) -> str:
    kind, value, context = error["type"], error["input"], error.get("ctx", {})
    got = f", got {shown(value)}"
    if kind == "missing":
        return f"{key} is missing" if key else "is missing"
    if kind == "extra_forbidden":
        return unknown_key(key, table)
    if kind == "literal_error":
        allowed = str(context["expected"]).replace("'", "").replace(" or ", ", ")
        return f"{key} must be one of {allowed}{got}"
    if kind == "tuple_type" and key in _ARRAYS and table == "the top level":
        return f"{key} must be written as [[{key}]], with two brackets{got}"
    if kind == "model_type" and key in _TABLES and isinstance(value, tuple):
        return f"{key} must be written as [{key}], with one bracket"
    if kind in _KINDS:
        return f"{key} must be {_KINDS[kind]}{got}".lstrip()
    if kind in ("greater_than", "greater_than_equal", "less_than", "less_than_equal"):
        sign = {"greater_than": ">", "greater_than_equal": ">=", "less_than": "<", "less_than_equal": "<="}[kind]
        return f"{key} must be {sign} {next(iter(context.values())):g}{got}"
    if kind == "too_short":
        return f"{key} must have at least {context['min_length']} entry{got}"
    if kind == "too_long":
        return f"{key} must have {context['max_length']} entries{got}"
    if kind == "value_error":
        said = str(context["error"])
        own = not key or said.split(" ")[0] == key
        return said if own else f"{key} {said}" if said.startswith(("must", "names", "'", '"')) else f"{key}: {said}"
    return f"{key}: {error['msg']}{got}"


def problem_line(error: ErrorDetails, raw: Mapping[str, Any], labels: Mapping[int, str]) -> str:
    """Return one problem in one line.

    Parameters
    ----------
    error : ErrorDetails
        From pydantic.
    raw : mapping
        What was validated.
    labels : mapping of int to str
        Where a run stands in ``runs.csv``, by its index.
    """
    where, table, inside = _place(raw, error["loc"], labels)
    key = str(inside[0]) if inside else ""
    if len(inside) > 1 and isinstance(inside[1], int):
        if error["type"] == "missing":
            line = f"{key} has too few entries, {inside[1]}"
            return f"{where}: {line}" if where else line
        key = f"{key}, entry {inside[1] + 1},"
    line = _words(error, key, table)
    line = " ".join(line.split())
    return f"{where}: {line}" if where else line


def campaign_error(path: Path, problems: Sequence[str]) -> CampaignError:
    """Return the error for a file: the first problem in the first line, with how many more there are.

    Examples
    --------
    >>> print(campaign_error(Path("c.toml"), ["name is missing", "no run"]))
    c.toml: name is missing (and 1 more problem)
      no run
    """
    first, more = problems[0], len(problems) - 1
    if not more:
        return CampaignError(f"{path}: {first}")
    lines = [f"{path}: {first} (and {more} more problem{'s' if more > 1 else ''})"]
    lines += [f"  {problem}" for problem in problems[1:MAX_LINES]]
    if len(problems) > MAX_LINES:
        lines.append(f"  ... and {len(problems) - MAX_LINES} not shown")
    return CampaignError("\n".join(lines))

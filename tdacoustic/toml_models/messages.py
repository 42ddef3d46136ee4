"""What pydantic found wrong in a file, each in one line that names the thing, the value and what is allowed."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, TypeVar

from pydantic_core import ErrorDetails

from tdacoustic.errors import TdacousticError

__all__ = ["MAX_LINES", "TOP_LEVEL", "Vocabulary", "file_error", "joined", "nearest", "problem_words", "shown"]

MAX_LINES: Final = 10
"""Problems that one message lists in full."""

TOP_LEVEL: Final = "the top level"
"""How messages call what is in no table."""

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

_SIGNS: Final[Mapping[str, str]] = MappingProxyType(
    {"greater_than": ">", "greater_than_equal": ">=", "less_than": "<", "less_than_equal": "<="}
)

_MAX_SHOWN: Final = 80

_ErrorT = TypeVar("_ErrorT", bound=TdacousticError)


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


def nearest(key: str, known: Sequence[str], cutoff: float = 0.0) -> str | None:
    """Return the known key most like a key, whatever the case, or None where none is like enough.

    Examples
    --------
    >>> nearest("Orign", ["value", "origin", "stderr"])
    'origin'
    """
    by_lower = {name.lower(): name for name in known}
    found = difflib.get_close_matches(key.lower(), by_lower, n=1, cutoff=cutoff)
    return by_lower[found[0]] if found else None


@dataclass(frozen=True)
class Vocabulary:
    """The keys a kind of file knows.

    Parameters
    ----------
    keys : mapping of str to tuple of str
        By table, as ``"[[channel]]"``, ``"[analysis]"`` or `TOP_LEVEL`.
    """

    keys: Mapping[str, tuple[str, ...]]

    def unknown_key(self, key: str, table: str) -> str:
        """Say that a key is not known in a table, and which known key is nearest, there or elsewhere.

        Examples
        --------
        >>> words = Vocabulary({"[a]": ("speed_rpm", "name"), "[b]": ("unit",)})
        >>> words.unknown_key("spedrpm", "[a]")
        "unknown key 'spedrpm' in [a]; the nearest known key is 'speed_rpm'"
        >>> words.unknown_key("unit", "[a]")
        "unknown key 'unit' in [a]; it belongs in [b]"
        """
        said = f"unknown key {shown(key)} {'at' if table == TOP_LEVEL else 'in'} {table}; "
        here = self.keys[table]
        homes = [place for place, keys in self.keys.items() if key in keys]
        if homes:
            return said + f"it belongs in {' or '.join(homes)}"
        near = nearest(key, here, 0.6)
        if near is None:
            for place, keys in self.keys.items():
                elsewhere = nearest(key, keys, 0.75)
                if elsewhere is not None:
                    return said + f"the nearest known key is {elsewhere!r} in {place}"
            near = nearest(key, here) or here[0]
            return said + f"the nearest known key is {near!r}; known are {', '.join(here)}"
        return said + f"the nearest known key is {near!r}"


def problem_words(error: ErrorDetails, key: str, table: str, vocabulary: Vocabulary) -> str:
    """Return what is wrong with a key, without where it is.

    Parameters
    ----------
    error : ErrorDetails
        From pydantic.
    key, table : str
        What the error is about; the table as `vocabulary` calls it.
    vocabulary : Vocabulary
    """
    kind, value, context = error["type"], error["input"], error.get("ctx", {})
    got = f", got {shown(value)}"
    if kind == "missing":
        return f"{key} is missing" if key else "is missing"
    if kind == "extra_forbidden":
        return vocabulary.unknown_key(key, table)
    if kind == "literal_error":
        allowed = str(context["expected"]).replace("'", "").replace(" or ", ", ")
        return f"{key} must be one of {allowed}{got}"
    if kind == "tuple_type" and table == TOP_LEVEL and f"[[{key}]]" in vocabulary.keys:
        return f"{key} must be written as [[{key}]], with two brackets{got}"
    if kind == "model_type" and f"[{key}]" in vocabulary.keys and isinstance(value, tuple):
        return f"{key} must be written as [{key}], with one bracket"
    if kind in _KINDS:
        return f"{key} must be {_KINDS[kind]}{got}".lstrip()
    if kind in _SIGNS:
        return f"{key} must be {_SIGNS[kind]} {next(iter(context.values())):g}{got}"
    if kind == "too_short":
        return f"{key} must have at least {context['min_length']} entry{got}"
    if kind == "too_long":
        return f"{key} must have {context['max_length']} entries{got}"
    if kind == "value_error":
        said = str(context["error"])
        own = not key or said.split(" ")[0] == key
        return said if own else f"{key} {said}" if said.startswith(("must", "names", "'", '"')) else f"{key}: {said}"
    return f"{key}: {error['msg']}{got}"


def joined(where: str, line: str) -> str:
    """Return a problem in one line, after where it is."""
    line = " ".join(line.split())
    return f"{where}: {line}" if where else line


def file_error(error_type: type[_ErrorT], path: Path, problems: Sequence[str]) -> _ErrorT:
    """Return the error for a file: the first problem in the first line, with how many more there are.

    Examples
    --------
    >>> print(file_error(TdacousticError, Path("c.toml"), ["name is missing", "no run"]))
    c.toml: name is missing (and 1 more problem)
      no run
    """
    first, more = problems[0], len(problems) - 1
    if not more:
        return error_type(f"{path}: {first}")
    lines = [f"{path}: {first} (and {more} more problem{'s' if more > 1 else ''})"]
    lines += [f"  {problem}" for problem in problems[1:MAX_LINES]]
    if len(problems) > MAX_LINES:
        lines.append(f"  ... and {len(problems) - MAX_LINES} not shown")
    return error_type("\n".join(lines))

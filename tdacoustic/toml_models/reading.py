"""From a TOML file to a tree that nobody can change, or to one message that says what is wrong."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from tdacoustic.errors import MissingFileError, TdacousticError
from tdacoustic.toml_models.messages import Vocabulary, shown
from tdacoustic.toml_models.paths import small_file

__all__ = ["check_schema", "file_or_inside", "frozen", "meta_lines", "read_toml", "steering_sign"]


def file_or_inside(path: Path, name: str) -> Path:
    """Return the file itself, or the file of that name in a folder.

    Raises
    ------
    MissingFileError
        Neither is there.
    """
    if path.is_dir():
        inside = path / name
        if not inside.is_file():
            raise MissingFileError(f"{path}: the folder holds no {name}")
        return inside
    if not path.is_file():
        raise MissingFileError(f"{path}: {'is not a file' if path.exists() else 'no such file'}")
    return path


def read_toml(path: Path, error_type: type[TdacousticError]) -> dict[str, Any]:
    """Read a TOML file, UTF-8 with or without a byte order mark.

    Raises
    ------
    error_type
        It cannot be read or is no valid TOML; the message names line and column. Or a text in it has a control
        character or an override of the direction of writing.
    """
    try:
        text = small_file(path, error_type).decode("utf-8-sig")  # Windows editors put a byte order mark
    except UnicodeDecodeError as error:
        raise error_type(f"{path}: is not UTF-8 (byte {error.start}: {error.reason})") from error
    try:
        tree = tomllib.loads(text)
        _refuse_controls(path, tree, error_type)
        return tree
    except tomllib.TOMLDecodeError as error:
        found = re.search(r"\(at line (\d+), column (\d+)\)", str(error))
        reason = re.sub(r"\s*\(at .*\)$", "", str(error))
        if found is None:
            raise error_type(f"{path}: no valid TOML: {reason}") from error
        line, column = int(found[1]), int(found[2])
        written = text.splitlines()[line - 1].strip() if line <= len(text.splitlines()) else ""
        raise error_type(f"{path}: line {line}, column {column}: no valid TOML: {reason}: {shown(written)}") from error
    except (RecursionError, ValueError) as error:  # nested a thousand deep, a number of 5000 digits, a 13th month
        raise error_type(f"{path}: no valid TOML: {error}") from error


def _refuse_controls(path: Path, tree: Any, error_type: type[TdacousticError], where: str = "") -> None:
    """Raise where a text or a key has a sign that steers a terminal or turns the direction of writing."""
    entries: Iterable[tuple[Any, Any]] = ()
    if isinstance(tree, dict):
        entries = tree.items()
    elif isinstance(tree, list):
        entries = enumerate(tree, 1)
    for key, value in entries:
        found = steering_sign(key) if isinstance(key, str) else None
        found = found or (steering_sign(value) if isinstance(value, str) else None)
        inside = f"{where}.{key}" if where else str(key)
        if found is not None:
            raise error_type(f"{path}: {inside!r} has the sign {found!a}, which no text here may have")
        _refuse_controls(path, value, error_type, inside)


def steering_sign(text: str) -> str | None:
    r"""First sign of a text that steers a terminal, ends a string of C or turns the direction of writing.

    Tabs and line breaks are none.

    Examples
    --------
    >>> steering_sign("a\tb\r\n") is None, steering_sign("a\x1b[31m")
    (True, '\x1b')
    """
    match = re.search("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x84\x86-\x9f\u202a-\u202e\u2066-\u2069]", text)
    return None if match is None else match[0]


def frozen(value: Any) -> Any:
    """Return a tree with every list as a tuple."""
    if isinstance(value, list):
        return tuple(frozen(item) for item in value)
    if isinstance(value, dict):
        return {key: frozen(item) for key, item in value.items()}
    return value


def meta_lines(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Yield the entries of ``[meta]`` in words, keys of nested tables joined by a dot."""
    for key, value in table.items():
        if isinstance(value, dict):
            yield from meta_lines(value, f"{prefix}{key}.")
        elif isinstance(value, tuple):
            yield f"{prefix}{key}", ", ".join(str(item) for item in value)
        else:
            yield f"{prefix}{key}", str(value)


def check_schema(
    path: Path, raw: dict[str, Any], schema: str, vocabulary: Vocabulary, error_type: type[TdacousticError]
) -> None:
    """Take ``schema`` out of a tree.

    Raises
    ------
    error_type
        It is missing, or of another kind of file.
    """
    if "schema" not in raw:
        near = next((key for key in raw if key.lower() == "schema"), None)
        also = f"; {vocabulary.unknown_key(near, 'the top level')}" if near else ""
        raise error_type(f'{path}: schema is missing, the file has to begin with schema = "{schema}"{also}')
    found = raw.pop("schema")
    if found != schema:
        hint = ""
        kind = re.match(r"tdacoustic-(campaign|fleet|synthesis)/", found) if isinstance(found, str) else None
        if kind is not None and not schema.startswith(kind[0]):
            hint = f"; this is a {kind[1]} file"
        raise error_type(f"{path}: schema must be {schema!r}, got {shown(found)}{hint}")

"""Headers of a sensor database, as laboratories spell them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from tdacoustic.errors import CampaignError, UnitError
from tdacoustic.toml_models import nearest, shown
from tdacoustic.units import parse_sensitivity

__all__ = ["SENSOR_COLUMNS", "sensor_columns"]

SENSOR_COLUMNS: Final = ("serial", "sensitivity", "unit", "quantity", "date", "due", "type", "note")

_SPELLINGS: Final = {
    "serial": ("serial number", "serial no", "serial nr", "s n", "sn", "sensor serial number"),
    "sensitivity": ("sens",),
    "unit": ("units", "sensitivity unit", "unit of sensitivity"),
    "date": ("calibration date", "cal date", "date of calibration", "calibrated", "calibrated on"),
    "due": ("due date", "calibration due", "calibration due date", "cal due", "cal due date", "next calibration"),
}
"""Headers that laboratories write, by what they are here; case, spaces, ``_``, ``-``, ``.`` and ``/`` do not count."""
_ALSO: Final = {words: column for column, spellings in _SPELLINGS.items() for words in (column, *spellings)} | {
    column: column for column in SENSOR_COLUMNS
}
_BETWEEN: Final = re.compile(r"[\s_\-./]+")
_BRACKETS: Final = re.compile(r"(?P<name>[^\[(]*?)\s*(?:\[(?P<unit>[^\[\]]*)\]|\((?P<perhaps>.*)\))")


def sensor_columns(path: Path, cells: Sequence[str]) -> tuple[list[str], str | None]:
    """Return the columns of a sensor database, and the unit that the header of its sensitivities states.

    What stands in brackets behind a header is a unit, in parentheses if it is one: ``Sensitivity [mV/Pa]``. Behind any
    other header it only explains.

    Parameters
    ----------
    path : Path
        For messages.
    cells : sequence of str
        Of the header.

    Returns
    -------
    list of str
        Out of `SENSOR_COLUMNS`; others as they stand, in lower case.
    str or None

    Raises
    ------
    CampaignError
        A column that is needed is missing, one stands twice, or one is nearly but not quite one of these.

    Examples
    --------
    >>> sensor_columns(Path("s.csv"), ["Serial No.", "Sensitivity [mV/Pa]", "Cal_Due"])
    (['serial', 'sensitivity', 'due'], 'mV/Pa')
    """
    plain = {_plain(cell) for cell in cells}
    read = [_column(path, cell, plain) for cell in cells]
    columns = [column for column, _ in read]
    for needed in ("serial", "sensitivity"):
        if needed not in columns:
            raise CampaignError(f"{path}: column {needed!r} is missing; there are {shown(tuple(columns))}")
    for column in columns:
        near = nearest(column, SENSOR_COLUMNS, 0.8)
        if near is not None and near != column and near not in columns:
            raise CampaignError(f"{path}: column {shown(column)}: the nearest known column is {near!r}")
        if column in SENSOR_COLUMNS and columns.count(column) > 1:
            raise CampaignError(f"{path}: column {column!r} stands twice")
    return columns, next((unit for _, unit in read if unit is not None), None)


def _plain(cell: str) -> str:
    return _BETWEEN.sub(" ", cell.casefold()).strip()


def _column(path: Path, cell: str, plain: set[str]) -> tuple[str, str | None]:
    """The column of a header and its unit; a spelling counts only where the column's own name does not stand."""
    name, unit = cell, None
    split = _BRACKETS.fullmatch(cell.strip())
    if split is not None and _plain(split["name"]) in _ALSO:
        name = split["name"]
        unit = split["unit"] if split["unit"] is not None else split["perhaps"]
    column = _ALSO.get(_plain(name))
    if column is None or (_plain(name) != column and column in plain):
        return cell.strip().lower(), None
    if column != "sensitivity" or unit is None:
        return column, None
    try:
        parse_sensitivity(f"1 {unit.strip()}")
    except UnitError as error:
        if split is not None and split["unit"] is None:
            return cell.strip().lower(), None  # words in parentheses, as of another kind of sensitivity
        raise CampaignError(f"{path}: column {shown(cell)}: {error}") from error
    return column, unit.strip()

"""The table of what a result rests on: parameters of a fleet with value, unit and origin, assumed ones tagged."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import Final

from tdacoustic.errors import FleetError
from tdacoustic.fleet import Fleet
from tdacoustic.reporting.document import Cell, Column, Origin, Table
from tdacoustic.reporting.language import say
from tdacoustic.reporting.sections.words import pretty_signs
from tdacoustic.studies.words import number_words, unit_of

__all__ = ["key_words", "keyed_words", "parameter_table", "quantity_of", "uncertain_words", "value_words"]

STANDINGS: Final[Mapping[str, Origin]] = {
    "assumed": "assumed",
    "calibrated": "calculated",
    "measured": "measured",
    "paper": "printed",
    "printed": "printed",
    "synthetic": "synthetic",
}
"""What kind of value it is, by the first word of its origin."""


def key_words(key: str, fleet: Fleet) -> str:
    """Return a dotted key in words; the key itself where the fleet has no such parameter.

    Parameters
    ----------
    key : str
    fleet : Fleet
    """
    if "." not in key:
        return key
    try:
        fleet.value_of(key)
    except FleetError:
        return key
    return number_words(key, fleet)


def keyed_words(key: str, fleet: Fleet) -> str:
    """Return a dotted key in words, with the key in brackets for whoever looks it up in the file."""
    words = key_words(key, fleet)
    return key if words == key else f"{words} ({key})"


def quantity_of(key: str, value: float, stderr: float | None = None) -> str:
    """Return a value with the unit that its key names, and with its standard error where it has one.

    Examples
    --------
    >>> quantity_of("model.structure_gain_db", 5.0748), quantity_of("gear_dynamics.mesh_damping_ratio", 0.5)
    ('5.075 dB', '0.5')
    >>> quantity_of("model.structure_gain_db", 4.8773, 11.83)
    '4.9 ± 12 dB (1 σ)'
    """
    unit = unit_of(key) if "." in key else ""
    after = unit if unit == "°" else f" {unit}".rstrip()
    if stderr is None or not stderr > 0.0:
        return pretty_signs(f"{value:.4g}") + after
    return f"{' ± '.join(uncertain_words(value, stderr))}{after} (1 σ)"


def uncertain_words(value: float, stderr: float) -> tuple[str, str]:
    """Return a value and its standard error: the error to two significant digits, the value as far, or to its own two.

    Parameters
    ----------
    value : float
    stderr : float
        More than 0.

    Examples
    --------
    >>> uncertain_words(4.877326, 11.83), uncertain_words(123.456, 0.0512), uncertain_words(-3.4e8, 2.12e7)
    (('4.9', '12'), ('123.456', '0.051'), ('\N{MINUS SIGN}3.4e8', '2.1e7'))
    """
    of_error = math.floor(math.log10(float(f"{stderr:.1e}"))) - 1
    of_value = math.floor(math.log10(abs(value))) - 1 if value else of_error
    return _to_place(value, min(of_error, of_value)), _to_place(stderr, of_error)


def _to_place(value: float, place: int) -> str:
    """A number rounded to a power of ten, with an exponent where it is very large or very small."""
    rounded = round(value, -place)
    if rounded and not 1e-4 <= abs(rounded) < 1e6:
        digits = max(1, math.floor(math.log10(abs(rounded))) - place + 1)
        return _number(rounded, digits)
    return pretty_signs(f"{rounded:.{max(0, -place)}f}")


def parameter_table(name: str, caption: str, fleet: Fleet, named: Callable[[str], tuple[str, str] | None]) -> Table:
    """Return the table of a fleet's parameters, in the order of its file.

    Parameters
    ----------
    name, caption : str
        Of the table.
    fleet : Fleet
    named : callable
        Words and unit of a dotted key, or None of one that does not belong here.
    """
    rows: list[list[Cell]] = []
    for parameter in fleet.parameters():
        found = None if parameter.value is None else named(parameter.key)
        if found is None:
            continue
        words, unit = found
        assumed = parameter.origin.startswith("assumed")
        origin = parameter.origin.removeprefix("assumed").lstrip(", ").capitalize() if assumed else parameter.origin
        value = value_words(parameter.key, parameter.value)
        quantity = f"{value} {unit}".rstrip()
        if parameter.stderr is not None:
            quantity = f"{f'{_with_error(value, parameter.value, parameter.stderr)} {unit}'.rstrip()} (1 σ)"
        rows.append([words, quantity, _standing(parameter.origin), origin])
    columns = (
        Column("parameter", say("Parameter")),
        Column("value", say("Value")),
        Column("standing", say("Standing"), kind="origin"),
        Column("origin", say("Where it comes from")),
    )
    return Table(name, caption, columns, rows)


def _with_error(words: str, value: object, stderr: float) -> str:
    """A value, in words already, and its standard error; a number is rounded to what the error allows."""
    if isinstance(value, int | float) and stderr > 0.0:
        return " ± ".join(uncertain_words(value, stderr))
    return f"{words} ± {stderr:.2g}"


def _standing(origin: str) -> Origin | None:
    """What kind of value an origin in words says that it is, by its first word; None where that says nothing."""
    return STANDINGS.get(re.split(r"[\s,:;]", origin, maxsplit=1)[0].lower())


def value_words(key: str, value: object) -> str:
    """Return a parameter's value in the unit that its key names.

    Examples
    --------
    >>> value_words("gear_pair.1.teeth", (31, 104)), value_words("gear_dynamics.mass_kg", (60.0, 280.0))
    ('31 : 104', '60, 280')
    >>> value_words("motor.carrier_hz", ((0.0, 400.0), (1000.0, 600.0)))
    '400 at 0 rpm; 600 at 1000 rpm'
    """
    if isinstance(value, tuple) and value and isinstance(value[0], tuple):
        unit = "km/h" if key == "operation.torque_table" else "rpm"
        return "; ".join(
            say("{number} at {speed}", number=_number(row[1]), speed=f"{_number(row[0])} {unit}") for row in value
        )
    if isinstance(value, tuple):
        return (" : " if key.endswith(".teeth") else ", ").join(_number(item) for item in value)
    return _number(value, 7) if isinstance(value, int | float) else str(value)


def _number(value: float, digits: int = 6) -> str:
    return pretty_signs(f"{value:.{digits}g}".replace("e+0", "e").replace("e+", "e"))

"""The table of what a result rests on: parameters of a fleet with value, unit and origin, assumed ones tagged."""

from __future__ import annotations

from collections.abc import Callable

from tdacoustic.errors import FleetError
from tdacoustic.fleet import Fleet
from tdacoustic.reporting.document import Cell, Column, Table
from tdacoustic.reporting.language import say
from tdacoustic.reporting.sections.words import pretty_signs
from tdacoustic.studies.words import number_words, unit_of

__all__ = ["key_words", "keyed_words", "parameter_table", "quantity_of", "value_words"]


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


def quantity_of(key: str, value: float) -> str:
    """Return a value with the unit that its key names.

    Examples
    --------
    >>> quantity_of("model.structure_gain_db", 5.0748), quantity_of("gear_dynamics.mesh_damping_ratio", 0.5)
    ('5.075 dB', '0.5')
    """
    unit = unit_of(key) if "." in key else ""
    return pretty_signs(f"{value:.4g}") + (unit if unit == "°" else f" {unit}".rstrip())


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
        if parameter.stderr is not None:
            value += f" ± {parameter.stderr:.2g}"
        rows.append([words, f"{value} {unit}".rstrip(), "assumed" if assumed else None, origin])
    columns = (
        Column("parameter", say("Parameter")),
        Column("value", say("Value")),
        Column("standing", say("Standing"), kind="origin"),
        Column("origin", say("Where it comes from")),
    )
    return Table(name, caption, columns, rows)


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

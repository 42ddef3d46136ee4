"""The table of what a result rests on: parameters of a fleet with value, unit and origin, assumed ones tagged."""

from __future__ import annotations

from collections.abc import Callable

from tdacoustic.fleet import Fleet
from tdacoustic.reporting.document import Cell, Column, Table

__all__ = ["parameter_table", "value_words"]


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
        Column("parameter", "Parameter"),
        Column("value", "Value"),
        Column("standing", "Standing", kind="origin"),
        Column("origin", "Where it comes from"),
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
        speed = "km/h" if key == "operation.torque_table" else "rpm"
        return "; ".join(f"{_number(row[1])} at {_number(row[0])} {speed}" for row in value)
    if isinstance(value, tuple):
        return (" : " if key.endswith(".teeth") else ", ").join(_number(item) for item in value)
    return _number(value, 7) if isinstance(value, int | float) else str(value)


def _number(value: float, digits: int = 6) -> str:
    return f"{value:.{digits}g}".replace("e+0", "e").replace("e+", "e")

"""Kinds of values of a fleet file: fractions, triples, stiffnesses, tables over motor speed."""

from __future__ import annotations

import bisect
import itertools
import math
from collections.abc import Callable
from typing import Annotated, Any

from pydantic import Field, PlainValidator

from tdacoustic.toml_models import Positive, shown

__all__ = [
    "Angle",
    "DampingRatio",
    "FluxDensities",
    "LossFactor",
    "OverSpeed",
    "Pair",
    "Point",
    "SoundPower",
    "SpeedTable",
    "Stiffness",
    "Triple",
    "ascending",
    "at_speed",
]

Pair = tuple[Positive, Positive]
"""Of pinion and wheel."""

Triple = tuple[Positive, Positive, Positive]
"""Along x, y, z."""

Point = tuple[float, float, float]
"""x, y, z."""

Angle = Annotated[float, Field(ge=0.0, le=45.0)]
"""A helix angle in degrees; the hand of the helix is not stated."""

DampingRatio = Annotated[float, Field(ge=0.0, le=1.0)]
"""Over critical damping."""

LossFactor = Annotated[float, Field(gt=0.0, le=1.0)]
"""Of a structure; never zero, which would make it singular at resonance."""

SpeedTable = tuple[tuple[float, ...], ...]
"""Rows of motor speed in rpm and values there, speeds ascending."""


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def ascending(rows: tuple[tuple[float, ...], ...], what: str) -> None:
    """Check that the first column begins at zero or above and ascends.

    Raises
    ------
    ValueError
        It does not; the message begins with "must".
    """
    if rows[0][0] < 0.0:
        raise ValueError(f"must have {what} >= 0 in its first column, got {shown(rows[0])}")
    for row, following in itertools.pairwise(rows):
        if not row[0] < following[0]:
            raise ValueError(f"must ascend in {what}, got {row[0]:g} and then {following[0]:g}")


def _over_speed(columns: tuple[str, ...], lowest: float | None) -> Callable[[Any], Any]:
    """Return the check of a constant or a table over motor speed, with one value or several."""
    many = len(columns) > 1
    constant = f"[{', '.join(columns)}]" if many else f"a number in {columns[0]}"
    form = f"{constant} or rows [rpm, {', '.join(columns)}]"

    def row_of(row: Any, length: int) -> tuple[float, ...] | None:
        if isinstance(row, tuple) and len(row) == length and all(_is_number(number) for number in row):
            return tuple(float(number) for number in row)
        return None

    def not_below(numbers: tuple[float, ...]) -> None:
        if lowest is not None and min(numbers) < lowest:
            raise ValueError(f"must be >= {lowest:g}, got {min(numbers):g}")

    def check(value: Any) -> Any:
        single = row_of(value, len(columns)) if many else row_of((value,), 1)
        if single is not None:
            not_below(single)
            return single if many else single[0]
        rows = tuple(row_of(row, len(columns) + 1) for row in value) if isinstance(value, tuple) else ()
        found = tuple(row for row in rows if row is not None)
        if not found or len(found) < len(rows):
            raise ValueError(f"must be {form}, got {shown(value)}")
        not_below(tuple(number for row in found for number in row[1:]))
        ascending(found, "rpm")
        return found

    return check


OverSpeed = Annotated[float | SpeedTable, PlainValidator(_over_speed(("Hz",), 0.0))]
"""A frequency in Hz, constant or ``[[rpm, Hz], ...]``; 0 Hz says that there is none."""

SoundPower = Annotated[float | SpeedTable, PlainValidator(_over_speed(("dB",), None))]
"""A sound power level re 1 pW, constant or ``[[rpm, dB], ...]``."""

FluxDensities = Annotated[tuple[float, float] | SpeedTable, PlainValidator(_over_speed(("B1", "B2"), 0.0))]
"""Two peak flux densities in T, constant or ``[[rpm, B1, B2], ...]``."""


def _stiffness(value: Any) -> Any:
    entries = value if isinstance(value, tuple) else (value,) * 3
    if len(entries) != 3 or not all(_is_number(entry) for entry in entries):
        raise ValueError(f"must be a number or [x, y, z], got {shown(value)}")
    if min(entries) <= 0.0:
        raise ValueError(f"must be > 0, got {shown(value)}")
    return tuple(float(entry) for entry in entries)


Stiffness = Annotated[tuple[float, float, float], PlainValidator(_stiffness)]
"""In N/m along x, y, z; one number stands for all three."""


def at_speed(table: SpeedTable, motor_speed_rpm: float) -> tuple[float, ...] | None:
    """Return the values of a table at a motor speed, linear between its rows.

    Outside of its speeds a table says nothing, and nothing is held or extrapolated:
    an inverter changes its pulse pattern, and near rated speed it has no carrier at all.

    Parameters
    ----------
    table : tuple of (float, ...)
        Rows of rpm and values.
    motor_speed_rpm : float

    Returns
    -------
    tuple of float or None
        None outside of the table.

    Examples
    --------
    >>> at_speed(((0.0, 400.0), (1000.0, 600.0)), 500.0)
    (500.0,)
    >>> at_speed(((0.0, 400.0), (1000.0, 600.0)), 1938.0) is None
    True
    """
    speeds = [row[0] for row in table]
    if not speeds[0] <= motor_speed_rpm <= speeds[-1]:
        return None
    above = bisect.bisect_left(speeds, motor_speed_rpm)
    if speeds[above] == motor_speed_rpm:
        return table[above][1:]
    low, high = table[above - 1], table[above]
    part = (motor_speed_rpm - low[0]) / (high[0] - low[0])
    return tuple(a + part * (b - a) for a, b in zip(low[1:], high[1:], strict=True))

"""From the unit in a key to SI."""

from __future__ import annotations

import math
from typing import Any, Final

__all__ = ["si_value"]

_FACTORS: Final = {
    "_mm": 1e-3,
    "_um": 1e-6,
    "_deg": math.pi / 180.0,
    "_km_h": 1.0 / 3.6,
    "_kw": 1e3,
    "_gpa": 1e9,
    "_percent": 1e-2,
}

_ZERO_CELSIUS_K: Final = 273.15


def si_value(key: str, value: Any) -> Any:
    """Return a value, or each number of a list, in SI units by the suffix of its key.

    Rows of tables, texts and values whose key names an SI unit, or none, are returned as they are.

    Examples
    --------
    >>> si_value("gear_pair.1.face_width_mm", 120.0)
    0.12
    >>> si_value("radiation.temperature_degc", 20.0)
    293.15
    """
    if isinstance(value, tuple):
        return tuple(si_value(key, entry) for entry in value) if not _has_rows(value) else value
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value
    if key.endswith("_degc"):
        return value + _ZERO_CELSIUS_K
    factor = next((factor for suffix, factor in _FACTORS.items() if key.endswith(suffix)), None)
    return value if factor is None else value * factor


def _has_rows(value: tuple[Any, ...]) -> bool:
    return any(isinstance(entry, tuple) for entry in value)

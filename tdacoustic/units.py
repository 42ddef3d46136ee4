"""Unit spellings, reference values and decibels.

The table of spellings is closed: a spelling that is not in it is refused, never
guessed. Inside the program every signal is in SI; rotational speed is in
revolutions per second.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from tdacoustic.errors import UnitError

__all__ = [
    "QUANTITIES",
    "QUANTITY_SI_SYMBOL",
    "REFERENCES",
    "STANDARD_GRAVITY_M_S2",
    "Sensitivity",
    "Unit",
    "level_db",
    "parse_full_scale",
    "parse_sensitivity",
    "parse_unit",
    "quantity_of_unit",
    "reference_label",
]

STANDARD_GRAVITY_M_S2: Final = 9.80665
"""Standard acceleration of gravity (exact, CGPM 1901)."""

PSI_PA: Final = 6894.757293168361
"""Pound-force per square inch in Pa (0.45359237 kg x 9.80665 m/s² / (0.0254 m)²)."""


@dataclass(frozen=True)
class Unit:
    """One unit: ``value_si = value * factor + offset``.

    Parameters
    ----------
    symbol : str
        Display spelling.
    si_symbol : str
        Symbol of the SI unit the factor leads to; two units measure the same
        thing exactly when this symbol is the same.
    factor, offset : float
        Conversion to SI.
    """

    symbol: str
    si_symbol: str
    factor: float
    offset: float = 0.0


def _table() -> dict[str, Unit]:
    rows: list[tuple[str, str, float, float]] = [  # spellings, SI symbol, factor, offset
        ("Pa pascal Pascal PA pascals Pascals", "Pa", 1.0, 0.0),
        ("hPa mbar", "Pa", 100.0, 0.0),
        ("kPa", "Pa", 1e3, 0.0),
        ("MPa", "Pa", 1e6, 0.0),
        ("mPa", "Pa", 1e-3, 0.0),
        ("uPa", "Pa", 1e-6, 0.0),
        ("bar", "Pa", 1e5, 0.0),
        ("psi", "Pa", PSI_PA, 0.0),
        ("m/s2 m*s-2 ms-2 m/s/s m/sec2 m/(s2) (m/s2)", "m/s^2", 1.0, 0.0),
        ("mm/s2", "m/s^2", 1e-3, 0.0),
        ("um/s2", "m/s^2", 1e-6, 0.0),
        ("g gn g0 G", "m/s^2", STANDARD_GRAVITY_M_S2, 0.0),
        ("mg", "m/s^2", 1e-3 * STANDARD_GRAVITY_M_S2, 0.0),
        ("rpm RPM r/min rev/min 1/min min-1 /min tr/min U/min 1/Min rot/min", "1/s", 1.0 / 60.0, 0.0),
        ("Hz hz HZ 1/s s-1 r/s rev/s rps", "1/s", 1.0, 0.0),
        ("kHz", "1/s", 1e3, 0.0),
        ("rad/s", "1/s", 1.0 / (2.0 * math.pi), 0.0),
        ("deg/s", "1/s", 1.0 / 360.0, 0.0),
        ("m/s", "m/s", 1.0, 0.0),
        ("mm/s", "m/s", 1e-3, 0.0),
        ("km/h kph kmh km/hr", "m/s", 1.0 / 3.6, 0.0),
        ("V volt Volt v volts Volts", "V", 1.0, 0.0),
        ("mV", "V", 1e-3, 0.0),
        ("uV", "V", 1e-6, 0.0),
        ("kV", "V", 1e3, 0.0),
        ("A ampere Ampere amperes Amperes amps Amps", "A", 1.0, 0.0),
        ("mA", "A", 1e-3, 0.0),
        ("kA", "A", 1e3, 0.0),
        ("pC", "C", 1e-12, 0.0),
        ("N newton", "N", 1.0, 0.0),
        ("kN", "N", 1e3, 0.0),
        ("N*m Nm Newton-meter", "N m", 1.0, 0.0),
        ("kN*m kNm", "N m", 1e3, 0.0),
        ("K kelvin", "K", 1.0, 0.0),
        ("degC C °C celsius", "K", 1.0, 273.15),
        ("degF °F F", "K", 5.0 / 9.0, 273.15 - 32.0 * 5.0 / 9.0),
        ("s sec", "s", 1.0, 0.0),
        ("ms", "s", 1e-3, 0.0),
        ("us", "s", 1e-6, 0.0),
        ("min", "s", 60.0, 0.0),
        ("m", "m", 1.0, 0.0),
        ("mm", "m", 1e-3, 0.0),
        ("um", "m", 1e-6, 0.0),
        ("% percent", "1", 1e-2, 0.0),
        ("1 - none None NONE", "1", 1.0, 0.0),
    ]
    return {
        spelling: Unit(spellings.split()[0], si_symbol, factor, offset)
        for spellings, si_symbol, factor, offset in rows
        for spelling in spellings.split()
    }


_UNITS: Final = MappingProxyType(_table())
_ELECTRICAL: Final = frozenset({"V", "C", "A"})

QUANTITY_SI_SYMBOL: Final = MappingProxyType(
    {
        "acceleration": "m/s^2",
        "sound_pressure": "Pa",
        "speed": "1/s",
        "torque": "N m",
        "current": "A",
        "voltage": "V",
        "force": "N",
        "temperature": "K",
    }
)
"""SI symbol of each quantity that has one; a speed may also be a train's, in m/s."""

QUANTITIES: Final = (*QUANTITY_SI_SYMBOL, "tacho", "other")
"""Every quantity a channel can have."""

REFERENCES: Final = MappingProxyType({"sound_pressure": 20e-6, "acceleration": 1e-6, "sound_power": 1e-12})
"""Reference values of levels (ISO 1683): Pa, m/s², W."""

_REFERENCE_LABELS: Final = MappingProxyType(
    {"sound_pressure": "20 uPa", "acceleration": "1 um/s^2", "sound_power": "1 pW"}
)


def _normalised(spelling: str) -> str:
    text = spelling.strip().replace("²", "2").replace("³", "3").replace("µ", "u").replace("μ", "u")
    text = (
        text.replace("·", "*").replace("⋅", "*").replace("**", "").replace("^", "").replace("⁻", "-").replace("¹", "1")
    )
    return re.sub(r"\s+", "*" if re.fullmatch(r"k?N\s+m|m\s+s-?2", text) else "", text)


def parse_unit(spelling: str) -> Unit:
    """Look a unit's spelling up in the closed table.

    Parameters
    ----------
    spelling : str
        As a logger or a user writes it: ``"m/s²"``, ``"m/s^2"``, ``"g"``, ``"tr/min"``.

    Returns
    -------
    Unit

    Raises
    ------
    UnitError
        The spelling is not in the table.

    Examples
    --------
    >>> parse_unit("g").factor
    9.80665
    >>> parse_unit("m/s²").si_symbol
    'm/s^2'
    """
    unit = _UNITS.get(_normalised(spelling))
    if unit is None:
        raise UnitError(
            f"unit {spelling!r} is not known; known are for example Pa, m/s^2, g, V, mV, rpm, Hz, km/h, N m, A, degC"
        )
    return unit


def quantity_of_unit(spelling: str | None) -> str | None:
    """Return the quantity a unit implies, or None where it implies none (or is unknown).

    Examples
    --------
    >>> quantity_of_unit("Pa"), quantity_of_unit("rpm"), quantity_of_unit("1")
    ('sound_pressure', 'speed', None)
    """
    if spelling is None:
        return None
    unit = _UNITS.get(_normalised(spelling))
    if unit is None:
        return None
    if unit.si_symbol == "m/s" and unit.symbol == "km/h":
        return "speed"
    return next((quantity for quantity, symbol in QUANTITY_SI_SYMBOL.items() if symbol == unit.si_symbol), None)


@dataclass(frozen=True)
class Sensitivity:
    """A sensor's sensitivity in SI: electrical SI units per physical SI unit."""

    electrical_per_physical: float
    electrical_si_symbol: str
    physical_si_symbol: str


_NUMBER = r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"


def parse_sensitivity(text: str) -> Sensitivity:
    """Read a sensitivity such as ``"10.2 mV/(m/s^2)"``, ``"50 mV/Pa"`` or ``"100 mV/g"``.

    Raises
    ------
    UnitError
        Not of the form *number electrical-unit/physical-unit*, or not positive.

    Examples
    --------
    >>> parse_sensitivity("50 mV/Pa").electrical_per_physical
    0.05
    """
    match = re.fullmatch(rf"\s*{_NUMBER}\s*([^/\s]+)\s*/\s*(.+?)\s*", text)
    if match is None:
        raise UnitError(f"sensitivity {text!r} is not of the form '50 mV/Pa' or '10.2 mV/(m/s^2)'")
    value, electrical_text, physical_text = match.groups()
    if physical_text.startswith("(") and physical_text.endswith(")"):
        physical_text = physical_text[1:-1]
    electrical, physical = parse_unit(electrical_text), parse_unit(physical_text)
    if electrical.si_symbol not in _ELECTRICAL:
        raise UnitError(f"sensitivity {text!r}: {electrical_text!r} is no electrical unit (V, mV, pC, mA)")
    number = float(value)
    if not (math.isfinite(number) and number > 0):
        raise UnitError(f"sensitivity {text!r} must be positive")
    return Sensitivity(number * electrical.factor / physical.factor, electrical.si_symbol, physical.si_symbol)


def parse_full_scale(text: str) -> tuple[float, Unit]:
    """Read a full scale such as ``"20 Pa"``; returns the number and its unit.

    Raises
    ------
    UnitError
        Not of the form *number unit*, or not positive.
    """
    match = re.fullmatch(rf"\s*{_NUMBER}(?:\s+|(?=[^\d\s.eE+-]))(\S.*?)\s*", text)
    if match is None:
        raise UnitError(f"full_scale {text!r} is not of the form '20 Pa'")
    number, unit = float(match.group(1)), parse_unit(match.group(2))
    if not (math.isfinite(number) and number > 0):
        raise UnitError(f"full_scale {text!r} must be positive")
    return number, unit


def level_db(rms: float, quantity: str) -> float | None:
    """Level of an rms value, or None where the quantity has no reference or the value is not positive.

    Examples
    --------
    >>> round(level_db(1.0, "sound_pressure"), 2)
    93.98
    """
    reference = REFERENCES.get(quantity)
    if reference is None or not (math.isfinite(rms) and rms > 0.0):
        return None
    return 20.0 * math.log10(rms / reference)


def reference_label(quantity: str) -> str | None:
    """Return the reference of a quantity's level in words (``"20 uPa"``), or None."""
    return _REFERENCE_LABELS.get(quantity)

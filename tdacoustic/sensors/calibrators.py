"""Calibrators: what they give, at which frequency, and the mistakes that are made about them."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Final

from tdacoustic.errors import UnitError
from tdacoustic.units import QUANTITY_SI_SYMBOL, REFERENCES, level_db, parse_unit

__all__ = [
    "FREQUENCY_TOLERANCE",
    "LIMIT_DB",
    "USUAL_FREQUENCIES_HZ",
    "Calibrator",
    "likely_mistake",
    "parse_calibrator",
    "sensitivity_doubt",
]

LIMIT_DB: Final = 0.5
"""Between two calibrator checks, and from the stated sensitivity. ISO 3095 and ISO 3381 do not accept results between
two checks that differ by more; for a single check against a stated sensitivity the same limit is used [assumed]."""

FREQUENCY_TOLERANCE: Final = 0.02
"""Of the stated or usual frequency. IEC 60942:2017 allows a class 1 calibrator 0.7 %, and a logger's clock adds
nothing that counts; the rest is room for calibrators of no class [assumed]."""

USUAL_FREQUENCIES_HZ: Final = {"sound_pressure": (1000.0, 250.0), "acceleration": (159.155, 79.577, 15.9155)}
"""Of sound calibrators and pistonphones (IEC 60942 names 160 Hz to 1.25 kHz as the range of all classes); of vibration
calibrators: 1000, 500 and 100 rad/s."""

CALIBRATOR_SIGMA_DB: Final = {"sound_pressure": 0.25 / math.sqrt(3.0), "acceleration": 0.26 / math.sqrt(3.0)}
"""Standard uncertainty of what a calibrator gives: the class 1 acceptance limit of IEC 60942:2017 from 160 Hz to
1.25 kHz, 0.25 dB, taken as evenly likely; for vibration 3 % [assumed, as data sheets of field calibrators say]."""

_FACTORS: Final = {"rms": 1.0, "peak": 1.0 / math.sqrt(2.0), "pp": 0.5 / math.sqrt(2.0)}
_DECIBELS: Final = re.compile(r"([-+]?\d+(?:\.\d+)?)\s*dB(?:\s*\(?\s*re\s*20\s*[uµμ]Pa\s*\)?)?", re.IGNORECASE)
_VALUE: Final = re.compile(r"(\d+(?:\.\d*)?(?:[eE][-+]?\d+)?)\s*([^\d\s.,].*?)(?:\s+(rms|peak|pp))?")
_HIGHEST_DB: Final = 180.0


@dataclass(frozen=True)
class Calibrator:
    """What a calibrator gives.

    Parameters
    ----------
    words : str
        As stated.
    quantity : str
        ``"sound_pressure"`` or ``"acceleration"``.
    rms : float
        In SI.
    """

    words: str
    quantity: str
    rms: float

    @property
    def level_db(self) -> float:
        """Its level re 20 uPa or 1 um/s²."""
        level = level_db(self.rms, self.quantity)
        assert level is not None
        return level

    @property
    def usual_hz(self) -> tuple[float, ...]:
        """Frequencies that such calibrators usually have."""
        return USUAL_FREQUENCIES_HZ[self.quantity]

    @property
    def sigma_db(self) -> float:
        """Standard uncertainty of what it gives [assumed to be of class 1]."""
        return CALIBRATOR_SIGMA_DB[self.quantity]


def parse_calibrator(text: str) -> Calibrator:
    """Read what a calibrator gives: ``"94 dB"`` (re 20 uPa), ``"1 Pa"``, ``"10 m/s^2"``, ``"1 g peak"``.

    A value is rms unless ``peak`` or ``pp`` stands behind it.

    Raises
    ------
    UnitError
        Not of this form, not positive, or of a quantity that no calibrator gives.

    Examples
    --------
    >>> round(parse_calibrator("94 dB").rms, 4), parse_calibrator("1 g peak").quantity
    (1.0024, 'acceleration')
    """
    words = " ".join(text.split())
    decibels = _DECIBELS.fullmatch(words)
    if decibels is not None:
        level = float(decibels[1])
        if not 0.0 < level <= _HIGHEST_DB:
            raise UnitError(f"calibrator {text!r}: {level:g} dB re 20 uPa is no level of a sound calibrator")
        return Calibrator(words, "sound_pressure", REFERENCES["sound_pressure"] * 10.0 ** (0.05 * level))
    found = _VALUE.fullmatch(words)
    if found is None:
        raise UnitError(f"calibrator {text!r} is not of the form '94 dB', '10 m/s^2' or '1 g peak'")
    unit = parse_unit(found[2])
    quantities = {QUANTITY_SI_SYMBOL[name]: name for name in USUAL_FREQUENCIES_HZ}
    if unit.si_symbol not in quantities:
        raise UnitError(f"calibrator {text!r}: {found[2]!r} is neither a sound pressure nor an acceleration")
    rms = float(found[1]) * unit.factor * _FACTORS[found[3] or "rms"]
    if not (math.isfinite(rms) and rms > 0.0):
        raise UnitError(f"calibrator {text!r} must be positive")
    return Calibrator(words, quantities[unit.si_symbol], rms)


_FACTOR_TEN: Final = {
    "sound_pressure": "a 94 dB calibrator taken for one of 114 dB or the reverse, or a factor of ten in a sensitivity",
    "acceleration": "a factor of ten in a sensitivity (10 and 100 mV/g), or g taken for m/s^2 (19.8 dB)",
}
_MISTAKES: Final = (
    (3.01, "a peak value taken for an rms value"),
    (6.02, "a factor of two"),
    (9.03, "a peak-to-peak value taken for an rms value"),
    (30.0, "a 94 dB calibrator taken for one of 124 dB or the reverse"),
    (40.0, "a factor of a hundred"),
    (60.0, "a factor of a thousand (V for mV)"),
)
_MISTAKE_TOLERANCE_DB: Final = 0.5


def likely_mistake(deviation_db: float, quantity: str) -> str | None:
    """Name the mistake that usually makes a deviation of this size, or return None.

    Examples
    --------
    >>> likely_mistake(-20.1, "sound_pressure")
    'a 94 dB calibrator taken for one of 114 dB or the reverse, or a factor of ten in a sensitivity'
    >>> likely_mistake(1.7, "sound_pressure") is None
    True
    """
    size = abs(deviation_db)
    if abs(size - 20.0) <= _MISTAKE_TOLERANCE_DB:
        return _FACTOR_TEN.get(quantity, "a factor of ten")
    near = [(abs(size - at), words) for at, words in _MISTAKES if abs(size - at) <= _MISTAKE_TOLERANCE_DB]
    if not near or (quantity != "sound_pressure" and "dB" in min(near)[1]):
        return None
    return min(near)[1]


_PLAUSIBLE: Final = {"sound_pressure": (2e-4, 0.15), "acceleration": (5e-5, 0.12)}
"""Sensitivities in V/Pa and V/(m/s²): of a quarter-inch pressure microphone to more than a one-inch one; 0.5 mV/g to
more than 1 V/g [assumed, from data sheets]."""


def sensitivity_doubt(volts_per_si: float, quantity: str) -> str | None:
    """Say that a sensitivity is of no usual sensor, or return None.

    Parameters
    ----------
    volts_per_si : float
        In V/Pa or V/(m/s²).
    quantity : str

    Examples
    --------
    >>> sensitivity_doubt(0.05, "sound_pressure") is None
    True
    >>> sensitivity_doubt(0.5, "sound_pressure")
    '500 mV/Pa is more than sensors have; is the calibrator one of 20 dB more or less, or is there a gain?'
    """
    low, high = _PLAUSIBLE.get(quantity, (0.0, math.inf))
    if low <= volts_per_si <= high:
        return None
    unit = "Pa" if quantity == "sound_pressure" else "(m/s^2)"
    side = "less" if volts_per_si < low else "more"
    doubt = "is the calibrator one of 20 dB more or less, or is there a gain?"
    if quantity != "sound_pressure":
        doubt = "is the calibrator's value right, or is there a gain?"
    return f"{1e3 * volts_per_si:.4g} mV/{unit} is {side} than sensors have; {doubt}"

"""From a log's numbers to SI: ``value_si = number * gain + offset``."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

from tdacoustic.campaign.scale import ELECTRICAL_SYMBOLS, Scale, physical_unit_text, si_symbols
from tdacoustic.errors import UnitError
from tdacoustic.recording import LogChannel
from tdacoustic.units import Unit, parse_full_scale, parse_sensitivity, parse_unit, quantity_of_unit

__all__ = ["Conversion", "convert"]

_UNSCALED: Final = ("tacho", "other")

_EXAMPLE_UNIT: Final = {
    "acceleration": "m/s^2",
    "sound_pressure": "Pa",
    "speed": "rpm",
    "torque": "N m",
    "current": "A",
    "voltage": "V",
    "force": "N",
    "temperature": "degC",
}


@dataclass(frozen=True)
class Conversion:
    """How a log's numbers become SI.

    Parameters
    ----------
    quantity : str
    si_symbol : str
    gain, offset : float
        ``value_si = number * gain + offset``.
    scaling : str
        The conversion in words.
    warnings : tuple of str
        What is doubtful about it.
    """

    quantity: str
    si_symbol: str
    gain: float
    offset: float
    scaling: str
    warnings: tuple[str, ...] = ()

    def limits(self, numbers: tuple[float, float] | None) -> tuple[float, float] | None:
        """Convert a pair of limits, smaller first."""
        if numbers is None:
            return None
        low, high = sorted(number * self.gain + self.offset for number in numbers)
        return low, high


@dataclass(frozen=True)
class _Numbers:
    """What one unit of a log's number is, before a sensitivity."""

    unit: Unit
    spelling: str
    factor: float
    words: str
    warnings: tuple[str, ...] = ()


def _known(spelling: str | None) -> Unit | None:
    if spelling is None:
        return None
    try:
        return parse_unit(spelling)
    except UnitError:
        return None


def _example(scale: Scale, log: LogChannel) -> str:
    quantity = scale.stated_quantity() or log.quantity
    return _EXAMPLE_UNIT.get(quantity or "", "Pa")


def _fractions(log: LogChannel, scale: Scale, place: str) -> _Numbers | None:
    """Read numbers that are fractions of a full scale that the log does not state."""
    full_scale = log.full_scale or 1.0
    if scale.full_scale is not None:
        number, unit = parse_full_scale(scale.full_scale)
        return _Numbers(unit, unit.symbol, number / full_scale, f"full scale {scale.full_scale} at {full_scale:g}")
    if scale.unit is not None:
        said = (
            "numbers are fractions of full scale"
            if full_scale == 1.0
            else f"numbers reach {full_scale:g} at full scale"
        )
        warning = f'{said}; 1.0 is taken as 1 {scale.unit} because unit = "{scale.unit}"'
        return _Numbers(parse_unit(scale.unit), scale.unit, 1.0, f"1.0 in the log taken as 1 {scale.unit}", (warning,))
    if (scale.quantity or log.quantity) in _UNSCALED:
        return None
    unit_text = "10 V" if scale.sensitivity is not None else f"20 {_example(scale, log)}"
    raise UnitError(
        f"numbers are fractions of a full scale ({full_scale:g}) that the log does not state, "
        f'add full_scale = "{unit_text}" (with the right number) to {place}'
    )


def _assumed_full_scale(log: LogChannel, text: str) -> _Numbers:
    unit = _known(log.unit)
    if unit is not None and unit.si_symbol != "1":
        raise UnitError(
            f"full_scale = {text!r} is for numbers without a unit, but the log's are in {log.unit} already; "
            "leave full_scale out"
        )
    number, full_unit = parse_full_scale(text)
    warning = f"the log does not say which number is full scale; 1.0 is taken as {text}"
    return _Numbers(full_unit, full_unit.symbol, number, f"full scale {text} at 1", (warning,))


def _plain(log: LogChannel, scale: Scale, place: str) -> _Numbers | None:
    """Read numbers that are in a unit, the campaign's or the log's."""
    if scale.unit is not None:
        unit, logged = parse_unit(scale.unit), _known(log.unit)
        warnings: tuple[str, ...] = ()
        if logged is not None and logged.si_symbol != "1" and replace(logged, symbol="") != replace(unit, symbol=""):
            warnings = (f"the log says {log.unit}, but unit = {scale.unit!r} is used as stated",)
        return _Numbers(unit, scale.unit, 1.0, f"log in {scale.unit}", warnings)
    unscaled = (scale.quantity or log.quantity) in _UNSCALED
    known = _known(log.unit)
    if known is not None and log.unit is not None:
        return _Numbers(known, log.unit, 1.0, f"log in {log.unit}")
    if unscaled:
        return None
    example = "V" if scale.sensitivity is not None else _example(scale, log)
    if log.unit is None:
        raise UnitError(f'the log states no unit, add unit = "{example}" (or what it is) to {place}')
    raise UnitError(f'the log\'s unit {log.unit!r} is not known, add unit = "{example}" (or what it is) to {place}')


def _numbers(log: LogChannel, scale: Scale, place: str) -> _Numbers | None:
    if log.full_scale is not None:
        return _fractions(log, scale, place)
    if scale.full_scale is not None:
        return _assumed_full_scale(log, scale.full_scale)
    return _plain(log, scale, place)


def _quantity(log: LogChannel, scale: Scale, numbers: _Numbers | None) -> tuple[str, tuple[str, ...]]:
    stated = scale.stated_quantity()
    logged = None if log.quantity == "other" else log.quantity
    if stated is not None:
        doubtful = logged not in (None, stated, "voltage")
        return stated, (f"the log says {logged}, {stated} is used as stated",) if doubtful else ()
    if logged is not None:
        return logged, ()
    if numbers is None:
        return log.quantity or "other", ()
    implied = quantity_of_unit(numbers.spelling)
    if implied == "voltage" or numbers.unit.si_symbol == "C":
        kept = implied or "other"
        doubt = f"numbers in {numbers.spelling} are kept as {kept}; a sensor's channel needs quantity and sensitivity"
        return kept, (doubt,)
    return implied or "other", ()


def convert(log: LogChannel, scale: Scale, place: str = "its [[channel]]") -> Conversion:
    """Find the conversion of one channel to SI.

    The quantity is the stated one, else the one that sensitivity, full scale or
    unit imply, else the log's, else the one its unit implies, else ``other``.

    Parameters
    ----------
    log : LogChannel
    scale : Scale
        What the user states.
    place : str
        Where a missing key is to be added, for messages.

    Returns
    -------
    Conversion

    Raises
    ------
    UnitError
        Something is missing, not known, or of another quantity; the message says which key would help.

    Examples
    --------
    >>> from tdacoustic.recording import Raster
    >>> mic = LogChannel("mic", Raster(48000.0, 10), full_scale=1.0)
    >>> convert(mic, Scale(full_scale="20 Pa")).gain
    20.0
    """
    scale.check()
    numbers = _numbers(log, scale, place)
    quantity, doubts = _quantity(log, scale, numbers)
    if numbers is None:
        if log.unit is not None and log.full_scale is None:
            doubts = (*doubts, f"the log's unit {log.unit!r} is not known; numbers are used as they are")
        return Conversion(quantity, "1", 1.0, 0.0, "numbers as in the log", doubts)
    warnings = (*numbers.warnings, *doubts)
    allowed = si_symbols(quantity)
    if scale.sensitivity is not None:
        return _through_sensitivity(quantity, scale.sensitivity, numbers, warnings, place)
    unit = numbers.unit
    if quantity == "tacho" and unit.si_symbol in ("1/s", "m/s"):
        raise UnitError(
            f'a tacho gives pulses, but the numbers are in {numbers.spelling}: say quantity = "speed" in {place}'
        )
    if allowed is not None and unit.si_symbol not in allowed:
        example = _EXAMPLE_UNIT[quantity]
        if unit.si_symbol in ELECTRICAL_SYMBOLS:
            raise UnitError(
                f"{quantity} in {numbers.spelling} needs a sensitivity, "
                f'add sensitivity = "... {numbers.spelling}/{f"({example})" if "/" in example else example}" to {place}'
            )
        raise UnitError(
            f"{quantity} cannot be in {numbers.spelling}: correct quantity, or add unit = {example!r} to {place}"
        )
    gain = numbers.factor * unit.factor
    words = numbers.words if gain == 1.0 and unit.offset == 0.0 else f"{numbers.words}, x {gain:.6g}"
    if unit.offset:
        words += f" + {unit.offset:.6g}"
    return Conversion(quantity, unit.si_symbol, gain, unit.offset, words, warnings)


def _through_sensitivity(
    quantity: str, text: str, numbers: _Numbers, warnings: tuple[str, ...], place: str
) -> Conversion:
    sensitivity, unit = parse_sensitivity(text), numbers.unit
    electrical = sensitivity.electrical_si_symbol
    if unit.si_symbol != electrical:
        raise UnitError(
            f"sensitivity = {text!r} is for {electrical}, but the log's numbers are in {numbers.spelling}: "
            f'leave it out, or add unit = "{electrical}" to {place}'
        )
    allowed = si_symbols(quantity)
    if allowed is not None and sensitivity.physical_si_symbol not in allowed:
        raise UnitError(f"sensitivity = {text!r} does not fit quantity {quantity!r}; correct one of them in {place}")
    ratio = sensitivity.electrical_per_physical
    # 10 mV/degC gives 0 V at 0 degC, not at 0 K
    zero = parse_unit(physical_unit_text(text)).offset
    physical = sensitivity.physical_si_symbol
    words = f"{ratio:.6g} {electrical}/{f'({physical})' if '/' in physical else physical}; {numbers.words}"
    gain = numbers.factor * unit.factor / ratio
    return Conversion(quantity, physical, gain, unit.offset / ratio + zero, words, warnings)

"""Scales that do not stand in a ``[[channel]]``: from a sensor database, or from a calibrator's recording."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

from tdacoustic.campaign.scale import ELECTRICAL_SYMBOLS, Scale, full_scale_of
from tdacoustic.errors import UnitError
from tdacoustic.ingest.conversion import Conversion, convert
from tdacoustic.recording import LogChannel
from tdacoustic.units import parse_unit

__all__ = ["FULL_SCALE", "NUMBER", "CalibratedScale", "KnownScale", "NumberUnit", "is_physical", "number_unit"]

FULL_SCALE: Final = "full scale"
"""Unit of numbers that are fractions of a full scale that nobody states."""
NUMBER: Final = "number"
"""Unit of numbers of which nothing is known."""


@dataclass(frozen=True)
class NumberUnit:
    """What a log's numbers are before any sensitivity.

    Parameters
    ----------
    unit : str
        SI symbol, `FULL_SCALE` or `NUMBER`.
    factor : float
        The log's number times this is in `unit`.
    """

    unit: str
    factor: float


def number_unit(log: LogChannel, scale: Scale) -> NumberUnit:
    """Return what a log's numbers are, as far as log and campaign say; never an error.

    Examples
    --------
    >>> from tdacoustic.recording import Raster
    >>> number_unit(LogChannel("mic", Raster(48000.0, 10), unit="mV"), Scale())
    NumberUnit(unit='V', factor=0.001)
    >>> number_unit(LogChannel("mic", Raster(48000.0, 10), full_scale=32768.0), Scale()).unit
    'full scale'
    """
    if scale.full_scale is not None:
        number, unit = full_scale_of(scale.full_scale)
        return NumberUnit(unit.si_symbol, number * unit.factor / (log.full_scale or 1.0))
    spelling = scale.unit if scale.unit is not None else log.unit
    try:
        known = None if spelling is None else parse_unit(spelling)
    except UnitError:
        known = None
    if known is not None and (scale.unit is not None or log.full_scale is None):
        return NumberUnit(known.si_symbol, known.factor)
    if log.full_scale is not None:
        return NumberUnit(FULL_SCALE, 1.0 / log.full_scale)
    return NumberUnit(NUMBER, 1.0)


@dataclass(frozen=True)
class CalibratedScale:
    """What a calibrator's recording says of a channel's numbers.

    Parameters
    ----------
    quantity, si_symbol : str
    unit : str
        Of the numbers, as `NumberUnit` has it.
    si_per_unit : float
    """

    quantity: str
    si_symbol: str
    unit: str
    si_per_unit: float

    def convert(self, log: LogChannel, scale: Scale) -> Conversion:
        """Return the conversion of a channel in a log.

        Raises
        ------
        UnitError
            The log's numbers are not what the calibrator was recorded in.
        """
        numbers = number_unit(log, scale)
        if numbers.unit != self.unit:
            raise UnitError(
                f"the calibrator was recorded in {self.unit}, but the log's numbers are in {numbers.unit}: "
                "its sensitivity cannot be used here"
            )
        return Conversion(self.quantity, self.si_symbol, numbers.factor * self.si_per_unit, 0.0, "")


@dataclass(frozen=True)
class KnownScale:
    """What is known of a channel's scale in a run besides its ``[[channel]]``.

    Parameters
    ----------
    words : str
        Whence, for the report.
    scale : Scale or None
        In place of the keys of the channel.
    calibrated : CalibratedScale or None
        Goes before all else.
    """

    words: str
    scale: Scale | None = None
    calibrated: CalibratedScale | None = None

    def convert(self, log: LogChannel, stated: Scale) -> Conversion:
        """Return the conversion of a channel in a log, as `tdacoustic.ingest.convert` does.

        Raises
        ------
        UnitError
            As there.
        """
        if self.calibrated is not None:
            return replace(self.calibrated.convert(log, stated), scaling=self.words)
        found = convert(log, self.scale or stated)
        return replace(found, scaling=f"{found.scaling}; {self.words}")


def is_physical(unit: str) -> bool:
    """Whether numbers in a unit, as `NumberUnit` has it, are what is measured rather than a sensor's signal."""
    return unit not in ELECTRICAL_SYMBOLS and unit not in (FULL_SCALE, NUMBER, "1")

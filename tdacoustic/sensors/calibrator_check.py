"""A calibrator run, a channel's numbers, and what the one shows in the other."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from tdacoustic.sensors.calibrators import Calibrator
from tdacoustic.sensors.reading import Plateau

__all__ = ["CalibratorCheck", "CalibratorRun", "ChannelScale", "Word", "signed_db"]

Word = Literal["ok", "warning", "bad"]
"""A verdict."""


@dataclass(frozen=True)
class CalibratorRun:
    """A run with a calibrator.

    Parameters
    ----------
    name : str
    kind : "before" or "after"
    series : int
        Which series of runs it belongs to, from 1.
    calibrator : Calibrator or None
        None where the campaign does not state it: such a run is only reported.
    frequency_hz : float or None
        As stated; None: one of the usual ones [assumed].
    """

    name: str
    kind: Literal["before", "after"]
    series: int
    calibrator: Calibrator | None
    frequency_hz: float | None = None

    @property
    def wanted_hz(self) -> tuple[float, ...]:
        """Frequencies that its tone may have; empty where nothing is known."""
        if self.frequency_hz is not None:
            return (self.frequency_hz,)
        return () if self.calibrator is None else self.calibrator.usual_hz


@dataclass(frozen=True)
class ChannelScale:
    """What a channel's numbers are.

    Parameters
    ----------
    channel : str
    unit : str
        What a calibrator's reading is in: ``"V"``, ``"Pa"``, ``"full scale"``, ``"number"``.
    factor : float
        The log's number times this is in `unit`.
    si_per_unit : float or None
        As campaign, log or sensor database say; None where nobody does.
    words : str
        That in words.
    """

    channel: str
    unit: str
    factor: float = 1.0
    si_per_unit: float | None = None
    words: str = ""


@dataclass(frozen=True)
class CalibratorCheck:
    """A channel in a calibrator run.

    Parameters
    ----------
    run : CalibratorRun
    scale : ChannelScale
    plateau : Plateau or None
        The steady stretch that was read; None where there is none.
    rms : float or None
        Of the tone, in `ChannelScale.unit`.
    repeat_db : float
        Span of the levels, where the calibrator was put on several times.
    verdict : "ok", "warning" or "bad"
        ``bad``: nothing is set by it and nothing checked.
    reason : str
    """

    run: CalibratorRun
    scale: ChannelScale
    plateau: Plateau | None
    rms: float | None
    repeat_db: float
    verdict: Word
    reason: str

    @property
    def counts(self) -> bool:
        """Whether it can set or check a scale."""
        return self.verdict != "bad" and self.rms is not None and self.run.calibrator is not None

    @property
    def read_si(self) -> float | None:
        """Rms of the tone in SI, through the scale as stated."""
        known = self.scale.si_per_unit
        return None if known is None or self.rms is None else self.rms * known

    @property
    def deviation_db(self) -> float | None:
        """What is read over what the calibrator gives; None where either is not known."""
        read, calibrator = self.read_si, self.run.calibrator
        return None if read is None or calibrator is None else 20.0 * math.log10(read / calibrator.rms)

    @property
    def unit_per_si(self) -> float | None:
        """The sensitivity that it shows, in `ChannelScale.unit` per SI unit."""
        calibrator = self.run.calibrator
        return None if calibrator is None or self.rms is None else self.rms / calibrator.rms

    @property
    def sigma_db(self) -> float | None:
        """Standard uncertainty of that: the calibrator, the steadiness of the tone, its scatter and its repetition."""
        if self.run.calibrator is None or self.plateau is None:
            return None
        parts = (self.run.calibrator.sigma_db, self.plateau.steadiness_db / math.sqrt(3.0), self.plateau.scatter_db)
        return math.hypot(*parts, 0.5 * self.repeat_db / math.sqrt(3.0))


def signed_db(value_db: float) -> str:
    """Write a difference with its sign, and with none where it is nothing.

    >>> signed_db(0.8), signed_db(-0.001)
    ('+0.80', '0.00')
    """
    text = f"{value_db:+.2f}"
    return "0.00" if text in ("+0.00", "-0.00") else text

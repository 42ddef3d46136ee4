"""What a calibrator's tone says of a channel: of its scale as stated, and of its drift."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

from tdacoustic.sensors.calibrators import (
    FREQUENCY_TOLERANCE,
    LIMIT_DB,
    Calibrator,
    likely_mistake,
    sensitivity_doubt,
)
from tdacoustic.sensors.plateaus import MIN_PLATEAU_S
from tdacoustic.sensors.reading import Plateau, ToneReading

__all__ = [
    "CalibratorCheck",
    "CalibratorRun",
    "ChannelCalibration",
    "ChannelScale",
    "calibrate_channel",
    "check_tone",
    "is_wanted",
]

Word = Literal["ok", "warning", "bad"]

UNSTEADY_DB: Final = 0.1
"""Of the level of half a second from the mean [assumed]; IEC 60942:2017 allows a class 1 calibrator 0.07 dB."""
DISTORTED: Final = 0.03
"""Harmonics over the tone [assumed, of the size that IEC 60942 allows with noise]."""
RESIDUE_DB: Final = -20.0
"""All else against the tone, from which on it is said [assumed]."""
SETTING_DB: Final = (19.5, 20.5)
"""Between two settings of one calibrator."""


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


def check_tone(run: CalibratorRun, scale: ChannelScale, reading: ToneReading) -> CalibratorCheck:
    """Judge what a channel shows of a calibrator.

    Parameters
    ----------
    run : CalibratorRun
    scale : ChannelScale
    reading : ToneReading
        In the log's numbers.
    """
    if not reading.plateaus:
        reason = "no tone stands out"
        if reading.stood_out_s > 0.0:
            reason = f"a tone stands out for {reading.stood_out_s:.3g} s, but keeps its level for less than "
            reason += f"{MIN_PLATEAU_S:g} s: too short to be read"
        return CalibratorCheck(run, scale, None, None, 0.0, "bad", reason)
    held = [item for item in reading.plateaus if is_wanted(item.frequency_hz, run.wanted_hz)]
    if not held:
        longest = max(reading.plateaus, key=lambda item: item.duration_s)
        wanted = " or ".join(f"{hz:.5g}" for hz in run.wanted_hz)
        whose = "is stated" if run.frequency_hz is not None else "is usual for such a calibrator [assumed]"
        reason = f"its tone is at {longest.frequency_hz:.5g} Hz, but {wanted} Hz {whose}"
        return CalibratorCheck(run, scale, longest, longest.rms * scale.factor, 0.0, "bad", reason)
    chosen, note = _one_setting(held, run, scale)
    if not chosen:
        longest = max(held, key=lambda item: item.duration_s)
        return CalibratorCheck(run, scale, longest, longest.rms * scale.factor, 0.0, "bad", note)
    plateau = max(chosen, key=lambda item: item.duration_s)
    rms = scale.factor * math.sqrt(sum(item.rms**2 for item in chosen) / len(chosen))
    check = CalibratorCheck(run, scale, plateau, rms, _span_db(chosen), "ok", "")
    if plateau.clipped:
        return CalibratorCheck(run, scale, plateau, rms, 0.0, "bad", "the tone is clipped")
    doubts = _doubts(check)
    words = "; ".join(part for part in (_reading_words(check), note, *doubts) if part)
    return CalibratorCheck(run, scale, plateau, rms, check.repeat_db, "warning" if doubts else "ok", words)


def is_wanted(frequency_hz: float, wanted_hz: Sequence[float]) -> bool:
    """Whether a tone is at one of the frequencies that it may have; at any where nothing is known."""
    return not wanted_hz or any(abs(frequency_hz - hz) <= FREQUENCY_TOLERANCE * hz for hz in wanted_hz)


def _span_db(plateaus: Sequence[Plateau]) -> float:
    levels = [20.0 * math.log10(item.rms) for item in plateaus]
    return max(levels) - min(levels)


def _one_setting(held: Sequence[Plateau], run: CalibratorRun, scale: ChannelScale) -> tuple[tuple[Plateau, ...], str]:
    """The stretches of one setting of the calibrator, and what is to be said of it; none where that is not clear."""
    span_db = _span_db(held)
    if span_db <= LIMIT_DB:
        times = f"put on {len(held)} times, which differ by {span_db:.2f} dB" if len(held) > 1 else ""
        return tuple(held), times
    lowest = min(item.rms for item in held)
    levels = [20.0 * math.log10(item.rms / lowest) for item in held]
    low = tuple(item for item, level in zip(held, levels, strict=True) if level <= LIMIT_DB)
    high = tuple(item for item, level in zip(held, levels, strict=True) if SETTING_DB[0] <= level <= SETTING_DB[1])
    calibrator = run.calibrator
    if calibrator is not None and calibrator.quantity == "sound_pressure" and len(low) + len(high) == len(held):
        is_low = calibrator.level_db < 104.0
        which = "lower" if is_low else "higher"
        return (
            low if is_low else high,
            f"two levels {span_db:.1f} dB apart: the {which} is taken for {calibrator.words}",
        )
    reason = f"steady at {len(held)} levels that differ by up to {span_db:.1f} dB: which of them is the calibrator's "
    return (), reason + "cannot be told; cut the run with start_s and end_s"


def _reading_words(check: CalibratorCheck) -> str:
    plateau, calibrator = check.plateau, check.run.calibrator
    assert plateau is not None and check.rms is not None
    at = f"{plateau.frequency_hz:.5g} Hz, {plateau.start_s:.1f} to {plateau.end_s:.1f} s"
    numbers = f"{check.rms:.4g} {check.scale.unit} rms at {at}"
    if calibrator is None:
        return f"{numbers}; the run states no calibrator, so nothing is set and nothing checked"
    deviation_db = check.deviation_db
    if deviation_db is None:
        return f"{numbers} for {calibrator.words}"
    if calibrator.quantity == "sound_pressure":
        given_db = calibrator.level_db
        return f"reads {given_db + deviation_db:.2f} dB for {given_db:.2f} dB ({_signed(deviation_db)} dB) at {at}"
    given = calibrator.rms
    return f"reads {check.read_si:.4g} m/s^2 rms for {given:.4g} ({_signed(deviation_db)} dB) at {at}"


def _signed(value_db: float) -> str:
    """A difference with its sign, and none where it is nothing."""
    text = f"{value_db:+.2f}"
    return "0.00" if text in ("+0.00", "-0.00") else text


def _doubts(check: CalibratorCheck) -> list[str]:
    plateau, calibrator, found = check.plateau, check.run.calibrator, []
    assert plateau is not None
    deviation_db = check.deviation_db
    if calibrator is not None and deviation_db is not None and abs(deviation_db) > LIMIT_DB:
        mistake = likely_mistake(deviation_db, calibrator.quantity)
        found.append(
            f"{abs(deviation_db):.2f} dB too {'high' if deviation_db > 0.0 else 'low'} by the stated scale, "
            f"more than {LIMIT_DB:g} dB{f': {mistake}?' if mistake else ''}"
        )
    unsteady_db = max(plateau.steadiness_db, plateau.wander_db)
    if unsteady_db > UNSTEADY_DB:
        found.append(f"the tone is unsteady by {unsteady_db:.2f} dB; does the calibrator sit tight?")
    if plateau.distortion > DISTORTED:
        found.append(f"harmonics are {100 * plateau.distortion:.2g} % of the tone")
    elif plateau.residue_db > RESIDUE_DB:
        found.append(f"all else is only {-plateau.residue_db:.0f} dB below the tone")
    return found


# ---------------------------------------------------------------- before and after


@dataclass(frozen=True)
class ChannelCalibration:
    """What the calibrator runs of a series say of a channel.

    Parameters
    ----------
    channel : str
    series : int
    checks : tuple of CalibratorCheck
    action : "set", "checked" or "reported"
        What they do to its scale.
    scale : ChannelScale
        With what the calibrators say where they set it, else as stated.
    drift_db : float or None
        The readings after over those before; None where either lacks.
    sigma_db : float or None
        Standard uncertainty of the scale that they set or check.
    verdict : "ok" or "warning"
    reason : str
    """

    channel: str
    series: int
    checks: tuple[CalibratorCheck, ...]
    action: Literal["set", "checked", "reported"]
    scale: ChannelScale
    drift_db: float | None
    sigma_db: float | None
    verdict: Word
    reason: str

    @property
    def deviation_db(self) -> float | None:
        """What the calibrators are read at through the stated scale, over what they give: the energy mean."""
        held = [check.deviation_db for check in self.checks if check.counts and check.deviation_db is not None]
        return _mean_db(held) if held else None


def calibrate_channel(checks: Sequence[CalibratorCheck], override: bool = False) -> ChannelCalibration:
    """Return what the calibrator runs of one series say of one channel.

    A scale is set by the energy mean of the readings before and after: where a sensor drifts, each run is then off by
    half of it at most. It is set where nobody states one, else only where `override` says so.

    Parameters
    ----------
    checks : sequence of CalibratorCheck
        Of one channel and one series; at least one.
    override : bool
        Set the scale even where one is stated.
    """
    first = checks[0]
    whole = tuple(checks)
    counting = [check for check in whole if check.counts]
    name, series, stated = first.scale.channel, first.run.series, first.scale
    if not counting:
        reasons = "; ".join(f"{check.run.name}: {check.reason}" for check in whole)
        word: Word = "warning" if any(check.verdict == "bad" for check in whole) else "ok"
        return ChannelCalibration(name, series, whole, "reported", stated, None, None, word, reasons)
    units = {check.scale.unit for check in counting}
    if len(units) > 1:
        reason = f"its numbers are in {' and in '.join(sorted(units))} in different calibrator runs; nothing is set"
        return ChannelCalibration(name, series, whole, "reported", stated, None, None, "warning", reason)
    sets = override or stated.si_per_unit is None
    means = {kind: _sensitivity(counting, kind) for kind in ("before", "after")}
    held = [value for value in means.values() if value is not None]
    drift_db = None
    if means["before"] is not None and means["after"] is not None:
        drift_db = 20.0 * math.log10(means["after"] / means["before"])
    unit_per_si = math.sqrt(sum(value**2 for value in held) / len(held))
    sigma_db = math.hypot(
        max(check.sigma_db or 0.0 for check in counting), 0.0 if drift_db is None else 0.5 * drift_db / math.sqrt(3.0)
    )
    scale = _set_scale(stated, unit_per_si, counting) if sets else stated
    found = ChannelCalibration(name, series, whole, "set" if sets else "checked", scale, drift_db, sigma_db, "ok", "")
    return _judged(found, means)


def _sensitivity(checks: Sequence[CalibratorCheck], kind: str) -> float | None:
    """Energy mean of the sensitivities before or after."""
    held = [check.unit_per_si for check in checks if check.run.kind == kind and check.unit_per_si is not None]
    return math.sqrt(sum(value**2 for value in held) / len(held)) if held else None


def _mean_db(levels_db: Sequence[float]) -> float:
    return 10.0 * math.log10(sum(10.0 ** (0.1 * level) for level in levels_db) / len(levels_db))


_SI: Final = {"sound_pressure": "Pa", "acceleration": "m/s^2"}


def _set_scale(stated: ChannelScale, unit_per_si: float, counting: Sequence[CalibratorCheck]) -> ChannelScale:
    calibrator = counting[0].run.calibrator
    assert calibrator is not None
    si = _SI[calibrator.quantity]
    below = f"({si})" if "/" in si else si
    if stated.unit == "V":
        words = f"{1e3 * unit_per_si:.5g} mV/{below}"
    elif stated.unit in ("full scale", "number"):
        words = f"{'full scale' if stated.unit == 'full scale' else '1.0 in the log'} is {1.0 / unit_per_si:.5g} {si}"
    elif stated.unit == si:
        words = f"the log's numbers x {1.0 / unit_per_si:.5g}"
    else:
        words = f"{unit_per_si:.5g} {stated.unit}/{below}"
    runs = ", ".join(check.run.name for check in counting)
    words += f" by calibrator run{'s' if len(counting) > 1 else ''} {runs} ({calibrator.words})"
    return ChannelScale(stated.channel, stated.unit, stated.factor, 1.0 / unit_per_si, words)


def _judged(found: ChannelCalibration, means: dict[str, float | None]) -> ChannelCalibration:
    """Add verdict and reason."""
    doubts, notes = [], []
    drift_db, deviation_db = found.drift_db, found.deviation_db
    calibrator = next(check.run.calibrator for check in found.checks if check.counts)
    assert calibrator is not None
    if drift_db is not None:
        words = f"after the runs {_signed(drift_db)} dB against before"
        if abs(drift_db) > LIMIT_DB:
            doubts.append(f"{words}, more than {LIMIT_DB:g} dB: levels between the two are doubtful")
        else:
            notes.append(words)
    else:
        notes.append(f"only {'before' if means['before'] is not None else 'after'} the runs: drift is not known")
    if found.action == "checked" and deviation_db is not None:
        words = f"read {_signed(deviation_db)} dB off the stated scale"
        if abs(deviation_db) > LIMIT_DB:
            mistake = likely_mistake(deviation_db, calibrator.quantity)
            doubts.append(f"{words}, more than {LIMIT_DB:g} dB{f': {mistake}?' if mistake else ''}")
        else:
            notes.append(words)
    if found.action == "set":
        notes.insert(0, f"set: {found.scale.words}")
        if deviation_db is not None:
            notes.append(f"instead of the stated scale, by which it reads {_signed(deviation_db)} dB off")
        if found.scale.unit == "V" and found.scale.si_per_unit:
            doubt = sensitivity_doubt(1.0 / found.scale.si_per_unit, calibrator.quantity)
            if doubt is not None:
                doubts.append(doubt)
    for kind in ("before", "after"):
        held = [check for check in found.checks if check.counts and check.run.kind == kind]
        levels = [20.0 * math.log10(check.unit_per_si or 1.0) for check in held]
        if levels and max(levels) - min(levels) > LIMIT_DB:
            doubts.append(f"{len(held)} runs {kind} differ by {max(levels) - min(levels):.2f} dB")
    word: Word = "warning" if doubts else "ok"
    return ChannelCalibration(
        found.channel,
        found.series,
        found.checks,
        found.action,
        found.scale,
        found.drift_db,
        found.sigma_db,
        word,
        "; ".join((*doubts, *notes)),
    )

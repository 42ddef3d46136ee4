"""What the calibrator runs before and after say of a channel together: its scale set or checked, and its drift."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

from tdacoustic.sensors.calibrator_check import CalibratorCheck, ChannelScale, Word, signed_db
from tdacoustic.sensors.calibrators import LIMIT_DB, likely_mistake, sensitivity_doubt

__all__ = ["ChannelCalibration", "calibrate_channel"]

Finding = tuple[bool, str]
"""Whether it is doubtful, and what."""


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


def _judged(found: ChannelCalibration, means: Mapping[str, float | None]) -> ChannelCalibration:
    """Add verdict and reason: what is doubtful first."""
    findings = (*_of_drift(found, means), *_of_scale(found), *_of_repetition(found))
    doubts = [words for doubtful, words in findings if doubtful]
    notes = [f"set: {found.scale.words}"] if found.action == "set" else []
    notes += [words for doubtful, words in findings if not doubtful]
    return replace(found, verdict="warning" if doubts else "ok", reason="; ".join((*doubts, *notes)))


def _of_drift(found: ChannelCalibration, means: Mapping[str, float | None]) -> Iterator[Finding]:
    if found.drift_db is None:
        yield False, f"only {'before' if means['before'] is not None else 'after'} the runs: drift is not known"
        return
    words = f"after the runs {signed_db(found.drift_db)} dB against before"
    if abs(found.drift_db) > LIMIT_DB:
        yield True, f"{words}, more than {LIMIT_DB:g} dB: levels between the two are doubtful"
    else:
        yield False, words


def _of_scale(found: ChannelCalibration) -> Iterator[Finding]:
    """What the stated scale is off, and whether a sensor has what is set."""
    calibrator = next(check.run.calibrator for check in found.checks if check.counts)
    assert calibrator is not None
    deviation_db, sets = found.deviation_db, found.action == "set"
    if deviation_db is not None:
        off = f"{signed_db(deviation_db)} dB off"
        words = f"instead of the stated scale, by which it reads {off}" if sets else f"read {off} the stated scale"
        if abs(deviation_db) > LIMIT_DB:
            mistake = likely_mistake(deviation_db, calibrator.quantity)
            yield True, f"{words}, more than {LIMIT_DB:g} dB{f': {mistake}?' if mistake else ''}"
        else:
            yield False, words
    if sets and found.scale.unit == "V" and found.scale.si_per_unit:
        doubt = sensitivity_doubt(1.0 / found.scale.si_per_unit, calibrator.quantity)
        if doubt is not None:
            yield True, doubt


def _of_repetition(found: ChannelCalibration) -> Iterator[Finding]:
    for kind in ("before", "after"):
        held = [check for check in found.checks if check.counts and check.run.kind == kind]
        levels = [20.0 * math.log10(check.unit_per_si or 1.0) for check in held]
        if levels and max(levels) - min(levels) > LIMIT_DB:
            yield True, f"{len(held)} runs {kind} differ by {max(levels) - min(levels):.2f} dB"

"""What a calibrator's tone in one run says of a channel's scale as stated."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from tdacoustic.sensors.calibrator_check import CalibratorCheck, CalibratorRun, ChannelScale, signed_db
from tdacoustic.sensors.calibrators import FREQUENCY_TOLERANCE, LIMIT_DB, likely_mistake
from tdacoustic.sensors.plateaus import MIN_PLATEAU_S
from tdacoustic.sensors.reading import Plateau, ToneReading

__all__ = ["check_tone", "is_wanted"]

UNSTEADY_DB: Final = 0.1
"""Of the level of half a second from the mean [assumed]; IEC 60942:2017 allows a class 1 calibrator 0.07 dB."""
DISTORTED: Final = 0.03
"""Harmonics over the tone [assumed, of the size that IEC 60942 allows with noise]."""
RESIDUE_DB: Final = -20.0
"""All else against the tone, from which on it is said [assumed]."""
SETTING_DB: Final = (19.5, 20.5)
"""Between two settings of one calibrator."""


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
        return f"reads {given_db + deviation_db:.2f} dB for {given_db:.2f} dB ({signed_db(deviation_db)} dB) at {at}"
    given = calibrator.rms
    return f"reads {check.read_si:.4g} m/s^2 rms for {given:.4g} ({signed_db(deviation_db)} dB) at {at}"


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

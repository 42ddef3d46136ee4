"""Checks of a whole run: its speed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from tdacoustic.quality.verdict import Verdict
from tdacoustic.speed import SpeedProfile

__all__ = ["check_speed"]

STATED_TOLERANCE: Final = 0.05
"""Relative distance between the measured and the stated speed that is said."""
KNOWN_SHARE: Final = 0.9
"""Part of a run over which its speed must be known, or it is said [assumed]."""
_CHECKS: Final = {"tacho": "tacho", "channel": "speed", "lines": "speed from lines"}


def check_speed(
    profiles: Sequence[SpeedProfile],
    tolerance: float,
    stated: dict[str, float],
    problems: Sequence[tuple[str, str]] = (),
    span_s: tuple[float, float] | None = None,
    no_lines: str | None = None,
) -> tuple[Verdict, ...]:
    """Return verdicts on the speed of a run.

    Parameters
    ----------
    profiles : sequence of SpeedProfile
    tolerance : float
        Relative variation up to which a speed is constant.
    stated : dict
        Speeds of the campaign in SI, by shaft (``motor``: 1/s, ``train``: m/s).
    problems : sequence of (str, str)
        Channels from which no speed could be had, and why.
    span_s : (float, float), optional
        First and last instant of the run's signals.
    no_lines : str, optional
        Why the speed could not be read from lines, where it was sought there.
    """
    found = [Verdict(channel, "speed", "warning", reason) for channel, reason in problems]
    for profile in profiles:
        found += _of_profile(profile, tolerance, stated, span_s)
    if no_lines is not None:
        found.append(Verdict("", _CHECKS["lines"], "warning", no_lines))
    if not profiles and not problems and no_lines is None:
        words = "from the campaign" if stated else "not known: no speed or tacho channel, and the campaign gives none"
        found.append(Verdict("", "speed", "ok" if stated else "warning", words))
    return tuple(found)


def _of_profile(
    profile: SpeedProfile, tolerance: float, stated: dict[str, float], span_s: tuple[float, float] | None
) -> list[Verdict]:
    factor, unit = (60.0, "rpm") if profile.si_symbol == "1/s" else (3.6, "km/h")
    low, high = factor * float(profile.speed.min()), factor * float(profile.speed.max())
    lines = profile.source == "lines"
    channel, check = ("", _CHECKS["lines"]) if lines else (profile.channel, "speed")
    who = f"{profile.shaft}, {profile.channel}: " if lines else ""
    if profile.stands:
        found = [Verdict(channel, check, "ok", f"{who}stands still ({low:.2g} to {high:.2g} {unit})")]
    elif profile.is_constant(tolerance):
        words = f"{who}{factor * profile.mean:.5g} {unit}, varies by {100 * profile.variation:.2g} %"
        found = [Verdict(channel, check, "ok", words)]
    else:
        words = f"{who}{low:.5g} to {high:.5g} {unit}: not constant (limit {100 * tolerance:g} %), a run-up"
        found = [Verdict(channel, check, "warning", f"{words}; not averaged into one spectrum")]
    share = 1.0 if span_s is None else profile.known_share(*span_s)
    if share < KNOWN_SHARE:
        words = f"{who}known in {100 * share:.0f} % of the run; what it does in the rest is not known"
        words += "" if lines else '; [analysis] speed_from = "lines" looks for it in the vibration'
        found.append(Verdict(channel, check, "warning", words))
    for note in profile.notes:
        bad = note in profile.faults
        found.append(Verdict(channel, _CHECKS[profile.source], "warning" if bad else "ok", note))
    key = "train" if profile.si_symbol == "m/s" else profile.shaft
    said = stated.get(key) if key is not None else None
    if said and profile.is_constant(tolerance) and abs(profile.mean / said - 1.0) > STATED_TOLERANCE:
        words = f"{who}measured {factor * profile.mean:.5g} {unit}, stated {factor * said:.5g} {unit}"
        found.append(Verdict(channel, check, "warning", words))
    return found

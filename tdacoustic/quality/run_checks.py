"""Checks of a whole run: its speed."""

from __future__ import annotations

from collections.abc import Sequence

from tdacoustic.quality.verdict import Verdict
from tdacoustic.speed import SpeedProfile

__all__ = ["check_speed"]

STATED_TOLERANCE = 0.05
"""Relative distance between the measured and the stated speed that is said."""


def check_speed(
    profiles: Sequence[SpeedProfile],
    tolerance: float,
    stated: dict[str, float],
    problems: Sequence[tuple[str, str]] = (),
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
    """
    found = [Verdict(channel, "speed", "warning", reason) for channel, reason in problems]
    for profile in profiles:
        factor, unit = (60.0, "rpm") if profile.si_symbol == "1/s" else (3.6, "km/h")
        low, high = factor * float(profile.speed.min()), factor * float(profile.speed.max())
        if profile.stands:
            found.append(Verdict(profile.channel, "speed", "ok", f"stands still ({low:.2g} to {high:.2g} {unit})"))
        elif profile.is_constant(tolerance):
            words = f"{factor * profile.mean:.5g} {unit}, varies by {100 * profile.variation:.2g} %"
            found.append(Verdict(profile.channel, "speed", "ok", words))
        else:
            words = f"{low:.5g} to {high:.5g} {unit}: not constant (limit {100 * tolerance:g} %), a run-up"
            found.append(Verdict(profile.channel, "speed", "warning", f"{words}; not averaged into one spectrum"))
        for note in profile.notes:
            found.append(Verdict(profile.channel, "tacho", "warning" if profile.doubtful else "ok", note))
        key = "train" if profile.si_symbol == "m/s" else profile.shaft
        said = stated.get(key) if key is not None else None
        if said and profile.is_constant(tolerance) and abs(profile.mean / said - 1.0) > STATED_TOLERANCE:
            words = f"measured {factor * profile.mean:.5g} {unit}, stated {factor * said:.5g} {unit}"
            found.append(Verdict(profile.channel, "speed", "warning", words))
    if not profiles and not problems:
        words = "from the campaign" if stated else "not known: no speed or tacho channel, and the campaign gives none"
        found.append(Verdict("", "speed", "ok" if stated else "warning", words))
    return tuple(found)

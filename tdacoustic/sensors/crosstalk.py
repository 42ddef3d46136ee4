"""Which channel a calibrator was on, where several show its tone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from tdacoustic.sensors.calibrator_check import ChannelScale
from tdacoustic.sensors.reading import Plateau, ToneReading

__all__ = ["CROSSTALK_DB", "own_tones"]

CROSSTALK_DB: Final = 10.0
"""A channel that shows the tone of another one at the same time and weaker by more only hears it [assumed]."""
_SAME_TONE: Final = 0.005

Held = Sequence[tuple[ChannelScale, ToneReading]]


def own_tones(held: Held) -> tuple[list[ToneReading], dict[str, tuple[str, float]]]:
    """Leave out the stretches in which a channel only hears the calibrator on another one.

    Parameters
    ----------
    held : sequence of (ChannelScale, ToneReading)
        Of one run.

    Returns
    -------
    list of ToneReading
        In the order of `held`, with the channel's own stretches alone.
    dict of str to (str, float)
        By channel that has none of its own, whose tone it hears and how much weaker, in dB.
    """
    found: list[ToneReading] = []
    heard: dict[str, tuple[str, float]] = {}
    for scale, reading in held:
        own: list[Plateau] = []
        loudest = ("", 0.0)
        for plateau in reading.plateaus:
            louder = [
                (_weaker_db((scale, plateau), (other, beside)), other.channel)
                for other, others in held
                if other.channel != scale.channel
                for beside in others.plateaus
            ]
            weaker_db, name = max(louder, default=(0.0, ""))
            if weaker_db <= CROSSTALK_DB:
                own.append(plateau)
            elif weaker_db > loudest[1]:
                loudest = (name, weaker_db)
        if reading.plateaus and not own:
            heard[scale.channel] = loudest
        found.append(replace(reading, plateaus=tuple(own)))
    return found, heard


def _weaker_db(one: tuple[ChannelScale, Plateau], two: tuple[ChannelScale, Plateau]) -> float:
    """By how much a tone is weaker than that of another channel at the same time; 0 where that cannot be said."""
    (scale, plateau), (other, beside) = one, two
    together_s = min(plateau.end_s, beside.end_s) - max(plateau.start_s, beside.start_s)
    same_tone = abs(plateau.frequency_hz - beside.frequency_hz) <= _SAME_TONE * beside.frequency_hz
    if together_s < 0.5 * min(plateau.duration_s, beside.duration_s) or not same_tone:
        return 0.0
    ratio_db = 20.0 * math.log10(beside.rms * other.factor / (plateau.rms * scale.factor))
    if scale.si_per_unit is not None and other.si_per_unit is not None:
        return ratio_db + 20.0 * math.log10(other.si_per_unit / scale.si_per_unit)
    return ratio_db if scale.unit == other.unit else 0.0

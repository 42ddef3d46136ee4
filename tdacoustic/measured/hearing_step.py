"""Step: what the microphones of a run say to the ear, in one pass over their samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.formats import scan
from tdacoustic.measured.hearing import ChannelAudibility, Hearing, RasterHearing
from tdacoustic.recording import Channel, Recording
from tdacoustic.spectra import LevelMeter
from tdacoustic.steps import LogFile, Step
from tdacoustic.steps.progress import tell_progress
from tdacoustic.tones import DIN_45681, ISO_TS_20065, AudibilityMeter, AudibilityMethod, highest_rated_hz

__all__ = ["HEARING", "METHODS", "HearingSettings", "hear_recording", "hear_run"]

BLOCK_BYTES = 8 * 2**20
"""Samples of all channels read together, as float64."""

METHODS: Final[tuple[AudibilityMethod, ...]] = (ISO_TS_20065, DIN_45681)


@dataclass(frozen=True)
class HearingSettings:
    """The microphones of a run that can be used, in the order of the campaign."""

    channels: tuple[Channel, ...]


def hear_run(settings: HearingSettings, logs: tuple[LogFile, ...]) -> Hearing:
    """Step: audible tones and levels over time of a run's microphones."""
    return hear_recording(Recording("run", tuple(scan(log.path) for log in logs), settings.channels))


def hear_recording(recording: Recording) -> Hearing:
    """Rate the tones of all channels and gather their A-weighted levels over time, in one pass.

    What a record is too short or too slow for is refused with the reason; the rest is done.

    Parameters
    ----------
    recording : Recording
        Of sound pressures.
    """
    groups = recording.rasters()
    values = sum(recording[names[0]].n_samples * len(names) for names in groups)
    rasters: list[RasterHearing] = []
    refused: list[tuple[str, str, str]] = []
    read = 0
    for names in groups:
        audibility, why = _audibility_meter(recording[names[0]], names)
        refused += [(name, "audibility", why) for name in names if why]
        levels, why = _level_meter(recording[names[0]], len(names))
        refused += [(name, "levels", why) for name in names if why]
        meters: list[_Meter] = [meter for meter in (audibility, levels) if meter is not None]
        for block in recording.blocks(names, max(1024, BLOCK_BYTES // (8 * len(names)))) if meters else ():
            for meter in meters:
                meter.take(block)
            read += block.size
            tell_progress(read / values)
        rated = () if audibility is None else audibility.result()
        notes = _notes(recording[names[0]])
        rasters.append(
            RasterHearing(
                names,
                recording[names[0]].start_s,
                tuple(ChannelAudibility.of(one, notes) for one in rated),
                None if levels is None else levels.result(),
            )
        )
    return Hearing(tuple(rasters), tuple(refused))


class _Meter(Protocol):
    def take(self, block: NDArray[np.float64]) -> None: ...


def _audibility_meter(channel: Channel, names: Sequence[str]) -> tuple[AudibilityMeter | None, str]:
    highest_hz = highest_rated_hz(channel.sample_rate_hz)
    lowest_hz = min(method.lowest_hz for method in METHODS)
    if highest_hz < lowest_hz:
        return None, (
            f"a rate of {channel.sample_rate_hz:g} Hz holds no critical band from {lowest_hz:g} Hz up, from which "
            "tones are rated"
        )
    try:
        return AudibilityMeter(names, channel.sample_rate_hz, channel.n_samples, METHODS), ""
    except AnalysisError as error:
        return None, str(error)


def _level_meter(channel: Channel, n_channels: int) -> tuple[LevelMeter | None, str]:
    try:
        return LevelMeter(channel.sample_rate_hz, n_channels, "A"), ""
    except AnalysisError as error:
        return None, str(error)


def _notes(channel: Channel) -> tuple[str, ...]:
    """What the rate keeps from being rated."""
    highest_hz = highest_rated_hz(channel.sample_rate_hz)
    if highest_hz >= max(method.highest_hz for method in METHODS):
        return ()
    return (f"sampled at {channel.sample_rate_hz:g} Hz: tones above {highest_hz:.0f} Hz cannot be rated",)


HEARING = Step("hearing", 1, hear_run, "Audible tones and levels over time")

"""Step: the speed of a run over time."""

from __future__ import annotations

from dataclasses import dataclass

from tdacoustic.errors import AnalysisError
from tdacoustic.formats import scan
from tdacoustic.measured.results import RunSpeed
from tdacoustic.recording import Channel, Recording
from tdacoustic.speed import EdgeFinder, LevelFinder, SpeedChannelMeter, SpeedProfile, clean_edges, speed_from_edges
from tdacoustic.steps import LogFile, Step

__all__ = ["SPEED", "SpeedSettings", "measure_speed"]

BLOCK_SAMPLES = 2**20
MENDED_LIMIT = 0.2
"""Part of a tacho's pulses that may be mended before it is said to give no speed."""


@dataclass(frozen=True)
class SpeedSettings:
    """Speed and tacho channels of a run."""

    channels: tuple[Channel, ...]


def measure_speed(settings: SpeedSettings, logs: tuple[LogFile, ...]) -> RunSpeed:
    """Step: speed over time from each speed or tacho channel."""
    if not settings.channels:
        return RunSpeed(())
    recording = Recording("run", tuple(scan(log.path) for log in logs), settings.channels)
    profiles: list[SpeedProfile] = []
    problems: list[tuple[str, str]] = []
    for channel in recording.channels:
        try:
            measure = _speed_from_tacho if channel.quantity == "tacho" else _speed_from_channel
            profiles.append(measure(recording, channel))
        except AnalysisError as error:
            problems.append((channel.name, str(error)))
    return RunSpeed(tuple(profiles), tuple(problems))


def _speed_from_channel(recording: Recording, channel: Channel) -> SpeedProfile:
    meter = SpeedChannelMeter(channel.sample_rate_hz)
    for block in recording.blocks([channel.name], BLOCK_SAMPLES):
        meter.take(block[0])
    times, values = meter.result()
    if values.size == 0:
        raise AnalysisError(f"speed channel {channel.name!r} holds no numbers")
    return SpeedProfile(channel.name, channel.shaft, channel.si_symbol, channel.start_s + times, values)


def _speed_from_tacho(recording: Recording, channel: Channel) -> SpeedProfile:
    if channel.pulses_per_rev is None:
        raise AnalysisError(f"tacho {channel.name!r} needs pulses_per_rev in its [[channel]]")
    levels = LevelFinder(max(16, round(channel.sample_rate_hz)))
    for block in recording.blocks([channel.name], BLOCK_SAMPLES):
        levels.take(block[0])
    low, high = levels.result()
    if not high > low:
        raise AnalysisError(f"tacho {channel.name!r} has no pulses: it stays at {low:.4g} {channel.si_symbol}")
    finder = EdgeFinder(low, high, channel.sample_rate_hz)
    for block in recording.blocks([channel.name], BLOCK_SAMPLES):
        finder.take(block[0])
    edges = clean_edges(finder.result())
    mended = edges.missing + edges.double
    if mended > MENDED_LIMIT * max(1, edges.times_s.size):
        raise AnalysisError(
            f"tacho {channel.name!r}: {edges.missing} pulses missing and {edges.double} double "
            f"of {edges.times_s.size}; no speed can be had from it"
        )
    times, speed = speed_from_edges(edges.times_s, channel.pulses_per_rev, channel.duration_s)
    words = f"{edges.times_s.size} pulses, {channel.pulses_per_rev:g} per revolution"
    if mended:
        words += f"; {edges.missing} missing put in, {edges.double} double taken out"
    return SpeedProfile(
        channel.name, channel.shaft, "1/s", channel.start_s + times, speed, (words,), doubtful=mended > 0
    )


SPEED = Step("speed", 1, measure_speed, "Speed over time")

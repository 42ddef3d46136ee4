"""Step: the speed of a run over time, and the angle of its shafts."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.formats import scan
from tdacoustic.measured.results import RunSpeed
from tdacoustic.recording import Channel, Recording
from tdacoustic.speed import (
    EdgeFinder,
    LevelFinder,
    ShaftAngle,
    SpeedChannelMeter,
    SpeedProfile,
    TachoReading,
    edge_directions,
    read_tacho,
    signed_reading,
    stands_between_edges,
)
from tdacoustic.steps import LogFile, Step
from tdacoustic.steps.progress import tell_progress

__all__ = ["SPEED", "SpeedSettings", "measure_speed"]

BLOCK_SAMPLES = 2**20


@dataclass(frozen=True)
class SpeedSettings:
    """Speed and tacho channels of a run, and the time that its signals last on the run's axis."""

    channels: tuple[Channel, ...]
    span_s: tuple[float, float] | None = None


@dataclass(frozen=True)
class _Tacho:
    """A tacho with its edges, in s after its first sample."""

    channel: Channel
    rising: NDArray[np.float64]
    falling: NDArray[np.float64]
    reading: TachoReading


def measure_speed(settings: SpeedSettings, logs: tuple[LogFile, ...]) -> RunSpeed:
    """Step: speed over time, and angle, from each speed or tacho channel."""
    if not settings.channels:
        return RunSpeed(())
    recording = Recording("run", tuple(scan(log.path) for log in logs), settings.channels)
    tachos: list[_Tacho] = []
    profiles: dict[str, SpeedProfile] = {}
    angles: dict[str, ShaftAngle] = {}
    problems: list[tuple[str, str]] = []
    for number, channel in enumerate(recording.channels, start=1):
        try:
            if channel.quantity == "tacho":
                tachos.append(_tacho(recording, channel))
            else:
                profiles[channel.name] = _cut(_speed_from_channel(recording, channel), settings.span_s)
        except AnalysisError as error:
            problems.append((channel.name, str(error)))
        tell_progress(number / len(recording.channels))
    for tacho in tachos:
        name, shaft, start_s = tacho.channel.name, tacho.channel.shaft, tacho.channel.start_s
        reading = _with_direction(tacho, tachos)
        try:
            profiles[name] = _cut(reading.profile(name, shaft, start_s), settings.span_s)
            angles[name] = reading.angle(shaft, start_s, name)
        except AnalysisError as error:
            problems.append((name, str(error)))
    for name, profile in profiles.items():
        if name not in angles and (angle := _angle_of(profile)) is not None:
            angles[name] = angle
    order = [channel.name for channel in recording.channels]
    return RunSpeed(
        tuple(profiles[name] for name in order if name in profiles),
        tuple(problems),
        tuple(angles[name] for name in order if name in angles),
    )


def _cut(profile: SpeedProfile, span_s: tuple[float, float] | None) -> SpeedProfile:
    return profile if span_s is None else profile.within(*span_s)


def _angle_of(profile: SpeedProfile) -> ShaftAngle | None:
    """Angle of a shaft from its speed; None of a train's speed, or where the shaft nowhere turns."""
    if profile.si_symbol != "1/s":
        return None
    try:
        return ShaftAngle.from_profile(profile)
    except AnalysisError:
        return None


def _speed_from_channel(recording: Recording, channel: Channel) -> SpeedProfile:
    meter = SpeedChannelMeter(channel.sample_rate_hz)
    for block in recording.blocks([channel.name], BLOCK_SAMPLES):
        meter.take(block[0])
    return meter.profile(channel.name, channel.shaft, channel.si_symbol, channel.start_s)


def _tacho(recording: Recording, channel: Channel) -> _Tacho:
    if channel.pulses_per_rev is None:
        raise AnalysisError(f"tacho {channel.name!r} needs pulses_per_rev in its [[channel]]")
    levels = LevelFinder(max(16, round(channel.sample_rate_hz)))
    for block in recording.blocks([channel.name], BLOCK_SAMPLES):
        levels.take(block[0])
    low, high = levels.result()
    if not high > low:
        raise AnalysisError(
            f"tacho {channel.name!r} has no pulses: it stays at {low:.4g} {channel.si_symbol}; "
            "the shaft stands, or the tacho is dead"
        )
    rate = channel.sample_rate_hz
    up, down = EdgeFinder(low, high, rate), EdgeFinder(low, high, rate, falling=True)
    for block in recording.blocks([channel.name], BLOCK_SAMPLES):
        up.take(block[0])
        down.take(block[0])
    rising, falling = up.result(), down.result()
    reading = read_tacho(channel.name, rising, falling, channel.pulses_per_rev, rate, channel.duration_s)
    return _Tacho(channel, rising, falling, reading)


def _with_direction(tacho: _Tacho, tachos: list[_Tacho]) -> TachoReading:
    """Return a tacho's reading with its direction, where a second one stands beside it on the same wheel."""
    own = tacho.channel
    for other in tachos:
        beside = other.channel
        same_wheel = own.shaft is not None and (own.shaft, own.drive) == (beside.shaft, beside.drive)
        if other is tacho or not same_wheel or own.pulses_per_rev != beside.pulses_per_rev:
            continue
        late = beside.start_s - own.start_s
        rising, falling = other.rising + late, other.falling + late
        if not stands_between_edges(tacho.reading.edges_s, rising, falling):
            continue
        try:
            signed = signed_reading(own.name, tacho.reading, edge_directions(tacho.reading.edges_s, rising, falling))
        except AnalysisError:
            continue
        return replace(signed, notes=(*signed.notes, f"direction by {beside.name}; forwards is what most edges show"))
    return tacho.reading


SPEED = Step("speed", 2, measure_speed, "Speed and angle over time")

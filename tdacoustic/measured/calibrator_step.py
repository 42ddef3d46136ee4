"""Step: what a run with a calibrator shows, channel by channel, in the log's own numbers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tdacoustic.formats import scan
from tdacoustic.recording import Channel, Recording
from tdacoustic.sensors.plateaus import Stretch, find_stretches
from tdacoustic.sensors.reading import LONGEST_S, LONGEST_SAMPLES, Plateau, ToneReading, read_plateau
from tdacoustic.sensors.tone_track import ToneTrackMeter
from tdacoustic.steps import LogFile, Step
from tdacoustic.steps.progress import tell_progress

__all__ = ["CALIBRATOR", "CalibratorReadings", "CalibratorSettings", "read_calibrator"]

BLOCK_BYTES = 8 * 2**20


@dataclass(frozen=True)
class CalibratorSettings:
    """Channels of a run with a calibrator, as the log's own numbers, and the frequencies that its tone may have."""

    channels: tuple[Channel, ...]
    wanted_hz: tuple[float, ...]


@dataclass(frozen=True)
class CalibratorReadings:
    """What each channel of the run shows, at instants of the run's time axis."""

    readings: tuple[ToneReading, ...]


def read_calibrator(settings: CalibratorSettings, logs: tuple[LogFile, ...]) -> CalibratorReadings:
    """Step: find where the calibrator was on, in one pass, and read it there."""
    recording = Recording("run", tuple(scan(log.path) for log in logs), settings.channels)
    total = sum(channel.n_samples for channel in settings.channels) or 1
    done, found = 0, {}
    for names in recording.rasters():
        meters = [ToneTrackMeter(recording[name].sample_rate_hz, settings.wanted_hz) for name in names]
        for block in recording.blocks(names, max(1024, BLOCK_BYTES // (8 * len(names)))):
            for meter, samples in zip(meters, block, strict=True):
                meter.take(samples)
            done += block.size
            tell_progress(0.9 * done / total)
        for name, meter in zip(names, meters, strict=True):
            stretches, stood_out_s = find_stretches(meter.result())
            plateaus = tuple(_read(recording, name, stretch) for stretch in stretches)
            found[name] = ToneReading(name, plateaus, stood_out_s)
    return CalibratorReadings(tuple(found[channel.name] for channel in settings.channels))


def _read(recording: Recording, name: str, stretch: Stretch) -> Plateau:
    """Read a stretch; of a long one its middle."""
    channel = recording[name]
    rate = channel.sample_rate_hz
    n = min(int(stretch.duration_s * rate), int(LONGEST_S * rate), LONGEST_SAMPLES)
    first = round(0.5 * (stretch.start_s + stretch.end_s) * rate) - n // 2
    part = replace(channel, start_sample=channel.start_sample + first, n_samples=n)
    samples = replace(recording, channels=(part,)).samples(name)
    span_s = (channel.start_s + stretch.start_s, channel.start_s + stretch.end_s)
    return read_plateau(
        np.ascontiguousarray(samples), rate, stretch.frequency_hz, span_s, stretch.wander_db, part.limits
    )


CALIBRATOR = Step("calibrator", 2, read_calibrator, "Tone of a calibrator")

"""Step: cross spectra of a run's references and receivers, and which channels these are."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Final

from tdacoustic.contributions import CrossPlan, CrossSpectra, CrossSpectrumMeter, plan_cross_spectra
from tdacoustic.errors import AnalysisError
from tdacoustic.formats import scan
from tdacoustic.recording import Channel, Recording
from tdacoustic.steps import LogFile, Step
from tdacoustic.steps.progress import tell_progress

__all__ = [
    "CROSS_SPECTRA",
    "CrossChannels",
    "CrossSpectraSettings",
    "cross_channels",
    "cross_spectra_settings",
    "measure_cross_spectra",
]

RESOLUTION_HZ: Final = 4.0
"""Line spacing: a frame of 250 ms is long against the 12 ms that sound takes for 4 m."""
OVERLAP: Final = 0.5
HIGHEST_HZ: Final = 5000.0
"""Highest line kept [assumed: beyond, an accelerometer's mounting and the paths decide, and no drive is told by it]."""
RATE_PART: Final = 0.4
"""The same over the sampling rate, below the slope of a logger's filter."""
RUN_BYTES: Final = 8 * 2**20
"""Size of a run's spectra: it bounds the number of segments."""
STEADY_SEGMENTS, RUN_UP_SEGMENTS, LEAST_SEGMENTS = 16, 64, 8
BLOCK_BYTES: Final = 8 * 2**20
NEAR: Final = ("near_field", "reference")
"""Roles of a microphone that may be a reference."""
NO_SOURCE: Final = (None, "air")
"""Components that name no source."""


@dataclass(frozen=True)
class CrossChannels:
    """Channels of a run that cross spectra are taken of.

    Parameters
    ----------
    references : tuple of str
    receivers : tuple of str
        Empty, as `references`, where there is nothing to hold against each other.
    left_out : tuple of (str, str)
        Channels that might have been among them, and why they are not.
    """

    references: tuple[str, ...]
    receivers: tuple[str, ...]
    left_out: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class CrossSpectraSettings:
    """References and receivers of a run, their frames and lines.

    Parameters
    ----------
    channels : tuple of Channel
        As they are read: references, then receivers.
    n_references : int
    resolution_hz, overlap, max_frequency_hz : float
    max_segments : int
    """

    channels: tuple[Channel, ...]
    n_references: int
    resolution_hz: float
    overlap: float
    max_frequency_hz: float
    max_segments: int

    @property
    def plan(self) -> CrossPlan:
        """Frames, lines and segments; raises AnalysisError as `tdacoustic.contributions.plan_cross_spectra`."""
        first = self.channels[0]
        return plan_cross_spectra(
            first.sample_rate_hz,
            first.n_samples,
            self.n_references,
            len(self.channels) - self.n_references,
            self.resolution_hz,
            self.overlap,
            self.max_frequency_hz,
            self.max_segments,
        )


def cross_channels(recording: Recording, receivers: Collection[str], usable: Collection[str]) -> CrossChannels:
    """Choose references and receivers of a run.

    A reference is an accelerometer with a component, or a microphone of role ``near_field`` or ``reference`` whose
    component is another than ``air``. Phase counts, so all are of one raster: that with most receivers, then
    references.

    Parameters
    ----------
    recording : Recording
    receivers : collection of str
        Microphones that stand for the noise.
    usable : collection of str
        Channels without a ``bad``.
    """
    left_out: list[tuple[str, str]] = []
    wanted: dict[str, bool] = {}
    for channel in recording.channels:
        reference = _is_reference(channel, left_out)
        if not reference and channel.name not in receivers:
            continue
        if channel.name in usable:
            wanted[channel.name] = reference
        else:
            left_out.append((channel.name, "its quality is bad"))
    chosen = CrossChannels((), ())
    for raster in recording.rasters():
        held = CrossChannels(
            tuple(name for name in raster if wanted.get(name) is True),
            tuple(name for name in raster if wanted.get(name) is False),
        )
        best = len(chosen.receivers), len(chosen.references)
        if held.references and held.receivers and (len(held.receivers), len(held.references)) > best:
            chosen = held
    if chosen.references:
        others = [name for name in wanted if name not in (*chosen.references, *chosen.receivers)]
        why = f"another log, rate or start than {chosen.receivers[0]}: phase needs one clock, nothing is resampled"
        left_out += [(name, why) for name in others]
    return CrossChannels(chosen.references, chosen.receivers, tuple(left_out))


def _is_reference(channel: Channel, left_out: list[tuple[str, str]]) -> bool:
    near = channel.quantity == "sound_pressure" and channel.role in NEAR
    if channel.quantity != "acceleration" and not near:
        return False
    if channel.component not in NO_SOURCE:
        return True
    left_out.append((channel.name, "no component is named that the sensor belongs to"))
    return False


def cross_spectra_settings(channels: Sequence[Channel], n_references: int, steady: bool) -> CrossSpectraSettings:
    """Return the settings for a run's references and receivers, with as many segments as `RUN_BYTES` leaves.

    Parameters
    ----------
    channels : sequence of Channel
        As they are read: references, then receivers.
    n_references : int
    steady : bool
        A run-up has more segments, to be gathered by speed.

    Raises
    ------
    AnalysisError
        A record too short, or too many channels.
    """
    highest_hz = min(HIGHEST_HZ, RATE_PART * channels[0].sample_rate_hz)
    least = CrossSpectraSettings(tuple(channels), n_references, RESOLUTION_HZ, OVERLAP, highest_hz, LEAST_SEGMENTS)
    room = max(LEAST_SEGMENTS, RUN_BYTES // least.plan.segment_bytes)
    return replace(least, max_segments=min(STEADY_SEGMENTS if steady else RUN_UP_SEGMENTS, room))


def measure_cross_spectra(settings: CrossSpectraSettings, logs: tuple[LogFile, ...]) -> CrossSpectra:
    """Step: cross spectra of one raster, in one pass over its samples."""
    recording = Recording("run", tuple(scan(log.path) for log in logs), settings.channels)
    names = [channel.name for channel in settings.channels]
    references, receivers = names[: settings.n_references], names[settings.n_references :]
    meter = CrossSpectrumMeter(settings.plan, references, receivers)
    n_samples, done = settings.channels[0].n_samples, 0
    for block in recording.blocks(names, max(1024, BLOCK_BYTES // (8 * len(names)))):
        meter.take(block)
        done += block.shape[1]
        tell_progress(done / n_samples)
    found = meter.result()
    if found.dead:
        raise AnalysisError(f"{', '.join(found.dead)}: a constant, to which nothing is coherent")
    return found


CROSS_SPECTRA = Step("cross spectra", 1, measure_cross_spectra, "Cross spectra of sensors and microphones")
"""Inputs: ``logs``."""

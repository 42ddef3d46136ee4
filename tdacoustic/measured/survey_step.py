"""Step: one pass over the samples of a run, and all that later steps need of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tdacoustic.formats import scan
from tdacoustic.measured.results import RasterSurvey, RunSpeed, Survey
from tdacoustic.quality import StatisticsMeter
from tdacoustic.recording import Channel, Recording
from tdacoustic.spectra import FramePlan, FramePowerMeter, ThirdOctaveMeter, plan_frames
from tdacoustic.spectra.frames import MAX_SEGMENTS
from tdacoustic.steps import LogFile, Step
from tdacoustic.steps.progress import tell_progress

__all__ = ["SURVEY", "FrameSettings", "SurveySettings", "survey_recording", "survey_run"]

BLOCK_BYTES = 8 * 2**20
"""Samples of all channels read together, as float64."""
BAND_QUANTITIES = frozenset({"sound_pressure", "acceleration"})
LOWEST_BAND_RATE_HZ = 100.0
MIN_SAMPLES = 16
"""Of a record, for a spectrum."""
RUN_UP_SEGMENTS = 256
"""Segments of a run-up: the time steps of its map."""


@dataclass(frozen=True)
class FrameSettings:
    """How records are cut into frames.

    Parameters
    ----------
    resolution_hz : float
        Line spacing.
    overlap : float
    run_up_resolution_hz : float
        Line spacing of a run-up, whose lines smear in long frames; not used where finer than `resolution_hz`.
    """

    resolution_hz: float = 1.0
    overlap: float = 0.5
    run_up_resolution_hz: float = 8.0


@dataclass(frozen=True)
class SurveySettings:
    """Signal channels of a run, their frames, and from which variation of the speed on it is a run-up."""

    channels: tuple[Channel, ...]
    frames: FrameSettings
    speed_tolerance: float


def survey_run(settings: SurveySettings, logs: tuple[LogFile, ...], speed: RunSpeed) -> Survey:
    """Step: one pass over a run's signal channels."""
    if not settings.channels:
        return Survey(())
    recording = Recording("run", tuple(scan(log.path) for log in logs), settings.channels)
    steady = speed.is_steady(settings.speed_tolerance)
    frames = settings.frames
    resolution_hz = frames.resolution_hz if steady else max(frames.resolution_hz, frames.run_up_resolution_hz)
    max_segments = MAX_SEGMENTS if steady else RUN_UP_SEGMENTS
    return survey_recording(recording, resolution_hz, frames.overlap, max_segments=max_segments)


def survey_recording(
    recording: Recording,
    resolution_hz: float = 1.0,
    overlap: float = 0.5,
    bands: bool = True,
    max_segments: int = MAX_SEGMENTS,
) -> Survey:
    """Gather block powers, band powers and statistics of all channels in one pass.

    Parameters
    ----------
    recording : Recording
    resolution_hz, overlap : float
        See `tdacoustic.spectra.plan_frames`.
    bands : bool
        Whether to run the third-octave filters too.
    max_segments : int
        Segments whose powers are kept apart, at most.
    """
    groups = recording.rasters()
    sizes = [recording[names[0]].n_samples * len(names) for names in groups]
    rasters = []
    for number, names in enumerate(groups):
        first = recording[names[0]]
        plan = None
        if first.n_samples >= MIN_SAMPLES:
            rate, n_samples = first.sample_rate_hz, first.n_samples
            plan = plan_frames(rate, n_samples, resolution_hz, overlap, len(names), max_segments)
        rasters.append(_survey_raster(recording, names, plan, bands, sum(sizes[:number]), sum(sizes)))
    return Survey(tuple(rasters))


def _survey_raster(
    recording: Recording,
    names: Sequence[str],
    plan: FramePlan | None,
    with_bands: bool,
    values_before: int,
    values: int,
) -> RasterSurvey:
    """Survey the channels of one raster; `values_before` of all `values` of the run were read before."""
    channels = [recording[name] for name in names]
    rate, n_samples = channels[0].sample_rate_hz, channels[0].n_samples
    statistics = StatisticsMeter(rate, tuple(channel.limits for channel in channels))
    power = None if plan is None else FramePowerMeter(plan, len(names))
    banded = [index for index, channel in enumerate(channels) if channel.quantity in BAND_QUANTITIES]
    third = None
    if with_bands and banded and rate >= LOWEST_BAND_RATE_HZ:
        third = ThirdOctaveMeter(rate, len(banded), n_samples)
    for block in recording.blocks(names, max(1024, BLOCK_BYTES // (8 * len(names)))):
        statistics.take(block)
        if power is not None:
            power.take(block)
        if third is not None:
            third.take(block if len(banded) == len(names) else block[banded])
        values_before += block.size
        tell_progress(values_before / values)
    return RasterSurvey(
        tuple(names),
        statistics.result(),
        None if power is None else power.result(),
        tuple(names[index] for index in banded) if third is not None else (),
        None if third is None else third.result(),
    )


SURVEY = Step("survey", 3, survey_run, "Block powers, bands and statistics")

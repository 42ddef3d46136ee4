"""The tasks that measure one run."""

from __future__ import annotations

from dataclasses import replace

from tdacoustic.measured.line_speed_step import LINE_SPEED, LineSpeedSettings
from tdacoustic.measured.measurement_step import MEASUREMENT, MeasurementSettings
from tdacoustic.measured.speed_step import SPEED, SpeedSettings
from tdacoustic.measured.survey_step import SURVEY, FrameSettings, SurveySettings
from tdacoustic.recording import Channel, span_of
from tdacoustic.steps import LogFile, Task

__all__ = ["as_read", "measurement_task"]


def as_read(channel: Channel) -> Channel:
    """Return the channel without what does not change its samples."""
    return replace(
        channel, component=None, drive="1", role=None, direction=None, position_m=None, distance_m=None, flags=()
    )


def measurement_task(
    label: str,
    settings: MeasurementSettings,
    frames: FrameSettings,
    logs: tuple[LogFile, ...],
    line_speed: LineSpeedSettings | None = None,
) -> Task:
    """Return the task that measures a run, with the tasks it rests on.

    Parameters
    ----------
    label : str
        What is measured, for progress.
    settings : MeasurementSettings
    frames : FrameSettings
    logs : tuple of LogFile
    line_speed : LineSpeedSettings or None
        Where the speed may have to be read from lines: its step then stands between that of the speed and all others,
        which take its result.
    """
    tellers = tuple(replace(as_read(c), drive=c.drive) for c in settings.channels if c.is_speed)
    signals = tuple(as_read(channel) for channel in settings.channels if not channel.is_speed)
    speed = SPEED.task(label, SpeedSettings(tellers, span_of(signals)), logs=logs)
    if line_speed is not None:
        sensors = tuple(as_read(channel) for channel in line_speed.channels)
        speed = LINE_SPEED.task(label, replace(line_speed, channels=sensors), logs=logs, speed=speed)
    survey = SURVEY.task(label, SurveySettings(signals, frames, settings.speed_tolerance), logs=logs, speed=speed)
    return MEASUREMENT.task(label, settings, speed=speed, survey=survey)

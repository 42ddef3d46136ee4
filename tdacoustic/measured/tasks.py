"""The tasks that measure one run."""

from __future__ import annotations

from dataclasses import replace

from tdacoustic.measured.measurement_step import MEASUREMENT, MeasurementSettings
from tdacoustic.measured.speed_step import SPEED, SpeedSettings
from tdacoustic.measured.survey_step import SURVEY, FrameSettings, SurveySettings
from tdacoustic.recording import Channel
from tdacoustic.steps import LogFile, Task

__all__ = ["measurement_task"]


def _as_read(channel: Channel) -> Channel:
    """Return the channel without what does not change its samples."""
    return replace(
        channel, component=None, drive="1", role=None, direction=None, position_m=None, distance_m=None, flags=()
    )


def measurement_task(
    label: str, settings: MeasurementSettings, frames: FrameSettings, logs: tuple[LogFile, ...]
) -> Task:
    """Return the task that measures a run, with the tasks it rests on.

    Parameters
    ----------
    label : str
        What is measured, for progress.
    settings : MeasurementSettings
    frames : FrameSettings
    logs : tuple of LogFile
    """
    speed = SPEED.task(label, SpeedSettings(tuple(c for c in settings.channels if c.is_speed)), logs=logs)
    signals = tuple(_as_read(channel) for channel in settings.channels if not channel.is_speed)
    survey = SURVEY.task(label, SurveySettings(signals, frames, settings.speed_tolerance), logs=logs, speed=speed)
    return MEASUREMENT.task(label, settings, speed=speed, survey=survey)

"""The measured side of one run, as steps: its speed, the survey of its samples, its measurement."""

from tdacoustic.measured.measurement_step import MeasurementSettings
from tdacoustic.measured.results import ChannelResult, RunMeasurement, RunSpeed, SegmentMap, Survey
from tdacoustic.measured.survey_step import FrameSettings, survey_recording
from tdacoustic.measured.tasks import measurement_task

__all__ = [
    "ChannelResult",
    "FrameSettings",
    "MeasurementSettings",
    "RunMeasurement",
    "RunSpeed",
    "SegmentMap",
    "Survey",
    "measurement_task",
    "survey_recording",
]

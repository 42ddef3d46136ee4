"""``[[run]]``: what was driven, and the logs of it."""

from __future__ import annotations

import datetime
from collections import Counter
from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from tdacoustic.campaign.railway import RailwayTest, passage_problem
from tdacoustic.campaign.values import StatedLog
from tdacoustic.sensors import parse_calibrator
from tdacoustic.toml_models import Name, NonNegative, Positive, Table, Text, each_once

__all__ = ["Alignment", "CampaignRun", "Kind", "Mode", "with_names"]

Kind = Literal["test", "background", "calibration_before", "calibration_after"]
"""What a run is for."""

Mode = Literal["traction", "brake", "coast", "hauled"]
"""How the drive was working."""

Alignment = Literal["start", "time_stamps", "shared"]
"""How the logs of a run are put on one time axis."""

LogNumber = Annotated[int, BeforeValidator(lambda value: int(value) if value in range(1, 1000) else value), Field(ge=1)]
"""Which log of a run, from 1; a table's cell is a number with a point."""


def _date(value: Any) -> str:
    if isinstance(value, datetime.date):  # TOML has dates of its own
        return value.isoformat()[:10]
    try:
        return datetime.date.fromisoformat(str(value).strip()).isoformat()
    except ValueError:
        raise ValueError(f"must be a day as '2026-05-04', got {value!r}") from None


def _calibrator(text: str) -> str:
    parse_calibrator(text)
    return text


class CampaignRun(Table):
    """One ``[[run]]``, or one row of ``runs.csv``.

    Parameters
    ----------
    name : str
        Unique. Default: the condition, or ``condition#k`` where several runs lack a
        name or share the condition; of a run that is no test, its kind after the condition.
    condition : str or None
        Runs of one condition are averaged; a test run needs it.
    kind : str
        One of `Kind`.
    mode : str or None
        One of `Mode`.
    torque_n_m : float or None
        Of one motor, signed.
    direction : str or None
        Of travel.
    wheel_diameter_mm : float or None
        As worn.
    oil_temperature_degc : float or None
    train_speed_km_h, motor_speed_rpm : float or None
        Magnitudes; absent where a speed or tacho channel says it.
    start_train_speed_km_h, start_motor_speed_rpm : float or None
        Of a run-up or a coast-down whose speed no channel says: the speed at its start, from which on it is sought in
        the lines of vibration. At most one of both.
    logs : tuple of WrittenPath
        At least one; paths, or URLs.
    sample_rate_hz : float or None
        Only where the log does not say.
    start_s, end_s : float or None
        Cut, from the run's common start.
    align : str or None
        One of `Alignment`: the logs started together, started when their time stamps say, or are aligned by a signal
        that all of them hold. Default: ``"shared"`` where `align_on` is stated, else by time stamps where all logs
        state a zone and parts of a second and differ, else started together.
    align_on : tuple of str
        The shared signal: one channel for each log, in their order, or one that all logs hold; by its name among the
        ``[[channel]]``, else by its name in the logs.
    reference_log : int or None
        Whose clock counts, from 1. Default: the first.
    max_offset_s : float or None
        How far a log's start may lie from where time stamps put it (the reference's start without them), for a shared
        signal that repeats itself.
    test : str or None
        What a railway standard calls the run: ``"pass-by"``, ``"stationary"``, ``"starting"``, ``"braking"`` or
        ``"constant-speed"``.
    date : str or None
        Day of the run, as ``"2026-05-04"``; only where the log does not say. A sensor's calibration is chosen by it.
    calibrator : str or None
        What the calibrator of a calibration run gives: ``"94 dB"``, ``"10 m/s^2"``, ``"1 g peak"``. Without it such a
        run is only reported.
    calibrator_frequency_hz : float or None
        Default: what such calibrators usually have.
    calibrated : tuple of str
        Channels that it was put on. Default: those of its quantity in which its tone stands out. Where a calibrator run
        holds fewer logs than other runs, as those of one recorder alone, it says whose they are: the `log` of a
        ``[[channel]]`` then counts the recorders, in the order in which the run names their logs.
    front_s, middle_s, rear_s : float or None
        Of a pass-by: when the unit's front, middle and rear are opposite the microphone, from the run's common start.
    valid : bool
    reject_reason : str or None
        Of a run that is not valid.
    """

    name: Name = ""
    condition: Name | None = None
    kind: Kind = "test"
    mode: Mode | None = None
    torque_n_m: float | None = None
    direction: Text | None = None
    wheel_diameter_mm: Positive | None = None
    oil_temperature_degc: Annotated[float, Field(ge=-273.15)] | None = None
    train_speed_km_h: NonNegative | None = None
    motor_speed_rpm: NonNegative | None = None
    start_train_speed_km_h: NonNegative | None = None
    start_motor_speed_rpm: NonNegative | None = None
    logs: Annotated[tuple[StatedLog, ...], Field(min_length=1)]
    sample_rate_hz: Positive | None = None
    start_s: float | None = None
    end_s: float | None = None
    align: Alignment | None = None
    align_on: Annotated[tuple[Text, ...], AfterValidator(each_once)] = ()
    reference_log: LogNumber | None = None
    max_offset_s: Positive | None = None
    date: Annotated[str, BeforeValidator(_date)] | None = None
    calibrator: Annotated[Text, AfterValidator(_calibrator)] | None = None
    calibrator_frequency_hz: Positive | None = None
    calibrated: Annotated[tuple[Name, ...], AfterValidator(each_once)] = ()
    test: RailwayTest | None = None
    front_s: float | None = None
    middle_s: float | None = None
    rear_s: float | None = None
    valid: bool = True
    reject_reason: Text | None = None

    @model_validator(mode="after")
    def _hangs_together(self) -> CampaignRun:
        if self.kind == "test" and self.condition is None:
            raise ValueError("condition is missing; a run of kind 'test' needs one")
        start_s = 0.0 if self.start_s is None else self.start_s
        if self.end_s is not None and not self.end_s > start_s:
            raise ValueError(f"end_s must be > start_s = {start_s:g}, got {self.end_s:g}")
        if not self.valid and self.reject_reason is None:
            raise ValueError("valid = false needs a reject_reason, which is missing")
        if self.valid and self.reject_reason is not None:
            raise ValueError(f"reject_reason {self.reject_reason!r} stands beside valid = true; set valid = false")
        self._one_speed()
        keys = [key for key in ("calibrator", "calibrator_frequency_hz", "calibrated") if getattr(self, key)]
        if keys and not self.is_calibration:
            raise ValueError(f"{keys[0]} is of a run of kind 'calibration_before' or 'calibration_after'")
        self._one_axis()
        problem = passage_problem(self)
        if problem is not None:
            raise ValueError(problem)
        written = [log.text for log in self.logs]
        for text, count in Counter(str(log.path) for log in self.logs).items():
            if count > 1:
                raise ValueError(f"logs names {text!r} {count} times, got {written}")
        return self

    @property
    def is_calibration(self) -> bool:
        """Whether a calibrator was recorded in it."""
        return self.kind.startswith("calibration")

    def _one_axis(self) -> None:
        """Raise where keys of several logs contradict each other, or name a log that is not there."""
        keys = [key for key in ("align", "align_on", "reference_log", "max_offset_s") if getattr(self, key)]
        if keys and len(self.logs) == 1:
            raise ValueError(f"{keys[0]} is of a run of several logs, but logs names one")
        if self.align == "shared" and not self.align_on:
            raise ValueError("align = 'shared' needs align_on, the channels that hold the shared signal; it is missing")
        if self.align_on and self.align not in (None, "shared"):
            raise ValueError(f"align_on is for align = 'shared', but align is {self.align!r}")
        if self.max_offset_s is not None and not self.align_on:
            raise ValueError("max_offset_s bounds the search of a shared signal, but align_on is missing")
        if len(self.align_on) not in (0, 1, len(self.logs)):
            raise ValueError(f"align_on must name one channel, or one for each of the {len(self.logs)} logs")
        if self.reference_log is not None and self.reference_log > len(self.logs):
            raise ValueError(f"reference_log = {self.reference_log}, but there are {len(self.logs)} logs")

    def _one_speed(self) -> None:
        """Raise where a start is stated twice, or beside a speed that holds for the whole run."""
        starts = [key for key in ("start_train_speed_km_h", "start_motor_speed_rpm") if getattr(self, key) is not None]
        held = [key for key in ("train_speed_km_h", "motor_speed_rpm") if getattr(self, key) is not None]
        if len(starts) > 1:
            raise ValueError(f"{' and '.join(starts)} are both given; leave one out")
        if starts and held:
            raise ValueError(
                f"{starts[0]} is of a run whose speed changes, but {held[0]} states one for all of it; leave one out"
            )


def _default_name(run: CampaignRun) -> str:
    if run.kind == "test":
        return run.condition or ""
    return run.kind if run.condition is None else f"{run.condition} {run.kind}"


def with_names(runs: Sequence[CampaignRun]) -> tuple[CampaignRun, ...]:
    """Return the runs with a name each: their own, the condition, or ``condition#k``, k counted over its runs."""
    bases = [_default_name(run) for run in runs]
    totals, seen, named = Counter(bases), Counter[str](), []
    for run, base in zip(runs, bases, strict=True):
        seen[base] += 1
        default = base if totals[base] == 1 else f"{base}#{seen[base]}"
        named.append(run if run.name else run.model_copy(update={"name": default}))
    return tuple(named)

"""How the logs of each run lie on one time axis: as started together, by time stamps, or by a shared signal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from tdacoustic.errors import AnalysisError, CampaignError, TdacousticError
from tdacoustic.formats import scan
from tdacoustic.ingest.axes import LogAxis, RunAxes
from tdacoustic.ingest.sources import NotFoundError, find_source
from tdacoustic.ingest.stamps import Stamp, late_s, parse_stamp
from tdacoustic.measured.clock_step import CLOCK, ClockFinding, ClockSettings, SharedChannel
from tdacoustic.measured.run_clocks import LogClock, RunClocks
from tdacoustic.quality import Verdict
from tdacoustic.recording import Log
from tdacoustic.steps import Store, Task, execute, lineage, result_of
from tdacoustic.workflows.fetched_logs import hashed_logs

if TYPE_CHECKING:
    from tdacoustic.campaign import Campaign, CampaignRun
    from tdacoustic.steps import Jobs, Progress, Record

__all__ = ["campaign_clocks"]

SUB_SECOND_S: Final = 0.5
"""Resolution below which stamps are believed without being asked for."""
WELL_ALIGNED: Final = 0.1
"""Samples of error of the axis, above which a warning says it."""


@dataclass(frozen=True)
class _Several:
    """A run of several logs."""

    run: CampaignRun
    logs: tuple[Log, ...]

    @property
    def reference(self) -> int:
        return (self.run.reference_log or 1) - 1

    @property
    def others(self) -> tuple[int, ...]:
        return tuple(index for index in range(len(self.logs)) if index != self.reference)

    def name(self, index: int) -> str:
        return self.logs[index].path.name

    def stamps(self) -> list[Stamp | None]:
        return [None if log.start_time is None else parse_stamp(log.start_time) for log in self.logs]

    def rate(self, index: int, column: int) -> float | None:
        return self.logs[index].channels[column].raster.sample_rate_hz or self.run.sample_rate_hz

    def span_s(self, index: int) -> tuple[float, float]:
        """First and last instant of a log's samples after its own start."""
        rasters = [channel.raster for channel in self.logs[index].channels]
        rates = [self.rate(index, column) for column in range(len(rasters))]
        ends = [r.start_s + r.n_samples / rate for r, rate in zip(rasters, rates, strict=True) if rate is not None]
        return min((r.start_s for r in rasters), default=0.0), max(ends, default=0.0)


def campaign_clocks(
    campaign: Campaign, store: Store, n_jobs: Jobs | None, progress: Progress | None
) -> tuple[dict[str, RunClocks], dict[str, TdacousticError], dict[str, Record]]:
    """Return the clocks of each run of several logs, why some cannot be had, and the records of the steps.

    Parameters
    ----------
    campaign : Campaign
    store : Store
    n_jobs : int or Executor or None
    progress : callable or None
    """
    clocks: dict[str, RunClocks] = {}
    failed: dict[str, TdacousticError] = {}
    tasks: dict[str, dict[int, Task]] = {}
    held: dict[str, _Several] = {}
    for run in campaign.runs:
        if not run.valid or len(run.logs) < 2:
            continue
        try:
            several = _Several(run, tuple(scan(log.path) for log in run.logs))
        except TdacousticError:
            continue  # said where the run's channels are bound
        try:
            method = _method(several)
            if method == "shared":
                tasks[run.name], held[run.name] = _tasks(campaign, several, store), several
            elif method == "time_stamps":
                clocks[run.name] = _by_stamps(several)
            else:
                clocks[run.name] = _together(several)
        except TdacousticError as error:
            failed[run.name] = error
    every = [task for of_run in tasks.values() for task in of_run.values()]
    errors = execute(every, store, n_jobs or 1, progress).failed if every else {}
    records: dict[str, Record] = {}
    for name, of_run in tasks.items():
        broken = next((errors[task.key] for task in of_run.values() if task.key in errors), None)
        if broken is not None:
            failed[name] = broken
            continue
        for task in of_run.values():
            records.update(lineage(task, store))
        found = {index: result_of(task, store) for index, task in of_run.items()}
        try:
            clocks[name] = _by_signal(held[name], found)
        except AnalysisError as error:
            failed[name] = error
    return clocks, failed, records


def _method(several: _Several) -> str:
    """Return what the run says, else what its time stamps allow."""
    run = several.run
    if run.align_on:
        return "shared"
    if run.align is not None:
        return run.align
    stamps = several.stamps()
    known = [stamp for stamp in stamps if stamp is not None]
    if len(known) == len(stamps) and len({stamp.zoned for stamp in known}) == 1:
        _check_overlap(several, known)
        differ = any(late_s(stamp, known[0]) != 0.0 for stamp in known[1:])
        if differ and all(stamp.zoned and stamp.resolution_s < SUB_SECOND_S for stamp in known):
            return "time_stamps"
    return "start"


def _check_overlap(several: _Several, stamps: Sequence[Stamp]) -> None:
    """Raise where time stamps put a log wholly before or after the reference."""
    own = several.span_s(several.reference)
    for index in several.others:
        late = late_s(stamps[index], stamps[several.reference])
        first, last = several.span_s(index)
        if late + first >= own[1] or late + last <= own[0]:
            raise CampaignError(
                f"run {several.run.name!r}: by their time stamps {several.name(several.reference)} "
                f"({stamps[several.reference].text}, {own[1] - own[0]:.6g} s) and {several.name(index)} "
                f"({stamps[index].text}, {last - first:.6g} s) do not overlap: the latter starts {late:.9g} s later. "
                'If a stamp is wrong, state align = "start" (they started together) or align_on = [...] (a signal that '
                "both hold)"
            )


def _together(several: _Several) -> RunClocks:
    logs = tuple(LogClock(several.name(i), several.name(several.reference), "start") for i in several.others)
    return RunClocks(several.run.name, "start", logs)


def _by_stamps(several: _Several) -> RunClocks:
    run, stamps = several.run, []
    for log, stamp in zip(several.logs, several.stamps(), strict=True):
        if stamp is None:
            said = "states no start" if log.start_time is None else f"states its start as {log.start_time!r}"
            raise CampaignError(f"run {run.name!r}: align = 'time_stamps', but {log.path.name} {said}")
        stamps.append(stamp)
    if len({stamp.zoned for stamp in stamps}) > 1:
        texts = ", ".join(f"{log.path.name} at {stamp.text}" for log, stamp in zip(several.logs, stamps, strict=True))
        raise CampaignError(f"run {run.name!r}: some time stamps have a zone and some none: {texts}")
    _check_overlap(several, stamps)
    reference = stamps[several.reference]
    axes, clocks, verdicts = [LogAxis()] * len(stamps), [], []
    for index in several.others:
        late = late_s(stamps[index], reference)
        resolution_s = max(stamps[index].resolution_s, reference.resolution_s)
        axes[index] = LogAxis(late, 1.0, f"starts {late:.9g} s after {several.name(several.reference)} by time stamps")
        doubt = (
            f"{several.name(index)} is put {late:.9g} s after {several.name(several.reference)} by their time stamps, "
            f"which resolve {resolution_s:g} s; how well the two clocks were set is not known, their drift is not "
            "corrected"
        )
        verdicts.append(Verdict("", "clock", "warning", doubt))
        names = several.name(index), several.name(several.reference)
        clocks.append(LogClock(*names, "time_stamps", late, doubts=(doubt,)))
    return RunClocks(run.name, "time_stamps", tuple(clocks), RunAxes(several.reference, tuple(axes)), tuple(verdicts))


# ---------------------------------------------------------------- shared signals


def _tasks(campaign: Campaign, several: _Several, store: Store) -> dict[int, Task]:
    """One task for each log but the reference."""
    run, reference = several.run, several.reference
    columns = [_column(campaign, several, index) for index in range(len(several.logs))]
    stamps = several.stamps()
    found = {}
    for index in several.others:
        one, two = stamps[reference], stamps[index]
        centre_s = late_s(two, one) if one is not None and two is not None and one.zoned == two.zoned else 0.0
        settings = ClockSettings(
            columns[reference], columns[index], run.max_offset_s, centre_s if run.max_offset_s is not None else 0.0
        )
        logs = hashed_logs(run, several.logs, store)
        pair = (logs[reference], logs[index])
        found[index] = CLOCK.task(f"run {run.name}, {several.name(index)}", settings, logs=pair)
    return found


def _column(campaign: Campaign, several: _Several, index: int) -> SharedChannel:
    """Find the shared signal in a log."""
    from tdacoustic.campaign import CampaignChannel

    run, log = several.run, several.logs[index]
    name = run.align_on[0] if len(run.align_on) == 1 else run.align_on[index]
    stated = next((channel for channel in campaign.channels if channel.name == name), None)
    if stated is not None and stated.log is not None and len(run.align_on) > 1 and stated.log != index + 1:
        raise CampaignError(
            f"run {run.name!r}: align_on names {name!r} for log {index + 1} ({log.path.name}), but its [[channel]] "
            f"says log = {stated.log}; align_on is in the order of logs"
        )
    source = name if stated is None else stated.source
    try:
        place = find_source(CampaignChannel(name="shared", source=source, log=index + 1), several.logs)
    except NotFoundError as error:
        raise CampaignError(f"run {run.name!r}: align_on {name!r}: {error}") from None
    raster = log.channels[place.column].raster
    rate = several.rate(index, place.column)
    if rate is None:
        raise CampaignError(
            f"run {run.name!r}: {log.path.name} states no sampling rate, add sample_rate_hz = ... to the run"
        )
    return SharedChannel(place.column, rate, raster.n_samples, raster.start_s)


def _by_signal(several: _Several, found: dict[int, ClockFinding]) -> RunClocks:
    run, names = several.run, several.name(several.reference)
    axes, clocks, verdicts = [LogAxis()] * len(several.logs), [], []
    for index, finding in found.items():
        estimate = finding.estimate
        if estimate is None:
            failure = finding.failure
            reason = "no alignment was found" if failure is None else failure.reason
            hint = (
                "max_offset_s narrows the search"
                if failure is not None and failure.ambiguous
                else ('align = "start" or "time_stamps" goes without it')
            )
            raise AnalysisError(
                f"run {run.name!r}: {several.name(index)} is not aligned to {names} on {', '.join(run.align_on)}: "
                f"{reason}; {hint}"
            )
        rate = max(_highest_rate(several, i) for i in (index, several.reference))
        said = (
            f"starts at {estimate.offset_s:.9g} s of {names} and counts {estimate.drift_ppm:+.4g} ppm of its rate, "
            f"by {_of_whom(run.align_on, index)}"
        )
        axes[index] = LogAxis(estimate.offset_s, 1.0 + 1e-6 * estimate.drift_ppm, f"time axis {said}")
        error = estimate.axis_error_s * rate
        words = (
            f"{several.name(index)} {said}; standard error {1e6 * estimate.offset_error_s:.3g} us, "
            f"{estimate.drift_error_ppm:.2g} ppm, of an instant at most {error:.2g} samples; nothing is resampled"
        )
        doubtful = bool(error > WELL_ALIGNED or estimate.doubts)
        verdicts.append(Verdict("", "clock", "warning" if doubtful else "ok", "; ".join((words, *estimate.doubts))))
        clocks.append(
            LogClock(
                several.name(index),
                names,
                "shared",
                estimate.offset_s,
                estimate.offset_error_s,
                estimate.drift_ppm,
                estimate.drift_error_ppm,
                rate,
                estimate,
                estimate.doubts,
            )
        )
    return RunClocks(run.name, "shared", tuple(clocks), RunAxes(several.reference, tuple(axes)), tuple(verdicts))


def _of_whom(align_on: Sequence[str], index: int) -> str:
    return align_on[0] if len(align_on) == 1 else align_on[index]


def _highest_rate(several: _Several, index: int) -> float:
    """Highest rate of a log: what an error is measured in."""
    rates = [several.rate(index, column) for column in range(len(several.logs[index].channels))]
    return max(rate for rate in rates if rate is not None)

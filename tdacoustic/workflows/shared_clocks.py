"""Clocks of a run's logs by a signal that all of them hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final

from tdacoustic.errors import AnalysisError, CampaignError, TdacousticError
from tdacoustic.ingest.axes import LogAxis, RunAxes
from tdacoustic.ingest.sources import NotFoundError, find_source
from tdacoustic.ingest.stamps import late_s
from tdacoustic.measured.clock_step import CLOCK, ClockFinding, ClockSettings, SharedChannel
from tdacoustic.measured.run_clocks import LogClock, RunClocks
from tdacoustic.quality import Verdict
from tdacoustic.steps import Store, Task, execute, lineage, result_of
from tdacoustic.workflows.fetched_logs import hashed_logs

if TYPE_CHECKING:
    from tdacoustic.campaign import Campaign
    from tdacoustic.steps import Jobs, Progress, Record
    from tdacoustic.workflows.several_logs import SeveralLogs

__all__ = ["clocks_by_signal", "shared_tasks", "sought_clocks"]

WELL_ALIGNED: Final = 0.1
"""Samples of error of the axis, above which a warning says it."""


def shared_tasks(campaign: Campaign, several: SeveralLogs, store: Store) -> dict[int, Task]:
    """Return a task for each log but the reference, by position.

    Parameters
    ----------
    campaign : Campaign
    several : SeveralLogs
    store : Store

    Raises
    ------
    CampaignError
        A log does not hold the shared signal, or no rate of it is stated.
    """
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


def _column(campaign: Campaign, several: SeveralLogs, index: int) -> SharedChannel:
    """Find the shared signal in a log."""
    from tdacoustic.campaign import CampaignChannel

    run, log = several.run, several.logs[index]
    name = _of_whom(run.align_on, index)
    stated = next((channel for channel in campaign.channels if channel.name == name), None)
    own = next((channel for channel in several.scanned.channels if channel.name == name), None)
    if own is not None and own.log is not None and len(run.align_on) > 1 and own.log != index + 1:
        raise CampaignError(
            f"run {run.name!r}: align_on names {name!r} for log {index + 1} ({several.name(index)}), but its "
            f"[[channel]] says log = {own.log}; align_on is in the order of logs"
        )
    source = name if stated is None else stated.source
    try:
        place = find_source(
            CampaignChannel(name="shared", source=source, log=index + 1), several.logs, several.scanned.names
        )
    except NotFoundError as error:
        raise CampaignError(f"run {run.name!r}: align_on {name!r}: {error}") from None
    raster = log.channels[place.column].raster
    rate = several.rate(index, place.column)
    if rate is None:
        raise CampaignError(
            f"run {run.name!r}: {several.name(index)} states no sampling rate, add sample_rate_hz = ... to the run"
        )
    return SharedChannel(place.column, rate, raster.n_samples, raster.start_s)


def sought_clocks(
    tasks: Mapping[str, Mapping[int, Task]], store: Store, n_jobs: Jobs, progress: Progress | None
) -> tuple[dict[str, dict[int, ClockFinding]], dict[str, TdacousticError], dict[str, Record]]:
    """Return what the search of a shared signal finds by run and log, which runs it fails for, and its records.

    Parameters
    ----------
    tasks : mapping of str to mapping of int to Task
        By run, as `shared_tasks` gives them.
    store : Store
    n_jobs : int or Executor
    progress : callable or None
    """
    every = [task for of_run in tasks.values() for task in of_run.values()]
    errors = execute(every, store, n_jobs, progress).failed if every else {}
    found: dict[str, dict[int, ClockFinding]] = {}
    failed: dict[str, TdacousticError] = {}
    records: dict[str, Record] = {}
    for name, of_run in tasks.items():
        broken = next((errors[task.key] for task in of_run.values() if task.key in errors), None)
        if broken is not None:
            failed[name] = broken
            continue
        for task in of_run.values():
            records.update(lineage(task, store))
        found[name] = {index: result_of(task, store) for index, task in of_run.items()}
    return found, failed, records


def clocks_by_signal(several: SeveralLogs, found: Mapping[int, ClockFinding]) -> RunClocks:
    """Return the clocks of a run by what was found.

    Parameters
    ----------
    several : SeveralLogs
    found : mapping of int to ClockFinding
        By position of the log.

    Raises
    ------
    AnalysisError
        A log could not be aligned.
    """
    run, names = several.run, several.name(several.reference)
    axes, clocks, verdicts = [LogAxis()] * len(several.logs), [], []
    for index, finding in found.items():
        estimate = finding.estimate
        if estimate is None:
            raise _not_aligned(several, index, finding)
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
        detail = "; ".join((words, *estimate.notes, *estimate.doubts))
        verdicts.append(Verdict("", "clock", "warning" if doubtful else "ok", detail))
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


def _not_aligned(several: SeveralLogs, index: int, finding: ClockFinding) -> AnalysisError:
    run, failure = several.run, finding.failure
    reason = "no alignment was found" if failure is None else failure.reason
    ambiguous = failure is not None and failure.ambiguous
    hint = "max_offset_s narrows the search" if ambiguous else 'align = "start" or "time_stamps" goes without it'
    return AnalysisError(
        f"run {run.name!r}: {several.name(index)} is not aligned to {several.name(several.reference)} on "
        f"{', '.join(run.align_on)}: {reason}; {hint}"
    )


def _of_whom(align_on: Sequence[str], index: int) -> str:
    return align_on[0] if len(align_on) == 1 else align_on[index]


def _highest_rate(several: SeveralLogs, index: int) -> float:
    """Highest rate of a log: what an error is measured in."""
    rates = [several.rate(index, column) for column in range(len(several.logs[index].channels))]
    return max(rate for rate in rates if rate is not None)

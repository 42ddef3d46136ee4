"""How the logs of each run lie on one time axis: as started together, by time stamps, or by a shared signal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from tdacoustic.errors import AnalysisError, CampaignError, TdacousticError
from tdacoustic.ingest.axes import LogAxis, RunAxes
from tdacoustic.ingest.stamps import Stamp, late_s
from tdacoustic.measured.run_clocks import LogClock, RunClocks
from tdacoustic.quality import Verdict
from tdacoustic.steps import Store, Task
from tdacoustic.workflows.several_logs import SeveralLogs
from tdacoustic.workflows.shared_clocks import clocks_by_signal, shared_tasks, sought_clocks

if TYPE_CHECKING:
    from tdacoustic.campaign import Campaign
    from tdacoustic.steps import Jobs, Progress, Record
    from tdacoustic.workflows.scanned_runs import ScannedRun

__all__ = ["CampaignClocks", "campaign_clocks"]

SUB_SECOND_S: Final = 0.5
"""Resolution below which stamps are believed without being asked for."""


@dataclass(frozen=True)
class CampaignClocks:
    """How the logs of a campaign's runs lie on one axis each.

    Parameters
    ----------
    runs : mapping of str to RunClocks
        By run of several logs.
    failed : mapping of str to TdacousticError
        By run, why that cannot be had.
    records : mapping of str to Record
        By key, of the steps that were needed.
    """

    runs: Mapping[str, RunClocks] = field(default_factory=dict)
    failed: Mapping[str, TdacousticError] = field(default_factory=dict)
    records: Mapping[str, Record] = field(default_factory=dict)


def campaign_clocks(
    campaign: Campaign,
    scanned: Sequence[ScannedRun],
    store: Store,
    n_jobs: Jobs | None = None,
    progress: Progress | None = None,
) -> CampaignClocks:
    """Find the clocks of each run of several logs; one that cannot be had does not stop the others.

    Parameters
    ----------
    campaign : Campaign
    scanned : sequence of ScannedRun
        Its valid runs.
    store : Store
    n_jobs : int or Executor, optional
        Processes; default 1.
    progress : callable, optional
    """
    clocks: dict[str, RunClocks] = {}
    failed: dict[str, TdacousticError] = {}
    tasks: dict[str, dict[int, Task]] = {}
    held: dict[str, SeveralLogs] = {}
    for item in scanned:
        run, several = item.run, SeveralLogs(item)
        if len(item.logs) < 2:
            continue
        try:
            method = _method(several)
            if method == "shared":
                tasks[run.name], held[run.name] = shared_tasks(campaign, several, store), several
            elif method == "time_stamps":
                clocks[run.name] = _by_stamps(several)
            else:
                clocks[run.name] = _together(several)
        except TdacousticError as error:
            failed[run.name] = error
    found, broken, records = sought_clocks(tasks, store, n_jobs or 1, progress)
    failed |= broken
    for name, findings in found.items():
        try:
            clocks[name] = clocks_by_signal(held[name], findings)
        except AnalysisError as error:
            failed[name] = error
    return CampaignClocks(clocks, failed, records)


def _method(several: SeveralLogs) -> str:
    """Return what the run says, else what its time stamps allow."""
    run = several.run
    if run.align_on:
        return "shared"
    if run.align is not None:
        return run.align
    stamps = several.stamps()
    known = [stamp for stamp in stamps if stamp is not None]
    if len(known) == len(stamps) and len({stamp.zoned for stamp in known}) == 1:
        if several.run.is_calibration and _apart(several, known):
            return "time_stamps"  # one recorder after the other: these did not start together
        _check_overlap(several, known)
        differ = any(late_s(stamp, known[0]) != 0.0 for stamp in known[1:])
        if differ and all(stamp.zoned and stamp.resolution_s < SUB_SECOND_S for stamp in known):
            return "time_stamps"
    return "start"


def _apart(several: SeveralLogs, stamps: Sequence[Stamp]) -> tuple[int, ...]:
    """Logs that time stamps put wholly before or after the reference."""
    own, found = several.span_s(several.reference), []
    for index in several.others:
        late = late_s(stamps[index], stamps[several.reference])
        first, last = several.span_s(index)
        if late + first >= own[1] or late + last <= own[0]:
            found.append(index)
    return tuple(found)


def _check_overlap(several: SeveralLogs, stamps: Sequence[Stamp]) -> None:
    """Raise where time stamps put a log wholly before or after the reference.

    A calibrator goes from microphone to microphone: the logs of its runs need not overlap.
    """
    apart = () if several.run.is_calibration else _apart(several, stamps)
    if not apart:
        return
    one, two = several.reference, apart[0]
    lengths = [last - first for first, last in map(several.span_s, (one, two))]
    raise CampaignError(
        f"run {several.run.name!r}: by their time stamps {several.name(one)} ({stamps[one].text}, {lengths[0]:.6g} s) "
        f"and {several.name(two)} ({stamps[two].text}, {lengths[1]:.6g} s) do not overlap: the latter starts "
        f"{late_s(stamps[two], stamps[one]):.9g} s later. "
        'If a stamp is wrong, state align = "start" (they started together) or align_on = [...] (a signal that both '
        "hold)"
    )


def _together(several: SeveralLogs) -> RunClocks:
    logs = tuple(LogClock(several.name(i), several.name(several.reference), "start") for i in several.others)
    return RunClocks(several.run.name, "start", logs)


def _by_stamps(several: SeveralLogs) -> RunClocks:
    run, stamps = several.run, []
    for name, log, stamp in zip(several.scanned.names, several.logs, several.stamps(), strict=True):
        if stamp is None:
            said = "states no start" if log.start_time is None else f"states its start as {log.start_time!r}"
            raise CampaignError(f"run {run.name!r}: align = 'time_stamps', but {name} {said}")
        stamps.append(stamp)
    if len({stamp.zoned for stamp in stamps}) > 1:
        texts = ", ".join(f"{name} at {stamp.text}" for name, stamp in zip(several.scanned.names, stamps, strict=True))
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
        verdicts.append(Verdict("", "clock", "warning" if several.needs_axis else "ok", doubt))
        names = several.name(index), several.name(several.reference)
        clocks.append(LogClock(*names, "time_stamps", late, doubts=(doubt,) if several.needs_axis else ()))
    return RunClocks(run.name, "time_stamps", tuple(clocks), RunAxes(several.reference, tuple(axes)), tuple(verdicts))

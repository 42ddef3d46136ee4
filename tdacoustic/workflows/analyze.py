"""The measured side of a campaign: logs to levels, spectra, lines and sources."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from tdacoustic.campaign import Campaign, CampaignRun, load_campaign
from tdacoustic.errors import TdacousticError
from tdacoustic.steps import Store, Task, default_store_path
from tdacoustic.steps.execution import Progress

if TYPE_CHECKING:
    from tdacoustic.attribution import Dominance, SourceLine
    from tdacoustic.ingest import Bound
    from tdacoustic.measured.runs import MeasuredRun
    from tdacoustic.results import Analysis, LogInput
    from tdacoustic.steps import LogFile, Record

__all__ = ["analyze"]

PARALLEL_BYTES = 100 * 2**20
"""Logs of less in all are analysed in this process: starting others would take longer."""

NO_FLEET = "No fleet file: whose order a line is, is not known, so it stays unassigned."
FLEET_UNUSED = (
    "The campaign names a fleet file, but this version does not ascribe lines to sources yet; it stays unassigned."
)


def analyze(
    campaign: str | Path | Campaign,
    store: str | Path | Store | None = None,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> Analysis:
    """Analyse the logs of a campaign.

    Parameters
    ----------
    campaign : path or Campaign
    store : path or Store, optional
        Where results are kept; default `tdacoustic.steps.default_store_path`.
    jobs : int, optional
        Processes; default: one a core where the logs are large enough to pay.
    progress : callable, optional

    Returns
    -------
    Analysis
        A run that cannot be read does not stop the others; it is named in
        `Analysis.problems` and in the quality table.

    Raises
    ------
    TdacousticError
        The campaign is wrong, or no run can be used.
    """
    from tdacoustic.steps import lineage, result_of

    campaign = campaign if isinstance(campaign, Campaign) else load_campaign(campaign)
    store = store if isinstance(store, Store) else Store(store or default_store_path())
    prepared = [_prepare(campaign, run, store) for run in campaign.runs if run.valid]
    _check_coverage(campaign, prepared)
    tasks = {item.run.name: item.task for item in prepared if item.task is not None}
    jobs = _jobs(prepared) if jobs is None else jobs
    failures = _execute(tasks, store, jobs, progress)
    runs = tuple(
        _measured(run, next((item for item in prepared if item.run is run), None), tasks, failures, store)
        for run in campaign.runs
    )
    problems = [*_problems(prepared, failures), *_missing_receivers(campaign, runs), *_not_built(campaign)]
    records: dict[str, Record] = {}
    for name, task in tasks.items():
        if name not in failures:
            result_of(task, store)
            records.update(lineage(task, store))
    inputs = _inputs(prepared)
    return _assemble(campaign, runs, tuple(problems), inputs, tuple(records.items()))


# ---------------------------------------------------------------- runs


@dataclass(frozen=True)
class _Prepared:
    run: CampaignRun
    bound: Bound | None = None
    task: Task | None = None
    logs: tuple[LogFile, ...] = ()
    error: TdacousticError | None = None
    flags: tuple[str, ...] = ()


def _prepare(campaign: Campaign, run: CampaignRun, store: Store) -> _Prepared:
    """Scan and hash a run's logs, bind its channels, make its task."""
    from tdacoustic.formats import scan
    from tdacoustic.ingest import bind_run
    from tdacoustic.measured import FrameSettings, MeasurementSettings, measurement_task
    from tdacoustic.steps import log_file

    try:
        scanned = tuple(scan(log.path) for log in run.logs)
        bound = bind_run(campaign.channels, run, scanned)
        logs = tuple(log_file(log.path, store) for log in run.logs)
    except TdacousticError as error:
        return _Prepared(run, error=error)
    analysis = campaign.analysis
    settings = MeasurementSettings(
        channels=bound.recording.channels,
        refused=tuple((refusal.channel, refusal.reason) for refusal in bound.refused),
        line_prominence_db=analysis.line_prominence_db,
        speed_tolerance=analysis.speed_tolerance,
        mains_hz=analysis.mains_hz,
        level_band_hz=analysis.level_band_hz,
        stated=_stated_speeds(run),
    )
    frames = FrameSettings(analysis.frequency_resolution_hz, analysis.overlap, analysis.run_up_resolution_hz)
    task = measurement_task(f"run {run.name}", settings, frames, logs)
    flags = [f"{log.path.name}: {flag}" for log in scanned for flag in log.flags]
    flags += [warning for warning in bound.warnings if not warning.startswith("channel ")]
    return _Prepared(run, bound, task, logs, flags=tuple(flags))


def _stated_speeds(run: CampaignRun) -> tuple[tuple[str, float], ...]:
    stated = []
    if run.motor_speed_rpm is not None:
        stated.append(("motor", run.motor_speed_rpm / 60.0))
    if run.train_speed_km_h is not None:
        stated.append(("train", run.train_speed_km_h / 3.6))
    return tuple(stated)


def _check_coverage(campaign: Campaign, prepared: Sequence[_Prepared]) -> None:
    """Raise where nothing can be used, or where a channel can be used in no run."""
    from tdacoustic.ingest import check_coverage

    if not prepared:
        return
    errors = [item.error for item in prepared if item.error is not None]
    if len(errors) == len(prepared):
        first = errors[0]
        raise type(first)("\n".join(dict.fromkeys(str(error) for error in errors))) from first
    check_coverage([item.bound for item in prepared if item.bound is not None], campaign.channels)


def _jobs(prepared: Sequence[_Prepared]) -> int:
    n_bytes = sum(log.n_bytes for item in prepared for log in item.logs)
    return 1 if n_bytes < PARALLEL_BYTES else (os.cpu_count() or 1)


def _execute(
    tasks: Mapping[str, Task], store: Store, jobs: int, progress: Progress | None
) -> dict[str, TdacousticError]:
    """Bring the tasks' results into the store; return the errors by run."""
    from tdacoustic.steps import execute

    outcome = execute(list(tasks.values()), store, jobs, progress)
    failures = {name: outcome.failed[task.key] for name, task in tasks.items() if task.key in outcome.failed}
    if failures and len(failures) == len(tasks):
        first = next(iter(failures.values()))
        raise type(first)("\n".join(dict.fromkeys(str(error) for error in failures.values()))) from first
    return failures


def _measured(
    run: CampaignRun,
    prepared: _Prepared | None,
    tasks: Mapping[str, Task],
    failures: Mapping[str, TdacousticError],
    store: Store,
) -> MeasuredRun:
    from tdacoustic.measured.runs import MeasuredRun
    from tdacoustic.quality import Verdict
    from tdacoustic.steps import result_of

    if prepared is None:
        return MeasuredRun(run, None, None, (Verdict("", "run", "warning", f"rejected: {run.reject_reason}"),))
    error = prepared.error or failures.get(run.name)
    if error is not None or prepared.bound is None:
        return MeasuredRun(run, None, None, (Verdict("", "run", "bad", f"cannot be used: {_words(run, error)}"),))
    measurement = result_of(tasks[run.name], store)
    verdicts = [Verdict("", "log", "warning", flag) for flag in prepared.flags]
    measured = MeasuredRun(run, prepared.bound.recording, measurement, tuple(verdicts))
    if not measured.usable_channels:
        unusable = Verdict("", "run", "bad", "cannot be used: no signal channel is in order")
        measured = replace(measured, verdicts=(*verdicts, unusable))
    return measured


def _words(run: CampaignRun, error: TdacousticError | None) -> str:
    """Return an error with the run's logs as the campaign writes them: a copied campaign gives the same result."""
    text = str(error)
    for log in run.logs:
        text = text.replace(str(log.path), log.text)
    return text


def _problems(prepared: Sequence[_Prepared], failures: Mapping[str, TdacousticError]) -> list[str]:
    found = []
    for item in prepared:
        error = item.error or failures.get(item.run.name)
        if error is not None:
            found.append(f"run {item.run.name!r} is left out: {_words(item.run, error)}")
        elif item.bound is not None:
            found += [refusal.reason for refusal in item.bound.refused]
    return found


def _missing_receivers(campaign: Campaign, runs: Sequence[MeasuredRun]) -> list[str]:
    from tdacoustic.measured.runs import receivers

    if campaign.runs and not receivers(runs):
        return ["no microphone among the channels: no noise level, no noise lines, no dominance"]
    return []


def _not_built(campaign: Campaign) -> list[str]:
    """What the campaign asks for and this version does not do."""
    found = []
    if campaign.fleet is not None:
        found.append(f"the fleet file {campaign.fleet.text} is not used by this version: no source is named")
    if campaign.analysis.orders:
        orders = ", ".join(f"{order:g}" for order in campaign.analysis.orders)
        found.append(f"orders {orders} are not cut by this version")
    calibrators = [run.name for run in campaign.runs if run.kind.startswith("calibration") and run.valid]
    if calibrators:
        found.append(f"calibrator runs {', '.join(calibrators)} are checked, but set no sensitivity in this version")
    return found


def _inputs(prepared: Sequence[_Prepared]) -> tuple[LogInput, ...]:
    from tdacoustic.results import LogInput

    found: dict[str, LogInput] = {}
    for item in prepared:
        if item.bound is not None:
            for written, log, file in zip(item.run.logs, item.bound.recording.logs, item.logs, strict=True):
                found[written.text] = LogInput(written.text, file.sha256, file.n_bytes, log.format)
    return tuple(found.values())


# ---------------------------------------------------------------- campaign


def _assemble(
    campaign: Campaign,
    runs: tuple[MeasuredRun, ...],
    problems: tuple[str, ...],
    inputs: tuple[LogInput, ...],
    records: tuple[tuple[str, Record], ...],
) -> Analysis:
    """Gather what stands above the single run: background, conditions, sources, dominance, tables."""
    from tdacoustic.attribution import attribute, dominance_of_condition, lines_of_condition
    from tdacoustic.measured.levels import condition_levels
    from tdacoustic.measured.runs import receivers
    from tdacoustic.results import Analysis
    from tdacoustic.tables import measured_tables

    levels = condition_levels(runs)
    microphones = receivers(runs)
    why_not = NO_FLEET if campaign.fleet is None else FLEET_UNUSED
    sources: list[SourceLine] = []
    dominance: list[Dominance] = []
    for condition in campaign.conditions():
        held = [run for run in runs if run.run.condition == condition and run.run.kind == "test"]
        lines = [line for name in microphones for line in lines_of_condition(condition, name, held)]
        found = attribute(lines, campaign.excludes, campaign.overrides, why_not)
        sources += found
        dominance.append(dominance_of_condition(condition, found, _receiver_energy(held, microphones)))
    tables = measured_tables(campaign, runs, levels, sources, dominance)
    return Analysis(campaign, runs, tuple(sources), tuple(dominance), tables, problems, inputs, records)


def _receiver_energy(runs: Sequence[MeasuredRun], microphones: Sequence[str]) -> dict[str, float]:
    """Mean square in the level band by receiver, energy mean over the steady runs."""
    found: dict[str, list[float]] = {}
    for run in runs:
        for result in run.measurement.channels if run.measurement is not None else ():
            steady = result.spectrum is not None and result.band_rms is not None and result.usable
            if result.channel in microphones and steady:
                found.setdefault(result.channel, []).append(float(result.band_rms or 0.0) ** 2)
    return {name: sum(values) / len(values) for name, values in found.items()}

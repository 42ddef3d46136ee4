"""The measured side of a campaign: logs to levels, spectra, lines and sources."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from tdacoustic.campaign import Campaign, load_campaign
from tdacoustic.errors import MissingFileError, TdacousticError
from tdacoustic.steps import Jobs, Progress, Store, default_store_path

if TYPE_CHECKING:
    from tdacoustic.attribution import ConditionEvidence, Dominance, RunEvidence, RunKinematics, SourceLine
    from tdacoustic.fleet import Fleet
    from tdacoustic.measured.runs import MeasuredRun
    from tdacoustic.results import Analysis, LogInput
    from tdacoustic.steps import Record
    from tdacoustic.workflows.groundwork import Groundwork
    from tdacoustic.workflows.runs import PreparedRun
    from tdacoustic.workflows.second_pass import FirstPass, SecondPass

__all__ = ["analyze"]

PARALLEL_BYTES = 100 * 2**20
"""Logs of less in all are analysed in this process: starting others would take longer."""


def analyze(
    campaign: str | Path | Campaign,
    store: str | Path | Store | None = None,
    jobs: Jobs | None = None,
    progress: Progress | None = None,
    *,
    without_runs: bool = False,
    deeper: bool = True,
    fetch_urls: bool = False,
) -> Analysis:
    """Analyse the logs of a campaign.

    Parameters
    ----------
    campaign : path or Campaign
    store : path or Store, optional
        Where results are kept; default `tdacoustic.steps.default_store_path`.
    jobs : int or Executor, optional
        Processes; default: one a core where the logs are large enough to pay.
    progress : callable, optional
    without_runs : bool
        Go on where no run can be used: for who has more to do than to analyse.
    deeper : bool
        Whether the second pass is made too: orders, tones, contributions.
    fetch_urls : bool
        Whether logs that the campaign names by URL may be fetched; they are kept in the store.

    Returns
    -------
    Analysis
        A run that cannot be read does not stop the others; it is named in
        `Analysis.problems` and in the quality table.

    Raises
    ------
    TdacousticError
        The campaign or its fleet is wrong, it names a URL that may not be fetched, or (unless `without_runs`) no run
        can be used.
    """
    from tdacoustic.reporting.template import load_template
    from tdacoustic.steps import execute, lineage, result_of
    from tdacoustic.workflows.fetched_logs import with_fetched_logs
    from tdacoustic.workflows.groundwork import lay_groundwork
    from tdacoustic.workflows.listening import with_sound
    from tdacoustic.workflows.order_tracking import order_problems
    from tdacoustic.workflows.run_speeds import check_speeds, speed_problems
    from tdacoustic.workflows.runs import gather_run, log_inputs, prepare_runs, run_problems, written_inputs
    from tdacoustic.workflows.second_pass import FirstPass, SecondPass, second_pass

    campaign = campaign if isinstance(campaign, Campaign) else load_campaign(campaign)
    store = store if isinstance(store, Store) else Store(store or default_store_path())
    campaign, not_fetched = with_fetched_logs(campaign, store, fetch_urls, progress)
    if campaign.template is not None:  # what is wrong with it is said before the work, not after
        load_template(campaign.template.path)
    fleet, problems = _fleet(campaign)
    ground = lay_groundwork(campaign, store, 1 if jobs is None else jobs, progress).with_failed(not_fetched)
    prepared = prepare_runs(campaign, store, without_runs, ground)
    tasks = {item.run.name: item.task for item in prepared if item.task is not None}
    n_jobs = _jobs(prepared) if jobs is None else jobs
    outcome = execute(list(tasks.values()), store, n_jobs, progress)
    failures = {name: outcome.failed[task.key] for name, task in tasks.items() if task.key in outcome.failed}
    if not without_runs:
        _raise_if_all_failed(failures, len(tasks))
    by_name = {item.run.name: item for item in prepared}
    runs = check_speeds([gather_run(run, by_name.get(run.name), failures, store) for run in campaign.runs], fleet)
    evidence: dict[str, RunEvidence] = {}
    records: dict[str, Record] = dict(ground.records)
    for name, task in tasks.items():
        if name not in failures:
            if by_name[name].evidence is not None:
                evidence[name] = result_of(task, store)
            records.update(lineage(task, store))
    first = FirstPass(campaign, fleet, by_name, runs, _kinematics(fleet, runs))
    second = second_pass(first, store, n_jobs, progress) if deeper else SecondPass()
    records.update(second.records)
    problems += [*run_problems(prepared, failures), *speed_problems(campaign, prepared, runs)]
    problems += [*_missing_receivers(campaign, runs), *ground.sensors.problems]
    problems += order_problems(first) if deeper else ()
    inputs = (*written_inputs(campaign, fleet is not None), *log_inputs(prepared))
    analysis = _assemble(
        first, second, evidence, ground, ([*problems, *second.problems], inputs, tuple(records.items()))
    )
    if not (second.made and campaign.analysis.sound_excerpts):
        return analysis
    return with_sound(analysis, first, second, store, n_jobs, progress)


def _fleet(campaign: Campaign) -> tuple[Fleet | None, list[str]]:
    """Load the campaign's fleet; one that is named but absent is a problem, one that is wrong an error."""
    if campaign.fleet is None:
        return None, []
    from tdacoustic.fleet import load_fleet

    try:
        return load_fleet(campaign.fleet.path), []
    except MissingFileError:
        return None, [f"fleet file {campaign.fleet.text}: no such file; no line is ascribed to a source"]


def _jobs(prepared: Sequence[PreparedRun]) -> int:
    n_bytes = sum(file.n_bytes for item in prepared for log in item.logs for file in log.files)
    return 1 if n_bytes < PARALLEL_BYTES else (os.cpu_count() or 1)


def _raise_if_all_failed(failures: Mapping[str, TdacousticError], n_tasks: int) -> None:
    if failures and len(failures) == n_tasks:
        first = next(iter(failures.values()))
        raise type(first)("\n".join(dict.fromkeys(str(error) for error in failures.values()))) from first


def _missing_receivers(campaign: Campaign, runs: Sequence[MeasuredRun]) -> list[str]:
    from tdacoustic.measured.runs import receivers

    if campaign.runs and not any(run.valid for run in campaign.runs):
        return ["all runs are rejected: nothing is analysed"]
    if any(run.recording is not None for run in runs) and not receivers(runs):
        return ["no microphone among the channels: no noise level, no noise lines, no dominance"]
    return []


# ---------------------------------------------------------------- campaign

Origins: TypeAlias = "tuple[list[str], tuple[LogInput, ...], tuple[tuple[str, Record], ...]]"
"""Problems, inputs and records."""


def _assemble(
    first: FirstPass,
    second: SecondPass,
    evidence: Mapping[str, RunEvidence],
    ground: Groundwork,
    origins: Origins,
) -> Analysis:
    """Gather what stands above the single run: background, conditions, sources, dominance, tables."""
    from tdacoustic.attribution import ConditionEvidence, attribute, dominance_of_condition
    from tdacoustic.attribution.kinds_of_evidence import agreement_of_condition
    from tdacoustic.measured.levels import condition_levels
    from tdacoustic.measured.runs import receivers
    from tdacoustic.results import Analysis
    from tdacoustic.tables import measured_tables
    from tdacoustic.tables.clocks import clock_table
    from tdacoustic.tables.contributions import contribution_tables
    from tdacoustic.tables.orders import order_tables
    from tdacoustic.tables.railway import railway_table
    from tdacoustic.tables.sensors import sensor_table
    from tdacoustic.tables.tones import tone_tables
    from tdacoustic.workflows.contributions import campaign_contributions, missing_components
    from tdacoustic.workflows.modes import campaign_modes
    from tdacoustic.workflows.railway_measures import railway_measures
    from tdacoustic.workflows.run_speeds import slips_of, speed_frames
    from tdacoustic.workflows.tonality import tonality

    campaign, fleet, runs, kinematics = first.campaign, first.fleet, first.runs, first.kinematics
    microphones = receivers(runs)
    levels = condition_levels(runs, {name: item.train_speed_km_h for name, item in kinematics.items()})
    components = _components(runs)
    sources: list[SourceLine] = []
    dominance: list[Dominance] = []
    asked: list[ConditionEvidence] = []
    for condition in campaign.conditions():
        held = [run for run in runs if run.run.condition == condition and run.run.kind == "test"]
        steady = {run.name: evidence[run.name] for run in held if run.name in evidence and _is_steady(run)}
        known = ConditionEvidence(condition, microphones, steady, kinematics, components, fleet is not None)
        found, draws = attribute(known, campaign.excludes, campaign.overrides, _seed(first, known))
        sources += found
        asked.append(known)
        energy = _receiver_energy(held, microphones)
        spread_db = levels.spread_db(condition, microphones)
        dominance.append(dominance_of_condition(condition, found, draws, energy, len(steady), spread_db))
    problems, inputs, records = origins
    problems = [*problems, *_unused_overrides(campaign, sources)]
    slips = slips_of(runs, fleet)
    heard = tonality(first, second, sources) if second.made else None
    railway, not_rated = railway_measures(first, second) if second.made else (None, [])
    problems += not_rated
    orders = second.of_kind("orders")
    contributions, modes = campaign_contributions(first, second), campaign_modes(first, second)
    problems += missing_components(first, second) if second.made else []
    agreements = {
        known.condition: agreement_of_condition(known, campaign.excludes, _seed(first, known), contributions)
        for known in (asked if second.made else ())
    }
    tables = {
        **measured_tables(campaign, runs, levels, sources, dominance, kinematics, agreements),
        **speed_frames(runs, fleet, slips),
        **tone_tables(heard),
        **railway_table(railway),
        **sensor_table(ground.sensors),
        **clock_table(ground.clocks),
        **order_tables(runs, orders),
        **contribution_tables(contributions, modes),
    }
    return Analysis(
        campaign=campaign,
        runs=runs,
        sources=tuple(sources),
        dominance=tuple(dominance),
        tables=tables,
        problems=tuple(problems),
        inputs=inputs,
        records=records,
        fleet=fleet,
        kinematics=kinematics,
        slips=slips,
        tonality=heard,
        railway=railway,
        orders=orders,
        contributions=contributions,
        modes=modes,
        agreements=agreements,
        sensors=ground.sensors,
        clocks=ground.clocks,
    )


def _unused_overrides(campaign: Campaign, sources: Sequence[SourceLine]) -> list[str]:
    from tdacoustic.attribution import means_line

    return [
        f"override of {override.frequency_hz:g} Hz in condition {override.condition}: there is no such noise line"
        for override in campaign.overrides
        if not any(means_line(override, source.line) for source in sources)
    ]


def _is_steady(run: MeasuredRun) -> bool:
    return run.measurement is not None and run.measurement.steady


def _seed(first: FirstPass, known: ConditionEvidence) -> int:
    """Seed of the resampling, from the keys of the steps: where numbers differ in the last bit the seed does not."""
    import hashlib

    tasks = [first.prepared[name].task for name in known.evidence]
    keys = "\n".join([known.condition, *sorted(task.key for task in tasks if task is not None)])
    return int(hashlib.sha256(keys.encode()).hexdigest()[:15], 16)


def _kinematics(fleet: Fleet | None, runs: Sequence[MeasuredRun]) -> dict[str, RunKinematics]:
    if fleet is None:
        return {}
    from tdacoustic.attribution import run_kinematics
    from tdacoustic.fleet import Kinematics

    found = {run.name: run_kinematics(run, Kinematics.of(fleet, run.run.wheel_diameter_mm)) for run in runs}
    return {name: item for name, item in found.items() if item is not None}


def _components(runs: Sequence[MeasuredRun]) -> tuple[str, ...]:
    """Components with an accelerometer, in the campaign's order."""
    channels = [channel for run in runs if run.recording is not None for channel in run.recording.channels]
    return tuple(dict.fromkeys(c.component for c in channels if c.quantity == "acceleration" and c.component))


def _receiver_energy(runs: Sequence[MeasuredRun], microphones: Sequence[str]) -> dict[str, float]:
    """Mean square in the level band by receiver, energy mean over the steady runs."""
    found: dict[str, list[float]] = {}
    for run in runs:
        for result in run.measurement.channels if run.measurement is not None else ():
            steady = result.spectrum is not None and result.band_rms is not None and result.usable
            if result.channel in microphones and steady:
                found.setdefault(result.channel, []).append(float(result.band_rms or 0.0) ** 2)
    return {name: sum(values) / len(values) for name, values in found.items()}

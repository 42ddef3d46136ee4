"""The modelled side of a fleet: conditions, helix angles and a sweep of speed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from tdacoustic.errors import FleetError, TdacousticError
from tdacoustic.fleet import Fleet, load_fleet
from tdacoustic.steps import Jobs, Progress, Store, default_store_path, log_file

if TYPE_CHECKING:
    from tdacoustic.drive import Condition, DriveModel, Receiver, SpeedSweep
    from tdacoustic.drive.what_if import WhatIfAnswer
    from tdacoustic.results import FleetPrediction
    from tdacoustic.steps import Record

__all__ = ["predict"]


def predict(
    fleet: str | Path | Fleet,
    store: str | Path | Store | None = None,
    progress: Progress | None = None,
    conditions: Iterable[Condition] | None = None,
    receivers: Sequence[Receiver] = (),
    jobs: Jobs | None = None,
    what_if: WhatIfAnswer | None = None,
) -> FleetPrediction:
    """Compute the model of a fleet over its ``[operation]``, or over other conditions.

    Parameters
    ----------
    fleet : path or Fleet
        The file, or the folder it is in.
    store : path or Store, optional
        Where sweep and transfer vectors are kept; default `tdacoustic.steps.default_store_path`.
    progress : callable, optional
    conditions : iterable of Condition, optional
        Instead of those of ``[operation]``. The sweep of speed needs the fleet's torque law also then; where that is
        missing the sweep is left out, and a doubt says so.
    receivers : sequence of Receiver
        Where levels are wanted besides the 4 m surface.
    jobs : int or Executor, optional
        Processes for transfer vectors that are not there yet; default one a core.
    what_if : WhatIfAnswer, optional
        What changes do to the levels of this fleet in these conditions at these receivers, where it is known already.

    Returns
    -------
    FleetPrediction

    Raises
    ------
    TdacousticError
        The fleet is wrong, lacks a parameter, or its gears cannot be; or there is no condition.
    """
    from threadpoolctl import threadpool_limits

    from tdacoustic.drive import DriveModel, conditions_of
    from tdacoustic.drive.what_if import check_cases
    from tdacoustic.fleet.study_problems import check_studies
    from tdacoustic.results import FleetPrediction, LogInput
    from tdacoustic.tables import predicted_tables, what_if_table
    from tdacoustic.tables.studies import pattern_tables, study_tables
    from tdacoustic.workflows.housing_sound import housing_sound
    from tdacoustic.workflows.near_field import check_maps, near_fields
    from tdacoustic.workflows.studies import studies_of
    from tdacoustic.workflows.what_if import predicted_what_if

    fleet = fleet if isinstance(fleet, Fleet) else load_fleet(fleet)
    store = store if isinstance(store, Store) else Store(store or default_store_path())
    held = conditions_of(fleet) if conditions is None else tuple(conditions)
    if not held:
        raise FleetError(f"{fleet.path}: there is no condition to compute: no speed is known")
    check_maps(fleet, held)
    check_cases(fleet, [condition.name for condition in held])
    check_studies(fleet, [condition.name for condition in held])
    housing, transfer_records = housing_sound(fleet, store, jobs, progress, receivers)
    model = DriveModel(fleet, housing=housing)
    with threadpool_limits(limits=1):  # so that the numbers are the same on any number of cores
        prediction = model.with_insertion_loss(model.with_coupling(model.evaluate(held, receivers)))
    sweep, records, doubts = _sweep(model, max(condition.train_speed_km_h for condition in held), store, progress)
    maps, map_records, unmapped = near_fields(fleet, housing, prediction.sound, store, progress)
    prediction = replace(prediction, sweep=sweep, maps=maps, doubts=(*prediction.doubts, *doubts, *unmapped))
    answer = what_if
    case_records: tuple[tuple[str, Record], ...] = ()
    if answer is None:
        asked = model, held, prediction.sound, receivers, store, housing, jobs, progress
        answer, case_records = predicted_what_if(*asked)
    prediction = replace(prediction, doubts=(*prediction.doubts, *answer.doubts))
    tables = predicted_tables(prediction, fleet.radiation.max_frequency_hz.value)
    tables["what_if"] = what_if_table(answer)
    studies, study_records = studies_of(fleet, housing, held, store, progress, jobs)
    tables |= {**pattern_tables(prediction), **study_tables(studies, fleet)}
    file = log_file(fleet.path)
    inputs = (LogInput(fleet.path.name, file.sha256, file.n_bytes, "TOML"),)
    steps = dict((*transfer_records, *map_records, *records, *case_records, *study_records.items()))
    return FleetPrediction(fleet, prediction, tables, inputs, tuple(steps.items()), answer, studies)


def _sweep(
    model: DriveModel, fastest_km_h: float, store: Store, progress: Progress | None
) -> tuple[SpeedSweep | None, tuple[tuple[str, Record], ...], list[str]]:
    """Sweep, its records and its doubts."""
    from tdacoustic.drive import SpeedSweep
    from tdacoustic.drive.sweep_step import sweep_speeds_km_h, sweep_tasks
    from tdacoustic.steps import execute, lineage, result_of

    speeds = sweep_speeds_km_h(model.fleet, fastest_km_h)
    try:
        tasks = sweep_tasks(model, speeds)
    except FleetError as error:
        return None, (), [f"no sweep of speed: {_without_path(model.fleet, error)}"]
    outcome = execute(list(tasks), store, 1, progress)
    failure: TdacousticError | None = next(iter(outcome.failed.values()), None)
    if failure is not None:
        raise failure
    up, down = (result_of(task, store) for task in tasks)
    records = dict(pair for task in tasks for pair in lineage(task, store))
    sweep = SpeedSweep(speeds, up, down)
    return sweep, tuple(records.items()), _doubts_of_sweep(sweep)


def _without_path(fleet: Fleet, error: FleetError) -> str:
    """An error's words with no folder of this machine: the same fleet elsewhere gives the same result."""
    return str(error).removeprefix(f"{fleet.path}: ")


def _doubts_of_sweep(sweep: SpeedSweep) -> list[str]:
    from tdacoustic.gears import coexisting

    both = coexisting(sweep.up, sweep.down)
    if not both.any():
        return []
    speeds = [speed for speed, twice in zip(sweep.train_speed_km_h, both, strict=True) if twice]
    return [
        f"at {len(speeds)} of {both.size} swept speeds, between {speeds[0]:.4g} and {speeds[-1]:.4g} km/h, two motions "
        "are stable: which one the gears take depends on whether the speed rises or falls; the conditions show the one "
        "reached from teeth in contact"
    ]

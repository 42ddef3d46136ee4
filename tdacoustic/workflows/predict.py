"""The modelled side of a fleet: conditions, helix angles and a sweep of speed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from tdacoustic.errors import TdacousticError
from tdacoustic.fleet import Fleet, load_fleet
from tdacoustic.steps import Store, default_store_path, log_file
from tdacoustic.steps.execution import Progress

if TYPE_CHECKING:
    from tdacoustic.drive import DriveModel, SpeedSweep
    from tdacoustic.results import FleetPrediction
    from tdacoustic.steps import Record

__all__ = ["predict"]


def predict(
    fleet: str | Path | Fleet, store: str | Path | Store | None = None, progress: Progress | None = None
) -> FleetPrediction:
    """Compute the model of a fleet over its ``[operation]``.

    Parameters
    ----------
    fleet : path or Fleet
        The file, or the folder it is in.
    store : path or Store, optional
        Where the sweep is kept; default `tdacoustic.steps.default_store_path`.
    progress : callable, optional

    Returns
    -------
    FleetPrediction

    Raises
    ------
    TdacousticError
        The fleet is wrong, lacks a parameter, or its gears cannot be.
    """
    from tdacoustic.drive import DriveModel
    from tdacoustic.results import FleetPrediction, LogInput
    from tdacoustic.tables import predicted_tables

    fleet = fleet if isinstance(fleet, Fleet) else load_fleet(fleet)
    store = store if isinstance(store, Store) else Store(store or default_store_path())
    model = DriveModel(fleet)
    prediction = model.evaluate()
    sweep, records = _sweep(model, store, progress)
    doubts = (*prediction.doubts, *_doubts_of_sweep(sweep))
    prediction = replace(prediction, sweep=sweep, doubts=doubts)
    tables = predicted_tables(prediction, fleet.radiation.max_frequency_hz.value)
    file = log_file(fleet.path)
    inputs = (LogInput(fleet.path.name, file.sha256, file.n_bytes, "TOML"),)
    return FleetPrediction(fleet, prediction, tables, inputs, records)


def _sweep(
    model: DriveModel, store: Store, progress: Progress | None
) -> tuple[SpeedSweep, tuple[tuple[str, Record], ...]]:
    from tdacoustic.drive import SpeedSweep
    from tdacoustic.drive.sweep_step import sweep_speeds_km_h, sweep_tasks
    from tdacoustic.steps import execute, lineage, result_of

    fastest = max(condition.train_speed_km_h for condition in model.conditions)
    speeds = sweep_speeds_km_h(model.fleet, fastest)
    tasks = sweep_tasks(model, speeds)
    outcome = execute(list(tasks), store, 1, progress)
    failure: TdacousticError | None = next(iter(outcome.failed.values()), None)
    if failure is not None:
        raise failure
    up, down = (result_of(task, store) for task in tasks)
    records = dict(pair for task in tasks for pair in lineage(task, store))
    return SpeedSweep(speeds, up, down), tuple(records.items())


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

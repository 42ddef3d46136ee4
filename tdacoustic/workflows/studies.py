"""The studies that a fleet asks for: responses, another source's numbers and features, design sweeps."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

from tdacoustic.errors import ExecutorError, StoreError, TdacousticError
from tdacoustic.fleet import Fleet
from tdacoustic.steps import Jobs, Progress, Store

if TYPE_CHECKING:
    from tdacoustic.drive import Condition, HousingSound
    from tdacoustic.fleet.design_sweep import DesignSweep
    from tdacoustic.steps import Record, Task
    from tdacoustic.studies import Studies, SweepResult
    from tdacoustic.studies.designs import Assignments

__all__ = ["studies_of"]

Records = dict[str, "Record"]

_PAYS: Final = 6
"""Batches that are not in the store yet from which other processes pay [assumed]: one starts in some two seconds, which
is what a batch takes."""


def studies_of(
    fleet: Fleet,
    housing: HousingSound | None,
    conditions: Sequence[Condition],
    store: Store,
    progress: Progress | None = None,
    jobs: Jobs | None = None,
) -> tuple[Studies, dict[str, Record]]:
    """Return what the studies of a fleet found, and the records of their steps by key.

    Sensitivities take a second or two, with a scan for ``[[reference]]`` and ``[[feature]]`` some five, with two-way
    coupling six times that; a point of a ``[[sweep]]`` takes 5 to 20 ms (in a grid seconds where teeth rattle), and
    with a housing of its own as long as that housing's transfer vectors. Its batches are kept one by one, so that a
    study goes on where it was ended.

    Parameters
    ----------
    fleet : Fleet
    housing : HousingSound or None
    conditions : sequence of Condition
    store : Store
    progress : callable, optional
    jobs : int, optional
        Processes for the batches of a ``[[sweep]]``, and for the transfer vectors of points that need their own.
        Default: for vectors one a core, for batches too from as many on as outweigh the start of a process.

    Raises
    ------
    TdacousticError
        A step failed.
    """
    from tdacoustic.studies import Studies, check_feature, check_reference, sensitivity_of, sweep_sensitivity_of
    from tdacoustic.studies.responses import responses_task

    task = responses_task(fleet, housing, conditions, scan=bool(fleet.reference or fleet.feature))
    responses, records = _done(task, store, progress)
    sweeps: list[SweepResult] = []
    for sweep in fleet.sweep:
        found, more = _swept(sweep, fleet, housing, conditions, store, progress, jobs)
        sweeps.append(found)
        records |= more
    studies = Studies(
        responses,
        sensitivity_of(responses),
        tuple(check_reference(reference, responses) for reference in fleet.reference),
        tuple(check_feature(feature, responses) for feature in fleet.feature),
        tuple(sweeps),
        tuple(one for one in map(sweep_sensitivity_of, sweeps) if one is not None),
    )
    return studies, records


def _done(task: Task, store: Store, progress: Progress | None) -> tuple[Any, Records]:
    """Result and records of a task, in this process: its settings may hold transfer vectors."""
    (found,), records = _all_done([task], store, progress, 1)
    return found, records


def _all_done(
    tasks: Sequence[Task], store: Store, progress: Progress | None, jobs: Jobs | None
) -> tuple[list[Any], Records]:
    """Results and records of tasks; without a number of processes, in as many as pay."""
    from tdacoustic.steps import execute, lineage, result_of

    processes = jobs
    if processes is None:
        processes = (os.cpu_count() or 1) if sum(task.key not in store for task in tasks) >= _PAYS else 1
    outcome = execute(tasks, store, processes, progress)
    for failure in outcome.failed.values():
        raise failure
    records = dict(pair for task in tasks for pair in lineage(task, store))
    return [result_of(task, store) for task in tasks], records


def _swept(
    sweep: DesignSweep,
    fleet: Fleet,
    housing: HousingSound | None,
    conditions: Sequence[Condition],
    store: Store,
    progress: Progress | None,
    jobs: Jobs | None,
) -> tuple[SweepResult, Records]:
    """A design sweep: the housings of its points first, then its batches, points with the same housing together."""
    from tdacoustic.studies.design_sweeps import assembled, sweep_task
    from tdacoustic.studies.designs import points_of, whole_keys
    from tdacoustic.studies.kept_housing import kept_housing
    from tdacoustic.studies.responses import bare_fleet

    held = [one for one in conditions if not sweep.conditions or one.name in sweep.conditions]
    whole = whole_keys(sweep, fleet)
    points = points_of(sweep, whole)
    groups, refused, records = _by_housing(sweep, fleet, points, store, progress, jobs)
    integrate = sweep.sampling == "grid"
    tasks: list[tuple[tuple[int, ...], Task]] = []
    for name, batches in groups.items() if held else ():
        of, sound, at = fleet, housing, held
        if name:
            try:
                of, sound, at, more = _other(fleet, points[min(map(min, batches))], held, store, jobs, progress)
            except (StoreError, ExecutorError):
                raise
            except TdacousticError as error:
                refused |= {number: _reason(fleet, error) for batch in batches for number in batch}
                continue
            records |= more
        asked = bare_fleet(of), None if sound is None else kept_housing(sound, store), at
        for batch in batches:
            task = sweep_task(_label(sweep, batch), *asked, [points[number] for number in batch], integrate)
            tasks.append((batch, task))
    found, more = _all_done([task for _, task in tasks], store, progress, jobs)
    parts = [(batch, part) for (batch, _), part in zip(tasks, found, strict=True)]
    return assembled(sweep, [one.name for one in held], refused, parts, whole), records | more


def _by_housing(
    sweep: DesignSweep,
    fleet: Fleet,
    points: Sequence[Assignments],
    store: Store,
    progress: Progress | None,
    jobs: Jobs | None,
) -> tuple[dict[str, list[tuple[int, ...]]], dict[int, str], Records]:
    """Batches by the name of their points' housing, and the points that cannot have one."""
    from tdacoustic.studies.designs import batches_of
    from tdacoustic.studies.sweep_housings import OWN, housings_task, keys_of_housings

    batches = batches_of(sweep)
    keys = keys_of_housings(fleet, sweep.keys)
    if not keys:
        return {OWN: list(batches)}, {}, {}
    tasks = [housings_task(_label(sweep, batch), fleet, [points[n] for n in batch], keys) for batch in batches]
    found, records = _all_done(tasks, store, progress, jobs)
    groups: dict[str, list[tuple[int, ...]]] = {}
    refused: dict[int, str] = {}
    for batch, housings in zip(batches, found, strict=True):
        members: dict[str, list[int]] = {}
        for number, name, reason in zip(batch, housings.names, housings.reasons, strict=True):
            if reason:
                refused[number] = reason
            else:
                members.setdefault(name, []).append(number)
        for name, numbers in members.items():
            groups.setdefault(name, []).append(tuple(numbers))
    return groups, refused, records


def _label(sweep: DesignSweep, numbers: Sequence[int]) -> str:
    n = len(numbers)
    return f"{sweep.name}, {n} of {sweep.n_points} point{'s' if sweep.n_points > 1 else ''}"


def _other(
    fleet: Fleet,
    point: Assignments,
    conditions: Sequence[Condition],
    store: Store,
    jobs: Jobs | None,
    progress: Progress | None,
) -> tuple[Fleet, HousingSound | None, list[Condition], Records]:
    """The fleet of a point with another housing, that housing, and the conditions under it."""
    from tdacoustic.studies.changed_fleet import conditions_under
    from tdacoustic.studies.design_sweeps import fleet_at
    from tdacoustic.workflows.housing_sound import housing_sound

    changed = fleet_at(fleet, point)
    at = list(conditions_under(fleet, changed, conditions))
    found, records = housing_sound(changed, store, jobs, progress)
    return changed, found, at, dict(records)


def _reason(fleet: Fleet, error: TdacousticError) -> str:
    """An error in one line, with no folder of this machine."""
    return " ".join(str(error).removeprefix(f"{fleet.path}: ").split())

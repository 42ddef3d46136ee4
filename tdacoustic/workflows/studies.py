"""The studies that a fleet asks for: responses, another source's numbers and features, design sweeps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from tdacoustic.errors import TdacousticError
from tdacoustic.fleet import Fleet
from tdacoustic.steps import Store
from tdacoustic.steps.execution import Progress

if TYPE_CHECKING:
    from tdacoustic.drive import Condition, HousingSound
    from tdacoustic.fleet.studies import DesignSweep
    from tdacoustic.steps import Record, Task
    from tdacoustic.studies import Studies, SweepResult

__all__ = ["studies_of"]

Records = dict[str, "Record"]


def studies_of(
    fleet: Fleet,
    housing: HousingSound | None,
    conditions: Sequence[Condition],
    store: Store,
    progress: Progress | None = None,
    jobs: int | None = None,
) -> tuple[Studies, dict[str, Record]]:
    """Return what the studies of a fleet found, and the records of their steps by key.

    Sensitivities take a second or two, with a scan for ``[[reference]]`` and ``[[feature]]`` some five, with two-way
    coupling six times that; a point of a ``[[sweep]]`` takes 5 to 20 ms (seconds where teeth rattle), and with a
    housing of its own as long as that housing's transfer vectors.

    Parameters
    ----------
    fleet : Fleet
    housing : HousingSound or None
    conditions : sequence of Condition
    store : Store
    progress : callable, optional
    jobs : int, optional
        Processes for the transfer vectors of points that need their own.

    Raises
    ------
    TdacousticError
        A step failed.
    """
    from tdacoustic.studies import Studies, check_feature, check_reference, sensitivity_of
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
    )
    return studies, records


def _done(task: Task, store: Store, progress: Progress | None) -> tuple[Any, Records]:
    """Result and records of a task, in this process: its settings may hold transfer vectors."""
    from tdacoustic.steps import execute, lineage, result_of

    outcome = execute([task], store, 1, progress)
    for failure in outcome.failed.values():
        raise failure
    return result_of(task, store), dict(lineage(task, store))


def _swept(
    sweep: DesignSweep,
    fleet: Fleet,
    housing: HousingSound | None,
    conditions: Sequence[Condition],
    store: Store,
    progress: Progress | None,
    jobs: int | None,
) -> tuple[SweepResult, Records]:
    """A design sweep, points with the same housing in one step."""
    from tdacoustic.studies.changed_fleet import conditions_under
    from tdacoustic.studies.design_sweeps import assembled, fleet_at, groups_task, points_of, sweep_task

    held = [one for one in conditions if not sweep.conditions or one.name in sweep.conditions]
    points = points_of(sweep)
    groups, records = _done(groups_task(sweep.name, fleet, points), store, progress)
    refused = {number: reason for number, reason in enumerate(groups.reasons) if reason}
    parts = []
    for group, numbers in groups.members().items() if held else ():
        of, sound, at = fleet, housing, held
        if group:
            of = fleet_at(fleet, points[numbers[0]])
            at = list(conditions_under(fleet, of, held))
            try:
                sound, more = _housing_of(of, store, jobs, progress)
            except TdacousticError as error:
                refused |= dict.fromkeys(numbers, _reason(fleet, error))
                continue
            records |= more
        label = f"{sweep.name}, {len(numbers)} point{'s' if len(numbers) > 1 else ''}"
        part, more = _done(sweep_task(label, of, sound, at, [points[n] for n in numbers]), store, progress)
        parts.append((numbers, part))
        records |= more
    return assembled(sweep, [one.name for one in held], refused, parts), records


def _housing_of(
    fleet: Fleet, store: Store, jobs: int | None, progress: Progress | None
) -> tuple[HousingSound | None, Records]:
    from tdacoustic.workflows.housing_sound import housing_sound

    found, records = housing_sound(fleet, store, jobs, progress)
    return found, dict(records)


def _reason(fleet: Fleet, error: TdacousticError) -> str:
    """An error in one line, with no folder of this machine."""
    return " ".join(str(error).removeprefix(f"{fleet.path}: ").split())

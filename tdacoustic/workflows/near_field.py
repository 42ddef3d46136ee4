"""Maps of the sound around the housing, for the conditions that the fleet names."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from tdacoustic.errors import FleetError
from tdacoustic.steps import Store
from tdacoustic.steps.execution import Progress

if TYPE_CHECKING:
    from tdacoustic.drive import Condition, DriveSound, HousingSound, NearField
    from tdacoustic.fleet import Fleet
    from tdacoustic.steps import Record

__all__ = ["check_maps", "near_fields"]

NO_BOX = "[radiation] map_conditions: maps are made around the parametric box alone, none of a housing from a STEP file"
NO_HOUSING = '[radiation] map_conditions: maps need method = "boundary_elements", and none are drawn'


def check_maps(fleet: Fleet, conditions: Sequence[Condition]) -> None:
    """Raise for a name in ``[radiation] map_conditions`` that is no condition, before anything is computed.

    Parameters
    ----------
    fleet : Fleet
    conditions : sequence of Condition
        Those that are computed. A condition of ``[operation]`` that is not among them is no fault: it is not mapped.

    Raises
    ------
    FleetError
    """
    known = [*(condition.name for condition in conditions), *fleet.operation.names]
    for name in fleet.radiation.map_conditions:
        if name not in known:
            raise FleetError(
                f"{fleet.path}: [radiation] map_conditions names {name!r}, which is no condition; there are "
                f"{', '.join(dict.fromkeys(known))}"
            )


def near_fields(
    fleet: Fleet,
    housing: HousingSound | None,
    sounds: Sequence[DriveSound],
    store: Store,
    progress: Progress | None = None,
) -> tuple[tuple[NearField, ...], tuple[tuple[str, Record], ...], list[str]]:
    """Return the maps of ``[radiation] map_conditions`` in that order, the records of their steps, and doubts.

    Parameters
    ----------
    fleet : Fleet
    housing : HousingSound or None
        None of point sources, of which nothing is mapped.
    sounds : sequence of DriveSound
        Of the conditions that are computed.
    store : Store
    progress : callable, optional

    Raises
    ------
    TdacousticError
        What the computation refuses.
    """
    by_name = {sound.condition: sound for sound in sounds}
    wanted = [by_name[name] for name in fleet.radiation.map_conditions if name in by_name]
    if not wanted:
        return (), (), []
    if housing is None:
        return (), (), [NO_HOUSING]
    from tdacoustic.drive.housing_steps import housing_tasks
    from tdacoustic.drive.insertion_loss import air_tasks
    from tdacoustic.drive.near_field_step import near_field_of, near_field_task, planes_of
    from tdacoustic.steps import execute, lineage, result_of

    planes = planes_of(fleet, housing)
    if not planes:
        return (), (), [NO_BOX]
    of_housing = housing_tasks(fleet)
    cavity = next(iter(air_tasks(fleet, of_housing)), None)
    tasks = [near_field_task(fleet, housing, sound, planes, of_housing.modes, cavity) for sound in wanted]
    outcome = execute(list(tasks), store, 1, progress)  # seconds each, on all cores: other processes would cost more
    for failure in outcome.failed.values():
        raise failure
    fields = tuple(
        near_field_of(fleet, housing, sound, planes, result_of(task, store))
        for sound, task in zip(wanted, tasks, strict=True)
    )
    records = dict(pair for task in tasks for pair in lineage(task, store))
    return fields, tuple(records.items()), []

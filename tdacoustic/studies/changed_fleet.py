"""What a changed fleet makes of the conditions and of the housing of the fleet before."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Final

from tdacoustic.drive import Condition, GearUnit, HousingSound, conditions_of, gear_unit_of
from tdacoustic.drive.conditions import followed
from tdacoustic.drive.housing_box import box_of
from tdacoustic.fleet import Fleet
from tdacoustic.housing import Box
from tdacoustic.steps import Task

__all__ = ["conditions_under", "housing_signature", "housing_under", "reseated"]

_OF_VECTORS: Final = ("housing.", "radiation.", "train.", "motor.position_m", "masuda.p", "gear_pair.")
_NOT_OF_VECTORS: Final = (".loss_factor", ".face_width_mm", ".backlash_um", ".transmission_error_um")


def conditions_under(fleet: Fleet, changed: Fleet, conditions: Sequence[Condition]) -> tuple[Condition, ...]:
    """Return conditions as they become when the fleet changes.

    Those of ``[operation]`` are read again. Others, as of a campaign, follow the changed fleet where they followed the
    fleet before (`tdacoustic.drive.conditions.followed`); what was measured stays.

    Parameters
    ----------
    fleet, changed : Fleet
    conditions : sequence of Condition
        Under `fleet`.

    Raises
    ------
    FleetError
        The changed torque law lacks what it needs.
    """
    own = _by_name(fleet)
    of_changed = _by_name(changed) if own else {}
    return tuple(
        of_changed[held.name]
        if own.get(held.name) == held and held.name in of_changed
        else followed(held, fleet, changed)
        for held in conditions
    )


def _by_name(fleet: Fleet) -> dict[str, Condition]:
    """Conditions of ``[operation]``; none where it names no speeds."""
    stated = fleet.operation.train_speed_km_h is not None
    return {condition.name: condition for condition in conditions_of(fleet)} if stated else {}


def housing_signature(fleet: Fleet) -> tuple[str, ...]:
    """Return what tells two housings apart whose modes or transfer vectors differ; nothing of point sources.

    Of a box the keys of the tasks behind its field. Of a STEP file every parameter that these could depend on: its
    tasks would read the file.

    Parameters
    ----------
    fleet : Fleet

    Raises
    ------
    FleetError
        No such housing can be.
    """
    if fleet.radiation.method.value == "point_sources":
        return ()
    if fleet.housing is not None and fleet.housing.step_file is not None:
        stated = (one for one in fleet.parameters() if one.key.startswith(_OF_VECTORS))
        return tuple(f"{one.key} = {one.value!r}" for one in stated if not one.key.endswith(_NOT_OF_VECTORS))
    from tdacoustic.drive.housing_steps import housing_tasks
    from tdacoustic.drive.source_inside import cavity_task

    tasks = housing_tasks(fleet)
    held: list[object] = []
    for one in (getattr(tasks, name.name) for name in fields(tasks)):
        held += one if isinstance(one, tuple) else (one,)
    if fleet.masuda.placement.value == "inside":
        held.append(cavity_task(fleet, gear_unit_of(fleet), tasks.box, tasks.body, tasks.modes))
    return tuple(task.key for task in held if isinstance(task, Task))


def housing_under(before: Fleet, after: Fleet, housing: HousingSound | None) -> HousingSound | None:
    """Return the housing of a changed fleet that needs no modes, transfer vectors or air inside of its own; else None.

    Parameters
    ----------
    before, after : Fleet
    housing : HousingSound or None
        Of the first.
    """
    if housing is None or housing_signature(before) != housing_signature(after):
        return None
    return reseated(housing, before, after, gear_unit_of(after))


def reseated(housing: HousingSound, before: Fleet, after: Fleet, unit: GearUnit) -> HousingSound:
    """Return a housing with the loss factor and the gears' places between the bearings of a changed fleet."""
    if after.housing != before.housing and isinstance(housing.box, Box):
        return replace(housing, box=box_of(after, unit))
    return housing

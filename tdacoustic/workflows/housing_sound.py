"""The transfer vectors of a fleet's housing, computed once and kept."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

from tdacoustic.steps import Store
from tdacoustic.steps.execution import Progress

if TYPE_CHECKING:
    from tdacoustic.drive import HousingSound, Receiver
    from tdacoustic.fleet import Fleet
    from tdacoustic.steps import Record

__all__ = ["housing_sound"]


def housing_sound(
    fleet: Fleet,
    store: Store,
    jobs: int | None = None,
    progress: Progress | None = None,
    receivers: Sequence[Receiver] = (),
) -> tuple[HousingSound | None, tuple[tuple[str, Record], ...]]:
    """Return the transfer vectors of a fleet's housing and the records of their steps; None of point sources.

    Parameters
    ----------
    fleet : Fleet
    store : Store
    jobs : int, optional
        Processes side by side; default one a core.
    progress : callable, optional
    receivers : sequence of Receiver
        Where levels are wanted besides the surface and the circle.

    Raises
    ------
    TdacousticError
        The housing, or the place of a source or receiver, cannot be computed.
    """
    if fleet.radiation.method.value == "point_sources":
        return None, ()
    from tdacoustic.drive import HousingSound
    from tdacoustic.drive.housing_steps import housing_tasks
    from tdacoustic.steps import execute, lineage, result_of

    tasks = housing_tasks(fleet, receivers)
    wanted = [tasks.modes, tasks.mean, tasks.points]
    outcome = execute(wanted, store, os.cpu_count() or 1 if jobs is None else jobs, progress)
    for failure in outcome.failed.values():
        raise failure
    modes, mean, points = (result_of(task, store) for task in wanted)
    records = dict(pair for task in wanted for pair in lineage(task, store))
    return HousingSound(tasks.box, tasks.body, modes, mean, points), tuple(records.items())

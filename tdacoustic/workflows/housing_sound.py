"""The transfer vectors of a fleet's housing, computed once and kept."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from tdacoustic.errors import FleetError, RadiationError
from tdacoustic.steps import Jobs, Progress, Store

if TYPE_CHECKING:
    from tdacoustic.drive import HousingSound, Receiver
    from tdacoustic.drive.housing_steps import HousingTasks
    from tdacoustic.fleet import Fleet
    from tdacoustic.steps import Record

__all__ = ["housing_sound"]

_MOST_BYTES: Final = 12e9
"""Memory that boundary elements in several processes may take together [assumed]."""


def housing_sound(
    fleet: Fleet,
    store: Store,
    jobs: Jobs | None = None,
    progress: Progress | None = None,
    receivers: Sequence[Receiver] = (),
) -> tuple[HousingSound | None, tuple[tuple[str, Record], ...]]:
    """Return the transfer vectors of a fleet's housing and the records of their steps; None of point sources.

    Parameters
    ----------
    fleet : Fleet
    store : Store
    jobs : int or Executor, optional
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
    from tdacoustic.drive import HousingError, HousingSound
    from tdacoustic.drive.housing_steps import housing_tasks
    from tdacoustic.drive.insertion_loss import air_tasks
    from tdacoustic.steps import execute, lineage, result_of

    tasks = housing_tasks(fleet, receivers)
    air = air_tasks(fleet, tasks)
    wanted = [tasks.modes, tasks.mean, tasks.points, *air]
    outcome = execute(wanted, store, _jobs(tasks, fleet) if jobs is None else jobs, progress)
    for failure in outcome.failed.values():
        if isinstance(failure, RadiationError | HousingError):
            raise FleetError(f"{fleet.path}: [housing]: {failure}") from failure
        raise failure
    modes, mean, points, *inside = (result_of(task, store) for task in wanted)
    records = dict(pair for task in wanted for pair in lineage(task, store))
    return HousingSound(tasks.box, tasks.body, modes, mean, points, *inside), tuple(records.items())


def _jobs(tasks: HousingTasks, fleet: Fleet) -> int:
    """Processes, one a core, or fewer where their systems together would not fit into memory."""
    needed = tasks.body.needed_bytes(fleet.radiation.max_frequency_hz.value)
    return max(1, min(os.cpu_count() or 1, int(_MOST_BYTES // needed)))

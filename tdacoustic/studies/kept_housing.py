"""The housing that all batches of a study share, kept once: a batch's points are no megabytes, its vectors are.

It lies in the store under the hash of its content, as a log does for other steps. So a batch's task holds but that
hash, and is light to send to another process.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from tdacoustic.drive import HousingSound
from tdacoustic.errors import StoreError
from tdacoustic.steps import Record, Step, Store, Task
from tdacoustic.steps.codec import canonical_json, encode, fingerprint
from tdacoustic.steps.record import versions

__all__ = ["STUDY_HOUSING", "kept_housing"]


@dataclass(frozen=True)
class HousingHash:
    """Which housing it is.

    Parameters
    ----------
    sha256 : str
        Of a `HousingSound`.
    """

    sha256: str


def kept_housing(housing: HousingSound, store: Store) -> Task:
    """Put a housing into a store and return the task under whose key it lies there.

    Parameters
    ----------
    housing : HousingSound
    store : Store

    Raises
    ------
    StoreError
        The store cannot be written.
    """
    task = STUDY_HOUSING.task(f"{len(housing.modes.frequency_hz)} modes", HousingHash(fingerprint(housing)))
    if not _is_kept(task, store):
        step, settings = task.step, canonical_json(encode(task.settings, []))
        record = Record(step.name, step.version, step.title, task.label, settings, (), versions(), 0.0)
        store.save(task.key, housing, record)
    return task


def _is_kept(task: Task, store: Store) -> bool:
    if task.key not in store:
        return False
    try:
        store.load(task.key)
    except KeyError:  # damaged; it is gone now
        return False
    return True


def _lost(settings: HousingHash) -> HousingSound:
    """Called where the housing was removed from the store while a study ran: it cannot be made of its hash."""
    raise StoreError(f"the housing of a study ({settings.sha256[:16]}) is no longer in the store; start it again")


STUDY_HOUSING: Final = Step("study-housing", 1, _lost, "Housing whose points a study computes")

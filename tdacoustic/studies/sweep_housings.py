"""Step: which points of a design sweep share a housing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from tdacoustic.errors import TdacousticError
from tdacoustic.fleet import Fleet
from tdacoustic.steps import Step, Task
from tdacoustic.steps.codec import fingerprint
from tdacoustic.steps.progress import tell_progress
from tdacoustic.studies.changed_fleet import housing_signature
from tdacoustic.studies.design_sweeps import fleet_at, helix_key
from tdacoustic.studies.designs import Assignments
from tdacoustic.studies.responses import bare_fleet, fleet_of, reason_of

__all__ = ["OWN", "SWEEP_HOUSINGS", "SweepHousings", "housings_task", "keys_of_housings"]

OWN: Final = ""
"""Name of the fleet's own housing, or of none as the fleet has none."""

_NEVER: Final = (
    *("gear_dynamics.", "operation.", "masuda.constant_db", "masuda.displacement", "masuda.weighting"),
    *("model.structure_gain_db", "model.motor_gain_db", "model.gear_path", "housing.loss_factor"),
    "housing.cavity_loss_factor",
)
_NEVER_OF_A_PAIR: Final = ("face_width_mm", "backlash_um", "transmission_error_um")
"""Keys that no modes and no transfer vectors depend on."""


@dataclass(frozen=True)
class HousingsSettings:
    """What the housings of points depend on.

    Parameters
    ----------
    fleet : str
        See `bare_fleet`.
    points : tuple of Assignments
    keys : tuple of str
        Those of their parameters that housings depend on.
    own : tuple of str
        Signature of the fleet's housing; it changes with the versions of its steps.
    """

    fleet: str
    points: tuple[Assignments, ...]
    keys: tuple[str, ...]
    own: tuple[str, ...]


@dataclass(frozen=True)
class SweepHousings:
    """Which points share a housing.

    Parameters
    ----------
    names : tuple of str
        Of each point the hash of its housing's signature, or `OWN`.
    reasons : tuple of str
        Why a point cannot be; empty of one that can, as far as its housing goes.
    """

    names: tuple[str, ...]
    reasons: tuple[str, ...]


def keys_of_housings(fleet: Fleet, keys: Sequence[str]) -> tuple[str, ...]:
    """Return those of some keys that modes or transfer vectors may depend on.

    Parameters
    ----------
    fleet : Fleet
    keys : sequence of str
        Of a sweep.
    """
    if fleet.radiation.method.value == "point_sources" and "radiation.method" not in keys:
        return ()
    return tuple(key for key in keys if key != helix_key(fleet) and not _is_none_of_housings(key))


def _is_none_of_housings(key: str) -> bool:
    parts = key.split(".")
    return key.startswith(_NEVER) or (parts[0] == "gear_pair" and parts[2] in _NEVER_OF_A_PAIR)


def housings_task(label: str, fleet: Fleet, points: Sequence[Assignments], keys: Sequence[str]) -> Task:
    """Return the task of the housings of points.

    Parameters
    ----------
    label : str
    fleet : Fleet
    points : sequence of Assignments
    keys : sequence of str
        See `keys_of_housings`.
    """
    settings = HousingsSettings(bare_fleet(fleet), tuple(points), tuple(keys), housing_signature(fleet))
    return SWEEP_HOUSINGS.task(label, settings)


def _sweep_housings(settings: HousingsSettings) -> SweepHousings:
    """A housing is looked at once for all points that have the same values of its keys."""
    fleet = fleet_of(settings.fleet)
    known: dict[Assignments, str] = {}
    names, reasons = [], []
    for place, point in enumerate(settings.points):
        tell_progress(place / len(settings.points))
        part = tuple(pair for pair in point if pair[0] in settings.keys)
        name, reason = known.get(part, OWN), ""
        if part not in known:
            try:
                signature = housing_signature(fleet_at(fleet, point))
            except TdacousticError as error:
                reason = reason_of(error)
            else:
                name = known[part] = OWN if signature == settings.own else fingerprint(signature)
        names.append(name)
        reasons.append(reason)
    return SweepHousings(tuple(names), tuple(reasons))


SWEEP_HOUSINGS: Final = Step("design-sweep-groups", 2, _sweep_housings, "Housings of the points of a design sweep")

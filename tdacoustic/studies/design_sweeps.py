"""Design sweeps: a prediction for each point of a grid of parameters, as steps that are kept."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive import Condition, HousingSound, gear_unit_of
from tdacoustic.errors import TdacousticError
from tdacoustic.fleet import Fleet
from tdacoustic.fleet.studies import DesignSweep
from tdacoustic.steps import Step, Task
from tdacoustic.steps.progress import tell_progress
from tdacoustic.studies.cases import QUANTITIES, Case, CaseModel
from tdacoustic.studies.changed_fleet import housing_signature
from tdacoustic.studies.responses import ModelSettings, bare_fleet, fleet_of, reason_of

__all__ = [
    "DESIGN_SWEEP",
    "SWEEP_GROUPS",
    "Assignments",
    "SweepGroups",
    "SweepPart",
    "SweepResult",
    "assembled",
    "fleet_at",
    "groups_task",
    "points_of",
    "sweep_task",
]

Real = NDArray[np.float64]

Assignments = tuple[tuple[str, Any], ...]
"""Values by key, of one point."""

SWEPT: Final = "swept"
"""Origin of a value that a point has instead of the fleet's."""


@dataclass(frozen=True, eq=False)
class SweepSettings:
    """What the points of a sweep depend on.

    Parameters
    ----------
    model : ModelSettings
        Of a fleet whose transfer vectors are those of every point.
    points : tuple of Assignments
    """

    model: ModelSettings
    points: tuple[Assignments, ...]


@dataclass(frozen=True)
class GroupSettings:
    """What the grouping of points depends on.

    Parameters
    ----------
    fleet : str
        See `bare_fleet`.
    points : tuple of Assignments
    own : tuple of str
        Signature of the fleet's housing; it changes with the versions of its steps.
    """

    fleet: str
    points: tuple[Assignments, ...]
    own: tuple[str, ...]


@dataclass(frozen=True)
class SweepGroups:
    """Which points of a sweep share a housing.

    Parameters
    ----------
    group : tuple of int
        Of each point; 0 has the fleet's own housing, or none as the fleet has.
    reasons : tuple of str
        Why a point cannot be; empty of one that can.
    """

    group: tuple[int, ...]
    reasons: tuple[str, ...]

    def members(self) -> dict[int, list[int]]:
        """Return the numbers of the points of each group, those left out that cannot be."""
        found: dict[int, list[int]] = {}
        for number, (group, reason) in enumerate(zip(self.group, self.reasons, strict=True)):
            if not reason:
                found.setdefault(group, []).append(number)
        return found


@dataclass(frozen=True, eq=False)
class SweepPart:
    """Points of a sweep that share their transfer vectors.

    Parameters
    ----------
    cases : tuple of Case
        Of the conditions, with the speeds of the first point.
    speed_km_h : ndarray, shape (points, cases)
    values : ndarray, shape (points, cases, quantities)
        See `CaseValues`; NaN of points that cannot be.
    reasons : tuple of str
        Why a point cannot be; empty of one that can.
    """

    cases: tuple[Case, ...]
    speed_km_h: Real
    values: Real
    reasons: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class SweepResult:
    """A design sweep.

    Parameters
    ----------
    sweep : DesignSweep
    points : tuple of Assignments
        All combinations of its values, the last key fastest.
    conditions : tuple of str
    speed_km_h : ndarray, shape (points, conditions)
    values : ndarray, shape (points, conditions, quantities)
        By `QUANTITIES`; NaN of points that cannot be.
    reasons : tuple of str
        Why a point cannot be; empty of one that can.
    """

    sweep: DesignSweep
    points: tuple[Assignments, ...]
    conditions: tuple[str, ...]
    speed_km_h: Real
    values: Real
    reasons: tuple[str, ...]

    def of(self, quantity: str) -> Real:
        """Return one quantity, shape (points, conditions)."""
        return np.asarray(self.values[..., QUANTITIES.index(quantity)])


def points_of(sweep: DesignSweep) -> tuple[Assignments, ...]:
    """Return the points of a sweep's grid, the last key fastest.

    Examples
    --------
    >>> sweep = DesignSweep(name="two", parameters=(("a.b", (1.0, 2.0)), ("c.d", ("x", "y"))))
    >>> points_of(sweep)[1]
    (('a.b', 1.0), ('c.d', 'y'))
    """
    keys = [key for key, _ in sweep.parameters]
    grid = itertools.product(*(values for _, values in sweep.parameters))
    return tuple(tuple(zip(keys, values, strict=True)) for values in grid)


def fleet_at(fleet: Fleet, point: Assignments) -> Fleet:
    """Return the fleet of a point.

    The helix angle of the modelled pair is none of its values: as in the helix sweep, rack, teeth, shifts and width
    stay, the centre distance follows, and the housing with its seats stays.

    Raises
    ------
    FleetError
        A file could not have these values, or its gears cannot be.
    """
    own = {key: value for key, value in point if key != _helix_key(fleet)}
    changed = fleet.replaced(own, origin=SWEPT) if own else fleet
    gear_unit_of(changed, _helix_rad(fleet, point))
    return changed


def _helix_key(fleet: Fleet) -> str:
    return f"gear_pair.{fleet.modelled_pair_number}.helix_angle_deg"


def _helix_deg(fleet: Fleet, point: Assignments) -> float | None:
    found = dict(point).get(_helix_key(fleet))
    return None if found is None else float(found)


def _helix_rad(fleet: Fleet, point: Assignments) -> float | None:
    angle = _helix_deg(fleet, point)
    return None if angle is None else math.radians(angle)


def groups_task(label: str, fleet: Fleet, points: Sequence[Assignments]) -> Task:
    """Return the task of the grouping of points by their housing.

    Parameters
    ----------
    label : str
    fleet : Fleet
    points : sequence of Assignments
    """
    return SWEEP_GROUPS.task(label, GroupSettings(bare_fleet(fleet), tuple(points), housing_signature(fleet)))


def _sweep_groups(settings: GroupSettings) -> SweepGroups:
    fleet = fleet_of(settings.fleet)
    numbers = {settings.own: 0}
    groups, reasons = [], []
    for place, point in enumerate(settings.points):
        group, reason = 0, ""
        try:
            key = housing_signature(fleet_at(fleet, point))
            group = numbers.setdefault(key, len(numbers))
        except TdacousticError as error:
            reason = reason_of(error)
        groups.append(group)
        reasons.append(reason)
        tell_progress((place + 1) / len(settings.points))
    return SweepGroups(tuple(groups), tuple(reasons))


def sweep_task(
    label: str,
    fleet: Fleet,
    housing: HousingSound | None,
    conditions: Sequence[Condition],
    points: Sequence[Assignments],
) -> Task:
    """Return the task of points that share their transfer vectors with a fleet.

    Parameters
    ----------
    label : str
    fleet : Fleet
    housing : HousingSound or None
        Of that fleet.
    conditions : sequence of Condition
        Of that fleet.
    points : sequence of Assignments
    """
    settings = SweepSettings(ModelSettings(bare_fleet(fleet), housing, tuple(conditions)), tuple(points))
    return DESIGN_SWEEP.task(label, settings)


def _design_sweep(settings: SweepSettings) -> SweepPart:
    fleet = fleet_of(settings.model.fleet)
    model = CaseModel(fleet, settings.model.housing, settings.model.conditions, helix=False)
    cases = model.base.cases
    shape = (len(settings.points), len(cases))
    values = np.full((*shape, len(QUANTITIES)), math.nan)
    speeds = np.full(shape, math.nan)
    reasons = []
    for number, point in enumerate(settings.points):
        try:
            found = model.values(fleet_at(fleet, point), _helix_deg(fleet, point))
        except TdacousticError as error:
            reasons.append(reason_of(error))
            continue
        if [case.name for case in found.cases] != [case.name for case in cases]:
            reasons.append("has other conditions than the fleet")
            continue
        values[number], speeds[number] = found.values, [case.value for case in found.cases]
        reasons.append("")
        tell_progress((number + 1) / len(settings.points))
    return SweepPart(cases, speeds, values, tuple(reasons))


def assembled(
    sweep: DesignSweep,
    conditions: Sequence[str],
    refused: Mapping[int, str],
    parts: Sequence[tuple[Sequence[int], SweepPart]],
) -> SweepResult:
    """Return a sweep from its parts.

    Parameters
    ----------
    sweep : DesignSweep
    conditions : sequence of str
    refused : mapping of int to str
        Points that never came to be computed, and why.
    parts : sequence of (sequence of int, SweepPart)
        Numbers of the points of each part.
    """
    points = points_of(sweep)
    shape = (len(points), len(conditions))
    values, speeds = np.full((*shape, len(QUANTITIES)), math.nan), np.full(shape, math.nan)
    reasons = [refused.get(number, "") for number in range(len(points))]
    for numbers, part in parts:
        for place, number in enumerate(numbers):
            values[number], speeds[number] = part.values[place], part.speed_km_h[place]
            reasons[number] = part.reasons[place]
    return SweepResult(sweep, points, tuple(conditions), speeds, values, tuple(reasons))


SWEEP_GROUPS: Final = Step("design-sweep-groups", 1, _sweep_groups, "Housings of the points of a design sweep")
DESIGN_SWEEP: Final = Step("design-sweep", 1, _design_sweep, "Predictions for points of a design sweep")

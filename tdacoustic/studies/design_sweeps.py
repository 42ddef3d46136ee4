"""Design sweeps: a prediction for each point of a design, in batches that are steps of their own."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive import Condition, HousingSound, gear_unit_of
from tdacoustic.errors import TdacousticError
from tdacoustic.fleet import Fleet
from tdacoustic.fleet.design_sweep import DesignSweep
from tdacoustic.steps import Step, Task
from tdacoustic.steps.progress import tell_progress
from tdacoustic.studies.cases import QUANTITIES, Case, CaseModel
from tdacoustic.studies.designs import Assignments, points_of
from tdacoustic.studies.responses import fleet_of, reason_of

__all__ = ["DESIGN_SWEEP", "SweepPart", "SweepResult", "assembled", "fleet_at", "helix_key", "sweep_task"]

Real = NDArray[np.float64]

SWEPT: Final = "swept"
"""Origin of a value that a point has instead of the fleet's."""

OTHER_CONDITIONS: Final = "has other conditions than the fleet"


@dataclass(frozen=True)
class BatchSettings:
    """What a batch depends on besides the housing.

    Parameters
    ----------
    fleet : str
        See `bare_fleet`; one whose transfer vectors are those of every point.
    conditions : tuple of Condition
        Of that fleet.
    points : tuple of Assignments
    integrate : bool
        Whether motions that the harmonic balance does not find are integrated in time, which takes seconds each.
    """

    fleet: str
    conditions: tuple[Condition, ...]
    points: tuple[Assignments, ...]
    integrate: bool


@dataclass(frozen=True, eq=False)
class SweepPart:
    """Points of a sweep that share their transfer vectors.

    Parameters
    ----------
    cases : tuple of Case
        Of the conditions, with the speeds of the fleet that the batch is of.
    speed_km_h : ndarray, shape (points, cases)
    values : ndarray, shape (points, cases, quantities)
        See `CaseValues`; NaN of points that cannot be, and of gears that rattle where nothing is integrated.
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
        See `points_of`.
    conditions : tuple of str
    speed_km_h : ndarray, shape (points, conditions)
    values : ndarray, shape (points, conditions, quantities)
        By `QUANTITIES`; NaN of points that cannot be, and of those that rattle.
    reasons : tuple of str
        Why a point cannot be; empty of one that can.
    whole : tuple of str
        Keys with a range that take whole numbers alone.
    """

    sweep: DesignSweep
    points: tuple[Assignments, ...]
    conditions: tuple[str, ...]
    speed_km_h: Real
    values: Real
    reasons: tuple[str, ...]
    whole: tuple[str, ...] = ()

    def of(self, quantity: str) -> Real:
        """Return one quantity, shape (points, conditions)."""
        return np.asarray(self.values[..., QUANTITIES.index(quantity)])

    @property
    def can_be(self) -> NDArray[np.bool_]:
        """Which points can be, shape (points,)."""
        return np.array([not reason for reason in self.reasons], dtype=bool)

    @property
    def rattles(self) -> NDArray[np.bool_]:
        """Where the balance finds no stable motion and none was integrated, shape (points, conditions)."""
        return np.asarray(self.can_be[:, None] & np.isnan(self.of("mesh_frequency_hz")))


def fleet_at(fleet: Fleet, point: Assignments) -> Fleet:
    """Return the fleet of a point.

    The helix angle of the modelled pair is none of its values: as in the helix sweep, rack, teeth, shifts and width
    stay, the centre distance follows, and the housing with its seats stays.

    Raises
    ------
    FleetError
        A file could not have these values, or its gears cannot be.
    """
    changed = _changed(fleet, point)
    gear_unit_of(changed, _helix_rad(fleet, point))
    return changed


def _changed(fleet: Fleet, point: Assignments) -> Fleet:
    own = {key: value for key, value in point if key != helix_key(fleet)}
    return fleet.replaced(own, origin=SWEPT) if own else fleet


def helix_key(fleet: Fleet) -> str:
    """Return the key of the helix angle that a sweep moves without the housing."""
    return f"gear_pair.{fleet.modelled_pair_number}.helix_angle_deg"


def _helix_deg(fleet: Fleet, point: Assignments) -> float | None:
    found = dict(point).get(helix_key(fleet))
    return None if found is None else float(found)


def _helix_rad(fleet: Fleet, point: Assignments) -> float | None:
    angle = _helix_deg(fleet, point)
    return None if angle is None else math.radians(angle)


def sweep_task(
    label: str,
    fleet: str,
    housing: Task | None,
    conditions: Sequence[Condition],
    points: Sequence[Assignments],
    integrate: bool = True,
) -> Task:
    """Return the task of points that share their transfer vectors with a fleet.

    Parameters
    ----------
    label : str
    fleet : str
    housing : Task or None
        See `kept_housing`; none of point sources.
    conditions : sequence of Condition
    points : sequence of Assignments
    integrate : bool
        See `BatchSettings`.
    """
    settings = BatchSettings(fleet, tuple(conditions), tuple(points), integrate)
    return DESIGN_SWEEP.task(label, settings, **({} if housing is None else {"housing": housing}))


def _design_sweep(settings: BatchSettings, housing: HousingSound | None = None) -> SweepPart:
    fleet = fleet_of(settings.fleet)
    held = CaseModel(fleet, housing, settings.conditions, helix=False, integrate=False, keep=True)
    cases = held.base.cases
    shape = (len(settings.points), len(cases))
    values = np.full((*shape, len(QUANTITIES)), math.nan)
    speeds = np.full(shape, math.nan)
    reasons = []
    for number, point in enumerate(settings.points):
        tell_progress(number / len(settings.points))
        try:
            found = held.values(_changed(fleet, point), _helix_deg(fleet, point), settings.integrate)
        except TdacousticError as error:
            reasons.append(reason_of(error))
            continue
        if [case.name for case in found.cases] != [case.name for case in cases]:
            reasons.append(OTHER_CONDITIONS)
            continue
        values[number], speeds[number] = found.values, [case.value for case in found.cases]
        reasons.append("")
    return SweepPart(cases, speeds, values, tuple(reasons))


def assembled(
    sweep: DesignSweep,
    conditions: Sequence[str],
    refused: Mapping[int, str],
    parts: Sequence[tuple[Sequence[int], SweepPart]],
    whole: Sequence[str] = (),
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
    whole : sequence of str
        See `points_of`.
    """
    points = points_of(sweep, whole)
    shape = (len(points), len(conditions))
    values, speeds = np.full((*shape, len(QUANTITIES)), math.nan), np.full(shape, math.nan)
    reasons = [refused.get(number, "") for number in range(len(points))]
    for numbers, part in parts:
        values[list(numbers)], speeds[list(numbers)] = part.values, part.speed_km_h
        for number, reason in zip(numbers, part.reasons, strict=True):
            reasons[number] = reason
    return SweepResult(sweep, points, tuple(conditions), speeds, values, tuple(reasons), tuple(whole))


DESIGN_SWEEP: Final = Step("design-sweep", 2, _design_sweep, "Predictions for points of a design sweep")

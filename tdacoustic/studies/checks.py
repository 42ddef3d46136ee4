"""Another source's numbers and features beside the model's: whether they are there, and what that hangs on."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.fleet.studies import Feature, Reference
from tdacoustic.studies.cases import QUANTITIES, Case
from tdacoustic.studies.responses import SCAN_DB, SCAN_FACTORS, Responses
from tdacoustic.studies.sensitivity import change_for, per_words
from tdacoustic.studies.shapes import direction_margin, extreme_margin, shape_margin, span_margin
from tdacoustic.studies.variations import Variation

__all__ = ["FeatureCheck", "Findings", "Influence", "Move", "ReferenceCheck", "check_feature", "check_reference"]

Real = NDArray[np.float64]

MOST_SHOWN: Final = 3
"""Influences and moves that are kept of each check."""

LEAST_CHANGE: Final = 0.005
"""Influences below this are not told."""

_NEARER: Final = 0.95
"""Part of a margin that a move must leave at most to be told as one that comes near."""


@dataclass(frozen=True)
class Influence:
    """How a margin or a difference hangs on an assumed number.

    Parameters
    ----------
    key : str
    change : float
        In the unit of the margin, for 10 % more of the number or for 1 dB more.
    per : str
        ``"+10 %"`` or ``"+1 dB"``.
    """

    key: str
    change: float
    per: str


@dataclass(frozen=True)
class Move:
    """A single assumed number moved within the range of the scan.

    Parameters
    ----------
    key : str
    amount : float
        Factor, or dB of a level.
    kind : {"relative", "level"}
    value : float or None
        What the number becomes; None of a table, all of whose rows move.
    margin : float
        There; 0 of a move that just brings or loses something.
    """

    key: str
    amount: float
    kind: str
    value: float | None
    margin: float

    @property
    def size(self) -> float:
        """Part of the range of the scan, 0 to 1."""
        if self.kind == "level":
            return abs(self.amount) / SCAN_DB[-1]
        return abs(math.log(self.amount)) / math.log(SCAN_FACTORS[-1])


@dataclass(frozen=True)
class Findings:
    """What a check hangs on.

    Parameters
    ----------
    influences : tuple of Influence
        Of assumed numbers, the strongest first.
    moves : tuple of Move
        Single assumed numbers that turn the verdict, the smallest move first.
    closest : Move or None
        Where none does: the one that comes nearest.
    """

    influences: tuple[Influence, ...]
    moves: tuple[Move, ...]
    closest: Move | None


@dataclass(frozen=True)
class ReferenceCheck:
    """A number of another source beside the model's.

    Parameters
    ----------
    reference : Reference
    case : Case or None
        The one it is held against; None where the model has no such case.
    value : float
        The model's, in the unit of the quantity; NaN of none.
    difference : float
        Model less reference, in dB; in degrees of a direction.
    findings : Findings
        Moves take the difference to zero.
    """

    reference: Reference
    case: Case | None
    value: float
    difference: float
    findings: Findings

    @property
    def holds(self) -> bool | None:
        """Whether the model is within `Reference.tolerated`; None where it has no value."""
        return None if math.isnan(self.difference) else abs(self.difference) <= self.reference.tolerated


@dataclass(frozen=True)
class FeatureCheck:
    """A feature of another source beside the model's values.

    Parameters
    ----------
    feature : Feature
    cases : tuple of Case
        In order.
    values : ndarray, shape (cases,)
        Of its quantity, in its unit; the lowest correlation alone of patterns.
    margin : float
        Zero or above where it is there. In dB; in degrees of a direction, without unit of a correlation. NaN where it
        cannot be said.
    findings : Findings
        Moves take the margin to zero.
    """

    feature: Feature
    cases: tuple[Case, ...]
    values: tuple[float, ...]
    margin: float
    findings: Findings

    @property
    def holds(self) -> bool | None:
        """Whether the feature is there; None where it cannot be said."""
        return None if math.isnan(self.margin) else self.margin >= 0.0


def check_reference(reference: Reference, responses: Responses) -> ReferenceCheck:
    """Hold a number of another source against the model's.

    Where the source leaves open of which condition it is, the condition nearest to it with the fleet as it is counts.

    Parameters
    ----------
    reference : Reference
    responses : Responses
    """
    over = "conditions" if reference.condition is not None else "helix"
    names = reference.condition or (f"{reference.helix_angle_deg:g}",)
    column = QUANTITIES.index(reference.quantity)
    places = [n for n, case in enumerate(responses.cases) if case.over == over and case.name in names]

    def difference(values: Real, place: int) -> Real:
        held = values[..., place, column]
        if reference.quantity == "loudest_deg":
            return np.asarray((held - reference.value + 180.0) % 360.0 - 180.0)
        return _as_levels(reference.quantity, held) - float(_as_levels(reference.quantity, np.array(reference.value)))

    known = [place for place in places if np.isfinite(responses.base[place, column])]
    if not known:
        return ReferenceCheck(reference, None, math.nan, math.nan, Findings((), (), None))
    place = min(known, key=lambda one: abs(float(difference(responses.base, one))))
    value, off = float(responses.base[place, column]), float(difference(responses.base, place))
    findings = _findings(responses, lambda values, alike: difference(values, place))
    if reference.quantity == "loudest_deg":  # on directions 5° apart, with no zero that a turn passes
        findings = Findings((), (), None)
    elif abs(off) <= reference.tolerated:
        findings = Findings(findings.influences, (), None)
    return ReferenceCheck(reference, responses.cases[place], value, off, findings)


def check_feature(feature: Feature, responses: Responses) -> FeatureCheck:
    """Look for a feature in the model's values.

    Parameters
    ----------
    feature : Feature
    responses : Responses
    """
    order = [n for n, case in enumerate(responses.cases) if case.over == feature.over]
    order.sort(key=lambda n: responses.cases[n].value)
    cases = tuple(responses.cases[n] for n in order)

    def margin(values: Real, alike: Real) -> Real:
        return _margin(feature, cases, values[..., order, :], alike)

    if feature.quantity == "pattern":
        shown = (float(responses.base_alike[_side(feature.over)]),)
    else:
        shown = tuple(responses.base[order, QUANTITIES.index(feature.quantity)].tolist())
    found = float(margin(responses.base, responses.base_alike))
    least = math.inf if feature.shape == "toward" else LEAST_CHANGE  # directions are 5° apart: no derivative
    return FeatureCheck(feature, cases, shown, found, _findings(responses, margin, least))


def _side(over: str) -> int:
    return 0 if over == "conditions" else 1


def _margin(feature: Feature, cases: Sequence[Case], values: Real, alike: Real) -> Real:
    """Margin of a feature in rows of cases in order, shape (...) of values of shape (..., cases, quantities)."""
    tolerance = feature.tolerated
    if feature.shape == "alike":
        assert feature.value is not None
        return alike[..., _side(feature.over)] - feature.value + tolerance
    held = values[..., QUANTITIES.index(feature.quantity)]
    if feature.shape == "toward":
        assert feature.value is not None
        return direction_margin(held, feature.value, tolerance)
    held = _as_levels(feature.quantity, held)
    if feature.shape in ("highest_at", "lowest_at"):
        at = np.array([case.name in feature.at for case in cases], dtype=bool)
        return extreme_margin(held, at, feature.shape == "highest_at", tolerance)
    if feature.shape == "span":
        assert feature.value is not None
        return span_margin(held, feature.value, tolerance)
    if feature.shape == "above":
        if not cases:
            return np.full(held.shape[:-1], np.nan)
        others = [_as_levels(name, values[..., QUANTITIES.index(name)]) for name in feature.than]
        lead = held - np.max(np.stack(others), axis=0)
        return np.asarray(lead.min(axis=-1) + tolerance)
    return shape_margin(feature.shape, held, tolerance)


def _as_levels(quantity: str, values: Real) -> Real:
    """Values as levels: amplitudes and frequencies in 20 lg, levels as they are."""
    if quantity.endswith("_db"):
        return values
    with np.errstate(divide="ignore"):
        levels = 20.0 * np.log10(values)
    return np.asarray(np.where(np.isfinite(levels), levels, np.nan))


def _findings(responses: Responses, of: Callable[[Real, Real], Real], least: float = LEAST_CHANGE) -> Findings:
    """What a number made of the cases' values hangs on, and what takes it through zero; `least` of what is told."""
    here = float(of(responses.base, responses.base_alike))
    if math.isnan(here) or not responses.varied:
        return Findings((), (), None)
    moved = of(responses.values, responses.alike)
    influences, moves, ends = [], [], []
    for variation, row in zip(responses.varied, moved, strict=True):
        if not variation.is_assumed:
            continue
        influences.append(_influence(variation, row, here))
        amounts = SCAN_DB if variation.kind == "level" else SCAN_FACTORS
        scanned = row[2:]
        if len(scanned):
            moves += _crossings(variation, amounts, scanned)
            ends += [_move(variation, a, float(m)) for a, m in zip(amounts, scanned, strict=True) if np.isfinite(m)]
    strongest = sorted((one for one in influences if abs(one.change) >= least), key=lambda one: -abs(one.change))
    nearest: dict[str, Move] = {}
    for move in sorted(moves, key=lambda one: one.size):
        nearest.setdefault(move.key, move)
    closest = None
    if not nearest and ends:
        best = min(ends, key=lambda one: abs(one.margin))
        closest = best if abs(best.margin) < _NEARER * abs(here) else None
    return Findings(tuple(strongest[:MOST_SHOWN]), tuple(nearest.values())[:MOST_SHOWN], closest)


def _influence(variation: Variation, row: Real, here: float) -> Influence:
    """Change for 10 % or 1 dB more, from the steps below and above; from one where there is no other."""
    change = float(change_for(variation.kind, row[0], np.array(here), row[1]))
    return Influence(variation.key, 0.0 if math.isnan(change) else change, per_words(variation.kind))


def _crossings(variation: Variation, amounts: Sequence[float], row: Real) -> list[Move]:
    """Where a scanned number passes zero, between two values of the scan."""
    scale = list(amounts) if variation.kind == "level" else [math.log(amount) for amount in amounts]
    found = []
    for place in range(len(amounts) - 1):
        low, high = float(row[place]), float(row[place + 1])
        if not (math.isfinite(low) and math.isfinite(high)) or (low >= 0.0) == (high >= 0.0):
            continue
        at = scale[place] + (scale[place + 1] - scale[place]) * low / (low - high)
        found.append(_move(variation, at if variation.kind == "level" else math.exp(at), 0.0))
    return found


def _move(variation: Variation, amount: float, margin: float) -> Move:
    return Move(variation.key, amount, variation.kind, variation.moved_value(amount), margin)

"""Step: how the numbers of every case respond when single numbers of the fleet move."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive import Condition, HousingSound
from tdacoustic.errors import TdacousticError
from tdacoustic.fleet import Fleet, fleet_toml
from tdacoustic.fleet.sections import STUDIES
from tdacoustic.steps import Step, Task
from tdacoustic.steps.progress import tell_progress
from tdacoustic.studies.cases import QUANTITIES, Case, CaseModel, CaseValues
from tdacoustic.studies.variations import LeftOut, Variation, variations_of
from tdacoustic.toml_models import frozen

__all__ = [
    "RESPONSES",
    "SCAN_DB",
    "SCAN_FACTORS",
    "SILENT",
    "STEP_DB",
    "STEP_RELATIVE",
    "VECTORS",
    "ModelSettings",
    "Responses",
    "amounts_of",
    "bare_fleet",
    "fleet_of",
    "reason_of",
    "responses_task",
]

Real = NDArray[np.float64]

STEP_RELATIVE: Final = 0.01
STEP_DB: Final = 0.1
"""Steps of the central differences to both sides [assumed]."""

SCAN_FACTORS: Final = tuple(3.0 ** (number / 6.0) for number in range(-6, 7))
SCAN_DB: Final = tuple(2.0 * number for number in range(-6, 7))
"""Amounts by which assumed numbers are moved one at a time: a third to three times the value, 12 dB to both sides
[assumed]."""

SILENT: Final = "moves none of these numbers"
VECTORS: Final = "needs modes or transfer vectors of its own, minutes a value; a [[sweep]] of it computes them"


@dataclass(frozen=True, eq=False)
class ModelSettings:
    """What studies of a model depend on.

    Parameters
    ----------
    fleet : str
        As a file, without name and studies: see `bare_fleet`.
    housing : HousingSound or None
    conditions : tuple of Condition
    scan : bool
        Whether assumed numbers are moved over their whole range, besides the steps.
    """

    fleet: str
    housing: HousingSound | None
    conditions: tuple[Condition, ...]
    scan: bool = False


@dataclass(frozen=True, eq=False)
class Responses:
    """The numbers of every case, as the fleet is and with single numbers of it moved.

    Parameters
    ----------
    cases : tuple of Case
    base : ndarray, shape (cases, quantities)
        See `CaseValues`.
    base_alike : ndarray, shape (2,)
    varied : tuple of Variation
    values : ndarray, shape (varied, amounts, cases, quantities)
        A step below and above, then the scan where there is one (see `amounts_of`); NaN where no such drive can be,
        and in the scan of numbers that are not assumed.
    alike : ndarray, shape (varied, amounts, 2)
    left_out : tuple of LeftOut
        Numbers that were not moved, and why.
    """

    cases: tuple[Case, ...]
    base: Real
    base_alike: Real
    varied: tuple[Variation, ...]
    values: Real
    alike: Real
    left_out: tuple[LeftOut, ...]

    @property
    def as_it_is(self) -> CaseValues:
        """The numbers with the fleet as it is."""
        return CaseValues(self.cases, self.base, self.base_alike)


def amounts_of(kind: str, scan: bool = True) -> tuple[float, ...]:
    """Return the amounts of `Responses`: factors, or dB of a level."""
    if kind == "level":
        return (-STEP_DB, STEP_DB, *(SCAN_DB if scan else ()))
    return (1.0 - STEP_RELATIVE, 1.0 + STEP_RELATIVE, *(SCAN_FACTORS if scan else ()))


def bare_fleet(fleet: Fleet) -> str:
    """Return a fleet as a file that says what its model depends on, and nothing else."""
    nothing: dict[str, Any] = dict.fromkeys(STUDIES, ())
    return fleet_toml(replace(fleet, name="fleet", meta=(), **nothing))


def fleet_of(text: str) -> Fleet:
    """Return the fleet that `bare_fleet` wrote; its path is of no folder."""
    raw = frozen(tomllib.loads(text))
    raw.pop("schema")
    return Fleet.of_tables(Path("fleet.toml"), raw)


def responses_task(
    fleet: Fleet, housing: HousingSound | None, conditions: Sequence[Condition], scan: bool = False
) -> Task:
    """Return the task of a fleet's responses.

    Parameters
    ----------
    fleet : Fleet
    housing : HousingSound or None
    conditions : sequence of Condition
    scan : bool
        Whether assumed numbers are moved over their whole range.
    """
    n = len(conditions)
    settings = ModelSettings(bare_fleet(fleet), housing, tuple(conditions), scan)
    return RESPONSES.task(f"{n} condition{'s' if n > 1 else ''}", settings)


def _responses(settings: ModelSettings) -> Responses:
    fleet = fleet_of(settings.fleet)
    model = CaseModel(fleet, settings.housing, settings.conditions)
    left_out: list[LeftOut] = []
    wanted: list[tuple[Variation, list[CaseValues | None]]] = []
    for held in variations_of(fleet):
        found = held if isinstance(held, LeftOut) else _stepped(model, held)
        if isinstance(found, LeftOut):
            left_out.append(found)
        else:
            wanted.append(found)
    n_amounts = len(amounts_of("relative", settings.scan))
    shape = (len(wanted), n_amounts)
    values = np.full((*shape, *model.base.values.shape), math.nan)
    alike = np.full((*shape, 2), math.nan)
    for number, (variation, stepped) in enumerate(wanted):
        scanned = _scanned(model, variation) if settings.scan and variation.is_assumed else ()
        for place, one in enumerate((*stepped, *scanned)):
            if one is not None and one.values.shape == model.base.values.shape:
                values[number, place], alike[number, place] = one.values, one.alike
        tell_progress((number + 1) / len(wanted))
    varied = tuple(variation for variation, _ in wanted)
    return Responses(model.base.cases, model.base.values, model.base.alike, varied, values, alike, tuple(left_out))


def _stepped(model: CaseModel, variation: Variation) -> tuple[Variation, list[CaseValues | None]] | LeftOut:
    """The numbers a step below and above; None on a side where no such drive can be."""
    sides: list[CaseValues | None] = []
    refused, same_vectors = "", False
    for amount in amounts_of(variation.kind, scan=False):
        try:
            changed = variation.moved(model.fleet, amount)
            if not same_vectors and model.needs_vectors(changed):
                return LeftOut(variation.key, variation.origin, VECTORS)
            same_vectors = True
            sides.append(model.values(changed, integrate=False))
        except TdacousticError as error:
            refused = reason_of(error)
            sides.append(None)
    known = [side for side in sides if side is not None]
    if not known:
        return LeftOut(variation.key, variation.origin, refused)
    if all(_same(side, model.base) for side in known):
        return LeftOut(variation.key, variation.origin, SILENT)
    return variation, sides


def _same(one: CaseValues, other: CaseValues) -> bool:
    kept = [place for place, name in enumerate(QUANTITIES) if name != "mesh_frequency_hz"]
    return one.cases == other.cases and np.allclose(
        one.values[:, kept], other.values[:, kept], rtol=1e-12, atol=0.0, equal_nan=True
    )


def _scanned(model: CaseModel, variation: Variation) -> Iterator[CaseValues | None]:
    for amount in amounts_of(variation.kind)[2:]:
        if amount == (0.0 if variation.kind == "level" else 1.0):
            yield model.base
            continue
        try:
            yield model.values(variation.moved(model.fleet, amount), integrate=False)
        except TdacousticError:
            yield None


def reason_of(error: TdacousticError) -> str:
    """Return an error in one line, without the name of the file."""
    return " ".join(str(error).removeprefix("fleet.toml: ").split())


RESPONSES: Final = Step("responses", 1, _responses, "Numbers of the model with single parameters moved")

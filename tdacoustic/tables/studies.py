"""The tables of patterns and studies."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Final

from tdacoustic.drive import Directivity, Prediction
from tdacoustic.drive.patterns import pattern_of, pattern_pairs
from tdacoustic.studies import (
    PATHS,
    FeatureCheck,
    Findings,
    ReferenceCheck,
    Sensitivity,
    Studies,
)
from tdacoustic.studies.sensitivity import per_words
from tdacoustic.studies.words import feature_words, reference_words
from tdacoustic.tables.frames import Row, frame_of
from tdacoustic.tables.sweeps import sweep_tables

if TYPE_CHECKING:
    import pandas as pd

    from tdacoustic.fleet import Fleet

__all__ = ["pattern_tables", "study_tables"]

_UNITS: Final = {"db": "dB", "um": "um", "n": "N", "hz": "Hz", "deg": "deg"}
"""Of a quantity, by the last part of its name."""


def pattern_tables(prediction: Prediction) -> dict[str, pd.DataFrame]:
    """Return ``patterns`` and ``pattern_correlation``: shapes of the level around the drive, and how alike they are.

    Parameters
    ----------
    prediction : Prediction
    """
    around = prediction.directivity
    return {
        "patterns": frame_of("patterns", (_pattern_row(one) for one in around)),
        "pattern_correlation": frame_of("pattern_correlation", _pair_rows(around)),
    }


def study_tables(studies: Studies, fleet: Fleet) -> dict[str, pd.DataFrame]:
    """Return the tables of studies as frames, by name; those of what was not studied are left out.

    ``sensitivity``, ``references``, ``features``, ``sweep_points``, ``sweeps`` and ``sweep_sensitivity``.

    Parameters
    ----------
    studies : Studies
    fleet : Fleet
        For its words.
    """
    rows: dict[str, Iterable[Row]] = {}
    if studies.sensitivity is not None:
        rows["sensitivity"] = _sensitivity_rows(studies.sensitivity)
    if studies.references:
        rows["references"] = (_reference_row(one, fleet) for one in studies.references)
    if studies.features:
        rows["features"] = (_feature_row(one, fleet) for one in studies.features)
    tables = {name: frame_of(name, table) for name, table in rows.items()}
    if studies.sweeps:
        tables |= sweep_tables(studies.sweeps, studies.sweep_sensitivities)
    return tables


def _known(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None


def _pattern_row(around: Directivity) -> Row:
    found = pattern_of(around)
    return {
        "sweep": found.sweep,
        "value": found.value,
        "mean_12m_db": _known(found.mean_db),
        "loudest_db": _known(found.loudest_db),
        "loudest_deg": _known(found.loudest_deg),
        "quietest_db": _known(found.quietest_db),
        "quietest_deg": _known(found.quietest_deg),
        "range_db": _known(found.range_db),
    }


def _pair_rows(arounds: tuple[Directivity, ...]) -> Iterator[Row]:
    for pair in pattern_pairs(arounds):
        yield {
            "sweep": pair.sweep,
            "first": pair.first,
            "second": pair.second,
            "correlation": _known(pair.correlation),
            "difference_db": pair.difference_db,
            "both_shaped": pair.both_shaped,
        }


def _sensitivity_rows(found: Sensitivity) -> Iterator[Row]:
    for variation, changes in zip(found.varied, found.change_db, strict=True):
        start = {"parameter": variation.key, "origin": variation.origin, "value": variation.value}
        for case, levels in zip(found.cases, changes, strict=True):
            at = "condition" if case.over == "conditions" else "helix_angle_deg"
            named = {at: case.name if case.over == "conditions" else case.value}
            for path, change in zip(PATHS, levels.tolist(), strict=True):
                per = {"per": per_words(variation.kind), "change_db": _known(change)}
                yield {**start, **named, "path": path, **per}
    for left in found.left_out:
        yield {"parameter": left.key, "origin": left.origin, "not_varied": left.reason}


def _findings_row(found: Findings) -> Row:
    row: Row = {}
    for number, influence in enumerate(found.influences, 1):
        row |= {
            f"influence_{number}": influence.key,
            f"influence_{number}_change": influence.change,
            f"influence_{number}_per": influence.per,
        }
    if found.moves:
        move = found.moves[0]
        row |= {"turned_by": move.key, "turned_at": move.value, "turned_amount": move.amount}
    return row


def _verdict(holds: bool | None) -> str:
    return "not determined" if holds is None else "reproduced" if holds else "not reproduced"


def _reference_row(check: ReferenceCheck, fleet: Fleet) -> Row:
    reference = check.reference
    return {
        "quantity": reference.quantity,
        "condition": " or ".join(reference.condition or ()),
        "helix_angle_deg": reference.helix_angle_deg,
        "kind": reference.kind,
        "origin": reference.origin,
        "reference_value": reference.value,
        "model_value": _known(check.value),
        "model_condition": check.case.name if check.case is not None and reference.condition is not None else "",
        "difference": _known(check.difference),
        "tolerance": reference.tolerated,
        "verdict": _verdict(check.holds),
        **_findings_row(check.findings),
        "sentence": reference_words(check, fleet).text,
        "unit": _UNITS[reference.quantity.rpartition("_")[2]],
        "difference_unit": "deg" if reference.quantity == "loudest_deg" else "dB",
    }


def _feature_row(check: FeatureCheck, fleet: Fleet) -> Row:
    feature = check.feature
    return {
        "feature": feature.label,
        "quantity": feature.quantity,
        "over": feature.over,
        "shape": feature.shape,
        "origin": feature.origin,
        "tolerance": feature.tolerated,
        "margin": _known(check.margin),
        "verdict": _verdict(check.holds),
        **_findings_row(check.findings),
        "sentence": feature_words(check, fleet).text,
        "margin_unit": {"alike": "correlation", "toward": "deg"}.get(feature.shape, "dB"),
    }

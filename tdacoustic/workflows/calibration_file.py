"""``calibration.json``: what a calibration found, for other programs."""

from __future__ import annotations

import dataclasses
import json
import math
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from tdacoustic.fitting.calibration import Calibration, FittedParameter
    from tdacoustic.results import CampaignCalibration

__all__ = ["SCHEMA", "calibration_json"]

SCHEMA: Final = "tdacoustic-calibration/1"

MOST_TELLING: Final = 20
"""Candidates for the next measurement that are written down."""


def calibration_json(result: CampaignCalibration) -> str:
    """Return ``calibration.json``.

    Parameters
    ----------
    result : CampaignCalibration
    """
    found = result.calibration
    correlation = None if found.correlation is None else found.correlation.tolist()
    document: dict[str, Any] = {
        "schema": SCHEMA,
        "campaign": result.campaign.name,
        "fleet": result.fleet.name,
        "model_sigma_db": found.model_sigma_db,
        "model_sigma_fitted": found.model_sigma_is_fitted,
        "parameters": {p.key: _parameter(p) for p in found.parameters},
        "residuals": _residuals(found),
        "left_out": [
            {"condition": left.condition, "error_db": left.error_db, "sigma_db": left.sigma_db}
            for left in found.left_out
        ],
        "correlation": correlation,
        "correlation_of": [parameter.key for parameter in found.moved],
        "rank": found.rank,
        "condition_number": found.condition_number,
        "chi_square": found.chi_square,
        "degrees_of_freedom": found.degrees_of_freedom,
        "interpolated_db": found.interpolated_db,
        "contributions": _contributions(found),
        "next_measurements": _next_measurements(found),
        "posterior": _posterior(found),
        "transferred": [{**dataclasses.asdict(held), "difference": held.difference} for held in found.transferred],
        "doubts": list(found.doubts),
        "inputs": [{"file": file.written, "sha256": file.sha256} for file in result.inputs],
        "versions": result.versions,
    }
    return json.dumps(_finite(document), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _parameter(parameter: FittedParameter) -> dict[str, Any]:
    held = parameter
    return {
        "value": held.value,
        "initial": held.initial,
        "min": held.low,
        "max": held.high,
        "stderr": held.stderr,
        "ci95": None if held.ci95 is None else list(held.ci95),
        "ci68": None if held.ci68 is None else list(held.ci68),
        "prior": None if held.prior is None else {"mean": held.prior[0], "sigma": held.prior[1]},
        "expression": held.expression,
    }


def _residuals(found: Calibration) -> list[dict[str, Any]]:
    return [
        {
            "condition": level.datum.condition.name,
            "campaign": level.datum.campaign or None,
            "receiver": level.datum.receiver.name,
            "what": level.datum.what,
            "measured_db": level.datum.level_db,
            "predicted_db": level.predicted_db,
            "before_db": level.before_db,
            "sigma_db": level.sigma_db,
            "weighting": level.datum.weighting,
            "origin": level.datum.origin,
            "source": level.datum.source,
        }
        for level in found.levels
    ]


def _contributions(found: Calibration) -> list[dict[str, Any]]:
    """Unweighted levels by path, before and after the fit, at each receiver."""
    after = {(a.condition, level.receiver, level.path): level.level_db for a in found.after for level in a.levels}
    return [
        {
            "condition": sound.condition,
            "receiver": level.receiver,
            "path": level.path,
            "before_db": level.level_db,
            "after_db": after.get((sound.condition, level.receiver, level.path)),
        }
        for sound in found.before
        for level in sound.levels
        if level.weighting == "Z" and level.path != "structure"
    ]


def _next_measurements(found: Calibration) -> list[dict[str, Any]]:
    return [
        {
            "train_speed_km_h": item.condition.train_speed_km_h,
            "torque_n_m": item.condition.torque_n_m,
            "receiver": item.receiver.name,
            "expected_db": item.expected_db,
            "interval_remaining": item.remaining,
        }
        for item in found.next_measurements[:MOST_TELLING]
    ]


def _posterior(found: Calibration) -> dict[str, Any] | None:
    held = found.posterior
    if held is None:
        return None
    return {
        "walkers": held.walkers,
        "steps": held.steps,
        "acceptance": held.acceptance,
        "converged": held.has_converged,
        "parameters": {
            p.key: {
                "median": p.median,
                "ci68": list(p.ci68),
                "ci95": list(p.ci95),
                "autocorrelation": p.autocorrelation,
                "effective_samples": p.effective_samples,
                "r_hat": p.r_hat,
            }
            for p in held.parameters
        },
    }


def _finite(value: Any) -> Any:
    """What JSON can hold: no number is null."""
    if isinstance(value, dict):
        return {key: _finite(held) for key, held in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(held) for held in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value

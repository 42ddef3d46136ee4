"""The model of a fleet fitted to a campaign's levels."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tdacoustic.campaign import Campaign, load_campaign
from tdacoustic.errors import CampaignError
from tdacoustic.steps import Store, default_store_path
from tdacoustic.steps.execution import Progress

if TYPE_CHECKING:
    from tdacoustic.results import CampaignCalibration

__all__ = ["calibrate", "calibration_json"]

SCHEMA = "tdacoustic-calibration/1"


def calibrate(
    campaign: str | Path | Campaign,
    store: str | Path | Store | None = None,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> CampaignCalibration:
    """Fit the parameters that ``[calibration] free`` names to the measured levels of a campaign.

    Parameters
    ----------
    campaign : path or Campaign
        With a fleet.
    store, jobs, progress
        As of `tdacoustic.analyze`.

    Raises
    ------
    TdacousticError
        There is no fleet, nothing to calibrate with, or the fleet cannot be computed.
    """
    from tdacoustic.fitting.calibration import calibrate_fleet, free_parameter
    from tdacoustic.fleet import load_fleet
    from tdacoustic.results import CampaignCalibration
    from tdacoustic.workflows.analyze import analyze
    from tdacoustic.workflows.measured_levels import measured_levels
    from tdacoustic.workflows.runs import written_inputs

    campaign = campaign if isinstance(campaign, Campaign) else load_campaign(campaign)
    store = store if isinstance(store, Store) else Store(store or default_store_path())
    if campaign.fleet is None:
        raise CampaignError(f"{campaign.path}: fleet is missing, and a calibration needs it")
    fleet = load_fleet(campaign.fleet.path)
    analysis = analyze(campaign, store, jobs, progress) if campaign.runs else None
    data, doubts = measured_levels(campaign, analysis, fleet)
    free = [free_parameter(fleet, key) for key in campaign.calibration.free]
    if progress is not None:
        progress("calibrating", 0, 1)
    origin = f"calibrated to {campaign.name}"
    found = calibrate_fleet(fleet, data, free, campaign.calibration.model_sigma_db, origin)
    found = replace(found, doubts=(*doubts, *found.doubts))
    inputs = written_inputs(campaign, with_fleet=True) if analysis is None else analysis.inputs
    return CampaignCalibration(campaign, fleet, analysis, found, inputs)


def calibration_json(result: CampaignCalibration) -> str:
    """Return ``calibration.json``.

    Parameters
    ----------
    result : CampaignCalibration
    """
    found = result.calibration
    parameters = {
        p.key: {
            "value": p.value,
            "initial": p.initial,
            "min": _known(p.low),
            "max": _known(p.high),
            "stderr": p.stderr,
            "ci95": None if p.ci95 is None else list(p.ci95),
        }
        for p in found.parameters
    }
    residuals = [
        {
            "condition": level.datum.condition.name,
            "receiver": level.datum.receiver.name,
            "measured_db": level.datum.level_db,
            "predicted_db": level.predicted_db,
            "before_db": level.before_db,
            "sigma_db": level.sigma_db,
            "weighting": level.datum.weighting,
            "origin": level.datum.origin,
        }
        for level in found.levels
    ]
    document: dict[str, Any] = {
        "schema": SCHEMA,
        "campaign": result.campaign.name,
        "fleet": result.fleet.name,
        "model_sigma_db": result.campaign.calibration.model_sigma_db,
        "parameters": parameters,
        "residuals": residuals,
        "left_out": [{"condition": left.condition, "error_db": left.error_db} for left in found.left_out],
        "correlation": None if found.correlation is None else found.correlation.tolist(),
        "rank": found.rank,
        "chi_square": found.chi_square,
        "doubts": list(found.doubts),
        "inputs": [{"file": file.written, "sha256": file.sha256} for file in result.inputs],
        "versions": result.versions,
    }
    return json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None

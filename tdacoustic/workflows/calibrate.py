"""The model of a fleet fitted to a campaign's levels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from tdacoustic.campaign import Campaign, load_campaign
from tdacoustic.errors import CampaignError, FittingError
from tdacoustic.steps import Jobs, Progress, Store, default_store_path
from tdacoustic.workflows.runs import fleet_input, written_inputs

if TYPE_CHECKING:
    from tdacoustic.drive import HousingSound
    from tdacoustic.fitting.calibration import Calibration
    from tdacoustic.fitting.measured_level import MeasuredLevel
    from tdacoustic.fleet import Fleet
    from tdacoustic.results import Analysis, CampaignCalibration, SpeedLevel

__all__ = ["calibrate"]

MOST_OF_THE_SOUND: Final = 0.5
"""Part of the sound energy that lines carry, below which a model of lines is doubtful beside an overall level."""


def calibrate(
    campaign: str | Path | Campaign,
    store: str | Path | Store | None = None,
    jobs: Jobs | None = None,
    progress: Progress | None = None,
    analysis: Analysis | None = None,
    *,
    fetch_urls: bool = False,
) -> CampaignCalibration:
    """Fit the parameters that ``[calibration]`` names to the measured levels of a campaign.

    Parameters
    ----------
    campaign : path or Campaign
        With a fleet.
    store, jobs, progress
        As of `tdacoustic.analyze`.
    analysis : Analysis, optional
        The campaign's measured side, where it is known already.
    fetch_urls : bool
        As of `tdacoustic.analyze`.

    Raises
    ------
    TdacousticError
        There is no fleet, nothing to calibrate with, or the fleet cannot be computed.
    """
    from threadpoolctl import threadpool_limits

    from tdacoustic.drive import gear_unit_of
    from tdacoustic.drive.doubts import structure_doubts
    from tdacoustic.fitting.calibration import calibrate_fleet
    from tdacoustic.fitting.free import checked_free
    from tdacoustic.fitting.levels import LevelModel
    from tdacoustic.fleet import load_fleet
    from tdacoustic.results import CampaignCalibration
    from tdacoustic.workflows.calibration_setup import candidates_of, fit_settings, free_parameters
    from tdacoustic.workflows.housing_sound import housing_sound
    from tdacoustic.workflows.joint_levels import joint_levels
    from tdacoustic.workflows.microphones import microphones
    from tdacoustic.workflows.what_if import calibrated_what_if, checked_cases

    campaign = campaign if isinstance(campaign, Campaign) else load_campaign(campaign)
    store = store if isinstance(store, Store) else Store(store or default_store_path())
    if campaign.fleet is None:
        raise CampaignError(f"{campaign.path}: fleet is missing, and a calibration needs it")
    fleet = load_fleet(campaign.fleet.path)
    checked_cases(campaign, fleet)
    if analysis is None and campaign.runs:
        analysis = _analyzed(campaign, store, jobs, progress, fetch_urls)
    if analysis is not None:
        campaign = analysis.campaign  # which knows where its logs were fetched to
    joint = joint_levels(
        campaign, analysis, fleet, lambda other: _analyzed(other, store, jobs, progress, fetch_urls), store
    )
    free, transferred, earlier = free_parameters(campaign, fleet, joint.campaigns)
    try:
        checked_free(fleet, [parameter.name for parameter in free])
    except FittingError as error:
        raise CampaignError(f"{campaign.path}: [calibration]: {error}") from error
    places = (*microphones(campaign, fleet).values(), *(datum.receiver for datum in joint.data))
    housing, records = housing_sound(fleet, store, jobs, progress, places)
    if progress is not None:
        progress("calibrating", 0, 1)
    with threadpool_limits(limits=1):  # so that the numbers are the same on any number of cores
        model = LevelModel(fleet, joint.data, housing)
        found = calibrate_fleet(
            fleet,
            joint.data,
            free,
            fit_settings(campaign),
            f"calibrated to {' and '.join(joint.campaigns)}",
            candidates=candidates_of(campaign, fleet, joint.data),
            transferred=transferred,
            earlier=earlier,
            housing=housing,
            model=model,
        )
        over_speed = _over_speed(fleet, found, joint.data, housing)
    answer, case_records = calibrated_what_if(campaign, analysis, found, model, store, jobs, progress)
    asked = () if answer is None else answer.doubts
    unit = gear_unit_of(fleet)
    mesh_hz = {datum.condition.name: unit.mesh_hz(datum.condition.motor_hz) for datum in joint.data}
    unheard = structure_doubts(fleet, list(mesh_hz.items()))
    doubts = (*joint.doubts, *unheard, *_doubts_of_lines(analysis, joint.data), *found.doubts, *asked)
    found = replace(found, doubts=tuple(dict.fromkeys(doubts)))
    own = written_inputs(campaign, with_fleet=True) if analysis is None else analysis.inputs
    prior_fleet = campaign.calibration.prior_fleet
    prior = () if prior_fleet is None else (fleet_input(prior_fleet, "prior fleet"),)
    inputs, steps = (*own, *joint.inputs, *prior), dict((*records, *case_records))
    return CampaignCalibration(campaign, fleet, analysis, found, inputs, over_speed, tuple(steps.items()), answer)


def _doubts_of_lines(analysis: Analysis | None, data: Sequence[MeasuredLevel]) -> list[str]:
    """Say where the recordings are mostly broadband and the model, which has lines alone, is held against all of it."""
    if analysis is None or all(datum.what != "overall" for datum in data):
        return []
    parts = [verdict.line_fraction for verdict in analysis.dominance if verdict.line_fraction is not None]
    if not parts or min(parts) >= MOST_OF_THE_SOUND:
        return []
    between = " to ".join(dict.fromkeys(f"{100.0 * part:.0f}" for part in (min(parts), max(parts))))
    return [
        f"lines carry {between} % of the recorded sound energy, and the model has lines alone: what is fitted to the "
        "overall levels takes the broadband sound on as well"
    ]


def _over_speed(
    fleet: Fleet, found: Calibration, data: Sequence[MeasuredLevel], housing: HousingSound | None
) -> tuple[SpeedLevel, ...]:
    """The model's level in the conditions of the data and of the fleet, before and after."""
    from tdacoustic.drive import DriveModel, conditions_of
    from tdacoustic.results import SpeedLevel

    conditions = {datum.condition.name: datum.condition for datum in data if datum.group == datum.condition.name}
    if fleet.operation.train_speed_km_h is not None:
        conditions = {**{condition.name: condition for condition in conditions_of(fleet)}, **conditions}
    by_speed = sorted(conditions.values(), key=lambda condition: condition.train_speed_km_h)
    sides = []
    for model in (DriveModel(fleet, housing=housing), DriveModel(found.fleet, housing=housing)):
        sounds = [model.sound_of(model.gears(condition)) for condition in by_speed]
        sides.append([sound.level_db(model.field.surface.name) for sound in sounds])
    return tuple(
        SpeedLevel(condition.name, condition.train_speed_km_h, *(math.nan if x is None else x for x in levels))
        for condition, *levels in zip(by_speed, *sides, strict=True)
    )


def _analyzed(
    campaign: Campaign, store: Store, jobs: Jobs | None, progress: Progress | None, fetch_urls: bool
) -> Analysis:
    from tdacoustic.workflows.analyze import analyze

    return analyze(campaign, store, jobs, progress, deeper=False, fetch_urls=fetch_urls)

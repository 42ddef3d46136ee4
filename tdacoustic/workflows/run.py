"""The main job: what the recordings show, the model fitted to it, and what the fitted model predicts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from tdacoustic.campaign import Campaign, load_campaign
from tdacoustic.errors import (
    AnalysisError,
    CampaignError,
    ExecutorError,
    FormatError,
    MissingFileError,
    StoreError,
    TdacousticError,
)
from tdacoustic.steps import Jobs, Progress, Store, default_store_path

if TYPE_CHECKING:
    from tdacoustic.drive.what_if import WhatIfAnswer
    from tdacoustic.fleet import Fleet
    from tdacoustic.results import Analysis, CampaignResult, FleetPrediction

__all__ = ["run"]

NO_FLEET = "nothing is calibrated and nothing is predicted: there is no fleet"

_LOGS_FAIL = (AnalysisError, FormatError, MissingFileError)
"""Errors of logs; of a wrong campaign or a store that cannot be used nothing is left to do."""

T = TypeVar("T")


def run(
    campaign: str | Path | Campaign,
    store: str | Path | Store | None = None,
    jobs: Jobs | None = None,
    progress: Progress | None = None,
    *,
    fetch_urls: bool = False,
) -> CampaignResult:
    """Do all that can be done for a campaign: analyse its logs, calibrate its fleet to them, predict with that.

    The prediction is for the campaign's conditions, at the speeds and torques that the calibration uses, then for those
    of the fleet's ``[operation]`` whose names the campaign does not have; on the 4 m surface and at each microphone of
    the campaign whose place is known.

    Parameters
    ----------
    campaign : path or Campaign
    store, jobs, progress, fetch_urls
        As of `tdacoustic.analyze`.

    Returns
    -------
    CampaignResult
        What could not be done is named in `CampaignResult.problems`. A fleet that cannot be calibrated predicts as it
        is.

    Raises
    ------
    TdacousticError
        The campaign or its fleet is wrong; or nothing can be done: no run can be used and nothing predicted.
    """
    from tdacoustic.fleet import load_fleet
    from tdacoustic.results import CampaignResult
    from tdacoustic.workflows.calibrate import calibrate
    from tdacoustic.workflows.what_if import checked_cases

    campaign = campaign if isinstance(campaign, Campaign) else load_campaign(campaign)
    store = store if isinstance(store, Store) else Store(store or default_store_path())
    if campaign.fleet is not None and campaign.fleet.path.is_file():  # one that is not there is told by the analysis
        checked_cases(campaign, load_fleet(campaign.fleet.path))
    analysis, lost = _measured_side(campaign, store, jobs, progress, fetch_urls)
    campaign, fleet = analysis.campaign, analysis.fleet
    if fleet is None:
        if lost is not None:
            raise lost
        return CampaignResult(campaign, analysis, None, None, (NO_FLEET,))
    calibration, unfitted = _tried(
        lambda: calibrate(campaign, store, jobs, progress, analysis=analysis, fetch_urls=fetch_urls)
    )
    used = fleet if calibration is None else calibration.calibration.fleet
    answer = None if calibration is None else calibration.what_if
    prediction, unpredicted = _tried(lambda: _predicted(campaign, analysis, used, store, jobs, progress, answer))
    if prediction is None and lost is not None:
        raise lost
    not_done = _not_done(campaign, fleet, unfitted, unpredicted)
    return CampaignResult(campaign, analysis, calibration, prediction, not_done)


def _measured_side(
    campaign: Campaign, store: Store, jobs: Jobs | None, progress: Progress | None, fetch_urls: bool
) -> tuple[Analysis, TdacousticError | None]:
    """The analysis; where no run can be used an empty one, and why."""
    from tdacoustic.workflows.analyze import analyze

    try:
        return analyze(campaign, store, jobs, progress, fetch_urls=fetch_urls), None
    except _LOGS_FAIL as error:
        return analyze(campaign, store, jobs, progress, without_runs=True, fetch_urls=fetch_urls), error


def _tried(task: Callable[[], T]) -> tuple[T | None, TdacousticError | None]:
    """A result, or why there is none; an error of the campaign's file, the store or a cluster ends the run."""
    try:
        return task(), None
    except (CampaignError, ExecutorError, StoreError):
        raise
    except TdacousticError as error:
        return None, error


def _predicted(
    campaign: Campaign,
    analysis: Analysis,
    fleet: Fleet,
    store: Store,
    jobs: Jobs | None,
    progress: Progress | None,
    answer: WhatIfAnswer | None,
) -> FleetPrediction:
    """The prediction; what changes would do is the calibration's, of the same fleet and places, with intervals."""
    from tdacoustic.workflows.measured_levels import campaign_conditions, more_conditions
    from tdacoustic.workflows.microphones import microphone_doubts, microphones
    from tdacoustic.workflows.predict import predict
    from tdacoustic.workflows.what_if import with_recordings

    conditions, doubts = campaign_conditions(campaign, analysis, fleet)
    conditions = {**conditions, **more_conditions(fleet, conditions)}
    receivers = tuple(microphones(campaign, fleet).values())
    found = predict(fleet, store, progress, conditions.values(), receivers, jobs, answer)
    if found.what_if is not None:
        found = replace(found, what_if=with_recordings(found.what_if, analysis))
    doubts = [*doubts, *microphone_doubts(campaign, fleet), *found.prediction.doubts]
    return replace(found, prediction=replace(found.prediction, doubts=tuple(dict.fromkeys(doubts))))


def _not_done(
    campaign: Campaign, fleet: Fleet, unfitted: TdacousticError | None, unpredicted: TdacousticError | None
) -> tuple[str, ...]:
    """What of calibration and prediction there is not, and why."""
    why_not = None if unfitted is None else _words(campaign, fleet, unfitted)
    if unpredicted is None:
        as_it_is = "the fleet is not calibrated, the prediction is made with it as it is"
        return () if why_not is None else (f"{as_it_is}: {why_not}",)
    why = _words(campaign, fleet, unpredicted)
    if why == why_not:
        return (f"the fleet is not calibrated and nothing is predicted: {why}",)
    predicted = f"nothing is predicted: {why}"
    return (predicted,) if why_not is None else (f"the fleet is not calibrated: {why_not}", predicted)


def _words(campaign: Campaign, fleet: Fleet, error: TdacousticError) -> str:
    """An error with the files as people wrote them: a copied campaign gives the same result."""
    written = "fleet" if campaign.fleet is None else campaign.fleet.text
    text = str(error).removeprefix(f"{campaign.path}: ").replace(str(fleet.path), written)
    return " ".join(text.split())

"""What changes of the drive do to its levels: for a fleet as it is, and with intervals for a calibrated one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, TypeAlias

from tdacoustic.steps import Jobs, Progress, Store

if TYPE_CHECKING:
    from tdacoustic.campaign import Campaign
    from tdacoustic.drive import Condition, DriveModel, DriveSound, HousingSound, Receiver
    from tdacoustic.drive.what_if import WhatIfAnswer
    from tdacoustic.fitting.calibration import Calibration
    from tdacoustic.fitting.levels import LevelModel
    from tdacoustic.fleet import Fleet
    from tdacoustic.results import Analysis
    from tdacoustic.steps import Record

__all__ = ["calibrated_what_if", "checked_cases", "predicted_what_if", "with_recordings"]

Records: TypeAlias = "tuple[tuple[str, Record], ...]"


def checked_cases(campaign: Campaign, fleet: Fleet) -> None:
    """Raise for what a fleet asks of a condition that neither it nor the campaign has, before anything is computed.

    Parameters
    ----------
    campaign : Campaign
    fleet : Fleet

    Raises
    ------
    FleetError
    """
    from tdacoustic.drive.what_if import check_cases
    from tdacoustic.fleet.study_problems import check_studies

    check_cases(fleet, campaign.conditions())
    check_studies(fleet, campaign.conditions())


def with_recordings(answer: WhatIfAnswer, analysis: Analysis | None) -> WhatIfAnswer:
    """Return an answer that says which part of the recorded sound its lines are.

    Parameters
    ----------
    answer : WhatIfAnswer
    analysis : Analysis or None
    """
    verdicts = () if analysis is None else analysis.dominance
    held = tuple((one.condition, one.line_fraction) for one in verdicts if one.line_fraction is not None)
    return replace(answer, line_fractions=held)


def predicted_what_if(
    model: DriveModel,
    conditions: Sequence[Condition],
    sounds: Sequence[DriveSound],
    receivers: Sequence[Receiver],
    store: Store,
    housing: HousingSound | None = None,
    jobs: Jobs | None = None,
    progress: Progress | None = None,
) -> tuple[WhatIfAnswer, Records]:
    """Return what the cases of a fleet do to its levels, without intervals, and the records of the steps behind it.

    A case whose parameters change the housing asks for modes and transfer vectors of its own: minutes, once.

    Parameters
    ----------
    model : DriveModel
    conditions : sequence of Condition
    sounds : sequence of DriveSound
        Of each of them.
    receivers : sequence of Receiver
        Besides the surface.
    store, jobs, progress
        As of `tdacoustic.predict`.
    housing : HousingSound, optional
        Of the model.

    Raises
    ------
    TdacousticError
        A case is for a condition that there is not, or cannot be computed.
    """
    from threadpoolctl import threadpool_limits

    from tdacoustic.drive.what_if import what_if_answer

    models, _, records = _changed(model.fleet, housing, receivers, store, jobs, progress)
    with threadpool_limits(limits=1):  # so that the numbers are the same on any number of cores
        return what_if_answer(model, conditions, sounds, receivers, models), records


def calibrated_what_if(
    campaign: Campaign,
    analysis: Analysis | None,
    calibration: Calibration,
    model: LevelModel,
    store: Store,
    jobs: Jobs | None = None,
    progress: Progress | None = None,
) -> tuple[WhatIfAnswer | None, Records]:
    """Return what the cases of a calibrated fleet do to its levels, with intervals; None without any condition.

    The conditions are the campaign's and those of ``[operation]`` whose names it does not have; the receivers are the
    surface and the campaign's microphones.

    Parameters
    ----------
    campaign : Campaign
    analysis : Analysis or None
    calibration : Calibration
    model : LevelModel
        That of the calibration's data, of the fleet before.
    store, jobs, progress
        As of `tdacoustic.calibrate`.

    Raises
    ------
    TdacousticError
        As of `predicted_what_if`.
    """
    from threadpoolctl import threadpool_limits

    from tdacoustic.drive import DriveModel
    from tdacoustic.drive.what_if import what_if_answer
    from tdacoustic.fitting.levels import LevelModel
    from tdacoustic.fitting.what_if import WhatIfPlaces, what_if_intervals
    from tdacoustic.workflows.measured_levels import campaign_conditions, more_conditions
    from tdacoustic.workflows.microphones import microphones

    fleet, housing = calibration.fleet, model.housing
    known, _ = campaign_conditions(campaign, analysis, fleet)
    conditions = (*known.values(), *more_conditions(fleet, known).values())
    if not conditions:
        return None, ()
    receivers = tuple(microphones(campaign, fleet).values())
    models, housings, records = _changed(fleet, housing, receivers, store, jobs, progress)
    with threadpool_limits(limits=1):  # so that the numbers are the same on any number of cores
        drive = DriveModel(fleet, housing=housing)
        sounds = [drive.sound_of(drive.gears(condition), receivers) for condition in conditions]
        answer = what_if_answer(drive, conditions, sounds, receivers, models)
        heard = [level.datum for level in calibration.levels]
        if len(heard) != len(model.data):
            model = LevelModel(model.fleet, heard, housing)
        places = WhatIfPlaces(conditions, (drive.field.surface, *receivers), housing, housings)
        return with_recordings(what_if_intervals(answer, calibration, model, places), analysis), records


def _changed(
    fleet: Fleet,
    housing: HousingSound | None,
    receivers: Sequence[Receiver],
    store: Store,
    jobs: Jobs | None,
    progress: Progress | None,
) -> tuple[Mapping[str, DriveModel], Mapping[str, HousingSound | None], Records]:
    """Models and housings of the cases with other parameters, by name, and the records of the housings' steps."""
    from tdacoustic.drive.what_if import changed_fleet, changed_model
    from tdacoustic.studies.changed_fleet import housing_under
    from tdacoustic.workflows.housing_sound import housing_sound

    models: dict[str, DriveModel] = {}
    housings: dict[str, HousingSound | None] = {}
    records: dict[str, Record] = {}
    for case in fleet.what_if:
        if case.parameters:
            changed = changed_fleet(fleet, case)
            held = housing_under(fleet, changed, housing)
            if held is None:
                held, made = housing_sound(changed, store, jobs, progress, receivers)
                records |= dict(made)
            models[case.name], housings[case.name] = changed_model(fleet, case, held), held
    return models, housings, tuple(records.items())

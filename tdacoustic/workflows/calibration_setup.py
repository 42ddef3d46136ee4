"""From ``[calibration]`` to what a fit is given: parameters, priors, settings, and what could be measured next."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from tdacoustic.errors import CampaignError, FittingError, FleetError

if TYPE_CHECKING:
    from tdacoustic.campaign import Campaign
    from tdacoustic.campaign.calibration import CalibrationSettings
    from tdacoustic.drive import Receiver
    from tdacoustic.fitting import FreeParameter
    from tdacoustic.fitting.measured_level import MeasuredLevel
    from tdacoustic.fitting.next_measurement import Candidate
    from tdacoustic.fitting.settings import FitSettings
    from tdacoustic.fitting.transfer import Transferred
    from tdacoustic.fleet import Fleet

__all__ = ["candidates_of", "fit_settings", "free_parameters"]

CANDIDATE_SPEEDS: Final = 9
CANDIDATE_TORQUES: Final = (1.0, 0.5)
"""Speeds, evenly over the range of data and fleet, and parts of the torque law, that a next measurement could have."""

OFFSET_BOUNDS: Final = 10.0
"""Bounds of a level offset over its standard deviation."""


def fit_settings(campaign: Campaign) -> FitSettings:
    """Return how a campaign wants its calibration done."""
    from tdacoustic.fitting.settings import FitSettings, PosteriorSettings

    stated = campaign.calibration
    posterior = PosteriorSettings(stated.posterior_walkers, stated.posterior_steps) if stated.posterior else None
    sigma_db = None if stated.fit_model_sigma else stated.model_sigma_db
    return FitSettings(sigma_db, stated.loss, stated.starts, posterior)


def free_parameters(
    campaign: Campaign, fleet: Fleet, campaigns: Sequence[str]
) -> tuple[list[FreeParameter], tuple[Transferred, ...], Fleet | None]:
    """Return the parameters of a fit, what was carried over from an earlier fleet, and that fleet.

    Parameters
    ----------
    campaign : Campaign
    fleet : Fleet
    campaigns : sequence of str
        Names of those fitted together; with more than one each gets a level offset.

    Raises
    ------
    TdacousticError
        A parameter that no fleet has, or that contradicts its bounds; an earlier fleet that was not calibrated.
    """
    from tdacoustic.fitting import FreeParameter
    from tdacoustic.fitting.calibration import free_parameter
    from tdacoustic.fitting.measured_level import offset_name
    from tdacoustic.fitting.parameters import lmfit_parameters
    from tdacoustic.fitting.transfer import transferred_priors
    from tdacoustic.fleet import load_fleet
    from tdacoustic.fleet.entries import split_entry
    from tdacoustic.fleet.messages import key_problem

    stated = _with_default(campaign.calibration, fleet)
    free = []
    for name in stated.names:
        held = stated.stated(name)
        prior = None
        if held.prior_mean is not None and held.prior_sigma is not None:
            prior = held.prior_mean, held.prior_sigma
        try:
            made = free_parameter(
                fleet,
                name,
                initial=_start(name, held.value, held.expression),
                low=held.min,
                high=held.max,
                prior=prior,
                scale=held.scale,
                expression=held.expression,
            )
        except (FittingError, FleetError) as error:
            if isinstance(error, FleetError) and key_problem(split_entry(name)[0]) is None:
                raise  # a parameter that fleets have, and this one lacks
            raise CampaignError(f"{campaign.path}: [calibration]: {error}") from error
        free.append(made)
    try:
        lmfit_parameters(free)
    except FittingError as error:
        raise CampaignError(f"{campaign.path}: [[calibration.parameter]]: {error}") from error
    transferred: tuple[Transferred, ...] = ()
    earlier = None
    if stated.prior_fleet is not None:
        earlier = load_fleet(stated.prior_fleet.path)
        carried, transferred = transferred_priors(free, earlier, stated.prior_discount)
        free = list(carried)
    if len(campaigns) > 1:
        sigma = stated.offset_sigma_db
        bound = OFFSET_BOUNDS * sigma
        free += [FreeParameter(offset_name(name), 0.0, -bound, bound, (0.0, sigma)) for name in campaigns]
    return free, transferred, earlier


def _with_default(stated: CalibrationSettings, fleet: Fleet) -> CalibrationSettings:
    """Settings whose `free`, where the file leaves it out, names the gain of the path that the total adds."""
    from tdacoustic.drive.levels import paths_of_total

    adds = paths_of_total(fleet)
    if "free" in stated.model_fields_set or "mesh" in adds or "structure" not in adds:
        return stated
    others = [name for name in stated.free if name != "masuda.constant_db"]
    return stated.model_copy(update={"free": ("model.structure_gain_db", *others)})


def _start(name: str, stated: float | None, expression: str | None) -> float | None:
    """Where the search starts; an auxiliary parameter with an expression need not say."""
    return 1.0 if stated is None and expression is not None and "." not in name else stated


def candidates_of(campaign: Campaign, fleet: Fleet, data: Sequence[MeasuredLevel]) -> list[Candidate]:
    """Return measurements that could be made next: speeds and torques that the data do not have, at each receiver.

    Speeds lie evenly between the slowest and the fastest of the data and of ``[operation]``; torques are the fleet's
    law, and half of it; receivers are those of the data.

    Parameters
    ----------
    campaign : Campaign
    fleet : Fleet
    data : sequence of MeasuredLevel
    """
    from tdacoustic.drive import Condition, torque_at
    from tdacoustic.fitting.next_measurement import Candidate
    from tdacoustic.fleet import Kinematics

    of_fleet = fleet.operation.train_speed_km_h
    speeds = {datum.condition.train_speed_km_h for datum in data} | set(of_fleet.value if of_fleet else ())
    low, high = min(speeds), max(speeds)
    steps = range(CANDIDATE_SPEEDS)
    asked = [low + (high - low) * step / (CANDIDATE_SPEEDS - 1) for step in steps] if high > low else [low]
    receivers: list[Receiver] = list(dict.fromkeys(datum.receiver for datum in data if datum.band_hz is None))
    kinematics = Kinematics.of(fleet)
    conditions = []
    for speed, part in itertools.product(asked, CANDIDATE_TORQUES):
        try:
            torque = part * torque_at(fleet, speed)
        except FleetError:  # beyond a torque table: nobody can drive there
            continue
        name = f"{speed:.4g} km/h, {torque:.4g} N m"
        conditions.append(
            Condition(name, speed, kinematics.motor_hz_at_km_h(speed), torque, fleet.operation.mode.value)
        )
    sigma_db = campaign.calibration.level_sigma_db
    known = [(d.condition, d.receiver) for d in data]
    return [
        Candidate(condition, receiver, sigma_db)
        for condition in conditions
        for receiver in receivers
        if not any(_same(condition, held) and receiver == at for held, at in known)
    ]


def _same(first: object, second: object) -> bool:
    from tdacoustic.drive import Condition

    assert isinstance(first, Condition) and isinstance(second, Condition)
    near = abs(first.train_speed_km_h - second.train_speed_km_h) <= 0.02 * second.train_speed_km_h
    return near and abs(first.torque_n_m - second.torque_n_m) <= 0.02 * abs(second.torque_n_m)

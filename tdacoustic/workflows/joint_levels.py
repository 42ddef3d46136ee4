"""The levels of a campaign, and of those that are fitted together with it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from tdacoustic.campaign import Campaign, load_campaign
from tdacoustic.errors import CampaignError

if TYPE_CHECKING:
    from tdacoustic.fitting.measured_level import MeasuredLevel
    from tdacoustic.fleet import Fleet
    from tdacoustic.results import Analysis, LogInput
    from tdacoustic.steps import Store

__all__ = ["JointLevels", "joint_levels"]


@dataclass(frozen=True)
class JointLevels:
    """Levels of one campaign or several.

    Parameters
    ----------
    data : tuple of MeasuredLevel
        Where there are several campaigns, each level names its own, and so does its condition.
    campaigns : tuple of str
        Names, the main one first.
    doubts : tuple of str
    inputs : tuple of LogInput
        Files of the further campaigns.
    """

    data: tuple[MeasuredLevel, ...]
    campaigns: tuple[str, ...]
    doubts: tuple[str, ...]
    inputs: tuple[LogInput, ...]


def joint_levels(
    campaign: Campaign, analysis: Analysis | None, fleet: Fleet, analyzed: Callable[[Campaign], Analysis], store: Store
) -> JointLevels:
    """Return the levels of a campaign and of those that its ``[calibration] with_campaigns`` names.

    Parameters
    ----------
    campaign : Campaign
    analysis : Analysis or None
        None of a campaign without runs.
    fleet : Fleet
    analyzed : callable
        Analyses a further campaign.
    store : Store
        In which the analyses are made.

    Raises
    ------
    TdacousticError
        A further campaign is wrong, of another fleet, or has the name of one before it; there is no level.
    """
    from tdacoustic.fleet import load_fleet
    from tdacoustic.workflows.measured_levels import measured_levels
    from tdacoustic.workflows.runs import written_inputs

    settings = campaign.calibration.data, campaign.calibration.level_sigma_db, store
    data, doubts = measured_levels(campaign, analysis, fleet, *settings)
    stated = campaign.calibration.with_campaigns
    if not stated:
        return JointLevels(tuple(data), (campaign.name,), tuple(doubts), ())
    names, inputs, joint = [campaign.name], [], [_of(campaign.name, datum) for datum in data]
    for path in stated:
        other = load_campaign(path.path)
        if other.name in names:
            raise CampaignError(f"{campaign.path}: with_campaigns: {path} has the name {other.name!r} of another one")
        if other.fleet is None or load_fleet(other.fleet.path) != fleet:
            raise CampaignError(
                f"{campaign.path}: with_campaigns: {path} is not of the same fleet; a fleet of its own takes the "
                "calibrated one as prior_fleet"
            )
        held = analyzed(other) if other.runs else None
        more, said = measured_levels(other, held, fleet, *settings)
        names.append(other.name)
        joint += [_of(other.name, datum) for datum in more]
        doubts += [f"{other.name}: {doubt}" for doubt in said]
        inputs += [
            replace(file, written=f"{path}: {file.written}")
            for file in (written_inputs(other, with_fleet=False) if held is None else held.inputs)
        ]
    return JointLevels(tuple(joint), tuple(names), tuple(doubts), tuple(inputs))


def _of(campaign: str, datum: MeasuredLevel) -> MeasuredLevel:
    """A level that says whose it is; two campaigns may have conditions of one name."""
    condition = replace(datum.condition, name=f"{campaign}: {datum.condition.name}")
    return replace(datum, condition=condition, group=f"{campaign}: {datum.group}", campaign=campaign)

"""A fleet calibrated to a campaign."""

from __future__ import annotations

from dataclasses import dataclass

from tdacoustic.campaign import Campaign
from tdacoustic.drive.what_if import WhatIfAnswer
from tdacoustic.fitting.calibration import Calibration
from tdacoustic.fleet import Fleet
from tdacoustic.results.analysis import Analysis, LogInput
from tdacoustic.steps.record import Record, versions

__all__ = ["CampaignCalibration", "SpeedLevel", "settings_in_force"]


@dataclass(frozen=True)
class SpeedLevel:
    """The model's level on the 4 m surface in one condition, before and after the calibration.

    Parameters
    ----------
    condition : str
    train_speed_km_h : float
    before_db, after_db : float
        NaN of a silent model.
    """

    condition: str
    train_speed_km_h: float
    before_db: float
    after_db: float


@dataclass(frozen=True)
class CampaignCalibration:
    """A fleet calibrated to a campaign.

    Parameters
    ----------
    campaign : Campaign
    fleet : Fleet
        As it was; `calibration.fleet` is the calibrated one.
    analysis : Analysis or None
        The measured side; None of a campaign without runs.
    calibration : Calibration
    inputs : tuple of LogInput
        Every file that went in.
    over_speed : tuple of SpeedLevel
        Of the campaign's conditions and of those of ``[operation]`` that it does not have, by speed.
    records : tuple of (str, Record)
        Key and record of the steps behind the housing's transfer vectors.
    what_if : WhatIfAnswer or None
        What changes of the calibrated drive do to its levels, with intervals; None without any condition.
    """

    campaign: Campaign
    fleet: Fleet
    analysis: Analysis | None
    calibration: Calibration
    inputs: tuple[LogInput, ...]
    over_speed: tuple[SpeedLevel, ...] = ()
    records: tuple[tuple[str, Record], ...] = ()
    what_if: WhatIfAnswer | None = None

    @property
    def versions(self) -> dict[str, str]:
        """Versions of Python and the libraries that made the numbers."""
        return dict(versions())


def settings_in_force(campaign: Campaign, fit: CampaignCalibration | None) -> dict[str, object]:
    """Return the settings of a campaign; of parameters to fit that its file does not name, those that the fit freed.

    Parameters
    ----------
    campaign : Campaign
    fit : CampaignCalibration or None
    """
    settings: dict[str, object] = dict(campaign.settings)
    if fit is not None and "free" not in campaign.calibration.model_fields_set:
        own = {parameter.name for parameter in campaign.calibration.parameter}
        freed = (found.key for found in fit.calibration.parameters if found.key not in own)
        settings["calibration.free"] = tuple(freed)
    return settings

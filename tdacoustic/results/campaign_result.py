"""All that was done for a campaign: the main job."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel

from tdacoustic.campaign import Campaign
from tdacoustic.results.analysis import Analysis, LogInput
from tdacoustic.results.campaign_calibration import CampaignCalibration, settings_in_force
from tdacoustic.results.fleet_prediction import FleetPrediction
from tdacoustic.steps import Record

__all__ = ["CampaignResult"]


@dataclass(frozen=True)
class CampaignResult:
    """All that was done for a campaign: the measured side, the model fitted to it, and what the model predicts.

    Parameters
    ----------
    campaign : Campaign
    analysis : Analysis
        Of no more than the rows of the campaign where no run could be used.
    calibration : CampaignCalibration or None
    prediction : FleetPrediction or None
        With the calibrated fleet; with the fleet as it is where it could not be calibrated.
    not_done : tuple of str
        Which of the last two is None, and why, one line each.

    Examples
    --------
    ``run("campaign.toml").prediction.tables["predictions"]`` is a pandas frame.
    """

    campaign: Campaign
    analysis: Analysis
    calibration: CampaignCalibration | None
    prediction: FleetPrediction | None
    not_done: tuple[str, ...] = ()

    @property
    def problems(self) -> tuple[str, ...]:
        """What could not be done, one line each."""
        return (*self.analysis.problems, *self.not_done)

    @property
    def doubts(self) -> tuple[str, ...]:
        """What must be known before the numbers of calibration and prediction are used, each once."""
        of_fit = () if self.calibration is None else self.calibration.calibration.doubts
        of_model = () if self.prediction is None else self.prediction.prediction.doubts
        return tuple(dict.fromkeys((*of_fit, *of_model)))

    @property
    def inputs(self) -> tuple[LogInput, ...]:
        """Every file that went in, each once."""
        of_fit = () if self.calibration is None else self.calibration.inputs
        return tuple(dict.fromkeys((*self.analysis.inputs, *of_fit)))

    @property
    def settings(self) -> dict[str, Any]:
        """Every setting of ``[analysis]`` and ``[calibration]`` in force, in the types that JSON has."""
        return {key: _plain(value) for key, value in settings_in_force(self.campaign, self.calibration).items()}

    @property
    def records(self) -> tuple[tuple[str, Record], ...]:
        """Key and record of every step, upstream first."""
        of_fit = () if self.calibration is None else self.calibration.records
        of_model = () if self.prediction is None else self.prediction.records
        return tuple(dict((*self.analysis.records, *of_fit, *of_model)).items())


def _plain(value: Any) -> Any:
    """A setting in JSON's types: a table by what it states, a path as it is written."""
    if isinstance(value, BaseModel):
        return {key: _plain(held) for key, held in value if held is not None}
    if isinstance(value, tuple):
        return [_plain(held) for held in value]
    return value if value is None or isinstance(value, bool | int | float | str) else getattr(value, "text", str(value))

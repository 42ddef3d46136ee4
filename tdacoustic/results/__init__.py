"""What the commands found, as reports, files and notebooks read it."""

from tdacoustic.results.analysis import Analysis, LogInput
from tdacoustic.results.campaign_calibration import CampaignCalibration, SpeedLevel
from tdacoustic.results.campaign_result import CampaignResult
from tdacoustic.results.fleet_prediction import FleetPrediction

__all__ = ["Analysis", "CampaignCalibration", "CampaignResult", "FleetPrediction", "LogInput", "SpeedLevel"]

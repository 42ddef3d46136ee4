"""``campaign.toml`` as checked, frozen models. Reads TOML and CSV, never a log."""

from tdacoustic.campaign.calibration import CalibrationParameter, CalibrationSettings, LevelKind
from tdacoustic.campaign.channels import CampaignChannel
from tdacoustic.campaign.judgements import Exclude, Level, Override
from tdacoustic.campaign.load import load_campaign
from tdacoustic.campaign.model import SCHEMA, Campaign
from tdacoustic.campaign.railway import RailwaySettings
from tdacoustic.campaign.runs import CampaignRun
from tdacoustic.campaign.scale import Scale
from tdacoustic.campaign.settings import AnalysisSettings
from tdacoustic.campaign.values import WrittenPath
from tdacoustic.toml_models import legal_name, name_problem

__all__ = [
    "SCHEMA",
    "AnalysisSettings",
    "CalibrationParameter",
    "CalibrationSettings",
    "Campaign",
    "CampaignChannel",
    "CampaignRun",
    "Exclude",
    "Level",
    "LevelKind",
    "Override",
    "RailwaySettings",
    "Scale",
    "WrittenPath",
    "legal_name",
    "load_campaign",
    "name_problem",
]

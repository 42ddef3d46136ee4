"""What is known of the channels' scales besides the campaign: sensor database and calibrators."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tdacoustic.campaign import CampaignChannel
from tdacoustic.ingest.known_scale import KnownScale
from tdacoustic.quality import Verdict
from tdacoustic.sensors import ChosenEntry

if TYPE_CHECKING:
    from tdacoustic.sensors.channel_calibration import ChannelCalibration

__all__ = ["CALIBRATION", "CampaignSensors", "DatabaseUse"]

CALIBRATION = "calibration"
"""Check of a channel in the runs between calibrators."""


@dataclass(frozen=True)
class DatabaseUse:
    """A channel whose sensor is in the sensor database.

    Parameters
    ----------
    channel, sensor : str
    chosen : ChosenEntry
    runs : tuple of str
        For which this calibration of the sensor holds.
    used : bool
        Whether the sensitivity comes from it; not where the campaign or the log says it.
    doubts : tuple of str
    """

    channel: str
    sensor: str
    chosen: ChosenEntry
    runs: tuple[str, ...]
    used: bool
    doubts: tuple[str, ...] = ()


@dataclass(frozen=True)
class CampaignSensors:
    """Scales of channels that do not stand in the campaign, and what calibrators say of all.

    Parameters
    ----------
    scales : mapping of str to mapping of str to KnownScale
        By run, then by channel; only where it differs from the campaign.
    calibrations : tuple of ChannelCalibration
        By series and channel.
    database : tuple of DatabaseUse
    verdicts : mapping of str to tuple of Verdict
        By run.
    problems : tuple of str
        What calibrator runs could not tell, one line each.
    """

    scales: Mapping[str, Mapping[str, KnownScale]] = field(default_factory=dict)
    calibrations: tuple[ChannelCalibration, ...] = ()
    database: tuple[DatabaseUse, ...] = ()
    verdicts: Mapping[str, tuple[Verdict, ...]] = field(default_factory=dict)
    problems: tuple[str, ...] = ()

    @property
    def any(self) -> bool:
        """Whether there is anything to be said."""
        return bool(self.calibrations or self.database or self.problems)

    def of_run(self, run: str) -> Mapping[str, KnownScale]:
        """Return the scales of a run by channel."""
        return self.scales.get(run, {})

    def scale_from(self, channel: CampaignChannel) -> str:
        """Say whence a channel's scale is, in a word or two."""
        if any(item.channel == channel.name and item.action == "set" for item in self.calibrations):
            return "calibrator"
        if any(item.channel == channel.name and item.used for item in self.database):
            return "sensor database"
        stated = channel.sensitivity or channel.full_scale or channel.unit
        return "campaign" if stated is not None else "log"

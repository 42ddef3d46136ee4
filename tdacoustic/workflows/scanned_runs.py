"""The logs of a campaign's runs, scanned once for all that asks for them."""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from tdacoustic.errors import CampaignError, TdacousticError
from tdacoustic.formats import scan
from tdacoustic.ingest.recorders import held_channels
from tdacoustic.ingest.sources import NotFoundError, find_source, log_names
from tdacoustic.recording import Log, LogChannel

if TYPE_CHECKING:
    from tdacoustic.campaign import Campaign, CampaignChannel, CampaignRun

__all__ = ["ScannedRun", "scan_runs"]


@dataclass(frozen=True)
class ScannedRun:
    """A valid run with its logs, or why they cannot be read.

    Parameters
    ----------
    run : CampaignRun
    logs : tuple of Log
        In the order of the run; none where `error` says why.
    channels : tuple of CampaignChannel
        Those that the run may have: of a calibrator run the ones that its logs hold, with its own numbers of logs.
    problems : tuple of str
        Why a calibrator run's channels cannot be told.
    error : TdacousticError or None
    """

    run: CampaignRun
    logs: tuple[Log, ...] = ()
    channels: tuple[CampaignChannel, ...] = ()
    problems: tuple[str, ...] = ()
    error: TdacousticError | None = None

    @cached_property
    def names(self) -> tuple[str, ...]:
        """What the logs are called in messages and tables."""
        return log_names(self.run, self.logs)

    def source(self, channel: CampaignChannel) -> tuple[int, int, LogChannel] | None:
        """Return log, column and source of a channel of the campaign; None where the run does not have it."""
        own = next((item for item in self.channels if item.name == channel.name), None)
        if own is None:
            return None
        try:
            found = find_source(own, self.logs)
        except (NotFoundError, CampaignError):
            return None  # said where the run is bound
        return found.log_index, found.column, self.logs[found.log_index].channels[found.column]

    @property
    def date(self) -> datetime.date | None:
        """Day of the run: as the campaign says, else the first of its logs' starts."""
        if self.run.date is not None:
            return datetime.date.fromisoformat(self.run.date)
        starts = sorted(log.start_time[:10] for log in self.logs if log.start_time)
        try:
            return datetime.date.fromisoformat(starts[0]) if starts else None
        except ValueError:
            return None


def scan_runs(campaign: Campaign) -> tuple[ScannedRun, ...]:
    """Scan the logs of all valid runs of a campaign; what cannot be read is said by the run.

    Parameters
    ----------
    campaign : Campaign
    """
    runs = [run for run in campaign.runs if run.valid]
    counted = [channel.log for channel in campaign.channels if channel.log is not None]
    recorders = max([*counted, *(len(run.logs) for run in runs if not run.is_calibration)], default=1)
    return tuple(_scanned(run, campaign.channels, recorders) for run in runs)


def _scanned(run: CampaignRun, channels: Sequence[CampaignChannel], recorders: int) -> ScannedRun:
    try:
        logs = tuple(scan(log.path) for log in run.logs)
    except TdacousticError as error:
        return ScannedRun(run, error=error)
    held = held_channels(channels, run, logs, recorders)
    return ScannedRun(run, logs, held.channels, held.problems)

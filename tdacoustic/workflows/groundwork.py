"""What must be known of a campaign's logs before its channels can be bound to them.

Logs are scanned once. What reads samples is a step: results are kept, and a campaign that asks for nothing of it pays
nothing. Clocks come first, as a calibrator run of several logs is read on its own time axis.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from tdacoustic.errors import TdacousticError
from tdacoustic.measured.run_clocks import RunClocks
from tdacoustic.measured.run_sensors import CampaignSensors

if TYPE_CHECKING:
    from tdacoustic.campaign import Campaign
    from tdacoustic.steps import Jobs, Progress, Record, Store
    from tdacoustic.workflows.scanned_runs import ScannedRun

__all__ = ["Groundwork", "lay_groundwork"]


@dataclass(frozen=True)
class Groundwork:
    """What is known of the logs before channels are bound.

    Parameters
    ----------
    clocks : mapping of str to RunClocks
        By run of several logs: how each log's time lies on the run's axis.
    failed : mapping of str to TdacousticError
        By run, why it cannot be bound.
    records : mapping of str to Record
        By key, of the steps that were needed.
    sensors : CampaignSensors
        Scales from a sensor database and from calibrators.
    scanned : tuple of ScannedRun
        All valid runs of the campaign: their logs are scanned once, here.
    """

    clocks: Mapping[str, RunClocks] = field(default_factory=dict)
    failed: Mapping[str, TdacousticError] = field(default_factory=dict)
    records: Mapping[str, Record] = field(default_factory=dict)
    sensors: CampaignSensors = field(default_factory=CampaignSensors)
    scanned: tuple[ScannedRun, ...] = ()

    def with_failed(self, failed: Mapping[str, TdacousticError]) -> Groundwork:
        """Return it with further runs that cannot be used."""
        return replace(self, failed={**self.failed, **failed})


def lay_groundwork(
    campaign: Campaign, store: Store, n_jobs: Jobs | None = None, progress: Progress | None = None
) -> Groundwork:
    """Find out what binding the campaign's channels rests on.

    Parameters
    ----------
    campaign : Campaign
    store : Store
    n_jobs : int or Executor, optional
        Processes; default 1.
    progress : callable, optional

    Returns
    -------
    Groundwork
        A run of which something cannot be found does not stop the others.
    """
    from tdacoustic.workflows.calibrators import campaign_sensors
    from tdacoustic.workflows.clocks import campaign_clocks
    from tdacoustic.workflows.scanned_runs import scan_runs

    scanned = scan_runs(campaign)
    clocks = campaign_clocks(campaign, scanned, store, n_jobs, progress)
    sensors, records = campaign_sensors(campaign, scanned, clocks, store, n_jobs, progress)
    return Groundwork(clocks.runs, clocks.failed, {**records, **clocks.records}, sensors, scanned)

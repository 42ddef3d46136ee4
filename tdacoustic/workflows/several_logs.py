"""A run of several logs, as those see it who put the logs on one time axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tdacoustic.ingest.stamps import Stamp, parse_stamp
from tdacoustic.recording import Log

if TYPE_CHECKING:
    from tdacoustic.campaign import CampaignRun
    from tdacoustic.workflows.scanned_runs import ScannedRun

__all__ = ["SeveralLogs"]


@dataclass(frozen=True)
class SeveralLogs:
    """A view of a run of several logs.

    Parameters
    ----------
    scanned : ScannedRun
    """

    scanned: ScannedRun

    @property
    def run(self) -> CampaignRun:
        """As the campaign has it."""
        return self.scanned.run

    @property
    def logs(self) -> tuple[Log, ...]:
        """In the order of the run."""
        return self.scanned.logs

    @property
    def reference(self) -> int:
        """Position of the log whose clock counts, from 0."""
        return (self.run.reference_log or 1) - 1

    @property
    def others(self) -> tuple[int, ...]:
        """Positions of the other logs."""
        return tuple(index for index in range(len(self.logs)) if index != self.reference)

    def name(self, index: int) -> str:
        """Return what a log is called."""
        return self.scanned.names[index]

    @property
    def needs_axis(self) -> bool:
        """Whether anything rests on the logs' common axis; of a calibrator run only a cut does."""
        return not self.run.is_calibration or self.run.start_s is not None or self.run.end_s is not None

    def stamps(self) -> list[Stamp | None]:
        """Return when each log says that it starts, where it says so."""
        return [None if log.start_time is None else parse_stamp(log.start_time) for log in self.logs]

    def rate(self, index: int, column: int) -> float | None:
        """Return the sampling rate of a log's channel in Hz, as the log or else its run states it."""
        return self.logs[index].channels[column].raster.sample_rate_hz or self.run.sample_rate_hz

    def span_s(self, index: int) -> tuple[float, float]:
        """Return first and last instant of a log's samples after its own start."""
        rasters = [channel.raster for channel in self.logs[index].channels]
        rates = [self.rate(index, column) for column in range(len(rasters))]
        ends = [r.start_s + r.n_samples / rate for r, rate in zip(rasters, rates, strict=True) if rate is not None]
        return min((r.start_s for r in rasters), default=0.0), max(ends, default=0.0)

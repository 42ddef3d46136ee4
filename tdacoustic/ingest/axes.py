"""Where each log's own time lies on the axis of its run."""

from __future__ import annotations

from dataclasses import dataclass, replace

from tdacoustic.recording import Raster

__all__ = ["LogAxis", "RunAxes"]


@dataclass(frozen=True)
class LogAxis:
    """An affine map of a log's own time u to the run's time: ``t = start_s + u / rate_factor``.

    Parameters
    ----------
    start_s : float
        Instant on the run's axis at which the log starts.
    rate_factor : float
        True sampling rate over the stated one, by the reference log's clock.
    words : str
        What is done to the log's time, in words; empty where nothing is.
    """

    start_s: float = 0.0
    rate_factor: float = 1.0
    words: str = ""

    def raster(self, raster: Raster, sample_rate_hz: float) -> tuple[Raster, float]:
        """Return a raster of the log and its rate by the run's clock; both as they are where nothing is done."""
        if self.start_s == 0.0 and self.rate_factor == 1.0:
            return raster, sample_rate_hz
        return replace(raster, start_s=self.start_s + raster.start_s / self.rate_factor), (
            sample_rate_hz * self.rate_factor
        )


@dataclass(frozen=True)
class RunAxes:
    """The axes of a run's logs.

    Parameters
    ----------
    reference : int
        Position of the log whose own time is the run's, from 0.
    axes : tuple of LogAxis
        In the order of the logs.
    warnings : tuple of str
        What is doubtful about them; instead of the warning of starts that differ.
    """

    reference: int
    axes: tuple[LogAxis, ...]
    warnings: tuple[str, ...] = ()

"""How the logs of a run lie on one time axis, and how that is known."""

from __future__ import annotations

from dataclasses import dataclass, field

from tdacoustic.clocks import ClockEstimate
from tdacoustic.ingest.axes import RunAxes
from tdacoustic.quality import Verdict

__all__ = ["LogClock", "RunClocks"]


@dataclass(frozen=True)
class LogClock:
    """One log's clock against the reference log's.

    Parameters
    ----------
    log, reference_log : str
        File names, or where two logs of the run share one, their paths as the campaign has them.
    method : str
        ``"start"``, ``"time_stamps"`` or ``"shared"``.
    offset_s : float
        Instant on the run's axis at which the log starts.
    offset_error_s : float or None
        One standard error; None where nothing tells it.
    drift_ppm, drift_error_ppm : float or None
        None where it is not known, and not corrected.
    sample_rate_hz : float or None
        Of the shared channel, as stated: what a sample is.
    estimate : ClockEstimate or None
        Of a shared signal.
    doubts : tuple of str
    """

    log: str
    reference_log: str
    method: str
    offset_s: float = 0.0
    offset_error_s: float | None = None
    drift_ppm: float | None = None
    drift_error_ppm: float | None = None
    sample_rate_hz: float | None = None
    estimate: ClockEstimate | None = None
    doubts: tuple[str, ...] = ()


@dataclass(frozen=True)
class RunClocks:
    """The clocks of a run's logs.

    Parameters
    ----------
    run : str
    method : str
    clocks : tuple of LogClock
        Of every log but the reference.
    axes : RunAxes or None
        None where the logs are taken as started together: nothing is changed then.
    verdicts : tuple of Verdict
    """

    run: str
    method: str
    clocks: tuple[LogClock, ...]
    axes: RunAxes | None = None
    verdicts: tuple[Verdict, ...] = field(default=())

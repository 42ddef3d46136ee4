"""Which samples of a raster lie in a run's cut."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tdacoustic.recording import Raster

__all__ = ["Cut", "cut_raster"]

_SAMPLE_TOLERANCE = 1e-6
"""Part of a sample by which an instant may miss it and still be it (rounding of decimal seconds)."""


@dataclass(frozen=True)
class Cut:
    """The samples of a channel that belong to a run.

    Parameters
    ----------
    start_sample, n_samples : int
    start_s : float
        Instant of the first one on the run's time axis, whose zero is the logs' start.
    warnings : tuple of str
    """

    start_sample: int
    n_samples: int
    start_s: float
    warnings: tuple[str, ...] = ()


def cut_raster(raster: Raster, sample_rate_hz: float, start_s: float | None, end_s: float | None) -> Cut:
    """Cut a raster to the samples at instants t with ``start_s <= t < end_s``.

    Parameters
    ----------
    raster : Raster
        Its own `start_s` counts.
    sample_rate_hz : float
    start_s, end_s : float or None
        From the run's common start; None leaves that end as it is.

    Returns
    -------
    Cut
        Possibly without samples. Cut ends that the log does not reach by more than
        a sample are warned of.

    Examples
    --------
    >>> cut_raster(Raster(100.0, 1000), 100.0, 1.0, 3.0)
    Cut(start_sample=100, n_samples=200, start_s=1.0, warnings=())
    """
    warnings = []
    log_end_s = raster.start_s + raster.n_samples / sample_rate_hz
    first, stop = 0, raster.n_samples
    if start_s is not None:
        wanted = math.ceil((start_s - raster.start_s) * sample_rate_hz - _SAMPLE_TOLERANCE)
        if wanted < -1:
            warnings.append(
                f"start_s = {start_s:g}, but the samples begin at {raster.start_s:g} s; what there is is used"
            )
        first = min(max(wanted, 0), raster.n_samples)
    if end_s is not None:
        wanted = math.ceil((end_s - raster.start_s) * sample_rate_hz - _SAMPLE_TOLERANCE)
        if wanted > raster.n_samples + 1:
            warnings.append(f"end_s = {end_s:g}, but the samples end at {log_end_s:g} s; what there is is used")
        stop = max(min(wanted, raster.n_samples), first)
    return Cut(first, stop - first, raster.start_s + first / sample_rate_hz, tuple(warnings))

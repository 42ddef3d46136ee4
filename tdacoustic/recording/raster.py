"""A raster: the equidistant instants at which a channel was sampled."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tdacoustic.errors import FormatError

__all__ = ["Raster"]


@dataclass(frozen=True)
class Raster:
    """Sampling rate, number of samples and start of a channel.

    Parameters
    ----------
    sample_rate_hz : float or None
        None where the log does not say; it then has to come from the campaign.
    n_samples : int
        Samples that the file really holds.
    start_s : float
        Instant of the first sample after the start of the log.
    sample_rate_raw_hz : float or None
        The rate as the file gives it, where it was a hair off a round number
        because of the format's rounding and has been snapped.

    Raises
    ------
    FormatError
        The rate is not positive and finite, or the number of samples is negative.
    """

    sample_rate_hz: float | None
    n_samples: int
    start_s: float = 0.0
    sample_rate_raw_hz: float | None = None

    def __post_init__(self) -> None:
        rate = self.sample_rate_hz
        if rate is not None and not (math.isfinite(rate) and rate > 0.0):
            raise FormatError(f"sample_rate_hz must be > 0, got {rate}")
        if self.n_samples < 0:
            raise FormatError(f"n_samples must be >= 0, got {self.n_samples}")

    @property
    def duration_s(self) -> float | None:
        """Length in seconds, or None without a rate."""
        return None if self.sample_rate_hz is None else self.n_samples / self.sample_rate_hz

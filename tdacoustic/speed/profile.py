"""The speed of one shaft, or of the train, over the time of a run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["SpeedProfile"]

Array = NDArray[np.float64]

STANDSTILL = {"1/s": 0.5, "m/s": 0.3}
"""A speed that stays below is a standstill (assumed: 30 rpm, 1 km/h); what it reads is the sensor's scatter."""


@dataclass(frozen=True)
class SpeedProfile:
    """Speed over time.

    Parameters
    ----------
    channel : str
        Where it comes from.
    shaft : str or None
        ``motor``, ``wheelset``; None for a train speed or where nobody says.
    si_symbol : str
        ``1/s`` (revolutions per second) or ``m/s`` (a train's speed).
    times_s : ndarray, shape (n,)
        On the run's time axis.
    speed : ndarray, shape (n,)
        In `si_symbol`; never negative for pulses.
    notes : tuple of str
        What had to be mended (missing pulses, ...), one sentence each.
    doubtful : bool
        More was mended than a tacho in order needs.
    """

    channel: str
    shaft: str | None
    si_symbol: str
    times_s: Array
    speed: Array
    notes: tuple[str, ...] = ()
    doubtful: bool = False

    @property
    def mean(self) -> float:
        """Mean over the run."""
        return float(np.mean(self.speed))

    @property
    def stands(self) -> bool:
        """Whether nothing moves: the 95th percentile of the speed's magnitude is that of a standstill."""
        return float(np.percentile(np.abs(self.speed), 95.0)) < STANDSTILL.get(self.si_symbol, 0.0)

    @property
    def variation(self) -> float:
        """Relative width between the 5th and the 95th percentile; 0 at a standstill."""
        if self.stands:
            return 0.0
        low, middle, high = np.percentile(self.speed, [5.0, 50.0, 95.0])
        return float((high - low) / abs(middle)) if middle else float("inf")

    def is_constant(self, tolerance: float) -> bool:
        """Whether the speed varies by no more than a relative tolerance."""
        return self.variation <= tolerance

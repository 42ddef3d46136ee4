"""The speed of one shaft, or of the train, over the time of a run."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.errors import AnalysisError

__all__ = ["SpeedProfile"]

Array = NDArray[np.float64]

LEAST_HOLE_S: Final = 0.25
"""Shortest time at the start or the end of a run without a speed that is said [assumed]."""
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
    error : ndarray, shape (n,), or None
        Standard error of each value, in `si_symbol`; None where nobody estimated it.
    confidence : ndarray, shape (n,), or None
        Probability that a value is of the right line, of a speed that was read from lines (0 to 1); None for others.
    unknown : tuple of (float, float, str)
        Spans of time in s within which the speed is not known, and why; no value lies inside of one.
    source : str
        ``"tacho"``, ``"channel"`` (that carries the speed as a value), or ``"lines"`` of vibration.
    faults : tuple of str
        Those of the notes that say that something is wrong.
    """

    channel: str
    shaft: str | None
    si_symbol: str
    times_s: Array
    speed: Array
    notes: tuple[str, ...] = ()
    doubtful: bool = False
    error: Array | None = None
    confidence: Array | None = None
    unknown: tuple[tuple[float, float, str], ...] = ()
    source: Literal["tacho", "channel", "lines"] = "channel"
    faults: tuple[str, ...] = ()

    def speed_at(self, times_s: ArrayLike) -> Array:
        """Return the speed at instants, any shape, linear between values.

        NaN where it is not known: before the first and after the last value, and inside of `unknown`. A value stands
        for an interval, so the first and the last one hold for half a step beyond it.
        """
        times = np.asarray(times_s, dtype=np.float64)
        if self.times_s.size == 0:
            return np.full(times.shape, np.nan)
        half = 0.5 * self.step_s
        speed = np.interp(times, self.times_s, self.speed)
        known = (times >= self.times_s[0] - half) & (times <= self.times_s[-1] + half)
        for first, last, _ in self.unknown:
            known &= (times <= first) | (times >= last)
        return np.where(known, speed, np.nan)

    @property
    def step_s(self) -> float:
        """Usual time between two values."""
        return float(np.median(np.diff(self.times_s))) if self.times_s.size > 1 else 0.0

    def known_share(self, first_s: float, last_s: float) -> float:
        """Return the part of a span of time within which the speed is known."""
        if self.times_s.size == 0 or not last_s > first_s:
            return 0.0
        half = 0.5 * self.step_s
        low, high = max(first_s, float(self.times_s[0]) - half), min(last_s, float(self.times_s[-1]) + half)
        lost = sum(max(0.0, min(high, last) - max(low, first)) for first, last, _ in self.unknown)
        return min(1.0, max(0.0, high - low - lost) / (last_s - first_s))

    def within(self, first_s: float, last_s: float) -> SpeedProfile:
        """Return the speed of a span of time alone, with what of it is not known.

        Raises
        ------
        AnalysisError
            No value lies in it.
        """
        inside = (self.times_s >= first_s) & (self.times_s <= last_s)
        what = "tacho" if self.source == "tacho" else "speed channel"
        if not inside.any():
            begins, ends = (float(self.times_s[at]) if self.times_s.size else np.nan for at in (0, -1))
            raise AnalysisError(
                f"{what} {self.channel!r} tells the speed from {begins:.2f} s to {ends:.2f} s alone, "
                f"outside of the signals' time from {first_s:.2f} s to {last_s:.2f} s"
            )
        times = self.times_s[inside]
        slack = max(LEAST_HOLE_S, 3.0 * self.step_s)
        found = [(max(first, first_s), min(last, last_s), why) for first, last, why in self.unknown]
        found = [span for span in found if span[1] > span[0]]
        notes: list[str] = []
        for first, last in ((first_s, float(times[0])), (float(times[-1]), last_s)):
            if last - first > slack and not any(
                low <= first + slack and high >= last - slack for low, high, _ in found
            ):
                found.append((first, last, f"the {what} says nothing"))
                notes.append(f"not known from {first:.2f} s to {last:.2f} s: the {what} says nothing there")
        return replace(
            self,
            times_s=times,
            speed=self.speed[inside],
            error=None if self.error is None else self.error[inside],
            confidence=None if self.confidence is None else self.confidence[inside],
            unknown=tuple(sorted(found)),
            notes=(*self.notes, *notes),
            faults=(*self.faults, *notes),
            doubtful=self.doubtful or bool(notes),
        )

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

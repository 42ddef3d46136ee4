"""Speed from a channel that carries it as a value."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from tdacoustic.errors import AnalysisError
from tdacoustic.speed.profile import STANDSTILL, SpeedProfile

__all__ = ["SpeedChannelMeter"]

Array = NDArray[np.float64]

ROUNDING = 1e-9
"""Relative difference of two samples that is none."""


class SpeedChannelMeter:
    """Averages a speed channel over intervals, block by block.

    Parameters
    ----------
    sample_rate_hz : float
    interval_s : float
        Time between two values of the result.
    """

    def __init__(self, sample_rate_hz: float, interval_s: float = 0.05) -> None:
        self._rate_hz = sample_rate_hz
        self._size = max(1, round(interval_s * sample_rate_hz))
        self._pending = np.zeros(0)
        self._means: list[Array] = []
        self._resolution = np.inf

    def take(self, values: Array) -> None:
        """Add samples, shape (n,), in order."""
        data = np.concatenate((self._pending, values))
        whole = data.size - data.size % self._size
        steps = np.abs(np.diff(data))
        steps = steps[steps > ROUNDING * np.abs(data[1:])]
        self._resolution = min(self._resolution, float(np.min(steps, initial=np.inf)))
        if whole:
            self._means.append(data[:whole].reshape(-1, self._size).mean(axis=1))
        self._pending = data[whole:]

    def result(self) -> tuple[Array, Array]:
        """Return times after the first sample in s, and the mean speed around each; intervals with NaN left out."""
        means = np.concatenate(self._means) if self._means else np.zeros(0)
        size = self._size
        if means.size == 0 and self._pending.size:
            size, means = self._pending.size, np.array([self._pending.mean()])
        times = (np.arange(means.size, dtype=np.float64) * size + 0.5 * (size - 1)) / self._rate_hz
        finite = np.isfinite(means)
        return times[finite], np.asarray(means[finite], dtype=np.float64)

    def profile(self, name: str, shaft: str | None, si_symbol: str, start_s: float = 0.0) -> SpeedProfile:
        """Return the speed on the run's time axis, on which the first sample is at `start_s`.

        Its error is the scatter of its values, at least that of rounding to the smallest step between two samples; None
        where these never differ, so that nothing tells it. Where the channel holds no numbers for a while, the speed is
        not known.

        Raises
        ------
        AnalysisError
            A channel without any number.
        """
        times, values = self.result()
        if values.size == 0:
            raise AnalysisError(f"speed channel {name!r} holds no numbers")
        step = self._size / self._rate_hz
        holes = np.flatnonzero(np.diff(times) > 1.5 * step)
        unknown = tuple(
            (start_s + float(times[at]), start_s + float(times[at + 1]), "the channel holds no numbers") for at in holes
        )
        faults = tuple(f"not known from {first:.2f} s to {last:.2f} s: {why}" for first, last, why in unknown)
        notes = list(faults)
        turned = np.sign(values[np.abs(values) > STANDSTILL.get(si_symbol, 0.0)])
        if turned.size and turned.min() < 0.0 < turned.max():
            notes.append("its sign changes: the direction is turned round")
        return SpeedProfile(
            name,
            shaft,
            si_symbol,
            start_s + times,
            values,
            tuple(notes),
            doubtful=bool(unknown),
            error=self._error(times, values),
            unknown=unknown,
            faults=faults,
        )

    def _error(self, times: Array, values: Array) -> Array | None:
        scatter = _scatter(times, values)
        if scatter is None or not np.isfinite(self._resolution):
            return None
        return np.hypot(scatter, self._resolution / np.sqrt(12.0))


def _scatter(times: Array, values: Array) -> Array | None:
    """Standard error of each value by its distance from the line between its neighbours, robust over nine of them."""
    if values.size < 9:
        return None
    part = (times[1:-1] - times[:-2]) / (times[2:] - times[:-2])
    off = np.abs(values[1:-1] - (values[:-2] + part * (values[2:] - values[:-2])))
    # Of independent values that distance has the variance 1 + 1/4 + 1/4.
    usual = 1.4826 * ndimage.median_filter(off, 9, mode="nearest") / np.sqrt(1.5)
    return np.concatenate((usual[:1], usual, usual[-1:]))

"""From a rough path of a speed to an exact one: spectra on the shaft's angle, and the peak of the comb between bins."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from tdacoustic.speed.comb import CombOrder
from tdacoustic.speed.comb_path import TEMPER, likeliest, moves

__all__ = ["RidgeRefinement", "smoothed_path"]

Array = NDArray[np.float64]

PAD: Final = 4
"""Bins of a refined spectrum per line spacing."""
FINE: Final = 81
"""Speeds that are tried around the path."""
SLOPES: Final = (-1.0, -0.5, 0.0, 0.5, 1.0)
"""Changes of acceleration that are tried, in units that move the middle order by a bin in half a frame."""
ROUGH_S: Final = 0.4
"""Standard deviation of the smoothing of the rough path [assumed]: it has the steps of its grid."""
WANDER_PART: Final = 0.5
"""Acceleration that the rough path may have missed, over the greatest one [assumed]."""
OUTLIER: Final = 4.0
MOST_FRAMES: Final = 20000
STANDS_OUT: Final = 4.0
"""Power over floor, mean of the channels, from which an order adds to what is known of the speed [assumed]."""
CONTRAST: Final = 2.0
"""Peak of the comb over its tenth percentile beside the path, over the root of the number of orders, from which a frame
tells a speed [tests/evidence, tuning seeds]; of floor alone it is about 1.8."""
PEAK_ERROR: Final = 0.6
"""Standard error of a line's frequency times frame length and root of power over floor [tests/evidence, tuning seeds];
Cramér and Rao's bound is sqrt(6)/(2 pi) = 0.39 of a rectangular window."""


class RidgeRefinement:
    """Measures the speed in frames along a known path, block by block.

    Each frame is resampled to even steps of the angle that the path and its slope say, so that orders become lines
    again; the sum of ln(1 + power over floor) at all orders is followed over time like the rough path, and its peak
    interpolated between the speeds that were tried.

    Parameters
    ----------
    times_s, speeds_hz : ndarray
        The rough path.
    orders : sequence of CombOrder
        Exact ones (`reach` 0) are used.
    frame_s : float
    reach_hz : float
        Half width around the path within which the speed is sought.
    acceleration_hz_s : float
    sample_rate_hz : float
    n_samples : int
    top_hz : float
    """

    def __init__(
        self,
        times_s: Array,
        speeds_hz: Array,
        orders: Sequence[CombOrder],
        frame_s: float,
        reach_hz: float,
        acceleration_hz_s: float,
        sample_rate_hz: float,
        n_samples: int,
        top_hz: float,
    ) -> None:
        self._rate_hz, self._top_hz, self._limit = sample_rate_hz, top_hz, acceleration_hz_s
        self._length = min(2 * round(0.5 * frame_s * sample_rate_hz), n_samples)
        self._hop = max(self._length // 4, math.ceil((n_samples - self._length + 1) / MOST_FRAMES))
        self._starts = np.arange(0, n_samples - self._length + 1, self._hop)
        self._times_s: Array = (self._starts + 0.5 * (self._length - 1)) / np.float64(sample_rate_hz)
        smooth, _ = smoothed_path(times_s, speeds_hz, np.ones(times_s.size), ROUGH_S)
        self._speeds = np.interp(self._times_s, times_s, smooth)
        self._slopes = np.interp(self._times_s, times_s, np.gradient(smooth, times_s))
        self._tried = np.linspace(-reach_hz, reach_hz, FINE)
        self._orders = np.array([item.order for item in orders if item.reach == 0.0])
        self._window = np.hanning(self._length + 1)[:-1]
        self._even = (np.arange(self._length) - 0.5 * (self._length - 1)) / sample_rate_hz
        self._counts = np.array([int(np.sum(self._orders * speed <= top_hz)) for speed in self._speeds])
        self._pending: Array | None = None
        self._first, self._next = 0, 0
        self._merits: list[Array] = []
        self._information: list[Array] = []

    def take(self, values: Array) -> None:
        """Add samples, shape (n_channels, n), in order."""
        data = values if self._pending is None else np.concatenate((self._pending, values), axis=1)
        while self._next < self._starts.size:
            start = int(self._starts[self._next]) - self._first
            if start + self._length > data.shape[1]:
                break
            self._measure(np.nan_to_num(data[:, start : start + self._length]), self._next)
            self._next += 1
        start = int(self._starts[self._next]) if self._next < self._starts.size else self._first + data.shape[1]
        drop = min(max(0, start - self._first), data.shape[1])
        self._pending, self._first = data[:, drop:].copy(), self._first + drop

    def result(self) -> tuple[Array, Array, Array]:
        """Return the frames' middles in s, their speeds, and standard errors, infinite where nothing stands out."""
        merits, information = np.array(self._merits), np.array(self._information)
        frames = merits.shape[0]
        step = float(self._tried[1] - self._tried[0])
        if frames == 0:
            return self._times_s[:0], np.zeros(0), np.zeros(0)
        kernel = moves(WANDER_PART * self._limit * self._hop / self._rate_hz, step, FINE)
        _, path = likeliest(TEMPER * merits, kernel)
        rows, inner = np.arange(frames), np.clip(path, 1, FINE - 2)
        below, top, above = (merits[rows, inner + beside] for beside in (-1, 0, 1))
        bend = below - 2.0 * top + above
        peaks = (bend < 0.0) & (top >= below) & (top >= above)
        moved = np.where(peaks, 0.5 * (below - above) / np.where(peaks, bend, -1.0), 0.0)
        speeds = self._speeds[:frames] + self._tried[inner] + moved * step
        contrast = (top - np.percentile(merits, 10.0, axis=1)) / np.sqrt(np.maximum(self._counts[:frames], 1))
        known = peaks & (information[rows, inner] > 0.0) & (contrast > CONTRAST)
        errors = np.where(known, PEAK_ERROR / np.sqrt(np.where(known, information[rows, inner], 1.0)), math.inf)
        return self._times_s[:frames], speeds, errors

    def _measure(self, frames: Array, index: int) -> None:
        speed, slope = float(self._speeds[index]), float(self._slopes[index])
        merit, information = np.full(FINE, -math.inf), np.zeros(FINE)
        orders = self._orders[(self._orders * speed <= self._top_hz) & (speed > 0.0)]
        length_s = self._length / self._rate_hz
        unit = 4.0 / (max(1.0, float(np.median(orders)) if orders.size else 1.0) * length_s**2)
        for part in SLOPES if orders.size else ():
            found, power = self._merit(frames, speed, slope + part * unit, orders, speed + self._tried)
            stands = np.where(power > STANDS_OUT, np.minimum(power, 100.0), 0.0)
            better = found > merit
            merit = np.where(better, found, merit)
            information = np.where(better, np.sum((orders[:, None] * length_s) ** 2 * stands, axis=0), information)
        self._merits.append(merit if orders.size else np.zeros(FINE))
        self._information.append(information)

    def _merit(
        self, frames: Array, speed: float, slope: float, orders: Array, speeds: Array
    ) -> tuple[Array, NDArray[np.float64]]:
        """Sum over orders of ln(1 + power over floor), and the mean power of channels, shape (orders, speeds)."""
        rate = slope / speed
        # Angle over speed: t + rate t²/2; where it is even, orders are lines at order x speed.
        inner = np.maximum(1.0 + 2.0 * rate * self._even, 0.0)
        warped = self._even if abs(rate) < 1e-9 else (np.sqrt(inner) - 1.0) / rate
        total = np.zeros((orders.size, speeds.size))
        bin_hz = self._rate_hz / (PAD * self._length)
        bins = math.ceil(self._top_hz / bin_hz) + 2
        for signal in frames:
            even = np.interp(warped, self._even, signal) * self._window
            power = np.abs(np.fft.rfft(even, PAD * self._length)[:bins]) ** 2
            floor = ndimage.uniform_filter1d(_floor_of(power), 4 * PAD + 1)
            over = power / np.maximum(floor, 1e-12 * power.max() + np.finfo(float).tiny)
            at = np.clip(orders[:, None] * speeds[None, :] / bin_hz, 0.0, power.size - 1.0)
            low = np.minimum(at.astype(np.intp), power.size - 2)
            total += over[low] + (at - low) * (over[low + 1] - over[low])
        return np.log1p(total).sum(axis=0), total / frames.shape[0]


def _floor_of(power: Array) -> Array:
    """Mean power of the floor around each bin of a padded spectrum."""
    thinned = power[:: PAD // 2]
    middle = ndimage.median_filter(thinned, 81, mode="nearest") / math.log(2.0)
    return np.asarray(np.interp(np.arange(power.size), np.arange(thinned.size) * (PAD // 2), middle))


def smoothed_path(times_s: Array, speeds_hz: Array, errors_hz: Array, spread_s: float) -> tuple[Array, Array]:
    """Return a local straight line through speeds, weighted by their errors, at the same instants, and its standard
    error.

    What lies apart from its neighbours' median by more than four times the usual is left out.

    Parameters
    ----------
    times_s, speeds_hz, errors_hz : ndarray, shape (n,)
        Errors infinite where there is no value.
    spread_s : float
        Standard deviation of the Gaussian weight over time.
    """
    known = np.isfinite(errors_hz)
    if known.sum() < 3:
        return speeds_hz.copy(), np.full(speeds_hz.size, math.inf)
    middle = np.interp(times_s, times_s[known], ndimage.median_filter(speeds_hz[known], 7, mode="nearest"))
    off = np.abs(speeds_hz - middle)
    usual = 1.4826 * float(np.median(off[known])) + 1e-12
    known &= off <= OUTLIER * np.maximum(usual, errors_hz)
    weight = np.where(known, 1.0 / np.where(known, np.maximum(errors_hz, 0.3 * usual), 1.0) ** 2, 0.0)
    smooth, error = np.empty(times_s.size), np.full(times_s.size, math.inf)
    for index, instant in enumerate(times_s):
        near = slice(*np.searchsorted(times_s, (instant - 3.5 * spread_s, instant + 3.5 * spread_s)))
        offset = times_s[near] - instant
        part = weight[near] * np.exp(-0.5 * (offset / spread_s) ** 2)
        s0, s1, s2 = (float(np.sum(part * offset**power)) for power in range(3))
        determinant = s0 * s2 - s1 * s1
        if s0 <= 0.0 or determinant <= 1e-9 * s0 * s2:
            smooth[index] = middle[index]
            continue
        lever = part * (s2 - s1 * offset) / determinant
        smooth[index] = float(np.sum(lever * speeds_hz[near]))
        error[index] = math.sqrt(float(np.sum(lever**2 / np.where(weight[near] > 0.0, weight[near], 1.0))))
    return smooth, error

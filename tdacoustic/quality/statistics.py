"""What one pass over the samples shows of a channel's health."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tdacoustic.quality.covariance import Covariance

__all__ = ["Statistics", "StatisticsMeter"]

Array = NDArray[np.float64]
Counts = NDArray[np.int64]

FLAT_S = 5e-3
FLAT_SAMPLES = 16
"""A stretch of identical values is flat from this long on, and from this many samples on."""

PLATEAU_SAMPLES = 3
"""Identical values in a row at a record's extreme from which it is clipped."""

PILE_SAMPLES = 8
"""Samples at a record's extreme, in a row or not, from which it is clipped: noise that is cut has no long plateaus."""

PLATEAU_OVER_NEXT = 4
"""Samples on a plateau over those at the next value, at least: the crest of a sine in whole numbers has up to 2.4."""


@dataclass(frozen=True)
class Statistics:
    """Statistics of the channels of one raster, arrays of shape (n_channels,) unless said otherwise.

    Parameters
    ----------
    n_samples : int
        Samples seen.
    missing : ndarray of int
        Samples that are no finite numbers.
    mean, mean_square : ndarray
        Of the finite samples; the mean square is about the mean.
    minimum, maximum : ndarray
    at_limits : ndarray of int
        Samples at the smallest or largest value the logger can store.
    plateau : ndarray of int
        Samples at the record's own extremes, where these are a plateau or a pile (`PLATEAU_SAMPLES`, `PILE_SAMPLES`).
    flat_samples, longest_flat : ndarray of int
        Samples in flat stretches, and the longest stretch.
    correlation : ndarray, shape (n_channels, n_channels)
        Normalised correlation at lag zero.
    """

    n_samples: int
    missing: Counts
    mean: Array
    mean_square: Array
    minimum: Array
    maximum: Array
    at_limits: Counts
    plateau: Counts
    flat_samples: Counts
    longest_flat: Counts
    correlation: Array


class _Plateau:
    """Counts samples at the extreme seen so far, on one side, those in runs, and those at the value next to it."""

    def __init__(self) -> None:
        self.extreme = self.second = -math.inf
        self._in_runs = 0
        self._at_extreme = 0
        self._at_second = 0

    @property
    def count(self) -> int:
        """Samples at the extreme; none where the value next to it is nearly as frequent: a rounded crest."""
        clipped = self._in_runs >= PLATEAU_SAMPLES or self._at_extreme >= PILE_SAMPLES
        return self._at_extreme if clipped and self._at_extreme > PLATEAU_OVER_NEXT * self._at_second else 0

    def take(self, values: Array, top: float) -> None:
        if not math.isfinite(top) or top < self.second:
            return
        if top > self.extreme:
            self.second, self._at_second = self.extreme, self._at_extreme
            self.extreme, self._at_extreme, self._in_runs = top, 0, 0
        if top == self.extreme:
            at_top = values == top
            self._at_extreme += int(np.count_nonzero(at_top))
            self._in_runs += _in_runs(at_top)
        below = float(np.max(values, where=values < self.extreme, initial=-math.inf))
        if below > self.second:
            self.second, self._at_second = below, 0
        if math.isfinite(below) and below == self.second:
            self._at_second += int(np.count_nonzero(values == below))


def _in_runs(chosen: NDArray[np.bool_]) -> int:
    """Samples in runs of at least `PLATEAU_SAMPLES`."""
    if int(np.count_nonzero(chosen)) < PLATEAU_SAMPLES:
        return 0
    edges = np.flatnonzero(np.diff(np.concatenate(([False], chosen, [False]))))
    lengths = edges[1::2] - edges[0::2]
    return int(lengths[lengths >= PLATEAU_SAMPLES].sum())


class _Flats:
    """Counts stretches of identical values across blocks."""

    def __init__(self, shortest: int) -> None:
        self._shortest = shortest
        self._last = math.nan
        self._run = 1
        self.samples = 0
        self.longest = 0

    def take(self, values: Array) -> None:
        if values.size == 0:
            return
        changed = np.empty(values.size, dtype=bool)
        changed[0] = values[0] != self._last
        np.not_equal(values[1:], values[:-1], out=changed[1:])
        same = values.size - int(np.count_nonzero(changed))
        if same + self._run < self._shortest:  # no stretch long enough can end or lie in this block
            last_change = values.size - 1 - int(np.argmax(changed[::-1])) if same < values.size else -1
            self._run = values.size - last_change if last_change >= 0 else self._run + values.size
            self._last = float(values[-1])
            return
        at = np.flatnonzero(changed)
        if at.size == 0:
            self._run += values.size
        else:
            self._close(self._run + int(at[0]))
            inner = np.diff(at)
            long = inner[inner >= self._shortest]
            if long.size:
                self.samples += int(long.sum())
                self.longest = max(self.longest, int(long.max()))
            self._run = values.size - int(at[-1])
        self._last = float(values[-1])

    def _close(self, run: int) -> None:
        if run >= self._shortest:
            self.samples += run
            self.longest = max(self.longest, run)

    def finish(self) -> None:
        self._close(self._run)
        self._run = 0


class StatisticsMeter:
    """Takes blocks of samples and gathers `Statistics`.

    Parameters
    ----------
    sample_rate_hz : float
    limits : sequence of (float, float) or None
        One entry a channel: what the logger can store.
    """

    def __init__(self, sample_rate_hz: float, limits: tuple[tuple[float, float] | None, ...]) -> None:
        n = len(limits)
        shortest = max(FLAT_SAMPLES, math.ceil(FLAT_S * sample_rate_hz))
        self._limits = limits
        self._flats = [_Flats(shortest) for _ in range(n)]
        self._tops = [_Plateau() for _ in range(n)]
        self._bottoms = [_Plateau() for _ in range(n)]
        self._seen = 0
        self._missing = np.zeros(n, dtype=np.int64)
        self._at_limits = np.zeros(n, dtype=np.int64)
        self._minimum = np.full(n, math.inf)
        self._maximum = np.full(n, -math.inf)
        self._squares = Covariance(n)

    def take(self, block: Array) -> None:
        """Add samples, shape (n_channels, n), in order."""
        if block.shape[1] == 0:
            return
        low, high = block.min(axis=1), block.max(axis=1)
        broken = np.flatnonzero(~np.isfinite(low) | ~np.isfinite(high))
        for channel in broken:
            finite = block[channel][np.isfinite(block[channel])]
            self._missing[channel] += block.shape[1] - finite.size
            low[channel], high[channel] = (finite.min(), finite.max()) if finite.size else (math.inf, -math.inf)
        self._minimum = np.minimum(self._minimum, low)
        self._maximum = np.maximum(self._maximum, high)
        for row, values in enumerate(block):
            limits = self._limits[row]
            if limits is not None and (low[row] <= limits[0] or high[row] >= limits[1]):
                self._at_limits[row] += int(np.count_nonzero((values <= limits[0]) | (values >= limits[1])))
            self._flats[row].take(values)
            self._tops[row].take(values, float(high[row]))
            if -low[row] >= self._bottoms[row].second:
                self._bottoms[row].take(-values, -float(low[row]))
        self._squares.take(block, whole=broken.size == 0)
        self._seen += block.shape[1]

    def result(self) -> Statistics:
        """Return the statistics of all samples taken so far."""
        for flats in self._flats:
            flats.finish()
        mean, covariance = self._squares.result()
        mean_square = np.diag(covariance).copy()
        with np.errstate(invalid="ignore", divide="ignore"):
            correlation = covariance / np.sqrt(np.outer(mean_square, mean_square))
        return Statistics(
            n_samples=self._seen,
            missing=self._missing.copy(),
            mean=mean,
            mean_square=mean_square,
            minimum=self._minimum.copy(),
            maximum=self._maximum.copy(),
            at_limits=self._at_limits.copy(),
            plateau=np.array(
                [  # a constant signal stands still; it has no extremes to be cut at
                    0 if top.extreme == -bottom.extreme else top.count + bottom.count
                    for top, bottom in zip(self._tops, self._bottoms, strict=True)
                ]
            ),
            flat_samples=np.array([flats.samples for flats in self._flats]),
            longest_flat=np.array([flats.longest for flats in self._flats]),
            correlation=correlation,
        )

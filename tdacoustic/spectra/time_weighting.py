"""Levels over time: A-weighted by a filter, with the time weightings F and S, and their maxima."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from tdacoustic.errors import AnalysisError
from tdacoustic.spectra.weighting import A_POLES_HZ, a_weighting_db

__all__ = ["TIME_CONSTANTS_S", "AWeighting", "LevelHistory", "LevelMeter", "TimeWeighting"]

Array = NDArray[np.float64]
TimeWeighting = Literal["F", "S"]

TIME_CONSTANTS_S: Final[dict[TimeWeighting, float]] = {"F": 0.125, "S": 1.0}
"""Time constants of the exponential weightings (IEC 61672-1:2013, 5.8.1)."""

SETTLING: Final = 5.0
"""A time-weighted level reads low at a record's start: less than 0.03 dB after this many time constants."""
EQUALISER_TAPS: Final = 63
"""Below 0.003 dB from the A curve to 0.45 of the rate at 51.2 kHz, 0.02 dB at 25.6 kHz; a test holds it."""
MAX_INTERVALS: Final = 1 << 16
"""Intervals of a history at most: beyond, neighbours are joined, so that memory does not depend on the length."""
LOWEST_RATE_HZ: Final = 2000.0
"""A lower rate does not hold 1 kHz, to which the A curve is referred."""


class AWeighting:
    """The A curve as a digital filter over blocks, for time-weighted levels alone.

    Four zeros at 0 Hz and the six poles of the analogue curve mapped by
    ``exp(-2 pi f / fs)``; a symmetric filter of `EQUALISER_TAPS` makes up for
    what the mapping changes, by least squares of the relative error up to half
    the rate. A filter made by the bilinear transform falls off near half the
    rate instead (0.4 dB at 12.5 kHz and 1.8 dB at 20 kHz for 51.2 kHz, even
    oversampled). On spectra use `a_weighting_db`, which is exact.

    Parameters
    ----------
    sample_rate_hz : float
        At least `LOWEST_RATE_HZ`.
    n_channels : int

    Raises
    ------
    AnalysisError
        The rate is too low.
    """

    def __init__(self, sample_rate_hz: float, n_channels: int) -> None:
        if not sample_rate_hz >= LOWEST_RATE_HZ:
            raise AnalysisError(
                f"A-weighted levels over time take a rate of at least {LOWEST_RATE_HZ:g} Hz, got {sample_rate_hz:g}"
            )
        first, second, third, fourth = (math.exp(-2.0 * math.pi * pole / sample_rate_hz) for pole in A_POLES_HZ)
        poles = (first, first, second, third, fourth, fourth)
        self._sos: Array = signal.zpk2sos(np.ones(4), poles, 1.0)
        self._taps = self._equaliser(sample_rate_hz)
        self._state: Array | None = None
        self._tail = np.zeros((n_channels, EQUALISER_TAPS - 1))

    @property
    def delay(self) -> int:
        """By how many samples the output lags."""
        return (EQUALISER_TAPS - 1) // 2

    def _equaliser(self, rate_hz: float) -> Array:
        frequencies = np.linspace(0.0, 0.5 * rate_hz, 2049)[1:]
        _, response = signal.sosfreqz(self._sos, 2.0 * np.pi * frequencies / rate_hz)
        wanted = 10.0 ** (0.05 * a_weighting_db(frequencies)) / np.abs(response)
        terms = 2.0 * np.cos(2.0 * np.pi * np.outer(frequencies / rate_hz, np.arange(self.delay + 1)))
        terms[:, 0] = 1.0
        half, *_ = np.linalg.lstsq(terms / wanted[:, None], np.ones(frequencies.size), rcond=None)
        return np.concatenate((half[:0:-1], half))

    def response_db(self, frequency_hz: Array, sample_rate_hz: float) -> Array:
        """Return the filter's own gain, for the conformance table."""
        angle = 2.0 * np.pi * np.asarray(frequency_hz) / sample_rate_hz
        gain = np.abs(signal.sosfreqz(self._sos, angle)[1]) * np.abs(signal.freqz(self._taps, 1.0, angle)[1])
        return np.asarray(20.0 * np.log10(gain))

    def take(self, block: Array) -> Array:
        """Return as many weighted samples as came, shape (n_channels, n)."""
        if block.shape[1] == 0:
            return block
        if self._state is None:  # as if the first value had stood for ever: an offset makes no onset
            rest = signal.sosfilt_zi(self._sos)
            self._state = rest[:, None, :] * block[None, :, :1]
        filtered, self._state = signal.sosfilt(self._sos, block, axis=-1, zi=self._state)
        data = np.concatenate((self._tail, filtered), axis=1)
        self._tail = data[:, data.shape[1] - (EQUALISER_TAPS - 1) :]
        return np.asarray(signal.oaconvolve(data, self._taps[None, :], mode="valid", axes=-1))


@dataclass(frozen=True)
class LevelHistory:
    """Mean squares over time, in intervals of equal length.

    Parameters
    ----------
    interval_s : float
        Length of an interval.
    weighting : "A" or "Z"
    mean_square : ndarray, shape (n_channels, n)
        Plain mean over each interval, unit².
    fast, slow : ndarray, shape (n_channels, n)
        With time weighting F and S, at the end of each interval.
    fast_max, slow_max : ndarray, shape (n_channels, n)
        Their largest value within each interval, over all samples.
    missing : ndarray of bool, shape (n_channels, n)
        The interval holds samples that were no numbers (taken as zero).
    duration_s : float
        Of the record; the last interval may be shorter.
    """

    interval_s: float
    weighting: Literal["A", "Z"]
    mean_square: Array
    fast: Array
    slow: Array
    fast_max: Array
    slow_max: Array
    missing: NDArray[np.bool_]
    duration_s: float

    @property
    def ends_s(self) -> Array:
        """End of each interval after the record's start, shape (n,)."""
        n = self.mean_square.shape[1]
        return np.minimum(self.interval_s * np.arange(1, n + 1), self.duration_s)

    def _parts(self, start_s: float, end_s: float) -> Array:
        """Seconds of each interval that lie between two instants."""
        if not 0.0 <= start_s < end_s <= self.duration_s * (1.0 + 1e-9):
            raise AnalysisError(
                f"the interval {start_s:g} to {end_s:g} s does not lie within the record of {self.duration_s:g} s"
            )
        ends = self.ends_s
        starts = np.concatenate(([0.0], ends[:-1]))
        return np.clip(np.minimum(ends, end_s) - np.maximum(starts, start_s), 0.0, None)

    def mean_square_between(self, channel: int, start_s: float, end_s: float) -> float:
        """Return the mean square between two instants; intervals at the ends count by their part inside.

        Raises
        ------
        AnalysisError
            The instants do not lie within the record.
        """
        parts = self._parts(start_s, end_s)
        return float(self.mean_square[channel] @ parts / parts.sum())

    def highest_between(self, channel: int, weighting: TimeWeighting, start_s: float, end_s: float) -> float:
        """Return the largest time-weighted mean square between two instants (whole intervals)."""
        inside = self._parts(start_s, end_s) > 0.0
        values = self.fast_max if weighting == "F" else self.slow_max
        return float(values[channel, inside].max())

    def at(self, channel: int, weighting: TimeWeighting, instant_s: float) -> float:
        """Return the time-weighted mean square at the end of the interval that an instant lies in."""
        index = min(int(instant_s / self.interval_s), self.mean_square.shape[1] - 1)
        return float((self.fast if weighting == "F" else self.slow)[channel, max(0, index)])

    def has_missing(self, channel: int, start_s: float, end_s: float) -> bool:
        """Whether samples between two instants were no numbers."""
        return bool(np.any(self.missing[channel, self._parts(start_s, end_s) > 0.0]))


class LevelMeter:
    """Takes blocks of samples and gathers their `LevelHistory`.

    The exponential average is that of the squared samples, one pole at
    ``exp(-1 / (fs tau))``; it starts at zero, so that levels read low for the
    first few time constants and never high.

    Parameters
    ----------
    sample_rate_hz : float
    n_channels : int
    weighting : "A" or "Z"
    interval_s : float
        Wanted length of an interval; whole samples, doubled as often as the
        record's length asks for (`MAX_INTERVALS`).

    Examples
    --------
    >>> import numpy as np
    >>> meter = LevelMeter(8192.0, 1, "Z")
    >>> meter.take(np.ones((1, 8192)))
    >>> round(float(meter.result().fast_max.max()), 4)
    0.9997
    """

    def __init__(
        self, sample_rate_hz: float, n_channels: int, weighting: Literal["A", "Z"] = "A", interval_s: float = 0.01
    ) -> None:
        if not interval_s > 0.0:
            raise AnalysisError(f"interval_s must be > 0, got {interval_s}")
        self._rate = sample_rate_hz
        self._weighting = weighting
        self._filter = AWeighting(sample_rate_hz, n_channels) if weighting == "A" else None
        self._skip = self._filter.delay if self._filter else 0
        self._poles = {key: math.exp(-1.0 / (sample_rate_hz * tau)) for key, tau in TIME_CONSTANTS_S.items()}
        self._states = {key: np.zeros((n_channels, 1)) for key in TIME_CONSTANTS_S}
        self._length = max(1, round(interval_s * sample_rate_hz))
        self._pending: list[Array] = []
        self._held = 0
        self._last = np.zeros((n_channels, 0))
        self._bad = np.zeros((n_channels, 0), dtype=np.bool_)
        self._rows: list[Array] = []
        self._done = 0
        self._taken = 0

    def take(self, block: Array) -> None:
        """Add samples, shape (n_channels, n), in order."""
        if block.shape[1] == 0:
            return
        bad = ~np.isfinite(block)
        clean = np.where(bad, 0.0, block) if bad.any() else block
        self._taken += block.shape[1]
        self._bad = np.concatenate((self._bad, bad), axis=1)
        self._last = clean[:, -1:]
        self._weigh(clean)

    def _weigh(self, samples: Array) -> None:
        weighted = self._filter.take(samples) if self._filter else samples
        dropped = min(self._skip, weighted.shape[1])
        self._skip -= dropped
        self._pending.append(weighted[:, dropped:])
        self._held += weighted.shape[1] - dropped
        if self._held >= self._length:
            self._gather()

    def _gather(self) -> None:
        data = np.concatenate(self._pending, axis=1)
        while data.shape[1] >= self._length:
            intervals = min(data.shape[1] // self._length, MAX_INTERVALS - self._done)
            used = intervals * self._length
            self._measure(data[:, :used], intervals)
            data = data[:, used:]
        self._pending, self._held = [data], data.shape[1]

    def _measure(self, data: Array, intervals: int) -> None:
        """Add so many intervals; the data end with the last of them."""
        squares = data * data
        starts = np.arange(intervals) * self._length
        counts = np.diff(np.append(starts, data.shape[1]))
        rows = np.empty((6, data.shape[0], intervals))
        rows[0] = np.add.reduceat(squares, starts, axis=1) / counts
        for place, key in enumerate(TIME_CONSTANTS_S, start=1):
            pole = self._poles[key]
            average, self._states[key] = signal.lfilter(
                [1.0 - pole], [1.0, -pole], squares, axis=-1, zi=self._states[key]
            )
            rows[place] = average[:, starts + counts - 1]
            rows[place + 2] = np.maximum.reduceat(average, starts, axis=1)
        rows[5] = np.logical_or.reduceat(self._bad[:, : data.shape[1]], starts, axis=1)
        self._bad = self._bad[:, data.shape[1] :]
        self._rows.append(rows)
        self._done += intervals
        if self._done == MAX_INTERVALS:
            self._join_neighbours()

    def _join_neighbours(self) -> None:
        """Make two intervals one; later ones are twice as long too."""
        rows = np.concatenate(self._rows, axis=2)
        left, right = rows[:, :, 0::2], rows[:, :, 1::2]
        joined = np.empty_like(left)
        joined[0] = 0.5 * (left[0] + right[0])
        joined[1:3] = right[1:3]
        joined[3:] = np.maximum(left[3:], right[3:])
        self._rows, self._done = [joined], self._done // 2
        self._length *= 2

    def result(self) -> LevelHistory:
        """Return the history of all samples taken; nothing can be taken after."""
        if self._taken and self._filter:
            self._weigh(np.repeat(self._last, self._filter.delay, axis=1))
        if self._held:
            self._measure(np.concatenate(self._pending, axis=1), 1)
        empty = np.zeros((6, self._last.shape[0], 0))
        rows = np.concatenate((empty, *self._rows), axis=2)
        return LevelHistory(
            self._length / self._rate,
            self._weighting,
            mean_square=rows[0],
            fast=rows[1],
            slow=rows[2],
            fast_max=rows[3],
            slow_max=rows[4],
            missing=rows[5] > 0.5,
            duration_s=self._taken / self._rate,
        )

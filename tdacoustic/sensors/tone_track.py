"""The tone of a calibrator over time: frequency and mean square, frame by frame, in one pass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

__all__ = ["FRAME_S", "LOBE", "LOWEST_HZ", "ToneTrack", "ToneTrackMeter", "line_powers"]

Array = NDArray[np.float64]

FRAME_S: Final = 0.25
"""Length of a frame; they overlap by half."""
LOWEST_HZ: Final = 10.0
"""Below lies what couplers let through of wind and of hands."""
LOBE: Final = 3
"""Lines to either side of a peak that belong to it: the main lobe of a Hann window and a little more. What a tone has
beyond is less than 3e-5 of its power, 0.0002 dB."""
_REACH: Final = 0.05
"""Relative distance from a wanted frequency within which its tone is looked for."""
_MIN_SAMPLES: Final = 64
_HIGHEST: Final = 1e100
"""Larger numbers, NaN and infinity are no signal: their squares leave the range of numbers."""


@dataclass(frozen=True)
class ToneTrack:
    """Candidates of a tone over time.

    Parameters
    ----------
    times_s : ndarray, shape (n_frames,)
        Middles of the frames, after the record's first sample.
    frequency_hz, tone : ndarray, shape (n_candidates, n_frames)
        The strongest line near each wanted frequency, and last the strongest of all: where it is, and its mean square.
    total : ndarray, shape (n_frames,)
        Mean square of all from `LOWEST_HZ` on. NaN where samples are missing.
    frame_s, hop_s : float
    """

    times_s: Array
    frequency_hz: Array
    tone: Array
    total: Array
    frame_s: float
    hop_s: float


def line_powers(frames: Array, low: int, high: int) -> tuple[Array, Array, Array]:
    """Return the strongest line of each frame between two lines of its spectrum, free of window and leakage.

    Parameters
    ----------
    frames : ndarray, shape (n_frames, n)
        Samples.
    low, high : int
        First and last line within which the peak lies.

    Returns
    -------
    position : ndarray, shape (n_frames,)
        Of the peak, in lines; exact for a lone sine through a Hann window.
    tone : ndarray, shape (n_frames,)
        Its mean square: the power of the main lobe.
    spectrum : ndarray, shape (n_frames, n // 2 + 1)
        Mean square of every line.
    """
    amplitude, spectrum = _spectra(frames)
    return (*_peak(amplitude, spectrum, low, high), spectrum)


def _spectra(frames: Array) -> tuple[Array, Array]:
    """Amplitudes through a Hann window, and mean square of every line."""
    n = frames.shape[1]
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(n) / n)
    amplitude = np.abs(np.fft.rfft((frames - frames.mean(axis=1, keepdims=True)) * window, axis=1))
    return amplitude, 2.0 * amplitude**2 / (n * float(np.sum(window**2)))


def _peak(amplitude: Array, spectrum: Array, low: int, high: int) -> tuple[Array, Array]:
    rows = np.arange(len(amplitude))
    last = amplitude.shape[1] - 1
    peak = low + np.argmax(amplitude[:, low : high + 1], axis=1)
    before, after = amplitude[rows, np.maximum(peak - 1, 0)], amplitude[rows, np.minimum(peak + 1, last)]
    side = np.where(after >= before, 1.0, -1.0)
    top = amplitude[rows, peak]
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.maximum(before, after) / top
        shift = np.where(top > 0.0, (2.0 * ratio - 1.0) / (1.0 + ratio), 0.0)
    position = peak + side * np.clip(shift, -0.5, 0.5)
    summed = np.concatenate([np.zeros((len(spectrum), 1)), np.cumsum(spectrum, axis=1)], axis=1)
    tone = summed[rows, np.minimum(peak + LOBE, last) + 1] - summed[rows, np.maximum(peak - LOBE, 0)]
    return position, tone


class ToneTrackMeter:
    """Follows the tone of one channel, block by block; memory does not grow but for a few numbers a frame.

    Parameters
    ----------
    sample_rate_hz : float
    wanted_hz : sequence of float
        Frequencies near which a tone is looked for.
    """

    def __init__(self, sample_rate_hz: float, wanted_hz: Sequence[float]) -> None:
        self._rate = sample_rate_hz
        self._n = max(_MIN_SAMPLES, 2 * round(0.5 * FRAME_S * sample_rate_hz))
        self._hop = self._n // 2
        self._rest = np.zeros(0)
        self._found: list[tuple[Array, Array, Array]] = []
        spacing, last = sample_rate_hz / self._n, self._n // 2
        self._low = max(2, round(LOWEST_HZ / spacing))
        self._ranges = [
            (max(self._low, int(hz * (1 - _REACH) / spacing)), min(last - 1, int(hz * (1 + _REACH) / spacing) + 1))
            for hz in wanted_hz
        ]
        self._ranges.append((self._low, last - 1))

    def take(self, block: Array) -> None:
        """Add samples, shape (n,)."""
        data = np.concatenate([self._rest, block])
        count = max(0, (data.size - self._n) // self._hop + 1)
        step = max(1, 2**20 // self._n)
        for first in range(0, count, step):
            last = min(count, first + step)
            part = data[first * self._hop : (last - 1) * self._hop + self._n]
            self._found.append(self._frames(np.lib.stride_tricks.sliding_window_view(part, self._n)[:: self._hop]))
        self._rest = data[count * self._hop :].copy()

    def _frames(self, frames: Array) -> tuple[Array, Array, Array]:
        known = np.all(np.abs(frames) < _HIGHEST, axis=1)
        whole = np.where(known[:, np.newaxis], frames, 0.0)
        amplitude, spectrum = _spectra(whole)
        found = [
            _peak(amplitude, spectrum, low, high) if high > low else (np.zeros(len(whole)), np.zeros(len(whole)))
            for low, high in self._ranges
        ]
        total = np.where(known, spectrum[:, self._low - 1 :].sum(axis=1), np.nan)
        position = np.array([item[0] for item in found])
        return position * self._rate / self._n, np.array([item[1] for item in found]), total

    def result(self) -> ToneTrack:
        """Return the track of what was taken."""
        frame_s, hop_s = self._n / self._rate, self._hop / self._rate
        if not self._found:
            empty = np.zeros((len(self._ranges), 0))
            return ToneTrack(np.zeros(0), empty, empty, np.zeros(0), frame_s, hop_s)
        frequency, tone = (np.concatenate([item[k] for item in self._found], axis=1) for k in (0, 1))
        total = np.concatenate([item[2] for item in self._found])
        times = 0.5 * frame_s + hop_s * np.arange(total.size, dtype=np.float64)
        return ToneTrack(times, frequency, tone, total, frame_s, hop_s)

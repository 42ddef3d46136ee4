"""Short-time spectra of several channels over their floor, gathered block by block."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

__all__ = ["CombSpectra", "over_its_floor"]

Array = NDArray[np.float64]
Grid = NDArray[np.float32]

FLOOR_BINS: Final = 41
"""Bins of the running median that is taken for the floor [assumed]."""
MOST_CELLS: Final = 8_000_000
"""Frames times bins that one channel may keep (16 MB); a longer record is looked at less often."""


class CombSpectra:
    """Power over floor in frames of one length.

    Parameters
    ----------
    frame_s : float
    sample_rate_hz : float
    n_samples : int
        Of the record.
    n_channels : int
    top_hz : float
        Higher bins are not kept.
    """

    def __init__(self, frame_s: float, sample_rate_hz: float, n_samples: int, n_channels: int, top_hz: float) -> None:
        self.length = max(16, 2 * round(0.5 * frame_s * sample_rate_hz))
        self.bin_hz = sample_rate_hz / self.length
        self._bins = min(self.length // 2 + 1, math.ceil(top_hz / self.bin_hz) + 2)
        self.hop = max(self.length // 2, math.ceil(n_samples * self._bins / MOST_CELLS))
        self._rate_hz = sample_rate_hz
        self._window = np.hanning(self.length + 1)[:-1]
        self._kept: list[list[NDArray[np.float16]]] = [[] for _ in range(n_channels)]
        self._pending = np.zeros((n_channels, 0))
        self._skip = 0
        self._frames = 0

    def take(self, values: Array) -> None:
        """Add samples, shape (n_channels, n), in order."""
        if self._skip:
            dropped = min(self._skip, values.shape[1])
            values, self._skip = values[:, dropped:], self._skip - dropped
        data = np.concatenate((self._pending, values), axis=1)
        count = max(0, (data.shape[1] - self.length) // self.hop + 1)
        if count:
            starts = self.hop * np.arange(count)
            for channel, kept in enumerate(self._kept):
                frames = np.lib.stride_tricks.sliding_window_view(data[channel], self.length)[starts]
                kept.append(over_its_floor(np.nan_to_num(frames) * self._window, self._bins).astype(np.float16))
        used = count * self.hop
        self._skip += max(0, used - data.shape[1])
        self._pending = data[:, used:].copy()
        self._frames += count

    @property
    def times_s(self) -> Array:
        """Middle of each frame after the first sample, shape (n_frames,)."""
        starts = np.arange(self._frames, dtype=np.float64) * self.hop
        return (starts + 0.5 * (self.length - 1)) / self._rate_hz

    @property
    def hop_s(self) -> float:
        """Time from frame to frame."""
        return self.hop / self._rate_hz

    def over_floor(self) -> list[Grid]:
        """Return power over floor of each channel, shape (n_frames, n_bins); at most 60000."""
        return [np.concatenate(kept).astype(np.float32) for kept in self._kept]


def over_its_floor(frames: Array, bins: int) -> Array:
    """Return the power of windowed frames over the mean power of the floor around each bin.

    The floor is the running median over frequency, of exponentially distributed powers ln 2 of their mean.

    Parameters
    ----------
    frames : ndarray, shape (n_frames, length)
    bins : int
        That are returned.
    """
    power = np.abs(np.fft.rfft(frames, axis=1)[:, : bins + FLOOR_BINS]) ** 2
    half = FLOOR_BINS // 2
    rows = np.pad(power, ((0, 0), (half, half)), mode="reflect" if power.shape[1] > half else "edge")
    # One long row is several times faster than many; the padding keeps them apart.
    middle = ndimage.median_filter(rows.ravel(), FLOOR_BINS).reshape(rows.shape)[:, half:-half] / math.log(2.0)
    least = np.maximum(1e-12 * power.max(axis=1, keepdims=True), np.finfo(np.float64).tiny)
    return np.asarray(np.minimum(power / np.maximum(middle, least), 6e4)[:, :bins])

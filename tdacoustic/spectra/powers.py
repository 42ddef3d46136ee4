"""Block powers: one pass over the samples, kept so that later steps need no second reading."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from tdacoustic.spectra.frames import FramePlan

__all__ = ["FramePowerMeter", "SegmentPowers", "hann"]

Array = NDArray[np.float64]


def hann(length: int) -> Array:
    """Periodic Hann window, shape (length,)."""
    return 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(length) / length)


@dataclass(frozen=True)
class SegmentPowers:
    """Mean-square densities of the segments of a record.

    Parameters
    ----------
    plan : FramePlan
    density : ndarray of float32, shape (n_channels, n_segments, n_frequencies)
        One-sided mean-square density, unit² / Hz, the mean over the segment's
        frames; Hann window, the mean of each frame removed.
    frames : ndarray of int, shape (n_channels, n_segments)
        Frames averaged; fewer where frames held samples that were no numbers.
    means : ndarray, shape (n_channels, n_segments)
        Mean of the frames' means.
    """

    plan: FramePlan
    density: NDArray[np.float32]
    frames: NDArray[np.int64]
    means: Array

    @property
    def segment_times_s(self) -> Array:
        """Middle of each segment after the record's start, shape (n_segments,)."""
        plan = self.plan
        frame = np.arange(plan.n_frames)
        segment = frame * plan.n_segments // plan.n_frames
        middle = (frame * plan.hop + 0.5 * plan.frame_length) / plan.sample_rate_hz
        return np.bincount(segment, weights=middle) / np.bincount(segment)


class FramePowerMeter:
    """Takes blocks of samples and gathers the powers of overlapping frames.

    The window is Hann; the mean of each frame is removed, which for a periodic
    Hann window changes lines 0 and 1 alone and is done there.

    Parameters
    ----------
    plan : FramePlan
    n_channels : int
    """

    def __init__(self, plan: FramePlan, n_channels: int) -> None:
        self.plan = plan
        shape = (n_channels, plan.n_segments)
        self._density = np.full((*shape, plan.n_frequencies), np.nan, dtype=np.float32)
        self._frames = np.zeros(shape, dtype=np.int64)
        self._means = np.zeros(shape)
        self._segment = 0
        self._running = np.zeros((n_channels, plan.n_frequencies))  # of the segment in hand: small, it stays in cache
        self._window = hann(plan.frame_length)
        self._scale = self._one_sided() / (plan.sample_rate_hz * float(np.sum(self._window**2)))
        self._scratch = np.empty(plan.frame_length)
        self._pending = np.empty((n_channels, 0))
        self._next_frame = 0

    def take(self, block: Array) -> None:
        """Add samples, shape (n_channels, n), in order."""
        held = self._pending.shape[1]
        # Only the frames that begin before the block need both joined; the others lie in the block itself.
        joined = np.concatenate((self._pending, block[:, : self.plan.frame_length]), axis=1)
        start = self._take_frames(joined, held)
        if start < held:  # too few samples yet for the next frame
            self._pending = np.concatenate((self._pending, block), axis=1)[:, start:]
            return
        start = start - held + self._take_frames(block[:, start - held :], block.shape[1])
        self._pending = block[:, start:].copy() if self._next_frame < self.plan.n_frames else block[:, :0].copy()

    def _take_frames(self, data: Array, before: int) -> int:
        """Take the frames of `data` that begin before a sample; return where the next one begins."""
        plan, start = self.plan, 0
        while start < before and self._next_frame < plan.n_frames and start + plan.frame_length <= data.shape[1]:
            self._take_frame(data[:, start : start + plan.frame_length])
            start += plan.hop
        return start if self._next_frame < plan.n_frames else max(start, before)

    def _take_frame(self, frames: Array) -> None:
        segment = self.plan.segment_of(self._next_frame)
        if segment != self._segment:
            self._close_segment()
            self._segment = segment
        half = 0.5 * self.plan.frame_length
        with np.errstate(invalid="ignore"):  # infinite values of both signs
            means = frames.mean(axis=1)
        for channel, frame in enumerate(frames):
            mean = float(means[channel])
            if not np.isfinite(mean):
                continue
            np.multiply(frame, self._window, out=self._scratch)
            transform = scipy.fft.rfft(self._scratch, overwrite_x=True)
            transform[0] -= half * mean
            transform[1] += 0.5 * half * mean
            squares = transform.view(np.float64)
            np.multiply(squares, squares, out=squares)
            running = self._running[channel]
            running += squares[0::2]
            running += squares[1::2]
            self._frames[channel, segment] += 1
            self._means[channel, segment] += mean
        self._next_frame += 1

    def _one_sided(self) -> Array:
        factor = np.full(self.plan.n_frequencies, 2.0)
        factor[0] = 1.0
        if self.plan.frame_length % 2 == 0:
            factor[-1] = 1.0
        return factor

    def _close_segment(self) -> None:
        """Put the running sums of the segment in hand where they belong, as a density."""
        for channel, running in enumerate(self._running):
            frames = self._frames[channel, self._segment]
            if frames:
                running *= self._scale
                running /= frames
                self._density[channel, self._segment] = running
                running[:] = 0.0

    def result(self) -> SegmentPowers:
        """Return the powers of all frames taken; nothing can be taken after."""
        self._close_segment()
        with np.errstate(invalid="ignore", divide="ignore"):
            means = self._means / self._frames
        return SegmentPowers(self.plan, self._density, self._frames, means)

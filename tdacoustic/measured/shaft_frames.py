"""Blocks of a raster over the angle of one shaft: resampled stretch by stretch, cut into frames, handed to meters."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.orders import AngleResampler, Frames, LineFrames, SynchronousMeter, plan_line_frames
from tdacoustic.orders.frames import FrameReader
from tdacoustic.orders.resampling import plan_samples_per_turn
from tdacoustic.speed import ShaftAngle

__all__ = ["ShaftFrames", "plan_turn_frames", "rows_for", "turns_within"]

Array = NDArray[np.float64]

EARLIER_S: Final = 2.0
"""By which samples are taken before a stretch begins, for the kernel of its first values."""
FRAMES_AT_LEAST: Final = 6
"""Lengths of a frame that a run has to hold; else frames are shorter and the resolution coarser."""
MOST_STRETCHES: Final = 32
"""Longest ones that are used of an angle that often breaks off."""


def turns_within(angle: ShaftAngle, start_s: float, end_s: float) -> float:
    """Return the turns of a shaft between two instants, those in its breaks left out."""
    total = 0.0
    for stretch in angle.stretches():
        first, last = max(start_s, stretch.first_s), min(end_s, stretch.last_s)
        if last > first:
            total += float(stretch.turns_at(last) - stretch.turns_at(first))
    return total


def plan_turn_frames(samples_per_turn: int, resolution: float, turns: float, overlap: float = 0.75) -> LineFrames:
    """Choose frames over an angle, no longer than a part of the turns that there are.

    Parameters
    ----------
    samples_per_turn : int
    resolution : float
        Line spacing asked for, in orders.
    turns : float
        Of the run.
    overlap : float
        Of consecutive frames.
    """
    spacing = min(max(resolution, FRAMES_AT_LEAST / turns), samples_per_turn / 16.0)
    return plan_line_frames(float(samples_per_turn), spacing, overlap=overlap)


@dataclass(eq=False)  # one is itself alone: arrays have no one truth of being equal
class _Chain:
    """One stretch of the angle with what its samples go through."""

    stretch: ShaftAngle
    resampler: AngleResampler | None
    frames: tuple[Frames, ...]


class ShaftFrames:
    """Takes blocks of a time signal and feeds meters with what they are over the angle of one shaft.

    Parameters
    ----------
    angle : ShaftAngle
        Of this shaft; breaks divide it into stretches, whose phases are not comparable.
    sample_rate_hz, start_s : float
        Of the raster.
    highest_order : float
        Of this shaft.
    """

    def __init__(self, angle: ShaftAngle, sample_rate_hz: float, start_s: float, highest_order: float) -> None:
        self.angle, self.rate_hz, self.start_s, self.highest_order = angle, sample_rate_hz, start_s, highest_order
        self.samples_per_turn = plan_samples_per_turn(highest_order)
        self._readers: dict[LineFrames, tuple[FrameReader, ...]] = {}
        self._synchronous: SynchronousMeter | None = None
        self._chains: list[_Chain] | None = None
        self._seen = 0

    def read_by(self, plan: LineFrames, readers: Sequence[FrameReader]) -> None:
        """Add meters that read the frames of a plan; before the first block. Those of one plan share its transforms."""
        self._readers[plan] = (*self._readers.get(plan, ()), *readers)

    def average_with(self, meter: SynchronousMeter) -> None:
        """Add a meter of the turns; it reads the longest stretch alone."""
        self._synchronous = meter

    def take(self, block: Array) -> None:
        """Add samples, shape (n_channels, n), in order."""
        if not self._readers and self._synchronous is None:
            return
        if self._chains is None:
            self._chains = self._begun()
        begin_s = self.start_s + self._seen / self.rate_hz
        end_s = begin_s + block.shape[1] / self.rate_hz
        self._seen += block.shape[1]
        for chain in list(self._chains):
            if chain.resampler is None:
                if end_s < chain.stretch.first_s - EARLIER_S:
                    continue
                chain.resampler = AngleResampler(
                    chain.stretch, self.rate_hz, self.highest_order, begin_s, self.samples_per_turn
                )
            even = chain.resampler.take(block)
            for frames in chain.frames:
                frames.take(even)
            if self._synchronous is not None and chain is self._chains[0]:
                self._synchronous.take(even)
            if begin_s > chain.stretch.last_s + EARLIER_S and chain is not self._chains[0]:
                self._chains.remove(chain)

    def _begun(self) -> list[_Chain]:
        """A chain for each stretch, the longest first."""
        stretches = sorted(self.angle.stretches(), key=lambda item: float(item.turns[0] - item.turns[-1]))
        return [
            _Chain(stretch, None, tuple(Frames(plan, readers) for plan, readers in self._readers.items()))
            for stretch in stretches[:MOST_STRETCHES]
        ]


def rows_for(frames: float, wanted: float, fewest: int, most: int) -> int:
    """Return how many rows so many frames fill with so many each."""
    return int(min(max(math.floor(frames / wanted), fewest), most))

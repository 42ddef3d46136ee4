"""How a record is cut into overlapping frames and segments of frames."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tdacoustic.errors import AnalysisError

__all__ = ["FramePlan", "plan_frames"]

MAX_SEGMENTS = 64
MIN_SEGMENTS = 8
SEGMENT_BYTES = 192 * 2**20
"""Memory that the segments' powers of all channels of a run may take."""


@dataclass(frozen=True)
class FramePlan:
    """Frames of equal length at equal distance, gathered in segments.

    Parameters
    ----------
    sample_rate_hz : float
    n_samples : int
        Of the record.
    frame_length, hop : int
        In samples.
    n_frames : int
    n_segments : int
        Groups of consecutive frames whose powers are kept apart.
    requested_resolution_hz : float
        Line spacing that was asked for; the actual one is `resolution_hz`.
    """

    sample_rate_hz: float
    n_samples: int
    frame_length: int
    hop: int
    n_frames: int
    n_segments: int
    requested_resolution_hz: float

    @property
    def resolution_hz(self) -> float:
        """Line spacing."""
        return self.sample_rate_hz / self.frame_length

    @property
    def n_frequencies(self) -> int:
        """Lines from 0 to half the sampling rate."""
        return self.frame_length // 2 + 1

    def segment_of(self, frame: int) -> int:
        """Segment that a frame belongs to."""
        return frame * self.n_segments // self.n_frames


def _smooth_length(target: float) -> int:
    """Return the even length nearest to a target whose prime factors are at most 7."""
    import numpy as np

    best, nearest = 2, math.inf
    limit = max(4.0, 2.0 * target)
    for a in range(1, 40):
        if 2.0**a > limit:
            break
        for b in range(0, 25):
            if 2.0**a * 3.0**b > limit:
                break
            for c in range(0, 16):
                base = 2**a * 3**b * 5**c
                if base > limit:
                    break
                for d in (0, 1, 2):
                    length = base * 7**d
                    distance = abs(float(np.log(length / target)))
                    if distance < nearest - 1e-12:
                        best, nearest = length, distance
    return best


def plan_frames(
    sample_rate_hz: float,
    n_samples: int,
    resolution_hz: float = 1.0,
    overlap: float = 0.5,
    n_channels: int = 1,
    max_segments: int = MAX_SEGMENTS,
) -> FramePlan:
    """Choose frames for a line spacing, as near to it as a quick transform length allows.

    A record shorter than one frame gets one frame of its own length, and
    `FramePlan.resolution_hz` says what that leaves.

    Parameters
    ----------
    sample_rate_hz : float
    n_samples : int
    resolution_hz : float
        Line spacing asked for.
    overlap : float
        Fraction of a frame shared with the next, 0 <= overlap < 1.
    n_channels : int
        Channels surveyed together; bounds the number of segments, so that
        memory does not depend on the record's length.
    max_segments : int
        Segments at most.

    Raises
    ------
    AnalysisError
        Fewer than 16 samples, or settings out of range.

    Examples
    --------
    >>> plan = plan_frames(51200.0, 512000)
    >>> plan.frame_length, plan.n_frames, plan.resolution_hz
    (51200, 19, 1.0)
    """
    if not resolution_hz > 0.0:
        raise AnalysisError(f"resolution_hz must be > 0, got {resolution_hz}")
    if not 0.0 <= overlap < 1.0:
        raise AnalysisError(f"overlap must be in [0, 1), got {overlap}")
    if n_samples < 16:
        raise AnalysisError(f"a record of {n_samples} samples is too short for a spectrum; it takes at least 16")
    target = sample_rate_hz / resolution_hz
    exact = round(target)
    length = exact if abs(target - exact) < 1e-9 * target and _is_smooth(exact) else _smooth_length(target)
    length = min(max(length, 16), n_samples - n_samples % 2)
    hop = max(1, round(length * (1.0 - overlap)))
    n_frames = 1 + (n_samples - length) // hop
    room = SEGMENT_BYTES // (8 * max(1, n_channels) * (length // 2 + 1))
    n_segments = min(n_frames, max(MIN_SEGMENTS, min(max_segments, room)))
    return FramePlan(sample_rate_hz, n_samples, length, hop, n_frames, n_segments, resolution_hz)


def _is_smooth(length: int) -> bool:
    if length < 2 or length % 2:
        return False
    for prime in (2, 3, 5, 7):
        while length % prime == 0:
            length //= prime
    return length == 1

"""Where in a recording a calibrator was on: stretches in which one tone keeps its level."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.sensors.tone_track import ToneTrack

__all__ = ["MIN_PLATEAU_S", "STEADY_DB", "Stretch", "find_stretches"]

Array = NDArray[np.float64]

STEADY_DB: Final = 0.2
"""Span of the levels of a tone's frames within which it is steady [assumed]; IEC 60942:2017 allows a class 1
calibrator 0.07 dB to either side, the rest is room for noise."""
MIN_PLATEAU_S: Final = 2.0
"""Shortest steady stretch that is read [assumed]; less than that is a calibrator put on in passing."""
OTHER_LEVEL_DB: Final = 1.0
"""A step by more within one tone is another setting of the calibrator, by less an unsteady one [assumed]."""
_STANDS_OUT: Final = 0.5
"""Part of a frame's power that a tone has at least."""
_SAME_TONE: Final = 0.005
"""Relative distance of two frames' frequencies within which they are one tone."""


@dataclass(frozen=True)
class Stretch:
    """A steady stretch of a tone.

    Parameters
    ----------
    start_s, end_s : float
        After the record's first sample, half a frame taken off at either end.
    frequency_hz : float
    mean_square : float
    wander_db : float
        By how much the level of the same tone lies elsewhere before or after, at most, where it is steady there too.
    """

    start_s: float
    end_s: float
    frequency_hz: float
    mean_square: float
    wander_db: float = 0.0

    @property
    def duration_s(self) -> float:
        """Length in seconds."""
        return self.end_s - self.start_s


def find_stretches(track: ToneTrack) -> tuple[tuple[Stretch, ...], float]:
    """Find the steady stretches of the tone that stands out.

    A tone near one of the wanted frequencies goes before any other; of several that one that is steady for longest.

    Parameters
    ----------
    track : ToneTrack

    Returns
    -------
    tuple of Stretch
        In the order of time; none where no tone keeps its level for `MIN_PLATEAU_S`.
    float
        For how long a tone near a wanted frequency stood out at all, in s.
    """
    stood_out_s = 0.0
    best: list[Stretch] = []
    last = len(track.tone) - 1
    for candidate in range(last + 1):
        if candidate == last and best:
            break
        mask, level = _frames_of(track, candidate)
        if candidate < last or last == 0:
            stood_out_s = max(stood_out_s, int(mask.sum()) * track.hop_s)
        found = _stretches(track, candidate, mask, level)
        if sum(item.duration_s for item in found) > sum(item.duration_s for item in best):
            best = found
    return tuple(sorted(best, key=lambda item: item.start_s)), stood_out_s


def _frames_of(track: ToneTrack, candidate: int) -> tuple[NDArray[np.bool_], Array]:
    """Frames in which a candidate stands out as one tone, and their levels in dB."""
    tone, frequency = track.tone[candidate], track.frequency_hz[candidate]
    with np.errstate(invalid="ignore", divide="ignore"):
        mask = (tone > 0.0) & (tone >= _STANDS_OUT * track.total)
        level = 10.0 * np.log10(tone)
    if mask.any():
        held = np.sort(frequency[mask])
        ends = np.searchsorted(held, held * (1.0 + _SAME_TONE), side="right")
        first = int(np.argmax(ends - np.arange(held.size)))
        middle = float(np.median(held[first : ends[first]]))
        mask &= np.abs(frequency - middle) <= _SAME_TONE * middle
    return mask, level


def _stretches(track: ToneTrack, candidate: int, mask: NDArray[np.bool_], level: Array) -> list[Stretch]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    found = []
    for first, stop in edges.reshape(-1, 2):
        windows = _steady_windows(level, int(first), int(stop), max(2, round(MIN_PLATEAU_S / track.hop_s)))
        stretches = [_stretch(track, candidate, *window) for window in windows]
        found += _merged([item for item in stretches if item.duration_s >= MIN_PLATEAU_S])
    return found


def _steady_windows(level: Array, first: int, stop: int, least: int) -> list[tuple[int, int]]:
    """Longest window whose levels span no more than `STEADY_DB`, and those of what is left to either side."""
    waiting, found = [(first, stop)], []
    while waiting:
        low, high = waiting.pop()
        if high - low < least:
            continue
        start, end = _longest(level, low, high)
        if end - start >= least:
            found.append((start, end))
            waiting += [(low, start), (end, high)]
    return found


def _longest(level: Array, first: int, stop: int) -> tuple[int, int]:
    """Longest window within which the levels span no more than `STEADY_DB`; each frame is looked at twice."""
    highest: deque[int] = deque()
    lowest: deque[int] = deque()
    best, start = (first, first), first
    for index in range(first, stop):
        while highest and level[highest[-1]] <= level[index]:
            highest.pop()
        while lowest and level[lowest[-1]] >= level[index]:
            lowest.pop()
        highest.append(index)
        lowest.append(index)
        while level[highest[0]] - level[lowest[0]] > STEADY_DB:
            start += 1
            if highest[0] < start:
                highest.popleft()
            if lowest[0] < start:
                lowest.popleft()
        if index + 1 - start > best[1] - best[0]:
            best = (start, index + 1)
    return best


def _stretch(track: ToneTrack, candidate: int, first: int, stop: int) -> Stretch:
    return Stretch(
        start_s=float(track.times_s[first]),
        end_s=float(track.times_s[stop - 1]),
        frequency_hz=float(np.median(track.frequency_hz[candidate, first:stop])),
        mean_square=float(np.mean(track.tone[candidate, first:stop])),
    )


def _merged(stretches: list[Stretch]) -> list[Stretch]:
    """Keep of one unbroken tone the longest stretch of each level; what it wanders by stands with it."""
    kept: list[Stretch] = []
    for item in sorted(stretches, key=lambda item: -item.duration_s):
        for index, other in enumerate(kept):
            distance_db = abs(10.0 * float(np.log10(item.mean_square / other.mean_square)))
            if distance_db <= OTHER_LEVEL_DB:
                worst = max(distance_db, other.wander_db)
                kept[index] = Stretch(other.start_s, other.end_s, other.frequency_hz, other.mean_square, worst)
                break
        else:
            kept.append(item)
    return kept

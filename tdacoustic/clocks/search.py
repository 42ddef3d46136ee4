"""Where windows of one record are found in another: a search over every offset that is allowed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from tdacoustic.clocks.records import SharedRecord, own_span, windows_of
from tdacoustic.clocks.whitening import LagFrame, lag_correlation, local_energy, whitened

__all__ = ["Candidate", "SearchPlan", "find_candidates"]

Array = NDArray[np.float64]

FRAME_S: Final = 32.0
"""Frame of the searched record, at least; four windows where these are longer."""
RAMP: Final = 0.25
"""Part of a window over which it rises and falls, and the searched frames with it."""
MOST_PEAKS: Final = 12
"""Candidates kept of a window."""
LEAST_SPAN_S: Final = 1e-3


@dataclass(frozen=True)
class SearchPlan:
    """What is searched.

    Parameters
    ----------
    window_s : float
    band_hz : (float, float)
    starts_s : tuple of float
        Of the windows, in the reference's time, ascending.
    offsets_s : tuple of (float, float)
        For each window, within which its offset lies.
    """

    window_s: float
    band_hz: tuple[float, float]
    starts_s: tuple[float, ...]
    offsets_s: tuple[tuple[float, float], ...]

    @property
    def freedom(self) -> float:
        """Independent values in a window: twice its length times the band's width."""
        return 2.0 * self.window_s * (self.band_hz[1] - self.band_hz[0])

    @property
    def apart_s(self) -> float:
        """Distance within which two peaks are one."""
        return 1.0 / (self.band_hz[1] - self.band_hz[0])


@dataclass(frozen=True)
class Candidate:
    """A place in the other record that a window fits.

    Parameters
    ----------
    window : int
    time_s : float
        Middle of the window, in the reference's time.
    offset_s : float
        The reference's time less the other's.
    correlation : float
        Signed.
    likelihood : float
        Log-likelihood ratio against a window that fits nowhere.
    """

    window: int
    time_s: float
    offset_s: float
    correlation: float
    likelihood: float


def find_candidates(reference: SharedRecord, other: SharedRecord, plan: SearchPlan) -> list[Candidate]:
    """Return the best places of each window, in one pass over the reference and one over the other record.

    Parameters
    ----------
    reference, other : SharedRecord
    plan : SearchPlan
    """
    frame, n_frame = _frame(other, plan)
    windows = _windows(reference, plan, frame)
    live = [index for index, window in enumerate(windows) if np.any(window)]
    starts = _frame_starts(other, plan, live, n_frame)
    if not live or not starts:
        return []
    best: list[list[tuple[float, float]]] = [[] for _ in windows]
    for start, block in zip(starts, windows_of(other, starts, n_frame), strict=True):
        n_held = min(n_frame, other.n_samples - start)
        held = n_held / other.sample_rate_hz
        lines = whitened(block[:n_held], n_frame, frame, round(RAMP * plan.window_s * other.sample_rate_hz))
        if not np.any(lines):
            continue
        local = local_energy(lines, plan.window_s, frame)
        lags = np.arange(frame.n_lags) * frame.step_s
        own_s = other.start_s + start / other.sample_rate_hz + lags
        fits = lags <= held - plan.window_s + frame.step_s
        for index in live:
            offsets = plan.starts_s[index] - own_s
            low, high = plan.offsets_s[index]
            allowed = fits & (offsets >= low) & (offsets <= high)
            if allowed.any():
                found = lag_correlation(windows[index], lines, local, frame)
                best[index] += _peaks(np.where(allowed, found, 0.0), offsets, plan.apart_s, frame.step_s)
                best[index] = _strongest(best[index], plan.apart_s)
    middle = 0.5 * plan.window_s
    return [
        Candidate(index, plan.starts_s[index] + middle, offset, value, _likelihood(value, plan.freedom))
        for index, peaks in enumerate(best)
        for value, offset in peaks
    ]


def _likelihood(correlation: float, freedom: float) -> float:
    return -0.5 * freedom * float(np.log1p(-min(correlation**2, 1.0 - 1e-9)))


def _frame(other: SharedRecord, plan: SearchPlan) -> tuple[LagFrame, int]:
    """Frame of the searched record: a whole number of its samples that a transform likes."""
    rate = other.sample_rate_hz
    wanted = max(FRAME_S, 6.0 * plan.window_s)
    wanted = min(wanted, other.n_samples / rate + plan.window_s)
    n = int(fft.next_fast_len(max(16, round(wanted * rate)), real=True))
    return LagFrame(n / rate, plan.band_hz), n


def _windows(reference: SharedRecord, plan: SearchPlan, frame: LagFrame) -> list[NDArray[np.complex128]]:
    rate = reference.sample_rate_hz
    n_frame, length = round(frame.duration_s * rate), round(plan.window_s * rate)
    starts = [max(0, round((start_s - reference.start_s) * rate)) for start_s in plan.starts_s]
    ramp = round(RAMP * length)
    return [whitened(window, n_frame, frame, ramp) for window in windows_of(reference, starts, length)]


def _frame_starts(other: SharedRecord, plan: SearchPlan, live: Sequence[int], n_frame: int) -> list[int]:
    """First samples of the frames in which any window may lie."""
    rate = other.sample_rate_hz
    hop = max(1, n_frame - round((1.0 + 2.0 * RAMP) * plan.window_s * rate) - 2)
    first_s, end_s = own_span(other)
    spans = [(plan.starts_s[i] - plan.offsets_s[i][1], plan.starts_s[i] - plan.offsets_s[i][0]) for i in live]
    starts = []
    for start in range(0, max(1, other.n_samples - round(plan.window_s * rate) + 1), hop):
        begins_s = first_s + start / rate
        ends_s = min(end_s, begins_s + hop / rate)
        if any(low <= ends_s and high >= begins_s - LEAST_SPAN_S for low, high in spans):
            starts.append(start)
    return starts


def _peaks(found: Array, offsets: NDArray[Any], apart_s: float, step_s: float) -> list[tuple[float, float]]:
    """Largest magnitudes, no two of one peak."""
    width = max(1, int(apart_s / step_s))
    n_cells = -(-found.size // width)
    padded = np.zeros(n_cells * width)
    padded[: found.size] = np.abs(found)
    cells = padded.reshape(n_cells, width)
    tops = cells.max(axis=1)
    chosen = np.argsort(tops)[::-1][: 3 * MOST_PEAKS]
    places = chosen * width + cells[chosen].argmax(axis=1)
    return [(float(found[i]), float(offsets[i])) for i in places if tops[i // width] > 0.0]


def _strongest(peaks: list[tuple[float, float]], apart_s: float) -> list[tuple[float, float]]:
    kept: list[tuple[float, float]] = []
    for value, offset in sorted(peaks, key=lambda peak: -abs(peak[0])):
        if all(abs(offset - other) > apart_s for _, other in kept):
            kept.append((value, offset))
            if len(kept) == MOST_PEAKS:
                break
    return kept

"""Which line of offset over time the candidates of many windows agree on, and how far ahead of the next it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.clocks.search import Candidate

__all__ = ["Consensus", "agree"]

Array = NDArray[np.float64]

BLOCK_OF_LINES: Final = 4096


@dataclass(frozen=True)
class Consensus:
    """A line ``offset(t) = offset_s - drift (t - time_s)`` and who is on it.

    Parameters
    ----------
    time_s, offset_s, drift : float
    sign : float
    likelihood : float
        Summed over its windows.
    correlation : float
        Mean magnitude over its windows.
    supporters : tuple of Candidate
    next_likelihood, next_correlation : float
        The same of the best line that shares no candidate with it.
    """

    time_s: float
    offset_s: float
    drift: float
    sign: float
    likelihood: float
    correlation: float
    supporters: tuple[Candidate, ...]
    next_likelihood: float = 0.0
    next_correlation: float = 0.0

    @property
    def ratio(self) -> float:
        """By how much the runner-up would have to correlate better to be as likely."""
        return float(np.sqrt(self.likelihood / self.next_likelihood)) if self.next_likelihood > 0.0 else np.inf


def agree(
    candidates: Sequence[Candidate],
    tolerance_s: float,
    max_drift: float,
    start: tuple[float, float] = (0.0, np.inf),
) -> Consensus | None:
    """Return the line with most likelihood, with what the runner-up has; None without candidates.

    Parameters
    ----------
    candidates : sequence of Candidate
    tolerance_s : float
        How far from a line a candidate may lie.
    max_drift : float
        Largest slope.
    start : (float, float)
        Offset where the other record's own time is zero, and how far it may lie from that.
    """
    best = _best(candidates, tolerance_s, max_drift, start)
    if best is None:
        return None
    time_s = float(np.mean([item.time_s for item in best]))
    offset_s, drift = _line(best, time_s)
    left = [item for item in candidates if not any(_is_near(item, held, tolerance_s) for held in best)]
    runner_up = _best(left, tolerance_s, max_drift, start)
    return Consensus(
        time_s,
        offset_s,
        drift,
        float(np.sign(best[0].correlation)),
        sum(item.likelihood for item in best),
        _mean(best),
        tuple(best),
        0.0 if runner_up is None else sum(item.likelihood for item in runner_up),
        0.0 if runner_up is None else _mean(runner_up),
    )


def _mean(items: Sequence[Candidate]) -> float:
    return float(np.mean([abs(item.correlation) for item in items]))


def _is_near(item: Candidate, held: Candidate, tolerance_s: float) -> bool:
    return item.window == held.window and abs(item.offset_s - held.offset_s) <= 2.0 * tolerance_s


def _line(items: Sequence[Candidate], time_s: float) -> tuple[float, float]:
    offsets = np.array([item.offset_s for item in items])
    times = np.array([item.time_s for item in items]) - time_s
    weights = np.array([item.likelihood for item in items])
    if len(items) < 2 or np.ptp(times) == 0.0:
        return float(np.average(offsets, weights=weights)), 0.0
    slope, level = np.polyfit(times, offsets, 1, w=np.sqrt(weights))
    return float(level), float(-slope)


def _best(
    candidates: Sequence[Candidate], tolerance_s: float, max_drift: float, start: tuple[float, float]
) -> list[Candidate] | None:
    if not candidates:
        return None
    time = np.array([item.time_s for item in candidates])
    offset = np.array([item.offset_s for item in candidates])
    sign = np.sign([item.correlation for item in candidates])
    gain = np.array([item.likelihood for item in candidates])
    window = np.array([item.window for item in candidates])
    level, slope, signs = _hypotheses(time, offset, sign, window, max_drift)
    starts = np.abs(level + slope * start[0] - start[0]) <= start[1] + tolerance_s
    level, slope, signs = level[starts], slope[starts], signs[starts]
    best_score, best_members = -1.0, np.zeros(0, dtype=int)
    for first in range(0, level.size, BLOCK_OF_LINES):
        part = slice(first, first + BLOCK_OF_LINES)
        near = np.abs(offset - (level[part, None] + slope[part, None] * time)) <= tolerance_s
        worth = np.where(near & (sign == signs[part, None]), gain, 0.0)
        score = np.zeros(worth.shape[0])
        for index in np.unique(window):
            score += worth[:, window == index].max(axis=1)
        top = int(score.argmax())
        if score[top] > best_score:
            best_score, best_members = float(score[top]), np.flatnonzero(worth[top] > 0.0)
    chosen: dict[int, Candidate] = {}
    for i in best_members:
        item = candidates[i]
        if item.window not in chosen or item.likelihood > chosen[item.window].likelihood:
            chosen[item.window] = item
    return [chosen[index] for index in sorted(chosen)] or None


def _hypotheses(
    time: Array, offset: Array, sign: Array, window: NDArray[np.int_], max_drift: float
) -> tuple[Array, Array, Array]:
    """Lines through one candidate without slope, and through two of different windows."""
    first, second = np.triu_indices(time.size, 1)
    pairs = (window[first] != window[second]) & (sign[first] == sign[second])
    first, second = first[pairs], second[pairs]
    slope = (offset[second] - offset[first]) / (time[second] - time[first])
    allowed = np.abs(slope) <= max_drift
    first, slope = first[allowed], slope[allowed]
    levels = np.concatenate((offset, offset[first] - slope * time[first]))
    return levels, np.concatenate((np.zeros(time.size), slope)), np.concatenate((sign, sign[first]))

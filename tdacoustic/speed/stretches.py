"""Stretches in which tacho pulses come without a break, and why they break off: a standstill, or a lost signal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

__all__ = ["Break", "Stretches", "find_stretches"]

Array = NDArray[np.float64]

MOST_IN_A_ROW: Final = 10
"""Missing pulses in a row that may be put in by their neighbours [assumed]; more are a break."""
LONGER_THAN: Final = 1.5
"""A standstill's interval over the longer of its neighbours, at least [assumed]."""
SILENT_AT_END: Final = 3.0
"""Intervals without a pulse from which on the start or the end of a record counts as silent [assumed]."""
STOPS_WITHIN: Final = 2.0
"""Teeth within which the pulses' own deceleration brings the shaft to rest, where they end by standing [assumed]."""
CRAWL_HZ_S: Final = 0.05
"""Deceleration, in turns/s², that no train misses [assumed]: a shaft that it stops within a tooth may stand."""
NEIGHBOURS: Final = 5


@dataclass(frozen=True)
class Break:
    """A span of time without pulses.

    Parameters
    ----------
    first_s, last_s : float
        From pulse to pulse; the start or the end of the record where there is none.
    kind : str
        ``"stands"``: the pulses slow down into it and speed up from it as those of a shaft at rest. ``"lost"``: they do
        not, and the speed is not known.
    at : str
        ``"start"``, ``"inside"`` or ``"end"`` of the record.
    """

    first_s: float
    last_s: float
    kind: Literal["stands", "lost"]
    at: Literal["start", "inside", "end"]

    @property
    def words(self) -> str:
        """One sentence."""
        ends = {
            "start": f"before {self.last_s:.2f} s",
            "inside": f"from {self.first_s:.2f} s to {self.last_s:.2f} s",
            "end": f"after {self.first_s:.2f} s",
        }[self.at]
        if self.kind == "stands":
            turning = "; one tacho cannot tell in which direction it turns afterwards" if self.at == "inside" else ""
            return f"stands {ends}{turning}"
        return f"no pulses {ends}: the speed is not known there"


@dataclass(frozen=True)
class Stretches:
    """Edges in pieces without a break.

    Parameters
    ----------
    pieces : tuple of ndarray
        Instants of the edges of each piece.
    breaks : tuple of Break
        In the order of time.
    """

    pieces: tuple[Array, ...]
    breaks: tuple[Break, ...]


def find_stretches(edges: Array, pulses_per_rev: float, duration_s: float) -> Stretches:
    """Cut edges where no pulse comes for too long.

    Parameters
    ----------
    edges : ndarray, shape (n,)
        Instants after the first sample, rising.
    pulses_per_rev : float
    duration_s : float
        Length of the record.
    """
    if edges.size < 3:
        return Stretches((edges,), ())
    steps = np.diff(edges)
    breaks: list[Break] = []
    cuts: list[int] = []
    for at in np.flatnonzero(steps > LONGER_THAN * _typical(steps)):
        before, after = steps[max(0, at - NEIGHBOURS) : at], steps[at + 1 : at + 1 + NEIGHBOURS]
        stands = _comes_to_rest(before, pulses_per_rev) and _comes_to_rest(after[::-1], pulses_per_rev)
        if stands or steps[at] > (MOST_IN_A_ROW + 1.5) * _typical_at(steps, int(at)):
            kind: Literal["stands", "lost"] = "stands" if stands else "lost"
            breaks.append(Break(float(edges[at]), float(edges[at + 1]), kind, "inside"))
            cuts.append(int(at) + 1)
    first, last = steps[:NEIGHBOURS][::-1], steps[-NEIGHBOURS:]
    if edges[0] > SILENT_AT_END * float(np.max(first[-2:])):
        kind = "stands" if _comes_to_rest(first, pulses_per_rev) else "lost"
        breaks.insert(0, Break(0.0, float(edges[0]), kind, "start"))
    if duration_s - edges[-1] > SILENT_AT_END * float(np.max(last[-2:])):
        kind = "stands" if _comes_to_rest(last, pulses_per_rev) else "lost"
        breaks.append(Break(float(edges[-1]), duration_s, kind, "end"))
    return Stretches(tuple(np.split(edges, cuts)), tuple(breaks))


def _typical(steps: Array) -> Array:
    """The longest of the two intervals on each side of each; a double pulse makes one of a pair short."""
    padded = np.concatenate((steps[:1], steps[:1], steps, steps[-1:], steps[-1:]))
    padded[:2], padded[-2:] = 0.0, 0.0
    return np.asarray(np.maximum.reduce([padded[:-4], padded[1:-3], padded[3:-1], padded[4:]]))


def _typical_at(steps: Array, at: int) -> float:
    """The longer of the medians of the intervals before and after one."""
    sides = [steps[max(0, at - NEIGHBOURS) : at], steps[at + 1 : at + 1 + NEIGHBOURS]]
    return max((float(np.median(side)) for side in sides if side.size), default=float("inf"))


def _comes_to_rest(steps: Array, pulses_per_rev: float) -> bool:
    """Whether intervals, the last one next to the break, are those of a shaft that comes to rest within it."""
    if steps.size == 0:
        return False
    speeds = 1.0 / (pulses_per_rev * steps)
    slowest = float(speeds[-1])
    tooth = 1.0 / pulses_per_rev
    if slowest**2 <= 2.0 * CRAWL_HZ_S * tooth:
        return True
    if steps.size < 3 or not np.all(np.diff(steps[-3:]) > 0.0):
        return False
    # v² falls linearly with the angle at a constant deceleration; that of the middle of the last interval.
    deceleration = -0.5 * float(np.polyfit(tooth * np.arange(speeds.size), speeds**2, 1)[0])
    return deceleration > 0.0 and slowest**2 <= 2.0 * deceleration * (STOPS_WITHIN + 0.5) * tooth

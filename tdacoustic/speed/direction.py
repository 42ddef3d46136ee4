"""Direction of rotation from two tachos a part of a tooth apart."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.speed.stretches import Break
from tdacoustic.speed.tacho import TachoReading

__all__ = ["edge_directions", "signed_reading", "stands_between_edges"]

Array = NDArray[np.float64]

NEAREST_EDGE: Final = 0.08
"""Part of a tooth by which two tachos must stand apart to tell a direction [assumed; a quarter is usual]."""


def stands_between_edges(edges: Array, rising_beside: Array, falling_beside: Array) -> bool:
    """Return whether the edges of one tacho fall clearly between those of another one.

    Only then its state at an edge is sure; two tachos on different teeth, or on the same flank, tell no direction.

    Parameters
    ----------
    edges : ndarray, shape (n,)
    rising_beside, falling_beside : ndarray
        Edges of the other tacho, on the same time axis.
    """
    beside = np.sort(np.concatenate((rising_beside, falling_beside)))
    if edges.size < 5 or beside.size < 5:
        return False
    after = np.clip(np.searchsorted(beside, edges), 1, beside.size - 1)
    distance = np.minimum(np.abs(edges - beside[after - 1]), np.abs(beside[after] - edges))
    pitch = np.gradient(edges)
    return bool(np.percentile(distance / np.maximum(pitch, 1e-12), 2.0) >= NEAREST_EDGE)


def edge_directions(edges: Array, rising_beside: Array, falling_beside: Array) -> NDArray[np.int8]:
    """Return +1 or -1 for each edge of one tacho: whether the tacho beside it is low or high at that instant.

    Of a single flank (rising edges) the other tacho's state is the opposite when the shaft turns the other way. Which
    of both is forward, nobody says: +1 is the state of most edges. 0 stands before the first edge of the other tacho.

    Parameters
    ----------
    edges : ndarray, shape (n,)
    rising_beside, falling_beside : ndarray
        Edges of the other tacho, on the same time axis.
    """
    rose = np.searchsorted(rising_beside, edges, side="right") - 1
    fell = np.searchsorted(falling_beside, edges, side="right") - 1
    last_rise = np.where(rose >= 0, rising_beside[np.maximum(rose, 0)] if rising_beside.size else -np.inf, -np.inf)
    last_fall = np.where(fell >= 0, falling_beside[np.maximum(fell, 0)] if falling_beside.size else -np.inf, -np.inf)
    ways = np.where(last_rise > last_fall, -1, 1).astype(np.int8)
    ways[(rose < 0) & (fell < 0)] = 0
    return np.asarray(-ways if int(ways.sum()) < 0 else ways, dtype=np.int8)


def signed_reading(name: str, reading: TachoReading, ways: NDArray[np.int8]) -> TachoReading:
    """Return a reading with the speed negative where the shaft turns backwards, and when it does so in its notes.

    Parameters
    ----------
    name : str
        Of the channel beside, for messages.
    reading : TachoReading
    ways : ndarray, shape (m,)
        Of `edge_directions`, for the edges of the reading.

    Raises
    ------
    AnalysisError
        More than a tenth of the edges change their way alone: the two tachos do not belong together.
    """
    alone = int(np.sum((ways[1:-1] != ways[:-2]) & (ways[1:-1] != ways[2:])))
    if alone > 0.1 * max(1, ways.size):
        raise AnalysisError(f"tacho {name!r}: the direction changes at {alone} of {ways.size} edges")
    middle = np.concatenate((ways[:1], np.median(np.stack((ways[:-2], ways[1:-1], ways[2:])), axis=0), ways[-1:]))
    nearest = np.clip(np.searchsorted(reading.edges_s, reading.times_s), 0, reading.edges_s.size - 1)
    turned = np.flatnonzero(np.diff(np.where(middle < 0, -1, 1)))
    notes = tuple(
        f"turns {'backwards' if middle[at + 1] < 0 else 'forwards'} from {reading.edges_s[at + 1]:.2f} s on"
        for at in turned
    )
    kept = tuple(
        note.replace("; one tacho cannot tell in which direction it turns afterwards", "") for note in reading.notes
    )
    way = np.where(middle[nearest] < 0, -1.0, 1.0)
    return replace(reading, speed=reading.speed * way, breaks=_with_turns(reading, turned), notes=(*kept, *notes))


def _with_turns(reading: TachoReading, turned: NDArray[np.intp]) -> tuple[Break, ...]:
    """The breaks, and one at each turn that is none yet: the angle does not go on through it."""
    found = list(reading.breaks)
    for at in turned:
        first, last = float(reading.edges_s[at]), float(reading.edges_s[at + 1])
        if not any(item.first_s <= first and item.last_s >= last for item in found):
            found.append(Break(first, last, "stands", "inside"))
    return tuple(sorted(found, key=lambda item: item.first_s))

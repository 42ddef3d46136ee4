"""Edges of one direction of a tacho, mended stretch by stretch, with the angle of the shaft at each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.speed.jitter import edge_jitter_s
from tdacoustic.speed.mending import clean_edges
from tdacoustic.speed.stretches import Break, find_stretches
from tdacoustic.speed.teeth import GapWheel, ToothPattern, find_gap_wheel, tooth_pattern

__all__ = ["MendedEdges", "fits_wheel", "is_better", "mend_edges"]

Array = NDArray[np.float64]

FALLING_BELOW: Final = 0.8
"""Falling edges are taken where their jitter is below this part of that of the rising ones [assumed]."""
SHARP_SAMPLES: Final = 0.3
"""Jitter in samples up to which rising edges are as sharp as sampling leaves any: 1/sqrt(12) of one is 0.29."""

UNEVEN: Final = "uneven teeth"


@dataclass(frozen=True)
class MendedEdges:
    """Edges of one direction, mended stretch by stretch, with their angle.

    Parameters
    ----------
    pieces, turns : tuple of ndarray
        Instants of the edges of each stretch, put-in ones included, and the turns from about 0 in each.
    put_in : tuple of ndarray of bool
        Which edges were put in.
    breaks : tuple of Break
    missing, double : int
        Edges put in and taken out, without those of a wheel's own gap.
    pulses_per_rev : float
        Positions of the wheel that a turn has, missing teeth counted.
    wheel : GapWheel or None
    pattern : ToothPattern or None
        Where it was taken off.
    jitter_s : float
    notes : tuple of str
    """

    pieces: tuple[Array, ...]
    turns: tuple[Array, ...]
    put_in: tuple[NDArray[np.bool_], ...]
    breaks: tuple[Break, ...]
    missing: int
    double: int
    pulses_per_rev: float
    wheel: GapWheel | None
    pattern: ToothPattern | None
    jitter_s: float
    notes: tuple[str, ...]


def mend_edges(edges: Array, pulses_per_rev: float, duration_s: float) -> MendedEdges:
    """Return edges cut into stretches and mended, with the wheel that made them.

    Parameters
    ----------
    edges : ndarray, shape (n,)
        Instants after the first sample, rising.
    pulses_per_rev : float
    duration_s : float
        Length of the record.
    """
    found = find_stretches(edges, pulses_per_rev, duration_s)
    cleaned = [clean_edges(piece) for piece in found.pieces]
    pieces = tuple(item.times_s for item in cleaned)
    put_in = tuple(~np.isin(item.times_s, edges) for item in cleaned)
    missing, double = sum(item.missing for item in cleaned), sum(item.double for item in cleaned)
    notes: list[str] = [item.words for item in found.breaks]
    wheel = find_gap_wheel(put_in)
    if wheel is not None:
        missing = max(0, missing - wheel.missing * wheel.marks)
        positions, note = _positions(wheel, pulses_per_rev)
        pulses_per_rev = positions
        notes.append(note)
    pattern = None
    if pulses_per_rev >= 2 and float(pulses_per_rev).is_integer():
        pattern = tooth_pattern(pieces, int(pulses_per_rev))
        pattern = pattern if pattern is not None and pattern.is_uneven else None
    if pattern is not None:
        notes.append(
            f"{UNEVEN}: {100.0 * pattern.rms_of_pitch:.2g} % of a pitch rms over {pattern.turns} turns, taken off; "
            "a torsion that repeats with each turn goes with it"
        )
    turns = tuple(
        np.arange(piece.size) / pulses_per_rev if pattern is None else pattern.turns_of(index, piece.size)
        for index, piece in enumerate(pieces)
    )
    jitter = edge_jitter_s(pieces, turns)
    return MendedEdges(
        pieces, turns, put_in, found.breaks, missing, double, pulses_per_rev, wheel, pattern, jitter, tuple(notes)
    )


def _positions(wheel: GapWheel, pulses_per_rev: float) -> tuple[float, str]:
    """Positions of a wheel with gaps that make a turn, and what to say of it."""
    teeth = wheel.positions - wheel.missing
    words = f"{wheel.missing} of every {wheel.positions} teeth are missing by design"
    if fits_wheel(wheel, pulses_per_rev):
        return pulses_per_rev, words
    marks = pulses_per_rev / teeth
    if abs(marks - round(marks)) < 1e-9:
        positions = float(round(marks) * wheel.positions)
        return positions, f"{words}: pulses_per_rev = {pulses_per_rev:g} counts the teeth, {positions:g} are taken"
    return pulses_per_rev, f"{words}, which pulses_per_rev = {pulses_per_rev:g} does not fit"


def fits_wheel(wheel: GapWheel, pulses_per_rev: float) -> bool:
    """Return whether a whole number of marks makes a turn."""
    return abs(pulses_per_rev / wheel.positions - round(pulses_per_rev / wheel.positions)) < 1e-9


def is_better(other: MendedEdges, first: MendedEdges, sample_rate_hz: float) -> bool:
    """Return whether the edges of the other direction need less mending, or scatter less after the same."""
    own, others = first.missing + first.double, other.missing + other.double
    if abs(others - own) > 2 + 0.01 * sum(piece.size for piece in first.pieces):
        return others < own
    if first.jitter_s * sample_rate_hz <= SHARP_SAMPLES:
        return False
    return bool(other.jitter_s < FALLING_BELOW * first.jitter_s)

"""The wheel of a tacho: teeth that are not evenly spaced, and gaps that are made on purpose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

__all__ = ["GapWheel", "ToothPattern", "find_gap_wheel", "tooth_pattern"]

Array = NDArray[np.float64]

FEWEST_TURNS: Final = 8
"""Turns over which a tooth is averaged, at least [assumed]."""
WORTH: Final = 1e-3
"""Rms deviation over the pitch below which teeth count as even [assumed]."""
SURE: Final = 3.0
"""Rms deviation over its standard error, at least [assumed]."""
FEWEST_GAPS: Final = 4
REPEATS: Final = 0.8
"""Part of a wheel's gaps that come at one distance, at least [assumed]."""


@dataclass(frozen=True)
class ToothPattern:
    """Where the teeth of a wheel stand.

    Parameters
    ----------
    deviation_turns : ndarray, shape (pulses_per_rev,)
        Angle of each tooth beyond its even place, in turns; their mean is 0.
    error_turns : float
        Standard error of one of them.
    turns : int
        Over which they were averaged.
    first_teeth : tuple of (int or None)
        Which tooth each stretch begins with; None where it is too short to tell.
    """

    deviation_turns: Array
    error_turns: float
    turns: int
    first_teeth: tuple[int | None, ...]

    @property
    def rms_of_pitch(self) -> float:
        """Rms deviation over the pitch."""
        return float(np.sqrt(np.mean(self.deviation_turns**2)) * self.deviation_turns.size)

    @property
    def is_uneven(self) -> bool:
        """Whether the deviations are worth taking off, and surely not scatter."""
        rms = float(np.sqrt(np.mean(self.deviation_turns**2)))
        return self.rms_of_pitch > WORTH and rms > SURE * self.error_turns

    def turns_of(self, stretch: int, count: int) -> Array:
        """Return the angle of the edges of a stretch, from about 0."""
        teeth = self.deviation_turns.size
        place = np.arange(count)
        first = self.first_teeth[stretch]
        if first is None:
            return np.asarray(place / teeth)
        return np.asarray(place / teeth + self.deviation_turns[(place + first) % teeth])


def tooth_pattern(pieces: Sequence[Array], teeth: int) -> ToothPattern | None:
    """Estimate where the teeth of a wheel stand, over turns; None where there are too few turns.

    A tooth's deviation is how late it comes beside the mean of the whole turn around it, times the speed. What repeats
    with each turn of the shaft is taken for the wheel's: a torsion that does so cannot be told from it. Stretches are
    brought to one another by the turn that fits best.

    Parameters
    ----------
    pieces : sequence of ndarray
        Instants of the edges of each stretch, missing ones put in.
    teeth : int
        At least 2.
    """
    parts = [(index, *_lateness(edges, teeth)) for index, edges in enumerate(pieces) if edges.size >= 4 * teeth]
    if not parts:
        return None
    parts.sort(key=lambda part: -part[1].shape[0])
    firsts: dict[int, int | None] = dict.fromkeys(range(len(pieces)))
    lead, table, first = parts[0]
    firsts[lead] = first
    gathered = [table]
    for index, other, start in parts[1:]:
        mean = np.median(gathered[0], axis=0)
        fits = [float(mean @ np.roll(np.median(other, axis=0), shift)) for shift in range(teeth)]
        shift = int(np.argmax(fits))
        gathered.append(np.roll(other, shift, axis=1))
        firsts[index] = (start + shift) % teeth
    deviations = np.concatenate(gathered)
    turns = deviations.shape[0]
    if turns < FEWEST_TURNS:
        return None
    middle = np.median(deviations, axis=0)
    middle -= middle.mean()
    scatter = 1.4826 * np.median(np.abs(deviations - np.median(deviations, axis=0)))
    return ToothPattern(middle, float(1.2533 * scatter / np.sqrt(turns)), turns, tuple(firsts.values()))


def _lateness(edges: Array, teeth: int) -> tuple[Array, int]:
    """Deviation of each tooth in each whole turn, shape (turns, teeth), in turns; and the place of the first edge."""
    weights = np.ones(teeth) / teeth if teeth % 2 else np.concatenate(([0.5], np.ones(teeth - 1), [0.5])) / teeth
    half = weights.size // 2
    late = edges[half : edges.size - half] - np.convolve(edges, weights, mode="valid")
    late = late[half : late.size - half] - np.convolve(late, weights, mode="valid")  # what an acceleration left in it
    whole = late.size // teeth
    inner = edges[half : edges.size - half]
    lasts = inner[2 * half :] - inner[: inner.size - 2 * half]  # how long the 2 half intervals around it take
    table = (late * (2.0 * half / teeth) / lasts)[: whole * teeth].reshape(whole, teeth)
    # The table's first tooth is 0; the first edge comes two halves of a turn before.
    return table - table.mean(axis=1, keepdims=True), (-2 * half) % teeth


@dataclass(frozen=True)
class GapWheel:
    """A wheel with a mark of missing teeth.

    Parameters
    ----------
    positions : int
        From mark to mark, missing teeth counted.
    missing : int
        Teeth that are missing in a mark.
    marks : int
        Marks that were found.
    """

    positions: int
    missing: int
    marks: int


def find_gap_wheel(put_in: Sequence[NDArray[np.bool_]]) -> GapWheel | None:
    """Recognise a wheel such as 60-2 by gaps that come at one distance; None where gaps are faults.

    Parameters
    ----------
    put_in : sequence of ndarray of bool
        Of each stretch, which edges had to be put in.
    """
    distances: list[int] = []
    lengths: list[int] = []
    for mask in put_in:
        change = np.diff(np.concatenate(([0], mask.astype(np.int8), [0])))
        starts, ends = np.flatnonzero(change == 1), np.flatnonzero(change == -1)
        lengths += (ends - starts).tolist()
        distances += np.diff(starts).tolist()
    if len(lengths) < FEWEST_GAPS or not distances:
        return None
    positions, missing = (max(set(values), key=values.count) for values in (distances, lengths))
    agree = min(distances.count(positions) / len(distances), lengths.count(missing) / len(lengths))
    if agree < REPEATS or positions <= 2 * missing:
        return None
    return GapWheel(int(positions), int(missing), len(lengths))

"""Families of harmonics among lines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from tdacoustic.lines.detection import Line

__all__ = ["Family", "find_families"]

MAX_HARMONIC = 20
MAX_DIVISOR = 3
"""The lowest line seen may be at most this harmonic of its family."""
LOWEST_FUNDAMENTAL_HZ = 10.0
CHANCE = 5e-3
"""Probability of as good a match among lines placed at random, at most."""
MIN_MEMBERS = 3
SIGMAS = 3.0


@dataclass(frozen=True)
class Family:
    """Lines at whole multiples of one fundamental.

    Parameters
    ----------
    fundamental_hz : float
        By least squares over its members, each by its own uncertainty.
    members : tuple of (int, int)
        Index of the line and number of the harmonic.
    chance : float
        Probability of as many matches among lines placed at random.
    """

    fundamental_hz: float
    members: tuple[tuple[int, int], ...]
    chance: float


def _members(
    frequencies: np.ndarray, tolerances: np.ndarray, fundamental: float, error: float
) -> tuple[list[tuple[int, int]], float]:
    """Lines at harmonics of a fundamental, and the expected number of such among random lines."""
    harmonic = np.maximum(1, np.round(frequencies / fundamental)).astype(int)
    allowed = np.minimum(tolerances + SIGMAS * error * harmonic, 0.25 * fundamental)
    fits = (np.abs(frequencies - harmonic * fundamental) <= allowed) & (harmonic <= MAX_HARMONIC)
    chance_each = float(np.mean(2.0 * allowed / fundamental))
    found: dict[int, int] = {}
    for index in np.flatnonzero(fits):
        number = int(harmonic[index])
        best = found.get(number)
        if best is None or abs(frequencies[index] - number * fundamental) < abs(
            frequencies[best] - number * fundamental
        ):
            found[number] = int(index)
    return [(index, number) for number, index in sorted(found.items())], chance_each


def _refined(frequencies: np.ndarray, errors: np.ndarray, members: list[tuple[int, int]]) -> tuple[float, float]:
    index = np.array([member[0] for member in members])
    number = np.array([member[1] for member in members], dtype=float)
    weight = (number / errors[index]) ** 2
    return float(np.sum(weight * frequencies[index] / number) / weight.sum()), float(1.0 / np.sqrt(weight.sum()))


def find_families(lines: Sequence[Line], resolution_hz: float) -> tuple[Family, ...]:
    """Group lines into families of harmonics, the least accidental first.

    A family has at least three members, one of them among the first two
    harmonics, and is less likely by chance than one in two hundred, the number
    of fundamentals tried counted in. A line belongs to one family at most.

    Parameters
    ----------
    lines : sequence of Line
    resolution_hz : float
        Line spacing of the spectrum; a tenth of it is the least tolerance.
    """
    frequencies = np.array([line.frequency_hz for line in lines])
    errors = np.array([max(line.frequency_error_hz, 0.02 * resolution_hz) for line in lines])
    tolerances = SIGMAS * errors + 0.1 * resolution_hz
    free = np.ones(len(lines), dtype=bool)
    families: list[Family] = []
    while free.sum() >= MIN_MEMBERS:
        best: Family | None = None
        candidates = [
            (frequencies[index] / divisor, errors[index] / divisor)
            for index in np.flatnonzero(free)
            for divisor in range(1, MAX_DIVISOR + 1)
            if frequencies[index] / divisor >= LOWEST_FUNDAMENTAL_HZ
        ]
        usable = np.flatnonzero(free)
        for fundamental, error in candidates:
            local, _ = _members(frequencies[usable], tolerances[usable], fundamental, error)
            if len(local) < MIN_MEMBERS:
                continue
            members = [(int(usable[index]), number) for index, number in local]
            fundamental, error = _refined(frequencies, errors, members)
            local, chance_each = _members(frequencies[usable], tolerances[usable], fundamental, error)
            members = [(int(usable[index]), number) for index, number in local]
            if len(members) < MIN_MEMBERS or members[0][1] > 2:
                continue
            harmonics_open = usable.size - 1
            chance = float(stats.binom.sf(len(members) - 2, harmonics_open, chance_each)) * len(candidates)
            if chance < CHANCE and (best is None or (chance, -fundamental) < (best.chance, -best.fundamental_hz)):
                best = Family(fundamental, tuple(members), chance)
        if best is None:
            break
        families.append(best)
        free[[index for index, _ in best.members]] = False
    return tuple(families)

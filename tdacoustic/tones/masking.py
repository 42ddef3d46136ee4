"""Levels of tones and of the noise that masks them: the formulas of ISO/PAS 20065:2016 and DIN 45681:2005.

The texts are sold, not public; the formulas are as phonometry (MIT) read them, and hold on the printed examples.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from tdacoustic.tones.critical_bands import critical_bandwidth_hz, geometric_band, separation_hz

__all__ = [
    "HANN_FACTOR",
    "TONE_OVER_DB",
    "audibility_uncertainty_db",
    "combined_level_db",
    "energy",
    "groups_of",
    "is_distinct",
    "mean_narrow_band_level_db",
    "relative_spread",
    "tone_extent",
    "tone_level_db",
    "uncertainty_of_spread_db",
]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

TONE_OVER_DB: Final = 6.0
"""A line belongs to a tone, and not to the noise, from this much over the mean narrow-band level (5.3.2, 5.3.3)."""
WITHIN_PEAK_DB: Final = 10.0
"""Lines of a tone lie less than this below its highest (5.3.3)."""
CONVERGED_DB: Final = 0.005
LEAST_SIDE_LINES: Final = 5
"""The iteration of the mean narrow-band level ends where fewer lines than this are left on one side (annex D)."""
HANN_FACTOR: Final = 1.5
"""Effective bandwidth of a Hann window over the line spacing (annex A)."""
STEEPNESS_DB: Final = 24.0
"""Least steepness of a distinct tone's edges, per octave (5.3.4)."""
TWO_TONES_BELOW_HZ: Final = 1000.0
LEVEL_SIGMA_DB: Final = 3.0
"""Standard deviation that clause 6 gives every line."""
COVERAGE: Final = 1.645
"""Of a two-sided interval of 90 % (clause 6)."""


def energy(levels_db: Array) -> Array:
    """Return the energies of levels, relative to the reference."""
    return np.asarray(10.0 ** (0.1 * levels_db))


def mean_narrow_band_level_db(
    levels_db: Array, band: tuple[int, int], peak: int, hann_factor: float = HANN_FACTOR
) -> tuple[float, Indices]:
    """Return the mean narrow-band level of the masking noise, and the lines it was taken over.

    Formula (6) and annex D: the energy mean of the lines of the critical band but that of the tone; lines more than
    6 dB over the result are left out and the mean is taken again, until it changes by less than 0.005 dB or fewer
    than five lines are left on one side. The window's effective bandwidth is taken off.

    Parameters
    ----------
    levels_db : ndarray, shape (n,)
        Of all lines.
    band : (int, int)
        First line of the critical band, and the one behind its last.
    peak : int
        The tone's line.
    """
    kept = np.delete(np.arange(*band), peak - band[0])
    level = _mean_level(levels_db, kept, hann_factor)
    while True:
        fewer = kept[levels_db[kept] <= level + TONE_OVER_DB]
        sides = np.count_nonzero(fewer < peak), np.count_nonzero(fewer > peak)
        if fewer.size == kept.size or min(sides) < LEAST_SIDE_LINES:
            return level, kept
        kept = fewer
        before, level = level, _mean_level(levels_db, kept, hann_factor)
        if abs(level - before) <= CONVERGED_DB:
            return level, kept


def _mean_level(levels_db: Array, lines: Indices, hann_factor: float) -> float:
    return float(10.0 * np.log10(np.mean(energy(levels_db[lines])) / hann_factor))


def tone_extent(levels_db: Array, peak: int, mean_level_db: float) -> tuple[int, int]:
    """Return the first and last line of a tone: those next to its highest over both thresholds (5.3.3)."""
    least = max(mean_level_db + TONE_OVER_DB, levels_db[peak] - WITHIN_PEAK_DB)
    first = last = peak
    while first > 0 and levels_db[first - 1] > least:
        first -= 1
    while last < levels_db.size - 1 and levels_db[last + 1] > least:
        last += 1
    return first, last


def tone_level_db(levels_db: Array, lines: Sequence[int] | Indices, hann_factor: float = HANN_FACTOR) -> float:
    """Return the level of a tone from its lines: formula (7) for one line, (8) for several."""
    chosen = levels_db[np.asarray(lines)]
    if chosen.size == 1:
        return float(chosen[0])
    return float(10.0 * np.log10(np.sum(energy(chosen)) / hann_factor))


def combined_level_db(levels_db: Array, extents: Sequence[tuple[int, int]], hann_factor: float = HANN_FACTOR) -> float:
    """Return the level of several tones together, lines that they share counted once (formula (17))."""
    lines = sorted({line for first, last in extents for line in range(first, last + 1)})
    return tone_level_db(levels_db, lines, hann_factor)


def is_distinct(
    levels_db: Array, step_hz: float, peak: int, extent: tuple[int, int], print_of: Literal["din", "iso"]
) -> bool:
    """Return whether a tone is narrow and steep enough to be heard as one (5.3.4).

    Formulas (10) and (11) take ``f_T / sqrt(2)`` on both sides in DIN 45681 and its reference program, ``f_T / 2``
    below and ``f_T`` above in the print of ISO/PAS 20065:2016 (phonometry, list of errata). The first is used.
    """
    first, last = extent
    frequency_hz = peak * step_hz
    if (last - first + 1) * step_hz > 26.0 * (1.0 + 0.001 * frequency_hz):  # formula (9)
        return False
    below, above = (math.sqrt(0.5), math.sqrt(0.5)) if print_of == "din" else (0.5, 1.0)
    for factor, edge in ((below, first - 1), (above, last + 1)):
        if not 0 <= edge < levels_db.size:
            continue
        drop_db = levels_db[peak] - levels_db[edge]
        if factor * frequency_hz * drop_db / (abs(peak - edge) * step_hz) < STEEPNESS_DB:
            return False
    return True


def audibility_uncertainty_db(
    tone_levels_db: Array, noise_levels_db: Array, frequency_hz: float, line_spacing_hz: float
) -> float:
    """Return half of the 90 % interval of an audibility (clause 6, formulas (22) to (27) and (29)).

    Parameters
    ----------
    tone_levels_db : ndarray
        Levels of the tone's lines; for a group the levels of its tones.
    noise_levels_db : ndarray
        Levels of the lines of the mean narrow-band level.
    """
    spread = relative_spread(tone_levels_db) + relative_spread(noise_levels_db)
    return uncertainty_of_spread_db(spread, frequency_hz, line_spacing_hz)


def relative_spread(levels_db: Array) -> float:
    """Return the sum of squared energies over the square of their sum: one over the number of equal levels."""
    part = energy(np.asarray(levels_db, dtype=np.float64))
    return float(np.sum(part**2) / np.sum(part) ** 2)


def uncertainty_of_spread_db(spread: float, frequency_hz: float, line_spacing_hz: float) -> float:
    """Return what `audibility_uncertainty_db` does, from the relative spreads of tone and noise added up."""
    width = 4.34 * line_spacing_hz / critical_bandwidth_hz(frequency_hz)
    return COVERAGE * math.sqrt(spread * LEVEL_SIGMA_DB**2 + width**2)


def groups_of(line_hz: Sequence[float], audibility_db: Sequence[float]) -> tuple[tuple[int, tuple[int, ...]], ...]:
    """Return which tones are heard as one: the leading tone and all members (5.3.8, step 3).

    A group is made around each tone that is the most audible of its own critical band. Exactly two tones below
    1 kHz that lie further apart than `separation_hz` stay two (formulas (18) and (19)).
    """
    found = []
    for leading, frequency_hz in enumerate(line_hz):
        low, high = geometric_band(frequency_hz)
        members = tuple(index for index, other in enumerate(line_hz) if low <= other <= high)
        if len(members) < 2 or any(audibility_db[index] > audibility_db[leading] for index in members):
            continue
        if len(members) == 2 and max(line_hz[index] for index in members) < TWO_TONES_BELOW_HZ:
            apart = abs(line_hz[members[0]] - line_hz[members[1]])
            if apart > separation_hz(frequency_hz):
                continue
        found.append((leading, members))
    return tuple(found)

"""The shape of the level around a drive, and how alike the shapes of two speeds or helix angles are."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive.prediction import Directivity

__all__ = ["FLAT_DB", "SHAPED_DB", "Pattern", "PatternPair", "least_alike", "pattern_of", "pattern_pairs", "range_db"]

Real = NDArray[np.float64]

FLAT_DB: Final = 0.05
"""Between the loudest and the quietest direction, below which a level is the same all around as it is printed."""

SHAPED_DB: Final = 1.0
"""From which a pattern counts as one with a shape, to be compared with others [assumed]."""


@dataclass(frozen=True)
class Pattern:
    """The level around a drive in a few numbers.

    Parameters
    ----------
    sweep : {"speed", "helix"}
    value : float
        Train speed in km/h, or helix angle in degrees.
    mean_db : float
        Mean in energy around the circle; NaN of no sound, as all that follows.
    loudest_db, quietest_db, range_db : float
        Of the directions computed, and their difference.
    loudest_deg, quietest_deg : float
        Where they are; NaN where the level is the same all around.
    """

    sweep: Literal["speed", "helix"]
    value: float
    mean_db: float
    loudest_db: float
    loudest_deg: float
    quietest_db: float
    quietest_deg: float
    range_db: float


@dataclass(frozen=True)
class PatternPair:
    """How alike the patterns of two speeds, or of two helix angles, are.

    Parameters
    ----------
    sweep : {"speed", "helix"}
    first, second : float
        Their values.
    correlation : float
        Pearson's, of the two series of levels in dB, each less its mean over the directions: 1 is the same shape
        whatever its height and depth. NaN where one of them is the same all around.
    difference_db : float
        Rms of the difference of the two, each less its mean: 0 is the same shape with the same depth.
    both_shaped : bool
        Whether both range over `SHAPED_DB` or more; a correlation of flatter ones says little.
    """

    sweep: Literal["speed", "helix"]
    first: float
    second: float
    correlation: float
    difference_db: float
    both_shaped: bool


def range_db(level_db: Real) -> float:
    """Return the difference of the loudest and the quietest direction; NaN where one of them has no sound."""
    return float(np.ptp(level_db)) if np.isfinite(level_db).all() else math.nan


def pattern_of(around: Directivity) -> Pattern:
    """Return the numbers of the level around a drive."""
    levels = around.level_db
    if not np.isfinite(levels).all():
        return Pattern(around.sweep, around.value, *(math.nan,) * 6)
    loudest, quietest = int(levels.argmax()), int(levels.argmin())
    flat = range_db(levels) < FLAT_DB
    at = [math.nan if flat else float(around.angle_deg[place]) for place in (loudest, quietest)]
    mean = 10.0 * math.log10(float(np.mean(10.0 ** (0.1 * levels))))
    high, low = float(levels[loudest]), float(levels[quietest])
    return Pattern(around.sweep, around.value, mean, high, at[0], low, at[1], high - low)


def pattern_pairs(arounds: Sequence[Directivity]) -> tuple[PatternPair, ...]:
    """Return the comparison of each two speeds, and of each two helix angles; those without sound are left out.

    Parameters
    ----------
    arounds : sequence of Directivity
        On the same directions.
    """
    found = []
    for sweep in ("speed", "helix"):
        held = [around for around in arounds if around.sweep == sweep and np.isfinite(around.level_db).all()]
        held.sort(key=lambda around: around.value)
        found += [_pair(first, second) for first, second in itertools.combinations(held, 2)]
    return tuple(found)


def _pair(first: Directivity, second: Directivity) -> PatternPair:
    levels = (first.level_db, second.level_db)
    a, b = (values - values.mean() for values in levels)
    ranges = [range_db(values) for values in levels]
    scale = math.sqrt(float(a @ a) * float(b @ b))
    alike = float(a @ b) / scale if min(ranges) >= FLAT_DB else math.nan
    apart = math.sqrt(float(np.mean((a - b) ** 2)))
    return PatternPair(first.sweep, first.value, second.value, alike, apart, min(ranges) >= SHAPED_DB)


def least_alike(levels_db: Real) -> float:
    """Return the lowest correlation among the pairs of several patterns; see `PatternPair`.

    Parameters
    ----------
    levels_db : ndarray, shape (patterns, directions)
        Patterns with a direction without sound, and those that range over less than `SHAPED_DB`, are left out.

    Returns
    -------
    float
        NaN of fewer than two.
    """
    shaped = [levels for levels in levels_db if range_db(levels) >= SHAPED_DB]
    return float(np.corrcoef(shaped).min()) if len(shaped) > 1 else math.nan

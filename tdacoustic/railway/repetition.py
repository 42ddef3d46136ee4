"""Several runs of one test: how many, how far apart, their mean and its rounding; positions; uncertainty."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from tdacoustic.errors import AnalysisError
from tdacoustic.railway.rules import UNVERIFIED, Standard

__all__ = [
    "END_POSITION_LENGTH_M",
    "Repetition",
    "Uncertainty",
    "decisive",
    "expanded_uncertainty_db",
    "repetition",
    "rounded_db",
    "unit_level_db",
]

END_POSITION_LENGTH_M: Final = 0.5 * math.pi * 7.5
"""Length that a position off a unit's end stands for (ISO 3095:2013, 5.7, read by phonometry)."""


@dataclass(frozen=True)
class Repetition:
    """The runs of one position.

    Parameters
    ----------
    levels_db : tuple of float
        Of the runs that count.
    mean_db : float or None
        Arithmetic mean; None without a run.
    spread_db : float or None
        Highest minus lowest.
    reported_db : int or None
        The mean rounded to a whole decibel; None where the runs are not valid.
    valid : bool
        Enough runs, close enough together.
    reason : str or None
        Why not.
    outliers : tuple of int
        Runs farther from the median than the allowed spread: the ones to look at, none is left out.
    """

    levels_db: tuple[float, ...]
    mean_db: float | None
    spread_db: float | None
    reported_db: int | None
    valid: bool
    reason: str | None
    outliers: tuple[int, ...] = ()


def rounded_db(level_db: float) -> int:
    """Round to a whole decibel; a half goes up, also one that binary arithmetic puts a hair below.

    The standard says "nearest integer" without a rule for the half (phonometry).

    Examples
    --------
    >>> rounded_db(81.5), rounded_db((70.1 + 70.3 + 71.1) / 3), rounded_db(81.49)
    (82, 71, 81)
    """
    return math.floor(level_db + 0.5 + 1e-9)


def repetition(levels_db: Sequence[float], standard: Standard) -> Repetition:
    """Judge the runs of one position by the standard's repetition rule.

    Runs that lie too far apart are not sifted: ISO 3095:2013, 9.3, asks for more runs until they are valid, and how
    to choose among more than three is not known here.

    Examples
    --------
    >>> from tdacoustic.railway import ISO_3095_2013
    >>> repetition([81.3, 82.1, 81.6], ISO_3095_2013).reported_db
    82
    """
    levels = tuple(float(level) for level in levels_db)
    if not levels:
        return Repetition((), None, None, None, False, "no run with a level")
    mean = math.fsum(levels) / len(levels)
    spread = max(levels) - min(levels)
    runs, allowed = standard.rule("runs"), standard.rule("spread_db")
    mark = "" if allowed.verified and runs.verified else f" {UNVERIFIED}"
    middle = float(np.median(levels))
    outliers = tuple(i for i, level in enumerate(levels) if abs(level - middle) > allowed.value)
    reason = None
    if len(levels) < runs.value:
        reason = f"{len(levels)} of at least {runs.value:g} runs{mark}"
    elif spread > allowed.value + 1e-9:
        reason = f"runs lie {spread:.1f} dB apart, {allowed.value:g} dB are allowed: more runs are needed{mark}"
    valid = reason is None
    return Repetition(levels, mean, spread, rounded_db(mean) if valid else None, valid, reason, outliers)


def decisive(positions: Mapping[str, Repetition]) -> tuple[str, int] | None:
    """Return the position with the highest reported level, and that level (6.7.1, 7.5.4, 8.7); None without any.

    At constant speed the positions are the two sides, and the louder one is the result.
    """
    reported = {name: runs.reported_db for name, runs in positions.items() if runs.reported_db is not None}
    if not reported:
        return None
    name = max(reported, key=lambda key: reported[key])
    return name, reported[name]


def unit_level_db(levels_db: Sequence[float], lengths_m: Sequence[float]) -> float:
    """Return the level of a standing unit: energy mean of its positions, each by the length it stands for.

    ISO 3095:2013, 5.7, formulas (1) and (2).

    Raises
    ------
    AnalysisError
        No position, unequal numbers, or a length that is not above zero.
    """
    if len(levels_db) != len(lengths_m) or not levels_db or min(lengths_m) <= 0.0:
        raise AnalysisError(
            f"a unit's level takes a length above zero for each level, got {len(levels_db)} for {list(lengths_m)}"
        )
    weights = np.asarray(lengths_m, dtype=np.float64)
    energy = 10.0 ** (0.1 * np.asarray(levels_db, dtype=np.float64))
    return float(10.0 * np.log10(energy @ weights / weights.sum()))


@dataclass(frozen=True)
class Uncertainty:
    """A level with the budget of annex G: corrected level, standard and expanded uncertainty."""

    level_db: float
    standard_db: float
    expanded_db: float


def expanded_uncertainty_db(
    reading_db: float, corrections_db: Sequence[float], uncertainties_db: Sequence[float], coverage: float = 2.0
) -> Uncertainty:
    """Combine an uncertainty budget (ISO 3095:2013, annex G: formulas G.1, G.5 and G.6).

    Parameters
    ----------
    reading_db : float
    corrections_db : sequence of float
        Mean value of each input's correction.
    uncertainties_db : sequence of float
        Standard uncertainty of each input; of one known by its limits +-a it is a / sqrt(3).
    coverage : float
    """
    standard = math.sqrt(math.fsum(value**2 for value in uncertainties_db))
    return Uncertainty(reading_db + math.fsum(corrections_db), standard, coverage * standard)

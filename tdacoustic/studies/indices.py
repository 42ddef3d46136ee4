"""How much of a result's variation each input makes: regression on it, and indices from its variance.

Pure functions of arrays. Intervals are percentiles of a bootstrap with a seed, so that the same numbers give the same
intervals.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "CONFIDENCE",
    "FEWEST_ROWS",
    "NO_CHANGE",
    "RESAMPLES",
    "Estimate",
    "Regression",
    "regression_of",
    "variance_indices",
]

Real = NDArray[np.float64]

CONFIDENCE: Final = 0.95
RESAMPLES: Final = 500
"""Of a bootstrap."""

FEWEST_ROWS: Final = 16
"""Rows of a design, or base points of Saltelli's, from which anything is said [assumed]; a regression also needs three
for each input."""

NO_CHANGE: Final = 1e-9
"""Range of a result, in its unit, up to which it does not vary."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """One number for each input, with its interval.

    Parameters
    ----------
    value, low, high : ndarray, shape (inputs,)
        The interval holds `CONFIDENCE`; NaN of what cannot be said.
    """

    value: Real
    low: Real
    high: Real


@dataclass(frozen=True, eq=False)
class Regression:
    """How a result follows its inputs along a straight line.

    Parameters
    ----------
    slope : Estimate
        Change of the result while an input passes from 0 to 1, in the result's unit.
    standardised : Estimate
        Standardised regression coefficients: the slopes in standard deviations of the result per one of the input.
        Their squares add up to `explained` where the inputs are independent.
    rank : Estimate
        Spearman's rank correlation with each input.
    explained : float
        R²: the part of the result's variance that the straight line has.
    explained_ranks : float
        R² of the same between ranks; above the other where the result bends, but only ever rises or falls.
    """

    slope: Estimate
    standardised: Estimate
    rank: Estimate
    explained: float
    explained_ranks: float


def regression_of(inputs: Real, result: Real, seed: int) -> Regression | None:
    """Return the regression of a result on its inputs; None of too few rows, or of a result that does not vary.

    Of an input that does not vary nothing is said: its numbers are NaN.

    The intervals resample rows as if they were independent. Those of a Latin hypercube are spread more evenly, so that
    theirs are rather too wide.

    Parameters
    ----------
    inputs : ndarray, shape (rows, inputs)
        Each from 0 to 1.
    result : ndarray, shape (rows,)
    seed : int
        Of the bootstrap.
    """
    rows, count = inputs.shape
    if rows < max(FEWEST_ROWS, 3 * count) or np.ptp(result) <= NO_CHANGE:
        return None
    varies = np.ptp(inputs, axis=0) > 0.0
    plain = np.column_stack([(inputs - inputs.mean(axis=0))[:, varies], result - result.mean()])
    ranks = _ranks(plain)
    found = []
    for weights in _resamples(rows, seed):
        line, among_ranks = _least_squares(_covariance(plain, weights)), _covariance(ranks, weights)
        spread = np.sqrt(np.diag(among_ranks))
        with np.errstate(divide="ignore", invalid="ignore"):  # rows drawn so that an input does not vary
            found.append([line[0], line[1], among_ranks[:-1, -1] / (spread[:-1] * spread[-1])])
    whole = np.full(rows, 1.0 / rows)
    explained, of_ranks = (_least_squares(_covariance(held, whole))[2] for held in (plain, ranks))
    slope, standardised, rank = (_among(held, varies) for held in _estimates(found))
    return Regression(slope, standardised, rank, explained, of_ranks)


def variance_indices(first: Real, second: Real, exchanged: Real, seed: int) -> tuple[Estimate, Estimate] | None:
    """Return the first-order and the total Sobol' index of each input; None of too few rows or of no variance.

    The first is the part of the variance that goes when the input is known; the total the part that stays when all
    others are known. What lies between them is interaction. Estimators of Saltelli et al. 2010 (Table 2, b and f), of
    results less their mean; unlike `scipy.stats.sobol_indices`, which has the same, rows may be missing.

    Parameters
    ----------
    first, second : ndarray, shape (rows,)
        Results at the rows of A and of B.
    exchanged : ndarray, shape (inputs, rows)
        At those of A with one column from B.
    seed : int
        Of the bootstrap.

    References
    ----------
    A. Saltelli et al., Variance based sensitivity analysis of model output. Design and estimator for the total
    sensitivity index, Computer Physics Communications 181 (2010) 259-270.
    """
    rows = len(first)
    if rows < FEWEST_ROWS or np.ptp([first, second]) <= NO_CHANGE:
        return None
    mean = 0.5 * (first.mean() + second.mean())
    a, b, step = first - mean, second - mean, exchanged - first
    columns = np.column_stack([a, b, a**2, b**2, *(b * step), *step, *(0.5 * step**2)])
    found = []
    for weights in _resamples(rows, seed):
        of_a, of_b, of_a2, of_b2, *others = weights @ columns
        middle = 0.5 * (of_a + of_b)
        variance = 0.5 * (of_a2 + of_b2) - middle**2
        product, difference, square = np.split(np.array(others), 3)
        found.append([(product - middle * difference) / variance, square / variance])
    own, total = _estimates(found)
    return own, total


def _resamples(rows: int, seed: int) -> Iterator[Real]:
    """Yield the weights of all rows, then those of rows drawn with replacement, `RESAMPLES` times."""
    yield np.full(rows, 1.0 / rows)
    rng = np.random.default_rng(seed)
    for _ in range(RESAMPLES):
        yield np.bincount(rng.integers(0, rows, rows), minlength=rows) / rows


def _estimates(found: list[list[Real]]) -> tuple[Estimate, ...]:
    """Numbers of the rows as they are, which come first, with intervals from the resampled ones."""
    own, drawn = np.array(found[0]), np.array(found[1:])
    beyond = 50.0 * (1.0 - CONFIDENCE)
    low, high = np.nanpercentile(drawn, [beyond, 100.0 - beyond], axis=0)
    return tuple(Estimate(*held) for held in zip(own, low, high, strict=True))


def _among(held: Estimate, varies: NDArray[np.bool_]) -> Estimate:
    """Estimates of those inputs that vary, NaN of the others."""
    whole = np.full((3, len(varies)), np.nan)
    whole[:, varies] = held.value, held.low, held.high
    return Estimate(*whole)


def _covariance(columns: Real, weights: Real) -> Real:
    mean = weights @ columns
    return np.asarray((columns.T * weights) @ columns - np.outer(mean, mean))


def _least_squares(covariance: Real) -> tuple[Real, Real, float]:
    """Slopes, standardised slopes and R² of the last column on the others, from their covariance."""
    slope = np.linalg.pinv(covariance[:-1, :-1], hermitian=True) @ covariance[:-1, -1]
    spread = np.sqrt(np.diag(covariance))
    return slope, slope * spread[:-1] / spread[-1], float(slope @ covariance[:-1, -1] / covariance[-1, -1])


def _ranks(columns: Real) -> Real:
    """Ranks of each column from 0 to 1, less their mean."""
    from scipy.stats import rankdata

    ranks = np.asarray(rankdata(columns, axis=0), dtype=np.float64) / len(columns)
    return ranks - ranks.mean(axis=0)

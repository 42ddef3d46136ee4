"""How an estimated coherence scatters about the true one: bias, interval, significance.

For Gaussian signals, n independent averages and q inputs the estimate x of a squared (multiple) coherence g is a beta
variable of parameters ``q + J`` and ``n - q``, where J is negative binomial: ``P(J = j) = (n)_j / j! g^j (1 - g)^n``.
For one input it is the law of N. R. Goodman (Technometrics 5 (1963) 151) that G. C. Carter gives (Proc. IEEE 75 (1987)
236, "Coherence and time delay estimation"). A partial coherence, k references conditioned out, follows the law of an
ordinary one with ``n - k`` averages (J. S. Bendat and A. G. Piersol, Random Data, 4th ed., 9.3).

Neglected: overlapping frames count as a smaller number of independent ones (P. D. Welch, 1967), which holds for the
variance but only nearly for the whole law; leakage and delays between channels, which lower a coherence too.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import special, stats

from tdacoustic.errors import AnalysisError

__all__ = ["coherence_interval", "corrected_coherence", "mean_coherence", "significant_coherence"]

Array = NDArray[np.float64]

GRID: Final = 96
NODES: Final = 256
"""Quantiles of J that stand for its law."""
SERIES_FROM: Final = 41.0
SERIES_TERMS: Final = 60
LARGE: Final = 1e4
"""Mean, or degrees of freedom, from which on a law is taken by its limit."""
HIGHEST: Final = 1.0 - 1e-7
"""Largest true coherence on the grid."""


def _check(averages: float, inputs: int) -> None:
    if not averages > inputs:
        raise AnalysisError(f"a coherence of {inputs} inputs takes more than {inputs} averages, got {averages:.3g}")


def mean_coherence(true: float | Array, averages: float, inputs: int = 1) -> Array:
    """Return the mean of the estimate for a true squared coherence.

    ``1 - (n - q)/n (1 - g) 2F1(1, 1; n + 1; g)``: q/n for none, and 1 for one.

    Parameters
    ----------
    true : float or ndarray
        0 to 1.
    averages : float
    inputs : int

    Examples
    --------
    >>> round(mean_coherence(0.0, 20.0, 3).item(), 6)
    0.15
    """
    _check(averages, inputs)
    g = np.minimum(np.asarray(true, dtype=np.float64), 1.0 - 1e-15)
    return 1.0 - (averages - inputs) / averages * (1.0 - g) * _hypergeometric(averages + 1.0, g)


def _hypergeometric(c: float, z: Array) -> Array:
    """2F1(1, 1; c; z): SciPy's has no value near z = 1 for large whole c, where its series takes few terms."""
    if c < SERIES_FROM:
        return np.asarray(special.hyp2f1(1.0, 1.0, c, z))
    step = np.arange(SERIES_TERMS)
    terms = np.cumprod((step + 1.0) / (c + step) * z[..., None], axis=-1)
    return 1.0 + terms.sum(axis=-1)


def _grid(averages: float) -> Array:
    """True coherences, dense near none, where the law bends over one over the averages."""
    last = float(np.arctanh(np.sqrt(HIGHEST)))
    near = np.linspace(0.0, min(last, 6.0 / np.sqrt(averages)), GRID // 2)
    return np.tanh(np.unique(np.concatenate((near, np.linspace(0.0, last, GRID // 2 + 1))))) ** 2


def corrected_coherence(estimate: Array, averages: float, inputs: int = 1) -> Array:
    """Return the true coherence whose mean estimate is the one given; 0 where it is below the mean of none at all.

    Parameters
    ----------
    estimate : ndarray
        Squared coherences, 0 to 1.
    averages : float
    inputs : int

    Raises
    ------
    AnalysisError
        Not more averages than inputs.
    """
    _check(averages, inputs)
    true = np.concatenate((_grid(averages), [1.0]))
    mean = np.append(mean_coherence(true[:-1], averages, inputs), 1.0)
    return np.interp(np.asarray(estimate, dtype=np.float64), mean, true)


def significant_coherence(averages: float, inputs: int = 1, level: float = 0.05) -> float:
    """Return the estimate that signals without coherence exceed with the given probability.

    ``1 - level^(1 / (n - 1))`` for one input.

    Examples
    --------
    >>> round(significant_coherence(20.0), 4)
    0.1459
    """
    _check(averages, inputs)
    return float(stats.beta.isf(level, inputs, averages - inputs))


def _nodes(at: Array, averages: float, true: float) -> Array:
    """Quantiles of J; of a large one, of the gamma law with its mean and variance, beyond that of the normal one."""
    mean = averages * true / (1.0 - true)
    if mean < LARGE and averages < LARGE:
        return np.asarray(stats.nbinom.ppf(at, averages, 1.0 - true))
    shape = 1.0 / (1.0 / max(mean, 1e-300) + 1.0 / averages) if mean > 0.0 else 1.0
    if shape > LARGE:
        return np.asarray(mean * (1.0 + stats.norm.ppf(at) / np.sqrt(shape)))
    return np.asarray(stats.gamma.ppf(at, shape) * mean / shape)


@lru_cache(maxsize=64)
def _quantiles(averages: float, inputs: int, probability: float) -> tuple[Array, Array, Array]:
    """True coherences and the estimates' two quantiles at each."""
    true = _grid(averages)
    at = (np.arange(NODES) + 0.5) / NODES
    nodes = np.array([_nodes(at, averages, g) for g in true])
    bounds = []
    for tail in (0.5 * (1.0 - probability), 0.5 * (1.0 + probability)):
        # The mixture's quantile by bisection, all true coherences at once, in a variable that resolves both ends.
        low, high = np.zeros(len(true)), np.full(len(true), 12.0)
        for _ in range(45):
            middle = 0.5 * (low + high)
            x = np.tanh(middle) ** 2
            below = special.betainc(inputs + nodes, averages - inputs, x[:, None]).mean(axis=1) < tail
            low, high = np.where(below, middle, low), np.where(below, high, middle)
        bounds.append(np.tanh(0.5 * (low + high)) ** 2)
    return true, bounds[0], bounds[1]


def coherence_interval(
    estimate: Array, averages: float, inputs: int = 1, probability: float = 0.95
) -> tuple[Array, Array]:
    """Return the true coherences between which the true one lies with a probability, by the estimate's exact law.

    The lower end is 0 where no coherence at all would give the estimate often enough.

    Parameters
    ----------
    estimate : ndarray
        Squared coherences, 0 to 1.
    averages : float
    inputs : int
    probability : float
        Both tails alike.

    Raises
    ------
    AnalysisError
        Not more averages than inputs.
    """
    _check(averages, inputs)
    true, lower, upper = _quantiles(round(float(averages), 2), inputs, probability)
    root = np.arctanh(np.sqrt(np.minimum(np.asarray(estimate, dtype=np.float64), HIGHEST)))
    axis = np.arctanh(np.sqrt(true))
    low = np.interp(root, np.arctanh(np.sqrt(np.minimum(upper, HIGHEST))), axis, left=0.0)
    high = np.interp(root, np.arctanh(np.sqrt(np.minimum(lower, HIGHEST))), axis, left=0.0)
    return np.tanh(low) ** 2, np.where(np.asarray(estimate) >= HIGHEST, 1.0, np.tanh(high) ** 2)

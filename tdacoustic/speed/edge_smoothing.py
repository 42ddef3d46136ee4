"""Smoothing of a shaft's angle by the known scatter of its tacho's edges."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

__all__ = ["smooth_turns"]

Array = NDArray[np.float64]

LONGEST_EDGES: Final = 200.0
"""Longest period, in edges, that is taken away (assumed); it bounds the condition number to some 1e11."""
SHORTEST_EDGES: Final = 2.0
STEPS: Final = 30


def smooth_turns(times_s: Array, turns: Array, scatter_s: float) -> Array:
    """Return the smoothest angle that passes its edges by their scatter, shape (n,).

    Smooth means small third differences, so that a constant acceleration is kept exactly. The strength is chosen so
    that the mean square of the deviations, each over the scatter times the speed, is 1 (C. H. Reinsch, Numer. Math. 10
    (1967) 177); it never takes away more than periods of `LONGEST_EDGES` edges, whose wobble may be real.

    Parameters
    ----------
    times_s, turns : ndarray, shape (n,)
    scatter_s : float
        Standard deviation of an edge's instant.

    Examples
    --------
    >>> times = np.linspace(0.0, 1.0, 50)
    >>> bool(np.allclose(smooth_turns(times, 5.0 * times**2, 1e-5), 5.0 * times**2, atol=1e-9))
    True
    """
    if times_s.size < 8:
        return turns.copy()
    differences = _third_differences(times_s)
    deviation = scatter_s * np.gradient(turns, times_s)
    weight = 1.0 / np.maximum(deviation, 1e-3 * float(np.max(deviation))) ** 2
    scale = float(np.median(weight))
    line = np.polynomial.Polynomial.fit(times_s, turns, 2)(times_s)  # of the smoother's null space: keeps digits
    wanted = turns - line

    def solved(strength: float) -> Array:
        banded = _normal_bands(differences, strength)
        banded[0] += weight / scale
        return np.asarray(linalg.solveh_banded(banded, wanted * weight / scale, lower=True))

    low, high = (6.0 * np.log(edges / (2.0 * np.pi)) for edges in (SHORTEST_EDGES, LONGEST_EDGES))
    if _misfit(solved(float(np.exp(high))), wanted, weight) <= 1.0:
        low = high
    for _ in range(STEPS if high > low else 0):
        middle = 0.5 * (low + high)
        if _misfit(solved(float(np.exp(middle))), wanted, weight) > 1.0:
            high = middle
        else:
            low = middle
    return line + solved(float(np.exp(low)))


def _misfit(found: Array, wanted: Array, weight: Array) -> float:
    return float(np.mean((found - wanted) ** 2 * weight))


def _third_differences(times: Array) -> Array:
    """Weights of the third divided difference of each four neighbours, shape (n - 3, 4); 1, -3, 3, -1 where even."""
    four = np.lib.stride_tricks.sliding_window_view(times, 4)
    distance = four[:, :, None] - four[:, None, :]
    distance[:, np.arange(4), np.arange(4)] = 1.0
    spacing = (four[:, 3] - four[:, 0]) / 3.0
    return np.asarray(-6.0 * spacing[:, None] ** 3 / np.prod(distance, axis=2))


def _normal_bands(differences: Array, strength: float) -> Array:
    """Lower bands of strength · DᵀD, shape (4, n)."""
    count = differences.shape[0]
    banded = np.zeros((4, count + 3))
    for below in range(4):
        for column in range(4 - below):
            banded[below, column : column + count] += differences[:, column] * differences[:, column + below]
    return strength * banded

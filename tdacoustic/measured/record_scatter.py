"""How well a record of some seconds determines its own mean square."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.measured.mean_levels import ONE_SIGMA

__all__ = ["band_energy", "record_sigma_db"]

MIN_SEGMENTS: Final = 4
"""Below, nothing is said."""


def record_sigma_db(
    density: NDArray[np.floating],
    frames: NDArray[np.integer],
    resolution_hz: float,
    band_hz: tuple[float, float] | None = None,
) -> float | None:
    """Return the standard error of a record's level, from the scatter of its segments; None of fewer than four.

    The means of consecutive segments are taken as independent, each weighted by its frames: overlapping Hann frames
    are correlated by 3 %. For noise of bandwidth B over T it comes to 4.34/sqrt(B T) dB, for a steady tone to nothing.
    Slower changes than the record is long are not in it.

    Parameters
    ----------
    density : ndarray, shape (n_segments, n_frequencies)
        Mean square per Hz.
    frames : ndarray of int, shape (n_segments,)
        Frames in each segment.
    resolution_hz : float
        Line spacing.
    band_hz : (float, float), optional
        Only what lies in it counts.

    Examples
    --------
    >>> density = np.array([[1.0, 1.0], [1.0, 1.2], [1.0, 1.0], [1.0, 0.8]])
    >>> round(record_sigma_db(density, np.ones(4, dtype=int), 1.0), 3)
    0.283
    """
    used = frames > 0
    if int(used.sum()) < MIN_SEGMENTS:
        return None
    weights = frames[used] / float(frames.sum())
    low_hz, high_hz = band_hz or (0.0, resolution_hz * density.shape[1])
    first = max(0, int(low_hz / resolution_hz) - 1)  # of the lines that lie in the band, and one more on each side
    held = density[used, first : int(high_hz / resolution_hz) + 3]
    energy = band_energy(held, resolution_hz, low_hz - first * resolution_hz, high_hz - first * resolution_hz)
    mean = float(weights @ energy)
    if not mean > 0.0:
        return None
    count = weights.size
    variance = float(weights**2 @ (energy - mean) ** 2) * count / (count - 1)
    from scipy import stats

    return 10.0 / math.log(10.0) * math.sqrt(variance) / mean * float(stats.t.ppf(ONE_SIGMA, count - 1))


def band_energy(
    density: NDArray[np.floating],
    resolution_hz: float,
    low_hz: float | NDArray[np.float64],
    high_hz: float | NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the mean square between two frequencies in each segment; lines at the edges count by their part inside.

    Parameters
    ----------
    density : ndarray, shape (n_segments, n_frequencies)
        Mean square per Hz.
    resolution_hz : float
    low_hz, high_hz : float or ndarray of shape (n_segments,)
        Edges, of all segments or of each.

    Returns
    -------
    ndarray, shape (n_segments,)

    Examples
    --------
    >>> band_energy(np.ones((1, 10)), 2.0, 3.0, 7.0)
    array([4.])
    """
    n_segments, n_lines = density.shape
    running = np.zeros((n_segments, n_lines + 1))
    np.cumsum(density, axis=1, out=running[:, 1:], dtype=np.float64)
    rows = np.arange(n_segments)

    def below(edge_hz: float | NDArray[np.float64]) -> NDArray[np.float64]:
        place = np.broadcast_to(np.clip(np.asarray(edge_hz) / resolution_hz + 0.5, 0.0, n_lines), (n_segments,))
        whole = np.minimum(place.astype(int), n_lines - 1)
        return np.asarray(running[rows, whole] + (place - whole) * density[rows, whole])

    return resolution_hz * (below(high_hz) - below(low_hz))

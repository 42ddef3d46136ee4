"""The local floor under the lines of a spectrum."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from tdacoustic.spectra import Spectrum

__all__ = ["local_floor"]

Array = NDArray[np.float64]

HALF_WIDTH_LINES = 25
"""Half width of the running median at low frequency, in lines of the spectrum."""
HALF_WIDTH_RELATIVE = 0.03
"""The same at high frequency, over the frequency."""
KNOTS_PER_HALF_WIDTH = 8
"""Places at which the median is taken, interpolated between them; one at each line takes nine times as long."""
DYNAMIC_RANGE = 1e-13
"""The floor is not taken below this part of the highest density: arithmetic, not signal."""


def _running_median(values: Array, at: NDArray[np.int64], half_width: int) -> Array:
    """Median around the places `at`; the window shrinks, symmetrically, towards the ends, so that a slope stays one."""
    n = values.size
    half_width = min(half_width, (n - 1) // 2)
    inner = (at >= half_width) & (at < n - half_width)
    result = np.empty(at.size)
    windows = np.lib.stride_tricks.sliding_window_view(values, 2 * half_width + 1)
    result[inner] = np.median(windows[at[inner] - half_width], axis=1)
    for index in np.flatnonzero(~inner):
        place = int(at[index])
        reach = max(min(place, n - 1 - place), min(4, n // 2 - 1))
        result[index] = np.median(values[max(0, place - reach) : place + reach + 1])
    return result


def local_floor(spectrum: Spectrum) -> Array:
    """Density of the floor under the lines, shape (n,), unit²/Hz.

    A running median, whose window is symmetric (so that a sloping spectrum is
    followed) and wide against a line; lines do not raise it as long as they
    fill less than half of the window. It is put on the scale of the mean with
    the ratio of mean to median of a chi-squared estimate.
    """
    density = spectrum.density
    n = density.size
    floor = np.empty(n)
    # The window grows with the frequency, octave by octave, each octave with one width.
    start = 0
    half_width = HALF_WIDTH_LINES
    while start < n:
        end = min(n, max(start + 1, int(half_width / HALF_WIDTH_RELATIVE)))
        step = max(1, half_width // KNOTS_PER_HALF_WIDTH)
        every = np.arange(start, min(end, half_width))  # each line where the window shrinks towards 0 Hz
        at = np.unique(np.concatenate((every, np.arange(start, end, step), [end - 1])))
        floor[start:end] = np.interp(np.arange(start, end), at, _running_median(density, at, half_width))
        start, half_width = end, 2 * half_width
    freedom = 2.0 * spectrum.averages
    floor *= freedom / stats.chi2.median(freedom)
    lowest = DYNAMIC_RANGE * float(np.max(density, initial=0.0))
    return np.maximum(floor, max(lowest, np.finfo(np.float64).tiny))

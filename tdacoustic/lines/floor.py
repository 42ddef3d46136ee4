"""The local floor under the lines of a spectrum."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, stats

from tdacoustic.spectra import Spectrum

__all__ = ["local_floor"]

Array = NDArray[np.float64]

HALF_WIDTH_LINES = 25
"""Half width of the running median at low frequency, in lines of the spectrum."""
HALF_WIDTH_RELATIVE = 0.03
"""The same at high frequency, over the frequency."""
DYNAMIC_RANGE = 1e-20
"""The floor is not taken below this part of the highest density: arithmetic, not signal."""


def _running_median(values: Array, half_width: int) -> Array:
    """Median over a window that shrinks, symmetrically, towards the ends, so that a slope stays a slope."""
    n = values.size
    half_width = min(half_width, (n - 1) // 2)
    result = ndimage.median_filter(values, size=2 * half_width + 1, mode="nearest")
    for at in range(half_width):
        reach = max(at, min(4, n // 2 - 1))
        result[at] = np.median(values[: at + reach + 1])
        result[n - 1 - at] = np.median(values[n - 1 - at - reach :])
    return np.asarray(result)


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
        low, high = max(0, start - 2 * half_width), min(n, end + 2 * half_width)
        floor[start:end] = _running_median(density[low:high], half_width)[start - low : end - low]
        start, half_width = end, 2 * half_width
    freedom = 2.0 * spectrum.averages
    floor *= freedom / stats.chi2.median(freedom)
    lowest = DYNAMIC_RANGE * float(np.max(density, initial=0.0))
    return np.maximum(floor, max(lowest, np.finfo(np.float64).tiny))

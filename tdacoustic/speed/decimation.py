"""Fewer samples for the search of slow lines, block by block."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import signal

__all__ = ["Decimator", "decimation_of"]

Array = NDArray[np.float64]

LOWEST_RATE_HZ: Final = 9000.0
"""Rate that is left at least: lines are looked for up to 4 kHz."""
HALF_TAPS: Final = 23
"""Half the length of the filter, in samples that are left: with `BETA` 80 dB from 0.56 of their rate on, flat to
0.44."""
BETA: Final = 8.0


def decimation_of(sample_rate_hz: float) -> int:
    """Return how many samples may become one.

    Examples
    --------
    >>> decimation_of(51200.0), decimation_of(8192.0)
    (5, 1)
    """
    return max(1, int(sample_rate_hz / LOWEST_RATE_HZ))


class Decimator:
    """Keeps each `factor`-th sample of several channels, filtered so that what lies above does not fold back.

    The filter has no delay: sample k of the result is that at k times the factor. Samples that are no numbers count
    as zero.

    Parameters
    ----------
    factor : int
        1 keeps all.
    n_channels : int
    """

    def __init__(self, factor: int, n_channels: int) -> None:
        self.factor = factor
        self._half = HALF_TAPS * factor if factor > 1 else 0
        self._taps = signal.firwin(2 * self._half + 1, 1.0 / factor, window=("kaiser", BETA)) if factor > 1 else None
        self._pending = np.zeros((n_channels, self._half))

    def count(self, n_samples: int) -> int:
        """Return how many samples are left of a record; the last ones lack what the filter would look ahead at."""
        return max(0, (n_samples - 1 - self._half) // self.factor + 1)

    def take(self, values: Array) -> Array:
        """Return what samples, shape (n_channels, n), in order, add to the result."""
        values = np.nan_to_num(values)
        if self._taps is None:
            return values
        data = np.concatenate((self._pending, values), axis=1)
        count = max(0, (data.shape[1] - 2 * self._half - 1) // self.factor + 1)
        if count == 0:
            self._pending = data
            return values[:, :0]
        used = data[:, : (count - 1) * self.factor + 2 * self._half + 1]
        first = 2 * HALF_TAPS  # where the whole filter has seen samples
        found = signal.upfirdn(self._taps, used, 1, self.factor, axis=1)[:, first : first + count]
        self._pending = data[:, count * self.factor :].copy()
        return np.asarray(found, dtype=np.float64)

"""Means and covariances of long records, block by block."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["Covariance"]

Array = NDArray[np.float64]


class Covariance:
    """Means and covariances of channels, exact to rounding whatever their offset.

    Samples are shifted by the mean of the first block, so that a large offset
    does not swallow a small signal.

    Parameters
    ----------
    n_channels : int
    """

    def __init__(self, n_channels: int) -> None:
        self._shift: Array | None = None
        self._count = np.zeros((n_channels, n_channels))
        self._sum = np.zeros((n_channels, n_channels))
        self._products = np.zeros((n_channels, n_channels))

    def take(self, block: Array, whole: bool = True) -> None:
        """Add samples, shape (n_channels, n); `whole` says that all of them are finite."""
        if self._shift is None:
            known = np.isfinite(block)
            count = np.maximum(1, np.count_nonzero(known, axis=1))
            self._shift = np.sum(block, axis=1, where=known) / count
        data = block - self._shift[:, np.newaxis]
        if whole:
            self._count += block.shape[1]
            self._sum += data.sum(axis=1)[:, np.newaxis]
            self._products += data @ data.T
        else:
            finite = np.isfinite(data)
            data = np.where(finite, data, 0.0)
            mask = finite.astype(np.float64)
            self._count += mask @ mask.T
            self._sum += data @ mask.T
            self._products += data @ data.T

    def result(self) -> tuple[Array, Array]:
        """Return means, shape (n,), and covariances, shape (n, n), over the samples both channels have."""
        shift = np.zeros(len(self._count)) if self._shift is None else self._shift
        with np.errstate(invalid="ignore", divide="ignore"):
            means = self._sum / self._count
            covariance = self._products / self._count - means * means.T
        return shift + np.diag(means), covariance

"""Cross-spectral matrices of one operating state: references, receivers, and both against each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError

__all__ = ["CrossMatrices", "explained_power"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

RANK = 1e-6
"""Eigenvalues of the references' coherency below this part of the largest are rounding (the spectra are complex64)."""


@dataclass(frozen=True)
class CrossMatrices:
    """Cross-spectral densities, averaged over a state.

    The line is the first axis and the matrix the last two, as linear algebra has it; results have the line last.

    Parameters
    ----------
    frequencies_hz : ndarray, shape (n_lines,)
    references, receivers : tuple of str
    s_xx : ndarray of complex, shape (n_lines, n_references, n_references)
        Mean of ``X_i conj(X_j)``.
    s_xy : ndarray of complex, shape (n_lines, n_references, n_receivers)
        Mean of ``X_i conj(Y_j)``.
    s_yy : ndarray, shape (n_lines, n_receivers)
        The receivers' own densities.
    averages : float
        Independent averages.

    Raises
    ------
    AnalysisError
        Shapes that do not fit, or values that are no numbers.
    """

    frequencies_hz: Array
    references: tuple[str, ...]
    receivers: tuple[str, ...]
    s_xx: Complex
    s_xy: Complex
    s_yy: Array
    averages: float

    def __post_init__(self) -> None:
        n, q, p = len(self.frequencies_hz), len(self.references), len(self.receivers)
        due = {"s_xx": (n, q, q), "s_xy": (n, q, p), "s_yy": (n, p)}
        for name, shape in due.items():
            values = getattr(self, name)
            if values.shape != shape:
                raise AnalysisError(f"{name} must have shape {shape}, got {values.shape}")
            if not np.isfinite(values).all():
                raise AnalysisError(f"{name} holds values that are no numbers")

    def index(self, name: str) -> int:
        """Return the place of a reference.

        Raises
        ------
        AnalysisError
            There is none of that name.
        """
        if name not in self.references:
            raise AnalysisError(f"no reference {name!r}; there are {', '.join(self.references)}")
        return self.references.index(name)

    def enough_averages(self, inputs: int, what: str) -> None:
        """Raise where there are not more averages than inputs.

        Raises
        ------
        AnalysisError
            With as many averages as inputs anything is explained in full, whatever it is.
        """
        if not self.averages > inputs:
            raise AnalysisError(
                f"{what} of {inputs} references takes more than {inputs} independent averages, "
                f"got {self.averages:.3g}: with fewer everything is explained in full; take a longer record or a "
                "coarser resolution"
            )


def explained_power(s_xx: Complex, s_xy: Complex, chosen: Sequence[int]) -> tuple[Array, Array]:
    """Return what a set of references explains of the receivers by least squares, and their rank.

    Parameters
    ----------
    s_xx : ndarray, shape (..., n, n)
    s_xy : ndarray, shape (..., n, p)
    chosen : sequence of int
        References used; none explains nothing.

    Returns
    -------
    power : ndarray, shape (..., p)
    rank : ndarray, shape (...,)
        Independent references among them.
    """
    if not len(chosen):
        shape = s_xy.shape[:-2]
        return np.zeros((*shape, s_xy.shape[-1])), np.zeros(shape)
    index = np.asarray(chosen)
    inner = s_xx[..., index[:, None], index]
    cross = s_xy[..., index, :]
    scale = inverse_root(np.diagonal(inner, axis1=-2, axis2=-1).real)
    values, vectors = np.linalg.eigh(inner * scale[..., :, None] * scale[..., None, :])
    kept = values > RANK * np.maximum(values[..., -1:], np.finfo(float).tiny)
    parts = vectors.conj().swapaxes(-1, -2) @ (cross * scale[..., :, None])
    weight = np.where(kept, 1.0 / np.where(kept, values, 1.0), 0.0)
    return np.einsum("...kp,...k->...p", np.abs(parts) ** 2, weight), kept.sum(axis=-1).astype(np.float64)


def inverse_root(power: Array) -> Array:
    """Return one over the root, 0 where there is no power."""
    live = power > 0.0
    return np.where(live, 1.0 / np.sqrt(np.where(live, power, 1.0)), 0.0)

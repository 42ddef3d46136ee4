"""Natural modes of a structure up to a frequency: Lanczos with shift and inversion (ARPACK on NGSolve's factors)."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.housing.box import HousingError
from tdacoustic.housing.elasticity import Structure

__all__ = ["natural_modes", "residual_modes", "static_deflections"]

Real = NDArray[np.float64]

_TOLERANCE: Final = 1e-7
"""Of ARPACK; the quotients that follow square the error."""

_LOW: Final = 0.2
"""Modes with λ below this part of the shift are iterated once more, with K⁻¹ M.

Where λ is small against the shift, what rounding adds of very stiff motions (1e-6 of a vector) still shows in λ: 1 % in
the first modes of the reference housing.
"""

_NOT_NEW: Final = 1e-6
"""A residual deflection below this part of the whole deflection says nothing new."""


def natural_modes(structure: Structure, highest_hz: float, expected: int) -> tuple[Real, Real]:
    """Return all natural frequencies up to a frequency, and modes with a modal mass of 1 kg.

    The shift lies in the middle of the wanted λ = ω², so that the eigenvalues nearest to it are all wanted ones; where
    `expected` was too few, it is raised until they reach 0 and the highest.

    Parameters
    ----------
    structure : Structure
    highest_hz : float
    expected : int
        Number of modes that is taken for enough at first.

    Returns
    -------
    frequency_hz : ndarray, shape (n,)
        Ascending.
    modes : ndarray, shape (n, unknowns)
        The largest entry of each is positive.

    Raises
    ------
    HousingError
        A mode without stiffness: a structure that is not held.
    """
    middle = 0.5 * (2.0 * math.pi * highest_hz) ** 2
    inverse = structure.shifted(middle)
    most = structure.unknowns // 3
    number = min(expected, most)
    while True:
        values, vectors = _nearest(structure, inverse, middle, number)
        if np.abs(values - middle).max() >= middle or number >= most:
            break
        number = min(math.ceil(1.2 * number), most)
    low = values < _LOW * middle
    vectors[low] = structure.applied(structure.flexibility, structure.applied(structure.mass, vectors[low]))
    vectors[low] *= np.abs(values[low, None])
    values, vectors = _ritz(structure, vectors)
    wanted = values <= 2.0 * middle
    values, vectors = values[wanted], vectors[wanted]
    if values.size and values[0] <= 0.0:
        raise HousingError("the housing is not held: a mode has no stiffness")
    largest = np.take_along_axis(vectors, np.abs(vectors).argmax(axis=1)[:, None], axis=1)
    return np.sqrt(values) / (2.0 * math.pi), vectors * np.sign(largest)


def _nearest(structure: Structure, inverse: object, shift: float, number: int) -> tuple[Real, Real]:
    """Return the eigenvalues nearest to the shift and their vectors, shape (number, unknowns)."""
    from scipy.sparse.linalg import LinearOperator, eigsh

    size = structure.unknowns

    def operator(matrix: object) -> LinearOperator:
        def apply(vector: Real) -> Real:
            return structure.applied(matrix, vector.reshape(1, size))[0]

        return LinearOperator((size, size), matvec=apply, dtype=np.float64)

    values, vectors = eigsh(
        operator(structure.stiffness),
        number,
        operator(structure.mass),
        sigma=shift,
        OPinv=operator(inverse),
        which="LM",
        ncv=min(size, math.ceil(1.5 * number) + 20),
        tol=_TOLERANCE,
        v0=np.random.default_rng(0).standard_normal(size),
    )
    return values, np.ascontiguousarray(vectors.T)


def _ritz(structure: Structure, vectors: Real) -> tuple[Real, Real]:
    """Return eigenvalues and M-normal vectors of the structure in the span of vectors."""
    from scipy.linalg import eigh

    stiffness = vectors @ structure.applied(structure.stiffness, vectors).T
    mass = vectors @ structure.applied(structure.mass, vectors).T
    values, combined = eigh(0.5 * (stiffness + stiffness.T), 0.5 * (mass + mass.T))
    return values, combined.T @ vectors


def static_deflections(structure: Structure) -> Real:
    """Return K⁻¹ f of each unit load, shape (loads, unknowns); solved twice, the second time for what was left."""
    found = structure.applied(structure.flexibility, structure.loads)
    left = structure.loads - structure.applied(structure.stiffness, found)
    return found + structure.applied(structure.flexibility, left)


def residual_modes(structure: Structure, frequency_hz: Real, modes: Real) -> tuple[Real, Real]:
    """Return the static correction as further modes: what the static deflections hold beyond the natural modes.

    The deflections under unit loads, less their part in the natural modes, are brought to the form of modes by
    Rayleigh and Ritz (residual vectors; J. M. Dickens, J. M. Nakagawa, M. J. Wittbrodt, Computers & Structures 62
    (1997) 985). They make the response to the loads exact at rest, and stand for all modes above the highest; their
    frequencies lie above it and are no resonances of the housing.

    Parameters
    ----------
    structure : Structure
    frequency_hz : ndarray, shape (n,)
    modes : ndarray, shape (n, unknowns)

    Returns
    -------
    frequency_hz : ndarray, shape (r,)
    modes : ndarray, shape (r, unknowns)
        Of modal mass 1 kg, orthogonal to `modes` in mass and stiffness; r is at most the number of loads.
    """
    whole = static_deflections(structure)
    size = np.sqrt(np.einsum("iu,iu->i", whole, structure.applied(structure.mass, whole)))
    rest = whole.copy()
    for _ in range(2):
        rest -= (rest @ structure.applied(structure.mass, modes).T) @ modes
    rest /= size[:, None]
    gram = rest @ structure.applied(structure.mass, rest).T
    squared, combined = np.linalg.eigh(0.5 * (gram + gram.T))
    new = squared > _NOT_NEW**2
    if not new.any():
        return np.empty(0), np.empty((0, structure.unknowns))
    values, vectors = _ritz(structure, (combined[:, new] / np.sqrt(squared[new])).T @ rest)
    return np.sqrt(values) / (2.0 * np.pi), vectors

"""Natural modes of a structure up to a frequency: block Lanczos with shift and inversion, on NGSolve's factors."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.housing.box import HousingError
from tdacoustic.housing.elasticity import Structure

__all__ = ["natural_modes", "residual_modes", "static_deflections"]

Real = NDArray[np.float64]

_BLOCK: Final = 8
"""Vectors that Lanczos takes at a time: they share the passes over the basis, and as many equal eigenvalues are found.

A free body on springs spread like its mass has six.
"""

_TOLERANCE: Final = 1e-6
"""Residual over the eigenvalue of (K - shift M)⁻¹ M at which a mode counts as found; its λ is right to the square."""

_REACH: Final = 1.02
"""Modes are looked for up to this times the distance that is wanted, so that those at the ends are well held."""

_LOW: Final = 0.01
"""Below this part of the shift λ is a small difference of large numbers, and is taken from K instead."""

_NOT_NEW: Final = 1e-6
"""A residual deflection below this part of the whole deflection says nothing new."""


def natural_modes(structure: Structure, highest_hz: float, expected: int) -> tuple[Real, Real]:
    """Return all natural frequencies up to a frequency, and modes with a modal mass of 1 kg.

    The shift lies in the middle of the wanted λ = ω², so that the eigenvalues nearest to it are all wanted ones.

    Parameters
    ----------
    structure : Structure
    highest_hz : float
    expected : int
        About how many there are: from when on it pays to look whether all are found.

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
    values, vectors = _nearest(structure, structure.shifted(middle), middle, expected)
    low = values < _LOW * middle
    values[low], vectors[low] = _ritz(structure, vectors[low])
    ascending = np.argsort(values)
    wanted = ascending[values[ascending] <= 2.0 * middle]
    values, vectors = values[wanted], vectors[wanted]
    if values.size and values[0] <= 0.0:
        raise HousingError("the housing is not held: a mode has no stiffness")
    largest = np.take_along_axis(vectors, np.abs(vectors).argmax(axis=1)[:, None], axis=1)
    return np.sqrt(values) / (2.0 * math.pi), vectors * np.sign(largest)


def _nearest(structure: Structure, inverse: object, shift: float, number: int) -> tuple[Real, Real]:
    """Return the eigenvalues less than the shift away from it, and their vectors with a modal mass of 1.

    Block Lanczos with (K - shift M)⁻¹ M, the whole basis kept orthogonal in M. After about as many vectors as are
    expected it looks now and then whether all Ritz values within reach have converged.
    """
    size = structure.unknowns
    basis = np.empty((2 * number + 10 * _BLOCK, size))
    projected = np.zeros((len(basis), len(basis)))
    start = np.random.default_rng(0).standard_normal((_BLOCK, size))
    block, massed, _ = _normal(structure, structure.applied(inverse, structure.massed(start)))
    held, look = 0, number
    while True:
        if held + 2 * _BLOCK > len(basis):
            basis = np.concatenate([basis, np.empty_like(basis)])
            projected = np.pad(projected, (0, len(projected)))
        new, held = slice(held, held + _BLOCK), held + _BLOCK
        basis[new] = block
        block = structure.applied(inverse, massed)
        for _ in range(2):
            part = basis[:held] @ structure.massed(block).T
            block -= part.T @ basis[:held]
            projected[:held, new] += part
        block, massed, length = _normal(structure, block)
        projected[held : held + _BLOCK, new] = length.T
        if held >= look or held >= size // 3:
            values, combined = np.linalg.eigh(projected[:held, :held], UPLO="U")
            near = np.abs(values) * _REACH * shift > 1.0
            left = np.linalg.norm(length.T @ combined[new][:, near], axis=0)
            if (left <= _TOLERANCE * np.abs(values[near])).all() or held >= size // 3:
                return shift + 1.0 / values[near], combined[:, near].T @ basis[:held]
            look = held + max(_BLOCK, number // 10)


def _normal(structure: Structure, block: Real) -> tuple[Real, Real, Real]:
    """Return vectors made orthogonal among themselves with a modal mass of 1, M times them, and L of block = L new."""
    lengths = np.eye(len(block))
    for _ in range(2):
        massed = structure.massed(block)
        length = np.linalg.cholesky(block @ massed.T)
        block, massed = np.linalg.solve(length, block), np.linalg.solve(length, massed)
        lengths = lengths @ length
    return block, massed, lengths


def _ritz(structure: Structure, vectors: Real) -> tuple[Real, Real]:
    """Return eigenvalues and M-normal vectors of the structure in the span of vectors."""
    from scipy.linalg import eigh

    stiffness = vectors @ structure.applied(structure.stiffness, vectors).T
    mass = vectors @ structure.massed(vectors).T
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
    size = np.sqrt(np.einsum("iu,iu->i", whole, structure.massed(whole)))
    rest = whole.copy()
    for _ in range(2):
        rest -= (structure.massed(rest) @ modes.T) @ modes
    rest /= size[:, None]
    gram = rest @ structure.massed(rest).T
    squared, combined = np.linalg.eigh(0.5 * (gram + gram.T))
    new = squared > _NOT_NEW**2
    if not new.any():
        return np.empty(0), np.empty((0, structure.unknowns))
    values, vectors = _ritz(structure, (combined[:, new] / np.sqrt(squared[new])).T @ rest)
    return np.sqrt(values) / (2.0 * np.pi), vectors

"""Envelopes of orders as cubic B-splines, and the banded system whose solution the Vold-Kalman filter is."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

__all__ = ["HALF_POWER", "Carriers", "NodeSystem", "alone_inverse", "penalty_of", "spline_weights"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

HALF_POWER: Final = np.sqrt(2.0) - 1.0
"""1 / (1 + HALF_POWER) is the gain at the bandwidth, 3 dB down."""
QUADRATURE: Final = 64
"""Points a node interval at which products of carriers are taken."""
FAR: Final = (8.0, 20.0)
"""Turns of carriers against each other in a node interval between which their coupling, some 1e-6 there and less, is
faded out: smoothly, since a step would couple them itself."""
RIDGE: Final = 1e-9
"""Added to the diagonal, over that of the data: decides where an order has no data at all."""


def spline_weights(shares: Array) -> Array:
    """Return the four cubic B-splines over an interval at shares of it, shape (n, 4)."""
    u = np.asarray(shares)
    return np.column_stack(
        ((1.0 - u) ** 3, 3.0 * u**3 - 6.0 * u**2 + 4.0, -3.0 * u**3 + 3.0 * u**2 + 3.0 * u + 1.0, u**3)
    ) / 6.0  # fmt: skip


@lru_cache(maxsize=8)
def _roughness(poles: int) -> Array:
    """Integrals over one interval of the products of the splines' derivatives of a degree, shape (4, 4)."""
    at, weight = np.polynomial.legendre.leggauss(4)
    pieces = (
        np.polynomial.Polynomial([1.0, -3.0, 3.0, -1.0]) / 6.0,
        np.polynomial.Polynomial([4.0, 0.0, -6.0, 3.0]) / 6.0,
        np.polynomial.Polynomial([1.0, 3.0, 3.0, -3.0]) / 6.0,
        np.polynomial.Polynomial([0.0, 0.0, 0.0, 1.0]) / 6.0,
    )
    values = np.array([piece.deriv(poles)(0.5 * (at + 1.0)) for piece in pieces])
    return np.asarray((values * (0.5 * weight)) @ values.T)


def penalty_of(bandwidth_hz: float, interval_s: float, samples: int, poles: int) -> float:
    """Return the strength of the structure equation in the units of the data term.

    With it the gain at a distance f from the carrier is ``1 / (1 + (√2 - 1) (f / B)^(2 poles))``: the minimum of
    ``Σ |2x e^{-iθ} - c|² + λ ∫ |d^p c / du^p|² du`` over node intervals u (H. Vold, J. Leuridan, SAE 931288; the
    passband as J. Tůma, Sb. věd. prací VŠB-TU Ostrava 51 (2005) 149, here for the continuous envelope). It is exact
    at the bandwidth, where the splines' own roughness counts and not that of the wave they stand for.
    """
    turn = np.exp(2j * np.pi * bandwidth_hz * interval_s * np.arange(4))
    wave = np.conj(turn)[:, None] * turn  # a coefficient turns by 2π B h from node to node
    data, rough = (float(np.sum(table * wave).real) for table in (_roughness(0), _roughness(poles)))
    return samples * HALF_POWER * data / rough


@dataclass(frozen=True)
class Carriers:
    """Carriers of all orders over some node intervals.

    Parameters
    ----------
    phasors : ndarray of complex, shape (n_orders, n_intervals, n_points)
        At evenly spaced points of each interval; 0 where an order has no data.
    rates : ndarray, shape (n_orders, n_intervals)
        Turns of each carrier in an interval.
    strengths : ndarray, shape (n_orders, n_intervals)
        Of the structure equation (`penalty_of`).
    samples : int
        Samples an interval.
    """

    phasors: Complex
    rates: Array
    strengths: Array
    samples: int

    @staticmethod
    def shares(samples: int) -> Array:
        """Where the points of an interval lie: each in the middle of the samples that it stands for."""
        points = min(samples, QUADRATURE)
        return (np.arange(points) + 0.5) / points - 0.5 / samples


class NodeSystem:
    """The normal equations of the coefficients of all orders' envelopes over some node intervals.

    Coefficient m of order k is unknown ``m K + k``. The matrix is Hermitian with 4 K - 1 bands below the diagonal: the
    data couple coefficients of all orders that share an interval, by the mean of one carrier against another; the
    structure equation couples those of one order.

    Parameters
    ----------
    carriers : Carriers
    poles : int
    """

    def __init__(self, carriers: Carriers, poles: int) -> None:
        self.n_orders, self.n_intervals = carriers.rates.shape
        self.size = (self.n_intervals + 3) * self.n_orders
        self.carriers, self.poles = carriers, poles
        self.data = np.zeros((4 * self.n_orders, self.size), dtype=np.complex128)
        self.structure = np.zeros((4 * self.n_orders, self.size), dtype=np.complex128)
        weights = spline_weights(Carriers.shares(carriers.samples))
        products = (weights[:, :, None] * weights[:, None, :]).reshape(-1, 16)
        self._products = products * (carriers.samples / weights.shape[0])
        for first in range(self.n_orders):
            for second in range(first, self.n_orders):
                self._add_data(first, second)
            for a in range(4):
                for b in range(a + 1):
                    self._add(self.structure, first, first, a, b, carriers.strengths[first] * _roughness(poles)[a, b])

    def _add_data(self, first: int, second: int) -> None:
        carriers = self.carriers
        turns = np.abs(carriers.rates[first] - carriers.rates[second])
        near = np.flatnonzero(turns < FAR[1] + np.abs(np.gradient(turns)) if turns.size > 1 else turns < FAR[1])
        if not near.size:
            return
        beat = np.conj(carriers.phasors[first, near]) * carriers.phasors[second, near]
        if turns[near].max() > FAR[0]:
            beat *= _fade(turns, beat.shape[1])[near]
        coupled = np.zeros((self.n_intervals, 16), dtype=np.complex128)
        coupled[near] = beat @ self._products
        for a in range(4):
            for b in range(a + 1) if first == second else range(4):
                self._add(self.data, first, second, a, b, coupled[:, 4 * a + b])

    def _add(self, bands: Complex, first: int, second: int, a: int, b: int, values: NDArray) -> None:
        """Add values of (coefficient i + a of one order, i + b of another) over the intervals i."""
        row, column = a * self.n_orders + first, b * self.n_orders + second
        if row < column:
            row, column, values = column, row, np.conj(values)
        stop = column + self.n_intervals * self.n_orders
        bands[row - column, column : stop : self.n_orders] += values

    def solve(self, moments: Complex, fixed: Complex | None) -> Complex:
        """Return the coefficients, shape (n_coefficients, n_orders, n_channels).

        Parameters
        ----------
        moments : ndarray of complex, same shape
        fixed : ndarray of complex, shape (n, n_orders, n_channels), or None
            The first coefficients, at least three, where they are already known.
        """
        channels = moments.shape[-1]
        known = 0 if fixed is None else len(fixed) * self.n_orders
        bands = self.data + self.structure
        bands[0] += RIDGE * self.carriers.samples
        right = moments.reshape(self.size, channels).copy()
        if fixed is not None:
            given = fixed.reshape(known, channels)
            for below in range(1, bands.shape[0]):  # what the known ones contribute to the rows of the others
                columns = np.arange(max(0, known - below), known)
                right[columns + below] -= bands[below, columns, None] * given[columns]
        # Bands over 50 at most: the factorisation is stable without pivots, the matrix being positive definite.
        found = linalg.solveh_banded(bands[:, known:], right[known:], lower=True, overwrite_b=True)
        if fixed is not None:
            found = np.concatenate((given, found))
        return np.asarray(found).reshape(-1, self.n_orders, channels)

    def misfit(self, coefficients: Complex) -> Complex:
        """Return what the data leave of the moments: the structure equation times the coefficients, same shape."""
        flat = coefficients.reshape(self.size, -1)
        result = self.structure[0, :, None] * flat
        for below in range(self.n_orders, self.structure.shape[0], self.n_orders):
            bands = self.structure[below, : self.size - below, None]
            result[below:] += bands * flat[:-below]
            result[:-below] += np.conj(bands) * flat[below:]
        return result.reshape(coefficients.shape)

    def inverse_diagonal(self) -> Array:
        """Return the diagonal of the inverse, shape (n_coefficients, n_orders)."""
        from tdacoustic.orders.kernels import banded_inverse_diagonal

        bands = self.data + self.structure
        bands[0] += RIDGE * self.carriers.samples
        factor = linalg.cholesky_banded(bands, lower=True, overwrite_ab=True)
        return np.asarray(banded_inverse_diagonal(np.ascontiguousarray(factor.T))).reshape(-1, self.n_orders)


def _fade(turns: Array, points: int) -> Array:
    """Share of a coupling that is kept, at the points of each interval: 1 up to `FAR[0]`, 0 from `FAR[1]` on."""
    at = (np.arange(points) + 0.5) / points - 0.5
    middle = np.arange(turns.size)
    fine = np.interp((middle[:, None] + at).ravel(), middle, turns).reshape(turns.size, points)
    return 0.5 + 0.5 * np.cos(np.pi * np.clip((fine - FAR[0]) / (FAR[1] - FAR[0]), 0.0, 1.0))


@lru_cache(maxsize=64)
def alone_inverse(strength: float, samples: int, poles: int) -> float:
    """Return the inverse's diagonal for one order that has no neighbours, far from the ends."""
    count = 257
    shares = Carriers.shares(samples)
    ones = np.ones((1, count, shares.size), dtype=np.complex128)
    carriers = Carriers(ones, np.zeros((1, count)), np.full((1, count), strength), samples)
    return float(NodeSystem(carriers, poles).inverse_diagonal()[count // 2, 0])

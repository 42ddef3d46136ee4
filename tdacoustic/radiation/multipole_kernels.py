"""Spherical waves at points and over panels, compiled."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

__all__ = ["panel_waves", "real_harmonics"]

Real = NDArray[np.float64]
Whole = NDArray[np.int64]

_STEP = 1e-3
"""Part of 1/k to both sides of a panel, for the derivative along its normal."""


@njit(cache=True)
def _legendre(height: float, degree: int, out: Real) -> None:
    """Fill out[n, m] with the associated Legendre functions normalised for real harmonics, ∫ Y² = 1."""
    side = math.sqrt(max(0.0, 1.0 - height * height))
    out[0, 0] = math.sqrt(0.25 / math.pi)
    for m in range(1, degree + 1):
        out[m, m] = (
            out[m - 1, m - 1] * side * math.sqrt((2.0 * m + 1.0) / (2.0 * m)) * (math.sqrt(2.0) if m == 1 else 1.0)
        )
    for m in range(degree):
        out[m + 1, m] = height * math.sqrt(2.0 * m + 3.0) * out[m, m]
        for n in range(m + 2, degree + 1):
            first = math.sqrt((4.0 * n * n - 1.0) / (n * n - m * m))
            second = math.sqrt(((n - 1.0) ** 2 - m * m) / (4.0 * (n - 1.0) ** 2 - 1.0))
            out[n, m] = first * (height * out[n - 1, m] - second * out[n - 2, m])


@njit(cache=True)
def _spherical_bessel(x: float, degree: int, out: Real) -> None:
    """Fill out[n] with j_n(x), n = 0..degree: downward from far above, scaled by the larger of j_0 and j_1."""
    if x < 1e-6:
        out[:] = 0.0
        out[0] = 1.0
        return
    start = degree + int(x) + 20 + int(4.0 * math.sqrt(degree + 1.0))
    above, here = 0.0, 1e-280
    for n in range(start, 0, -1):
        below = (2.0 * n + 1.0) / x * here - above
        above, here = here, below
        if abs(here) > 1e250:
            here *= 1e-250
            above *= 1e-250
            for k in range(n, degree + 1):
                out[k] *= 1e-250
        if n - 1 <= degree:
            out[n - 1] = here
    zeroth, first = math.sin(x) / x, math.sin(x) / (x * x) - math.cos(x) / x
    factor = zeroth / here if abs(zeroth) > abs(first) else first / above
    for n in range(degree + 1):
        out[n] *= factor


@njit(cache=True)
def _harmonics(place: Real, numbers: Whole, degree: int, legendre: Real, around: Real, radial: Real, out: Real) -> None:
    """Fill out[h] with radial[n] Y_nm in the direction of a place."""
    distance = math.sqrt(place[0] ** 2 + place[1] ** 2 + place[2] ** 2)
    _legendre(place[2] / distance if distance > 0.0 else 1.0, degree, legendre)
    flat = math.sqrt(place[0] ** 2 + place[1] ** 2)
    cosine, sine = (place[0] / flat, place[1] / flat) if flat > 0.0 else (1.0, 0.0)
    around[0, 0], around[0, 1] = 1.0, 0.0
    for m in range(1, degree + 1):
        around[m, 0] = around[m - 1, 0] * cosine - around[m - 1, 1] * sine
        around[m, 1] = around[m - 1, 1] * cosine + around[m - 1, 0] * sine
    for h in range(len(numbers)):
        n, m = numbers[h, 0], numbers[h, 1]
        out[h] = radial[n] * legendre[n, abs(m)] * (around[m, 0] if m >= 0 else around[-m, 1])


@njit(cache=True)
def _real_harmonics(places: Real, numbers: Whole, degree: int, out: Real) -> None:
    legendre, around = np.zeros((degree + 1, degree + 1)), np.zeros((degree + 1, 2))
    radial = np.ones(degree + 1)
    for i in range(len(places)):
        _harmonics(places[i], numbers, degree, legendre, around, radial, out[i])


def real_harmonics(places_m: Real, numbers: Whole) -> Real:
    """Return the real spherical harmonics in the directions of places, shape (places, harmonics).

    Parameters
    ----------
    places_m : ndarray, shape (places, 3)
        From the centre.
    numbers : ndarray of int, shape (harmonics, 2)
        n and m; m < 0 those with sin |m|φ.
    """
    out = np.empty((len(places_m), len(numbers)))
    _real_harmonics(np.ascontiguousarray(places_m), numbers, int(numbers[:, 0].max()), out)
    return out


@njit(cache=True, parallel=True)
def _panel_waves(
    corners: Real, normals: Real, wave: float, numbers: Whole, scale: Real, mean: NDArray[Any], slope: NDArray[Any]
) -> None:
    degree = len(scale) - 1
    step = _STEP / wave
    gauss = 1.0 / math.sqrt(3.0)
    for i in prange(len(corners)):
        legendre, around = np.zeros((degree + 1, degree + 1)), np.zeros((degree + 1, 2))
        radial, found = np.empty(degree + 1), np.empty(len(numbers))
        both, place, cross = np.zeros((2, len(numbers))), np.empty(3), np.empty(3)
        for corner in range(4):
            u = gauss * (-1.0 if corner % 2 == 0 else 1.0)
            v = gauss * (-1.0 if corner < 2 else 1.0)
            along_u = 0.25 * ((1.0 - v) * (corners[i, 1] - corners[i, 0]) + (1.0 + v) * (corners[i, 2] - corners[i, 3]))
            along_v = 0.25 * ((1.0 - u) * (corners[i, 3] - corners[i, 0]) + (1.0 + u) * (corners[i, 2] - corners[i, 1]))
            cross[0] = along_u[1] * along_v[2] - along_u[2] * along_v[1]
            cross[1] = along_u[2] * along_v[0] - along_u[0] * along_v[2]
            cross[2] = along_u[0] * along_v[1] - along_u[1] * along_v[0]
            area = math.sqrt(cross[0] ** 2 + cross[1] ** 2 + cross[2] ** 2)
            point = 0.25 * (
                (1.0 - u) * (1.0 - v) * corners[i, 0]
                + (1.0 + u) * (1.0 - v) * corners[i, 1]
                + (1.0 + u) * (1.0 + v) * corners[i, 2]
                + (1.0 - u) * (1.0 + v) * corners[i, 3]
            )
            for side in range(2):
                sign = 1.0 if side == 0 else -1.0
                for axis in range(3):
                    place[axis] = point[axis] + sign * step * normals[i, axis]
                distance = math.sqrt(place[0] ** 2 + place[1] ** 2 + place[2] ** 2)
                _spherical_bessel(wave * distance, degree, radial)
                for n in range(degree + 1):
                    radial[n] *= scale[n]
                _harmonics(place, numbers, degree, legendre, around, radial, found)
                for h in range(len(numbers)):
                    both[side, h] += area * found[h]
        for h in range(len(numbers)):
            mean[i, h] = 0.5 * (both[0, h] + both[1, h])
            slope[i, h] = (both[0, h] - both[1, h]) / (2.0 * step)


def panel_waves(
    corners_m: Real, normals: Real, wave_number_rad_m: float, numbers: Whole, scale: Real
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the integrals over panels of j_n(kr) Y_nm and of its derivative along their normals.

    Two by two Gauss points a panel.

    Parameters
    ----------
    corners_m : ndarray, shape (panels, 4, 3)
        From the centre.
    normals : ndarray, shape (panels, 3)
    wave_number_rad_m : float
    numbers : ndarray of int, shape (harmonics, 2)
    scale : ndarray, shape (degrees,)
        Factor by n, so that high ones stay within single precision.

    Returns
    -------
    waves, slopes : ndarray of float32, shape (panels, harmonics)
    """
    shape = (len(corners_m), len(numbers))
    mean, slope = np.empty(shape, dtype=np.float32), np.empty(shape, dtype=np.float32)
    _panel_waves(
        np.ascontiguousarray(corners_m), np.ascontiguousarray(normals), wave_number_rad_m, numbers, scale, mean, slope
    )
    return mean, slope

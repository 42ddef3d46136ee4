"""Outgoing spherical waves of a body: one set of numbers for every receiver around it.

Outside the sphere around `centre_m` that encloses a body, its field is (time factor e^{+jωt})::

    p(r) = Σ_nm c_nm · e^{-jka} h_n(kr) / h_n(ka) · Y_nm        h_n = j_n - j y_n, Y_nm real, ∫ Y² = 1
    c_nm = -jk h_n(ka) e^{jka} ∫ (p ∂φ_nm/∂n + jkρc v φ_nm) dS,  φ_nm = j_n(kr) Y_nm

with a the radius of that sphere: c is the pressure on it, order by order. It is smooth in frequency (what is left of
its phase are ways of at most a), so it can be interpolated, and it knows of no receiver: level at 4 m, directivity,
sound power and microphones all follow from it.

Over rigid ground the centre lies on the ground and the image doubles the coefficients that are even there.

Source: the expansion of the free-space Green's function, E. G. Williams, Fourier Acoustics (1999), chapters 6 and 8.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.radiation.multipole_kernels import panel_waves, real_harmonics
from tdacoustic.radiation.surfaces import Surface

__all__ = ["LEAST_DEGREE", "Multipoles", "degree_for"]

Point = tuple[float, float, float]
Real = NDArray[np.float64]
Complex = NDArray[np.complexfloating[Any, Any]]

LEAST_DEGREE: Final = 10
"""Degrees kept at low frequencies, for receivers half a radius off the enclosing sphere."""


def degree_for(wave_number_rad_m: float, radius_m: float) -> int:
    """Return the highest degree of a body's waves that reaches far, to about a percent of its pressure.

    Beyond ka the waves fade; the excess grows with the cube root (W. C. Chew et al., Fast and Efficient Algorithms in
    Computational Electromagnetics, 2001, section 3.4).

    Examples
    --------
    >>> degree_for(55.0, 0.8)
    53
    """
    size = wave_number_rad_m * radius_m
    return max(LEAST_DEGREE, math.ceil(size + 2.2 * size ** (1.0 / 3.0) + 1.0))


@dataclass(frozen=True)
class Multipoles:
    """Spherical waves around a centre at one frequency.

    Parameters
    ----------
    wave_number_rad_m : float
    centre_m : (float, float, float)
        On the ground where there is one.
    radius_m : float
        The a of the module's equations.
    degree : int
        Highest n.
    over_ground : bool
        Only waves that are even in z stay, for rigid ground at the height of the centre.
    """

    wave_number_rad_m: float
    centre_m: Point
    radius_m: float
    degree: int
    over_ground: bool = False

    @cached_property
    def numbers(self) -> NDArray[np.int64]:
        """N and m of the harmonics, m < 0 those with the sine: (harmonics, 2)."""
        pairs = [(n, m) for n in range(self.degree + 1) for m in range(-n, n + 1)]
        return np.array([pair for pair in pairs if not (self.over_ground and sum(pair) % 2)], dtype=np.int64)

    @property
    def _images(self) -> float:
        return 2.0 if self.over_ground else 1.0

    @cached_property
    def _at_radius(self) -> Complex:
        """h_n(ka) e^{jka} by degree."""
        size = self.wave_number_rad_m * self.radius_m
        return _hankel(self.degree, np.array([size]))[0] * np.exp(1j * size)

    def of_surface(self, surface: Surface, pressures_pa: Complex, velocity_m_s: ArrayLike, impedance: float) -> Complex:
        """Return the coefficients of a body's field.

        Parameters
        ----------
        surface : Surface
        pressures_pa : ndarray, shape (panels, n)
            On its panels.
        velocity_m_s : array_like, shape (panels, n), or 0
            Out of the body.
        impedance : float
            ρc of the air in Pa s/m.

        Returns
        -------
        ndarray of complex64, shape (harmonics, n)
        """
        scale = np.abs(self._at_radius)
        mean, slope = panel_waves(
            surface.corners_m - np.asarray(self.centre_m), surface.normals, self.wave_number_rad_m, self.numbers, scale
        )
        found = _real_product(slope, pressures_pa)
        if np.any(velocity_m_s):
            factor = 1j * self.wave_number_rad_m * impedance
            found = found + factor * _real_product(mean, np.asarray(velocity_m_s))
        phase = -1j * self._images * self.wave_number_rad_m * self._at_radius / scale
        return np.asarray(phase[self.numbers[:, 0], None] * found, dtype=np.complex64)

    def of_point_source(self, source_m: ArrayLike) -> Complex:
        """Return the coefficients of the field of a point source, beyond its own distance from the centre.

        Parameters
        ----------
        source_m : array_like, shape (3,)
            Of 1 Pa at 1 m.

        Returns
        -------
        ndarray of complex, shape (harmonics,)
        """
        from scipy.special import spherical_jn

        place = np.asarray(source_m, dtype=np.float64)[None] - np.asarray(self.centre_m)
        distance = max(float(np.linalg.norm(place)), 1e-9)
        regular = spherical_jn(np.arange(self.degree + 1), self.wave_number_rad_m * distance)
        by_degree = -4j * math.pi * self._images * self.wave_number_rad_m * regular * self._at_radius
        return np.asarray(by_degree[self.numbers[:, 0]] * real_harmonics(place, self.numbers)[0])

    def at(self, points_m: ArrayLike) -> Complex:
        """Return the waves at points, in Pa per coefficient: (points, harmonics).

        Parameters
        ----------
        points_m : array_like, shape (points, 3)
            Outside the sphere of `radius_m`.
        """
        places = np.asarray(points_m, dtype=np.float64).reshape(-1, 3) - np.asarray(self.centre_m)
        distance = np.linalg.norm(places, axis=1)
        by_degree = _hankel(self.degree, self.wave_number_rad_m * distance) / self._at_radius
        return np.asarray(by_degree[:, self.numbers[:, 0]] * real_harmonics(places, self.numbers))

    def mean_weights(self, radius_m: float) -> Real:
        """Return the weights of |c|² in the mean of |p|² over the sphere of a radius around the centre: (harmonics,).

        Over ground: over the half sphere.
        """
        distance = np.array([self.wave_number_rad_m * radius_m])
        by_degree = np.abs(_hankel(self.degree, distance)[0] / self._at_radius) ** 2 / (4.0 * math.pi)
        return np.asarray(by_degree[self.numbers[:, 0]])

    def mean_of_source(self, source_m: ArrayLike, radius_m: float) -> float:
        """Return the mean of |p|² over a sphere of what `of_point_source` leaves out of a source: degrees beyond.

        Parameters
        ----------
        source_m : array_like, shape (3,)
        radius_m : float
            Farther from the centre than the source.
        """
        from scipy.special import eval_legendre, spherical_jn

        place = np.asarray(source_m, dtype=np.float64) - np.asarray(self.centre_m)
        distance = float(np.linalg.norm(place))
        size = self.wave_number_rad_m * distance
        last = math.ceil(size + 6.0 * size ** (1.0 / 3.0) + 10.0)
        degrees = np.arange(self.degree + 1, max(last, self.degree) + 1)
        if not len(degrees) or distance == 0.0:
            return 0.0
        outgoing = np.abs(_hankel(int(degrees[-1]), np.array([self.wave_number_rad_m * radius_m]))[0][degrees]) ** 2
        terms = (2 * degrees + 1) * spherical_jn(degrees, size) ** 2 * outgoing * self.wave_number_rad_m**2
        if self.over_ground:
            between = 1.0 - 2.0 * (place[2] / distance) ** 2
            terms = 2.0 * terms * (1.0 + eval_legendre(degrees, between))
        return float(terms.sum())


def _hankel(degree: int, arguments: Real) -> Complex:
    """Return h_n(x) = j_n - j y_n for n = 0..degree: (arguments, degrees)."""
    from scipy.special import spherical_jn, spherical_yn

    degrees = np.arange(degree + 1)[None]
    with np.errstate(over="ignore"):
        return np.asarray(spherical_jn(degrees, arguments[:, None]) - 1j * spherical_yn(degrees, arguments[:, None]))


def _real_product(waves: NDArray[np.float32], columns: ArrayLike) -> Complex:
    """Return waves.T @ columns for real waves (panels, harmonics) and complex columns (panels, n)."""
    complex_columns = np.ascontiguousarray(columns, dtype=np.complex64)
    product = np.ascontiguousarray(waves.T @ complex_columns.view(np.float32))
    return np.asarray(product.view(np.complex64))

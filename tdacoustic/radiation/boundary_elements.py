"""The sound field outside a vibrating or rigid body: boundary elements of Burton and Miller's equation.

Constant pressure and velocity on flat panels, collocation at their centres. With e^{+jωt}, G = e^{-jkR} / (4πR), the
normal out of the body, the double layer D, the single layer S, their derivatives along the normal H and D', b = 1/k::

    (½ - D + jb H) p = jkρc (S - jb (½ + D')) v          on the surface
    p = D p + jkρc S v                                   outside

The pressure at a receiver is linear in the velocities, so many velocities share one factorisation, or, where the
receivers are fewer, the receivers do. Mirror planes split fields into parities that do not see each other: with three
planes eight systems of an eighth of the size, 1/64 of the work.

How good it is, on the reference housing 0.45 x 1.0 x 0.9 m with the mean velocity of each panel (the value at its
centre is worse where a panel is not small against a bending wave): 7.5 panels a wavelength give the level of patterns
on one side at 4 m within 0.22 dB, 11 within 0.08 dB (700 and 1000 Hz, tests/evidence). That takes some 500 panels on
the body, however long the wave: a sphere of 96 panels is off by 0.4 dB.

Sources: A. J. Burton, G. F. Miller, Proc. R. Soc. A 323 (1971) 201; the sign of the coupling: S. Marburg, J. Comput.
Acoust. 24 (2016) 1550016.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.errors import RadiationError
from tdacoustic.radiation.mirror_threads import of_each
from tdacoustic.radiation.panel_integrals import assembled, place, refuse_near
from tdacoustic.radiation.surfaces import Surface

__all__ = ["ExteriorProblem"]

Real = NDArray[np.float64]
Complex = NDArray[np.complexfloating[Any, Any]]

_RECEIVERS_AT_ONCE = 256
"""Rows kept in memory together: with 15,000 panels 60 MB."""


@dataclass(frozen=True, eq=False)
class ExteriorProblem:
    """A body in air, at one frequency.

    The first use of it assembles and factors the systems, and they stay with it: one problem for one frequency, dropped
    before the next.

    Parameters
    ----------
    surface : Surface
    wave_number_rad_m : float
        k = ω/c.
    impedance_pa_s_m : float
        ρc of the air.
    ground_m : float, optional
        Height z of rigid ground below the body; None of free space. The surface then has no mirror plane z.
    precision : {"single", "double"}
        Of the systems; the integrals are always double. Single is off by parts in 1e5 (test), half the time and memory.
    formulation : {"burton_miller", "plain"}
        ``"plain"`` is b = 0, which fails at the resonances of the space inside: kept to show that it does.
    least_panels_per_wavelength : float
        What the longest side of a panel must at least be.

    Raises
    ------
    RadiationError
        A number out of range, a grid that is too coarse for the wave number, a body that reaches the ground.

    Examples
    --------
    A sphere that breathes with 1 m/s, against p = ρc jka / (1 + jka) · a / r at k = 2 rad/m:

    >>> import numpy as np
    >>> from tdacoustic.radiation.grids import sphere_surface
    >>> problem = ExteriorProblem(sphere_surface(0.5, 8), 2.0, 413.0)
    >>> pressure = problem.transfer([[3.0, 0.0, 0.0]], np.ones((problem.surface.n_panels, 1)))
    >>> bool(abs(abs(pressure[0, 0]) / (413.0 / abs(1 + 1j) * 0.5 / 3.0) - 1.0) < 0.02)
    True
    """

    surface: Surface
    wave_number_rad_m: float
    impedance_pa_s_m: float
    ground_m: float | None = None
    precision: Literal["single", "double"] = "single"
    formulation: Literal["burton_miller", "plain"] = "burton_miller"
    least_panels_per_wavelength: float = 6.0

    def __post_init__(self) -> None:
        for name in ("wave_number_rad_m", "impedance_pa_s_m"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise RadiationError(f"{name} must be > 0, got {value!r}")
        if self.panels_per_wavelength < self.least_panels_per_wavelength:
            raise RadiationError(
                f"the grid has {self.panels_per_wavelength:.2g} panels a wavelength (longest side "
                f"{self.surface.longest_side_m:.4g} m at k = {self.wave_number_rad_m:.4g} rad/m), "
                f"at least {self.least_panels_per_wavelength:g} are asked for"
            )
        if self.ground_m is not None:
            if "z" in self.surface.mirrors.planes:
                raise RadiationError("a body over ground has no mirror plane z: make its grid without")
            lowest = float(self.surface.corners_m[..., 2].min())
            if not lowest > self.ground_m:
                raise RadiationError(
                    f"the body reaches down to z = {lowest:.4g} m, it must be above the ground at {self.ground_m:g} m"
                )

    @property
    def panels_per_wavelength(self) -> float:
        """Of the longest side of any panel."""
        return 2.0 * math.pi / (self.wave_number_rad_m * self.surface.longest_side_m)

    @property
    def coupling_m(self) -> float:
        """The b of Burton and Miller's equation."""
        return 1.0 / self.wave_number_rad_m if self.formulation == "burton_miller" else 0.0

    def pressures(self, normal_velocity_m_s: ArrayLike) -> Complex:
        """Return the pressure on each panel.

        Parameters
        ----------
        normal_velocity_m_s : array_like
            (panels, n): n velocities out of the body, real or complex, on all panels in the order of `Surface`.

        Returns
        -------
        ndarray
            (panels, n), in Pa.
        """
        velocity = self._parts(self._checked(normal_velocity_m_s))
        return self._whole(self._surface_pressures(velocity))

    def transfer(
        self, receivers_m: ArrayLike, normal_velocity_m_s: ArrayLike, way: Literal["direct", "adjoint"] | None = None
    ) -> Complex:
        """Return the pressure at receivers of velocities of the surface.

        Parameters
        ----------
        receivers_m : array_like
            (receivers, 3), outside the body and a panel away from it.
        normal_velocity_m_s : array_like
            (panels, n), out of the body.
        way : {"direct", "adjoint"}, optional
            Solve for the velocities, or for the receivers; None: for what is fewer.

        Returns
        -------
        ndarray
            (receivers, n), in Pa.

        Raises
        ------
        RadiationError
            Shapes that do not fit, or a receiver in or on the body or below the ground.
        """
        velocity = self._parts(self._checked(normal_velocity_m_s))
        receivers = self._outside("receiver", receivers_m)
        if way == "adjoint" or (way is None and len(receivers) < velocity.shape[-1]):
            return np.concatenate([self._received(some, velocity) for some in _portions(receivers)])
        pressure = self._surface_pressures(velocity)
        factor = 1j * self.wave_number_rad_m * self.impedance_pa_s_m
        found = []
        for double, single in (self._representation(some) for some in _portions(receivers)):

            def part(parity: int, double: Complex = double, single: Complex = single) -> Complex:
                return double[parity] @ pressure[parity] + factor * (single[parity] @ velocity[parity])

            found.append(sum(of_each(part, len(velocity))))
        return np.concatenate(found)

    def panel_transfer(self, receivers_m: ArrayLike) -> Complex:
        """Return the pressure at receivers of unit velocity of each panel alone.

        Parameters
        ----------
        receivers_m : array_like
            (receivers, 3).

        Returns
        -------
        ndarray
            (receivers, panels), in Pa s/m.
        """
        receivers = self._outside("receiver", receivers_m)
        rows = [self._receiver_rows(some) for some in _portions(receivers)]
        count = self.surface.mirrors.count
        return np.concatenate([self._whole(row.transpose(0, 2, 1) / count).T for row in rows])

    def scattered(self, sources_m: ArrayLike, receivers_m: ArrayLike) -> Complex:
        """Return the whole pressure at receivers of point sources outside the body, which is rigid.

        Parameters
        ----------
        sources_m : array_like
            (sources, 3), of 1 Pa at 1 m in free space: e^{-jkR} / R.
        receivers_m : array_like
            (receivers, 3).

        Returns
        -------
        ndarray
            (receivers, sources), in Pa: with the body, and with the ground where there is one.

        Raises
        ------
        RadiationError
            A source or receiver in or on the body or below the ground; both at one place.
        """
        sources, receivers = self._outside("source", sources_m), self._outside("receiver", receivers_m)
        direct = self._incident(sources, receivers)[0].T
        pressure = self._blocked(sources)
        scattered = [
            sum(a @ p for a, p in zip(self._representation(some)[0], pressure, strict=True))
            for some in _portions(receivers)
        ]
        return np.asarray(direct + np.concatenate(scattered))

    def blocked_pressures(self, sources_m: ArrayLike) -> Complex:
        """Return the whole pressure on each panel of the rigid body in the field of point sources.

        Parameters
        ----------
        sources_m : array_like
            (sources, 3), of 1 Pa at 1 m in free space.

        Returns
        -------
        ndarray
            (panels, sources), in Pa.
        """
        return self._whole(self._blocked(self._outside("source", sources_m)))

    def _blocked(self, sources_m: Real) -> Complex:
        incident, slope = self._incident(sources_m, self.surface.centres_m)
        along = np.einsum("sni,ni->sn", slope, self.surface.normals)
        return self._solved(self._parts((incident - 1j * self.coupling_m * along).T))

    @property
    def _type(self) -> type[np.complexfloating[Any, Any]]:
        return np.complex64 if self.precision == "single" else np.complex128

    @cached_property
    def _systems(self) -> tuple[list[tuple[Complex, NDArray[np.int32]]], Complex]:
        """The factored systems of each parity, as of the transpose, and the operators of the velocities."""
        from scipy.linalg.lapack import cgetrf, zgetrf

        n = len(self.surface.panels)
        pressure, velocity = self._assembled(self.surface.centres_m[:n], self.surface.normals[:n], True)
        diagonal = np.arange(n)
        pressure[:, diagonal, diagonal] += 0.5
        velocity[:, diagonal, diagonal] -= 0.5j * self.coupling_m
        factor = cgetrf if self.precision == "single" else zgetrf

        def factored(parity: int) -> tuple[Complex, NDArray[np.int32]]:
            triangles, pivots, fault = factor(pressure[parity].T, overwrite_a=True)
            if fault:
                raise RadiationError(f"the system is singular at k = {self.wave_number_rad_m:.6g} rad/m")
            return triangles, pivots

        return of_each(factored, len(pressure)), velocity

    def _assembled(self, points_m: Real, directions: Real, on_panels: bool) -> tuple[Complex, Complex]:
        """Return the weights A and B of `panel_kernels`: (parities, points, panels of the part)."""
        coupling = self.coupling_m if on_panels else 0.0
        return assembled(
            self.surface, points_m, directions, self.wave_number_rad_m, coupling, self.ground_m, self._type, on_panels
        )

    def _representation(self, receivers_m: Real) -> tuple[Complex, Complex]:
        """Return the weights of the pressure and of jkρc times the velocity: (parities, receivers, panels)."""
        pressure, velocity = self._assembled(receivers_m, np.zeros_like(receivers_m), False)
        return -pressure, velocity

    def _receiver_rows(self, receivers_m: Real) -> Complex:
        """Return the weights of each parity's velocities at receivers: (parities, receivers, panels of the part)."""
        double, single = self._representation(receivers_m)
        solved = self._solved(double.transpose(0, 2, 1), transposed=True)
        operators = self._systems[1]
        factor = 1j * self.wave_number_rad_m * self.impedance_pa_s_m

        def row(parity: int) -> Complex:
            return np.asarray(factor * (solved[parity].T @ operators[parity] + single[parity]), dtype=self._type)

        return np.stack(of_each(row, len(solved)))

    def _received(self, receivers_m: Real, velocity: Complex) -> Complex:
        """Return the pressures at receivers (receivers, n) of the parities' velocities, solving for the receivers."""
        rows = self._receiver_rows(receivers_m)
        return np.asarray(sum(of_each(lambda parity: rows[parity] @ velocity[parity], len(rows))))

    def _surface_pressures(self, velocity: Complex) -> Complex:
        """Return the parities' pressures on the part's panels of the parities' velocities."""
        factor, operators = 1j * self.wave_number_rad_m * self.impedance_pa_s_m, self._systems[1]
        return self._solved(
            np.stack(of_each(lambda parity: factor * (operators[parity] @ velocity[parity]), len(velocity)))
        )

    def _solved(self, right: Complex, transposed: bool = False) -> Complex:
        """Return the solutions of the systems (parities, panels of the part, n), or of their transposes."""
        from scipy.linalg.lapack import cgetrs, zgetrs

        solve = cgetrs if self.precision == "single" else zgetrs
        factors = self._systems[0]

        def solution(parity: int) -> Complex:
            found = np.zeros(right.shape[1:], dtype=self._type)
            there = np.flatnonzero(np.any(right[parity] != 0.0, axis=0))
            if len(there):
                columns = np.asfortranarray(right[parity][:, there], dtype=self._type)
                found[:, there] = solve(*factors[parity], columns, trans=0 if transposed else 1, overwrite_b=True)[0]
            return found

        return np.stack(of_each(solution, len(right)))

    def _parts(self, field: Complex) -> Complex:
        """Return a field on all panels (panels, n) in its parities: (parities, panels of the part, n)."""
        mirrors = self.surface.mirrors
        reflections = np.asarray(field, dtype=self._type).reshape(mirrors.count, -1, field.shape[-1])
        return np.asarray(mirrors.summed(reflections) / mirrors.count, dtype=self._type)

    def _whole(self, parts: Complex) -> Complex:
        """Return the field on all panels of its parities."""
        return self.surface.mirrors.summed(parts).reshape(-1, parts.shape[-1])

    def _incident(self, sources_m: Real, points_m: Real) -> tuple[Complex, Complex]:
        """Return the pressure of the sources alone, with their images, and its gradient: (sources, points[, 3])."""
        wave = 1j * self.wave_number_rad_m
        places = [sources_m]
        if self.ground_m is not None:
            places.append(sources_m * [1.0, 1.0, -1.0] + [0.0, 0.0, 2.0 * self.ground_m])
        pressure, slope = 0.0, 0.0
        for origin in places:
            arms = points_m[None] - origin[:, None]
            distance = np.linalg.norm(arms, axis=-1)
            if not (distance > 0.0).all():
                source, receiver = np.argwhere(distance == 0.0)[0]
                raise RadiationError(
                    f"source {source} is at the place of receiver {receiver}, {place(points_m[receiver])}"
                )
            part = np.exp(-wave * distance) / distance
            pressure = pressure + part
            slope = slope - (part * (wave + 1.0 / distance) / distance)[..., None] * arms
        return np.asarray(pressure), np.asarray(slope)

    def _checked(self, normal_velocity_m_s: ArrayLike) -> Complex:
        velocity = np.asarray(normal_velocity_m_s)
        if velocity.ndim != 2 or len(velocity) != self.surface.n_panels:
            raise RadiationError(
                f"normal velocities must be of shape ({self.surface.n_panels}, n), a row a panel, got {velocity.shape}"
            )
        if not np.isfinite(velocity).all():
            raise RadiationError("normal velocities must be finite")
        return velocity

    def _outside(self, name: str, points_m: ArrayLike) -> Real:
        """Return points (n, 3), checked to be outside the body and above the ground."""
        points = np.array(points_m, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
            raise RadiationError(f"{name}s must be finite and of shape (n, 3), got shape {points.shape}")
        if self.ground_m is not None and (points[:, 2] < self.ground_m).any():
            fault = int(np.argmax(points[:, 2] < self.ground_m))
            raise RadiationError(
                f"{name} {fault} at {place(points[fault])} is below the ground at z = {self.ground_m:g} m"
            )
        refuse_near(self.surface, name, points)
        return points


def _portions(points: Real) -> Iterator[Real]:
    return (points[start : start + _RECEIVERS_AT_ONCE] for start in range(0, len(points), _RECEIVERS_AT_ONCE))

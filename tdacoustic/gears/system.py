"""The gear pair on its bearings: two nodes, eight degrees of freedom (paper, equations (1) to (3))."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.errors import GearError
from tdacoustic.gears.contact_lines import ContactLines
from tdacoustic.gears.foundation import Foundation
from tdacoustic.gears.mesh_poles import LEAST_PART, MeshPoles

__all__ = ["DIRECTIONS", "FREEDOMS", "GearSystem"]

DIRECTIONS: Final = ("x", "y", "z")
"""x along the line of centres, y tangential, z along the shafts (physics.md section 2)."""

FREEDOMS: Final = ("x1", "y1", "z1", "theta1", "x2", "y2", "z2", "theta2")
"""Node 1 is the pinion, node 2 the wheel; both rotations are positive in the same sense."""

Six = tuple[float, float, float, float, float, float]

TRANSLATIONS: Final = [0, 1, 2, 4, 5, 6]
"""Places of the six translations among the `FREEDOMS`."""


@dataclass(frozen=True)
class GearSystem:
    """The equations of motion M x'' + C x' + K x + V F = T, with everything that does not depend on speed and load.

    F = c_m δ' + k_m(t) τ(δ - e) with δ = V·x; τ has a gap of the backlash, k_m follows the contact lines.

    Parameters
    ----------
    masses_kg, inertias_kg_m2, base_radii_m : (float, float)
        Of pinion and wheel.
    bearing_stiffness_n_per_m, bearing_damping_n_s_per_m : tuple of 6 float
        Pinion x, y, z, wheel x, y, z; the total of a gear's bearings.
    pressure_angle_rad : float
        Ψ of the equations: working transverse pressure angle, for centres along x.
    base_helix_angle_rad : float
    contact_lines : ContactLines
    mesh_stiffness_n_per_m : float
        Mean k̄ along the normal line of action.
    mesh_damping_ratio : float
        ζ of c_m = 2 ζ √(k̄ m_e), from 0 to 1.
    half_backlash_m : float
        b; the gap is 2b.
    transmission_error_m : tuple of float
        Amplitudes of the sines at mesh harmonics 1, 2, ..., phase 0.
    mesh_damping : {"always", "contact"}
        Whether c_m acts always, as the paper prints it, or only while teeth touch.
    foundation : Foundation, optional
        What the bearings stand on. Default: seats that do not move.

    Raises
    ------
    GearError
        A value out of range, or a transmission error that the backlash has no room for.
    """

    masses_kg: tuple[float, float]
    inertias_kg_m2: tuple[float, float]
    base_radii_m: tuple[float, float]
    bearing_stiffness_n_per_m: Six
    bearing_damping_n_s_per_m: Six
    pressure_angle_rad: float
    base_helix_angle_rad: float
    contact_lines: ContactLines
    mesh_stiffness_n_per_m: float
    mesh_damping_ratio: float
    half_backlash_m: float
    transmission_error_m: tuple[float, ...]
    mesh_damping: Literal["always", "contact"] = "always"
    foundation: Foundation | None = None

    def __post_init__(self) -> None:
        for name in ("masses_kg", "inertias_kg_m2", "base_radii_m", "bearing_stiffness_n_per_m"):
            if not all(math.isfinite(value) and value > 0.0 for value in getattr(self, name)):
                raise GearError(f"{name} must be > 0, got {getattr(self, name)!r}")
        if not all(math.isfinite(value) and value >= 0.0 for value in self.bearing_damping_n_s_per_m):
            raise GearError(f"bearing_damping_n_s_per_m must be >= 0, got {self.bearing_damping_n_s_per_m!r}")
        if not (math.isfinite(self.mesh_stiffness_n_per_m) and self.mesh_stiffness_n_per_m > 0.0):
            raise GearError(f"mesh_stiffness_n_per_m must be > 0, got {self.mesh_stiffness_n_per_m!r}")
        if not 0.0 <= self.mesh_damping_ratio <= 1.0:
            raise GearError(f"mesh_damping_ratio must be from 0 to 1, got {self.mesh_damping_ratio!r}")
        if not (math.isfinite(self.half_backlash_m) and self.half_backlash_m >= 0.0):
            raise GearError(f"half_backlash_m must be >= 0, got {self.half_backlash_m!r}")
        if not all(math.isfinite(amplitude) for amplitude in self.transmission_error_m):
            raise GearError(f"transmission_error_m must be numbers, got {self.transmission_error_m!r}")
        for name in ("pressure_angle_rad", "base_helix_angle_rad"):
            if not -0.5 * math.pi < getattr(self, name) < 0.5 * math.pi:
                raise GearError(f"{name} must be below a right angle, got {getattr(self, name)!r}")
        if self.mesh_damping not in ("always", "contact"):
            raise GearError(f"mesh_damping must be 'always' or 'contact', got {self.mesh_damping!r}")
        if self.transmission_error_pp_m > 2.0 * self.half_backlash_m:
            raise GearError(
                f"the transmission error, {1e6 * self.transmission_error_pp_m:.4g} um peak to peak, is larger than the "
                f"backlash of {2e6 * self.half_backlash_m:.4g} um: the teeth would jam"
            )

    @cached_property
    def direction_vector(self) -> NDArray[np.float64]:
        """V of equation (2): displacement along the normal line of action for each of the `FREEDOMS`."""
        sine, cosine = math.sin(self.pressure_angle_rad), math.cos(self.pressure_angle_rad)
        cos_b, sin_b = math.cos(self.base_helix_angle_rad), math.sin(self.base_helix_angle_rad)
        r1, r2 = self.base_radii_m
        x, y = cos_b * sine, cos_b * cosine
        return np.array([x, y, sin_b, r1 * cos_b, -x, -y, -sin_b, r2 * cos_b])

    @cached_property
    def mass_matrix(self) -> NDArray[np.float64]:
        """Diagonal of M, shape (8,), in kg and kg m²."""
        (m1, m2), (j1, j2) = self.masses_kg, self.inertias_kg_m2
        return np.array([m1, m1, m1, j1, m2, m2, m2, j2])

    @cached_property
    def stiffness_matrix(self) -> NDArray[np.float64]:
        """Diagonal of K, shape (8,), in N/m; nothing holds the rotations."""
        k = self.bearing_stiffness_n_per_m
        return np.array([*k[:3], 0.0, *k[3:], 0.0])

    @cached_property
    def damping_matrix(self) -> NDArray[np.float64]:
        """Diagonal of C, shape (8,), in N s/m."""
        c = self.bearing_damping_n_s_per_m
        return np.array([*c[:3], 0.0, *c[3:], 0.0])

    @property
    def equivalent_mass_kg(self) -> float:
        """m_e = 1 / (r1²/J1 + r2²/J2): both inertias as one mass on the line of action."""
        return 1.0 / sum(r**2 / j for r, j in zip(self.base_radii_m, self.inertias_kg_m2, strict=True))

    @cached_property
    def mesh_damping_n_s_per_m(self) -> float:
        """c_m = 2 ζ √(k̄ m_e)."""
        return 2.0 * self.mesh_damping_ratio * math.sqrt(self.mesh_stiffness_n_per_m * self.equivalent_mass_kg)

    @cached_property
    def on_rigid_seats(self) -> GearSystem:
        """The same gears on seats that do not move."""
        return self if self.foundation is None else replace(self, foundation=None)

    @cached_property
    def reduced(self) -> ReducedSystem:
        """The same motion without its rigid rotation, on seats that do not move."""
        return ReducedSystem.of(self)

    @cached_property
    def mesh_poles(self) -> MeshPoles:
        """The motion in time of gears on a foundation, with all its modes."""
        return MeshPoles.of(self, 0.0)

    @cached_property
    def main_mesh_poles(self) -> MeshPoles:
        """The same with those modes that the mesh feels, for multipliers."""
        return MeshPoles.of(self, LEAST_PART)

    @cached_property
    def transmission_error_pp_m(self) -> float:
        """Peak to peak of e(t)."""
        size = 64 * (len(self.transmission_error_m) + 1)
        values = self.transmission_error_at(np.arange(size) / size)
        return float(values.max() - values.min())

    def transmission_error_at(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return e in m at times in mesh periods."""
        values = np.zeros_like(time)
        for harmonic, amplitude in enumerate(self.transmission_error_m, 1):
            values = values + amplitude * np.sin(2.0 * np.pi * harmonic * time)
        return values

    def transmission_error_fourier(self, highest: int) -> NDArray[np.complex128]:
        """Return the complex Fourier coefficients of e for harmonics 0 to `highest`, in m."""
        found = np.zeros(highest + 1, dtype=np.complex128)
        held = np.array(self.transmission_error_m[:highest])
        found[1 : held.size + 1] = -0.5j * held
        return found

    def mean_force_n(self, torque_n_m: float) -> float:
        """Mean force F_0 along the normal line of action at a torque on the pinion."""
        return torque_n_m / (self.base_radii_m[0] * math.cos(self.base_helix_angle_rad))

    def receptance_m_per_n(self, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
        """Return H at frequencies above zero: δ = -H F without a mesh.

        H = Σ V_j² / (K_j - ω² M_j + iω C_j) on seats that do not move; else V_j² of the rotations, and of the
        translations V·x of `per_mesh_force`.
        """
        if self.foundation is None:
            return np.asarray((self.direction_vector**2 / self.dynamic_stiffness(frequency_hz)).sum(axis=-1))
        omega = 2.0 * np.pi * np.asarray(frequency_hz, dtype=np.float64)
        turning = -(math.cos(self.base_helix_angle_rad) ** 2) / (omega**2 * self.equivalent_mass_kg)
        moved, _ = self.per_mesh_force(np.atleast_1d(frequency_hz))
        return np.asarray(turning - (moved @ self.direction_vector[TRANSLATIONS]).reshape(omega.shape))

    def per_mesh_force(
        self, frequency_hz: NDArray[np.float64]
    ) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        """Return x, y, z of pinion and wheel, and the forces on their bearings, per mesh force, shape (n, 6) each.

        A bearing is a spring and a damper Z = K + iωC between the shaft and a seat that moves by S under the forces on
        all seats. With A = Z⁻¹ + S the bearing force is R = A⁻¹ x, and R - ω² M x = -V F gives R = -(1 - ω² M A)⁻¹ V F.

        Parameters
        ----------
        frequency_hz : ndarray, shape (n,)
            Above zero.
        """
        direction = self.direction_vector[TRANSLATIONS]
        omega = 2.0 * np.pi * frequency_hz[:, None]
        bearing = self.stiffness_matrix[TRANSLATIONS] + 1j * omega * self.damping_matrix[TRANSLATIONS]
        if self.foundation is None:
            still = np.asarray(-direction / self.dynamic_stiffness(frequency_hz)[:, TRANSLATIONS])
            return still, np.asarray(bearing * still)
        flexible = self.foundation.compliance_m_per_n(frequency_hz)
        diagonal = np.arange(6)
        flexible[:, diagonal, diagonal] += 1.0 / bearing
        inertia = omega**2 * self.mass_matrix[TRANSLATIONS]
        pushed = np.tile(-direction, (len(omega), 1))[..., None]
        force = np.linalg.solve(np.eye(6) - inertia[:, :, None] * flexible, pushed)
        return np.asarray((flexible @ force)[..., 0]), np.asarray(force[..., 0])

    def dynamic_stiffness(self, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
        """Return K_j - ω² M_j + iω C_j of each of the `FREEDOMS` on seats that do not move, shape (..., 8)."""
        omega = 2.0 * np.pi * np.asarray(frequency_hz, dtype=np.float64)[..., None]
        return np.asarray(self.stiffness_matrix - omega**2 * self.mass_matrix + 1j * omega * self.damping_matrix)

    @cached_property
    def fastest_hz(self) -> float:
        """Highest natural frequency in Hz with the mesh at its stiffest, on seats that do not move."""
        peak = float(self.contact_lines.relative(np.linspace(0.0, 1.0, 65)).max())
        return float(self.natural_frequencies_hz(peak * self.mesh_stiffness_n_per_m)[-1])

    def natural_frequencies_hz(self, mesh_stiffness_n_per_m: float | None = None) -> NDArray[np.float64]:
        """Return the undamped natural frequencies on seats that do not move in Hz, ascending, shape (8,).

        The rigid rotation is at 0.

        Parameters
        ----------
        mesh_stiffness_n_per_m : float, optional
            Default: the mean.
        """
        stiffness = self.mesh_stiffness_n_per_m if mesh_stiffness_n_per_m is None else mesh_stiffness_n_per_m
        root = 1.0 / np.sqrt(self.mass_matrix)
        coupled = np.diag(self.stiffness_matrix) + stiffness * np.outer(self.direction_vector, self.direction_vector)
        squared = np.linalg.eigvalsh(root[:, None] * coupled * root)
        return np.asarray(np.sqrt(np.maximum(squared, 0.0)) / (2.0 * np.pi))


@dataclass(frozen=True)
class ReducedSystem:
    """Seven coordinates: x, y, z of both gears and p = r1 θ1 + r2 θ2, with the equivalent mass.

    The other rotation, in which the teeth roll without force, is uncoupled from the mesh as long as T2 = T1 r2/r1. With
    it go the two unit multipliers of its Jordan block.

    Parameters
    ----------
    direction, masses, stiffness, damping : ndarray, shape (7,)
    """

    direction: NDArray[np.float64]
    masses: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    damping: NDArray[np.float64]

    @classmethod
    def of(cls, system: GearSystem) -> ReducedSystem:
        """Return the reduced form of a system."""
        kept = [0, 1, 2, 4, 5, 6]
        return cls(
            np.append(system.direction_vector[kept], math.cos(system.base_helix_angle_rad)),
            np.append(system.mass_matrix[kept], system.equivalent_mass_kg),
            np.append(system.stiffness_matrix[kept], 0.0),
            np.append(system.damping_matrix[kept], 0.0),
        )

    def response(self, forces: NDArray[np.complex128], frequency_hz: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Return the coordinates that mesh forces at frequencies above zero cause, shape (n, 7)."""
        omega = 2.0 * np.pi * frequency_hz[:, None]
        impedance = self.stiffness - omega**2 * self.masses + 1j * omega * self.damping
        return np.asarray(-self.direction * forces[:, None] / impedance)

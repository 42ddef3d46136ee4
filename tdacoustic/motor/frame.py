"""The motor's yoke and frame as rings: stiffness, mass and vibration by spatial order (physics.md section 5)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from tdacoustic.errors import MotorError
from tdacoustic.motor.cylinder import relative_intensity

__all__ = ["MU_0", "MotorFrame", "Ring"]

MU_0: Final = 4e-7 * math.pi
"""Permeability of free space in H/m."""

_ROTOR_ORDER: Final = 1


@dataclass(frozen=True)
class Ring:
    """A thin cylindrical ring that vibrates in its plane.

    Parameters
    ----------
    radius_m : float
        Mean.
    length_m, thickness_m : float
    modulus_pa, density_kg_m3 : float
    added_mass_kg : float
        That moves with it (windings, teeth), spread evenly.
    """

    radius_m: float
    length_m: float
    thickness_m: float
    modulus_pa: float
    density_kg_m3: float
    added_mass_kg: float = 0.0

    def __post_init__(self) -> None:
        for name in ("radius_m", "length_m", "thickness_m", "modulus_pa", "density_kg_m3"):
            if not getattr(self, name) > 0.0:
                raise MotorError(f"{name} of a ring must be > 0, got {getattr(self, name)!r}")
        if not self.added_mass_kg >= 0.0:
            raise MotorError(f"added_mass_kg must be >= 0, got {self.added_mass_kg!r}")

    def stiffness_n_per_m(self, order: int) -> float:
        """Total radial force over radial displacement, both peak, in a wave of an order.

        Order 0 stretches the ring: 2π E h l / R. Order r >= 2 bends it: 2π l E h³ (r² - 1)² / (12 R³).

        Raises
        ------
        MotorError
            Order 1, which moves the ring as a whole.
        """
        _check_order(order)
        if order == 0:
            return 2.0 * math.pi * self.modulus_pa * self.thickness_m * self.length_m / self.radius_m
        bending = self.modulus_pa * self.thickness_m**3 / 12.0
        return 2.0 * math.pi * self.length_m * bending * (order**2 - 1) ** 2 / self.radius_m**3

    def mass_kg(self, order: int) -> float:
        """Mass that goes with the radial displacement: bending moves the ring tangentially too, (1 + 1/r²).

        Raises
        ------
        MotorError
            Order 1.
        """
        _check_order(order)
        own = 2.0 * math.pi * self.radius_m * self.length_m * self.thickness_m * self.density_kg_m3
        total = own + self.added_mass_kg
        return total if order == 0 else total * (1.0 + 1.0 / order**2)


def _check_order(order: int) -> None:
    if order < 0:
        raise MotorError(f"spatial order must be >= 0, got {order}")
    if order == _ROTOR_ORDER:
        raise MotorError(
            "spatial order 1 moves the rotor on its bearings, which a motor of rings does not have; give such an "
            "excitation its sound_power_level_db"
        )


@dataclass(frozen=True)
class MotorFrame:
    """Core and frame of a motor, which move together (paper, equations (9) and (10)).

    Parameters
    ----------
    core, frame : Ring
        Yoke of the stator with what hangs on it; housing. The core's radius and length carry the magnetic force, those
        of the frame radiate.
    loss_factor : float
        η, above zero: without it the motor is singular at resonance.
    """

    core: Ring
    frame: Ring
    loss_factor: float

    def __post_init__(self) -> None:
        if not 0.0 < self.loss_factor <= 1.0:
            raise MotorError(f"loss_factor of a motor must be above 0 and at most 1, got {self.loss_factor!r}")

    def natural_hz(self, order: int) -> float:
        """Natural frequency of an order."""
        stiffness = self.core.stiffness_n_per_m(order) + self.frame.stiffness_n_per_m(order)
        mass = self.core.mass_kg(order) + self.frame.mass_kg(order)
        return math.sqrt(stiffness / mass) / (2.0 * math.pi)

    def displacement_m(self, order: int, frequency_hz: float, flux_density_t: tuple[float, float]) -> float:
        """Return the peak radial displacement of a rotating wave: equation (10) with the loss factor added.

        Parameters
        ----------
        order : int
            Spatial order r, not 1.
        frequency_hz : float
        flux_density_t : (float, float)
            Peak flux densities of the two waves whose product shakes the core; B1 B2 / (2 μ0) is the amplitude of the
            cross term.
        """
        force = 2.0 * math.pi * self.core.radius_m * self.core.length_m
        force *= flux_density_t[0] * flux_density_t[1] / (2.0 * MU_0)
        stiffness = self.core.stiffness_n_per_m(order) + self.frame.stiffness_n_per_m(order)
        mass = self.core.mass_kg(order) + self.frame.mass_kg(order)
        omega = 2.0 * math.pi * frequency_hz
        return force / abs(stiffness * (1.0 + 1j * self.loss_factor) - omega**2 * mass)

    def sound_power_w(
        self,
        order: int,
        frequency_hz: float,
        flux_density_t: tuple[float, float],
        impedance_pa_s_m: float,
        sound_speed_m_s: float,
        standing: bool = False,
    ) -> float:
        """Return the sound power of a wave in W: equation (9).

        ½ ρc ω² Y² 2πR₂l₂ I_c(r, kR₂); half of it where the wave stands, whose mean square over the surface is half.
        The infinite cylinder radiates more than a short one at low frequency.

        Parameters
        ----------
        order, frequency_hz, flux_density_t
            As of `displacement_m`.
        impedance_pa_s_m, sound_speed_m_s : float
            ρc and c of the air.
        standing : bool
        """
        omega = 2.0 * math.pi * frequency_hz
        velocity = omega * self.displacement_m(order, frequency_hz, flux_density_t)
        surface = 2.0 * math.pi * self.frame.radius_m * self.frame.length_m
        coefficient = float(relative_intensity(order, omega / sound_speed_m_s * self.frame.radius_m))
        power = 0.5 * impedance_pa_s_m * velocity**2 * surface * coefficient
        return 0.5 * power if standing else power

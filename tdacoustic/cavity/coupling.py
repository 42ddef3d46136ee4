"""Air in a cavity and its walls moving together, both ways.

The pressure p = Σ a_n ψ_n inside follows from a source of volume flow Q and from the walls' outward velocities q_m φ_m,

    (k_n² - k²) V a_n = jωρ (Q ψ_n(source) - Σ_m L_nm q_m),     L_nm = ∫ψ_n φ_m dS,

and pushes the walls outwards with the modal forces Σ_n L_nm a_n. The air outside does not load them (as everywhere in
this package).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.cavity.modes import CavityError, CavityModes, powers

__all__ = ["WallModes", "blocked_forces", "coupled_velocities", "wall_impedance"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class WallModes:
    """What the walls are without air: modes of 1 kg modal mass.

    Parameters
    ----------
    frequency_hz : ndarray, shape (wall modes,)
    loss_factor : float
        Structural, K (1 + jη).
    """

    frequency_hz: Real
    loss_factor: float

    def __post_init__(self) -> None:
        if not 0.0 <= self.loss_factor <= 1.0:
            raise CavityError(f"the loss factor of walls must be 0 to 1, got {self.loss_factor!r}")

    def impedance(self, frequency_hz: float) -> Complex:
        """Return modal force over modal velocity, (ω_m² (1 + jη) - ω²) / (jω), shape (wall modes,)."""
        omega, natural = 2.0 * math.pi * frequency_hz, 2.0 * math.pi * self.frequency_hz
        return np.asarray((natural**2 * (1.0 + 1j * self.loss_factor) - omega**2) / (1j * omega))


def wall_impedance(cavity: CavityModes, frequency_hz: float, loss_factor: float) -> Complex:
    """Return the modal force with which the air holds against each modal velocity, shape (wall modes, wall modes).

    Symmetric; what the air does to the walls is minus it times their modal velocities.

    Parameters
    ----------
    cavity : CavityModes
    frequency_hz : float
    loss_factor : float
        Of the air in the cavity.

    Raises
    ------
    CavityError
        As `CavityModes.squared_wave_number`.
    """
    square = cavity.squared_wave_number(frequency_hz, loss_factor)
    response, across = cavity.responses(square), cavity.walls
    air = (across.T * response.real) @ across + 1j * ((across.T * response.imag) @ across)
    inertia = 2j * math.pi * frequency_hz * cavity.density_kg_m3
    return np.asarray((air + powers(cavity.walls_beyond, square)) * (inertia / cavity.volume_m3))


def blocked_forces(cavity: CavityModes, frequency_hz: float, loss_factor: float) -> Complex:
    """Return the modal forces on walls that do not move, for a source of 1 Pa at 1 m in free space.

    The source's volume flow is held: jωρQ = 4π Pa m.

    Parameters
    ----------
    cavity, frequency_hz, loss_factor
        As of `wall_impedance`.
    """
    square = cavity.squared_wave_number(frequency_hz, loss_factor)
    forces = (cavity.responses(square) * cavity.source) @ cavity.walls + powers(cavity.source_beyond, square)
    return np.asarray(forces * (4.0 * math.pi / cavity.volume_m3))


def coupled_velocities(
    cavity: CavityModes,
    walls: WallModes,
    frequency_hz: float,
    loss_factor: float,
    source_pa_m: complex = 1.0,
    forces: ArrayLike | None = None,
) -> Complex:
    """Return the modal velocities of the walls with the air of the cavity, shape (wall modes,).

    Parameters
    ----------
    cavity : CavityModes
    walls : WallModes
    frequency_hz : float
    loss_factor : float
        Of the air in the cavity.
    source_pa_m : complex
        Amplitude of the source: its pressure in free space times the distance.
    forces : array_like of complex, shape (wall modes,), optional
        Modal forces from elsewhere, in N/√kg.

    Returns
    -------
    ndarray of complex
        Amplitudes in m √kg / s: peak where source and forces are peak.

    Raises
    ------
    CavityError
        As `CavityModes.squared_wave_number`; walls of another number of modes.

    Examples
    --------
    A piston of 10 kg and 0.1 m² on a spring closes a cube of 1 m: below all resonances the air is a spring ρc²S²/V
    beside it.

    >>> stiffness, area, mass = 1e4, 0.1, 10.0
    >>> cube = CavityModes(1.0, 343.0, 1.2, 100.0, np.zeros(1), np.full((1, 1), area / math.sqrt(mass)),
    ...                    np.zeros((0, 1, 1)), np.ones(1), np.zeros((0, 1)))
    >>> piston = WallModes(np.array([math.sqrt(stiffness / mass) / (2.0 * math.pi)]), 0.0)
    >>> velocity = coupled_velocities(cube, piston, 0.01, 0.0, 0.0, [1.0 / math.sqrt(mass)])[0] / math.sqrt(mass)
    >>> round(2.0 * math.pi * 0.01 / abs(velocity) - stiffness), round(1.2 * 343.0**2 * area**2)
    (1412, 1412)
    """
    if cavity.walls.shape[1] != len(walls.frequency_hz):
        raise CavityError(
            f"the cavity is coupled with {cavity.walls.shape[1]} wall modes, the walls have {len(walls.frequency_hz)}"
        )
    loads = source_pa_m * blocked_forces(cavity, frequency_hz, loss_factor)
    if forces is not None:
        loads = loads + np.asarray(forces, dtype=np.complex128)
    whole = wall_impedance(cavity, frequency_hz, loss_factor)
    whole[np.diag_indices(len(whole))] += walls.impedance(frequency_hz)
    return np.asarray(np.linalg.solve(whole, loads))

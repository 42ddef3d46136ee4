"""What walls of metal alone take from the sound in a cavity."""

from __future__ import annotations

import math
from typing import Final

__all__ = ["boundary_layer_loss_factor"]

_VISCOSITY_M2_S: Final = 1.51e-5
"""Kinematic, of air at 20 °C."""

_PRANDTL: Final = 0.71
_ADIABATIC: Final = 1.4


def boundary_layer_loss_factor(frequency_hz: float, surface_m2: float, volume_m3: float) -> float:
    """Return the loss factor of a cavity by viscosity and heat conduction at its smooth walls alone.

    η = S/V ((κ - 1) δ_t + 2/3 δ_v) with the layers δ_v = √(2ν/ω), δ_t = δ_v/√Pr; for a diffuse field, in which the mean
    square of the pressure at a wall is twice that inside and of the velocity along it 4/3 of |p/(ρc)|² (Kirchhoff's
    boundary layer).

    Parameters
    ----------
    frequency_hz, surface_m2, volume_m3 : float

    Examples
    --------
    The reference housing at 500 Hz:

    >>> round(boundary_layer_loss_factor(500.0, 4.19, 0.362), 5)
    0.0013
    """
    viscous = math.sqrt(2.0 * _VISCOSITY_M2_S / (2.0 * math.pi * frequency_hz))
    thermal = viscous / math.sqrt(_PRANDTL)
    return surface_m2 / volume_m3 * ((_ADIABATIC - 1.0) * thermal + 2.0 / 3.0 * viscous)

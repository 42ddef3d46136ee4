"""Air: density and speed of sound."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from tdacoustic.errors import RadiationError

__all__ = ["Air"]

_GAS_CONSTANT: Final = 287.05
"""Of dry air in J/(kg K)."""

_ADIABATIC: Final = 1.4
_PRESSURE_PA: Final = 101325.0


@dataclass(frozen=True)
class Air:
    """Dry air at standard pressure; humidity changes its speed of sound by less than half a percent.

    Parameters
    ----------
    temperature_k : float

    Examples
    --------
    >>> air = Air(293.15)
    >>> round(air.sound_speed_m_s, 1), round(air.density_kg_m3, 3)
    (343.2, 1.204)
    """

    temperature_k: float

    def __post_init__(self) -> None:
        if not self.temperature_k > 0.0:
            raise RadiationError(f"temperature of the air must be > 0 K, got {self.temperature_k!r}")

    @property
    def density_kg_m3(self) -> float:
        """ρ = p / (R T)."""
        return _PRESSURE_PA / (_GAS_CONSTANT * self.temperature_k)

    @property
    def sound_speed_m_s(self) -> float:
        """Of small waves: c = √(κ R T)."""
        return math.sqrt(_ADIABATIC * _GAS_CONSTANT * self.temperature_k)

    @property
    def impedance_pa_s_m(self) -> float:
        """ρc."""
        return self.density_kg_m3 * self.sound_speed_m_s

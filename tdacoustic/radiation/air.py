"""Air: density, speed of sound and absorption."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.errors import RadiationError

__all__ = ["ABSORPTION_RANGE", "Air", "absorption_db_per_m"]

_GAS_CONSTANT: Final = 287.05
"""Of dry air in J/(kg K)."""

_ADIABATIC: Final = 1.4
_PRESSURE_PA: Final = 101325.0

_REFERENCE_K: Final = 293.15
_TRIPLE_POINT_K: Final = 273.16

ABSORPTION_RANGE: Final = ((-20.0, 50.0), (10.0, 100.0), (50.0, 10000.0))
"""Temperatures in °C, relative humidities in % and frequencies in Hz of the tables of ISO 9613-1."""


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


def absorption_db_per_m(frequency_hz: ArrayLike, temperature_k: float, humidity_percent: float) -> NDArray[np.float64]:
    """Return what air at standard pressure takes from a pure tone on its way (ISO 9613-1:1993, equations (3) to (5)).

    Classical absorption and the relaxation of oxygen and nitrogen. The standard states 10 % for 0.05 to 5 % of water
    in the air at -20 to 50 °C; outside of `ABSORPTION_RANGE` it is an extrapolation.

    Parameters
    ----------
    frequency_hz : array_like
    temperature_k : float
    humidity_percent : float
        Relative humidity, 0 to 100.

    Raises
    ------
    RadiationError
        A temperature or a humidity that cannot be.

    Examples
    --------
    >>> round(1000.0 * float(absorption_db_per_m(1000.0, 283.15, 70.0)), 2)
    3.66
    """
    if not temperature_k > 0.0:
        raise RadiationError(f"temperature of the air must be > 0 K, got {temperature_k!r}")
    if not 0.0 <= humidity_percent <= 100.0:
        raise RadiationError(f"humidity of the air must be from 0 to 100 %, got {humidity_percent!r}")
    squared = np.asarray(frequency_hz, dtype=np.float64) ** 2
    relative = temperature_k / _REFERENCE_K
    saturation = 10.0 ** (4.6151 - 6.8346 * (_TRIPLE_POINT_K / temperature_k) ** 1.261)
    water = humidity_percent * saturation  # molar concentration in %
    oxygen_hz = 24.0 + 4.04e4 * water * (0.02 + water) / (0.391 + water)
    nitrogen_hz = relative**-0.5 * (9.0 + 280.0 * water * math.exp(-4.17 * (relative ** (-1.0 / 3.0) - 1.0)))
    relaxation = 0.01275 * math.exp(-2239.1 / temperature_k) / (oxygen_hz + squared / oxygen_hz)
    relaxation = relaxation + 0.1068 * math.exp(-3352.0 / temperature_k) / (nitrogen_hz + squared / nitrogen_hz)
    return np.asarray(8.686 * squared * (1.84e-11 * math.sqrt(relative) + relative**-2.5 * relaxation))

"""The modes of a rigid-walled cavity, as the coupling with its walls needs them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tdacoustic.housing import HousingError

__all__ = ["CavityError", "CavityModes"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


class CavityError(HousingError):
    """A cavity, a source in it or a point of it that cannot be."""


@dataclass(frozen=True)
class CavityModes:
    """Modes of the air in a cavity of any shape with rigid walls, and what couples them with walls and a source.

    Mode n is a real function ψ_n with a mean square of 1 over the cavity. Those above the kept ones follow the walls
    and the source without resonance: their sum is a power series in k², whose coefficients stand in `walls_beyond` and
    `source_beyond` (none of them: an empty first axis). Arrays are read-only.

    Parameters
    ----------
    volume_m3 : float
    sound_speed_m_s, density_kg_m3 : float
        Of the air in it.
    highest_hz : float
        Up to which the modes are meant.
    wave_number_rad_m : ndarray, shape (modes,)
        k_n; the first is 0, the compression of all the air alike.
    walls : ndarray, shape (modes, wall modes)
        ∫ψ_n φ_m dS over the walls, φ_m the outward displacement of wall mode m in 1/√kg.
    walls_beyond : ndarray, shape (terms, wall modes, wall modes)
        Σ L_nm L_nm' / k_n^(2t+2) over the modes n that are not kept, L the integrals of `walls`.
    source : ndarray, shape (modes,)
        ψ_n where the source is.
    source_beyond : ndarray, shape (terms, wall modes)
        Σ ψ_n(source) L_nm / k_n^(2t+2) over the same.

    Raises
    ------
    CavityError
        Shapes that do not fit, or a value out of range.
    """

    volume_m3: float
    sound_speed_m_s: float
    density_kg_m3: float
    highest_hz: float
    wave_number_rad_m: Real
    walls: Real
    walls_beyond: Real
    source: Real
    source_beyond: Real

    def __post_init__(self) -> None:
        for name in ("volume_m3", "sound_speed_m_s", "density_kg_m3", "highest_hz"):
            if not getattr(self, name) > 0.0:
                raise CavityError(f"{name} of a cavity must be > 0, got {getattr(self, name)!r}")
        modes, wall_modes = self.walls.shape
        terms = len(self.walls_beyond)
        expected = {
            "wave_number_rad_m": (modes,),
            "source": (modes,),
            "walls_beyond": (terms, wall_modes, wall_modes),
            "source_beyond": (terms, wall_modes),
        }
        for name, shape in expected.items():
            if getattr(self, name).shape != shape:
                raise CavityError(
                    f"{name} of {modes} cavity modes and {wall_modes} wall modes must have the shape {shape}, got "
                    f"{getattr(self, name).shape}"
                )
        for name in ("wave_number_rad_m", "walls", "source", "walls_beyond", "source_beyond"):
            held = getattr(self, name)
            if held.flags.writeable:
                held = held.copy()
                held.flags.writeable = False
                object.__setattr__(self, name, held)

    @property
    def frequency_hz(self) -> Real:
        """Natural frequencies of the kept modes, shape (modes,)."""
        return np.asarray(self.wave_number_rad_m * self.sound_speed_m_s / (2.0 * np.pi))

    def squared_wave_number(self, frequency_hz: float, loss_factor: float) -> complex:
        """Return k² (1 - jη): the loss factor is that of the air's compressibility, ρc² (1 + jη) for small η.

        Raises
        ------
        CavityError
            A frequency outside 0 to `highest_hz`, or a loss factor outside 0 to 1.
        """
        if not 0.0 < frequency_hz <= self.highest_hz * (1.0 + 1e-9):
            raise CavityError(f"the cavity's modes are for 0 to {self.highest_hz:g} Hz, got {frequency_hz:g}")
        if not 0.0 <= loss_factor <= 1.0:
            raise CavityError(f"the loss factor of a cavity must be 0 to 1, got {loss_factor!r}")
        return complex((2.0 * np.pi * frequency_hz / self.sound_speed_m_s) ** 2 * (1.0 - 1j * loss_factor))

    def responses(self, squared_wave_number: complex) -> Complex:
        """Return 1 / (k_n² - k²), shape (modes,)."""
        return np.asarray(1.0 / (self.wave_number_rad_m**2 - squared_wave_number))


def powers(terms: NDArray[Any], squared_wave_number: complex) -> Complex:
    """Return the sum of terms times (k²)^t along the first axis; zeros of no terms."""
    total = np.zeros(terms.shape[1:], dtype=np.complex128)
    for term in terms[::-1]:
        total = total * squared_wave_number + term
    return total

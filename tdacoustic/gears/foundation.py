"""What the bearings stand on: a structure by its modes, seen where the bearings of the two gears press on it.

With it the coupling of gears and housing is two-way: a bearing's spring and damper lie between a shaft and a seat that
moves. Without it the seats stand still (one-way coupling).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.errors import GearError

__all__ = ["Foundation"]

CORRECTION_LOSS: Final = 0.3
"""Loss factor of the shapes of a static correction, as viscous dampers [assumed]. Of 0.02 to 1 it came closest to the
reference housing with modes to twice and three times the frequency: at 108 speeds and helix angles of the reference
drive the peak to peak of δ was off by at most 2.3 % (0.6 % at nine of ten), bearing forces by 0.3 dB (0.15 dB)."""

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Foundation:
    """Modes of a structure with a modal mass of 1 kg, and how they move the bearings of the gears.

    The modal sum is that of a mechanical system at every frequency: reciprocal and passive. Beyond the modes that were
    computed it is no longer the structure's own, but stays such a system, and its motion falls with the square of the
    frequency; so it is used throughout, and nothing jumps where the modes end. Shapes of a static correction are no
    resonances, and must not act as such on mesh harmonics there: they are damped by `CORRECTION_LOSS`. Arrays are
    read-only.

    Parameters
    ----------
    frequency_hz : ndarray, shape (modes,)
        Above zero.
    shapes : ndarray, shape (modes, 6)
        Displacement under the bearings of pinion x, y, z and wheel x, y, z in the frame of the gears, in 1/√kg.
    loss_factor : float
        η, above 0 and at most 1.
    damping : {"structural", "viscous"}
        ``"structural"``: ω_m² (1 + jη), which has no equation in time. ``"viscous"``: a damper η ω_m for each mode,
        the same at its resonance. Multipliers and the integration in time always take the second.
    corrections : int
        How many of the modes, the last ones, are shapes of a static correction.

    Raises
    ------
    GearError
        Another shape, or a value out of range.

    Examples
    --------
    A rigid mass of 4 kg on a soft spring, which the pinion's bearings push along x:

    >>> mass = Foundation(np.array([1.0]), np.array([[0.5, 0.0, 0.0, 0.0, 0.0, 0.0]]), 0.02)
    >>> round(float(mass.compliance_m_per_n(100.0)[0, 0, 0].real) * (2.0 * np.pi * 100.0) ** 2, 3)
    -0.25
    """

    frequency_hz: Real
    shapes: Real
    loss_factor: float
    damping: Literal["structural", "viscous"] = "structural"
    corrections: int = 0

    def __post_init__(self) -> None:
        frequency, shapes = (np.array(held, dtype=np.float64) for held in (self.frequency_hz, self.shapes))
        if frequency.ndim != 1 or shapes.shape != (frequency.size, 6):
            raise GearError(
                f"{frequency.size} modes of a foundation need shapes of {(frequency.size, 6)}, got {shapes.shape}"
            )
        if not (np.isfinite(frequency).all() and (frequency > 0.0).all() and np.isfinite(shapes).all()):
            raise GearError("modes of a foundation must have frequencies above 0 and finite shapes")
        if not 0.0 < self.loss_factor <= 1.0:
            raise GearError(f"loss_factor of a foundation must be above 0 and at most 1, got {self.loss_factor!r}")
        if self.damping not in ("structural", "viscous"):
            raise GearError(f"damping of a foundation must be 'structural' or 'viscous', got {self.damping!r}")
        if not 0 <= self.corrections <= frequency.size:
            raise GearError(f"{frequency.size} modes of a foundation cannot hold {self.corrections!r} corrections")
        for name, held in (("frequency_hz", frequency), ("shapes", shapes)):
            held.flags.writeable = False
            object.__setattr__(self, name, held)

    @cached_property
    def natural_rad_s(self) -> Real:
        """ω_m, shape (modes,)."""
        return np.asarray(2.0 * np.pi * self.frequency_hz)

    @cached_property
    def loss_factors(self) -> Real:
        """η of each mode, shape (modes,)."""
        found = np.full(self.frequency_hz.size, self.loss_factor)
        found[found.size - self.corrections :] = max(self.loss_factor, CORRECTION_LOSS)
        return found

    @cached_property
    def _products(self) -> Real:
        return np.asarray((self.shapes[:, :, None] * self.shapes[:, None, :]).reshape(-1, 36))

    def modal_receptance(self, frequency_hz: ArrayLike) -> Complex:
        """Return q_m per modal force in s², shape (n, modes)."""
        omega = 2.0 * np.pi * np.atleast_1d(np.asarray(frequency_hz, dtype=np.float64))[:, None]
        natural = self.natural_rad_s
        lossy = omega * natural
        if self.damping == "structural":
            resonances = natural.size - self.corrections
            lossy[:, :resonances] = natural[:resonances] ** 2
        return np.asarray(1.0 / (natural**2 - omega**2 + 1j * self.loss_factors * lossy))

    def compliance_m_per_n(self, frequency_hz: ArrayLike) -> Complex:
        """Return S: displacements under the bearings per force on them, shape (n, 6, 6), symmetric.

        Parameters
        ----------
        frequency_hz : array_like, shape (n,)
            From zero.
        """
        receptance = self.modal_receptance(frequency_hz)
        whole = receptance.real @ self._products + 1j * (receptance.imag @ self._products)
        return whole.reshape(-1, 6, 6)

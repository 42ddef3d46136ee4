"""The response of modes to forces at the seats, whichever way the modes were computed."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.housing.box import HousingError

__all__ = ["SeatResponse"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


class SeatResponse:
    """What follows from frequencies and seats' displacements of modes of unit modal mass.

    `HousingModes` of a box and `SolidModes` of a STEP file are of this kind.
    """

    highest_hz: float
    natural: int
    frequency_hz: Real
    seats: Real
    mass_kg: float

    @property
    def own_loss_factor(self) -> float:
        """Of the housing that the modes are of."""
        raise NotImplementedError

    def _receptance(self, frequency_hz: ArrayLike, loss_factor: float | None) -> tuple[Real, Complex]:
        """Return ω and 1 / (ω_m² (1 + jη) - ω²), shape (modes, n)."""
        damping = self.own_loss_factor if loss_factor is None else loss_factor
        if not 0.0 < damping <= 1.0:
            raise HousingError(f"loss_factor must be above 0 and at most 1, got {damping!r}")
        asked_hz = np.atleast_1d(np.asarray(frequency_hz, dtype=np.float64))
        outside = ~((asked_hz >= 0.0) & (asked_hz <= self.highest_hz * (1.0 + 1e-9)))
        if outside.any():
            raise HousingError(
                f"the modes are for 0 to {self.highest_hz:g} Hz, the response is asked for at "
                f"{asked_hz[outside][0]:g} Hz"
            )
        omega = 2.0 * np.pi * asked_hz
        natural = 2.0 * np.pi * self.frequency_hz[:, None]
        return omega, np.asarray(1.0 / (natural**2 * (1.0 + 1j * damping) - omega**2))

    def response(self, frequency_hz: ArrayLike, forces_n: ArrayLike, loss_factor: float | None = None) -> Complex:
        """Return the modal velocities under forces at the seats, time factor exp(+jωt).

        Times `normal_at` they are velocities of the surface. What the static correction leaves out grows with the
        fourth power of the frequency (figures in tests/evidence/README.md). The loss factor holds for the springs too.

        Parameters
        ----------
        frequency_hz : array_like, shape (n,)
        forces_n : array_like of complex, shape (4, 3, n)
            Amplitudes by `SEAT_PLACES` and direction in the drive frame, as `frames.seat_loads` gives them.
        loss_factor : float, optional
            Instead of the box's.

        Returns
        -------
        ndarray of complex, shape (modes, n)
            Amplitudes in m √kg / s: peak where the forces are peak.

        Raises
        ------
        HousingError
            Forces of another shape, a frequency below 0 or above `highest_hz`, or a loss factor out of range.
        """
        omega, receptance = self._receptance(frequency_hz, loss_factor)
        forces = np.asarray(forces_n, dtype=np.complex128)
        if forces.shape != (4, 3, omega.size):
            raise HousingError(f"forces must have the shape {(4, 3, omega.size)}, got {forces.shape}")
        modal = np.einsum("msd,sdn->mn", self.seats, forces)
        return np.asarray(1j * omega * receptance * modal)

    def seat_compliance(self, frequency_hz: ArrayLike, loss_factor: float | None = None) -> Complex:
        """Return displacements of the seats per force at the seats in m/N, shape (4, 3, 4, 3, n).

        Parameters
        ----------
        frequency_hz : array_like, shape (n,)
        loss_factor : float, optional
            Instead of the box's.

        Raises
        ------
        HousingError
            A frequency below 0 or above `highest_hz`, or a loss factor out of range.
        """
        _, receptance = self._receptance(frequency_hz, loss_factor)
        return np.asarray(np.einsum("msd,mte,mn->sdten", self.seats, self.seats, receptance, optimize=True))

"""The modes of a housing as the sound field needs them, and its response to forces at the seats."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.housing.box import Box, HousingError
from tdacoustic.housing.surface import PanelNodes, read_only

__all__ = ["HousingModes"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class HousingModes:
    """Modes with a modal mass of 1 kg: natural ones, then those that make the static response exact.

    The last ones (`eigenmodes.residual_modes`) enter every sum like the others; their frequencies lie above
    the natural ones and are no resonances of the housing. Arrays are read-only.

    Parameters
    ----------
    box : Box
    highest_hz : float
        Responses are good up to here; the natural modes reach further (`box_modes.MODES_BEYOND`).
    natural : int
        Number of natural modes; the others are the static correction.
    frequency_hz : ndarray, shape (modes,)
    seats : ndarray, shape (modes, 4, 3)
        Mean displacement of each seat by `SEAT_PLACES` along x, y, z of the drive frame, in 1/√kg.
    surface : PanelNodes
    outward : ndarray, shape (modes, nodes)
        Displacement along the outward normal at the nodes of `surface`, in 1/√kg.
    mass_kg : float
        Of the computed structure.
    """

    box: Box
    highest_hz: float
    natural: int
    frequency_hz: Real
    seats: Real
    surface: PanelNodes
    outward: Real
    mass_kg: float

    def __post_init__(self) -> None:
        number = len(self.frequency_hz)
        if self.seats.shape != (number, 4, 3) or self.outward.shape != (number, len(self.surface.points_m)):
            raise HousingError(
                f"{number} modes need seats of shape {(number, 4, 3)} and {len(self.surface.points_m)} values on the "
                f"surface, got {self.seats.shape} and {self.outward.shape}"
            )
        if not 0 <= self.natural <= number:
            raise HousingError(f"natural must be from 0 to the number of modes, {number}, got {self.natural}")
        if not (np.isfinite(self.frequency_hz).all() and (np.asarray(self.frequency_hz) > 0.0).all()):
            raise HousingError("frequency_hz of modes must be > 0")
        read_only(self)

    def normal_at(self, points_m: ArrayLike, normals: ArrayLike) -> Real:
        """Return the outward displacement of all modes at points of the outer surface, shape (modes, n), in 1/√kg.

        Parameters
        ----------
        points_m, normals : array_like, shape (n, 3)
            In the frame of the box; outward normals, along x, y or z.

        Raises
        ------
        HousingError
            A point off the surface.
        """
        nodes, weights = self.surface.weights(points_m, normals)
        found = np.zeros((len(self.frequency_hz), len(nodes)))
        for column in range(nodes.shape[1]):
            found += self.outward[:, nodes[:, column]] * weights[:, column]
        return found

    def _receptance(self, frequency_hz: ArrayLike, loss_factor: float | None) -> tuple[Real, Complex]:
        """Return ω and 1 / (ω_m² (1 + jη) - ω²), shape (modes, n)."""
        damping = self.box.loss_factor if loss_factor is None else loss_factor
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

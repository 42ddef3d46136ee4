"""The modes of a housing as the sound field needs them, and its response to forces at the seats."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.housing.box import Box, HousingError
from tdacoustic.housing.response import SeatResponse
from tdacoustic.housing.surface import PanelNodes, read_only

__all__ = ["HousingModes"]

Real = NDArray[np.float64]


@dataclass(frozen=True)
class HousingModes(SeatResponse):
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

    @property
    def own_loss_factor(self) -> float:
        """Of the box."""
        return self.box.loss_factor

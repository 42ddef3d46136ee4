"""Forces of the shafts on their bearings, line by line from the mesh force (physics.md section 3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.errors import GearError
from tdacoustic.gears.steady_state import SteadyState
from tdacoustic.gears.system import TRANSLATIONS, GearSystem

__all__ = ["GEARS", "BearingForces", "bearing_forces", "sampling_points"]

GEARS: Final = ("pinion", "wheel")


@dataclass(frozen=True)
class BearingForces:
    """Forces on the bearings of both gears, each the total of a gear's bearings: R = K x + C x'.

    With a foundation x is the motion of a shaft against its seats.

    Parameters
    ----------
    frequency_hz : ndarray, shape (n,)
        Above zero, ascending.
    harmonic : ndarray, shape (n,)
        Of the mesh; NaN of a line that is none of its harmonics.
    amplitude_n : ndarray of complex, shape (2, 3, n)
        Peak amplitudes, by `GEARS` and direction x, y, z.
    mean_n : ndarray, shape (2, 3)
        Signed: as the shaft presses.
    """

    frequency_hz: NDArray[np.float64]
    harmonic: NDArray[np.float64]
    amplitude_n: NDArray[np.complex128]
    mean_n: NDArray[np.float64]

    def rms_n(self) -> NDArray[np.float64]:
        """Rms of all lines together, shape (2, 3)."""
        return np.asarray(np.sqrt(0.5 * (np.abs(self.amplitude_n) ** 2).sum(axis=-1)))

    def sampled_n(self, points_hz: ArrayLike) -> NDArray[np.float64]:
        """Return the spectrum at sampling points as the paper takes them (Fig. 9), shape (2, 3, points).

        A point stands for the band up to half way to its neighbours; its value is the peak amplitude of one sinusoid
        with the energy of the lines in that band. A motion that repeats each mesh period has none between its
        harmonics, and the points there are zero.

        Parameters
        ----------
        points_hz : array_like
            Ascending, at least two.
        """
        points = np.asarray(points_hz, dtype=np.float64)
        if points.size < 2 or not (np.diff(points) > 0.0).all():
            raise GearError(f"sampling points must ascend and be at least two, got {points.size}")
        middle = 0.5 * (points[1:] + points[:-1])
        edges = np.concatenate([[2.0 * points[0] - middle[0]], middle, [2.0 * points[-1] - middle[-1]]])
        place = np.searchsorted(edges, self.frequency_hz, side="right") - 1
        held = (place >= 0) & (place < points.size)
        energy = np.zeros((2, 3, points.size))
        for gear in range(2):
            for direction in range(3):
                squared = np.abs(self.amplitude_n[gear, direction, held]) ** 2
                energy[gear, direction] = np.bincount(place[held], squared, points.size)
        return np.asarray(np.sqrt(energy))


def bearing_forces(system: GearSystem, state: SteadyState) -> BearingForces:
    """Return the bearing forces of a steady state: (K_j + iω C_j) of each bearing's deflection, line by line.

    Parameters
    ----------
    system : GearSystem
        That of the state.
    state : SteadyState
    """
    lines = state.lines
    _, per_force = system.per_mesh_force(lines.frequency_hz)
    force = per_force * lines.force_n[:, None]
    mean = -system.direction_vector[TRANSLATIONS] * state.mean_force_n
    return BearingForces(
        lines.frequency_hz, lines.harmonic, np.stack([force[:, :3].T, force[:, 3:].T]), mean.reshape(2, 3)
    )


def sampling_points(mesh_hz: float, highest_hz: float, between: int = 3) -> NDArray[np.float64]:
    """Return the mesh harmonics up to a frequency and points between them, equally spaced (paper, section 4.2).

    Parameters
    ----------
    mesh_hz, highest_hz : float
    between : int
        Points between two harmonics [assumed]; the paper says "several".

    Examples
    --------
    >>> sampling_points(500.0, 1000.0, between=1)
    array([ 250.,  500.,  750., 1000.])
    """
    spacing = mesh_hz / (between + 1)
    return np.asarray(spacing * np.arange(1, int(highest_hz / spacing * (1.0 + 1e-12)) + 1), dtype=np.float64)

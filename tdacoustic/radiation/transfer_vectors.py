"""The sound of a body's vibrations and of point sources beside it, kept over frequency for any receiver.

What is computed, node by node over frequency, are the multipoles (`multipoles`) of unit modal velocities and of the
waves that the rigid body scatters; receivers too close for multipoles get their pressures directly, in a computation of
their own. All else (means over spheres, directivities, microphones) follows without boundary elements.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import RadiationError
from tdacoustic.radiation.body_in_air import COARSEST_GRID_HZ, LEAST_ELEMENTS_PER_WAVELENGTH, BodyInAir
from tdacoustic.radiation.interpolation import frequency_nodes
from tdacoustic.radiation.surfaces import Surface

if TYPE_CHECKING:
    from tdacoustic.radiation.boundary_elements import ExteriorProblem

__all__ = [
    "LOWEST_HZ",
    "NearNodes",
    "TransferBand",
    "TransferNodes",
    "bands_of",
    "frequencies_of",
    "grid_hz_for",
    "near_band",
    "outgoing_waves",
    "rungs_of",
    "transfer_band",
]

Real = NDArray[np.float64]
Velocities = Callable[[Surface], Real]
Done = Callable[[float], None]

LOWEST_HZ: Final = 20.0

GRID_LADDER_HZ: Final = (COARSEST_GRID_HZ, 1300.0, 1600.0, 2000.0, 2500.0, 3000.0)
"""Highest frequencies of grids."""

_PHASE_STEP: Final = 1.25
"""Radians that the phase of the multipoles turns by, at most, from one frequency to the next."""

_DENSE: Final = 13.0
"""k times the radius up to which the frequencies lie twice as dense."""

_AT_ONCE: Final = 8
"""Frequencies of one task at most; tasks run side by side and are kept one by one."""


def _silent(part_done: float) -> None:
    """Nobody listens."""


@dataclass(frozen=True)
class TransferBand:
    """Some frequencies with one grid.

    Parameters
    ----------
    frequency_hz : tuple of float
    grid_hz : float
    """

    frequency_hz: tuple[float, ...]
    grid_hz: float


@dataclass(frozen=True)
class TransferNodes:
    """Outgoing waves at some frequencies.

    Columns are unit modal velocities (m √kg / s), then unit sources (1 Pa at 1 m), of these what the body scatters,
    times `BodyInAir.back_to_sources`.

    Parameters
    ----------
    frequency_hz : tuple of float
    multipoles : tuple of ndarray of complex64, each of shape (harmonics, columns)
        As of `Multipoles`, which says how many there are.
    panels : int
        Of the grid.
    """

    frequency_hz: tuple[float, ...]
    multipoles: tuple[NDArray[np.complex64], ...]
    panels: int


@dataclass(frozen=True)
class NearNodes:
    """Pressures at near receivers at some frequencies.

    Parameters
    ----------
    frequency_hz : tuple of float
    pressures : ndarray of complex64, shape (frequencies, receivers, columns)
        Columns as of `TransferNodes`.
    """

    frequency_hz: tuple[float, ...]
    pressures: NDArray[np.complex64]


def frequencies_of(body: BodyInAir, highest_hz: float) -> Real:
    """Return the frequencies at which the field is computed, up to one.

    Parameters
    ----------
    body : BodyInAir
    highest_hz : float

    Raises
    ------
    RadiationError
        A highest frequency that is not above `LOWEST_HZ`, or that no grid can carry.
    """
    if not highest_hz > LOWEST_HZ:
        raise RadiationError(f"max_frequency_hz must be above {LOWEST_HZ:g} Hz, got {highest_hz:g}")
    radian_hz = body.sound_speed_m_s / (2.0 * math.pi * body.radius_m)
    return frequency_nodes(LOWEST_HZ, highest_hz, _PHASE_STEP * radian_hz, _DENSE * radian_hz)


def grid_hz_for(frequency_hz: float, highest_hz: float) -> float:
    """Return the highest frequency of the grid that a frequency is computed on.

    Examples
    --------
    >>> grid_hz_for(300.0, 3000.0), grid_hz_for(1400.0, 1500.0), grid_hz_for(4000.0, 5000.0)
    (1000.0, 1500.0, 4687.5)
    """
    ladder = list(GRID_LADDER_HZ)
    while ladder[-1] < highest_hz:
        ladder.append(1.25 * ladder[-1])
    rung = next(rung for rung in ladder if rung >= frequency_hz * (1.0 - 1e-9))
    return max(GRID_LADDER_HZ[0], min(rung, highest_hz))


def rungs_of(highest_hz: float) -> tuple[float, ...]:
    """Return the highest frequencies of all grids that frequencies up to one are computed on.

    Examples
    --------
    >>> rungs_of(700.0), rungs_of(1500.0)
    ((1000.0,), (1000.0, 1300.0, 1500.0))
    """
    found = [grid_hz_for(LOWEST_HZ, highest_hz)]
    while found[-1] < highest_hz * (1.0 - 1e-9):
        found.append(grid_hz_for(found[-1] * (1.0 + 1e-6), highest_hz))
    return tuple(found)


def bands_of(body: BodyInAir, highest_hz: float) -> tuple[TransferBand, ...]:
    """Return the frequencies by grid, few enough at once that two processes share the work.

    Parameters
    ----------
    body : BodyInAir
    highest_hz : float
    """
    found = []
    nodes = frequencies_of(body, highest_hz)
    for grid_hz, held in itertools.groupby(nodes.tolist(), lambda node: grid_hz_for(node, highest_hz)):
        some = list(held)
        count = math.ceil(len(some) / _AT_ONCE)
        found += [TransferBand(tuple(part.tolist()), grid_hz) for part in np.array_split(some, count)]
    body.check_grid(found[-1].grid_hz)
    return tuple(found)


def transfer_band(
    body: BodyInAir, band: TransferBand, velocities_of: Velocities, done: Done = _silent
) -> TransferNodes:
    """Compute the outgoing waves of one band.

    Parameters
    ----------
    body : BodyInAir
    band : TransferBand
    velocities_of : callable
        From a grid to the mean outward velocity of its panels, one column each: (panels, n).
    done : callable
        Told now and then which part is done.
    """
    found = _over(outgoing_waves, body, band, velocities_of, done)
    return TransferNodes(band.frequency_hz, tuple(found), body.surface(band.grid_hz).n_panels)


def near_band(body: BodyInAir, band: TransferBand, velocities_of: Velocities, done: Done = _silent) -> NearNodes:
    """Compute the pressures at the near receivers of one band; parameters as of `transfer_band`."""
    return NearNodes(band.frequency_hz, np.stack(_over(_near_pressures, body, band, velocities_of, done)))


def _over(
    solve: Callable[[BodyInAir, Surface, NDArray[Any], float], NDArray[np.complex64]],
    body: BodyInAir,
    band: TransferBand,
    velocities_of: Velocities,
    done: Done,
) -> list[NDArray[np.complex64]]:
    """Return what one frequency after the other gives on the grid of a band."""
    surface = body.surface(band.grid_hz)
    velocities = np.asarray(velocities_of(surface), dtype=np.float32)
    found = []
    for number, frequency in enumerate(band.frequency_hz):
        done(number / len(band.frequency_hz))
        found.append(solve(body, surface, velocities, frequency))
    return found


def _near_pressures(
    body: BodyInAir, surface: Surface, velocities: NDArray[Any], frequency_hz: float
) -> NDArray[np.complex64]:
    """Return the pressures of all columns at the near receivers at a frequency: (receivers, columns)."""
    problem = _problem(body, surface, frequency_hz)
    columns = [problem.transfer(body.near_m, velocities)]
    if body.sources_m:
        scattered = problem.scattered(body.sources_m, body.near_m) - body.direct(frequency_hz, body.near_m)
        columns.append(scattered * body.back_to_sources(frequency_hz))
    return np.concatenate(columns, axis=1).astype(np.complex64)


def outgoing_waves(
    body: BodyInAir, surface: Surface, velocities: NDArray[Any], frequency_hz: float
) -> NDArray[np.complex64]:
    """Return the multipoles of all columns at a frequency: (harmonics, columns).

    Parameters
    ----------
    body : BodyInAir
    surface : Surface
    velocities : ndarray, shape (panels, n)
    frequency_hz : float
    """
    problem, waves = _problem(body, surface, frequency_hz), body.waves(frequency_hz)
    found = [waves.of_surface(surface, problem.pressures(velocities), velocities, body.impedance_pa_s_m)]
    if body.sources_m:
        blocked = problem.blocked_pressures(body.sources_m)
        scattered = waves.of_surface(surface, blocked, 0.0, body.impedance_pa_s_m)
        found.append(scattered * body.back_to_sources(frequency_hz))
    return np.concatenate(found, axis=1).astype(np.complex64)


def _problem(body: BodyInAir, surface: Surface, frequency_hz: float) -> ExteriorProblem:
    from tdacoustic.radiation.boundary_elements import ExteriorProblem

    return ExteriorProblem(
        surface,
        body.wave_number_rad_m(frequency_hz),
        body.impedance_pa_s_m,
        body.ground_m,
        least_panels_per_wavelength=0.99 * LEAST_ELEMENTS_PER_WAVELENGTH,
    )

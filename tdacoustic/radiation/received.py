"""From multipoles over frequency to what a surface or receivers get of modes and sources."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.radiation.body_in_air import BodyInAir
from tdacoustic.radiation.interpolation import lagrange, spread_nodes, weighted_sum
from tdacoustic.radiation.transfer_vectors import NearNodes, TransferNodes

__all__ = ["MeanVectors", "PointVectors", "mean_vectors", "point_vectors"]

Point = tuple[float, float, float]
Real = NDArray[np.float64]
Complex = NDArray[np.complexfloating[Any, Any]]

_MOST_KNOWN: Final = 200
"""Frequencies whose matrices are kept: 0.6 MB each."""


@dataclass(frozen=True)
class MeanVectors:
    """Means of |p|² over a sphere, or over a half sphere on the ground.

    Parameters
    ----------
    radius_m : float
    frequency_hz : ndarray, shape (n,)
    modal : ndarray of complex64, shape (n, modes, modes)
        Hermitian: the mean is qᴴ P q for modal velocities q.
    sources : ndarray, shape (n, sources)
        Of sources of 1 Pa at 1 m, the body in their field.
    """

    radius_m: float
    frequency_hz: Real
    modal: NDArray[np.complex64]
    sources: Real

    def of_modes(self, frequency_hz: float, velocities: Complex) -> float:
        """Return the mean of |p|² of modal velocities (modes,), in Pa²."""
        held = np.asarray(velocities, dtype=np.complex64)
        return max(float((self._modal_at(frequency_hz) @ held @ held.conj()).real), 0.0)

    @cached_property
    def _known(self) -> dict[float, NDArray[np.complex64]]:
        return {}

    def _modal_at(self, frequency_hz: float) -> NDArray[np.complex64]:
        """The matrix at a frequency; some are kept, because fits ask for the same ones again and again."""
        found = self._known.get(frequency_hz)
        if found is None:
            some, weights = lagrange(self.frequency_hz, frequency_hz)
            found = np.tensordot(weights.astype(np.float32), self.modal[some], axes=1)
            if len(self._known) < _MOST_KNOWN:
                self._known[frequency_hz] = found
        return found

    def of_source(self, frequency_hz: float, source: int) -> float:
        """Return the mean of |p|² of a source by its number, in Pa²."""
        some, weights = lagrange(self.frequency_hz, frequency_hz)
        return max(float(weights @ self.sources[some, source]), 0.0)


@dataclass(frozen=True)
class PointVectors:
    """Pressures at receivers, of each mode and of what the body scatters of each source.

    Parameters
    ----------
    points_m : tuple of (float, float, float)
    frequency_hz : ndarray, shape (n,)
    columns : ndarray of complex64, shape (n, points, modes + sources)
        Times e^{+jkR}, R from the centre of the multipoles, and those of sources times `BodyInAir.back_to_sources`, so
        that they are smooth over frequency.
    """

    points_m: tuple[Point, ...]
    frequency_hz: Real
    columns: NDArray[np.complex64]

    def of_modes(self, frequency_hz: float, velocities: Complex, asked: Sequence[int] | None = None) -> Real:
        """Return |p|² of modal velocities (modes,) at the points, or at those with the numbers asked for, in Pa²."""
        some, weights = lagrange(self.frequency_hz, frequency_hz)
        held = np.asarray(velocities, dtype=np.complex64)
        columns = self.columns[some] if asked is None else self.columns[some][:, list(asked)]
        return np.asarray(np.abs(weights @ (columns[:, :, : len(held)] @ held)) ** 2)

    def of_source(self, body: BodyInAir, frequency_hz: float, source: int, asked: Sequence[int] | None = None) -> Real:
        """Return |p|² of a source by its number, direct and scattered, at the points or those asked for, in Pa²."""
        some, weights = lagrange(self.frequency_hz, frequency_hz)
        numbers = list(range(len(self.points_m)) if asked is None else asked)
        places = [self.points_m[number] for number in numbers]
        column = self.columns.shape[2] - len(body.sources_m) + source
        scattered = weights @ self.columns[some, :, column][:, numbers]
        scattered = scattered * _waves_back(body, frequency_hz, places).conj()
        scattered = scattered / body.back_to_sources(frequency_hz)[source]
        direct = body.direct(frequency_hz, places)[:, source]
        return np.asarray(np.abs(direct + scattered) ** 2)


class _Field:
    """The computed nodes of all bands as one field over frequency."""

    def __init__(self, body: BodyInAir, parts: Sequence[TransferNodes], near: Sequence[NearNodes] = ()) -> None:
        self.body = body
        held = sorted(parts, key=lambda part: part.frequency_hz[0])
        self.frequency_hz = np.array([f for part in held for f in part.frequency_hz])
        self.multipoles = [waves for part in held for waves in part.multipoles]
        close = sorted(near, key=lambda part: part.frequency_hz[0])
        self.near = np.concatenate([part.pressures for part in close]) if close else np.zeros((0, 0, 0))

    def multipoles_at(self, frequency_hz: float) -> Complex:
        """Return the multipoles of all columns at a frequency: (harmonics, columns)."""
        some, weights = lagrange(self.frequency_hz, frequency_hz)
        found = weighted_sum(self.multipoles[some], weights)
        kept = len(self.body.waves(frequency_hz).numbers)
        return found[:kept]

    def near_at(self, frequency_hz: float) -> Complex:
        """Return the pressures at the near receivers times e^{+jkR}: (receivers, columns)."""
        some, weights = lagrange(self.frequency_hz, frequency_hz)
        turns = np.stack([_waves_back(self.body, f, self.body.near_m) for f in self.frequency_hz[some]])
        return np.asarray(np.tensordot(weights, self.near[some] * turns[:, :, None], axes=1))


def _waves_back(body: BodyInAir, frequency_hz: float, points_m: ArrayLike) -> Complex:
    """Return e^{+jkR} for points at the distance R from the centre of the multipoles."""
    places = np.asarray(points_m, dtype=np.float64).reshape(-1, 3) - np.asarray(body.centre_m)
    return np.asarray(np.exp(1j * body.wave_number_rad_m(frequency_hz) * np.linalg.norm(places, axis=1)))


def mean_vectors(body: BodyInAir, parts: Sequence[TransferNodes], radius_m: float) -> MeanVectors:
    """Return the means over the sphere of a radius around the drive's centre (over ground, the point below it).

    Parameters
    ----------
    body : BodyInAir
    parts : sequence of TransferNodes
    radius_m : float

    Raises
    ------
    RadiationError
        The sphere does not enclose box and sources with room.
    """
    body.check_sphere(radius_m)
    field = _Field(body, parts)
    frequencies = spread_nodes(field.frequency_hz)
    modes = field.multipoles[0].shape[1] - len(body.sources_m)
    modal = np.empty((len(frequencies), modes, modes), dtype=np.complex64)
    sources = np.empty((len(frequencies), len(body.sources_m)))
    for number, frequency in enumerate(frequencies.tolist()):
        waves, columns = body.waves(frequency), field.multipoles_at(frequency)
        weights = waves.mean_weights(radius_m)
        weighted = columns[:, :modes] * np.sqrt(weights).astype(np.float32)[:, None]
        modal[number] = weighted.conj().T @ weighted
        for index, place in enumerate(body.sources_m):
            scattered = columns[:, modes + index] / body.back_to_sources(frequency)[index]
            whole = scattered + waves.of_point_source(place)
            sources[number, index] = weights @ np.abs(whole) ** 2 + waves.mean_of_source(place, radius_m)
    return MeanVectors(radius_m, frequencies, modal, sources)


def point_vectors(
    body: BodyInAir, parts: Sequence[TransferNodes], points_m: tuple[Point, ...], near: Sequence[NearNodes] = ()
) -> PointVectors:
    """Return the pressures at points.

    Parameters
    ----------
    body : BodyInAir
    parts : sequence of TransferNodes
    points_m : tuple of (float, float, float)
        Points for which `BodyInAir.is_near` holds must be among its `near_m`.
    near : sequence of NearNodes
        Of these.
    """
    field = _Field(body, parts, near)
    frequencies = spread_nodes(field.frequency_hz)
    far = [number for number, point in enumerate(points_m) if not body.is_near(point)]
    by_near = [(number, body.near_m.index(point)) for number, point in enumerate(points_m) if body.is_near(point)]
    places = np.asarray(points_m, dtype=np.float64).reshape(-1, 3)
    columns = np.empty((len(frequencies), len(points_m), field.multipoles[0].shape[1]), dtype=np.complex64)
    for number, frequency in enumerate(frequencies.tolist()):
        if far:
            back = _waves_back(body, frequency, places[far])
            waves = body.waves(frequency).at(places[far]).astype(np.complex64)
            columns[number, far] = (waves @ field.multipoles_at(frequency)) * back[:, None]
        if by_near:
            close = field.near_at(frequency)
            for here, there in by_near:
                columns[number, here] = close[there]
    return PointVectors(points_m, frequencies, columns)

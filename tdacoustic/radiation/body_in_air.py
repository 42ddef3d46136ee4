"""A body in air with what stands beside it: the setting of transfer vectors, whatever the body's shape."""

from __future__ import annotations

import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.errors import RadiationError
from tdacoustic.radiation.surfaces import Axis, Surface

if TYPE_CHECKING:
    from tdacoustic.radiation.multipoles import Multipoles

__all__ = ["COARSEST_GRID_HZ", "LEAST_ELEMENTS_PER_WAVELENGTH", "BodyInAir"]

Point = tuple[float, float, float]
Complex = NDArray[np.complexfloating[Any, Any]]

LEAST_ELEMENTS_PER_WAVELENGTH: Final = 5.0

_NEAR: Final = 1.5
"""Receivers nearer than this many radii of the enclosing sphere are computed without multipoles."""

_MOST_BYTES: Final = 6e9

COARSEST_GRID_HZ: Final = 1000.0
"""Highest frequency of the coarsest grid, which carries all lower ones too, because it must resolve the modes."""


class BodyInAir(ABC):
    """A body, the air around it, point sources beside it and receivers close to it.

    A kind of body is a frozen dataclass that has the attributes below and fills in the abstract methods.

    Attributes
    ----------
    position_m : (float, float, float)
        The middle of the body's ends, in the drive frame.
    sound_speed_m_s, impedance_pa_s_m : float
    ground_m : float or None
        Height of rigid ground.
    sources_m : tuple of (float, float, float)
    near_m : tuple of (float, float, float)
        Receivers for which `is_near` holds.
    elements_per_wavelength : float
    """

    position_m: Point
    sound_speed_m_s: float
    impedance_pa_s_m: float
    ground_m: float | None
    sources_m: tuple[Point, ...]
    near_m: tuple[Point, ...]
    elements_per_wavelength: float

    def check(self) -> None:
        """Raise for too few elements a wavelength, or a body that reaches the ground.

        Raises
        ------
        RadiationError
        """
        if not self.elements_per_wavelength >= LEAST_ELEMENTS_PER_WAVELENGTH:
            raise RadiationError(
                f"elements_per_wavelength must be at least {LEAST_ELEMENTS_PER_WAVELENGTH:g}, "
                f"got {self.elements_per_wavelength:g}"
            )
        lowest = self.ends_m[0][2]
        if self.ground_m is not None and not lowest > self.ground_m:
            raise RadiationError(
                f"the housing reaches down to z = {lowest:.4g} m, the ground is at {self.ground_m:.4g} m"
            )

    @property
    @abstractmethod
    def ends_m(self) -> tuple[Point, Point]:
        """Lowest and highest x, y, z of the body, in the drive frame."""

    @property
    @abstractmethod
    def mirrors(self) -> tuple[Axis, ...]:
        """Planes that body and ground are symmetric to, each the axis it is normal to."""

    @abstractmethod
    def distance_m(self, point_m: Sequence[float]) -> float:
        """Return how far a point is from the body; 0 in it or on it."""

    @abstractmethod
    def panel_m(self, grid_hz: float) -> float:
        """Return the size of the panels of the grid that carries frequencies up to one."""

    @abstractmethod
    def panels_about(self, grid_hz: float) -> float:
        """Return about how many panels that grid has."""

    @abstractmethod
    def grid(self, grid_hz: float) -> Surface:
        """Return that grid, whose memory has been checked."""

    @property
    def centre_m(self) -> Point:
        """Of the multipoles: the drive's centre, over ground the point of the ground below it."""
        return (0.0, 0.0, 0.0 if self.ground_m is None else self.ground_m)

    @cached_property
    def radius_m(self) -> float:
        """Of the sphere around `centre_m` that encloses the ends."""
        corners = itertools.product(*zip(*self.ends_m, strict=True))
        return max(math.dist(corner, self.centre_m) for corner in corners)

    @property
    def reach(self) -> str:
        """The ends along each axis, in words."""
        ends = [f"{name} {low:.4g} to {high:.4g} m" for name, low, high in zip("xyz", *self.ends_m, strict=True)]
        return ", ".join(ends)

    def wave_number_rad_m(self, frequency_hz: float) -> float:
        """Return k = ω/c."""
        return 2.0 * math.pi * frequency_hz / self.sound_speed_m_s

    def is_near(self, point_m: Sequence[float]) -> bool:
        """Whether a point is too close for multipoles."""
        return math.dist(point_m, self.centre_m) < _NEAR * self.radius_m

    def surface(self, grid_hz: float) -> Surface:
        """Return the grid that carries frequencies up to one.

        Raises
        ------
        RadiationError
            It would take more memory than there may be.
        """
        self.check_grid(grid_hz)
        return self.grid(grid_hz)

    def check_grid(self, grid_hz: float) -> None:
        """Raise for a grid that would take more memory than there may be.

        Raises
        ------
        RadiationError
        """
        panels, needed = self.panels_about(grid_hz), self.needed_bytes(grid_hz)
        if needed > _MOST_BYTES:
            raise RadiationError(
                f"max_frequency_hz: {grid_hz:g} Hz with elements_per_wavelength = {self.elements_per_wavelength:g} "
                f"take {panels:.0f} panels on this housing and {1e-9 * needed:.0f} GB of memory, more than "
                f"{1e-9 * _MOST_BYTES:.0f}; what the grid can carry ends at about "
                f"{grid_hz * (_MOST_BYTES / needed) ** 0.25:.0f} Hz"
            )

    def needed_bytes(self, grid_hz: float) -> float:
        """Return the memory that the systems of the grid for a frequency take, about."""
        return 16.0 * float(self.panels_about(grid_hz)) ** 2 / 2 ** len(self.mirrors)

    @property
    def clearance_m(self) -> float:
        """Least distance of sources and receivers from the walls: three quarters of a panel of the coarsest grid."""
        return max(0.05, 1.1 * self.panel_m(COARSEST_GRID_HZ))

    def check_sphere(self, radius_m: float) -> None:
        """Raise for a sphere around the drive's centre that does not enclose body and sources with room.

        Raises
        ------
        RadiationError
        """
        farthest = max((math.dist(source, self.centre_m) for source in self.sources_m), default=0.0)
        least = max(_NEAR * self.radius_m, 1.05 * farthest)
        if radius_m < least:
            raise RadiationError(
                f"a sphere of {radius_m:g} m does not enclose the housing and the sources with room: it takes "
                f"{least:.3g} m at least"
            )

    def waves(self, frequency_hz: float) -> Multipoles:
        """Return the outgoing waves that carry the body's sound at a frequency."""
        from tdacoustic.radiation.multipoles import Multipoles, degree_for

        wave = self.wave_number_rad_m(frequency_hz)
        degree = degree_for(wave, self.radius_m)
        return Multipoles(wave, self.centre_m, self.radius_m, degree, self.ground_m is not None)

    def direct(self, frequency_hz: float, points_m: ArrayLike) -> Complex:
        """Return the pressure of the sources without the body, with their images in the ground: (points, sources)."""
        wave = 1j * self.wave_number_rad_m(frequency_hz)
        points = np.asarray(points_m, dtype=np.float64).reshape(-1, 1, 3)
        sources = np.asarray(self.sources_m, dtype=np.float64).reshape(1, -1, 3)
        found = np.zeros((len(points), sources.shape[1]), dtype=np.complex128)
        for places in [sources] if self.ground_m is None else [sources, self._mirrored(sources)]:
            distance = np.linalg.norm(points - places, axis=2)
            found += np.exp(-wave * distance) / distance
        return found

    def back_to_sources(self, frequency_hz: float) -> Complex:
        """Return e^{+jkd} of each source at the distance d from the middle of the body: (sources,).

        What the body scatters, times it, is as smooth over frequency as what the body radiates.
        """
        ways = [math.dist(source, self.position_m) for source in self.sources_m]
        return np.exp(1j * self.wave_number_rad_m(frequency_hz) * np.array(ways))

    def _mirrored(self, places_m: NDArray[np.float64]) -> NDArray[np.float64]:
        assert self.ground_m is not None
        return places_m * [1.0, 1.0, -1.0] + [0.0, 0.0, 2.0 * self.ground_m]

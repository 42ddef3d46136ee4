"""A box in air with what stands beside it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

from tdacoustic.radiation.body_in_air import (
    COARSEST_GRID_HZ,
    LEAST_ELEMENTS_PER_WAVELENGTH,
    BodyInAir,
)
from tdacoustic.radiation.grids import box_surface
from tdacoustic.radiation.surfaces import Axis, Surface

__all__ = ["COARSEST_GRID_HZ", "LEAST_ELEMENTS_PER_WAVELENGTH", "BoxInAir"]

Point = tuple[float, float, float]


@dataclass(frozen=True)
class BoxInAir(BodyInAir):
    """A box, the air around it, point sources beside it and receivers close to it.

    Parameters
    ----------
    extent_m, position_m : (float, float, float)
        Size along x, y, z and where its middle is, in the drive frame.
    sound_speed_m_s, impedance_pa_s_m : float
    ground_m : float, optional
        Height of rigid ground.
    sources_m : tuple of (float, float, float)
    near_m : tuple of (float, float, float)
        Receivers for which `is_near` holds.
    elements_per_wavelength : float

    Raises
    ------
    RadiationError
        Too few elements a wavelength; a box that reaches the ground.
    """

    extent_m: Point
    position_m: Point
    sound_speed_m_s: float
    impedance_pa_s_m: float
    ground_m: float | None = None
    sources_m: tuple[Point, ...] = ()
    near_m: tuple[Point, ...] = ()
    elements_per_wavelength: float = 7.5

    def __post_init__(self) -> None:
        self.check()

    @property
    def _axes(self) -> list[tuple[float, float]]:
        return list(zip(self.position_m, self.extent_m, strict=True))

    @property
    def ends_m(self) -> tuple[Point, Point]:
        """Lowest and highest x, y, z of the box."""
        (x0, x1), (y0, y1), (z0, z1) = ((p - 0.5 * e, p + 0.5 * e) for p, e in self._axes)
        return (x0, y0, z0), (x1, y1, z1)

    @property
    def mirrors(self) -> tuple[Axis, ...]:
        """The planes through its middle; over ground the upright ones."""
        return ("x", "y", "z") if self.ground_m is None else ("x", "y")

    def distance_m(self, point_m: Sequence[float]) -> float:
        """Return how far a point is from the box; 0 in it or on it."""
        return math.hypot(*(max(abs(x - p) - 0.5 * e, 0.0) for x, (p, e) in zip(point_m, self._axes, strict=True)))

    def panel_m(self, grid_hz: float) -> float:
        """Return the size of the panels of the grid that carries frequencies up to one."""
        return min(self.sound_speed_m_s / (self.elements_per_wavelength * grid_hz), min(self.extent_m) / 6.0)

    def panels_about(self, grid_hz: float) -> float:
        """Return about how many panels that grid has."""
        largest = self.panel_m(grid_hz)
        pairs = itertools.combinations(self.extent_m, 2)
        return sum(2 * math.ceil(one / largest) * math.ceil(other / largest) for one, other in pairs)

    def grid(self, grid_hz: float) -> Surface:
        """Return that grid."""
        return box_surface(self.extent_m, self.panel_m(grid_hz), self.mirrors, self.position_m)

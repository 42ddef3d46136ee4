"""The solid of a STEP file in air: the same seam as a box, its panels taken from the modes' step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from tdacoustic.housing import SolidHousing, SolidModes
from tdacoustic.housing.step_file.modes import SolidPanels
from tdacoustic.radiation.body_in_air import BodyInAir
from tdacoustic.radiation.surfaces import Axis, Mirrors, Surface

__all__ = ["SolidInAir", "panel_size_m"]

Point = tuple[float, float, float]

_AXES: Final[tuple[Axis, ...]] = ("x", "y", "z")

_COLD_M_S: Final = 331.0
"""Sound speed at 0 °C, for the size of panels: the modes' step makes them, and must not hang on the temperature."""

_PANELS_MORE: Final = 1.6
"""Panels there are over those that squares of the asked size would take: 1.1 to 1.5 on a box, 1.8 to 2.5 on ribs."""


def panel_size_m(grid_hz: float, elements_per_wavelength: float, extent_m: Point) -> float:
    """Return the size of panels, to a micrometre.

    Parameters
    ----------
    grid_hz : float
        Highest frequency that they carry.
    elements_per_wavelength : float
    extent_m : (float, float, float)
        Of the body: at least six panels go across it.
    """
    return round(min(_COLD_M_S / (elements_per_wavelength * grid_hz), min(extent_m) / 6.0), 6)


@dataclass(frozen=True)
class SolidInAir(BodyInAir):
    """The solid of a STEP file, the air around it, point sources beside it and receivers close to it.

    Parameters
    ----------
    low_m, high_m : (float, float, float)
        Its ends, in the drive frame.
    planes_m : tuple of (str, float)
        Mirror planes of its outer surface: the axis each is normal to, and where it is in the drive frame.
    area_m2 : float
        Of its outer surface.
    sound_speed_m_s, impedance_pa_s_m : float
    ground_m : float, optional
    sources_m, near_m : tuple of (float, float, float)
    elements_per_wavelength : float
    housing : SolidHousing, optional
        For distances from the true surface; without it they are those from its ends. No step needs it.
    panels : tuple of SolidPanels
        Of the modes, where the grids are wanted.

    Raises
    ------
    RadiationError
        Too few elements a wavelength; a body that reaches the ground.
    """

    low_m: Point
    high_m: Point
    planes_m: tuple[tuple[Axis, float], ...]
    area_m2: float
    sound_speed_m_s: float
    impedance_pa_s_m: float
    ground_m: float | None = None
    sources_m: tuple[Point, ...] = ()
    near_m: tuple[Point, ...] = ()
    elements_per_wavelength: float = 7.5
    origin_m: Point = (0.0, 0.0, 0.0)
    housing: SolidHousing | None = None
    panels: tuple[SolidPanels, ...] = ()

    def __post_init__(self) -> None:
        self.check()

    @property
    def position_m(self) -> Point:  # type: ignore[override]
        """The middle of its ends."""
        x, y, z = (0.5 * (low + high) for low, high in zip(self.low_m, self.high_m, strict=True))
        return x, y, z

    @property
    def extent_m(self) -> Point:
        """Outer dimensions along x, y, z."""
        x, y, z = (high - low for low, high in zip(self.low_m, self.high_m, strict=True))
        return x, y, z

    @property
    def ends_m(self) -> tuple[Point, Point]:
        """Lowest and highest x, y, z."""
        return self.low_m, self.high_m

    @property
    def mirrors(self) -> tuple[Axis, ...]:
        """Its own planes; over ground the upright ones of them."""
        return tuple(axis for axis, _ in self.planes_m if axis != "z" or self.ground_m is None)

    @property
    def alone(self) -> SolidInAir:
        """The same without what only checks of places need, as steps are known by it."""
        return replace(self, housing=None)

    def with_panels(self, modes: SolidModes) -> SolidInAir:
        """Return the same with the panels that its modes were computed with."""
        return replace(self, panels=modes.grids)

    def distance_m(self, point_m: Sequence[float]) -> float:
        """Return how far a point is from the surface; 0 in the body or on it."""
        apart = math.hypot(
            *(max(low - x, x - high, 0.0) for x, low, high in zip(point_m, self.low_m, self.high_m, strict=True))
        )
        if self.housing is None or apart > max(self.extent_m):
            return apart
        place = np.asarray(point_m, dtype=np.float64) - np.asarray(self.origin_m)
        skin = self.housing.skin
        if float(skin.winding(place)[0]) > 0.5:
            return 0.0
        return max(apart, float(skin.closest(place, 200)[0][0]))

    def panel_m(self, grid_hz: float) -> float:
        """Return the size of the panels of the grid that carries frequencies up to one."""
        return panel_size_m(grid_hz, self.elements_per_wavelength, self.extent_m)

    def panels_about(self, grid_hz: float) -> float:
        """Return about how many panels that grid has."""
        return _PANELS_MORE * self.area_m2 / self.panel_m(grid_hz) ** 2

    def panels_for(self, grid_hz: float) -> SolidPanels:
        """Return the panels of that grid, in the file's axes, with their velocities.

        Raises
        ------
        KeyError
            They have not been made.
        """
        size = self.panel_m(grid_hz)
        for held in self.panels:
            if math.isclose(held.size_m, size, rel_tol=1e-6):
                return held
        raise KeyError(f"no panels of {size:g} m")

    @cached_property
    def _mirrored_planes(self) -> Mirrors:
        places = dict(self.planes_m)
        x, y, z = (places.get(axis, 0.0) for axis in _AXES)
        return Mirrors(self.mirrors, (x, y, z))

    def grid(self, grid_hz: float) -> Surface:
        """Return that grid in the drive frame.

        The panels' order, reflections after the part that is given, is that of their velocities: where ground takes
        the plane z away, the part and its reflection in it are the new part, and z is the plane whose sign changes
        fastest.
        """
        held = self.panels_for(grid_hz)
        vertices = held.vertices_m + np.asarray(self.origin_m)
        panels = held.panels
        places = dict(self.planes_m)
        if "z" in places and self.ground_m is not None:
            below = vertices * [1.0, 1.0, -1.0] + [0.0, 0.0, 2.0 * places["z"]]
            triangle = (panels[:, 3] < 0)[:, None]
            turned = np.where(triangle, panels[:, [0, 2, 1, 3]], panels[:, [0, 3, 2, 1]])
            turned = np.where(turned < 0, -1, turned + len(vertices))
            vertices, panels = np.concatenate([vertices, below]), np.concatenate([panels, turned])
        return Surface(vertices, panels, self._mirrored_planes)

"""Masuda's source inside the housing: where it stands, the air around it, and what it does to the walls."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.cavity import (
    BoxInterior,
    CavityError,
    CavityModes,
    WallModes,
    box_cavity,
    check_inside,
    coupled_velocities,
    inner_size_m,
    interior_of,
    pressure_of_source,
    pressure_of_walls,
    with_source_at,
)
from tdacoustic.drive.gear_unit import GearUnit
from tdacoustic.errors import FleetError
from tdacoustic.fleet import Fleet
from tdacoustic.housing import Box, HousingModes
from tdacoustic.radiation.body_in_air import BodyInAir
from tdacoustic.steps import Step, Task

__all__ = ["CAVITY_MODES", "CavitySettings", "HousingCavity", "SourceInside", "cavity_task", "inside_m"]

Complex = NDArray[np.complex128]
Point = tuple[float, float, float]

_MOST_KNOWN: Final = 400
"""Frequencies whose velocities are kept."""


@dataclass(frozen=True)
class CavitySettings:
    """What the air in a housing depends on besides the housing's modes.

    Parameters
    ----------
    source_m : (float, float, float)
        From the middle of the housing.
    highest_hz, sound_speed_m_s, density_kg_m3 : float
    """

    source_m: Point
    highest_hz: float
    sound_speed_m_s: float
    density_kg_m3: float


@dataclass(frozen=True)
class HousingCavity:
    """The air in a housing.

    Parameters
    ----------
    source_m : (float, float, float)
        From the middle of the housing.
    interior : BoxInterior
    modes : CavityModes
    """

    source_m: Point
    interior: BoxInterior
    modes: CavityModes


def _cavity(settings: CavitySettings, modes: HousingModes) -> HousingCavity:
    speed, density = settings.sound_speed_m_s, settings.density_kg_m3
    interior = interior_of(modes.box, modes, speed)
    air = box_cavity(interior, settings.highest_hz, settings.source_m, speed, density)
    return HousingCavity(settings.source_m, interior, air)


CAVITY_MODES: Final = Step("cavity-modes", 1, _cavity, "The air inside the housing and its coupling with the walls")


def inside_m(fleet: Fleet, unit: GearUnit, box: Box) -> Point:
    """Return where the source inside stands, from the middle of the housing.

    ``[masuda] position_m`` where its placement is inside; else the pitch point, which cuts the line between the seats'
    centres as the numbers of teeth do, where the pinion stands along its shaft.

    Parameters
    ----------
    fleet : Fleet
    unit : GearUnit
    box : Box
    """
    assert fleet.housing is not None
    stated = fleet.masuda.position_m if fleet.masuda.placement.value == "inside" else None
    if stated is not None:
        x, y, z = (place - own for place, own in zip(stated.value, fleet.housing.position_m.value, strict=True))
        return x, y, z
    pinion, wheel = box.seats
    part = unit.geometry.teeth[0] / sum(unit.geometry.teeth)
    x, z = (round(one + part * (other - one), 7) for one, other in zip(pinion.centre_m, wheel.centre_m, strict=True))
    return x, pinion.gear_y_m, z


def cavity_task(fleet: Fleet, unit: GearUnit, box: object, body: BodyInAir, modes: Task) -> Task | None:
    """Return the task of the air inside a fleet's housing.

    None of a housing that is no parametric box, and where a source that nothing asks for has no room.

    Parameters
    ----------
    fleet : Fleet
    unit : GearUnit
    box : Box
        Or another housing.
    body : BodyInAir
    modes : Task
        Of the housing.

    Raises
    ------
    FleetError
        With ``placement = "inside"``: no parametric box; the source is not inside, or too close to a wall.
    """
    if not isinstance(box, Box):
        if fleet.masuda.placement.value == "inside":
            raise FleetError(
                f'{fleet.path}: [masuda] placement = "inside": only the air inside of the parametric box can be '
                "computed, and [housing] names a step_file"
            )
        return None
    place = inside_m(fleet, unit, box)
    try:
        check_inside(inner_size_m(box), place)
    except CavityError as error:
        if fleet.masuda.placement.value != "inside":
            return None
        raise FleetError(f"{fleet.path}: [masuda]: {error}") from error
    density = body.impedance_pa_s_m / body.sound_speed_m_s
    settings = CavitySettings(place, fleet.radiation.max_frequency_hz.value, body.sound_speed_m_s, density)
    return CAVITY_MODES.task(f"up to {settings.highest_hz:g} Hz", settings, modes=modes)


class SourceInside:
    """What a source inside does to the walls, and the sound pressure inside.

    Parameters
    ----------
    cavity : HousingCavity
    frequency_hz : ndarray, shape (modes,)
        Of the housing's modes.
    position_m : (float, float, float)
        Of the housing's middle, in the drive frame.
    """

    def __init__(self, cavity: HousingCavity, frequency_hz: NDArray[np.float64], position_m: Point) -> None:
        self.cavity = cavity
        self._frequency_hz = frequency_hz
        self._position_m = position_m

    @property
    def source_m(self) -> Point:
        """Where the source stands in the drive frame."""
        x, y, z = (a + b for a, b in zip(self.cavity.source_m, self._position_m, strict=True))
        return x, y, z

    @cached_property
    def _known(self) -> dict[tuple[float, float, float], Complex]:
        return {}

    def velocities(self, frequency_hz: float, loss_factor: float, cavity_loss_factor: float) -> Complex:
        """Return the modal velocities of the housing for a source of 1 Pa at 1 m in free space, shape (modes,).

        Some are kept, because conditions, helix angles and fits ask for the same ones again.

        Parameters
        ----------
        frequency_hz : float
        loss_factor : float
            Of the walls.
        cavity_loss_factor : float
            Of the air.
        """
        key = (frequency_hz, loss_factor, cavity_loss_factor)
        found = self._known.get(key)
        if found is None:
            walls = WallModes(self._frequency_hz, loss_factor)
            found = coupled_velocities(self.cavity.modes, walls, frequency_hz, cavity_loss_factor)
            found.flags.writeable = False
            if len(self._known) < _MOST_KNOWN:
                self._known[key] = found
        return found

    def moved(self, by_m: Point) -> SourceInside | None:
        """Return the source a way off; None where it would not be inside."""
        held = self.cavity
        x, y, z = (a + b for a, b in zip(held.source_m, by_m, strict=True))
        try:
            modes = with_source_at(held.interior, held.modes, (x, y, z))
        except CavityError:
            return None
        return SourceInside(HousingCavity((x, y, z), held.interior, modes), self._frequency_hz, self._position_m)

    def pressures(
        self,
        points_m: Any,
        frequency_hz: float,
        cavity_loss_factor: float,
        velocities: Complex | None = None,
        source_pa_m: complex = 0.0,
    ) -> Complex:
        """Return the sound pressure at points inside, in Pa, shape (points,).

        Parameters
        ----------
        points_m : array_like, shape (points, 3)
            In the drive frame, in the housing's air.
        frequency_hz : float
        cavity_loss_factor : float
        velocities : ndarray of complex, shape (modes,), optional
            Modal velocities of the housing, whatever moves it: bearing forces, or the source itself. Walls that stand
            still without them.
        source_pa_m : complex
            Amplitude of the source: its pressure in free space times the distance. Where it moves the walls too, their
            `velocities` times it must be given with it.

        Raises
        ------
        CavityError
            A point outside of the air, or at the source.
        """
        points = np.asarray(points_m, dtype=np.float64).reshape(-1, 3) - np.asarray(self._position_m)
        air = self.cavity.modes
        wave = complex(np.sqrt(air.squared_wave_number(frequency_hz, cavity_loss_factor)))
        found = np.zeros(len(points), dtype=np.complex128)
        if source_pa_m:
            found += source_pa_m * pressure_of_source(self.cavity.interior, points, self.cavity.source_m, wave)
        if velocities is not None:
            interior, density = self.cavity.interior, air.density_kg_m3
            found += pressure_of_walls(interior, points, velocities, frequency_hz, wave, density)
        return found

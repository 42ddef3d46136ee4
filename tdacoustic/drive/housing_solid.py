"""The housing of a fleet that names a STEP file: what is read, where it stands, its modes.

The file's axes are the drive's (x along travel, y to the left along the shafts, z up), and its origin is put at
``[housing] position_m``: with the default, 0, 0, 0, the coordinates of the drawing are those of the drive.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final

from tdacoustic.drive.gear_unit import GearUnit
from tdacoustic.drive.solid_in_air import panel_size_m
from tdacoustic.errors import FleetError
from tdacoustic.fleet import Fleet
from tdacoustic.fleet.housing import HousingSeat
from tdacoustic.housing import SHAFTS, HousingError, SeatWish, SolidHousing, SolidModes, SolidWish
from tdacoustic.housing.box import Shaft
from tdacoustic.radiation.body_in_air import COARSEST_GRID_HZ, BodyInAir
from tdacoustic.radiation.transfer_vectors import rungs_of
from tdacoustic.steps import LogFile, Step, Task, log_file

__all__ = ["SOLID_MODES", "SolidModesSettings", "is_solid", "solid_modes_task", "solid_notes", "solid_of", "wish_of"]


@dataclass(frozen=True)
class SolidModesSettings:
    """What the modes of a STEP file's solid depend on besides the file.

    Parameters
    ----------
    wish : SolidWish
        Without the gears' places along their shafts.
    highest_hz : float
    panel_sizes_m : tuple of float
        Of the grids that the sound is computed on.
    """

    wish: SolidWish
    highest_hz: float
    panel_sizes_m: tuple[float, ...]


def _solid_modes(settings: SolidModesSettings, step_file: LogFile) -> SolidModes:
    from tdacoustic.housing import solid_modes

    if hashlib.sha256(step_file.path.read_bytes()).hexdigest() != step_file.sha256:
        raise HousingError(f"{step_file.path}: changed since it was looked at; start again")
    try:
        return solid_modes(step_file.path, settings.wish, settings.highest_hz, settings.panel_sizes_m)
    except HousingError as refused:
        raise HousingError(f"{step_file.path}: {refused}") from refused


SOLID_MODES: Final = Step("solid-modes", 1, _solid_modes, "Modes of the STEP file's housing by finite elements")


def is_solid(fleet: Fleet) -> bool:
    """Whether the housing of a fleet is a STEP file's."""
    return fleet.step_path is not None


def wish_of(fleet: Fleet, unit: GearUnit) -> SolidWish:
    """Return what a fleet says of the housing in its STEP file.

    Parameters
    ----------
    fleet : Fleet
    unit : GearUnit
        For the centre distance.

    Raises
    ------
    FleetError
        Keys that contradict a STEP file or each other.
    """
    assert fleet.housing is not None
    held = fleet.housing
    sizes = ("size_m", "wall_mm", "bearing_panel_mm", "top_bottom_mm")
    stated = [key for key in sizes if getattr(held, key) is not None]
    if stated:
        raise FleetError(
            f"{fleet.path}: [housing]: {', '.join(stated)} and step_file are stated both: a housing is a box of plates "
            "or what the STEP file holds"
        )
    by_shaft: dict[str, tuple[int, HousingSeat]] = {}
    for number, seat in enumerate(held.seat, 1):
        if seat.shaft in by_shaft:
            raise FleetError(
                f"{fleet.path}: [[housing.seat]] {number}: the {seat.shaft} has one already; one entry stands for the "
                "two bearings of a shaft"
            )
        by_shaft[seat.shaft] = (number, seat)
    pinion, wheel = (_seat(fleet, shaft, *by_shaft.get(shaft, (0, None))) for shaft in SHAFTS)
    return SolidWish(
        (pinion, wheel),
        round(unit.geometry.centre_distance_m, 7),
        fleet.number("housing.material.modulus_gpa"),
        fleet.number("housing.material.density_kg_m3"),
        fleet.number("housing.material.poisson"),
        held.hanger_stiffness_n_per_m.value,
    )


def _seat(fleet: Fleet, shaft: Shaft, number: int, seat: HousingSeat | None) -> SeatWish:
    assert fleet.housing is not None
    if seat is None:
        return SeatWish(shaft, None, None, None)
    centre, gear_y = None, None
    if seat.position_m is not None:
        origin = fleet.housing.position_m.value
        x, y, z = (round(place - own, 9) for place, own in zip(seat.position_m.value, origin, strict=True))
        centre, gear_y = (x, z), y
    key = f"housing.seat.{number}"
    return SeatWish(
        seat.shaft,
        centre,
        None if seat.radius_m is None else fleet.number(f"{key}.radius_m"),
        None if seat.thickness_mm is None else fleet.number(f"{key}.thickness_mm"),
        seat.stiffness_n_per_m.value,
        gear_y,
    )


def solid_of(fleet: Fleet, unit: GearUnit) -> SolidHousing:
    """Return the housing in a fleet's STEP file; read once for all fleets of one process that ask for the same.

    Parameters
    ----------
    fleet : Fleet
    unit : GearUnit

    Raises
    ------
    FleetError
        The file is missing, or holds no housing; the message names it and says why.
    MissingPackageError
        NGSolve is not installed.
    """
    path = _path_of(fleet)
    wish = wish_of(fleet, unit)
    try:
        found = _read(path, hashlib.sha256(path.read_bytes()).hexdigest(), wish.without_gears)
        return found.with_gears(wish, fleet.number("housing.loss_factor"))
    except HousingError as refused:
        raise FleetError(f"{fleet.path}: [housing]: step_file {path.name}: {refused}") from refused


@lru_cache(maxsize=8)
def _read(path: Path, sha256: str, wish: SolidWish) -> SolidHousing:
    """Return what a file holds; its sha256 is there to tell two contents of one path apart."""
    from tdacoustic.housing import read_solid

    return read_solid(path, wish)


def _path_of(fleet: Fleet) -> Path:
    path = fleet.step_path
    assert path is not None
    if not path.is_file():
        raise FleetError(f"{fleet.path}: [housing]: step_file: there is no file {path}")
    return path


def solid_notes(solid: SolidHousing, body: BodyInAir) -> tuple[str, ...]:
    """Return what was done to the solid of a STEP file and what its sound costs, in whole sentences.

    Parameters
    ----------
    solid : SolidHousing
    body : BodyInAir
    """
    planes = ", ".join(f"{axis} = {at:.4g} m" for axis, at in solid.planes_m)
    symmetry = (
        f"Its outside is symmetric to {planes} (in the file's coordinates), and boundary elements use that."
        if solid.planes_m
        else "Its outside has no plane of symmetry normal to x, y or z: boundary elements are of the whole."
    )
    size = " x ".join(f"{edge:.4g}" for edge in solid.extent_m)
    about = (
        f"It is {size} m in size (x, y, z), its thin walls are some {1e3 * solid.wall_m:.3g} mm thick; "
        f"{body.panels_about(COARSEST_GRID_HZ):.0f} panels or so carry its sound to {COARSEST_GRID_HZ:g} Hz."
    )
    return (*solid.notes, about, symmetry)


def solid_modes_task(fleet: Fleet, unit: GearUnit, solid: SolidHousing) -> Task:
    """Return the task of the modes; the file enters its key by its content alone.

    Parameters
    ----------
    fleet : Fleet
    unit : GearUnit
    solid : SolidHousing
    """
    highest_hz = fleet.radiation.max_frequency_hz.value
    a_wavelength = fleet.radiation.elements_per_wavelength.value
    sizes = {panel_size_m(grid_hz, a_wavelength, solid.extent_m) for grid_hz in rungs_of(highest_hz)}
    settings = SolidModesSettings(wish_of(fleet, unit).without_gears, highest_hz, tuple(sorted(sizes, reverse=True)))
    return SOLID_MODES.task(f"up to {highest_hz:g} Hz", settings, step_file=log_file(_path_of(fleet)))

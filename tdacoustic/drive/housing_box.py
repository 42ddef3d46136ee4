"""The housing of a fleet: a box or a STEP file's solid, the air around it, and where the point sources stand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from tdacoustic.drive.gear_unit import GearUnit
from tdacoustic.drive.housing_solid import is_solid, solid_of
from tdacoustic.drive.solid_in_air import SolidInAir
from tdacoustic.drive.sources import SourcePlaces
from tdacoustic.errors import FleetError, RadiationError
from tdacoustic.fleet import Fleet
from tdacoustic.fleet.housing import HousingSeat
from tdacoustic.housing import Box, HousingError, Seat, SolidHousing, horizontal_centres
from tdacoustic.radiation import Air
from tdacoustic.radiation.body_in_air import BodyInAir
from tdacoustic.radiation.box_in_air import BoxInAir

__all__ = ["AnyHousing", "body_of", "box_of", "ground_of", "housing_of", "source_places"]

Point = tuple[float, float, float]
AnyHousing = Box | SolidHousing

ABOVE_TOP_M: Final = 0.1
"""Of the mesh's free source above the middle of the housing's top, where the fleet does not say [assumed]."""


def ground_of(fleet: Fleet) -> float | None:
    """Return the height of rigid ground: at the rail, half a wheel diameter below the drive's centre [assumed]."""
    return -0.5 * fleet.train.wheel_diameter_m if fleet.radiation.space.value == "half" else None


def housing_of(fleet: Fleet, unit: GearUnit) -> AnyHousing:
    """Return the housing of a fleet: the solid of its STEP file where it names one, else its box.

    Parameters
    ----------
    fleet : Fleet
    unit : GearUnit
        For the centre distance.

    Raises
    ------
    FleetError
        As `box_of`, or the STEP file holds no housing.
    """
    return solid_of(fleet, unit) if is_solid(fleet) else box_of(fleet, unit)


def box_of(fleet: Fleet, unit: GearUnit) -> Box:
    """Return the parametric housing of a fleet.

    Seats without a position lie on a horizontal line of centres in the middle of the box, the gears' centre distance
    apart, each gear in the middle between its bearings [assumed].

    Parameters
    ----------
    fleet : Fleet
    unit : GearUnit
        For the centre distance.

    Raises
    ------
    FleetError
        ``[housing]`` is missing or lacks something, or no such box can be.
    """
    if fleet.housing is None:
        raise FleetError(f"{fleet.path}: [housing] is missing, and boundary elements need it")
    if fleet.housing.step_file is not None:
        raise FleetError(f"{fleet.path}: [housing]: step_file: this needs the parametric box")
    lengths = {f"{panel}_m": fleet.number(f"housing.{panel}_mm") for panel in ("wall", "bearing_panel", "top_bottom")}
    size = fleet.get("housing.size_m").value
    try:
        return Box(
            size_m=size,
            seats=_seats(fleet, unit),
            modulus_pa=fleet.number("housing.material.modulus_gpa"),
            density_kg_m3=fleet.number("housing.material.density_kg_m3"),
            poisson=fleet.number("housing.material.poisson"),
            loss_factor=fleet.number("housing.loss_factor"),
            hanger_stiffness_n_per_m=fleet.housing.hanger_stiffness_n_per_m.value,
            **lengths,
        )
    except HousingError as error:
        raise FleetError(f"{fleet.path}: [housing]: {error}") from error


def _seats(fleet: Fleet, unit: GearUnit) -> tuple[Seat, Seat]:
    assert fleet.housing is not None
    held = fleet.housing.seat
    by_shaft: dict[str, tuple[int, HousingSeat]] = {}
    for number, seat in enumerate(held, 1):
        if seat.shaft in by_shaft:
            raise FleetError(
                f"{fleet.path}: [[housing.seat]] {number}: the {seat.shaft} has one already; one entry stands for the "
                "two bearings of a shaft"
            )
        by_shaft[seat.shaft] = (number, seat)
    missing = [shaft for shaft in ("pinion", "wheel") if shaft not in by_shaft]
    if missing:
        raise FleetError(f"{fleet.path}: [[housing.seat]]: there is none of the {' and the '.join(missing)}")
    stated = [shaft for shaft in ("pinion", "wheel") if by_shaft[shaft][1].position_m is not None]
    if len(stated) == 1:
        raise FleetError(f"{fleet.path}: [[housing.seat]]: position_m is stated for the {stated[0]} alone")
    apart_m = round(unit.geometry.centre_distance_m, 7)  # no step shall hang on the last bit of a geometry
    defaults = dict(zip(("pinion", "wheel"), horizontal_centres(apart_m), strict=True))
    pinion, wheel = (_seat(fleet, *by_shaft[shaft], defaults[shaft]) for shaft in ("pinion", "wheel"))
    return pinion, wheel


def _seat(fleet: Fleet, number: int, seat: HousingSeat, default: tuple[float, float]) -> Seat:
    assert fleet.housing is not None
    centre, gear_y = default, 0.0
    if seat.position_m is not None:
        middle = fleet.housing.position_m.value
        x, y, z = (place - own for place, own in zip(seat.position_m.value, middle, strict=True))
        centre, gear_y = (x, z), y
    return Seat(
        seat.shaft,
        centre,
        fleet.number(f"housing.seat.{number}.radius_m"),
        fleet.number(f"housing.seat.{number}.thickness_mm"),
        seat.stiffness_n_per_m.value,
        gear_y,
    )


def source_places(fleet: Fleet, top_m: Point | None = None) -> SourcePlaces:
    """Return where the motor's and the mesh's point sources stand.

    Parameters
    ----------
    fleet : Fleet
    top_m : (float, float, float), optional
        Middle of the housing's top in the drive frame; default that of the box.

    Raises
    ------
    FleetError
        With boundary elements: the motor makes sound and has no position.
    """
    assert fleet.housing is not None
    if top_m is None:
        x, y, z = fleet.housing.position_m.value
        top_m = (x, y, z + 0.5 * fleet.get("housing.size_m").value[2])
    mesh = fleet.masuda.position_m if fleet.masuda.placement.value == "free" else None
    motor = fleet.motor
    sounds = motor is not None and any(
        e.sound_power_level_db is not None or e.flux_density_t is not None for e in motor.excitation
    )
    if sounds and motor is not None and motor.position_m is None:
        raise FleetError(
            f"{fleet.path}: [motor]: position_m is missing, and boundary elements need it: the motor's sources stand "
            "beside the housing"
        )
    place = None if motor is None or motor.position_m is None or not sounds else motor.position_m.value
    x, y, top = top_m
    return SourcePlaces((x, y, top + ABOVE_TOP_M) if mesh is None else mesh.value, place)


def body_of(fleet: Fleet, housing: AnyHousing, receivers_m: Sequence[tuple[str, Point]] = ()) -> BoxInAir | SolidInAir:
    """Return the housing in its air, with the sources and with those receivers that are close.

    Parameters
    ----------
    fleet : Fleet
    housing : Box or SolidHousing
    receivers_m : sequence of (str, (float, float, float))
        Names and places.

    Raises
    ------
    FleetError
        A source or receiver in the housing or at its walls, or what `BodyInAir` refuses.
    """
    try:
        body = _solid_in_air(fleet, housing) if isinstance(housing, SolidHousing) else _box_in_air(fleet, housing)
        named = ("the mesh's source ([masuda] position_m)", "the motor's source ([motor] position_m)")
        for name, place in (*zip(named, body.sources_m, strict=False), *receivers_m):
            _outside(body, name, place)
        for name, place in receivers_m:
            if any(math.dist(place, source) < 1e-3 for source in body.sources_m):
                raise RadiationError(f"{name} at {place} m is at a source of the model, where there is no level")
        return replace(body, near_m=tuple(sorted({place for _, place in receivers_m if body.is_near(place)})))
    except RadiationError as error:
        raise FleetError(f"{fleet.path}: [radiation]: {error}") from error


def _box_in_air(fleet: Fleet, box: Box) -> BoxInAir:
    assert fleet.housing is not None
    air = Air(fleet.number("radiation.temperature_degc"))
    return BoxInAir(
        box.extent_m,
        fleet.housing.position_m.value,
        air.sound_speed_m_s,
        air.impedance_pa_s_m,
        ground_of(fleet),
        _sources(source_places(fleet)),
        elements_per_wavelength=fleet.radiation.elements_per_wavelength.value,
    )


def _solid_in_air(fleet: Fleet, solid: SolidHousing) -> SolidInAir:
    assert fleet.housing is not None
    air = Air(fleet.number("radiation.temperature_degc"))
    origin = fleet.housing.position_m.value
    (x0, y0, z0), (x1, y1, z1) = (
        tuple(round(place + own, 7) for place, own in zip(end, origin, strict=True))
        for end in (solid.low_m, solid.high_m)
    )
    return SolidInAir(
        (x0, y0, z0),
        (x1, y1, z1),
        tuple((axis, round(at + origin["xyz".index(axis)], 7)) for axis, at in solid.planes_m),
        round(solid.area_m2, 4),
        air.sound_speed_m_s,
        air.impedance_pa_s_m,
        ground_of(fleet),
        _sources(source_places(fleet, (0.5 * (x0 + x1), 0.5 * (y0 + y1), z1))),
        elements_per_wavelength=fleet.radiation.elements_per_wavelength.value,
        origin_m=origin,
        housing=solid,
    )


def _sources(places: SourcePlaces) -> tuple[Point, ...]:
    """The mesh's source, and the motor's where it makes sound."""
    return (places.mesh_m,) if places.motor_m is None else (places.mesh_m, places.motor_m)


def _outside(body: BodyInAir, name: str, place: Point) -> None:
    apart = body.distance_m(place)
    if apart < body.clearance_m:
        where = "lies inside the housing" if apart <= 0.0 else f"is {1e3 * apart:.0f} mm from the housing's wall"
        raise RadiationError(
            f"{name} at {place} m {where}, which reaches over {body.reach}; boundary elements need it outside, "
            f"{1e3 * body.clearance_m:.0f} mm off at least"
        )
    if body.ground_m is not None and place[2] < body.ground_m:
        raise RadiationError(f"{name} at {place} m is below the ground at z = {body.ground_m:.4g} m")

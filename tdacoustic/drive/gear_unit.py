"""The gear pair that a fleet's model computes: its geometry, stiffness and equations of motion."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

from tdacoustic.errors import FleetError, GearError
from tdacoustic.fleet import Fleet, Kinematics
from tdacoustic.gears import (
    ContactLines,
    GearGeometry,
    GearSystem,
    MeshStiffness,
    helix_angle_of,
    mesh_stiffness,
)

__all__ = ["GearUnit", "gear_unit_of"]

_SAME_DISTANCE_M: Final = 5e-5
"""A stated centre distance may differ by this from that of a stated helix angle: the play of centres."""


@dataclass(frozen=True)
class GearUnit:
    """The modelled gear pair in its place in the drive.

    Parameters
    ----------
    pair : str
        Its name.
    geometry : GearGeometry
    stiffness : MeshStiffness
    system : GearSystem
    motor_turns : float
        Turns of the motor for one of the pinion: 1 of the first stage.
    """

    pair: str
    geometry: GearGeometry
    stiffness: MeshStiffness
    system: GearSystem
    motor_turns: float

    def mesh_hz(self, motor_hz: float) -> float:
        """Mesh frequency at turns of the motor per second."""
        return motor_hz / self.motor_turns * self.geometry.teeth[0]

    def pinion_torque_n_m(self, motor_torque_n_m: float) -> float:
        """Torque on the pinion at one of the motor; losses of earlier stages are left out."""
        return motor_torque_n_m * self.motor_turns

    def pitch_line_speed_m_s(self, motor_hz: float) -> float:
        """Speed at the working pitch circle."""
        return 2.0 * math.pi * motor_hz / self.motor_turns * self.geometry.pitch_radii_m[0]

    def line_load_n_per_m(self, motor_torque_n_m: float) -> float:
        """Tangential force at the reference circle over the face width."""
        force = abs(self.pinion_torque_n_m(motor_torque_n_m)) / self.geometry.reference_radii_m[0]
        return force / self.geometry.face_width_m


def gear_unit_of(fleet: Fleet, helix_angle_rad: float | None = None) -> GearUnit:
    """Return the gear pair that the fleet's model computes.

    Parameters
    ----------
    fleet : Fleet
    helix_angle_rad : float, optional
        Instead of the fleet's, for a helix sweep: rack, teeth, shifts and width stay and the centre distance follows
        (physics.md section 1).

    Raises
    ------
    FleetError
        The fleet lacks a parameter, or its gears cannot be made or cannot mesh; the message says which and why.
    """
    pair = f"gear_pair.{fleet.modelled_pair_number}"
    try:
        geometry = _geometry(fleet, pair, helix_angle_rad)
        stiffness = mesh_stiffness(geometry)
        system = _system(fleet, pair, geometry, stiffness)
    except GearError as error:
        where = f"[[gear_pair]] {fleet.modelled_pair.name}"
        turned = "" if helix_angle_rad is None else f" with a helix angle of {math.degrees(helix_angle_rad):g}°"
        raise FleetError(f"{fleet.path}: {where}{turned}: {error}") from error
    earlier = Kinematics.of(fleet).shaft_orders[fleet.modelled_pair_number - 1]
    return GearUnit(fleet.modelled_pair.name, geometry, stiffness, system, 1.0 / earlier)


def _geometry(fleet: Fleet, pair: str, helix_angle_rad: float | None) -> GearGeometry:
    held = fleet.modelled_pair
    rack: dict[str, Any] = {
        "teeth": held.teeth.value,
        "normal_module_m": fleet.number(f"{pair}.normal_module_mm"),
        "pressure_angle_rad": fleet.number(f"{pair}.pressure_angle_deg"),
        "profile_shift": fleet.numbers(f"{pair}.profile_shift"),
    }
    stated = helix_angle_rad
    if stated is None and held.helix_angle_deg is not None:
        stated = fleet.number(f"{pair}.helix_angle_deg")
    if stated is None and held.centre_distance_mm is None:
        raise FleetError(
            f"{fleet.path}: [[gear_pair]] {held.name}: helix_angle_deg or centre_distance_mm is missing, and one of "
            "them is needed here"
        )
    distance_m = None if held.centre_distance_mm is None else fleet.number(f"{pair}.centre_distance_mm")
    if stated is None:
        assert distance_m is not None
        stated = helix_angle_of(distance_m, **rack)
    geometry = GearGeometry(
        **rack,
        helix_angle_rad=stated,
        addendum_coefficient=fleet.number(f"{pair}.addendum_coefficient"),
        clearance_coefficient=fleet.number(f"{pair}.clearance_coefficient"),
        face_width_m=fleet.number(f"{pair}.face_width_mm"),
    )
    calculated_m = geometry.centre_distance_m
    if helix_angle_rad is None and distance_m is not None and abs(calculated_m - distance_m) > _SAME_DISTANCE_M:
        raise GearError(
            f"helix_angle_deg {math.degrees(stated):g} and centre_distance_mm {1e3 * distance_m:g} contradict each "
            f"other: with these profile shifts the teeth mesh at {1e3 * calculated_m:.3f} mm; leave one of them out"
        )
    return geometry


def _system(fleet: Fleet, pair: str, geometry: GearGeometry, stiffness: MeshStiffness) -> GearSystem:
    masses = fleet.numbers("gear_dynamics.mass_kg")
    springs = (
        *fleet.numbers("gear_dynamics.pinion_bearing_stiffness_n_per_m"),
        *fleet.numbers("gear_dynamics.wheel_bearing_stiffness_n_per_m"),
    )
    ratio = fleet.number("gear_dynamics.bearing_damping_ratio")
    carried = (masses[0],) * 3 + (masses[1],) * 3
    dampers = tuple(2.0 * ratio * math.sqrt(k * m) for k, m in zip(springs, carried, strict=True))
    inertias = fleet.numbers("gear_dynamics.inertia_kg_m2")
    return GearSystem(
        (masses[0], masses[1]),
        (inertias[0], inertias[1]),
        geometry.base_radii_m,
        springs,  # type: ignore[arg-type]
        dampers,  # type: ignore[arg-type]
        geometry.working_pressure_angle_rad,
        geometry.base_helix_angle_rad,
        ContactLines(geometry.transverse_contact_ratio, geometry.overlap_ratio),
        stiffness.normal_n_per_m,
        fleet.number("gear_dynamics.mesh_damping_ratio"),
        0.5 * fleet.number(f"{pair}.backlash_um"),
        fleet.numbers(f"{pair}.transmission_error_um"),
        fleet.gear_dynamics.mesh_damping.value if fleet.gear_dynamics is not None else "always",
    )

"""The drive's level at 4 m, computed once more without the program: the truth of the calibration study.

Nothing of `tdacoustic` is used here. Numbers of the drive come from `calibration/reference-drive/fleet.toml`, read as
TOML; geometry, meshing noise and distance law are written out from physics.md; the motion of the gears is that of the
eight equations as printed (tests/gears/printed_equations.py), marched in time from the static deflection until it
repeats. One number is taken over: the mean mesh stiffness, which stands here as `MESH_STIFFNESS_N_PER_M`.
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from printed_equations import direction, rates
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

REFERENCE_DRIVE = Path(__file__).resolve().parents[2] / "calibration" / "reference-drive" / "fleet.toml"

MESH_STIFFNESS_N_PER_M = 2.5618699912627425e9
"""Of the reference drive along the normal line of action, by ISO 6336-1 method B: the program's number, not ours."""

CHUNK_S, REPEATS = 0.1, 2e-5
"""The march ends when the peak to peak has changed by less than this part over such a time; the slowest transient
falls by more than half in it where the bearings' damping ratio is 0.005 or more."""

SAMPLES = 2000
"""In the mesh period from which the peak to peak is read."""


@dataclass(frozen=True)
class TrueDrive:
    """The parameters that the study varies; everything else is the reference drive's.

    Frequencies of the motor's lines do not matter for unweighted levels in free space.
    """

    masuda_constant_db: float = 20.0
    mesh_damping_ratio: float = 0.05
    bearing_damping_ratio: float = 0.05
    bearing_stiffness_factor: float = 1.0
    transmission_error_um: float = 5.0
    motor_lines_db: tuple[float, ...] = ()
    motor_gain_db: float = 0.0
    numbers: dict[str, Any] = field(default_factory=lambda: tomllib.loads(REFERENCE_DRIVE.read_text(encoding="utf-8")))


def bare(value: Any) -> Any:
    """The value of a parameter that may carry its origin."""
    return value["value"] if isinstance(value, dict) else value


def involute(angle_rad: float) -> float:
    return math.tan(angle_rad) - angle_rad


def geometry(pair: dict[str, Any]) -> SimpleNamespace:
    """The gear pair of physics.md section 1: the helix angle is the one that gives the stated centre distance."""
    (z1, z2), module = bare(pair["teeth"]), 1e-3 * bare(pair["normal_module_mm"])
    normal = math.radians(bare(pair["pressure_angle_deg"]))
    shifts, centre_m = bare(pair["profile_shift"]), 1e-3 * bare(pair["centre_distance_mm"])

    def working_angle(helix: float) -> float:
        transverse = math.atan2(math.tan(normal), math.cos(helix))
        wanted = involute(transverse) + 2.0 * sum(shifts) / (z1 + z2) * math.tan(normal)
        return float(brentq(lambda angle: involute(angle) - wanted, 0.01, 1.0, xtol=1e-15))

    def base_radius(helix: float, teeth: int) -> float:
        transverse = math.atan2(math.tan(normal), math.cos(helix))
        return 0.5 * teeth * module / math.cos(helix) * math.cos(transverse)

    def distance(helix: float) -> float:
        return (base_radius(helix, z1) + base_radius(helix, z2)) / math.cos(working_angle(helix))

    helix = float(brentq(lambda angle: distance(angle) - centre_m, 0.0, 0.5, xtol=1e-15))
    working = working_angle(helix)
    bases = (base_radius(helix, z1), base_radius(helix, z2))
    tips = [
        0.5 * z * module / math.cos(helix) + module * (x + bare(pair["addendum_coefficient"]))
        for z, x in zip((z1, z2), shifts, strict=True)
    ]
    path = sum(math.sqrt(tip**2 - base**2) for tip, base in zip(tips, bases, strict=True))
    path -= centre_m * math.sin(working)
    return SimpleNamespace(
        helix_rad=helix,
        base_helix_rad=math.asin(math.sin(helix) * math.cos(normal)),
        working_angle_rad=working,
        base_radii_m=bases,
        pitch_radius_m=centre_m * z1 / (z1 + z2),
        ratio=z2 / z1,
        transverse_contact_ratio=path / (2.0 * math.pi * bases[0] / z1),
        overlap_ratio=1e-3 * bare(pair["face_width_mm"]) * math.sin(helix) / (math.pi * module),
    )


def gears(drive: TrueDrive, pair: SimpleNamespace) -> SimpleNamespace:
    """What the printed equations read."""
    dynamics, teeth = drive.numbers["gear_dynamics"], drive.numbers["gear_pair"][0]
    masses = bare(dynamics["mass_kg"])
    springs = [
        drive.bearing_stiffness_factor * spring
        for side in ("pinion", "wheel")
        for spring in bare(dynamics[f"{side}_bearing_stiffness_n_per_m"])
    ]
    carried = [masses[0]] * 3 + [masses[1]] * 3
    return SimpleNamespace(
        masses_kg=masses,
        inertias_kg_m2=bare(dynamics["inertia_kg_m2"]),
        base_radii_m=pair.base_radii_m,
        bearing_stiffness_n_per_m=springs,
        bearing_damping_n_s_per_m=[
            2.0 * drive.bearing_damping_ratio * math.sqrt(spring * mass)
            for spring, mass in zip(springs, carried, strict=True)
        ],
        pressure_angle_rad=pair.working_angle_rad,
        base_helix_angle_rad=pair.base_helix_rad,
        contact_lines=pair,
        mesh_stiffness_n_per_m=MESH_STIFFNESS_N_PER_M,
        mesh_damping_ratio=drive.mesh_damping_ratio,
        half_backlash_m=0.5e-6 * bare(teeth["backlash_um"]),
        transmission_error_m=[1e-6 * drive.transmission_error_um],
        mesh_damping=bare(dynamics["mesh_damping"]),
    )


def rest(system: SimpleNamespace, torque_n_m: float) -> np.ndarray:
    """Sixteen states: the static deflection with the mesh at its mean stiffness, all of the rotation the pinion's."""
    radius, cosine = system.base_radii_m[0], math.cos(system.base_helix_angle_rad)
    along, force = direction(system), torque_n_m / (radius * cosine)
    state = np.zeros(16)
    springs = np.array(system.bearing_stiffness_n_per_m)
    moves = [0, 1, 2, 4, 5, 6]
    state[moves] = -force * along[moves] / springs
    compression = force / system.mesh_stiffness_n_per_m + math.copysign(system.half_backlash_m, force)
    state[3] = (compression - along[:8] @ state[:8]) / (radius * cosine)
    return state


def swing_m(system: SimpleNamespace, mesh_hz: float, torque_n_m: float, rtol: float = 1e-6) -> float:
    """Peak to peak of δ, marched until it repeats."""
    right, along = rates(system, mesh_hz, torque_n_m), direction(system)
    absolute = np.concatenate([np.full(8, 1e-5), np.full(8, 1e-5 * 2.0 * math.pi * mesh_hz)]) * rtol
    periods = math.ceil(CHUNK_S * mesh_hz)
    state, before = rest(system, torque_n_m), 0.0
    for _ in range(60):
        for span, kept in ((periods - 1, None), (1, np.linspace(0.0, 1.0 / mesh_hz, SAMPLES + 1))):
            found = solve_ivp(
                right, (0.0, span / mesh_hz), state, "DOP853", kept, rtol=rtol, atol=absolute, max_step=0.1 / mesh_hz
            )
            assert found.success, found.message
            state = found.y[:, -1]
        swing = float(np.ptp(along @ found.y[:8]))
        if abs(swing - before) < REPEATS * swing:
            return swing
        before = swing
    raise ValueError(f"the motion at {mesh_hz:g} Hz does not repeat")


def masuda_db(pair: SimpleNamespace, speed_m_s: float, power_kw: float, swing_um: float, constant_db: float) -> float:
    """Equation (8) of physics.md section 4: level of a gear unit at 1 m."""
    shape = (1.0 - math.tan(pair.helix_rad / 2.0)) * pair.ratio ** (1.0 / 8.0)
    shape /= pair.transverse_contact_ratio ** (1.0 / 4.0)
    dynamic = math.sqrt((5.56 + math.sqrt(speed_m_s)) / 5.56)
    return 20.0 * shape * dynamic + 20.0 * math.log10(power_kw) + 20.0 * math.log10(swing_um) + constant_db


def levels_at_4_m_db(drive: TrueDrive, speeds_km_h: list[float] | None = None) -> list[float]:
    """Total level at 4 m for each speed of ``[operation]``, or for those given."""
    pair = geometry(drive.numbers["gear_pair"][0])
    system = gears(drive, pair)
    operation = drive.numbers["operation"]
    torque = bare(operation["torque_n_m"])
    at_4_m_db = -10.0 * math.log10(4.0 * math.pi * 4.0**2)
    to_power_db = 10.0 * math.log10(4.0 * math.pi * 1.0**2)
    teeth = bare(drive.numbers["gear_pair"][0]["teeth"])
    levels = []
    for speed in speeds_km_h or bare(operation["train_speed_km_h"]):
        turns_hz = speed / 3.6 / (math.pi * 1e-3 * bare(drive.numbers["train"]["wheel_diameter_mm"])) * pair.ratio
        swing = swing_m(system, turns_hz * teeth[0], torque)
        mesh = masuda_db(
            pair,
            2.0 * math.pi * turns_hz * pair.pitch_radius_m,
            2.0 * math.pi * turns_hz * torque / 1000.0,
            1e6 * swing,
            drive.masuda_constant_db,
        )
        powers = [mesh + to_power_db, *(line + drive.motor_gain_db for line in drive.motor_lines_db)]
        levels.append(10.0 * math.log10(sum(10.0 ** (power / 10.0) for power in powers)) + at_4_m_db)
    return levels

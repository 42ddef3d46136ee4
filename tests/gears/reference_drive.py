"""The reference drive of physics.md section 2: the paper's gear pair, everything else assumed."""

import math
from dataclasses import replace

from tdacoustic.gears import ContactLines, GearGeometry, GearSystem, helix_angle_of, mesh_stiffness

TEETH = (31, 104)
NORMAL_MODULE_M = 7.35e-3
PRESSURE_ANGLE_RAD = math.radians(20.0)
PROFILE_SHIFT = (0.27807, -0.59026)
CENTRE_DISTANCE_M = 0.495
FACE_WIDTH_M = 0.12

MASSES_KG = (60.0, 280.0)
INERTIAS_KG_M2 = (0.35, 22.0)
BEARING_STIFFNESS_N_PER_M = (1.0e9, 1.0e9, 3e8, 1.2e9, 1.2e9, 4e8)
RATED_TORQUE_N_M = 5913.0


def reference_geometry(helix_angle_deg=None):
    if helix_angle_deg is None:
        helix = helix_angle_of(CENTRE_DISTANCE_M, TEETH, NORMAL_MODULE_M, PRESSURE_ANGLE_RAD, PROFILE_SHIFT)
    else:
        helix = math.radians(helix_angle_deg)
    return GearGeometry(TEETH, NORMAL_MODULE_M, PRESSURE_ANGLE_RAD, helix, PROFILE_SHIFT, 1.2, 0.35, FACE_WIDTH_M)


def reference_system(
    helix_angle_deg=None,
    mesh_damping_ratio=0.05,
    transmission_error_m=(5e-6,),
    mesh_damping="always",
    bearing_damping_ratio=0.05,
    half_backlash_m=100e-6,
):
    pair = reference_geometry(helix_angle_deg)
    masses = [mass for mass in MASSES_KG for _ in range(3)]
    bearing_damping = tuple(
        2.0 * bearing_damping_ratio * math.sqrt(stiffness * mass)
        for stiffness, mass in zip(BEARING_STIFFNESS_N_PER_M, masses, strict=True)
    )
    return GearSystem(
        MASSES_KG,
        INERTIAS_KG_M2,
        pair.base_radii_m,
        BEARING_STIFFNESS_N_PER_M,
        bearing_damping,
        pair.working_pressure_angle_rad,
        pair.base_helix_angle_rad,
        ContactLines(pair.transverse_contact_ratio, pair.overlap_ratio),
        mesh_stiffness(pair).normal_n_per_m,
        mesh_damping_ratio,
        half_backlash_m,
        transmission_error_m,
        mesh_damping,
    )


def single_mass(mesh_damping_ratio, transmission_error_m, contact_lines, half_backlash_m=100e-6, mesh_damping="always"):
    """The gears of the reference drive on shafts that give way to nothing: one mass m_e on one mesh.

    A mass of 1e9 kg on each shaft keeps it where it is at mesh frequencies (m_e is 27 kg), and straight teeth turn the
    whole force about it.
    """
    system = reference_system(None, mesh_damping_ratio, transmission_error_m, mesh_damping, 0.0, half_backlash_m)
    return replace(system, masses_kg=(1e9, 1e9), base_helix_angle_rad=0.0, contact_lines=contact_lines)

"""The gears: geometry, mesh stiffness, nonlinear dynamics, bearing forces, meshing noise (paper, sections 4.1 to 4.3).

Arrays and types in, arrays and types out, in SI units; no files, no fleet.
"""

from tdacoustic.gears.bearing_forces import GEARS, BearingForces, bearing_forces, sampling_points
from tdacoustic.gears.contact_lines import ContactLines
from tdacoustic.gears.foundation import Foundation
from tdacoustic.gears.geometry import GearGeometry, helix_angle_of
from tdacoustic.gears.masuda import masuda_level_db
from tdacoustic.gears.mesh_stiffness import MeshStiffness, mesh_stiffness
from tdacoustic.gears.steady_state import SteadyState, balanced_state, steady_state
from tdacoustic.gears.sweep import Branch, branch_of_sweep, coexisting
from tdacoustic.gears.system import DIRECTIONS, FREEDOMS, GearSystem

__all__ = [
    "DIRECTIONS",
    "FREEDOMS",
    "GEARS",
    "BearingForces",
    "Branch",
    "ContactLines",
    "Foundation",
    "GearGeometry",
    "GearSystem",
    "MeshStiffness",
    "SteadyState",
    "balanced_state",
    "bearing_forces",
    "branch_of_sweep",
    "coexisting",
    "helix_angle_of",
    "masuda_level_db",
    "mesh_stiffness",
    "sampling_points",
    "steady_state",
]

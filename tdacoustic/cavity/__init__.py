"""The air inside a closed housing: its modes, how it moves with the walls, and the field of a source in it.

SI units, the frame of the housing's middle, time factor exp(+jωt). Walls answer by modes of 1 kg modal mass
(`tdacoustic.housing`); what they send outside is the concern of `tdacoustic.radiation`.
"""

from tdacoustic.cavity.box import (
    CLEARANCE_M,
    BoxInterior,
    box_interior,
    check_inside,
    inner_size_m,
    interior_of,
    wall_displacements,
)
from tdacoustic.cavity.box_modes import box_cavity, with_source_at
from tdacoustic.cavity.coupling import WallModes, blocked_forces, coupled_velocities, wall_impedance
from tdacoustic.cavity.losses import boundary_layer_loss_factor
from tdacoustic.cavity.mass_law import field_incidence_db
from tdacoustic.cavity.modes import CavityError, CavityModes
from tdacoustic.cavity.pressure import pressure_of_source, pressure_of_walls

__all__ = [
    "CLEARANCE_M",
    "BoxInterior",
    "CavityError",
    "CavityModes",
    "WallModes",
    "blocked_forces",
    "boundary_layer_loss_factor",
    "box_cavity",
    "box_interior",
    "check_inside",
    "coupled_velocities",
    "field_incidence_db",
    "inner_size_m",
    "interior_of",
    "pressure_of_source",
    "pressure_of_walls",
    "wall_displacements",
    "wall_impedance",
    "with_source_at",
]

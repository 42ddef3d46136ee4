"""Mean stiffness of a mesh by ISO 6336-1, method B."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from tdacoustic.errors import GearError
from tdacoustic.gears.geometry import GearGeometry

__all__ = ["LOW_LOAD_N_PER_M", "MeshStiffness", "mesh_stiffness"]

_SERIES: Final = (0.04723, 0.15551, 0.25791, -0.00635, -0.11654, -0.00193, -0.24188, 0.00529, 0.00182)
"""Coefficients C1 to C9 of the flexibility q' of a pair of teeth in mm um/N."""

_MEASURED_OVER_THEORETICAL: Final = 0.8
"""C_M: solid discs measured against the theory."""

_N_PER_MM_UM: Final = 1e9
"""1 N/(mm um) in N/m²."""

LOW_LOAD_N_PER_M: Final = 100e3
"""Tangential load on the face width below which ISO 6336-1 lowers the stiffness in proportion: 100 N/mm."""


@dataclass(frozen=True)
class MeshStiffness:
    """Stiffness of a mesh of two steel gears.

    Parameters
    ----------
    single_n_per_m2 : float
        c', of one pair of teeth per unit of face width, in the transverse plane.
    mesh_n_per_m2 : float
        c_γα, mean of the whole mesh per unit of face width.
    normal_n_per_m : float
        k̄ along the normal line of action, over the face width: c_γα b / cos² β_b.
    doubts : tuple of str
        Where the pair lies outside the range that the method was made for.
    """

    single_n_per_m2: float
    mesh_n_per_m2: float
    normal_n_per_m: float
    doubts: tuple[str, ...]


def mesh_stiffness(pair: GearGeometry) -> MeshStiffness:
    """Return the mean stiffness of a mesh: ISO 6336-1, method B, of steel on steel.

    c' = C_M C_R C_B cos β / q' with C_M = 0.8, C_R = 1 (solid discs) and C_B of the basic rack;
    c_γα = c' (0.75 εα + 0.25). The division by cos² β_b carries it from the transverse to the normal line of action
    (physics.md section 2). Loads above 100 N/mm are presumed.

    Parameters
    ----------
    pair : GearGeometry

    Raises
    ------
    GearError
        The series of the method gives no stiffness above zero for these teeth.

    Examples
    --------
    >>> spur = GearGeometry((40, 40), 3e-3, math.radians(20), 0.0, (0.0, 0.0), 1.0, 0.25, 0.02)
    >>> round(mesh_stiffness(spur).single_n_per_m2 / 1e9, 3)
    13.55
    """
    slanted = math.cos(pair.helix_angle_rad) * math.cos(pair.base_helix_angle_rad) ** 2
    virtual = [teeth / slanted for teeth in pair.teeth]
    (x1, x2), (z1, z2) = pair.profile_shift, virtual
    terms = (1.0, 1.0 / z1, 1.0 / z2, x1, x1 / z1, x2, x2 / z2, x1**2, x2**2)
    flexibility = sum(coefficient * term for coefficient, term in zip(_SERIES, terms, strict=True))
    dedendum = pair.addendum_coefficient + pair.clearance_coefficient
    rack = (1.0 + 0.5 * (1.2 - dedendum)) * (1.0 - 0.02 * (20.0 - math.degrees(pair.pressure_angle_rad)))
    if flexibility <= 0.0 or rack <= 0.0:
        raise GearError(
            f"ISO 6336-1 gives no stiffness for {pair.teeth[0]} and {pair.teeth[1]} teeth with profile shifts {x1:g} "
            f"and {x2:g} and a dedendum of {dedendum:g} modules: they are too far from what the method is made for"
        )
    single = _MEASURED_OVER_THEORETICAL * rack * math.cos(pair.helix_angle_rad) / flexibility * _N_PER_MM_UM
    mesh = single * (0.75 * pair.transverse_contact_ratio + 0.25)
    normal = mesh * pair.face_width_m / math.cos(pair.base_helix_angle_rad) ** 2
    return MeshStiffness(single, mesh, normal, tuple(_doubts(pair)))


def _doubts(pair: GearGeometry) -> list[str]:
    found = []
    contact = f"transverse contact ratio {pair.transverse_contact_ratio:.3f}"
    if pair.transverse_contact_ratio < 1.2:
        found.append(f"{contact} is below 1.2, where ISO 6336-1 may give too stiff a mesh")
    if pair.transverse_contact_ratio > 2.0:
        found.append(f"{contact} is above 2; ISO 6336-1 was made for lower ones")
    if math.degrees(pair.helix_angle_rad) > 30.0:
        found.append(f"helix angle {math.degrees(pair.helix_angle_rad):g}° is above the 30° of ISO 6336-1")
    if pair.profile_shift[0] < pair.profile_shift[1] or not -0.5 <= sum(pair.profile_shift) <= 2.0:
        found.append(
            f"profile shifts {pair.profile_shift[0]:g} and {pair.profile_shift[1]:g} are outside of the series of "
            "ISO 6336-1 (x1 >= x2, -0.5 <= x1 + x2 <= 2)"
        )
    return found

"""``[gear_dynamics]``: masses, bearings and damping of the gears."""

from __future__ import annotations

from typing import Literal

from tdacoustic.fleet.parameter import Parameter, default
from tdacoustic.fleet.values import DampingRatio, Pair, Triple
from tdacoustic.toml_models import Table

__all__ = ["GearDynamics"]


class GearDynamics(Table):
    """``[gear_dynamics]``; pairs are of pinion and wheel, triples along x, y, z of physics.md section 2.

    Parameters
    ----------
    mass_kg, inertia_kg_m2 : Parameter of (float, float) or None
    pinion_bearing_stiffness_n_per_m, wheel_bearing_stiffness_n_per_m : Parameter of (float, float, float) or None
        Total of a gear's bearings.
    bearing_damping_ratio : Parameter of float or None
        Per direction, c = 2 ζ √(k m), from 0 to 1.
    mesh_damping_ratio : Parameter of float or None
        c_m = 2 ζ √(k̄ m_e), from 0 to 1.
    mesh_damping : Parameter of str
        ``"always"`` as printed in the paper, or ``"contact"``: only while teeth touch.
    """

    mass_kg: Parameter[Pair] | None = None
    inertia_kg_m2: Parameter[Pair] | None = None
    pinion_bearing_stiffness_n_per_m: Parameter[Triple] | None = None
    wheel_bearing_stiffness_n_per_m: Parameter[Triple] | None = None
    bearing_damping_ratio: Parameter[DampingRatio] | None = None
    mesh_damping_ratio: Parameter[DampingRatio] | None = None
    mesh_damping: Parameter[Literal["always", "contact"]] = default("always")

"""``[housing]`` and ``[[housing.seat]]``: the gearbox's box."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from tdacoustic.fleet.parameter import Parameter
from tdacoustic.fleet.values import LossFactor, Point, Stiffness, Triple
from tdacoustic.toml_models import Positive, Table, Text

__all__ = ["Housing", "HousingSeat", "Material"]


class Material(Table):
    """``[housing.material]``.

    Parameters
    ----------
    modulus_gpa, density_kg_m3, poisson : Parameter of float or None
    """

    modulus_gpa: Parameter[Positive] | None = None
    density_kg_m3: Parameter[Positive] | None = None
    poisson: Parameter[Annotated[float, Field(ge=0.0, lt=0.5)]] | None = None


class HousingSeat(Table):
    """One ``[[housing.seat]]``: where bearings of a shaft sit.

    Parameters
    ----------
    shaft : str
        ``"pinion"`` or ``"wheel"``.
    position_m : Parameter of (float, float, float) or None
    radius_m, thickness_mm : Parameter of float or None
    stiffness_n_per_m : Parameter of (float, float, float) or None
        Of the springs at the seat along x, y, z; one number stands for all.
    """

    shaft: Literal["pinion", "wheel"]
    position_m: Parameter[Point] | None = None
    radius_m: Parameter[Positive] | None = None
    thickness_mm: Parameter[Positive] | None = None
    stiffness_n_per_m: Parameter[Stiffness] | None = None


class Housing(Table):
    """``[housing]``: a welded box, or a STEP file.

    Parameters
    ----------
    size_m : Parameter of (float, float, float) or None
    wall_mm, bearing_panel_mm, top_bottom_mm : Parameter of float or None
        Thicknesses.
    material : Material
    loss_factor : Parameter of float or None
    hanger_stiffness_n_per_m : Parameter of (float, float, float) or None
        Along x, y, z; one number stands for all.
    step_file : Parameter of str or None
        Path, relative to the fleet file.
    seat : tuple of HousingSeat
    """

    size_m: Parameter[Triple] | None = None
    wall_mm: Parameter[Positive] | None = None
    bearing_panel_mm: Parameter[Positive] | None = None
    top_bottom_mm: Parameter[Positive] | None = None
    material: Material = Material()
    loss_factor: Parameter[LossFactor] | None = None
    hanger_stiffness_n_per_m: Parameter[Stiffness] | None = None
    step_file: Parameter[Text] | None = None
    seat: tuple[HousingSeat, ...] = ()

"""``[housing]`` and ``[[housing.seat]]``: the gearbox's box."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from tdacoustic.fleet.parameter import Parameter, default
from tdacoustic.fleet.values import LossFactor, Point, Stiffness, Triple
from tdacoustic.toml_models import PathText, Positive, Table

__all__ = ["Housing", "HousingSeat", "Material"]


class Material(Table):
    """``[housing.material]``; steel where the file does not say.

    Parameters
    ----------
    modulus_gpa, density_kg_m3, poisson : Parameter of float
    """

    modulus_gpa: Parameter[Positive] = default(210.0)
    density_kg_m3: Parameter[Positive] = default(7850.0)
    poisson: Parameter[Annotated[float, Field(ge=0.0, lt=0.5)]] = default(0.3)


class HousingSeat(Table):
    """One ``[[housing.seat]]``: where the two bearings of a shaft sit, one in each bearing panel.

    Parameters
    ----------
    shaft : str
        ``"pinion"`` or ``"wheel"``.
    position_m : Parameter of (float, float, float) or None
        In the drive frame: x and z of the shaft, y of its gear. With a STEP file it may be left out where the file
        names the seat, and the gear is then in the middle between its bearings.
    radius_m, thickness_mm : Parameter of float or None
        With a STEP file: of the part of the wall that is a seat where there is no bore; a bore brings its own.
    stiffness_n_per_m : Parameter of (float, float, float)
        Of the springs at each of the two seats along x, y, z; one number stands for all.
    """

    shaft: Literal["pinion", "wheel"]
    position_m: Parameter[Point] | None = None
    radius_m: Parameter[Positive] | None = None
    thickness_mm: Parameter[Positive] | None = None
    stiffness_n_per_m: Parameter[Stiffness] = default((2e7, 2e7, 2e7))


class Housing(Table):
    """``[housing]``: a welded box, or a STEP file.

    Parameters
    ----------
    size_m : Parameter of (float, float, float) or None
        Along the shafts, along travel, up.
    position_m : Parameter of (float, float, float)
        Of its middle, in the drive frame; of a STEP file's origin, so that with 0, 0, 0 the coordinates of the drawing
        are those of the drive.
    wall_mm, bearing_panel_mm, top_bottom_mm : Parameter of float or None
        Thicknesses.
    material : Material
    loss_factor : Parameter of float
    cavity_loss_factor : Parameter of float
        Of the air inside. Default 0.01 [assumed]: viscosity and heat conduction at bare walls alone give 0.001 at
        500 Hz (`tdacoustic.cavity.boundary_layer_loss_factor`); gears, shafts, oil mist and small leaks are taken to
        add the rest. In the reference housing it is an absorption coefficient of 0.04 at 500 Hz, a little above that of
        smooth hard surfaces.
    hanger_stiffness_n_per_m : Parameter of (float, float, float)
        Along x, y, z; one number stands for all.
    step_file : Parameter of str or None
        Path, relative to the fleet file, instead of `size_m` and the thicknesses: one closed hollow solid (or up to 20
        parts that touch), in the unit that the file states, its axes those of the drive (x along travel, y to the left
        along the shafts, z up). Small gaps are sewn; what is no housing is refused with the reason. Seats are where
        `position_m` says, else where a face or solid is named so (``"pinion"``, ``"seat wheel left"``; ``"hanger"``
        names the hanger's place), else on a horizontal line of centres through its middle [assumed]. A round bore along
        y at a seat is closed by a plug of the housing's material [assumed: bearing and cover]; any other opening into
        the housing is refused with its place and width.
    seat : tuple of HousingSeat
    """

    size_m: Parameter[Triple] | None = None
    position_m: Parameter[Point] = default((0.0, 0.0, 0.0))
    wall_mm: Parameter[Positive] | None = None
    bearing_panel_mm: Parameter[Positive] | None = None
    top_bottom_mm: Parameter[Positive] | None = None
    material: Material = Material()
    loss_factor: Parameter[LossFactor] = default(0.02)
    cavity_loss_factor: Parameter[LossFactor] = default(0.01)
    hanger_stiffness_n_per_m: Parameter[Stiffness] = default((2e7, 2e7, 2e7))
    step_file: Parameter[PathText] | None = None
    seat: tuple[HousingSeat, ...] = ()

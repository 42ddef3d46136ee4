"""``[masuda]``: the meshing noise of a gear unit."""

from __future__ import annotations

from typing import Literal

from tdacoustic.fleet.parameter import Parameter, default
from tdacoustic.fleet.values import Point
from tdacoustic.toml_models import Table

__all__ = ["Masuda"]


class Masuda(Table):
    """``[masuda]``, equation (8); physics.md section 4 says what is open about it.

    Parameters
    ----------
    constant_db : Parameter of float
        C of the equation.
    placement : Parameter of str
        ``"free"`` (a point source at the gearbox), ``"inside"`` the housing (the paper to the letter) or ``"off"``.
    displacement : Parameter of str
        What X is: ``"um_pp"`` or ``"static_ratio"``.
    weighting : Parameter of str
        ``"Z"`` or ``"A"``.
    position_m : Parameter of (float, float, float) or None
        Of the point source, in the drive frame. Default: the drive's centre; with boundary elements 0.1 m above the
        middle of the housing's top where it is free, the pitch point between the shafts where it is inside.
    """

    constant_db: Parameter[float] = default(20.0, "paper, equation (8)")
    placement: Parameter[Literal["free", "inside", "off"]] = default("free")
    displacement: Parameter[Literal["um_pp", "static_ratio"]] = default("um_pp")
    weighting: Parameter[Literal["Z", "A"]] = default("Z")
    position_m: Parameter[Point] | None = None

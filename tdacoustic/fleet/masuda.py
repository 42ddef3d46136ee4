"""``[masuda]``: the meshing noise of a gear unit."""

from __future__ import annotations

from typing import Literal

from tdacoustic.fleet.parameter import Parameter, default
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
    """

    constant_db: Parameter[float] = default(20.0, "paper, equation (8)")
    placement: Parameter[Literal["free", "inside", "off"]] = default("free")
    displacement: Parameter[Literal["um_pp", "static_ratio"]] = default("um_pp")
    weighting: Parameter[Literal["Z", "A"]] = default("Z")

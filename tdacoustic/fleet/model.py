"""``[model]``: which parts of the physics the total adds, and how gears and housing act on each other."""

from __future__ import annotations

from typing import Literal

from tdacoustic.fleet.parameter import Parameter, default
from tdacoustic.toml_models import Name, Table

__all__ = ["Model"]


class Model(Table):
    """``[model]``.

    Parameters
    ----------
    gear_path : Parameter of str
        ``"masuda"``, ``"structure"`` (bearing forces through the housing) or ``"sum"`` (the paper, which counts the
        gear twice).
    structure_gain_db, motor_gain_db : Parameter of float
        Added to the structure's level, and to the sound power level of each of the motor's lines.
    coupling : Parameter of str
        ``"one_way"``: the bearings stand on seats that do not move, and their forces shake the housing. ``"two_way"``:
        the seats give way under the gears, which needs ``[radiation] method = "boundary_elements"``.
    gear_pair : str or None
        Name of the pair that the gear model computes. Default: the first.
    """

    gear_path: Parameter[Literal["masuda", "structure", "sum"]] = default("masuda")
    structure_gain_db: Parameter[float] = default(0.0)
    motor_gain_db: Parameter[float] = default(0.0)
    coupling: Parameter[Literal["one_way", "two_way"]] = default("one_way")
    gear_pair: Name | None = None

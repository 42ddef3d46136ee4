"""``[model]``: which parts of the physics the total adds."""

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
    gear_pair : str or None
        Name of the pair that the gear model computes. Default: the first.
    """

    gear_path: Parameter[Literal["masuda", "structure", "sum"]] = default("masuda")
    structure_gain_db: Parameter[float] = default(0.0)
    motor_gain_db: Parameter[float] = default(0.0)
    gear_pair: Name | None = None

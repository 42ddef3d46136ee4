"""``[operation]``: the speeds and torques to compute."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from pydantic import AfterValidator, Field, model_validator

from tdacoustic.fleet.parameter import DEFAULT, Parameter, default
from tdacoustic.fleet.values import Angle, ascending
from tdacoustic.toml_models import Name, NonNegative, Positive, Table

__all__ = ["Operation"]

_NEEDED: Final = {
    "constant": "torque_n_m",
    "constant_power": "power_kw",
    "running_resistance": "resistance_n",
    "table": "torque_table",
}


def _torque_rows(rows: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    ascending(rows, "km/h")
    return rows


class Operation(Table):
    """``[operation]``. A torque is of one motor, signed.

    Parameters
    ----------
    train_speed_km_h : Parameter of tuple of float or None
        One a condition.
    condition_names : tuple of str
        One a speed. Default: `names`.
    mode : Parameter of str
        ``"traction"``, ``"brake"``, ``"coast"`` or ``"hauled"``.
    torque : Parameter of str
        The law: ``"constant"`` needs `torque_n_m`, ``"constant_power"`` `power_kw`, ``"running_resistance"``
        `resistance_n`, ``"table"`` `torque_table`.
    torque_n_m, power_kw : Parameter of float or None
    resistance_n : Parameter of (float, float, float) or None
        a + b V + c V² with V in km/h, of one drive.
    torque_table : Parameter of tuple of (float, float) or None
        Rows of km/h and N m, speeds ascending.
    helix_angle_deg : Parameter of tuple of float or None
        Of the helix sweep.
    """

    train_speed_km_h: Parameter[Annotated[tuple[Positive, ...], Field(min_length=1)]] | None = None
    condition_names: tuple[Name, ...] = ()
    mode: Parameter[Literal["traction", "brake", "coast", "hauled"]] = default("traction")
    torque: Parameter[Literal["constant", "constant_power", "running_resistance", "table"]] = default("constant")
    torque_n_m: Parameter[float] | None = None
    power_kw: Parameter[float] | None = None
    resistance_n: Parameter[tuple[NonNegative, NonNegative, NonNegative]] | None = None
    torque_table: (
        Parameter[Annotated[tuple[tuple[NonNegative, float], ...], Field(min_length=1), AfterValidator(_torque_rows)]]
        | None
    ) = None
    helix_angle_deg: Parameter[Annotated[tuple[Angle, ...], Field(min_length=1)]] | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Of the conditions; ``"1"``, ``"2"``, ... where the file gives none."""
        if self.condition_names or self.train_speed_km_h is None:
            return self.condition_names
        return tuple(str(number) for number, _ in enumerate(self.train_speed_km_h.value, 1))

    @model_validator(mode="after")
    def _consistent(self) -> Operation:
        speeds = () if self.train_speed_km_h is None else self.train_speed_km_h.value
        if self.condition_names and len(self.condition_names) != len(speeds):
            raise ValueError(
                f"condition_names has {len(self.condition_names)} entries, train_speed_km_h {len(speeds)}; one a speed"
            )
        twice = next((n for i, n in enumerate(self.condition_names) if n in self.condition_names[:i]), None)
        if twice is not None:
            raise ValueError(f"condition_names names {twice!r} twice")
        needed = _NEEDED[self.torque.value]
        if self.torque.origin != DEFAULT and getattr(self, needed) is None:
            raise ValueError(f"torque = {self.torque.value!r} needs {needed}, which is missing")
        return self

"""``[[gear_pair]]``: the teeth, stage by stage from the motor to the wheelset."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from tdacoustic.fleet.parameter import Parameter, default
from tdacoustic.fleet.values import Angle
from tdacoustic.toml_models import Name, NonNegative, Positive, Table

__all__ = ["GearPair"]

_Teeth = Annotated[int, Field(ge=5, le=1000)]
_Shift = Annotated[float, Field(ge=-3.0, le=3.0)]


class GearPair(Table):
    """One ``[[gear_pair]]``; several stand in series, from the motor to the wheelset.

    Kinematics needs the teeth only.

    Parameters
    ----------
    name : str
        Unique. Default: its position, from ``"1"``.
    teeth : Parameter of (int, int)
        Driving gear (pinion), driven gear (wheel), in traction.
    normal_module_mm : Parameter of float or None
    pressure_angle_deg : Parameter of float
        Of the basic rack, in the normal section.
    helix_angle_deg : Parameter of float or None
        At the reference circle; may be left out where the centre distance is given.
    addendum_coefficient, clearance_coefficient : Parameter of float or None
        Of the module.
    profile_shift : Parameter of (float, float) or None
        Coefficients of pinion and wheel.
    centre_distance_mm : Parameter of float or None
        May be left out where the helix angle is given.
    face_width_mm : Parameter of float or None
    backlash_um : Parameter of float or None
        The whole of it, 2b.
    transmission_error_um : Parameter of tuple of float or None
        Amplitude of harmonic 1, 2, ... of the mesh.
    """

    name: Name = ""
    teeth: Parameter[tuple[_Teeth, _Teeth]]
    normal_module_mm: Parameter[Positive] | None = None
    pressure_angle_deg: Parameter[Annotated[float, Field(gt=0.0, lt=45.0)]] = default(20.0)
    helix_angle_deg: Parameter[Angle] | None = None
    addendum_coefficient: Parameter[Positive] | None = None
    clearance_coefficient: Parameter[NonNegative] | None = None
    profile_shift: Parameter[tuple[_Shift, _Shift]] | None = None
    centre_distance_mm: Parameter[Positive] | None = None
    face_width_mm: Parameter[Positive] | None = None
    backlash_um: Parameter[NonNegative] | None = None
    transmission_error_um: Parameter[Annotated[tuple[NonNegative, ...], Field(min_length=1)]] | None = None

    @property
    def ratio(self) -> float:
        """Turns of the driving shaft for one of the driven."""
        driving, driven = self.teeth.value
        return driven / driving

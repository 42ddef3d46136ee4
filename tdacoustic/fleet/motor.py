"""``[motor]`` and ``[[motor.excitation]]``: what the motor is and what shakes it."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from tdacoustic.fleet.parameter import Parameter, default
from tdacoustic.fleet.values import FluxDensities, LossFactor, OverSpeed, Point, SoundPower, SpeedTable, at_speed
from tdacoustic.toml_models import Name, NonNegative, Positive, Table

__all__ = ["Motor", "MotorExcitation"]


class MotorExcitation(Table):
    """One ``[[motor.excitation]]``: frequency = carrier x fc + supply x f1 + shaft x n + fixed_hz.

    Parameters
    ----------
    name : str
        Unique.
    order : Parameter of int or None
        Spatial order r of the force wave.
    carrier, supply, shaft : Parameter of float or None
        Multiples of the inverter's carrier, of the supply frequency and of the motor shaft's turns.
    fixed_hz : Parameter of float or None
    flux_density_t : Parameter or None
        Peak flux densities ``[B1, B2]``, or ``[[rpm, B1, B2], ...]``.
    sound_power_level_db : Parameter or None
        Instead: re 1 pW, or ``[[rpm, dB], ...]``.
    standing : Parameter of bool
        A standing wave instead of a rotating one (3 dB less).
    """

    name: Name
    order: Parameter[Annotated[int, Field(ge=0)]] | None = None
    carrier: Parameter[float] | None = None
    supply: Parameter[float] | None = None
    shaft: Parameter[float] | None = None
    fixed_hz: Parameter[float] | None = None
    flux_density_t: Parameter[FluxDensities] | None = None
    sound_power_level_db: Parameter[SoundPower] | None = None
    standing: Parameter[bool] = default(False)

    @property
    def terms(self) -> tuple[float, float, float, float]:
        """Multiples of carrier, supply and shaft, and the fixed part in Hz; 0 where the file gives none."""
        given = (self.carrier, self.supply, self.shaft, self.fixed_hz)
        a, b, c, d = (0.0 if part is None else part.value for part in given)
        return a, b, c, d

    def flux_density_t_at(self, motor_speed_rpm: float) -> tuple[float, float] | None:
        """Peak flux densities B1, B2 in T; None outside of a table's speeds, or where none is given."""
        if self.flux_density_t is None:
            return None
        value = self.flux_density_t.value
        if isinstance(value[0], tuple):
            value = at_speed(value, motor_speed_rpm)  # type: ignore[assignment]
        return None if value is None else (value[0], value[1])  # type: ignore[return-value]

    def sound_power_level_db_at(self, motor_speed_rpm: float) -> float | None:
        """Sound power level re 1 pW; None outside of a table's speeds, or where none is given."""
        if self.sound_power_level_db is None:
            return None
        value = self.sound_power_level_db.value
        if isinstance(value, tuple):
            found = at_speed(value, motor_speed_rpm)
            return None if found is None else found[0]
        return value

    def acts_at(self, motor_speed_rpm: float) -> bool:
        """Whether its amplitude lets it act at a motor speed.

        Not outside of the speeds of an amplitude's table, nor where a flux density is
        zero; an excitation without amplitude acts at every speed.
        """
        if self.flux_density_t is not None:
            found = self.flux_density_t_at(motor_speed_rpm)
            return found is not None and min(found) > 0.0
        return self.sound_power_level_db is None or self.sound_power_level_db_at(motor_speed_rpm) is not None

    @model_validator(mode="after")
    def _consistent(self) -> MotorExcitation:
        if self.flux_density_t is not None and self.sound_power_level_db is not None:
            raise ValueError("flux_density_t and sound_power_level_db are both given; leave one out")
        if not any(self.terms):
            raise ValueError("has no frequency: one of carrier, supply, shaft and fixed_hz must not be 0")
        return self


class Motor(Table):
    """``[motor]``.

    Parameters
    ----------
    pole_pairs : Parameter of int or None
    slip : Parameter of float or None
        Of the rotor against the field: positive in traction, negative in braking, 0 of a synchronous motor.
    carrier_hz : Parameter or None
        Of the inverter, constant or ``[[rpm, Hz], ...]``; 0 Hz where it has none.
    position_m : Parameter of (float, float, float) or None
    frame_radius_mm, frame_length_mm, frame_thickness_mm : Parameter of float or None
        Mean radius and length of the frame.
    core_radius_mm, core_length_mm, core_thickness_mm : Parameter of float or None
        Of the stator core's yoke.
    frame_modulus_gpa, core_modulus_gpa, density_kg_m3, added_mass_kg : Parameter of float or None
    loss_factor : Parameter of float or None
    excitation : tuple of MotorExcitation
    """

    pole_pairs: Parameter[Annotated[int, Field(ge=1, le=100)]] | None = None
    slip: Parameter[Annotated[float, Field(gt=-1.0, lt=1.0)]] | None = None
    carrier_hz: Parameter[OverSpeed] | None = None
    position_m: Parameter[Point] | None = None
    frame_radius_mm: Parameter[Positive] | None = None
    frame_length_mm: Parameter[Positive] | None = None
    frame_thickness_mm: Parameter[Positive] | None = None
    core_radius_mm: Parameter[Positive] | None = None
    core_length_mm: Parameter[Positive] | None = None
    core_thickness_mm: Parameter[Positive] | None = None
    frame_modulus_gpa: Parameter[Positive] | None = None
    core_modulus_gpa: Parameter[Positive] | None = None
    density_kg_m3: Parameter[Positive] | None = None
    added_mass_kg: Parameter[NonNegative] | None = None
    loss_factor: Parameter[LossFactor] | None = None
    excitation: tuple[MotorExcitation, ...] = ()

    def carrier_hz_at(self, motor_speed_rpm: float) -> float | None:
        """Carrier frequency at a motor speed.

        Parameters
        ----------
        motor_speed_rpm : float

        Returns
        -------
        float or None
            A constant holds at every speed. A table is linear between its rows; None outside of its speeds (nothing
            is held or extrapolated), at a row of 0 Hz, and between such a row and the next.

        Examples
        --------
        >>> motor = Motor(carrier_hz=Parameter(((0.0, 400.0), (1000.0, 600.0), (1001.0, 0.0))))
        >>> motor.carrier_hz_at(500.0), motor.carrier_hz_at(1000.5), motor.carrier_hz_at(1938.0)
        (500.0, None, None)
        """
        if self.carrier_hz is None:
            return None
        value = self.carrier_hz.value
        if not isinstance(value, tuple):
            return value or None
        present: SpeedTable = tuple((speed, float(hz > 0.0)) for speed, hz in value)
        if at_speed(present, motor_speed_rpm) != (1.0,):
            return None
        found = at_speed(value, motor_speed_rpm)
        return None if found is None else found[0]

    @model_validator(mode="after")
    def _consistent(self) -> Motor:
        names = [excitation.name for excitation in self.excitation]
        twice = next((name for i, name in enumerate(names) if name in names[:i]), None)
        if twice is not None:
            raise ValueError(f"two [[motor.excitation]] are called {twice!r}")
        for excitation in self.excitation:
            carrier, supply, _, _ = excitation.terms
            if carrier and self.carrier_hz is None:
                raise ValueError(f"excitation {excitation.name!r} follows the carrier, but carrier_hz is missing")
            for key in ("pole_pairs", "slip"):
                if supply and getattr(self, key) is None:
                    raise ValueError(f"excitation {excitation.name!r} follows the supply, but {key} is missing")
        return self

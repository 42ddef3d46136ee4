"""Point sources of a drive: the motor's lines, and the meshing noise at the gears."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive.conditions import Condition
from tdacoustic.errors import FleetError, MotorError
from tdacoustic.fleet import Fleet, Kinematics, MotorExcitation
from tdacoustic.fleet.excitations import motor_excitations
from tdacoustic.gears.masuda import SPHERE_OF_1_M_DB
from tdacoustic.motor import MotorFrame, Ring
from tdacoustic.radiation import Air
from tdacoustic.spectra.weighting import a_weighting_db

__all__ = ["MotorSources", "SoundSource", "SourcePlaces", "StructureSource", "mesh_source"]

_REFERENCE_W = 1e-12
Point = tuple[float, float, float]

_CENTRE: Point = (0.0, 0.0, 0.0)

_FRAME_KEYS = (
    *(f"{part}_{what}_mm" for part in ("core", "frame") for what in ("radius", "length", "thickness")),
    *("frame_modulus_gpa", "core_modulus_gpa", "density_kg_m3", "loss_factor"),
)


@dataclass(frozen=True)
class SoundSource:
    """A tone of a point source.

    Parameters
    ----------
    path : {"motor", "mesh", "structure"}
    name : str
        Of the excitation.
    frequency_hz : float
    sound_power_level_db : float
        Unweighted, re 1 pW.
    position_m : (float, float, float)
        In the drive's frame.
    """

    path: Literal["motor", "mesh", "structure"]
    name: str
    frequency_hz: float
    sound_power_level_db: float
    position_m: Point = _CENTRE


@dataclass(frozen=True, eq=False)
class StructureSource(SoundSource):
    """A tone of the housing that the bearing forces shake.

    Parameters
    ----------
    velocities : ndarray of complex, shape (modes,)
        Peak amplitudes of the modal velocities in m √kg / s, gain included.
    """

    velocities: NDArray[np.complex128] = field(default_factory=lambda: np.zeros(0, dtype=np.complex128))


@dataclass(frozen=True)
class SourcePlaces:
    """Where point sources stand.

    Parameters
    ----------
    mesh_m : (float, float, float)
    motor_m : (float, float, float), optional
        None of a motor without sound.
    """

    mesh_m: Point
    motor_m: Point | None = None


class MotorSources:
    """The motor of a fleet as a list of tones at each speed.

    Parameters
    ----------
    fleet : Fleet
        Its motor may be absent, or may name excitations without amplitude: these are known lines of unknown strength
        and are left out.

    Raises
    ------
    FleetError
        An excitation has flux densities, but the motor lacks a parameter that its vibration needs.
    """

    def __init__(self, fleet: Fleet) -> None:
        self._fleet = fleet
        self._kinematics = Kinematics.of(fleet)
        self._air = Air(fleet.number("radiation.temperature_degc"))
        motor = fleet.motor
        self._excitations: tuple[MotorExcitation, ...] = () if motor is None else motor.excitation
        needs_frame = any(excitation.flux_density_t is not None for excitation in self._excitations)
        self.frame = _frame(fleet) if needs_frame else None
        position = None if motor is None else motor.position_m
        self._position_m = _CENTRE if position is None else position.value

    @property
    def without_amplitude(self) -> tuple[str, ...]:
        """Names of excitations whose strength the fleet does not say."""
        return tuple(
            excitation.name
            for excitation in self._excitations
            if excitation.flux_density_t is None and excitation.sound_power_level_db is None
        )

    def at(self, condition: Condition) -> tuple[SoundSource, ...]:
        """Return the motor's tones in a condition, by their order in the fleet, with ``[model] motor_gain_db``.

        Raises
        ------
        FleetError
            An excitation cannot be computed.
        """
        found = []
        gain_db = self._fleet.model.motor_gain_db.value
        frequencies_hz = self._frequencies_hz(condition.motor_hz)
        for excitation in self._excitations:
            frequency_hz = frequencies_hz.get(excitation.name, 0.0)
            if frequency_hz <= 0.0:
                continue
            level_db = self._level_db(excitation, frequency_hz, 60.0 * condition.motor_hz)
            if level_db is not None:
                found.append(SoundSource("motor", excitation.name, frequency_hz, level_db + gain_db, self._position_m))
        return tuple(found)

    def _frequencies_hz(self, motor_hz: float) -> dict[str, float]:
        """Frequencies of the excitations that act at a motor speed, by name."""
        motor, kinematics = self._fleet.motor, self._kinematics
        if motor is None:
            return {}
        acting = motor_excitations(motor, motor_hz, kinematics.carrier_hz(motor_hz), kinematics.supply_hz(motor_hz))
        return {excitation.name: excitation.frequency_hz for excitation in acting}

    def _level_db(self, excitation: MotorExcitation, frequency_hz: float, motor_speed_rpm: float) -> float | None:
        if excitation.flux_density_t is None:
            return excitation.sound_power_level_db_at(motor_speed_rpm)
        flux = excitation.flux_density_t_at(motor_speed_rpm)
        assert self.frame is not None and flux is not None  # it acts at this speed
        where = f"{self._fleet.path}: [[motor.excitation]] {excitation.name}"
        if excitation.order is None:
            raise FleetError(f"{where}: order is missing, and its flux densities need it")
        air, standing = self._air, excitation.standing.value
        try:
            power_w = self.frame.sound_power_w(
                excitation.order.value, frequency_hz, flux, air.impedance_pa_s_m, air.sound_speed_m_s, standing
            )
        except MotorError as error:
            raise FleetError(f"{where}: {error}") from error
        return 10.0 * math.log10(power_w / _REFERENCE_W) if power_w > 0.0 else None


def _frame(fleet: Fleet) -> MotorFrame:
    values = {key: fleet.number(f"motor.{key}") for key in _FRAME_KEYS}
    motor = fleet.motor
    added_kg = 0.0 if motor is None or motor.added_mass_kg is None else motor.added_mass_kg.value
    rings = {}
    for part, added in (("core", added_kg), ("frame", 0.0)):
        rings[part] = Ring(
            values[f"{part}_radius_mm"],
            values[f"{part}_length_mm"],
            values[f"{part}_thickness_mm"],
            values[f"{part}_modulus_gpa"],
            values["density_kg_m3"],
            added,
        )
    return MotorFrame(rings["core"], rings["frame"], values["loss_factor"])


def mesh_source(
    fleet: Fleet, mesh_hz: float, masuda_db: float | None, position_m: Point | None = None
) -> SoundSource | None:
    """Return the meshing noise as a tone at the mesh frequency; None where Masuda's formula has no level.

    The formula's level at 1 m is of a point source: its sound power level is 11 dB more. Where it is read as
    A-weighted the weighting at the mesh frequency is taken off again.

    Parameters
    ----------
    fleet : Fleet
        For the reading of ``[masuda]``.
    mesh_hz : float
    masuda_db : float or None
        At 1 m, in that reading.
    position_m : (float, float, float), optional
        Default: ``[masuda] position_m``, else the drive's centre.
    """
    if masuda_db is None:
        return None
    if position_m is None:
        position_m = _CENTRE if fleet.masuda.position_m is None else fleet.masuda.position_m.value
    weighted_db = float(a_weighting_db(mesh_hz)) if fleet.masuda.weighting.value == "A" else 0.0
    return SoundSource("mesh", "mesh", mesh_hz, masuda_db - weighted_db + SPHERE_OF_1_M_DB, position_m)

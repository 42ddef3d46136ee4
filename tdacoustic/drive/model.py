"""The drive model: a fleet and conditions in, a prediction out."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Literal

import numpy as np

from tdacoustic.drive.conditions import Condition, conditions_of
from tdacoustic.drive.coupling import CoupledCondition, Coupling, coupling_curves, coupling_doubts, values_of
from tdacoustic.drive.doubts import circle_doubts, gear_doubts, sound_doubts
from tdacoustic.drive.gear_unit import GearUnit, gear_unit_of
from tdacoustic.drive.housing_field import HousingField, HousingSound
from tdacoustic.drive.levels import CIRCLE_DEG, PointField, Receiver
from tdacoustic.drive.prediction import Directivity, DriveSound, GearState, HelixCase, Prediction
from tdacoustic.drive.sources import MotorSources, SoundSource, mesh_source
from tdacoustic.errors import FleetError, GearError
from tdacoustic.fleet import Fleet
from tdacoustic.gears import (
    BearingForces,
    Foundation,
    SteadyState,
    balanced_state,
    bearing_forces,
    masuda_level_db,
    steady_state,
)
from tdacoustic.housing import foundation_of

__all__ = ["DriveModel"]


class DriveModel:
    """The model of a fleet's drive.

    Parameters
    ----------
    fleet : Fleet
    unit : GearUnit, optional
        Its gears, where they are known already.
    housing : HousingSound, optional
        The housing's transfer vectors, which sound by ``method = "boundary_elements"`` needs.

    Attributes
    ----------
    fleet : Fleet
    unit : GearUnit
        Its bearings stand on the housing where the fleet couples both ways.

    Raises
    ------
    FleetError
        The fleet lacks what the model needs, or its gears cannot be.
    """

    def __init__(self, fleet: Fleet, unit: GearUnit | None = None, housing: HousingSound | None = None) -> None:
        self.fleet = fleet
        self._motor = MotorSources(fleet)
        self._housing = housing
        self._two_way = fleet.model.coupling.value == "two_way"
        self._coupled: dict[int, tuple[GearUnit, GearUnit]] = {}
        self.unit = unit or gear_unit_of(fleet)
        if self._two_way and housing is not None:
            self.unit = self._on_housing(self.unit)

    @cached_property
    def field(self) -> PointField:
        """The field of its sources; a `HousingField` with boundary elements.

        Raises
        ------
        FleetError
            Boundary elements without transfer vectors.
        """
        if self.fleet.radiation.method.value == "point_sources":
            return PointField(self.fleet)
        if self._housing is None:
            raise FleetError(
                f'{self.fleet.path}: [radiation] method = "boundary_elements" needs the transfer vectors of the '
                "housing: tdacoustic.predict and tdacoustic.calibrate compute them"
            )
        return HousingField(self.fleet, self._housing)

    def _moved(self, unit: GearUnit | None) -> GearUnit:
        """The gears whose motion is asked for, on the housing where the fleet couples both ways."""
        unit = unit or self.unit
        return self._on_housing(unit) if self._two_way else unit

    def _on_housing(self, unit: GearUnit) -> GearUnit:
        """The same gears, their bearings on the housing; made once of a unit, for what it keeps of its motion."""
        if unit.system.foundation is not None:
            return unit
        if id(unit) not in self._coupled:
            system = replace(unit.system, foundation=self._foundation)
            self._coupled[id(unit)] = unit, replace(unit, system=system)
        return self._coupled[id(unit)][1]

    @cached_property
    def _foundation(self) -> Foundation:
        if self._housing is None:
            raise FleetError(
                f'{self.fleet.path}: [model] coupling = "two_way" needs the modes of the housing: tdacoustic.predict '
                "and tdacoustic.calibrate compute them"
            )
        loss_factor = self.fleet.number("housing.loss_factor")
        return foundation_of(self._housing.box, self._housing.modes, loss_factor)

    @cached_property
    def conditions(self) -> tuple[Condition, ...]:
        """Those of ``[operation]``."""
        return conditions_of(self.fleet)

    def evaluate(self, conditions: Iterable[Condition] | None = None, receivers: Sequence[Receiver] = ()) -> Prediction:
        """Return the prediction for conditions, and for the helix angles of ``[operation]`` at the fastest of them.

        A fleet that names no angles gets its own alone.

        Parameters
        ----------
        conditions : iterable of Condition, optional
            Default: those of ``[operation]``.
        receivers : sequence of Receiver
            Where levels are wanted besides the surface of ``[radiation] sphere_radius_m``.
        """
        held = self.conditions if conditions is None else tuple(conditions)
        states = tuple(self.gears(condition) for condition in held)
        sound = tuple(self.sound_of(state, receivers) for state in states)
        helix = self._helix_cases(max(held, key=lambda condition: condition.motor_hz), receivers) if held else ()
        around = [
            *(
                self._around("speed", state.condition.train_speed_km_h, s)
                for state, s in zip(states, sound, strict=True)
            ),
            *(self._around("helix", case.helix_angle_deg, case.sound) for case in helix),
        ]
        doubts = (
            *gear_doubts(self.fleet, self.unit, states, helix),
            *sound_doubts(self.fleet, sound, self._motor.without_amplitude),
            *self.field.doubts([source for one in sound for source in one.sources]),
            *circle_doubts(self.fleet, [*sound, *(case.sound for case in helix)], around),
        )
        return Prediction(
            self.unit,
            states,
            sound,
            self.field.surface.name,
            tuple(around),
            helix,
            None,
            tuple(dict.fromkeys(doubts)),
            self.field.facts if isinstance(self.field, HousingField) else None,
        )

    def sound(
        self,
        condition: Condition,
        masuda_db: float | None,
        receivers: Sequence[Receiver] = (),
        forces: BearingForces | None = None,
    ) -> DriveSound:
        """Return the drive's sound in a condition.

        Parameters
        ----------
        condition : Condition
        masuda_db : float or None
            Level of the meshing noise at 1 m: see `masuda_db`.
        receivers : sequence of Receiver
            Besides the surface.
        forces : BearingForces, optional
            Without them there is no structure-borne sound.
        """
        structure = self.field.structure_sources(forces)
        sources = (*self.motor_sources(condition), *self.gear_sources(condition, masuda_db), *structure)
        surface = self.field.surface
        levels = self.field.levels(sources, (surface, *receivers))
        return DriveSound(condition.name, sources, levels, tuple(self.field.received_db(sources, surface).tolist()))

    def motor_sources(self, condition: Condition) -> tuple[SoundSource, ...]:
        """Return the motor's tones in a condition."""
        return self._motor.at(condition)

    def gear_sources(self, condition: Condition, masuda_db: float | None) -> tuple[SoundSource, ...]:
        """Return the meshing noise in a condition; of no level, none."""
        mesh_hz = self.unit.mesh_hz(condition.motor_hz)
        mesh = mesh_source(self.fleet, mesh_hz, masuda_db, self.field.mesh_position_m)
        heard = None if mesh is None else self.field.meshing(mesh)
        return () if heard is None else (heard,)

    def sound_of(self, state: GearState, receivers: Sequence[Receiver] = ()) -> DriveSound:
        """Return the drive's sound with the gears in a state, at the surface and at receivers."""
        return self.sound(state.condition, state.masuda_db, receivers, state.forces)

    def _around(self, sweep: Literal["speed", "helix"], value: float, sound: DriveSound) -> Directivity:
        return Directivity(sweep, value, np.array(CIRCLE_DEG), self.field.around_db(sound.sources))

    def gears(self, condition: Condition, unit: GearUnit | None = None) -> GearState:
        """Return the gears in one condition.

        Parameters
        ----------
        condition : Condition
        unit : GearUnit, optional
            Default: the fleet's.
        """
        unit = self._moved(unit)
        steady = self.motion(condition, unit)
        level_db = self.masuda_db(condition, steady.dte_pp_m, steady.static_compression_m, unit)
        mesh_hz = unit.mesh_hz(condition.motor_hz)
        return GearState(condition, mesh_hz, steady, bearing_forces(unit.system, steady), level_db)

    def motion(self, condition: Condition, unit: GearUnit | None = None) -> SteadyState:
        """Return the motion of the gears in one condition.

        Parameters
        ----------
        condition, unit
            As of `gears`.
        """
        unit = self._moved(unit)
        mesh_hz, torque_n_m = unit.mesh_hz(condition.motor_hz), unit.pinion_torque_n_m(condition.torque_n_m)
        try:
            return steady_state(unit.system, mesh_hz, torque_n_m)
        except GearError as error:
            raise FleetError(f"{self.fleet.path}: condition {condition.name}: {error}") from error

    def masuda_db(
        self, condition: Condition, dte_pp_m: float, static_compression_m: float, unit: GearUnit | None = None
    ) -> float | None:
        """Return equation (8) in the reading of ``[masuda]``; None without power.

        Parameters
        ----------
        condition : Condition
        dte_pp_m, static_compression_m : float
            Of its motion.
        unit : GearUnit, optional
            Default: the fleet's.
        """
        unit = unit or self.unit
        displacement = 1e6 * dte_pp_m
        if self.fleet.masuda.displacement.value == "static_ratio":
            displacement = dte_pp_m / abs(static_compression_m) if static_compression_m else 0.0
        return masuda_level_db(
            unit.geometry.helix_angle_rad,
            unit.geometry.ratio,
            unit.geometry.transverse_contact_ratio,
            unit.pitch_line_speed_m_s(condition.motor_hz),
            condition.power_w,
            displacement,
            self.fleet.masuda.constant_db.value,
        )

    def with_coupling(self, prediction: Prediction) -> Prediction:
        """Return a prediction with one-way against two-way coupling over frequency and conditions, and its doubts.

        It is no part of `evaluate`, as it costs as much as that. Without a housing the prediction stays as it is.

        Parameters
        ----------
        prediction : Prediction
            Of this model.
        """
        if self._housing is None or not isinstance(self.field, HousingField):
            return prediction
        unit, highest_hz = self._on_housing(self.unit), self._housing.modes.highest_hz
        mesh_hz = [(state.condition.name, state.mesh_hz) for state in prediction.conditions]
        pairs = zip(prediction.conditions, prediction.sound, strict=True)
        held = tuple(self._either_way(unit, *pair) for pair in pairs)
        curves = coupling_curves(unit.system, highest_hz, mesh_hz)
        coupling = Coupling("two_way" if self._two_way else "one_way", highest_hz, curves, held)
        doubts = (*prediction.doubts, *coupling_doubts(coupling, prediction.conditions))
        return replace(prediction, coupling=coupling, doubts=doubts)

    def with_insertion_loss(self, prediction: Prediction) -> Prediction:
        """Return a prediction with the housing's insertion loss; without a housing it stays as it is.

        Parameters
        ----------
        prediction : Prediction
            Of this model.
        """
        if not isinstance(self.field, HousingField):
            return prediction
        return replace(prediction, insertion_loss=self.field.insertion_loss(prediction.conditions))

    def _either_way(self, unit: GearUnit, state: GearState, sound: DriveSound) -> CoupledCondition:
        """A condition with the fleet's coupling and with the other one."""
        other = unit.system.on_rigid_seats if self._two_way else unit.system
        condition = state.condition
        steady = balanced_state(other, state.mesh_hz, unit.pinion_torque_n_m(condition.torque_n_m))
        sounds = [sound]
        if steady is not None:
            level_db = self.masuda_db(condition, steady.dte_pp_m, steady.static_compression_m)
            sounds.append(self.sound(condition, level_db, (), bearing_forces(other, steady)))
        order = slice(None, None, -1 if self._two_way else 1)
        paths = ("structure", "mesh", "total")
        surface = self.field.surface.name
        levels = [[held.level_db(surface, path) for held in sounds] + [None] * (2 - len(sounds)) for path in paths]
        dte, multiplier, contact = zip(*(values_of(held) for held in (state.steady, steady)), strict=True)
        return CoupledCondition(
            condition.name,
            state.mesh_hz,
            *(tuple(pair[order]) for pair in (dte, multiplier, *levels, contact)),
        )

    def _helix_cases(self, condition: Condition, receivers: Sequence[Receiver]) -> tuple[HelixCase, ...]:
        stated = self.fleet.operation.helix_angle_deg
        cases = []
        own_deg = math.degrees(self.unit.geometry.helix_angle_rad)
        for angle_deg in stated.value if stated is not None else (own_deg,):
            unit = self._moved(gear_unit_of(self.fleet, math.radians(angle_deg)))
            gears = self.gears(replace(condition, name=f"{condition.name}, {angle_deg:g}°"), unit)
            cases.append(HelixCase(angle_deg, unit, gears, self.sound_of(gears, receivers)))
        return tuple(cases)

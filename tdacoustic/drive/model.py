"""The drive model: a fleet and conditions in, a prediction out."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Literal

import numpy as np

from tdacoustic.drive.conditions import Condition, conditions_of
from tdacoustic.drive.gear_unit import GearUnit, gear_unit_of
from tdacoustic.drive.levels import PointField, Receiver
from tdacoustic.drive.prediction import Directivity, DriveSound, GearState, HelixCase, Prediction
from tdacoustic.drive.sources import MotorSources, mesh_source
from tdacoustic.errors import FleetError, GearError
from tdacoustic.fleet import Fleet
from tdacoustic.gears import SteadyState, bearing_forces, masuda_level_db, steady_state
from tdacoustic.gears.mesh_stiffness import LOW_LOAD_N_PER_M

__all__ = ["DriveModel"]


class DriveModel:
    """The model of a fleet's drive.

    Parameters
    ----------
    fleet : Fleet
    unit : GearUnit, optional
        Its gears, where they are known already.

    Raises
    ------
    FleetError
        The fleet lacks what the model needs, or its gears cannot be.
    """

    def __init__(self, fleet: Fleet, unit: GearUnit | None = None) -> None:
        self.fleet = fleet
        self.unit = unit or gear_unit_of(fleet)
        self._motor = MotorSources(fleet)
        self._field = PointField(fleet)

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
        sound = tuple(self.sound(state, receivers) for state in states)
        helix = self._helix_cases(max(held, key=lambda condition: condition.motor_hz), receivers) if held else ()
        around = [
            *(
                self._around("speed", state.condition.train_speed_km_h, s)
                for state, s in zip(states, sound, strict=True)
            ),
            *(self._around("helix", case.helix_angle_deg, case.sound) for case in helix),
        ]
        doubts = (*self._doubts(states, helix), *self._sound_doubts(sound))
        return Prediction(
            self.unit, states, sound, self._field.surface.name, tuple(around), helix, None, tuple(dict.fromkeys(doubts))
        )

    def sound(self, state: GearState, receivers: Sequence[Receiver] = ()) -> DriveSound:
        """Return the drive's sound where the gears are in a state.

        Parameters
        ----------
        state : GearState
        receivers : sequence of Receiver
            Besides the surface.
        """
        mesh = mesh_source(self.fleet, state.mesh_hz, state.masuda_db)
        sources = (*self._motor.at(state.condition), *((mesh,) if mesh is not None else ()))
        levels = self._field.levels(sources, (self._field.surface, *receivers))
        return DriveSound(state.condition.name, sources, levels)

    def _around(self, sweep: Literal["speed", "helix"], value: float, sound: DriveSound) -> Directivity:
        angles = np.arange(0.0, 360.0, 5.0)
        return Directivity(sweep, value, angles, self._field.around_db(sound.sources, angles))

    def _sound_doubts(self, sound: tuple[DriveSound, ...]) -> Iterator[str]:
        gear_path, placement = self.fleet.model.gear_path.value, self.fleet.masuda.placement.value
        if self.fleet.radiation.method.value != "point_sources":
            yield "boundary elements are not there yet: the field is that of point sources"
        if gear_path != "masuda":
            yield (
                f'gear_path = "{gear_path}": the bearing forces\' way through the housing is not there yet, so the '
                "total lacks it"
            )
        if placement == "inside" and gear_path != "structure":
            yield (
                "Masuda's source is put inside the housing, whose insertion loss is not there yet: the total holds "
                "nothing of it, and its constant cannot be seen in a level outside"
            )
        if placement == "off":
            yield "Masuda's meshing noise is off: it is shown, and the total holds nothing of it"
        unknown = self._motor.without_amplitude
        if unknown:
            yield (
                f"excitation{'s' if len(unknown) > 1 else ''} {', '.join(unknown)} of the motor: neither flux "
                "densities nor a sound power level, so no sound of theirs is in the levels"
            )
        if not any(s.path == "motor" for one in sound for s in one.sources):
            yield "the motor makes no sound in this model: the levels are those of the gears alone"

    def gears(self, condition: Condition, unit: GearUnit | None = None, steady: SteadyState | None = None) -> GearState:
        """Return the gears in one condition.

        Parameters
        ----------
        condition : Condition
        unit : GearUnit, optional
            Default: the fleet's.
        steady : SteadyState, optional
            Their motion, where it is known already.
        """
        unit = unit or self.unit
        mesh_hz = unit.mesh_hz(condition.motor_hz)
        try:
            steady = steady or steady_state(unit.system, mesh_hz, unit.pinion_torque_n_m(condition.torque_n_m))
        except GearError as error:
            raise FleetError(f"{self.fleet.path}: condition {condition.name}: {error}") from error
        level_db = masuda_level_db(
            unit.geometry.helix_angle_rad,
            unit.geometry.ratio,
            unit.geometry.transverse_contact_ratio,
            unit.pitch_line_speed_m_s(condition.motor_hz),
            condition.power_w,
            self._masuda_displacement(steady.dte_pp_m, steady.static_compression_m),
            self.fleet.masuda.constant_db.value,
        )
        return GearState(condition, mesh_hz, steady, bearing_forces(unit.system, steady), level_db)

    def _masuda_displacement(self, dte_pp_m: float, static_compression_m: float) -> float:
        if self.fleet.masuda.displacement.value == "um_pp":
            return 1e6 * dte_pp_m
        return dte_pp_m / abs(static_compression_m) if static_compression_m else 0.0

    def _helix_cases(self, condition: Condition, receivers: Sequence[Receiver]) -> tuple[HelixCase, ...]:
        stated = self.fleet.operation.helix_angle_deg
        cases = []
        own_deg = math.degrees(self.unit.geometry.helix_angle_rad)
        for angle_deg in stated.value if stated is not None else (own_deg,):
            unit = gear_unit_of(self.fleet, math.radians(angle_deg))
            gears = self.gears(replace(condition, name=f"{condition.name}, {angle_deg:g}°"), unit)
            cases.append(HelixCase(angle_deg, unit, gears, self.sound(gears, receivers)))
        return tuple(cases)

    def _doubts(self, states: tuple[GearState, ...], helix: tuple[HelixCase, ...]) -> Iterator[str]:
        yield from _stiffness_doubts(self.unit, helix)
        yield from self._mode_doubts(states)
        loads = [self.unit.line_load_n_per_m(state.condition.torque_n_m) for state in states]
        low = [pair for pair in zip(states, loads, strict=True) if 0.0 < pair[1] < LOW_LOAD_N_PER_M]
        if low:
            least = min(load for _, load in low)
            yield (
                f"{_conditions([state for state, _ in low])}: the load on the teeth is below 100 N/mm (down to "
                f"{1e-3 * least:.3g} N/mm), where ISO 6336-1 lowers the mesh stiffness in proportion; here it is not "
                "lowered"
            )
        by_text: dict[str, list[GearState]] = {}
        for state in (*states, *(case.gears for case in helix)):
            doubt = _doubt_of(state)
            if doubt is not None:
                by_text.setdefault(doubt, []).append(state)
        yield from (f"{_conditions(held)}: {doubt}" for doubt, held in by_text.items())

    def _mode_doubts(self, states: tuple[GearState, ...]) -> Iterator[str]:
        operation = self.fleet.operation
        mode, law = operation.mode.value, operation.torque.value.replace("_", " ")
        if not any(state.condition.torque_n_m < 0.0 for state in states):
            return
        if mode == "traction":
            yield "the mode is traction, but the torque is below zero: the wheelset drives the motor"
        else:
            yield (
                f"the mode is {mode}: the wheelset drives, and the torque of the law ({law}) is taken as one against "
                "the motor, on the other flanks of the teeth"
            )


def _stiffness_doubts(unit: GearUnit, helix: tuple[HelixCase, ...]) -> Iterator[str]:
    yield from (f"mesh stiffness: {doubt}" for doubt in unit.stiffness.doubts)
    for case in helix:
        beyond = [doubt for doubt in case.unit.stiffness.doubts if not doubt.startswith("transverse contact ratio")]
        yield from (f"mesh stiffness at {case.helix_angle_deg:g}°: {doubt}" for doubt in beyond)


def _conditions(states: list[GearState]) -> str:
    names = ", ".join(state.condition.name.replace(", ", " at ") for state in states)
    return f"condition{'s' if len(states) > 1 else ''} {names}"


def _doubt_of(state: GearState) -> str | None:
    steady = state.steady
    if steady.method == "at_rest":
        return (
            "without torque the teeth of the model do not touch, so there is no force and no meshing noise; real gears "
            "rattle under what the model leaves out"
        )
    if steady.repeats_after is None:
        return (
            "the motion does not repeat: forces are the strongest lines of a record of it, the peak to peak is that of "
            "the record, and what is broadband has no line"
        )
    if steady.repeats_after > 1:
        return (
            f"the motion repeats only after {steady.repeats_after} mesh periods, with lines between the mesh harmonics"
        )
    return None

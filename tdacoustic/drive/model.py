"""The drive model: a fleet and conditions in, a prediction out."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import cached_property

from tdacoustic.drive.conditions import Condition, conditions_of
from tdacoustic.drive.gear_unit import GearUnit, gear_unit_of
from tdacoustic.drive.prediction import GearState, HelixCase, Prediction
from tdacoustic.errors import FleetError, GearError
from tdacoustic.fleet import Fleet
from tdacoustic.gears import bearing_forces, masuda_level_db, steady_state
from tdacoustic.gears.mesh_stiffness import LOW_LOAD_N_PER_M

__all__ = ["DriveModel"]


class DriveModel:
    """The model of a fleet's drive.

    Parameters
    ----------
    fleet : Fleet

    Raises
    ------
    FleetError
        The fleet lacks what the model needs, or its gears cannot be.
    """

    def __init__(self, fleet: Fleet) -> None:
        self.fleet = fleet
        self.unit = gear_unit_of(fleet)

    @cached_property
    def conditions(self) -> tuple[Condition, ...]:
        """Those of ``[operation]``."""
        return conditions_of(self.fleet)

    def evaluate(self, conditions: Iterable[Condition] | None = None) -> Prediction:
        """Return the prediction for conditions, and for the helix angles of ``[operation]`` at the fastest of them.

        Parameters
        ----------
        conditions : iterable of Condition, optional
            Default: those of ``[operation]``.
        """
        held = self.conditions if conditions is None else tuple(conditions)
        states = tuple(self.gears(condition) for condition in held)
        helix = self._helix_cases(max(held, key=lambda condition: condition.motor_hz)) if held else ()
        return Prediction(self.unit, states, helix, None, tuple(self._doubts(states, helix)))

    def gears(self, condition: Condition, unit: GearUnit | None = None) -> GearState:
        """Return the gears in one condition.

        Parameters
        ----------
        condition : Condition
        unit : GearUnit, optional
            Default: the fleet's.
        """
        unit = unit or self.unit
        mesh_hz = unit.mesh_hz(condition.motor_hz)
        try:
            steady = steady_state(unit.system, mesh_hz, unit.pinion_torque_n_m(condition.torque_n_m))
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

    def _helix_cases(self, condition: Condition) -> tuple[HelixCase, ...]:
        stated = self.fleet.operation.helix_angle_deg
        cases = []
        for angle_deg in stated.value if stated is not None else ():
            unit = gear_unit_of(self.fleet, math.radians(angle_deg))
            gears = self.gears(replace(condition, name=f"{condition.name}, {angle_deg:g}°"), unit)
            cases.append(HelixCase(angle_deg, unit, gears))
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

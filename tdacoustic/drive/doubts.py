"""What the reader of a prediction must know before using its numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

from tdacoustic.drive.gear_unit import GearUnit
from tdacoustic.drive.patterns import pattern_of
from tdacoustic.drive.prediction import Directivity, DriveSound, GearState, HelixCase
from tdacoustic.fleet import Fleet
from tdacoustic.gears.mesh_stiffness import LOW_LOAD_N_PER_M
from tdacoustic.radiation import ABSORPTION_RANGE

__all__ = ["circle_doubts", "gear_doubts", "sound_doubts"]

NODE_PLANE_DB: Final = 6.0
"""From which the circle's mean below the sphere's counts as a node plane [assumed]."""


def gear_doubts(
    fleet: Fleet, unit: GearUnit, states: tuple[GearState, ...], helix: tuple[HelixCase, ...]
) -> Iterator[str]:
    """Yield what the reader must know of the gears before using the numbers."""
    yield from _stiffness_doubts(unit, helix)
    yield from _mode_doubts(fleet, states)
    loads = [unit.line_load_n_per_m(state.condition.torque_n_m) for state in states]
    low = [pair for pair in zip(states, loads, strict=True) if 0.0 < pair[1] < LOW_LOAD_N_PER_M]
    if low:
        least = min(load for _, load in low)
        yield (
            f"{_conditions([state for state, _ in low])}: the load on the teeth is below 100 N/mm (down to "
            f"{1e-3 * least:.3g} N/mm), where ISO 6336-1 lowers the mesh stiffness in proportion; here it is not "
            "lowered"
        )
    yield from structure_doubts(fleet, [(state.condition.name, state.mesh_hz) for state in states])
    by_text: dict[str, list[GearState]] = {}
    for state in (*states, *(case.gears for case in helix)):
        doubt = _doubt_of(state)
        if doubt is not None:
            by_text.setdefault(doubt, []).append(state)
    yield from (f"{_conditions(held)}: {doubt}" for doubt, held in by_text.items())


def structure_doubts(fleet: Fleet, mesh_hz: Sequence[tuple[str, float]]) -> Iterator[str]:
    """Yield what the path of the structure leaves out, where the total adds it.

    Parameters
    ----------
    fleet : Fleet
    mesh_hz : sequence of (str, float)
        Conditions and their mesh frequencies.
    """
    if fleet.radiation.method.value == "point_sources":
        return
    highest_hz = fleet.radiation.max_frequency_hz.value
    silent = [name for name, frequency in mesh_hz if frequency > highest_hz]
    if fleet.model.gear_path.value != "masuda" and silent:
        yield (
            f"condition{'s' if len(silent) > 1 else ''} {', '.join(silent)}: the mesh frequency lies above "
            f"max_frequency_hz = {highest_hz:g}, so the structure has no sound there and the total lacks it"
        )
    elif fleet.model.gear_path.value != "masuda":
        yield f"the structure's sound is that of the bearing forces' lines up to {highest_hz:g} Hz, and of none beyond"
    if fleet.masuda.placement.value == "inside" and fleet.model.gear_path.value != "structure" and silent:
        yield (
            f"condition{'s' if len(silent) > 1 else ''} {', '.join(silent)}: Masuda's source inside the housing has no "
            f"sound there, because the mesh frequency lies above max_frequency_hz = {highest_hz:g}"
        )
    later = len(fleet.gear_pair) - fleet.modelled_pair_number
    if later % 2:
        yield (
            "the modelled pair is not the last stage: its wheel turns against the wheelset, and the bearing forces on "
            "the housing are those of the other direction of travel"
        )


def _mode_doubts(fleet: Fleet, states: tuple[GearState, ...]) -> Iterator[str]:
    operation = fleet.operation
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


def sound_doubts(fleet: Fleet, sound: tuple[DriveSound, ...], unknown: tuple[str, ...]) -> Iterator[str]:
    """Yield what the reader must know of the levels; `unknown` names the motor's excitations without amplitude."""
    gear_path, placement = fleet.model.gear_path.value, fleet.masuda.placement.value
    if gear_path != "masuda" and fleet.radiation.method.value == "point_sources":
        yield (
            f'gear_path = "{gear_path}": the bearing forces\' way through the housing takes method = '
            '"boundary_elements", so the total lacks it'
        )
    with_housing = fleet.radiation.method.value != "point_sources"
    if gear_path == "sum" and placement != "off" and with_housing:
        yield (
            'gear_path = "sum": the gear is counted twice, once by Masuda\'s level of the whole unit and once by the '
            "bearing forces through its housing"
        )
    if placement == "inside" and gear_path != "structure":
        yield _inside_doubt(fleet)
    if placement == "off":
        yield "Masuda's meshing noise is off: it is shown, and the total holds nothing of it"
    yield from _air_doubts(fleet, sound)
    if unknown:
        yield (
            f"excitation{'s' if len(unknown) > 1 else ''} {', '.join(unknown)} of the motor: neither flux "
            "densities nor a sound power level, so no sound of theirs is in the levels"
        )
    if not any(s.path == "motor" for one in sound for s in one.sources):
        yield "the motor makes no sound in this model: the levels are those of the gears alone"


def _inside_doubt(fleet: Fleet) -> str:
    if fleet.radiation.method.value == "point_sources":
        return (
            'Masuda\'s source is put inside the housing, whose sound takes method = "boundary_elements": the total '
            "holds nothing of it, and its constant cannot be seen in a level outside"
        )
    return (
        "Masuda's source is put inside the housing: his level is of gear units measured with their housings, so here "
        "the housing's insertion loss is taken from it a second time"
    )


def circle_doubts(fleet: Fleet, sounds: Sequence[DriveSound], arounds: Sequence[Directivity]) -> Iterator[str]:
    """Yield where the circle of the directivity lies in a node plane of the sound.

    Parameters
    ----------
    fleet : Fleet
    sounds : sequence of DriveSound
        Of the conditions, then of the helix angles.
    arounds : sequence of Directivity
        Of the same.
    """
    sphere_m, circle_m = fleet.radiation.sphere_radius_m.value, fleet.radiation.circle_radius_m.value
    below: dict[str, list[str]] = {"speed": [], "helix": []}
    for sound, around in zip(sounds, arounds, strict=True):
        on_sphere = sound.level_db(f"{sphere_m:g} m")
        if on_sphere is None:
            continue
        # 1/R from the one sphere to the other; what the air takes on the way between is left out
        apart = on_sphere + 20.0 * math.log10(sphere_m / circle_m) - pattern_of(around).mean_db
        if apart > NODE_PLANE_DB:
            name = sound.condition if around.sweep == "speed" else f"{around.value:g}°"
            below[around.sweep].append(f"{name} ({apart:.0f} dB)")
    if not any(below.values()):
        return
    named = [(("condition", "conditions"), below["speed"]), (("helix angle", "helix angles"), below["helix"])]
    where = "; ".join(f"{words[len(held) > 1]} {', '.join(held)}" for words, held in named if held)
    yield (
        f"{where}: the mean level on the circle at {circle_m:g} m lies so far below the mean over the sphere of that "
        "radius, because the circle lies in a node plane of the sound. What is left there is the small difference of "
        "large parts: its level and shape hang on the symmetry of the model and on the grid (some dB), and say nothing "
        "of how loud the drive is"
    )


def _air_doubts(fleet: Fleet, sound: Sequence[DriveSound]) -> Iterator[str]:
    radiation = fleet.radiation
    (coldest, hottest), (driest, _), (lowest_hz, highest_hz) = ABSORPTION_RANGE
    air = (radiation.temperature_degc.value, radiation.humidity_percent.value)
    if radiation.air_absorption.value:
        heard = (source.frequency_hz for one in sound for source in one.sources)
        beyond = [frequency for frequency in heard if not lowest_hz <= frequency <= highest_hz]
        if beyond:
            yield (
                f"absorption of the air at {min(beyond):.0f} to {max(beyond):.0f} Hz is extrapolated: ISO 9613-1 "
                f"states it for {lowest_hz:g} to {highest_hz:g} Hz"
            )
    if radiation.air_absorption.value and not (coldest <= air[0] <= hottest and air[1] >= driest):
        yield (
            f"absorption of the air at {air[0]:g} °C and {air[1]:g} % humidity is extrapolated: ISO 9613-1 states it "
            f"for {coldest:g} to {hottest:g} °C and {driest:g} % at least"
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

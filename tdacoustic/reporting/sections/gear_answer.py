"""The answer first: what the gears do in each condition, in which regime, and what speaks against it."""

from __future__ import annotations

import math

from tdacoustic.drive import GearState, torque_at
from tdacoustic.errors import FleetError
from tdacoustic.fleet import Fleet
from tdacoustic.gears.mesh_stiffness import LOW_LOAD_N_PER_M
from tdacoustic.reporting.document import Block, Cell, Column, Notice, Paragraph, Section, Sentences, Table
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.gear_words import (
    by_speed,
    conditions_words,
    flank_words,
    hertz,
    largest_line,
    law_words,
    level_unit,
    micrometres,
    motion_words,
    newtons,
    range_words,
    sentence,
    significant,
    state_words,
    torque_words,
)
from tdacoustic.reporting.sections.helix_sweep import helix_words
from tdacoustic.reporting.sections.loads_over_speed import largest_words, rise_words
from tdacoustic.reporting.sections.meshing_noise import reading_words
from tdacoustic.reporting.sections.paper_features import features_words
from tdacoustic.reporting.sections.printed import PAPER, is_of_the_paper
from tdacoustic.reporting.sections.sound_field import sound_words
from tdacoustic.reporting.sections.speed_sweep import sweep_words
from tdacoustic.reporting.sections.what_if import what_if_line
from tdacoustic.results import FleetPrediction

__all__ = ["asked_lines", "gear_answer", "gear_overview", "regime_words"]

SCOPE = mark(
    "Computed are the gears on their bearings, Masuda's meshing noise, the motor's tones as far as the fleet says "
    "them, and the level around these as point sources; the housing is not."
)
SCOPE_WITH_HOUSING = mark(
    "Computed are the gears on their bearings, Masuda's meshing noise, the motor's tones as far as the fleet says "
    "them, and the housing: what the bearing forces make it radiate, and how it scatters the sources beside it."
)
ONE_WAY = mark("The bearing forces are those of bearings in a housing that does not move.")
TWO_WAY = mark("The bearing forces are those of bearings in a housing that gives way under them.")

TERMS = mark(
    "DTE is the dynamic transmission error. Forces are the total of a gear's bearings, peak amplitudes of a line; x "
    "lies along the line of centres, y is tangential, z lies along the shafts."
)

_MODES = {
    "traction": mark("traction"),
    "brake": mark("brake"),
    "coast": mark("coast"),
    "hauled": mark("hauled"),
}


def gear_answer(result: FleetPrediction) -> list[Block]:
    """Return the summary: the regime, a sentence a condition, what holds over the conditions, then the doubts."""
    doubts = [Notice("warning", sentence(doubt)) for doubt in result.prediction.doubts]
    asked = asked_lines(result)
    return [*_said(result), *([Sentences(asked)] if asked else []), *doubts, _table(result)]


def asked_lines(result: FleetPrediction) -> list[str]:
    """Return what was asked of the model in a line each: another source's features, and what a change would bring."""
    features, changes = features_words(result), what_if_line(result.what_if)
    return [*([sentence(features)] if features else []), *([changes] if changes else [])]


def gear_overview(result: FleetPrediction) -> Section:
    """Return the section on all conditions: `gear_answer` without the doubts, for a report that has them elsewhere."""
    return Section("model-conditions", say("The drive by condition"), [*_said(result), _table(result)])


def _said(result: FleetPrediction) -> list[Block]:
    states = list(result.prediction.conditions)
    blocks: list[Block] = [
        Paragraph(f"{regime_words(result)} {_scope(result)}"),
        Sentences([_of_condition(result.fleet, state, sound_words(result, state)) for state in states]),
    ]
    if any(state.masuda_db is not None for state in states):
        blocks.append(Paragraph(f"{say(TERMS)} {reading_words(result.fleet)}"))
    over = [sentence(text) for text in _over_conditions(result) if text]
    return [*blocks, Sentences(over)] if over else blocks


def _scope(result: FleetPrediction) -> str:
    """What is computed."""
    if result.prediction.housing is None:
        return say(SCOPE)
    coupling = say(TWO_WAY) if result.fleet.model.coupling.value == "two_way" else say(ONE_WAY)
    return f"{say(SCOPE_WITH_HOUSING)} {coupling}"


def regime_words(result: FleetPrediction) -> str:
    """Say which regime is computed, and what the torque's sign means."""
    fleet, states = result.fleet, result.prediction.conditions
    torques = [state.condition.torque_n_m for state in states]
    mode, low, high = say(_MODES[fleet.operation.mode.value]), min(torques), max(torques)
    if not low and not high:
        said = [say("Regime: {mode}, no torque, so that nothing presses the flanks of the teeth together.", mode=mode)]
    else:
        powers = sorted(1e-3 * state.condition.power_w for state in states)
        regime = say(
            "Regime: {mode}, {torque} of one motor, {law} ({power} kW).",
            mode=mode,
            torque=range_words(torque_words(low), torque_words(high)),
            law=_law_words(result),
            power=range_words(significant(powers[0]), significant(powers[-1])),
        )
        said = [regime, _sign_words(states)]
    return " ".join([*said, *_of_the_test(result)])


def _law_words(result: FleetPrediction) -> str:
    """How the torques follow from the speed, where it is the fleet's law that gives them."""
    fleet, conditions = result.fleet, [state.condition for state in result.prediction.conditions]
    stated = say("as the runs state it")
    try:
        of_law = [torque_at(fleet, condition.train_speed_km_h) for condition in conditions]
    except FleetError:
        return stated
    held = [math.isclose(c.torque_n_m, law, rel_tol=1e-9) for c, law in zip(conditions, of_law, strict=True)]
    if all(held):
        return law_words(fleet)
    return say("{law} or as the runs state it", law=law_words(fleet)) if any(held) else stated


def _sign_words(states: tuple[GearState, ...]) -> str:
    drive = [state for state in states if state.condition.torque_n_m > 0.0]
    coast = [state for state in states if state.condition.torque_n_m < 0.0]
    if not coast:
        return say("Above zero the motor drives the wheelset and the drive flanks carry.")
    if not drive:
        return say("Below zero the wheelset drives the motor and the coast flanks carry.")
    return say(
        "In {driving} the motor drives the wheelset and the drive flanks carry, in {coasting} the wheelset drives the "
        "motor and the coast flanks carry.",
        driving=conditions_words(drive),
        coasting=conditions_words(coast),
    )


def _of_the_test(result: FleetPrediction) -> list[str]:
    """What the paper's test was, for a fleet that is the paper's."""
    if not is_of_the_paper(result.fleet):
        return []
    unit, states = result.prediction.unit, result.prediction.conditions
    said = [
        say(
            "In the test of the paper ({paper}, section 3.1) another locomotive hauled this one, so "
            "that the gears carried drag only, on the coast flanks; how much is not printed.",
            paper=say(PAPER),
        )
    ]
    loads = [unit.line_load_n_per_m(state.condition.torque_n_m) for state in states]
    if min(loads) >= LOW_LOAD_N_PER_M:
        said.append(say("The load computed here is another regime than that of the test."))
    return said


def _of_condition(fleet: Fleet, state: GearState, around: str) -> str:
    condition, steady = state.condition, state.steady
    start = say(
        "{condition}: mesh frequency {frequency}, {torque}",
        condition=state_words(state),
        frequency=hertz(state.mesh_hz),
        torque=_torque(condition.torque_n_m),
    )
    if steady.method == "at_rest":
        rest = say("the teeth of the model do not touch, so there is no vibration, no force and no meshing noise")
        return sentence("; ".join(part for part in (start, rest, around) if part))
    parts = [say("DTE {length} peak to peak", length=micrometres(steady.dte_pp_m))]
    largest = largest_line(state)
    if largest is not None:
        gear, direction, force, frequency = largest
        parts.append(
            say(
                "largest bearing force {force} at {frequency} ({gear}, {direction})",
                force=newtons(force),
                frequency=hertz(frequency),
                gear=gear,
                direction=direction,
            )
        )
    if state.masuda_db is not None:
        parts.append(say("Masuda's level {level:.1f} {unit} at 1 m", level=state.masuda_db, unit=level_unit(fleet)))
    parts += [around] if around else []
    return sentence(f"{start}; {', '.join(parts)}. {sentence(motion_words(steady))}")


def _torque(torque_n_m: float) -> str:
    return (
        say("torque {torque} ({flank})", torque=torque_words(torque_n_m), flank=flank_words(torque_n_m))
        if torque_n_m
        else say("no torque")
    )


def _over_conditions(result: FleetPrediction) -> list[str]:
    loaded = [state for state in by_speed(result.prediction.conditions) if largest_line(state) is not None]
    found = []
    if loaded:
        found = [largest_words(loaded), rise_words(loaded)]
    return [*found, sweep_words(result), helix_words(result)]


def _table(result: FleetPrediction) -> Table:
    columns = (
        Column("condition", say("Condition")),
        Column("train_speed_km_h", say("Speed"), "km/h", 1, "number"),
        Column("motor_speed_rpm", say("Motor"), "rpm", 1, "number"),
        Column("mesh_frequency_hz", say("Mesh"), "Hz", 1, "number"),
        Column("torque_n_m", say("Torque"), "N m", 0, "number"),
        Column("dte_pp_um", say("DTE"), say("µm, peak to peak"), 2, "number"),
        Column("largest_force_n", say("Largest force"), "N", 0, "number"),
        Column("masuda_spl_1m_db", say("Masuda, 1 m"), level_unit(result.fleet), 1, "number"),
    )
    rows: list[list[Cell]] = []
    for state in result.prediction.conditions:
        condition, largest = state.condition, largest_line(state)
        rows.append(
            [
                condition.name,
                condition.train_speed_km_h,
                60.0 * condition.motor_hz,
                state.mesh_hz,
                condition.torque_n_m,
                1e6 * state.steady.dte_pp_m,
                None if largest is None else largest[2],
                state.masuda_db,
            ]
        )
    return Table("conditions", say("The conditions"), columns, rows, origin="calculated")

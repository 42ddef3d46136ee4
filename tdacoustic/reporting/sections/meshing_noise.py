"""Masuda's meshing noise beside Table 5 of the paper, and what of it can be compared."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tdacoustic.drive import GearState
from tdacoustic.fleet import Fleet
from tdacoustic.reporting.document import Block, Cell, Column, FigureBlock, Notice, Paragraph, Section, Sentences, Table
from tdacoustic.reporting.figure import Axis, Figure, Line
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.gear_words import by_speed, conditions_words, level_unit, sentence
from tdacoustic.reporting.sections.paper_features import judged_words
from tdacoustic.reporting.sections.parameters import parameter_table
from tdacoustic.reporting.sections.printed import (
    DTE_PP_UM,
    FIGURE_11_CONDITION,
    LEVEL_OF_TEXT_DB,
    PAPER,
    TABLE_5,
    Printed,
    is_of_the_paper,
    printed_of,
)
from tdacoustic.reporting.sections.words import pretty_signs
from tdacoustic.results import FleetPrediction

__all__ = ["masuda_named", "meshing_noise", "reading_words"]

_READING = {
    "masuda.constant_db": (mark("Masuda: constant C"), "dB"),
    "masuda.displacement": (mark("Masuda: what X is (displacement)"), ""),
    "masuda.weighting": (mark("Masuda: weighting of the level"), ""),
    "masuda.placement": (mark("Masuda: where its source is put"), ""),
}
"""Words and unit of the formula's reading, by key of the fleet file."""

FEWEST = 3
"""Conditions below which a shape is not compared as a whole."""

METHOD = mark(
    "Equation (8) of the paper, after Masuda, Abe and Hattori (1986): L = 20 (1 − tan(β/2)) u^(1/8) / εα^(1/4) "
    "√((5.56 + √v) / 5.56) + 20 lg W + 20 lg X + C, with the power W of one motor in kW and v the speed of the pitch "
    "line in m/s. It is the overall level of a whole gear unit at 1 m, its housing included; how it is spread over "
    "frequencies is not part of it."
)
OPEN = mark(
    "Its absolute height cannot be held against a measurement before C is calibrated: the unit of W, what X is and C "
    "are open in what is printed, and within one reading they are one additive constant. Differences between "
    "conditions can be compared within one reading; between readings they differ by the torque of each condition."
)


def meshing_noise(result: FleetPrediction) -> Section:
    """Return the section on Masuda's meshing noise."""
    states = by_speed(result.prediction.conditions)
    beside = _beside(result.fleet, states)
    blocks: list[Block] = [Paragraph(say(METHOD)), Paragraph(reading_words(result.fleet)), _reading(result.fleet)]
    silent = [state for state in states if state.masuda_db is None]
    if silent:
        words = say("no power or no vibration, so the formula has no level")
        blocks.append(Paragraph(sentence(f"{conditions_words(silent)}: {words}")))
    reference = next((state for state in states if state.masuda_db is not None), None)
    if reference is not None:
        blocks += [_table(result.fleet, states, reference, beside)]
        if len(states) - len(silent) > 1:
            blocks.append(FigureBlock(_figure(result.fleet, states, reference, beside), "calculated"))
    if not _is_calibrated(result.fleet):
        blocks.append(Paragraph(say(OPEN)))
    if beside and reference is not None:
        blocks += _comparison(states, beside)
    judged = judged_words(result, ("masuda_",))
    blocks += [Paragraph(sentence(judged))] if judged else []
    return Section("meshing-noise", say("Meshing noise"), blocks)


def masuda_named(key: str) -> tuple[str, str] | None:
    """Return words and unit of a parameter of the formula's reading, None of another."""
    if key not in _READING:
        return None
    words, unit = _READING[key]
    return say(words), unit


def reading_words(fleet: Fleet) -> str:
    """Say in which reading the formula is used, and how far its height can be trusted."""
    constant = fleet.masuda.constant_db
    if fleet.masuda.displacement.value == "um_pp":
        displacement = say("X the peak to peak of the DTE in µm")
    else:
        displacement = say("X the peak to peak of the DTE over the static compression F₀ / k̄")
    text = say(
        "Masuda's level is that at 1 m in {unit} re 20 µPa with C = {constant} dB, {displacement}, W in kW.",
        unit=level_unit(fleet),
        constant=pretty_signs(f"{constant.value:g}"),
        displacement=displacement,
    )
    if not _is_calibrated(fleet):
        trust = say("The constant is not calibrated, so only differences between conditions mean something.")
    elif constant.stderr is None:
        trust = say("The constant is calibrated ({origin}).", origin=constant.origin)
    else:
        trust = say(
            "The constant is calibrated ± {error:.2g} dB ({origin}).", error=constant.stderr, origin=constant.origin
        )
    return f"{text} {trust}"


def _is_calibrated(fleet: Fleet) -> bool:
    constant = fleet.masuda.constant_db
    return constant.stderr is not None or constant.origin.startswith("calibrated")


def _reading(fleet: Fleet) -> Table:
    return parameter_table("masuda-reading", say("The reading of the formula in force"), fleet, masuda_named)


Beside = dict[str, Printed]
"""Rows of Table 5 by name of the condition here."""


def _beside(fleet: Fleet, states: Sequence[GearState]) -> Beside:
    if not is_of_the_paper(fleet):
        return {}
    found = {state.condition.name: printed_of(state) for state in states}
    return {name: row for name, row in found.items() if row is not None}


def _relative(state: GearState, reference: GearState) -> float | None:
    assert reference.masuda_db is not None
    return None if state.masuda_db is None else state.masuda_db - reference.masuda_db


def _table(fleet: Fleet, states: Sequence[GearState], reference: GearState, beside: Beside) -> Table:
    unit, first = level_unit(fleet), reference.condition.name
    relative = say("dB re condition {name}", name=first)
    columns = [
        Column("condition", say("Condition")),
        Column("mesh_frequency_hz", say("Mesh"), "Hz", 1, "number"),
        Column("power_kw", say("Power W"), "kW", 1, "number"),
        Column("dte_pp_um", say("DTE"), say("µm, peak to peak"), 2, "number"),
        Column("masuda_spl_1m_db", say("Level at 1 m"), unit, 1, "number"),
        Column("relative_db", say("Level"), relative, 1, "number"),
    ]
    printed_first = beside.get(first)
    if beside:
        columns.append(Column("printed_db", say("Table 5"), say("dB, printed"), 2, "number"))
    if printed_first is not None:
        columns.append(Column("printed_relative_db", say("Table 5"), relative, 1, "number"))
    rows: list[list[Cell]] = []
    for state in states:
        condition, row = state.condition, beside.get(state.condition.name)
        cells: list[Cell] = [condition.name, state.mesh_hz, 1e-3 * abs(condition.power_w), 1e6 * state.steady.dte_pp_m]
        cells += [state.masuda_db, _relative(state, reference)]
        if beside:
            cells.append(None if row is None else row.level_db)
        if printed_first is not None:
            cells.append(None if row is None else row.level_db - printed_first.level_db)
        rows.append(cells)
    return Table("masuda", say("Masuda's meshing noise of the conditions"), columns, rows, origin="calculated")


def _figure(fleet: Fleet, states: Sequence[GearState], reference: GearState, beside: Beside) -> Figure:
    name = reference.condition.name
    ours = [_relative(state, reference) for state in states]
    lines = [
        Line(
            np.array([state.mesh_hz for state in states]),
            np.array([math.nan if value is None else value for value in ours]),
            say("this drive"),
            color=0,
            points=True,
        )
    ]
    caption = say("One dot a condition; the lines between them only lead the eye.")
    if name in beside:
        rows = list(beside.values())
        levels = np.array([row.level_db - beside[name].level_db for row in rows])
        lines.append(
            Line(
                np.array([row.mesh_hz for row in rows]), levels, say("Table 5, printed"), "dashed", color=1, points=True
            )
        )
        beside_words = say(
            "Calculated, and as printed in Table 5 of {paper}, each relative to its condition {name}.",
            paper=say(PAPER),
            name=name,
        )
        caption = f"{beside_words} {caption}"
    return Figure(
        "masuda-shape",
        say("Masuda's level over the conditions, relative to condition {name}", name=name),
        caption,
        Axis(say("Mesh frequency"), "Hz"),
        Axis(say("Level"), level_unit(fleet), reference=say("condition {name}", name=name)),
        lines,
        height=360,
    )


def _comparison(states: Sequence[GearState], beside: Beside) -> list[Block]:
    of_figure = next(row for row in TABLE_5 if row.condition == FIGURE_11_CONDITION)
    factor = 10.0 ** ((of_figure.level_db - LEVEL_OF_TEXT_DB) / 20.0)
    notice = say(
        "Against Table 5 only the shape over the conditions can be compared; the absolute level "
        "cannot. The paper's own two levels of condition {name} contradict each "
        "other: {level_of_text:g} dB in section 4.3 (with X = {displacement:g} µm) and "
        "{level_of_table:g} dB in Table 5, a factor of {factor:.2f} in W X. Neither the torque, the "
        "transmission error nor the inertias, bearings and damping behind Table 5 are printed.",
        name=FIGURE_11_CONDITION,
        level_of_text=LEVEL_OF_TEXT_DB,
        displacement=DTE_PP_UM,
        level_of_table=of_figure.level_db,
        factor=factor,
    )
    offset = _offset_words(states, beside)
    return [Notice("info", notice), *([Sentences([sentence(offset)])] if offset else [])]


def _offset_words(states: Sequence[GearState], beside: Beside) -> str:
    """How far this drive's levels and Table 5 are apart, as an offset and what is left beside it."""
    pairs = [(s.masuda_db, beside[s.condition.name].level_db) for s in states if s.condition.name in beside]
    off = np.array([ours - printed for ours, printed in pairs if ours is not None])
    if off.size < FEWEST:
        return ""
    rest = float(np.sqrt(np.mean((off - off.mean()) ** 2)))
    return pretty_signs(
        say(
            "over {count} conditions the level here is {offset:+.1f} dB off Table 5 on average, which "
            "the constant would take up; in shape the two then differ by {rest:.1f} dB rms, at most "
            "by {most:.1f} dB",
            count=off.size,
            offset=off.mean(),
            rest=rest,
            most=np.abs(off - off.mean()).max(),
        )
    )

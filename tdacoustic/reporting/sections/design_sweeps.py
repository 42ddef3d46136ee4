"""Design sweeps: of a grid levels over one parameter as lines, over two as maps, over more as a table."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from tdacoustic.reporting.document import (
    Block,
    Cell,
    Column,
    Details,
    FigureBlock,
    Notice,
    Paragraph,
    Section,
    Table,
)
from tdacoustic.reporting.figure import Axis, Figure, Heatmap, Line
from tdacoustic.reporting.language import say, say_count
from tdacoustic.reporting.sections.design_studies import design_study
from tdacoustic.reporting.sections.parameters import value_words
from tdacoustic.reporting.sections.words import joined, slug
from tdacoustic.results import FleetPrediction
from tdacoustic.studies import SweepResult
from tdacoustic.studies.words import number_words, unit_of

__all__ = ["design_sweeps"]

MOST_LINES: Final = 8
_WIDE: Final = 20.0
"""Largest over smallest value from which an axis is logarithmic."""
MOST_ROWS: Final = 300
"""Rows of a table in the page; the whole is in sweeps.csv."""


def design_sweeps(result: FleetPrediction) -> Section | None:
    """Return the section on design sweeps; None where the fleet asks for none."""
    sweeps = result.studies.sweeps
    if not sweeps:
        return None
    text = say(
        "Each point is a prediction of its own with other values of the fleet's parameters; the "
        "level is the total at {surface}. A helix angle of the modelled pair changes the gears "
        "alone, as in the helix sweep; a point whose housing differs has modes and transfer "
        "vectors of its own.",
        surface=result.prediction.surface,
    )
    blocks: list[Block] = [Paragraph(text)]
    return Section("design-sweeps", say("Design sweeps"), [*blocks, *(_of(result, sweep) for sweep in sweeps)])


def _of(result: FleetPrediction, found: SweepResult) -> Section:
    name = slug("sweep", found.sweep.name)
    refused = [reason for reason in found.reasons if reason]
    blocks: list[Block] = []
    if refused:
        told = joined(list(dict.fromkeys(refused))[:3])
        blocks.append(
            Notice(
                "warning",
                say_count(
                    "{count} of {points} points cannot be: {reasons}.",
                    "{count} of {points} points cannot be: {reasons}.",
                    len(refused),
                    points=len(found.points),
                    reasons=told,
                ),
            )
        )
    study = next((one for one in result.studies.sweep_sensitivities if one.found is found), None)
    blocks += _over_grid(result, found, name) if study is None else design_study(result, study, name)
    table = _table(result, found, name)
    blocks.append(table if len(table.rows) <= 12 else Details(say("Levels at each point"), [table]))
    return Section(name, found.sweep.name, blocks)


def _over_grid(result: FleetPrediction, found: SweepResult, name: str) -> list[Block]:
    keys, axes = found.sweep.keys, found.sweep.values
    numeric = all(isinstance(value, float | int) and not isinstance(value, bool) for held in axes for value in held)
    blocks: list[Block] = []
    if np.isfinite(found.of("spl_4m_db")).any():
        if len(axes) == 1 and numeric and len(found.points) > 1:
            blocks.append(FigureBlock(_lines(result, found, name), "calculated"))
        elif len(axes) == 2 and numeric and all(len(values) > 1 for values in axes):
            blocks += _maps(result, found, name)
    told = joined([say("{parameter} is {key}", parameter=_label(result, key), key=key) for key in keys])
    return [*blocks, Paragraph(say("In the fleet file: {parameters}.", parameters=told))]


def _label(result: FleetPrediction, key: str) -> str:
    words = number_words(key, result.fleet)
    return f"{words[:1].upper()}{words[1:]}"


def _lines(result: FleetPrediction, found: SweepResult, name: str) -> Figure:
    (key, *_), (values, *_) = found.sweep.keys, found.sweep.values
    there = [place for place in np.argsort(values).tolist() if not found.reasons[place]]
    x = np.array(values, dtype=float)[there]
    levels = found.of("spl_4m_db")[there]
    wide = x.min() > 0.0 and x.max() >= _WIDE * x.min()
    lines = [
        Line(x, levels[:, place], say("condition {condition}", condition=condition), points=True)
        for place, condition in enumerate(found.conditions)
        if np.isfinite(levels[:, place]).any()
    ]
    some = (
        ""
        if len(lines) <= MOST_LINES
        else say("{shown} of {held} conditions are drawn.", shown=MOST_LINES, held=len(lines))
    )
    label = _label(result, key)
    return Figure(
        name,
        say("Total over {parameter}", parameter=number_words(key, result.fleet)),
        some,
        Axis(label, unit_of(key), "log" if wide else "linear"),
        Axis(say("Sound pressure level"), "dB", reference="20 µPa"),
        lines[:MOST_LINES],
    )


def _maps(result: FleetPrediction, found: SweepResult, name: str) -> list[Block]:
    """One map a condition, the first in sight."""
    (key_y, key_x), (values_y, values_x) = found.sweep.keys, found.sweep.values
    order_y, order_x = np.argsort(values_y), np.argsort(values_x)
    levels = found.of("spl_4m_db").reshape(len(values_y), len(values_x), len(found.conditions))
    axes = [Axis(_label(result, key), unit_of(key)) for key in (key_x, key_y)]
    figures = []
    for place, condition in enumerate(found.conditions):
        z = levels[:, :, place][order_y][:, order_x]
        if not np.isfinite(z).any():
            continue
        low, high = float(np.nanmin(z)), float(np.nanmax(z))
        scale = Axis(say("Level"), "dB", reference="20 µPa")
        caption = say(
            "The colours reach from {low:.1f} to {high:.1f} dB; each condition has a scale of its own.",
            low=low,
            high=high,
        )
        x, y = (np.array(held, dtype=float)[of] for held, of in ((values_x, order_x), (values_y, order_y)))
        heat = Heatmap(x, y, z, say("condition {condition}", condition=condition), scale)
        title = say("Total in condition {condition} over both parameters", condition=condition)
        drawn = Figure(slug(name, condition), title, caption, axes[0], axes[1], [heat])
        figures.append(FigureBlock(drawn, "calculated"))
    return [*figures[:1], *([Details(say("The other conditions"), figures[1:])] if figures[1:] else [])]


def _table(result: FleetPrediction, found: SweepResult, name: str) -> Table:
    keys = found.sweep.keys
    columns = [Column("point", say("Point"), "", 0, "number")]
    columns += [Column(key.replace(".", "_"), _label(result, key), unit_of(key)) for key in keys]
    columns += [
        Column(f"condition_{one}", say("Condition {condition}", condition=one), "dB", 1, "number")
        for one in found.conditions
    ]
    columns += [Column("reason", say("Why not"))] if any(found.reasons) else []
    levels = found.of("spl_4m_db")
    rows: list[list[Cell]] = []
    for number, (point, reason) in enumerate(zip(found.points[:MOST_ROWS], found.reasons, strict=False)):
        values = [value_words(key, value) for key, value in point]
        shown = [None if math.isnan(level) else level for level in levels[number].tolist()]
        rows.append([number + 1, *values, *shown, *([reason] if any(found.reasons) else [])])
    n = len(found.points)
    caption = [say("Total at {surface} by point and condition", surface=result.prediction.surface)]
    if n > MOST_ROWS:
        caption.append(say("the first {shown} of {held} points, all are in sweeps.csv", shown=MOST_ROWS, held=n))
    return Table(f"{name}-points", "; ".join(caption), columns, rows, origin="calculated")

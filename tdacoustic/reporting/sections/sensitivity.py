"""What the levels depend on: how much they change with single parameters of the fleet."""

from __future__ import annotations

import math
from typing import Final

from tdacoustic.fleet import Fleet
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
from tdacoustic.reporting.figure import Axis, Bars, Figure
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.parameters import quantity_of, value_words
from tdacoustic.reporting.sections.words import joined, pretty_signs
from tdacoustic.results import FleetPrediction
from tdacoustic.studies import Sensitivity, Variation
from tdacoustic.studies.responses import SILENT, STEP_DB, STEP_RELATIVE, VECTORS
from tdacoustic.studies.sensitivity import per_words
from tdacoustic.studies.words import number_words, unit_of

__all__ = ["sensitivity"]

MOST_BARS: Final = 10
_OVER: Final = {"conditions": mark("over the conditions"), "helix": mark("over the helix angles")}
_CAPTIONS: Final = {
    ("conditions",): mark(
        "Slope of the total at {surface}, told for 10 % more; the largest in size over the conditions."
    ),
    ("helix",): mark("Slope of the total at {surface}, told for 10 % more; the largest in size over the helix angles."),
    ("conditions", "helix"): mark(
        "Slope of the total at {surface}, told for 10 % more; the largest in size over the conditions or over the "
        "helix angles."
    ),
}


def sensitivity(result: FleetPrediction) -> Section | None:
    """Return the section on sensitivities; None where nothing was varied."""
    found = result.studies.sensitivity
    if found is None or not found.varied:
        return None
    surface = result.prediction.surface
    blocks: list[Block] = [Paragraph(_method(surface))]
    ranking = found.ranking()[:MOST_BARS]
    if ranking:
        blocks.append(Paragraph(_ranking_words(result.fleet, found, ranking)))
        blocks.append(FigureBlock(_figure(result, found, ranking), "calculated"))
    if found.rattling:
        blocks.append(Notice("info", _rattling_words(found)))
    blocks.append(Details(say("Changes of the total, by parameter"), [_table(result, found)]))
    blocks += _left_out(result.fleet, found)
    return Section("sensitivity", say("What the levels depend on"), blocks)


def _method(surface: str) -> str:
    return say(
        "Slopes of the level at {surface} when a single parameter moves and all others stay, "
        "from central differences of ±{percent:g} % of the parameter (±{decibels:g} dB of a "
        "level). What stands for +10 % is ten times what 1 % does, and for +1 dB ten times what "
        "0.1 dB does: linear, not computed with so much more. Near a resonance such a step can "
        "do much more, or the opposite; [[what_if]] and [[sweep]] compute it. Of a table over "
        "speed all rows move together.",
        surface=surface,
        percent=100.0 * STEP_RELATIVE,
        decibels=STEP_DB,
    )


def _rattling_words(found: Sensitivity) -> str:
    told = [
        say("condition {condition}", condition=case.name) if case.over == "conditions" else f"{case.name}°"
        for case in found.rattling
    ]
    return say(
        "At {cases} the harmonic balance finds no stable motion when some of the gears' "
        "parameters move: these changes are left out there, as each would take an integration in "
        "time over seconds.",
        cases=joined(told),
    )


def _ranking_words(fleet: Fleet, found: Sensitivity, ranking: tuple[int, ...]) -> str:
    strongest = found.strongest("conditions")
    told = [
        say(
            "{parameter} ({change:+.1f} dB for {more})",
            parameter=number_words(found.varied[place].key, fleet),
            change=strongest[place],
            more=per_words(found.varied[place].kind),
        )
        for place in ranking[:3]
    ]
    return pretty_signs(
        say(
            "Of the assumed parameters the total depends most on {parameters}: the largest changes over speed.",
            parameters=joined(told),
        )
    )


def _figure(result: FleetPrediction, found: Sensitivity, ranking: tuple[int, ...]) -> Figure:
    shown = [found.varied[place] for place in ranking]
    names = [
        number_words(variation.key, result.fleet) + (f" ({_per(variation)})" if variation.kind == "level" else "")
        for variation in shown
    ]
    held = [over for over in _OVER if found.of_total(over).shape[1]]
    bars = [Bars(names, found.strongest(over)[list(ranking)], say(_OVER[over])) for over in held]
    return Figure(
        "sensitivity",
        say("Assumed parameters that the total depends on most"),
        say(_CAPTIONS[tuple(held)], surface=result.prediction.surface),
        Axis(say("Parameter")),
        Axis(say("Change of the level"), "dB"),
        bars,
        height=460,
    )


def _per(variation: Variation) -> str:
    return per_words(variation.kind)


def _table(result: FleetPrediction, found: Sensitivity) -> Table:
    columns = [
        Column("words", say("Parameter")),
        Column("value", say("Value")),
        Column("origin", say("Where it comes from")),
        Column("per", say("For")),
    ]
    for over in _OVER:
        for case in found.cases:
            if case.over == over:
                title = (
                    say("Condition {condition}", condition=case.name)
                    if over == "conditions"
                    else say("Helix {angle}°", angle=case.name)
                )
                columns.append(Column(f"{over}_{case.name}", title, "dB", 2, "number"))
    columns.append(Column("parameter", say("Key")))
    order = sorted(range(len(found.varied)), key=lambda place: -abs(found.strongest("conditions")[place]))
    errors = {parameter.key: parameter.stderr for parameter in result.fleet.parameters()}
    rows: list[list[Cell]] = []
    for place in order:
        variation = found.varied[place]
        value = say("over speed") if variation.value is None else _value(variation, errors.get(variation.key))
        changes = [float(change) for over in _OVER for change in found.of_total(over)[place]]
        cells: list[Cell] = [None if math.isnan(change) else change for change in changes]
        words = number_words(variation.key, result.fleet)
        rows.append([words, value, variation.origin, _per(variation), *cells, variation.key])
    caption = say(
        "Change of the total at {surface} by its slope, by condition and helix angle", surface=result.prediction.surface
    )
    return Table("sensitivity-total", caption, columns, rows, origin="calculated")


def _value(variation: Variation, stderr: float | None) -> str:
    if stderr is not None and isinstance(variation.value, int | float):
        return quantity_of(variation.key, variation.value, stderr)
    unit = unit_of(variation.key)
    return value_words(variation.key, variation.value) + (unit if unit == "°" else f" {unit}".rstrip())


def _left_out(fleet: Fleet, found: Sensitivity) -> list[Block]:
    """Parameters that were not varied, by reason."""
    by_reason: dict[str, list[str]] = {}
    for left in found.left_out:
        by_reason.setdefault(left.reason, []).append(left.key)
    if not by_reason:
        return []
    order = sorted(by_reason, key=lambda reason: (reason != VECTORS, reason != SILENT, reason))
    rows: list[list[Cell]] = [[number_words(key, fleet), reason, key] for reason in order for key in by_reason[reason]]
    columns = (Column("words", say("Parameter")), Column("reason", say("Why not")), Column("parameter", say("Key")))
    title = say("Parameters not varied")
    return [Details(title, [Table("not-varied", title, columns, rows)])]

"""Studies over ranges: which parameters decide the level, and how it lies over each."""

from __future__ import annotations

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
    Sentences,
    Table,
)
from tdacoustic.reporting.figure import Axis, Bars, Figure, Markers
from tdacoustic.reporting.language import say, say_count
from tdacoustic.reporting.sections.design_study_words import (
    left_out_words,
    level_words,
    method_words,
    study_words,
)
from tdacoustic.reporting.sections.parameters import value_words
from tdacoustic.reporting.sections.words import slug
from tdacoustic.results import FleetPrediction
from tdacoustic.studies import LevelInStudy, SweepSensitivity
from tdacoustic.studies.indices import Estimate
from tdacoustic.studies.words import number_words, unit_of

__all__ = ["design_study"]

MOST_BARS: Final = 10
"""Parameters of a figure, the most important ones."""
MOST_LEVELS: Final = 7
"""Conditions side by side, beside their energy mean."""
MOST_SCATTERS: Final = 6
MOST_MARKS: Final = 1000
"""Points of a scatter, evenly taken from all."""


def design_study(result: FleetPrediction, study: SweepSensitivity, name: str) -> list[Block]:
    """Return what the report says of a study over ranges.

    Parameters
    ----------
    result : FleetPrediction
    study : SweepSensitivity
    name : str
        Anchor of its section.
    """
    blocks: list[Block] = []
    left_out = left_out_words(study)
    if left_out:
        blocks.append(Notice("info", left_out))
    blocks.append(Paragraph(method_words(study)))
    ranges = _ranges(result, study, name)
    blocks.append(ranges if len(ranges.rows) <= MOST_BARS else Details(say("Parameters and ranges"), [ranges]))
    said = study_words(result.fleet, study)
    if said:
        blocks.append(Sentences(said))
    level = study.overall
    if level is None or level.weights is None:
        return blocks
    if level.total is not None:
        blocks.append(FigureBlock(_indices(result, study, level, name), "calculated"))
    blocks.append(FigureBlock(_by_condition(result, study, name), "calculated"))
    scatters = [FigureBlock(_scatter(result, study, level, place, name)) for place in study.ranking()[:MOST_SCATTERS]]
    blocks.append(scatters[0])
    if scatters[1:]:
        blocks.append(Details(say("The level over the next parameters"), scatters[1:]))
    blocks.append(Details(say("Sensitivities by parameter and condition"), [_table(result, study, name)]))
    return blocks


def _ranges(result: FleetPrediction, study: SweepSensitivity, name: str) -> Table:
    columns = (
        Column("words", say("Parameter")),
        Column("from", say("From"), align="right"),
        Column("to", say("To"), align="right"),
        Column("spread", say("Values")),
        Column("parameter", say("Key")),
    )
    rows: list[list[Cell]] = []
    for key, held in zip(study.keys, study.found.sweep.ranges, strict=True):
        unit = unit_of(key)
        ends = [
            f"{value_words(key, end)}{unit if unit == '°' else f' {unit}'}".rstrip() for end in (held.low, held.high)
        ]
        spread = say("each ratio as likely") if held.scale == "log" else say("each as likely")
        whole = [say("whole numbers alone")] if key in study.found.whole else []
        rows.append([number_words(key, result.fleet), *ends, ", ".join([spread, *whole]), key])
    return Table(f"{name}-ranges", say("Parameters and ranges"), columns, rows)


def _names(result: FleetPrediction, study: SweepSensitivity) -> tuple[list[int], list[str]]:
    places = list(study.ranking()[:MOST_BARS])
    return places, [number_words(study.keys[place], result.fleet) for place in places]


def _some(study: SweepSensitivity) -> list[str]:
    """How many parameters are drawn, where not all are."""
    n = len(study.keys)
    return [say("The first {shown} of {held} parameters are drawn.", shown=MOST_BARS, held=n)] if n > MOST_BARS else []


def _bars(names: list[str], places: list[int], held: Estimate | None, name: str) -> Bars:
    if held is None:
        return Bars(names, np.full(len(names), np.nan), name)
    value = held.value[places]
    errors = np.clip(np.stack([value - held.low[places], held.high[places] - value]), 0.0, None)
    return Bars(names, value, name, errors)


def _indices(result: FleetPrediction, study: SweepSensitivity, level: LevelInStudy, name: str) -> Figure:
    places, names = _names(result, study)
    bars = [
        _bars(names, places, level.first_order, say("on its own (first order)")),
        _bars(names, places, level.total, say("with interactions (total)")),
    ]
    caption = [
        say(
            "Of the {level} at {surface}; lines are intervals of 95 %. An index below 0 is one of 0 from "
            "too few points.",
            level=level_words(level),
            surface=result.prediction.surface,
        ),
        *_some(study),
    ]
    title = say("Part of the level's variance that each parameter makes")
    axes = Axis(say("Parameter")), Axis(say("Part of the variance"))
    return Figure(f"{name}-indices", title, " ".join(caption), *axes, bars, height=460)


def _by_condition(result: FleetPrediction, study: SweepSensitivity, name: str) -> Figure:
    places, names = _names(result, study)
    conditions = [level for level in study.levels if level.condition is not None]
    shown = [*conditions[:MOST_LEVELS], *(level for level in study.levels if level.condition is None)]
    bars = [
        _bars(
            names,
            places,
            level.weights,
            say("energy mean") if level.condition is None else say("condition {condition}", condition=level.condition),
        )
        for level in shown
    ]
    variance = any(level.total is not None for level in shown)
    caption = [say("At {surface}; lines are intervals of 95 %.", surface=result.prediction.surface)]
    if len(conditions) > MOST_LEVELS:
        caption.append(say("{shown} of {held} conditions are drawn.", shown=MOST_LEVELS, held=len(conditions)))
    if variance:
        what, title = say("Total index"), say("Total index of each parameter by condition")
    else:
        what = say("Standardised regression coefficient")
        title = say("Standardised regression coefficient of each parameter by condition")
    axes = Axis(say("Parameter")), Axis(what)
    return Figure(f"{name}-conditions", title, " ".join([*caption, *_some(study)]), *axes, bars, height=460)


def _scatter(result: FleetPrediction, study: SweepSensitivity, level: LevelInStudy, place: int, name: str) -> Figure:
    key, held = study.keys[place], study.found.sweep.ranges[place]
    there = np.flatnonzero(np.isfinite(level.level_db))
    if study.found.sweep.sampling == "saltelli":  # the others repeat the values of these
        there = there[there % (len(study.keys) + 2) < 2]
    some = there[np.linspace(0, len(there) - 1, min(MOST_MARKS, len(there))).round().astype(int)]
    values = np.array([study.found.points[number][place][1] for number in some.tolist()], dtype=float)
    words = number_words(key, result.fleet)
    drawn = (
        say("{shown} of {held} points", shown=len(some), held=len(there))
        if len(some) < len(there)
        else say_count("{count} point", "{count} points", len(some))
    )
    return Figure(
        slug(name, "over", key),
        say("Level over {parameter}", parameter=words),
        _scatter_caption(level, result.prediction.surface, drawn),
        Axis(f"{words[:1].upper()}{words[1:]}", unit_of(key), held.scale),
        Axis(say("Sound pressure level"), "dB", reference="20 µPa"),
        [Markers(values, level.level_db[some], level_words(level))],
    )


def _scatter_caption(level: LevelInStudy, surface: str, points: str) -> str:
    if level.condition is None:
        return say(
            "Energy mean over the conditions at {surface}, all other parameters anywhere in their ranges; {points}.",
            surface=surface,
            points=points,
        )
    return say(
        "Level in condition {condition} at {surface}, all other parameters anywhere in their ranges; {points}.",
        condition=level.condition,
        surface=surface,
        points=points,
    )


def _table(result: FleetPrediction, study: SweepSensitivity, name: str) -> Table:
    variance = study.found.sweep.sampling == "saltelli"
    titles = {
        "slope": (say("Over its range"), "dB", 1),
        "standardised": (say("Standardised regression"), "", 2),
        "rank": (say("Rank correlation"), "", 2),
        **({"first": (say("First order"), "", 2), "total": (say("Total"), "", 2)} if variance else {}),
    }
    columns = [Column("parameter", say("Parameter")), Column("level", say("Level"))]
    for measure, (title, unit, digits) in titles.items():
        columns.append(Column(measure, title, unit, digits, "number"))
        columns.append(Column(f"{measure}_low", say("{index}, from", index=title), unit, digits, "number"))
        columns.append(Column(f"{measure}_high", say("{index}, to", index=title), unit, digits, "number"))
    columns.append(Column("explained", "R²", "", 2, "number"))
    rows: list[list[Cell]] = []
    for place in study.ranking():
        words = number_words(study.keys[place], result.fleet)
        for level in study.levels:
            told = (
                say("energy mean")
                if level.condition is None
                else say("condition {condition}", condition=level.condition)
            )
            held = level.regression
            of_line = (None, None, None) if held is None else (held.slope, held.standardised, held.rank)
            estimates = [*of_line, *((level.first_order, level.total) if variance else ())]
            cells = [cell for one in estimates for cell in _cells(one, place)]
            rows.append([words, told, *cells, None if held is None else held.explained])
    caption = say("Sensitivities of the total at {surface}, with intervals of 95 %", surface=result.prediction.surface)
    return Table(f"{name}-sensitivities", caption, columns, rows, origin="calculated")


def _cells(held: Estimate | None, place: int) -> tuple[Cell, Cell, Cell]:
    if held is None:
        return None, None, None
    return float(held.value[place]), float(held.low[place]), float(held.high[place])

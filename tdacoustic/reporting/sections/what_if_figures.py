"""Figure and tables of what changes of the drive do to its levels."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np

from tdacoustic.drive.what_if import STEPS_DB, WhatIfAnswer, WhatIfLevel, off_name, step_name
from tdacoustic.reporting.document import Cell, Column, Table
from tdacoustic.reporting.figure import Axis, Bars, Element, Figure, Markers
from tdacoustic.reporting.language import mark, say

__all__ = ["what_if_figure", "what_if_table"]

SLOTS: Final = {"motor": 0, "mesh": 1, "structure": 2}

MOST_DRAWN: Final = 6
"""Cases of the fleet that the figure shows; the table has all."""

_STEPS: Final = {
    "motor": mark("motor {step:g} dB less"),
    "mesh": mark("mesh {step:g} dB less"),
    "structure": mark("structure {step:g} dB less"),
}

_GROUP: Final = 0.68
"""Part of a category that its bars take together, in both renderers."""


def what_if_figure(answer: WhatIfAnswer, conditions: Sequence[Sequence[WhatIfLevel]]) -> Figure | None:
    """Return bars of what is taken off, with intervals, and marks of what a source left out would take off.

    None where there is nothing to draw.
    """
    shown: list[tuple[str, str, int | None, str | None]]
    if answer.assumed:
        shown = [
            (step_name(path, STEPS_DB[0]), say(_STEPS[path], step=abs(STEPS_DB[0])), SLOTS[path], off_name(path))
            for path in answer.paths
        ]
    else:
        shown = [(case.name, case.name, None, None) for case in answer.cases[:MOST_DRAWN]]
    places = [f"{levels[0].condition} ({levels[0].train_speed_km_h:.4g} km/h)" for levels in conditions]
    elements: list[Element] = []
    marked: list[np.ndarray] = []
    wide = _GROUP / len(shown)
    for number, (case, legend, slot, off) in enumerate(shown):
        held = [_of_case(levels, case) for levels in conditions]
        elements.append(Bars(places, _off_db(held), legend, _lengths(held), slot))
        if off is not None:
            x = np.arange(len(places)) - 0.5 * _GROUP + (number + 0.5) * wide
            marked.append(np.stack([x, _off_db([_of_case(levels, off) for levels in conditions])]))
    if marked:
        x, most = np.concatenate(marked, axis=1)
        elements.append(Markers(x, most, say("the source left out"), symbol="x", color=7))
    if all(not np.isfinite(element.values).any() for element in elements if isinstance(element, Bars)):
        return None
    lines = [] if answer.basis is None else [say("Lines are intervals of 95 %.")]
    marks = [say("A cross is missing where nothing is left that sounds.")] if answer.assumed else []
    return Figure(
        "what-if-over-speed",
        say("What changes take off the level at {surface}", surface=answer.surface),
        " ".join([say("One group a condition, by speed."), *lines, *marks]),
        Axis(say("Condition")),
        Axis(say("Less at {surface}", surface=answer.surface), "dB"),
        elements,
    )


def _of_case(levels: Iterable[WhatIfLevel], name: str) -> WhatIfLevel | None:
    return next((level for level in levels if level.case == name), None)


def _off_db(levels: Sequence[WhatIfLevel | None]) -> np.ndarray:
    changes = [None if level is None else level.change_db for level in levels]
    return np.array([math.nan if change is None else -change for change in changes])


def _lengths(levels: Sequence[WhatIfLevel | None]) -> np.ndarray | None:
    """Lengths of the error bars below and above; None without any interval."""
    below, above = np.full(len(levels), math.nan), np.full(len(levels), math.nan)
    for number, level in enumerate(levels):
        if level is not None and level.change_95_db is not None and level.change_db is not None:
            low, high = level.change_95_db
            below[number], above[number] = high - level.change_db, level.change_db - low
    return np.stack([below, above]) if np.isfinite(below).any() else None


def what_if_table(answer: WhatIfAnswer, name: str, caption: str, levels: Iterable[WhatIfLevel]) -> Table:
    """Return levels and their changes, with intervals where there are any."""
    with_ends = answer.basis is not None
    everywhere = name == "what-if"
    columns = [
        Column("condition", say("Condition")),
        Column("train_speed_km_h", say("Speed"), "km/h", 1, "number"),
        *((Column("receiver", say("At")), Column("weighting", say("Weighting"))) if everywhere else ()),
        Column("case", say("Case")),
        Column("before_db", say("As it is"), "dB", 1, "number"),
        Column("level_db", say("Then"), "dB", 1, "number"),
        Column("change_db", say("Change"), "dB", 1, "number"),
    ]
    if with_ends:
        columns += [
            Column("change_low_db", say("95 % from"), "dB", 1, "number"),
            Column("change_high_db", say("to"), "dB", 1, "number"),
            Column("fit_change_low_db", say("Fit alone from"), "dB", 1, "number"),
            Column("fit_change_high_db", say("to"), "dB", 1, "number"),
            Column("level_low_db", say("Level 95 % from"), "dB", 1, "number"),
            Column("level_high_db", say("to"), "dB", 1, "number"),
        ]
    rows: list[list[Cell]] = []
    for level in levels:
        row: list[Cell] = [level.condition, level.train_speed_km_h]
        row += [level.receiver, level.weighting] if everywhere else []
        row += [level.case, level.before_db, level.level_db, level.change_db]
        ends = (level.change_95_db, level.fit_95_db, level.level_95_db) if with_ends else ()
        for pair in ends:
            row += [None, None] if pair is None else list(pair)
        rows.append(row)
    return Table(name, caption, columns, rows, origin="calculated")

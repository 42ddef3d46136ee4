"""Calibrated parameters with their intervals, campaign by campaign."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Final, TypeAlias

import numpy as np

from tdacoustic.gathering.fits import FittedValue, State
from tdacoustic.gathering.gathered import Gathering
from tdacoustic.gathering.outliers import Group
from tdacoustic.gathering.result import GatheredResult
from tdacoustic.gathering.robust import spread_of
from tdacoustic.reporting.document import Block, Cell, Column, Details, FigureBlock, Paragraph, Section, Table
from tdacoustic.reporting.figure import Axis, Figure, Line, Markers, Rule, Symbol
from tdacoustic.reporting.language import mark, say, say_count
from tdacoustic.reporting.sections.campaigns_rows import (
    MOST_ROWS,
    SHOWN_ROWS,
    captioned,
    name_cell,
    short,
    shown_of,
    spread_out,
    when,
)
from tdacoustic.reporting.shown import ORIGIN_WORDS

__all__ = ["campaigns_parameters"]

MOST_FIGURES: Final = 6
MOST_NAMED: Final = 40
"""Campaigns of a figure up to which each has its name beside it."""
MOST_IN_ORDER: Final = 1000
_WIDE: Final = 30.0

_LOOKS: Final[tuple[tuple[State, str, int, Symbol], ...]] = (
    ("determined", mark("determined, with its interval of 95 %"), 0, "circle"),
    ("on a bound", mark("on a bound: the optimum may lie beyond it"), 1, "x"),
    ("undetermined", mark("not determined by the data"), 7, "triangle"),
)
_STATES: Final = tuple(state for state, *_ in _LOOKS)
_STATE_WORDS: Final[dict[State, str]] = {
    "determined": mark("determined"),
    "on a bound": mark("on a bound"),
    "undetermined": mark("undetermined"),
}

_SHOWN_VALUES: Final = mark("Shown are {shown} of {held} values; all are in dataset/{table}.parquet.")
_SHOWN_EVENLY: Final = mark("Shown are {shown} of {held} campaigns, evenly; all are in dataset/{table}.parquet.")

_EXPLAINED: Final = mark(
    "Each campaign's own calibration, with the interval of 95 % where the data give one; an interval that is open to "
    "one side is drawn to the parameter's bound. A value on a bound, and one that the data do not determine, says "
    "nothing of the train: it is marked, and left out of medians and comparisons."
)

Entry: TypeAlias = tuple[GatheredResult, FittedValue]
Groups: TypeAlias = dict[Group, list[Entry]]


def campaigns_parameters(gathering: Gathering) -> Section | None:
    """Return the section on calibrated parameters; None where nothing was calibrated."""
    groups: Groups = {}
    for result in gathering.results:
        for fitted in result.parameters:
            if fitted.value is not None and fitted.state in _STATES:
                group = Group("parameter", result.origin, result.fleet, fitted.parameter)
                groups.setdefault(group, []).append((result, fitted))
    if not groups:
        return None
    order = list(gathering.origins)
    ranked = sorted(groups, key=lambda group: (order.index(group.origin), -len(groups[group]), group.fleet, group.what))
    drawn = [group for group in ranked if len(groups[group]) > 1][:MOST_FIGURES]
    blocks: list[Block] = [Paragraph(say(_EXPLAINED)), _summary(ranked, groups)]
    blocks += [_figure(number, group, groups[group]) for number, group in enumerate(drawn, 1)]
    left = sum(len(groups[group]) > 1 for group in ranked) - len(drawn)
    if left:
        blocks.append(
            Paragraph(
                say_count(
                    "{count} more parameter of a fleet and origin: see dataset/parameters.parquet.",
                    "{count} more parameters of a fleet and origin: see dataset/parameters.parquet.",
                    left,
                )
            )
        )
    blocks.append(_values(gathering, ranked, groups))
    return Section("parameters", say("Calibrated parameters"), blocks)


def _summary(ranked: Sequence[Group], groups: Groups) -> Table:
    columns = [
        Column("parameter", say("Parameter")),
        Column("origin", say("Origin"), kind="origin"),
        Column("fleet", say("Fleet")),
        Column("campaigns", say("Campaigns"), kind="number", digits=0),
        Column("determined", say("Determined"), kind="number", digits=0),
        Column("on_a_bound", say("On a bound"), kind="number", digits=0),
        Column("undetermined", say("Not determined"), kind="number", digits=0),
        Column("median", say("Median"), say("of determined ones"), kind="number"),
        Column("scatter", say("Scatter"), say("1.4826 MAD"), kind="number"),
    ]
    rows: list[list[Cell]] = []
    for group in ranked[:MOST_ROWS]:
        states = Counter(fitted.state for _, fitted in groups[group])
        values = [v.value for _, v in groups[group] if v.state == "determined" and v.value is not None]
        spread = spread_of(values, 0.0) if values else None
        middle = [None, None] if spread is None else [spread.median, spread.scatter if spread.n > 1 else None]
        counts: list[Cell] = [len(groups[group]), *(states[state] for state in _STATES)]
        rows.append([group.what, group.origin, group.fleet or None, *counts, *middle])
    left_out = shown_of(len(rows), len(ranked), SHOWN_ROWS, "parameters")
    return Table("parameters", captioned(say("Calibrated parameters by fleet"), left_out), columns, rows)


# ---------------------------------------------------------------- figures


def _ends(fitted: FittedValue) -> tuple[float, float] | None:
    """Both ends of an interval, an open one at the bound; None without any."""
    low, high = fitted.ci95
    if fitted.state == "on a bound" or (low is None and high is None):
        return None
    low, high = fitted.low if low is None else low, fitted.high if high is None else high
    return None if low is None or high is None else (low, high)


def _figure(number: int, group: Group, entries: Sequence[Entry]) -> FigureBlock:
    ordered = sorted(entries, key=lambda entry: (entry[1].value or 0.0, entry[0].train))
    values = [v.value for _, v in entries if v.state == "determined" and v.value is not None]
    median = spread_of(values, 0.0).median if values else None
    what = f"{group.what}, {say(ORIGIN_WORDS[group.origin])}"
    words = f"{group.fleet}." if group.fleet else ""
    axis = Axis(group.what, scale="log" if _is_wide(entries) else "linear")
    make = _forest if len(ordered) <= MOST_NAMED else _in_order
    figure = make(f"parameter-{number}", what, words, axis, ordered, median)
    return FigureBlock(figure, group.origin)


def _is_wide(entries: Sequence[Entry]) -> bool:
    """Whether the bounds are positive and lie so far apart that only ratios can be seen."""
    bounds = [(fitted.low, fitted.high) for _, fitted in entries]
    return all(low is not None and high is not None and low > 0.0 and high > _WIDE * low for low, high in bounds)


def _forest(name: str, what: str, words: str, key: Axis, ordered: Sequence[Entry], median: float | None) -> Figure:
    """A row a campaign, its interval across."""
    places = {id(result): len(ordered) - 1 - place for place, (result, _) in enumerate(ordered)}
    elements: list[Line | Markers | Rule] = []
    for state, legend, slot, symbol in _LOOKS:
        held = [(result, fitted) for result, fitted in ordered if fitted.state == state]
        intervals = [(places[id(result)], _ends(fitted)) for result, fitted in held]
        across = [(place, ends) for place, ends in intervals if ends is not None]
        if across:
            x = np.array([value for _, ends in across for value in (*ends, ends[1])])
            y = np.array([value for place, _ in across for value in (place, place, np.nan)], dtype=np.float64)
            elements.append(Line(x, y, say(legend), color=slot, group=say("interval of 95 %"), width=2.0, opacity=0.55))
        if held:
            at = np.array([places[id(result)] for result, _ in held], dtype=np.float64)
            shown = np.array([fitted.value for _, fitted in held], dtype=np.float64)
            texts = [_hover(result, fitted) for result, fitted in held]
            elements.append(Markers(shown, at, say(legend), texts=texts, symbol=symbol, color=slot))
    if median is not None:
        elements.append(Rule(median, say("median")))
    names = [short(f"{result.train} {when(result)[:4]}".strip()) for result, _ in reversed(ordered)]
    told = say("A row a campaign, by value; the dashed line is the median of the determined ones.")
    caption = " ".join(part for part in (words, told) if part)
    height = min(150 + 22 * len(ordered), 1600)
    axis = Axis(say("Campaign"), names=names, limits=(-0.7, len(ordered) - 0.3))
    return Figure(name, say("Calibrated {what}", what=what), caption, key, axis, elements, height=height)


def _in_order(name: str, what: str, words: str, key: Axis, ordered: Sequence[Entry], median: float | None) -> Figure:
    """Campaigns side by side in the order of their values, their intervals upright."""
    shown = spread_out(ordered, MOST_IN_ORDER)
    elements: list[Line | Markers] = []
    if median is not None:
        whole = np.array([0.0, len(shown) - 1.0])
        elements.append(Line(whole, np.full(2, median), say("median of determined ones"), "dashed", color=7))
    for state, legend, slot, symbol in _LOOKS:
        held = [(place, result, fitted) for place, (result, fitted) in enumerate(shown) if fitted.state == state]
        upright = [(place, ends) for place, _, fitted in held if (ends := _ends(fitted)) is not None]
        if upright:
            x = np.array([float(value) for place, _ in upright for value in (place, place, place)])
            y = np.array([value for _, ends in upright for value in (*ends, np.nan)])
            elements.append(Line(x, y, say(legend), color=slot, group=say("interval of 95 %"), width=1.0, opacity=0.45))
        if held:
            at = np.array([float(place) for place, _, _ in held])
            values = np.array([fitted.value for *_, fitted in held], dtype=np.float64)
            texts = [_hover(result, fitted) for _, result, fitted in held]
            elements.append(Markers(at, values, say(legend), texts=texts, symbol=symbol, color=slot))
    left_out = shown_of(len(shown), len(ordered), _SHOWN_EVENLY, "parameters")
    places = Axis(say("Campaigns in order"), limits=(-1.0, float(len(shown))))
    told = say_count(
        "{count} campaign in the order of their values.",
        "{count} campaigns in the order of their values.",
        len(ordered),
    )
    caption = " ".join(part for part in (words, told, left_out) if part)
    return Figure(name, say("Calibrated {what}", what=what), caption, places, key, elements, height=420)


def _hover(result: GatheredResult, fitted: FittedValue) -> str:
    parts = [short(result.train, 40), when(result), _state(fitted)]
    return ", ".join(part for part in parts if part)


def _state(fitted: FittedValue) -> str:
    return say(_STATE_WORDS.get(fitted.state, fitted.state))


# ---------------------------------------------------------------- values


def _values(gathering: Gathering, ranked: Sequence[Group], groups: Groups) -> Details:
    columns = [
        Column("train", say("Train, else campaign")),
        Column("date", say("Date")),
        Column("origin", say("Origin"), kind="origin"),
        Column("fleet", say("Fleet")),
        Column("parameter", say("Parameter")),
        Column("value", say("Value"), kind="number"),
        Column("ci95_low", say("From"), "95 %", kind="number"),
        Column("ci95_high", say("To"), "95 %", kind="number"),
        Column("state", say("State")),
    ]
    entries = [(group, entry) for group in ranked for entry in groups[group]]
    entries.sort(key=lambda item: item[1][1].state == "determined")  # what is doubtful first
    rows: list[list[Cell]] = []
    for group, (result, fitted) in entries[:MOST_ROWS]:
        whose: list[Cell] = [name_cell(gathering, [result]), when(result) or None, result.origin, result.fleet or None]
        numbers: list[Cell] = [fitted.value, *fitted.ci95]
        rows.append([*whose, group.what, *numbers, _state(fitted)])
    left_out = shown_of(len(rows), len(entries), _SHOWN_VALUES, "parameters")
    caption = captioned(say("Values, doubtful ones first"), left_out)
    return Details(say("Values of single campaigns"), [Table("parameter-values", caption, columns, rows)])

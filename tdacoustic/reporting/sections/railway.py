"""The quantities of the railway standards: what the runs give, what is not to be had, and whether repetition holds."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from tdacoustic.measured.hearing import Hearing
from tdacoustic.railway import (
    STANDARDS,
    Finding,
    PositionResult,
    Quantity,
    RailwayMeasures,
    RunQuantity,
    UnitResult,
)
from tdacoustic.reporting.document import (
    Block,
    Cell,
    Column,
    Details,
    FigureBlock,
    Paragraph,
    Section,
    Sentences,
    Table,
)
from tdacoustic.reporting.figure import Axis, Element, Figure, Line, Rule
from tdacoustic.reporting.sections.folding import in_sight
from tdacoustic.reporting.sections.item_tables import item_table
from tdacoustic.reporting.sections.words import condition_words, joined, pretty_signs, slug
from tdacoustic.results import Analysis
from tdacoustic.units import REFERENCES

__all__ = ["railway", "railway_words"]

SHOWN_FIGURES = 2
"""Histories drawn openly; further ones are folded away."""
MOST_FIGURES = 8
MOST_RUNS = 6
DRAWN_DB = 60.0
"""Below the highest level of a history, what is drawn."""

_STATES = {"met": "all requirements met", "broken": "a requirement broken", "unknown": "requirements unknown"}


def railway(analysis: Analysis) -> Section | None:
    """Return the section on the railway standards, or None where the campaign asks for nothing of them."""
    found = analysis.railway
    if found is None:
        return None
    blocks: list[Block] = [Paragraph(_intro(found))]
    said = [*_results(analysis, found), *_units(found)]
    if said:
        blocks.append(Sentences(said))
    figures = [FigureBlock(figure, analysis.campaign.origin) for figure in _histories(analysis, found)]
    blocks += figures[:SHOWN_FIGURES]
    if figures[SHOWN_FIGURES:]:
        blocks.append(Details("Levels over time of the other tests", figures[SHOWN_FIGURES:]))
    if found.positions:
        blocks.append(in_sight(_repetition_table(analysis, found.positions), "Repetition by microphone"))
    if found.quantities:
        blocks.append(in_sight(_quantity_table(analysis, found.quantities), "Quantities of each run"))
        findings = _findings_table(found.quantities)
        if findings is not None:
            blocks.append(Details("The requirements one by one", [findings]))
    return Section("railway", "By the railway standards", blocks)


def railway_words(analysis: Analysis, condition: str) -> str:
    """Return the results of a condition by the standards in a few words; empty where there is none.

    Parameters
    ----------
    analysis : Analysis
    condition : str
    """
    if analysis.railway is None:
        return ""
    said: dict[str, list[str]] = {}
    for item in analysis.railway.positions:
        if item.condition == condition and item.decisive and item.repetition.reported_db is not None:
            words = f"{item.test} {item.symbol} = {item.repetition.reported_db} dB at {item.channel}"
            said.setdefault(words, []).append(item.standard)
    return "; ".join(f"{words} ({joined(standards)})" for words, standards in said.items())


def _intro(found: RailwayMeasures) -> str:
    with_level = [item for item in found.quantities if item.quantity.level_db is not None]
    if not found.quantities:
        return "Nothing is rated: no run that could be measured states its test with a microphone that can be used."
    words = (
        f"{len(with_level)} of {len(found.quantities)} quantities could be had from the runs "
        f"({', '.join(found.standards)}). Levels are A-weighted, re 20 µPa, as measured; one that is corrected for "
        "background stands beside. A requirement that nothing in campaign and logs tells of is unknown, not met."
    )
    doubtful = [name for name in found.standards if not all(rule.verified for rule in STANDARDS[name].rules)]
    if doubtful:
        words += (
            f" Rules of {joined(doubtful)} are in part taken over from other editions or from practice "
            "[not verified against the standard's text]; each says so where it is used."
        )
    return words


# ---------------------------------------------------------------- in words


def _results(analysis: Analysis, found: RailwayMeasures) -> Iterator[str]:
    """One sentence a condition, standard and quantity; then one a quantity that no run has."""
    groups: dict[tuple[str, str, str, str], list[PositionResult]] = {}
    for position in found.positions:
        groups.setdefault((position.condition, position.standard, position.test, position.symbol), []).append(position)
    for (condition, standard, test, symbol), held in groups.items():
        words = f"{condition_words(analysis, condition)}, {test} by {standard}"
        yield pretty_signs(f"{words}: {_of_positions(found, symbol, held)}")
    missing: dict[tuple[str, str, str, str, str], list[str]] = {}
    for item in found.quantities:
        q = item.quantity
        if q.level_db is None:
            key = (item.condition, q.standard, q.test, q.symbol, q.reason or "")
            missing.setdefault(key, []).append(f"{item.channel} in run {item.run}")
    for (condition, standard, test, symbol, reason), where in missing.items():
        places = "; ".join(where[:4]) + (f" and {len(where) - 4} more" if len(where) > 4 else "")
        words = f"{condition_words(analysis, condition)}, {test} by {standard}: no {symbol}"
        yield pretty_signs(f"{words} ({places}): {reason}.")


def _of_positions(found: RailwayMeasures, symbol: str, held: Sequence[PositionResult]) -> str:
    best = next((position for position in held if position.decisive), None)
    if best is not None:
        runs = best.repetition
        of = f" at {best.channel}, the loudest of {len(held)} positions" if len(held) > 1 else f" at {best.channel}"
        said = (
            f"{symbol} = {runs.reported_db} dB{of} (mean {runs.mean_db:.1f} dB of {len(runs.levels_db)} runs, "
            f"{runs.spread_db:.1f} dB apart)"
        )
        return f"{said}; {_state_words(found, best)}."
    parts = []
    for position in held:
        runs = position.repetition
        count = f"{len(runs.levels_db)} run" + ("s" if len(runs.levels_db) != 1 else "")
        parts.append(f"{position.channel} {runs.mean_db:.1f} dB of {count}, no result: {runs.reason}")
    return f"{symbol}: {'; '.join(parts)}; {_state_words(found, held[0])}."


def _state_words(found: RailwayMeasures, position: PositionResult) -> str:
    """Requirements of the runs of a position in words, broken ones by name."""
    same = (position.condition, position.channel, position.standard, position.test)
    findings = [
        finding
        for item in found.quantities
        if (item.condition, item.channel, item.quantity.standard, item.quantity.test) == same
        for finding in item.quantity.findings
    ]
    broken = list(dict.fromkeys(finding.requirement for finding in findings if finding.state == "broken"))
    unknown = list(dict.fromkeys(finding.requirement for finding in findings if finding.state == "unknown"))
    parts = [f"broken: {', '.join(broken)}"] if broken else []
    parts += [f"not known: {', '.join(unknown)}"] if unknown else []
    return "; ".join(parts) or _STATES["met"]


def _units(found: RailwayMeasures) -> Iterator[str]:
    for unit in found.units:
        yield pretty_signs(_of_unit(unit))


def _of_unit(unit: UnitResult) -> str:
    words = f"Condition {unit.condition}, standing unit by {unit.standard}"
    if unit.level_db is None:
        return f"{words}: no level of the unit: {unit.reason}."
    if unit.reported_db is None:
        return f"{words}: {unit.level_db:.1f} dB over its positions, no result: {unit.reason}."
    return f"{words}: {unit.reported_db} dB over its positions ({unit.level_db:.1f} dB)."


# ---------------------------------------------------------------- figures


def _histories(analysis: Analysis, found: RailwayMeasures) -> list[Figure]:
    """Levels over time of tests with instants or maxima: the runs of a condition at its loudest microphone."""
    groups: dict[tuple[str, str], list[RunQuantity]] = {}
    for item in found.quantities:
        if item.quantity.level_db is not None and item.quantity.test in ("pass-by", "starting", "braking"):
            groups.setdefault((item.condition, item.quantity.test), []).append(item)
    figures = []
    for (condition, test), held in list(groups.items())[:MOST_FIGURES]:
        loudest = max(held, key=lambda item: item.quantity.level_db or -math.inf)
        same = (loudest.channel, loudest.quantity.standard)
        runs = [item for item in held if (item.channel, item.quantity.standard) == same][:MOST_RUNS]
        figure = _history(analysis, condition, test, runs)
        if figure is not None:
            figures.append(figure)
    return figures


def _history(analysis: Analysis, condition: str, test: str, runs: Sequence[RunQuantity]) -> Figure | None:
    """Levels over time of the runs of a condition; those of passages from the instant of the front on."""
    passing = test == "pass-by"
    hearing = {} if analysis.tonality is None else analysis.tonality.hearing
    elements: list[Element] = []
    rules: list[Element] = [Rule(0.0, "front")] if passing else []
    for item in runs:
        quantity = item.quantity
        zero = (quantity.start_s or 0.0) if passing else 0.0
        line = _line(item, hearing.get(item.run), zero)
        if line is not None:
            elements.append(line)
            if passing and quantity.end_s is not None:
                rules.append(Rule(quantity.end_s - zero, "rear" if len(runs) == 1 else f"rear, {item.run}"))
    if not elements:
        return None
    first = runs[0]
    told = ", ".join(f"run {item.run} {item.quantity.level_db:.1f} dB" for item in runs)
    since = "Time from the passing of the front" if passing else "Time from the start of the run"
    return Figure(
        slug("level-history", condition, test),
        f"Level over time: {test}, {condition_words(analysis, condition)}, {first.channel}",
        f"{first.quantity.symbol} by {first.quantity.standard}: {told}. Drawn is the A-weighted level with time "
        "weighting F, which reads low for the first half second of a record.",
        Axis(since, "s"),
        Axis("A-weighted level", "dB", reference="20 µPa"),
        [*elements, *rules],
        height=340,
    )


def _line(item: RunQuantity, hearing: Hearing | None, zero_s: float) -> Line | None:
    held = None if hearing is None else hearing.levels(item.channel)
    if held is None:
        return None
    history, place, start_s = held
    with np.errstate(divide="ignore"):
        fast = 10.0 * np.log10(history.fast[place] / REFERENCES["sound_pressure"] ** 2)
    top = float(np.max(fast, initial=-math.inf))
    if not math.isfinite(top):
        return None
    return Line(start_s + history.ends_s - zero_s, np.where(fast > top - DRAWN_DB, fast, np.nan), f"run {item.run}")


# ---------------------------------------------------------------- tables


def _repetition_table(analysis: Analysis, positions: Sequence[PositionResult]) -> Table:
    columns: list[tuple[Column, Callable[[PositionResult], Cell]]] = [
        (Column("condition", "Condition"), lambda p: p.condition),
        (Column("standard", "Standard"), lambda p: p.standard),
        (Column("test", "Test"), lambda p: p.test),
        (Column("channel", "Microphone"), lambda p: p.channel + (" (decisive)" if p.decisive else "")),
        (Column("symbol", "Quantity"), lambda p: p.symbol),
        (Column("n_runs", "Runs", "", 0, "number"), lambda p: len(p.repetition.levels_db)),
        (Column("mean_db", "Mean", "dB", 1, "number"), lambda p: p.repetition.mean_db),
        (Column("spread_db", "Spread", "dB", 1, "number"), lambda p: p.repetition.spread_db),
        (Column("reported_db", "Result", "dB", 0, "number"), lambda p: p.repetition.reported_db),
        (Column("state", "Requirements"), lambda p: p.state),
        (Column("reason", "Why no result"), lambda p: p.repetition.reason or ""),
    ]
    return item_table("railway-repetition", "Repetition", positions, columns, analysis.campaign.origin)


def _quantity_table(analysis: Analysis, quantities: Sequence[RunQuantity]) -> Table:
    columns: list[tuple[Column, Callable[[RunQuantity], Cell]]] = [
        (Column("run", "Run"), lambda item: item.run),
        (Column("channel", "Microphone"), lambda item: item.channel),
        (Column("standard", "Standard"), lambda item: item.quantity.standard),
        (Column("test", "Test"), lambda item: item.quantity.test),
        (Column("symbol", "Quantity"), lambda item: item.quantity.symbol),
        (Column("level_db", "Level", "dB re 20 µPa", 1, "number"), lambda item: item.quantity.level_db),
        (Column("corrected_db", "Less background", "dB", 1, "number"), lambda item: item.quantity.corrected_db),
        (Column("span", "Interval"), lambda item: _span(item.quantity)),
        (Column("state", "Requirements"), lambda item: item.quantity.state),
        (Column("reason", "Why no level"), lambda item: item.quantity.reason or ""),
    ]
    return item_table("railway", "Quantities of each run", quantities, columns, analysis.campaign.origin)


def _span(quantity: Quantity) -> str:
    if quantity.start_s is None or quantity.end_s is None:
        return ""
    return f"{quantity.start_s:.2f} to {quantity.end_s:.2f} s"


def _findings_table(quantities: Sequence[RunQuantity]) -> Table | None:
    """Each requirement once a standard, with the runs and microphones that found the same of it."""
    groups: dict[tuple[str, str, Finding], list[str]] = {}
    for item in quantities:
        for finding in item.quantity.findings:
            key = (item.quantity.standard, item.quantity.test, finding)
            groups.setdefault(key, []).append(f"{item.run}, {item.channel}")
    if not groups:
        return None
    order = {"broken": 0, "unknown": 1, "met": 2}
    columns = (
        Column("standard", "Standard"),
        Column("test", "Test"),
        Column("requirement", "Requirement"),
        Column("state", "State"),
        Column("detail", "Found"),
        Column("origin", "Rule from"),
        Column("where", "Run and microphone"),
    )
    rows: list[list[Cell]] = [
        [standard, test, finding.requirement, finding.state, finding.detail, finding.origin, "; ".join(where)]
        for (standard, test, finding), where in sorted(groups.items(), key=lambda entry: order[entry[0][2].state])
    ]
    return Table("railway-findings", "What the standards ask, held against what is known", columns, rows)

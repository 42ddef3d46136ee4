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
from tdacoustic.reporting.language import say, say_count
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
        blocks.append(Details(say("Levels over time of the other tests"), figures[SHOWN_FIGURES:]))
    if found.positions:
        blocks.append(in_sight(_repetition_table(analysis, found.positions), say("Repetition by microphone")))
    if found.quantities:
        blocks.append(in_sight(_quantity_table(analysis, found.quantities), say("Quantities of each run")))
        findings = _findings_table(found.quantities)
        if findings is not None:
            blocks.append(Details(say("The requirements one by one"), [findings]))
    return Section("railway", say("By the railway standards"), blocks)


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
            words = say(
                "{test} {symbol} = {level} dB at {channel}",
                test=item.test,
                symbol=item.symbol,
                level=item.repetition.reported_db,
                channel=item.channel,
            )
            said.setdefault(words, []).append(item.standard)
    return "; ".join(f"{words} ({joined(standards)})" for words, standards in said.items())


def _intro(found: RailwayMeasures) -> str:
    with_level = [item for item in found.quantities if item.quantity.level_db is not None]
    if not found.quantities:
        return say(
            "Nothing is rated: no run that could be analysed states its test with a microphone that can be used."
        )
    words = say(
        "{count} of {all} quantities could be had from the runs ({standards}). "
        "Levels are A-weighted, re 20 µPa, as recorded; one that is corrected for background "
        "stands beside. A requirement that nothing in campaign and logs tells of is unknown, not "
        "met.",
        count=len(with_level),
        all=len(found.quantities),
        standards=", ".join(found.standards),
    )
    doubtful = [name for name in found.standards if not all(rule.verified for rule in STANDARDS[name].rules)]
    if not doubtful:
        return words
    taken_over = say(
        "Rules of {standards} are in part taken over from other editions or from practice "
        "[not verified against the standard's text]; each says so where it is used.",
        standards=joined(doubtful),
    )
    return f"{words} {taken_over}"


# ---------------------------------------------------------------- in words


def _results(analysis: Analysis, found: RailwayMeasures) -> Iterator[str]:
    """One sentence a condition, standard and quantity; then one a quantity that no run has."""
    groups: dict[tuple[str, str, str, str], list[PositionResult]] = {}
    for position in found.positions:
        groups.setdefault((position.condition, position.standard, position.test, position.symbol), []).append(position)
    for (condition, standard, test, symbol), held in groups.items():
        words = say(
            "{condition}, {test} by {standard}",
            condition=condition_words(analysis, condition),
            test=test,
            standard=standard,
        )
        yield pretty_signs(f"{words}: {_of_positions(found, symbol, held)}")
    missing: dict[tuple[str, str, str, str, str], list[str]] = {}
    for item in found.quantities:
        q = item.quantity
        if q.level_db is None:
            key = (item.condition, q.standard, q.test, q.symbol, q.reason or "")
            missing.setdefault(key, []).append(say("{channel} in run {run}", channel=item.channel, run=item.run))
    for (condition, standard, test, symbol, reason), where in missing.items():
        places = "; ".join(where[:4])
        if len(where) > 4:
            places = say("{places} and {count} more", places=places, count=len(where) - 4)
        words = say(
            "{condition}, {test} by {standard}: no {symbol}",
            condition=condition_words(analysis, condition),
            test=test,
            standard=standard,
            symbol=symbol,
        )
        yield pretty_signs(f"{words} ({places}): {reason}.")


def _of_positions(found: RailwayMeasures, symbol: str, held: Sequence[PositionResult]) -> str:
    best = next((position for position in held if position.decisive), None)
    if best is not None:
        return f"{_result_words(symbol, best, len(held))}; {_state_words(found, best)}."
    parts = []
    for position in held:
        runs = position.repetition
        parts.append(
            say_count(
                "{channel} {mean:.1f} dB of {count} run, no result: {reason}",
                "{channel} {mean:.1f} dB of {count} runs, no result: {reason}",
                len(runs.levels_db),
                channel=position.channel,
                mean=runs.mean_db,
                reason=runs.reason,
            )
        )
    return f"{symbol}: {'; '.join(parts)}; {_state_words(found, held[0])}."


def _result_words(symbol: str, best: PositionResult, n_positions: int) -> str:
    """The result at the position that decides, and the runs that it is of."""
    runs = best.repetition
    of_runs = say(
        "mean {mean:.1f} dB of {count} runs, {spread:.1f} dB apart",
        mean=runs.mean_db,
        count=len(runs.levels_db),
        spread=runs.spread_db,
    )
    where = (
        say("{channel}, the loudest of {count} positions", channel=best.channel, count=n_positions)
        if n_positions > 1
        else best.channel
    )
    return say(
        "{symbol} = {level} dB at {where} ({of_runs})",
        symbol=symbol,
        level=runs.reported_db,
        where=where,
        of_runs=of_runs,
    )


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
    parts = [say("broken: {requirements}", requirements=", ".join(broken))] if broken else []
    parts += [say("not known: {requirements}", requirements=", ".join(unknown))] if unknown else []
    return "; ".join(parts) or say("all requirements met")


def _units(found: RailwayMeasures) -> Iterator[str]:
    for unit in found.units:
        yield pretty_signs(_of_unit(unit))


def _of_unit(unit: UnitResult) -> str:
    words = say("Condition {condition}, standing unit by {standard}", condition=unit.condition, standard=unit.standard)
    if unit.level_db is None:
        said = say("no level of the unit: {reason}", reason=unit.reason)
    elif unit.reported_db is None:
        said = say("{level:.1f} dB over its positions, no result: {reason}", level=unit.level_db, reason=unit.reason)
    else:
        said = say("{rounded} dB over its positions ({level:.1f} dB)", rounded=unit.reported_db, level=unit.level_db)
    return f"{words}: {said}."


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
    rules: list[Element] = [Rule(0.0, say("front"))] if passing else []
    for item in runs:
        quantity = item.quantity
        zero = (quantity.start_s or 0.0) if passing else 0.0
        line = _line(item, hearing.get(item.run), zero)
        if line is not None:
            elements.append(line)
            if passing and quantity.end_s is not None:
                name = say("rear") if len(runs) == 1 else say("rear, {run}", run=item.run)
                rules.append(Rule(quantity.end_s - zero, name))
    if not elements:
        return None
    first = runs[0]
    told = ", ".join(say("run {run} {level:.1f} dB", run=item.run, level=item.quantity.level_db) for item in runs)
    since = say("Time from the passing of the front") if passing else say("Time from the start of the run")
    return Figure(
        slug("level-history", condition, test),
        say(
            "Level over time: {test}, {condition}, {channel}",
            test=test,
            condition=condition_words(analysis, condition),
            channel=first.channel,
        ),
        say(
            "{symbol} by {standard}: {told}. Drawn is the A-weighted level with time weighting F, "
            "which reads low for the first half second of a record.",
            symbol=first.quantity.symbol,
            standard=first.quantity.standard,
            told=told,
        ),
        Axis(since, "s"),
        Axis(say("A-weighted level"), "dB", reference="20 µPa"),
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
    return Line(
        start_s + history.ends_s - zero_s, np.where(fast > top - DRAWN_DB, fast, np.nan), say("run {run}", run=item.run)
    )


# ---------------------------------------------------------------- tables


def _repetition_table(analysis: Analysis, positions: Sequence[PositionResult]) -> Table:
    columns: list[tuple[Column, Callable[[PositionResult], Cell]]] = [
        (Column("condition", say("Condition")), lambda p: p.condition),
        (Column("standard", say("Standard")), lambda p: p.standard),
        (Column("test", say("Test")), lambda p: p.test),
        (Column("channel", say("Microphone")), _channel_words),
        (Column("symbol", say("Quantity")), lambda p: p.symbol),
        (Column("n_runs", say("Runs"), "", 0, "number"), lambda p: len(p.repetition.levels_db)),
        (Column("mean_db", say("Mean"), "dB", 1, "number"), lambda p: p.repetition.mean_db),
        (Column("spread_db", say("Spread"), "dB", 1, "number"), lambda p: p.repetition.spread_db),
        (Column("reported_db", say("Result"), "dB", 0, "number"), lambda p: p.repetition.reported_db),
        (Column("state", say("Requirements")), lambda p: p.state),
        (Column("reason", say("Why no result")), lambda p: p.repetition.reason or ""),
    ]
    return item_table("railway-repetition", say("Repetition"), positions, columns, analysis.campaign.origin)


def _channel_words(position: PositionResult) -> str:
    return say("{channel} (decisive)", channel=position.channel) if position.decisive else position.channel


def _quantity_table(analysis: Analysis, quantities: Sequence[RunQuantity]) -> Table:
    columns: list[tuple[Column, Callable[[RunQuantity], Cell]]] = [
        (Column("run", say("Run")), lambda item: item.run),
        (Column("channel", say("Microphone")), lambda item: item.channel),
        (Column("standard", say("Standard")), lambda item: item.quantity.standard),
        (Column("test", say("Test")), lambda item: item.quantity.test),
        (Column("symbol", say("Quantity")), lambda item: item.quantity.symbol),
        (Column("level_db", say("Level"), "dB re 20 µPa", 1, "number"), lambda item: item.quantity.level_db),
        (Column("corrected_db", say("Less background"), "dB", 1, "number"), lambda item: item.quantity.corrected_db),
        (Column("span", say("Interval")), lambda item: _span(item.quantity)),
        (Column("state", say("Requirements")), lambda item: item.quantity.state),
        (Column("reason", say("Why no level")), lambda item: item.quantity.reason or ""),
    ]
    return item_table("railway", say("Quantities of each run"), quantities, columns, analysis.campaign.origin)


def _span(quantity: Quantity) -> str:
    if quantity.start_s is None or quantity.end_s is None:
        return ""
    return say("{start:.2f} to {end:.2f} s", start=quantity.start_s, end=quantity.end_s)


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
        Column("standard", say("Standard")),
        Column("test", say("Test")),
        Column("requirement", say("Requirement")),
        Column("state", say("State")),
        Column("detail", say("Found")),
        Column("origin", say("Rule from")),
        Column("where", say("Run and microphone")),
    )
    rows: list[list[Cell]] = [
        [standard, test, finding.requirement, finding.state, finding.detail, finding.origin, "; ".join(where)]
        for (standard, test, finding), where in sorted(groups.items(), key=lambda entry: order[entry[0][2].state])
    ]
    return Table("railway-findings", say("What the standards ask, held against what is known"), columns, rows)

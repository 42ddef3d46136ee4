"""The answer first: who dominates at each speed, how sure that is, and what speaks against it."""

from __future__ import annotations

import math

import numpy as np

from tdacoustic.attribution import Dominance, SourceLine
from tdacoustic.attribution.dominance import DECIDED
from tdacoustic.measured.levels import energy_mean_db
from tdacoustic.measured.runs import receivers
from tdacoustic.reporting.document import Block, Cell, Column, FigureBlock, Notice, Paragraph, Sentences, Table
from tdacoustic.reporting.figure import Axis, Bars, Figure
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.contributions import agreement_words
from tdacoustic.reporting.sections.order_sentences import loudest_order_words
from tdacoustic.reporting.sections.railway import railway_words
from tdacoustic.reporting.sections.words import (
    OWNER_SLOTS,
    UNKNOWN_SPEED,
    condition_words,
    distinct_lines,
    is_override,
    joined,
    probability_words,
    speed_words,
    tested_runs,
)
from tdacoustic.results import Analysis
from tdacoustic.units import level_db

__all__ = ["answer", "conditions_answer", "verdicts_answer"]

NAMED_LINES = 3
MOST_OF_THE_SOUND = 0.5
"""Line fraction below which the lines do not speak for the sound as a whole [assumed]."""
WORTH_SAYING = 0.05
"""Share of the lines' energy from which it is named against the verdict [assumed]."""
SPREAD_DB = 1.0
"""Spread of a level over runs from which it is named; the table always has it [assumed]."""

EXCITATION_WORDS = {
    "mesh": mark("at mesh orders"),
    "inverter": mark("at inverter orders"),
    "motor": mark("at orders of the motor shaft"),
    "wheelset": mark("at orders of the wheelset"),
    "unknown": mark("at no known order"),
}

SHARE_WORDS = {
    "ambiguous": mark("belongs to either, motor or gearbox"),
    "unassigned": mark("belongs to no known source"),
}


def answer(analysis: Analysis) -> list[Block]:
    """Return the summary: a sentence a condition, the verdicts side by side, then what could not be done."""
    return [*_sentences(analysis), *verdicts_answer(analysis), *_notices(analysis)]


def conditions_answer(analysis: Analysis) -> list[Block]:
    """Return a sentence a condition, then what could not be done: `answer` without the verdicts side by side."""
    return [*_sentences(analysis), *_notices(analysis)]


def _sentences(analysis: Analysis) -> list[Block]:
    found = [_of_condition(analysis, condition) for condition in analysis.campaign.conditions()]
    return [Sentences(found)] if found else []


def _notices(analysis: Analysis) -> list[Block]:
    found = [Notice("warning", say("Not done: {problem}", problem=problem)) for problem in analysis.problems]
    if analysis.fleet is None and analysis.campaign.fleet is None and analysis.sources:
        text = say("No fleet file: whose order a line is, is not known, so no source is named and no verdict is given.")
        found.insert(0, Notice("info", text))
    return list(found)


def _of_condition(analysis: Analysis, condition: str) -> str:
    words = condition_words(analysis, condition)
    level = _level_words(analysis, condition)
    runs = [run for run in analysis.runs if run.run.condition == condition and run.measurement is not None]
    stated = "" if runs else _stated_levels(analysis, condition)
    if stated or not level:
        return f"{words}: {stated or 'no noise level, so no noise lines and no dominant source'}."
    if runs and all(run.measurement is not None and not run.measurement.steady for run in runs):
        orders = [loudest_order_words(analysis, run, receivers(analysis.runs)) for run in runs]
        known = "; ".join(dict.fromkeys(text for text in orders if text))
        said = say(
            "{words}: {level}; a run-up, so no noise lines and no dominant source{known}.",
            words=words,
            level=level,
            known=f"; {known}" if known else "",
        )
        return _with(said, agreement_words(analysis, condition))
    verdict = next((v for v in analysis.dominance if v.condition == condition), None)
    held = [source for source in analysis.sources if source.line.condition == condition]
    lines = _strongest_words(held) or (_no_lines_words(analysis, condition) if runs else "")
    if analysis.fleet is None or verdict is None or not held:
        parts = [f"{words}: {level}", lines]
        if verdict is not None and verdict.line_fraction is not None and held:
            parts.append(say("the lines carry {percent} of the sound energy", percent=_percent(verdict.line_fraction)))
        if verdict is not None:
            parts.append(say("dominant source {dominant}", dominant=verdict.dominant))
        return _with(f"{'; '.join(part for part in parts if part)}.", agreement_words(analysis, condition))
    said = f"{words}: {_verdict_words(verdict)}{_fraction_words(analysis, verdict)}."
    against = _against(analysis, verdict, held)
    if against:
        said += (
            say(" Against it: {against}.", against="; ".join(against))
            if verdict.dominant != "undecided"
            else f" {_listed(against)}"
        )
    by_hand = _by_hand(analysis, condition, held)
    if by_hand:
        said += say(" Set by the engineer: {by_hand}.", by_hand="; ".join(by_hand))
    said = _with(said, agreement_words(analysis, condition))
    return say("{said} Level {level}; {lines}.", said=said, level=level, lines=lines)


def _with(said: str, more: str) -> str:
    return f"{said} {more}" if more else said


def _listed(parts: list[str]) -> str:
    text = "; ".join(parts)
    return f"{text[:1].upper()}{text[1:]}."


def _verdict_words(verdict: Dominance) -> str:
    sure = probability_words(verdict.confidence)
    if verdict.dominant != "undecided":
        share = verdict.shares.get(verdict.dominant)
        excitation = say(EXCITATION_WORDS.get(verdict.dominant_excitation or "", ""))
        has = [say("{percent} of their energy", percent=_percent(share))] if share is not None else []
        has += [say("mostly {excitation}", excitation=excitation)] if excitation else []
        words = say(
            "the {dominant} dominates the noise lines with probability {sure}",
            dominant=verdict.dominant,
            sure=sure.replace("> ", "above "),
        )
        return f"{words} ({', '.join(has)})" if has else words
    if verdict.leading is None:
        return say("undecided, for no line could be given to a source")
    if verdict.leading == "unassigned":
        return say(
            "undecided, for most of the lines' energy belongs to no known source (probability {sure})", sure=sure
        )
    return say(
        "undecided: the {leading} leads, but with probability {sure} only ({decided:g} is asked for)",
        leading=verdict.leading,
        sure=sure,
        decided=DECIDED,
    )


def _fraction_words(analysis: Analysis, verdict: Dominance) -> str:
    if verdict.line_fraction is None:
        return ""
    part = _percent(verdict.line_fraction)
    if verdict.line_fraction < MOST_OF_THE_SOUND:
        left_out = any(exclude.condition == verdict.condition for exclude in analysis.campaign.excludes)
        of_condition = [run for run in tested_runs(analysis) if run.run.condition == verdict.condition]
        moving = any(speed_words(run) == UNKNOWN_SPEED for run in of_condition)
        rest = "broadband" + (say(", or moves with a speed that is not known") if moving else "")
        rest += say(" or left out") if left_out else ""
        but = say("; and") if verdict.dominant == "undecided" else say(", but")
        return say(
            "{but} the lines are only {part} of the sound energy: the rest is {rest}", but=but, part=part, rest=rest
        )
    return say("; the lines are {part} of the sound energy", part=part)


def _against(analysis: Analysis, verdict: Dominance, held: list[SourceLine]) -> list[str]:
    """What speaks against the verdict, or qualifies it."""
    found = []
    for name, share in verdict.shares.items():
        if name != verdict.dominant and share >= WORTH_SAYING:
            of_source = say("belongs to the {name}", name=name)
            found.append(
                say(
                    "{percent} of the lines' energy {name}",
                    percent=_percent(share),
                    name=say(SHARE_WORDS.get(name, of_source)),
                )
            )
    lines = distinct_lines(held)
    for radiator in dict.fromkeys(source.radiator for source in lines if source.conflict):
        conflicts = sorted(
            (source for source in lines if source.conflict and source.radiator == radiator),
            key=lambda source: source.line.frequency_hz,
        )
        named = joined([f"{_hz(source)} ({source.excitation_name})" for source in conflicts])
        order, shown = (say("order does"), "it") if len(conflicts) == 1 else (say("orders do"), "them")
        found.append(
            say(
                "conflict at {named}, whose {order} not belong to the {radiator}, though its sensors show {shown}",
                named=named,
                order=order,
                radiator=radiator,
                shown=shown,
            )
        )
    if lines and lines[0].excitation == "unknown":
        found.append(say("no known order explains the strongest line, {hz}", hz=_hz(lines[0])))
    if verdict.spread_db is not None and verdict.spread_db >= SPREAD_DB:
        found.append(
            say(
                "the level of the {n_runs} runs differs by up to {spread_db:.1f} dB",
                n_runs=verdict.n_runs,
                spread_db=verdict.spread_db,
            )
        )
    return found


def _by_hand(analysis: Analysis, condition: str, held: list[SourceLine]) -> list[str]:
    """What the engineer set over the data."""
    found = []
    overrides = [source for source in distinct_lines(held) if is_override(source)]
    if overrides:
        found.append(say("the source at {hz}", hz=joined([_hz(source) for source in overrides])))
    bands = [exclude.frequency_hz for exclude in analysis.campaign.excludes if exclude.condition == condition]
    if bands:
        found.append(
            say(
                "{low} left out", low=joined([say("{low:g} to {high:g} Hz", low=low, high=high) for low, high in bands])
            )
        )
    return found


def _hz(source: SourceLine) -> str:
    return f"{source.line.frequency_hz:.0f} Hz"


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %" if share >= 0.01 else say("under 1 %")


def _strongest_words(held: list[SourceLine]) -> str:
    named = [
        f"{_hz(source)} ({level_db(math.sqrt(source.line.mean_square), 'sound_pressure'):.1f} dB)"
        for source in distinct_lines(held)[:NAMED_LINES]
    ]
    return say("strongest noise lines {named}", named=", ".join(named)) if named else ""


def verdicts_answer(analysis: Analysis) -> list[Block]:
    """Return the verdicts in a table and as bars; nothing without a fleet, or where no condition has lines."""
    if analysis.fleet is None:
        return []
    judged = [verdict for verdict in analysis.dominance if verdict.shares]
    if not judged:
        return []
    blocks: list[Block] = [_table(analysis)]
    method = say(
        "Shares are of the unweighted sound energy in the lines, averaged over the receivers, "
        "and not of the whole sound: the column beside them says how much of it the lines are. P "
        "is the probability that the leading source is the largest when segments are resampled "
        "and cross-talk is in doubt; below {decided:g} the verdict is undecided.",
        decided=DECIDED,
    )
    if all(verdict.n_runs <= 1 for verdict in judged):
        method += say(" Every condition rests on a single run, so how well it repeats is not known.")
    blocks.append(Paragraph(method))
    categories = [f"{verdict.condition}: {verdict.dominant}" for verdict in judged]
    bars = [
        Bars(categories, np.array([100.0 * verdict.shares.get(name, 0.0) for verdict in judged]), name, color=slot)
        for name, slot in OWNER_SLOTS.items()
        if any(verdict.shares.get(name, 0.0) > 0.0 for verdict in judged)
    ]
    figure = Figure(
        "source-shares",
        say("Whose the energy of the noise lines is"),
        say("Below each bar the condition and its verdict. The bars fill up to 100 % of the lines, not of the sound."),
        Axis(say("Condition and verdict")),
        Axis(say("Share of the lines' energy"), "%", limits=(0.0, 100.0)),
        bars,
        height=320,
        bar_mode="stack",
    )
    return [*blocks, FigureBlock(figure, analysis.campaign.origin)]


def _table(analysis: Analysis) -> Table:
    speeds = analysis.tables["dominance"].set_index("condition")["train_speed_km_h"]
    repeated = any(verdict.n_runs > 1 for verdict in analysis.dominance)
    digits = 0 if all(float(speed).is_integer() for speed in speeds.dropna()) else 1
    columns = [
        Column("condition", say("Condition")),
        Column("train_speed_km_h", say("Speed"), "km/h", digits, "number"),
        Column("dominant", say("Verdict"), kind="verdict"),
        Column("confidence", "P", align="right"),
        Column("motor_percent", say("Motor"), "%", 0, "number"),
        Column("gearbox_percent", say("Gearbox"), "%", 0, "number"),
        Column("ambiguous_percent", say("Either"), "ambiguous", 0, "number"),
        Column("unassigned_percent", say("Neither"), "unassigned", 0, "number"),
        Column("line_percent", say("Lines"), say("% of sound"), 0, "number"),
        Column("dominant_excitation", say("Excitation")),
        *([Column("n_runs", say("Runs"), "", 0, "number")] if repeated else []),
        *([Column("spread_db", say("Spread"), "dB", 1, "number")] if repeated else []),
    ]
    rows = []
    for verdict in analysis.dominance:
        cells: dict[str, Cell] = {
            f"{name}_percent": None if not verdict.shares else 100.0 * verdict.shares.get(name, 0.0)
            for name in OWNER_SLOTS
        }
        cells |= {
            "condition": verdict.condition,
            "train_speed_km_h": speeds.get(verdict.condition),
            "dominant": verdict.dominant,
            "confidence": _probability_cell(verdict),
            "line_percent": None if verdict.line_fraction is None else 100.0 * verdict.line_fraction,
            "dominant_excitation": verdict.dominant_excitation or "",
            "n_runs": verdict.n_runs,
            "spread_db": verdict.spread_db,
        }
        rows.append([cells[column.key] for column in columns])
    return Table(
        "dominance",
        say("Dominance by speed: shares of the lines' energy in %, and of the lines in all sound"),
        columns,
        rows,
        origin=analysis.campaign.origin,
    )


def _probability_cell(verdict: Dominance) -> str:
    """The probability, and of what it is where that is not the verdict."""
    leading = f" {verdict.leading}" if verdict.dominant == "undecided" and verdict.leading is not None else ""
    return probability_words(verdict.confidence) + leading


def _stated_levels(analysis: Analysis, condition: str) -> str:
    """Levels that the campaign states, for a condition without recordings."""
    words = []
    for level in analysis.campaign.levels:
        if level.condition == condition:
            unit = "dB" if level.weighting == "Z" else f"dB({level.weighting})"
            where = "" if level.distance_m is None else say(" at {distance_m:g} m", distance_m=level.distance_m)
            words.append(f"{level.level_db:.1f} {unit} re 20 µPa{where} ({level.origin or 'origin not stated'})")
    return (
        say("{words}, stated and not recorded, so no lines and no dominant source", words=joined(words))
        if words
        else ""
    )


def _no_lines_words(analysis: Analysis, condition: str) -> str:
    excluded = any(exclude.condition == condition for exclude in analysis.campaign.excludes)
    return say("no noise lines but those that the campaign excludes") if excluded else say("no noise lines")


def _level_words(analysis: Analysis, condition: str) -> str:
    microphones = receivers(analysis.runs)
    table = analysis.tables["levels"]
    held = table[(table["condition"] == condition) & (table["quantity"] == "sound_pressure")]
    measured = held[held["channel"].isin(microphones)] if microphones else held
    chosen = measured if len(measured) else held
    level = energy_mean_db(chosen["level_db"].dropna())
    weighted = energy_mean_db(chosen["laeq_db"].dropna())
    words = [f"{level:.1f} dB"] if level is not None else []
    if weighted is not None:
        words.append(f"{weighted:.1f} dB(A)")
    if not words:
        return ""
    used = list(dict.fromkeys(chosen.loc[chosen["level_db"].notna() | chosen["laeq_db"].notna(), "channel"]))
    where = (
        say("energy mean of {n_used} microphones", n_used=len(used))
        if len(used) > 1
        else say("at {used}", used=used[0])
    )
    by_standard = railway_words(analysis, condition)
    where += say(", over the whole records; {by_standard}", by_standard=by_standard) if by_standard else ""
    return f"{' or '.join(words)} re 20 µPa, {where}"

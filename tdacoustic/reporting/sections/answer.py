"""The answer first: who dominates at each speed, how sure that is, and what speaks against it."""

from __future__ import annotations

import math

import pandas as pd

from tdacoustic.attribution import Dominance, SourceLine
from tdacoustic.attribution.dominance import DECIDED
from tdacoustic.measured.levels import energy_mean_db
from tdacoustic.measured.runs import receivers
from tdacoustic.reporting.document import Block, Notice, Sentences
from tdacoustic.reporting.language import mark, say, say_count
from tdacoustic.reporting.sections.agreement import agreement_words
from tdacoustic.reporting.sections.order_sentences import loudest_order_words
from tdacoustic.reporting.sections.railway import railway_words
from tdacoustic.reporting.sections.verdicts import verdicts_answer
from tdacoustic.reporting.sections.words import (
    UNKNOWN_SPEED,
    condition_words,
    distinct_lines,
    is_override,
    joined,
    probability_words,
    source_word,
    speed_words,
    tested_runs,
)
from tdacoustic.results import Analysis
from tdacoustic.units import level_db

__all__ = ["answer", "conditions_answer", "level_of_condition"]

NAMED_LINES = 3
MOST_OF_THE_SOUND = 0.5
"""Line fraction below which the lines do not speak for the sound as a whole [assumed]."""
WORTH_SAYING = 0.05
"""Share of the lines' energy from which it is named against the verdict [assumed]."""
SPREAD_DB = 1.0
"""Spread of a level over runs from which it is named; the table always has it [assumed]."""

EXCITATION_WORDS = {
    "mesh": mark("mostly at mesh orders"),
    "inverter": mark("mostly at inverter orders"),
    "motor": mark("mostly at orders of the motor shaft"),
    "wheelset": mark("mostly at orders of the wheelset"),
    "unknown": mark("mostly at no known order"),
}

SHARE_WORDS = {
    "ambiguous": mark("{percent} of the lines' energy belongs to either, motor or gearbox"),
    "unassigned": mark("{percent} of the lines' energy belongs to no known source"),
}
SHARE_OF_SOURCE = mark("{percent} of the lines' energy belongs to the {source}")


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
        nothing = say("no noise level, so no noise lines and no dominant source")
        return f"{words}: {stated or nothing}."
    agreement = agreement_words(analysis, condition)
    if runs and all(run.measurement is not None and not run.measurement.steady for run in runs):
        orders = [loudest_order_words(analysis, run, receivers(analysis.runs)) for run in runs]
        known = dict.fromkeys(text for text in orders if text)
        parts = [level, say("the speed changes, so no noise lines and no dominant source"), *known]
        return _sentences_of(f"{words}: {'; '.join(parts)}.", agreement)
    verdict = next((v for v in analysis.dominance if v.condition == condition), None)
    held = [source for source in analysis.sources if source.line.condition == condition]
    lines = _strongest_words(held) or (_no_lines_words(analysis, condition) if runs else "")
    if analysis.fleet is None or verdict is None or not held:
        parts = [f"{words}: {level}", lines]
        if verdict is not None and verdict.line_fraction is not None and held:
            parts.append(say("the lines carry {percent} of the sound energy", percent=_percent(verdict.line_fraction)))
        if verdict is not None:
            parts.append(say("dominant source {source}", source=source_word(verdict.dominant)))
        return _sentences_of(f"{'; '.join(part for part in parts if part)}.", agreement)
    return _sentences_of(
        f"{words}: {_judged_words(analysis, verdict)}.",
        _against_words(verdict, held),
        _by_hand_words(analysis, condition, held),
        agreement,
        say("Level {level}; {lines}.", level=level, lines=lines),
    )


def _sentences_of(*sentences: str) -> str:
    return " ".join(sentence for sentence in sentences if sentence)


def _judged_words(analysis: Analysis, verdict: Dominance) -> str:
    """The verdict, and how much of the sound it speaks for."""
    words = _verdict_words(verdict)
    if verdict.line_fraction is None:
        return words
    percent = _percent(verdict.line_fraction)
    if verdict.line_fraction >= MOST_OF_THE_SOUND:
        return say("{verdict}; the lines are {percent} of the sound energy", verdict=words, percent=percent)
    rest = _rest_words(analysis, verdict.condition)
    if verdict.dominant == "undecided":
        return say(
            "{verdict}; and the lines are only {percent} of the sound energy: {rest}",
            verdict=words,
            percent=percent,
            rest=rest,
        )
    return say(
        "{verdict}, but the lines are only {percent} of the sound energy: {rest}",
        verdict=words,
        percent=percent,
        rest=rest,
    )


def _verdict_words(verdict: Dominance) -> str:
    sure = probability_words(verdict.confidence)
    if verdict.dominant != "undecided":
        return _dominant_words(verdict, sure)
    if verdict.leading is None:
        return say("undecided, for no line could be given to a source")
    if verdict.leading == "unassigned":
        return say(
            "undecided, for most of the lines' energy belongs to no known source (probability {probability})",
            probability=sure,
        )
    return say(
        "undecided: the {source} leads, but with probability {probability} only ({decided:g} is asked for)",
        source=source_word(verdict.leading),
        probability=sure,
        decided=DECIDED,
    )


def _dominant_words(verdict: Dominance, sure: str) -> str:
    source = source_word(verdict.dominant)
    words = (
        say(
            "the {source} dominates the noise lines with probability above {probability}",
            source=source,
            probability=sure.removeprefix("> "),
        )
        if sure.startswith("> ")
        else say(
            "the {source} dominates the noise lines with probability {probability}", source=source, probability=sure
        )
    )
    share = verdict.shares.get(verdict.dominant)
    excitation = EXCITATION_WORDS.get(verdict.dominant_excitation or "")
    has = [say("{percent} of their energy", percent=_percent(share))] if share is not None else []
    has += [say(excitation)] if excitation else []
    return f"{words} ({', '.join(has)})" if has else words


def _rest_words(analysis: Analysis, condition: str) -> str:
    """What the sound is that the lines are not."""
    left_out = any(exclude.condition == condition for exclude in analysis.campaign.excludes)
    of_condition = [run for run in tested_runs(analysis) if run.run.condition == condition]
    if any(speed_words(run) == say(UNKNOWN_SPEED) for run in of_condition):
        return (
            say("the rest is broadband, or moves with a speed that is not known or left out")
            if left_out
            else say("the rest is broadband, or moves with a speed that is not known")
        )
    return say("the rest is broadband or left out") if left_out else say("the rest is broadband")


def _against_words(verdict: Dominance, held: list[SourceLine]) -> str:
    against = "; ".join(_against(verdict, held))
    if not against:
        return ""
    if verdict.dominant == "undecided":
        return f"{against[:1].upper()}{against[1:]}."
    return say("Against it: {against}.", against=against)


def _against(verdict: Dominance, held: list[SourceLine]) -> list[str]:
    """What speaks against the verdict, or qualifies it."""
    found = [
        say(SHARE_WORDS.get(name, SHARE_OF_SOURCE), percent=_percent(share), source=source_word(name))
        for name, share in verdict.shares.items()
        if name != verdict.dominant and share >= WORTH_SAYING
    ]
    lines = distinct_lines(held)
    for radiator in dict.fromkeys(source.radiator for source in lines if source.conflict):
        conflicts = sorted(
            (source for source in lines if source.conflict and source.radiator == radiator),
            key=lambda source: source.line.frequency_hz,
        )
        found.append(
            say_count(
                "conflict at {lines}, whose order does not belong to the {source}, though its sensors show it",
                "conflict at {lines}, whose orders do not belong to the {source}, though its sensors show them",
                len(conflicts),
                lines=joined([f"{_hz(source)} ({source.excitation_name})" for source in conflicts]),
                source=source_word(str(radiator)),
            )
        )
    if lines and lines[0].excitation == "unknown":
        found.append(say("no known order explains the strongest line, {frequency}", frequency=_hz(lines[0])))
    if verdict.spread_db is not None and verdict.spread_db >= SPREAD_DB:
        found.append(
            say(
                "the level of the {count} runs differs by up to {spread:.1f} dB",
                count=verdict.n_runs,
                spread=verdict.spread_db,
            )
        )
    return found


def _by_hand_words(analysis: Analysis, condition: str, held: list[SourceLine]) -> str:
    """What the engineer set over the data."""
    found = []
    overrides = [source for source in distinct_lines(held) if is_override(source)]
    if overrides:
        found.append(say("the source at {frequencies}", frequencies=joined([_hz(source) for source in overrides])))
    bands = [exclude.frequency_hz for exclude in analysis.campaign.excludes if exclude.condition == condition]
    if bands:
        words = joined([say("{low:g} to {high:g} Hz", low=low, high=high) for low, high in bands])
        found.append(say("{bands} left out", bands=words))
    return say("Set by the engineer: {settings}.", settings="; ".join(found)) if found else ""


def _hz(source: SourceLine) -> str:
    return f"{source.line.frequency_hz:.0f} Hz"


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %" if share >= 0.01 else say("under 1 %")


def _strongest_words(held: list[SourceLine]) -> str:
    named = [
        f"{_hz(source)} ({level_db(math.sqrt(source.line.mean_square), 'sound_pressure'):.1f} dB)"
        for source in distinct_lines(held)[:NAMED_LINES]
    ]
    return say("strongest noise lines {lines}", lines=", ".join(named)) if named else ""


def _stated_levels(analysis: Analysis, condition: str) -> str:
    """Levels that the campaign states, for a condition without recordings."""
    words = []
    for level in analysis.campaign.levels:
        if level.condition == condition:
            unit = "dB" if level.weighting == "Z" else f"dB({level.weighting})"
            value = f"{level.level_db:.1f} {unit} re 20 µPa"
            if level.distance_m is not None:
                value = say("{level} at {distance:g} m", level=value, distance=level.distance_m)
            origin = level.origin or say("origin not stated")
            words.append(f"{value} ({origin})")
    if not words:
        return ""
    return say("{levels}, stated and not recorded, so no lines and no dominant source", levels=joined(words))


def _no_lines_words(analysis: Analysis, condition: str) -> str:
    excluded = any(exclude.condition == condition for exclude in analysis.campaign.excludes)
    return say("no noise lines but those that the campaign excludes") if excluded else say("no noise lines")


def level_of_condition(analysis: Analysis, condition: str) -> str:
    """Return the level of a condition, the energy mean over its receivers, with its reference; empty without one."""
    value, _ = _level_of(analysis, condition)
    return f"{value} re 20 µPa" if value else ""


def _level_of(analysis: Analysis, condition: str) -> tuple[str, pd.DataFrame]:
    """The level in words, and the rows that it is the mean of."""
    microphones = receivers(analysis.runs)
    table = analysis.tables["levels"]
    held = table[(table["condition"] == condition) & (table["quantity"] == "sound_pressure")]
    measured = held[held["channel"].isin(microphones)] if microphones else held
    chosen = measured if len(measured) else held
    level = energy_mean_db(chosen["level_db"].dropna())
    weighted = energy_mean_db(chosen["laeq_db"].dropna())
    if level is not None and weighted is not None:
        value = say("{level:.1f} dB or {weighted:.1f} dB(A)", level=level, weighted=weighted)
    elif level is not None:
        value = f"{level:.1f} dB"
    elif weighted is not None:
        value = f"{weighted:.1f} dB(A)"
    else:
        value = ""
    return value, chosen


def _level_words(analysis: Analysis, condition: str) -> str:
    value, chosen = _level_of(analysis, condition)
    if not value:
        return ""
    used = list(dict.fromkeys(chosen.loc[chosen["level_db"].notna() | chosen["laeq_db"].notna(), "channel"]))
    parts = [f"{value} re 20 µPa"]
    parts.append(
        say("energy mean of {count} microphones", count=len(used))
        if len(used) > 1
        else say("at {channel}", channel=used[0])
    )
    by_standard = railway_words(analysis, condition)
    if by_standard:
        parts.append(say("over the whole records; {by_standard}", by_standard=by_standard))
    return ", ".join(parts)

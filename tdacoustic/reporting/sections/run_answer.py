"""The answer of the main job first: who dominates, how the model fits, what it predicts, and what speaks against it."""

from __future__ import annotations

import math

from tdacoustic.attribution import Dominance
from tdacoustic.drive import GearState
from tdacoustic.reporting.document import Block, Notice, Section, Sentences
from tdacoustic.reporting.language import say, say_count
from tdacoustic.reporting.sections.answer import conditions_answer, level_of_condition
from tdacoustic.reporting.sections.calibration import calibration_answer
from tdacoustic.reporting.sections.gear_answer import asked_lines
from tdacoustic.reporting.sections.gear_words import (
    by_speed,
    conditions_words,
    hertz,
    largest_line,
    named_conditions,
    newtons,
    range_words,
    sentence,
    state_words,
)
from tdacoustic.reporting.sections.parameters import key_words, quantity_of
from tdacoustic.reporting.sections.sound_paths import SoundPath, heard_paths, is_added
from tdacoustic.reporting.sections.verdicts import verdicts_answer
from tdacoustic.reporting.sections.words import condition_words, pretty_signs, probability_words, source_word
from tdacoustic.results import Analysis, CampaignResult, FleetPrediction

__all__ = ["calibration_line", "model_lines", "prediction_line", "run_answer"]

MOST_LEVELS = 8
"""Conditions whose levels are all named in a sentence; of more the slowest and the fastest are."""


def run_answer(result: CampaignResult) -> list[Block]:
    """Return the summary: all in a few lines, then sources, fit and prediction with what speaks against them."""
    lines = *_dominance_lines(result), calibration_line(result), prediction_line(result), *model_lines(result)
    short = [line for line in lines if line]
    blocks: list[Block] = [Sentences(short)] if short else []
    blocks.append(Section("answer-sources", say("Which source dominates"), conditions_answer(result.analysis)))
    if result.calibration is not None:
        blocks.append(Section("answer-fit", say("How the model fits"), calibration_answer(result.calibration)))
    not_done = [Notice("warning", sentence(text)) for text in result.not_done]
    if result.prediction is not None:
        said: list[Block] = [*not_done, *_new_doubts(result)]
        words = _predicted_words(result.prediction)
        said = [Sentences(words), *said] if words else said
        blocks.append(Section("answer-prediction", say("What the model predicts"), said))
    elif not_done:
        blocks.append(Section("answer-not-done", say("What is not done"), not_done))
    verdicts = verdicts_answer(result.analysis)
    return [*blocks, Section("answer-verdicts", say("The verdicts side by side"), verdicts)] if verdicts else blocks


def calibration_line(result: CampaignResult) -> str:
    """Return the calibration in a line of text; empty without one."""
    if result.calibration is None:
        return ""
    found = result.calibration.calibration
    values = [
        say(
            "{parameter} {fitted} (it was {initial:.4g})",
            parameter=key_words(p.key, found.fleet),
            initial=p.initial,
            fitted=quantity_of(p.key, p.value, p.stderr),
        )
        for p in found.parameters
    ]
    errors = [(level.before_db - level.datum.level_db, level.error_db) for level in found.levels]
    before, after = (math.hypot(*side) / math.sqrt(len(errors)) for side in zip(*errors, strict=True))
    misfit = say("levels off by {before:.1f} dB rms before, {after:.1f} dB after", before=before, after=after)
    doubts = say_count("{count} doubt", "{count} doubts", len(found.doubts))
    return pretty_signs(
        say(
            "Calibration: {parameters}; {misfit}; {doubts}.", parameters=", ".join(values), misfit=misfit, doubts=doubts
        )
    )


def prediction_line(result: CampaignResult) -> str:
    """Return the prediction in a line of text; empty without one."""
    if result.prediction is None:
        return ""
    levels = _level_words(result.prediction) or say("no sound")
    if result.calibration is None:
        return say("Prediction with the fleet as it is: {levels}.", levels=levels)
    return say("Prediction with the calibrated fleet: {levels}.", levels=levels)


def model_lines(result: CampaignResult) -> list[str]:
    """Return the lines of `asked_lines` of the prediction."""
    return [] if result.prediction is None else asked_lines(result.prediction)


def _dominance_lines(result: CampaignResult) -> list[str]:
    """Who dominates where, a sentence a condition, in order of speed; of many conditions one for all."""
    analysis = result.analysis
    verdicts = [verdict for verdict in analysis.dominance if verdict.shares]
    if not 0 < len(verdicts) <= MOST_LEVELS:
        return [line] if (line := _dominance_line(result)) else []
    return [_verdict_line(analysis, verdict) for verdict in verdicts]


def _verdict_line(analysis: Analysis, verdict: Dominance) -> str:
    named = {
        "condition": condition_words(analysis, verdict.condition),
        "source": source_word(verdict.leading or verdict.dominant),
        "probability": probability_words(verdict.confidence).replace(" ", "\u00a0"),
        "percent": f"{100.0 * (verdict.line_fraction or 0.0):.0f}",
    }
    if verdict.dominant == "undecided" and verdict.leading is None:
        words = say(
            "{condition}: undecided, for none of the noise lines, which are {percent} % of the sound energy, could be "
            "given to a source",
            **named,
        )
    elif verdict.dominant == "undecided" and verdict.leading == "unassigned":
        words = say(
            "{condition}: undecided, for most of the energy of the noise lines, which are {percent} % of the sound "
            "energy, belongs to no known source (P\u00a0{probability})",
            **named,
        )
    elif verdict.dominant == "undecided":
        words = say(
            "{condition}: undecided, the {source} leads the noise lines (P\u00a0{probability}), which are {percent} % "
            "of the sound energy",
            **named,
        )
    else:
        words = say(
            "{condition}: the {source} dominates the noise lines (P\u00a0{probability}), which are {percent} % of the "
            "sound energy",
            **named,
        )
    return "; ".join(part for part in (words, level_of_condition(analysis, verdict.condition)) if part) + "."


def _dominance_line(result: CampaignResult) -> str:
    """Who dominates where; empty where no source is named."""
    named: dict[str, list[str]] = {}
    for verdict in result.analysis.dominance:
        named.setdefault(verdict.dominant, []).append(verdict.condition)
    undecided = named.pop("undecided", [])
    if not named:
        return ""
    parts = [
        say(
            "the {source} dominates the noise lines in {conditions}",
            source=source_word(source),
            conditions=named_conditions(names),
        )
        for source, names in named.items()
    ]
    parts += [say("undecided in {conditions}", conditions=named_conditions(undecided))] if undecided else []
    of_sound = [100.0 * v.line_fraction for v in result.analysis.dominance if v.line_fraction is not None]
    if of_sound:
        percent = range_words(f"{min(of_sound):.0f}", f"{max(of_sound):.0f}")
        parts.append(say("these lines are {percent} % of the sound energy", percent=percent))
    return sentence("; ".join(parts))


def _predicted_words(found: FleetPrediction) -> list[str]:
    """The prediction in a few sentences, without its levels."""
    forces = [
        (
            line[2],
            say(
                "{force} at {frequency} in {condition}, {gear}, {direction}",
                force=newtons(line[2]),
                frequency=hertz(line[3]),
                condition=state_words(state),
                gear=line[0],
                direction=line[1],
            ),
        )
        for state in found.prediction.conditions
        if (line := largest_line(state)) is not None
    ]
    words = [louder] if (louder := _louder_words(found)) else []
    return [*words, say("The largest bearing force is {force}.", force=max(forces)[1])] if forces else words


def _total_db(found: FleetPrediction, state: GearState, path: str = "total") -> float | None:
    sound = found.prediction.sound_of(state.condition.name)
    return None if sound is None else sound.level_db(found.prediction.surface, path)


def _level_words(found: FleetPrediction) -> str:
    """Levels on the surface by speed; empty where nothing sounds."""
    levels = [
        say(
            "{level:.1f} dB in condition {condition} ({speed:.4g} km/h)",
            level=level,
            condition=state.condition.name,
            speed=state.condition.train_speed_km_h,
        )
        for state in by_speed(found.prediction.conditions)
        if (level := _total_db(found, state)) is not None
    ]
    if not levels:
        return ""
    shown = (
        ", ".join(levels)
        if len(levels) <= MOST_LEVELS
        else say("{lowest} to {highest}", lowest=levels[0], highest=levels[-1])
    )
    return say("at {surface} (re 20 µPa) {levels}", surface=found.prediction.surface, levels=shown)


def _louder_words(found: FleetPrediction) -> str:
    """Which of the paths of the total is the loudest, by condition; empty of fewer than two paths."""
    added = [path for path in heard_paths(found.prediction.sound) if is_added(found.fleet, path)]
    if len(added) < 2:
        return ""
    held: dict[SoundPath, list[GearState]] = {path: [] for path in added}
    for state in by_speed(found.prediction.conditions):
        levels = {path: level for path in added if (level := _total_db(found, state, path.key)) is not None}
        if levels:
            held[max(levels, key=levels.__getitem__)].append(state)
    parts = [
        say("{part} in {conditions}", part=say(path.phrase), conditions=conditions_words(states))
        for path, states in held.items()
        if states
    ]
    if len(added) == 2:
        return say("The louder part of the total is {parts}.", parts=", ".join(parts))
    return say("The loudest part of the total is {parts}.", parts=", ".join(parts))


def _new_doubts(result: CampaignResult) -> list[Notice]:
    """Doubts of the prediction that the calibration has not said."""
    said = () if result.calibration is None else result.calibration.calibration.doubts
    found = () if result.prediction is None else result.prediction.prediction.doubts
    return [Notice("warning", sentence(doubt)) for doubt in found if doubt not in said]

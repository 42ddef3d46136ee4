"""The answer of the main job first: who dominates, how the model fits, what it predicts, and what speaks against it."""

from __future__ import annotations

import math

from tdacoustic.drive import GearState
from tdacoustic.reporting.document import Block, Notice, Section, Sentences
from tdacoustic.reporting.language import say
from tdacoustic.reporting.sections.answer import conditions_answer, verdicts_answer
from tdacoustic.reporting.sections.calibration import calibration_answer
from tdacoustic.reporting.sections.gear_answer import asked_lines
from tdacoustic.reporting.sections.gear_words import (
    by_speed,
    conditions_words,
    hertz,
    largest_line,
    newtons,
    sentence,
    state_words,
)
from tdacoustic.reporting.sections.parameters import key_words, quantity_of
from tdacoustic.reporting.sections.sound_paths import SoundPath, heard_paths, is_added
from tdacoustic.reporting.sections.words import joined, pretty_signs
from tdacoustic.results import CampaignResult, FleetPrediction

__all__ = ["calibration_line", "model_lines", "prediction_line", "run_answer"]

MOST_LEVELS = 8
"""Conditions whose levels are all named in a sentence; of more the slowest and the fastest are."""


def run_answer(result: CampaignResult) -> list[Block]:
    """Return the summary: all in a few lines, then sources, fit and prediction with what speaks against them."""
    lines = _dominance_line(result), calibration_line(result), prediction_line(result), *model_lines(result)
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
            "{key} {initial:.4g} to {quantity_of}",
            key=key_words(p.key, found.fleet),
            initial=p.initial,
            quantity_of=quantity_of(p.key, p.value),
        )
        for p in found.parameters
    ]
    errors = [(level.before_db - level.datum.level_db, level.error_db) for level in found.levels]
    before, after = (math.hypot(*side) / math.sqrt(len(errors)) for side in zip(*errors, strict=True))
    misfit = say("levels off by {before:.1f} dB rms before, {after:.1f} dB after", before=before, after=after)
    doubts = say("{n_doubts} doubt{value}", n_doubts=len(found.doubts), value="s" if len(found.doubts) != 1 else "")
    return pretty_signs(
        say("Calibration: {values}; {misfit}; {doubts}.", values=", ".join(values), misfit=misfit, doubts=doubts)
    )


def prediction_line(result: CampaignResult) -> str:
    """Return the prediction in a line of text; empty without one."""
    if result.prediction is None:
        return ""
    levels = _level_words(result.prediction)
    return say("Prediction with {which}: {levels}.", which=_which(result), levels=levels or say("no sound"))


def model_lines(result: CampaignResult) -> list[str]:
    """Return the lines of `asked_lines` of the prediction."""
    return [] if result.prediction is None else asked_lines(result.prediction)


def _dominance_line(result: CampaignResult) -> str:
    """Who dominates where; empty where no source is named."""
    named: dict[str, list[str]] = {}
    for verdict in result.analysis.dominance:
        named.setdefault(verdict.dominant, []).append(verdict.condition)
    undecided = named.pop("undecided", [])
    if not named:
        return ""
    parts = [
        say("the {source} dominates the noise lines in {conditions}", source=source, conditions=_conditions(names))
        for source, names in named.items()
    ]
    parts += [say("undecided in {conditions}", conditions=_conditions(undecided))] if undecided else []
    of_sound = [100.0 * v.line_fraction for v in result.analysis.dominance if v.line_fraction is not None]
    ends = list(dict.fromkeys(f"{end:.0f}" for end in (min(of_sound), max(of_sound)))) if of_sound else []
    parts += [say("these lines are {ends} % of the sound energy", ends=" to ".join(ends))] if ends else []
    return sentence("; ".join(parts))


def _conditions(names: list[str]) -> str:
    return say("condition{value} {names}", value="s" if len(names) > 1 else "", names=joined(names))


def _predicted_words(found: FleetPrediction) -> list[str]:
    """The prediction in a few sentences, without its levels."""
    forces = [
        (
            line[2],
            say(
                "{newtons} at {hertz} in {state}, {line}, {line_2}",
                newtons=newtons(line[2]),
                hertz=hertz(line[3]),
                state=state_words(state),
                line=line[0],
                line_2=line[1],
            ),
        )
        for state in found.prediction.conditions
        if (line := largest_line(state)) is not None
    ]
    words = [louder] if (louder := _louder_words(found)) else []
    return [*words, say("The largest bearing force is {forces}.", forces=max(forces)[1])] if forces else words


def _which(result: CampaignResult) -> str:
    return say("the fleet as it is") if result.calibration is None else say("the calibrated fleet")


def _total_db(found: FleetPrediction, state: GearState, path: str = "total") -> float | None:
    sound = found.prediction.sound_of(state.condition.name)
    return None if sound is None else sound.level_db(found.prediction.surface, path)


def _level_words(found: FleetPrediction) -> str:
    """Levels on the surface by speed; empty where nothing sounds."""
    levels = [
        say(
            "{level:.1f} dB in condition {name} ({train_speed_km_h:.4g} km/h)",
            level=level,
            name=state.condition.name,
            train_speed_km_h=state.condition.train_speed_km_h,
        )
        for state in by_speed(found.prediction.conditions)
        if (level := _total_db(found, state)) is not None
    ]
    if not levels:
        return ""
    shown = (
        ", ".join(levels)
        if len(levels) <= MOST_LEVELS
        else say("{levels} to {levels_2}", levels=levels[0], levels_2=levels[-1])
    )
    return say("at {surface} {shown}", surface=found.prediction.surface, shown=shown)


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
        say("{phrase} in {conditions}", phrase=path.phrase, conditions=conditions_words(states))
        for path, states in held.items()
        if states
    ]
    return sentence(
        say(
            "the {value} part of the total is {parts}",
            value="louder" if len(added) == 2 else "loudest",
            parts=", ".join(parts),
        )
    )


def _new_doubts(result: CampaignResult) -> list[Notice]:
    """Doubts of the prediction that the calibration has not said."""
    said = () if result.calibration is None else result.calibration.calibration.doubts
    found = () if result.prediction is None else result.prediction.prediction.doubts
    return [Notice("warning", sentence(doubt)) for doubt in found if doubt not in said]

"""What changes of the drive do to its levels: a sentence a speed, what to begin with, and how sure that is."""

from __future__ import annotations

from tdacoustic.drive.what_if import WhatIfAnswer, WhatIfLevel
from tdacoustic.fleet import Fleet
from tdacoustic.reporting.document import Block, Details, FigureBlock, Notice, Paragraph, Section, Sentences
from tdacoustic.reporting.language import say
from tdacoustic.reporting.sections.gear_words import sentence
from tdacoustic.reporting.sections.what_if_doubts import interval_words, lines_words, open_words
from tdacoustic.reporting.sections.what_if_figures import what_if_figure, what_if_table
from tdacoustic.reporting.sections.what_if_words import (
    alone_words,
    cases_words,
    condition_words,
    effects,
    first_words,
    little_words,
)
from tdacoustic.results import FleetPrediction

__all__ = ["what_if_line", "what_if_of", "what_if_section"]


def what_if_of(result: FleetPrediction) -> Section | None:
    """Return the section of a prediction; None where nothing was asked."""
    return None if result.what_if is None else what_if_section(result.what_if, result.fleet)


def what_if_section(answer: WhatIfAnswer, fleet: Fleet) -> Section | None:
    """Return the section on what changes of the drive do; None where it is silent throughout.

    Parameters
    ----------
    answer : WhatIfAnswer
    fleet : Fleet
        For its words.
    """
    conditions = _conditions(answer)
    if not answer.paths or not conditions:
        return None
    blocks: list[Block] = [Paragraph(cases_words(answer, fleet)), Paragraph(lines_words(answer))]
    blocks.append(Sentences([condition_words(answer, levels) for levels in conditions]))
    over = [text for text in (first_words(answer, conditions), *little_words(answer, conditions)) if text]
    blocks += [Sentences(over)] if over else []
    blocks.append(Paragraph(interval_words(answer, fleet)))
    blocks += [Notice("warning", text) for text in open_words(answer, fleet)]
    figure = what_if_figure(answer, conditions)
    blocks += [] if figure is None else [FigureBlock(figure, "calculated")]
    near = [level for levels in conditions for level in levels]
    blocks.append(
        what_if_table(answer, "what-if-surface", say("Changes at {surface}, unweighted", surface=answer.surface), near)
    )
    all_receivers = say("All receivers, unweighted and A-weighted")
    blocks.append(Details(all_receivers, [what_if_table(answer, "what-if", all_receivers, answer.levels)]))
    return Section("what-if", say("What it brings to quieten a source"), blocks)


def what_if_line(answer: WhatIfAnswer | None) -> str:
    """Return the slowest and the fastest speed of the answer in a line of text, and what it leaves out; or nothing."""
    conditions = [] if answer is None else _conditions(answer)
    if answer is None or not conditions or not answer.paths:
        return ""
    ends = conditions[:1] if len(conditions) == 1 else [conditions[0], conditions[-1]]
    parts = [
        say(
            "at {speed:.4g} km/h {effects}",
            speed=levels[0].train_speed_km_h,
            effects=alone_words(answer, levels) or "; ".join(effects(answer, levels, with_off=False)),
        )
        for levels in ends
    ]
    said = " ".join([f"{parts[0]}.", *(sentence(part) for part in parts[1:])])
    asked = say("What if (the model's level at {surface}): {effects}", surface=answer.surface, effects=said)
    return f"{asked} {lines_words(answer)}"


def _conditions(answer: WhatIfAnswer) -> list[list[WhatIfLevel]]:
    """Unweighted levels at the surface, those of each condition together, by speed."""
    found: dict[str, list[WhatIfLevel]] = {}
    for level in answer.levels:
        if (level.receiver, level.weighting) == (answer.surface, "Z") and level.before_db is not None:
            found.setdefault(level.condition, []).append(level)
    return sorted(found.values(), key=lambda levels: levels[0].train_speed_km_h)

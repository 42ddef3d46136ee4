"""What changes of the drive do to its levels: a sentence a speed, what to begin with, and how sure that is."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np

from tdacoustic.drive.what_if import STEPS_DB, WhatIfAnswer, WhatIfLevel, most_off_db, off_name, step_name
from tdacoustic.fleet import Fleet, WhatIf
from tdacoustic.reporting.document import (
    Block,
    Cell,
    Column,
    Details,
    FigureBlock,
    Notice,
    Paragraph,
    Section,
    Sentences,
    Table,
)
from tdacoustic.reporting.figure import Axis, Bars, Element, Figure, Markers
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.gear_words import sentence
from tdacoustic.reporting.sections.parameters import keyed_words
from tdacoustic.reporting.sections.words import joined, pretty_signs
from tdacoustic.results import FleetPrediction
from tdacoustic.studies.words import unit_of

__all__ = ["what_if_line", "what_if_of", "what_if_section"]

SOURCES: Final = {"motor": mark("the motor"), "mesh": mark("the meshing noise"), "structure": mark("the structure")}
SLOTS: Final = {"motor": 0, "mesh": 1, "structure": 2}

MOST_NAMED: Final = 4
MOST_DRAWN: Final = 6
"""Cases of the fleet that a sentence names, and that the figure shows; the table has all."""

LITTLE_DB: Final = 1.0
"""What a source left out takes off, below which others come first [assumed]."""

SMALLEST_DB: Final = 0.05
"""Changes that are none at the decimals shown."""

ALONE: Final = mark("is all that sounds in the model, each decibel less of it is one less at")

_GROUP: Final = 0.68
"""Part of a category that its bars take together, in both renderers."""


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
    blocks: list[Block] = [Paragraph(_cases_words(answer, fleet)), Paragraph(_lines_words(answer))]
    blocks.append(Sentences([_condition_words(answer, levels) for levels in conditions]))
    over = [text for text in (_first_words(answer, conditions), *_little_words(answer, conditions)) if text]
    blocks += [Sentences(over)] if over else []
    blocks.append(Paragraph(_interval_words(answer, fleet)))
    blocks += [Notice("warning", text) for text in _open_words(answer, fleet)]
    figure = _figure(answer, conditions)
    blocks += [] if figure is None else [FigureBlock(figure, "calculated")]
    near = [level for levels in conditions for level in levels]
    blocks.append(
        _table(answer, "what-if-surface", say("Changes at {surface}, unweighted", surface=answer.surface), near)
    )
    whole = _table(answer, "what-if", say("All receivers, unweighted and A-weighted"), answer.levels)
    blocks.append(Details(say("All receivers, unweighted and A-weighted"), [whole]))
    return Section("what-if", say("What it brings to quieten a source"), blocks)


def what_if_line(answer: WhatIfAnswer | None) -> str:
    """Return the slowest and the fastest speed of the answer in a line of text, and what it leaves out; or nothing."""
    conditions = [] if answer is None else _conditions(answer)
    if answer is None or not conditions or not answer.paths:
        return ""
    ends = conditions[:1] if len(conditions) == 1 else [conditions[0], conditions[-1]]
    parts = []
    for levels in ends:
        alone = _alone(answer, levels)
        said = (
            "; ".join(_effects(answer, levels, with_off=False))
            if alone is None
            else f"{say(SOURCES[alone])} {say(ALONE)} {answer.surface}"
        )
        parts.append(
            say("at {train_speed_km_h:.4g} km/h {said}", train_speed_km_h=levels[0].train_speed_km_h, said=said)
        )
    said = ". ".join([parts[0], *(sentence(part).rstrip(".") for part in parts[1:])])
    return say(
        "What if (the model's level at {surface}): {said}. {lines}",
        surface=answer.surface,
        said=said,
        lines=_lines_words(answer),
    )


def _lines_words(answer: WhatIfAnswer) -> str:
    """What of the sound the model has, and so what of a recorded level can change."""
    fractions = [fraction for _, fraction in answer.line_fractions]
    if not fractions:
        return say("The model has lines alone: a recorded level, with broadband sound in it, changes by less.")
    ends = (min(fractions), max(fractions))
    parts = " to ".join(dict.fromkeys(f"{100.0 * end:.0f}" for end in ends))
    most = " to ".join(dict.fromkeys(f"{most_off_db(end):.1f}" for end in ends if end < 1.0))
    text = say("The model has lines alone, which are {parts} % of the recorded sound energy", parts=parts)
    if not most:
        return f"{text}."
    of_all = "" if len(fractions) == 1 else say(", depending on the condition")
    return say(
        "{text}: as long as the rest stays, the recorded level falls by {most} dB at most{of_all}.",
        text=text,
        most=most,
        of_all=of_all,
    )


def _conditions(answer: WhatIfAnswer) -> list[list[WhatIfLevel]]:
    """Unweighted levels at the surface, those of each condition together, by speed."""
    found: dict[str, list[WhatIfLevel]] = {}
    for level in answer.levels:
        if (level.receiver, level.weighting) == (answer.surface, "Z") and level.before_db is not None:
            found.setdefault(level.condition, []).append(level)
    return sorted(found.values(), key=lambda levels: levels[0].train_speed_km_h)


def _cases_words(answer: WhatIfAnswer, fleet: Fleet) -> str:
    if not answer.assumed:
        cases = joined([f"{_quoted(case.name)} ({_case_words(case, fleet)})" for case in answer.cases])
        return say("The cases are those of the fleet's [[what_if]]: {cases}.", cases=cases)
    steps = joined([f"{abs(step):g}" for step in STEPS_DB])
    return say(
        "The fleet asks for no case of its own ([[what_if]]): each source of the total is taken "
        "{steps} dB down [assumed steps] and left out.",
        steps=steps,
    )


def _quoted(name: str) -> str:
    return f"\N{LEFT DOUBLE QUOTATION MARK}{name}\N{RIGHT DOUBLE QUOTATION MARK}"


def _case_words(case: WhatIf, fleet: Fleet) -> str:
    """What a case changes."""
    changes = {path: case.gain_db(path) for path in case.stated_paths}
    parts = [
        say("{path} off", path=path) if change == -math.inf else f"{path} {change:+g} dB"
        for path, change in changes.items()
    ]
    parts += [f"{keyed_words(key, fleet)} = {_value_words(key, value)}" for key, value in case.parameters]
    only = "" if case.conditions is None else say(", in {names} only", names=_names(case.conditions))
    return pretty_signs(", ".join(parts)) + only


def _value_words(key: str, value: Any) -> str:
    unit = unit_of(key)
    return f"{_plain(value)}{unit if unit in ('', '°') else f' {unit}'}"


def _plain(value: Any) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(_plain(entry) for entry in value)}]"
    return f"{value:g}"


# ---------------------------------------------------------------- a condition


def _where(levels: Sequence[WhatIfLevel]) -> str:
    return say(
        "condition {condition} ({train_speed_km_h:.4g} km/h)",
        condition=levels[0].condition,
        train_speed_km_h=levels[0].train_speed_km_h,
    )


def _condition_words(answer: WhatIfAnswer, levels: Sequence[WhatIfLevel]) -> str:
    before = levels[0].before_db
    start = say("{where}, {before:.1f} dB at {surface}", where=_where(levels), before=before, surface=answer.surface)
    alone = _alone(answer, levels)
    if alone is not None:
        return sentence(f"{start}: {say(SOURCES[alone])} {say(ALONE)} {answer.surface}")
    return sentence(f"{start}: {'; '.join(_effects(answer, levels))}")


def _alone(answer: WhatIfAnswer, levels: Sequence[WhatIfLevel]) -> str | None:
    """The path that alone sounds in a condition, where the usual cases show it."""
    held = {level.case: level for level in levels}
    for path in answer.paths if answer.assumed else ():
        if off_name(path) in held and held[off_name(path)].level_db is None:
            return path
    return None


def _effects(answer: WhatIfAnswer, levels: Sequence[WhatIfLevel], with_off: bool = True) -> list[str]:
    """What each case does in a condition: of the usual ones the larger step, and without the source."""
    held = {level.case: level for level in levels}
    if not answer.assumed:
        said = [f"{_quoted(name)} {_effect(held[name])}" for name in list(held)[:MOST_NAMED]]
        return [*said, say("more in the table")] if len(held) > MOST_NAMED else said
    found = []
    for path in answer.paths:
        step = held[step_name(path, STEPS_DB[0])]
        off = held[off_name(path)]
        text = say(
            "{steps_db:g} dB less from {sources} {effect}",
            steps_db=abs(STEPS_DB[0]),
            sources=say(SOURCES[path]),
            effect=_effect(step),
        )
        if with_off and off.change_db is not None and (step.change_db or 0.0) - off.change_db >= SMALLEST_DB:
            text += say(", {taken} if it were silent", taken=_taken(off))
        found.append(text)
    return found


def _effect(level: WhatIfLevel) -> str:
    """A change in words, with its interval."""
    change, ends = level.change_db, level.change_95_db
    if change is None:
        return say("leaves nothing that sounds")
    low, high = (change, change) if ends is None else ends
    if low <= -SMALLEST_DB and high >= SMALLEST_DB:
        about = f"{change:+.1f}" if abs(change) >= SMALLEST_DB else "0.0"
        return pretty_signs(
            say("changes it by {about} dB ({low:+.1f} to {high:+.1f})", about=about, low=low, high=high)
        )
    if max(-low, high) < SMALLEST_DB:
        return say("changes nothing")
    return (
        say("adds {taken}", taken=_taken(level, -1.0))
        if high >= SMALLEST_DB
        else say("takes {taken} off", taken=_taken(level))
    )


def _taken(level: WhatIfLevel, sign: float = 1.0) -> str:
    """What a change takes off, or with -1 adds, with its interval where that says more."""
    assert level.change_db is not None  # asked by the caller
    ends = level.change_95_db or (level.change_db, level.change_db)
    between = [f"{abs(max(end, 0.0)):.1f}" for end in sorted(-sign * end for end in ends)]  # no "-0.0"
    value = f"{abs(max(-sign * level.change_db, 0.0)):.1f}"
    return f"{value} dB ({' to '.join(between)})" if {*between} != {value} else f"{value} dB"


# ---------------------------------------------------------------- over the conditions


def _first_words(answer: WhatIfAnswer, conditions: Sequence[Sequence[WhatIfLevel]]) -> str:
    """From which source most is gained, and where the intervals leave that open; empty of one source."""
    if not answer.assumed or len(answer.paths) < 2:
        return ""
    named: dict[str, list[str]] = {}
    unsure = []
    for levels in conditions:
        held = {level.case: level for level in levels}
        steps = {path: held[step_name(path, STEPS_DB[0])] for path in answer.paths}
        ranked = sorted(answer.paths, key=lambda path: steps[path].change_db or 0.0)
        named.setdefault(ranked[0], []).append(levels[0].condition)
        if _overlap(steps[ranked[0]], steps[ranked[1]]):
            unsure.append(levels[0].condition)
    parts = [
        say("at {sources} in {names}", sources=say(SOURCES[path]), names=_names(names)) for path, names in named.items()
    ]
    text = say("{steps_db:g} dB less bring most {parts}", steps_db=abs(STEPS_DB[0]), parts=joined(parts))
    if unsure and answer.basis is not None:
        text += say(
            "; in {names} the intervals overlap, and which source to begin with is not decided", names=_names(unsure)
        )
    return sentence(text)


def _overlap(first: WhatIfLevel, second: WhatIfLevel) -> bool:
    if first.change_95_db is None or second.change_95_db is None:
        return False
    return first.change_95_db[1] > second.change_95_db[0]


def _little_words(answer: WhatIfAnswer, conditions: Sequence[Sequence[WhatIfLevel]]) -> list[str]:
    """Where a source left out altogether takes next to nothing off, and where only the intervals leave more open."""
    if not answer.assumed or len(answer.paths) < 2:
        return []
    little: dict[str, list[str]] = {}
    perhaps: dict[str, list[str]] = {}
    most_db = 0.0
    for levels in conditions:
        held = {level.case: level for level in levels}
        for path in answer.paths if _alone(answer, levels) is None else ():
            off = held[off_name(path)]
            if off.change_db is None or -off.change_db >= LITTLE_DB:
                continue
            at_most_db = -off.change_db if off.change_95_db is None else -off.change_95_db[0]
            if at_most_db < LITTLE_DB:
                little.setdefault(path, []).append(levels[0].condition)
            else:
                perhaps.setdefault(path, []).append(levels[0].condition)
                most_db = max(most_db, at_most_db)
    start = say("Left out altogether, less than {little_db:g} dB is gained from", little_db=LITTLE_DB)
    found = (
        [say("{start} {where_from}: others come first.", start=start, where_from=_where_from(little))] if little else []
    )
    if perhaps:
        most = say("up to {most_db:.1f} dB by the intervals", most_db=most_db)
        found.append(
            say(
                "{start} {where_from} by the fitted values, but {most}.",
                start=start,
                where_from=_where_from(perhaps),
                most=most,
            )
        )
    return found


def _where_from(named: Mapping[str, Sequence[str]]) -> str:
    return joined(
        [say("{sources} in {names}", sources=say(SOURCES[path]), names=_names(names)) for path, names in named.items()]
    )


def _names(names: Sequence[str]) -> str:
    return say("condition{value} {names}", value="s" if len(names) > 1 else "", names=joined(names))


# ---------------------------------------------------------------- how sure


def _interval_words(answer: WhatIfAnswer, fleet: Fleet) -> str:
    basis = answer.basis
    if basis is None:
        return say(
            "There is no interval: without a calibration the levels of the sources stand as the fleet's values make "
            "them, and nothing says how far these are off."
        )
    method = say("the range over") if basis.method == "profile" else say("2.5 and 97.5 % quantiles over")
    how = say("that the data allow (profile likelihood)") if basis.method == "profile" else say("out of the posterior")
    keys = joined([keyed_words(key, fleet) for key in basis.parameters])
    fitted = say("all values of {keys} {how}", keys=keys, how=how) if keys else say("no parameter, as none was fitted")
    scatter = (
        say(
            ", together with the model's scatter of {model_sigma_db:.2g} dB as an error of each "
            "source by itself in each condition [assumed]",
            model_sigma_db=basis.model_sigma_db,
        )
        if basis.model_sigma_db > 0.0
        else ""
    )
    alone = (
        say(" If the sources are off alike, the interval of the fitted parameters alone holds; the table has it too.")
        if basis.model_sigma_db > 0.0
        else ""
    )
    return say(
        "In brackets: intervals of 95 %, {method} {fitted}{scatter}.{alone} Not in them is what "
        "parameters that were not fitted are off by beyond that, sound that the model does not "
        "have, and whether a measure keeps what it promises. The levels in the table are the "
        "model's; of a measured level a change holds as far as these lines make it.",
        method=method,
        fitted=fitted,
        scatter=scatter,
        alone=alone,
    )


def _open_words(answer: WhatIfAnswer, fleet: Fleet) -> list[str]:
    held = () if answer.basis is None else answer.basis.open_parameters
    if not held:
        return []
    bounds = say("their bounds hold") if len(held) > 1 else say("its bounds hold")
    named = joined([keyed_words(key, fleet) for key in held])
    return [
        say(
            "The data do not determine {named}: {bounds} these intervals, as far as they depend on it.",
            named=named,
            bounds=bounds,
        )
    ]


# ---------------------------------------------------------------- figure and tables


def _figure(answer: WhatIfAnswer, conditions: Sequence[Sequence[WhatIfLevel]]) -> Figure | None:
    """Bars of what is taken off, with intervals, and marks of what a source left out would take off."""
    shown: list[tuple[str, int | None, str | None]]
    if answer.assumed:
        shown = [(step_name(path, STEPS_DB[0]), SLOTS[path], off_name(path)) for path in answer.paths]
    else:
        shown = [(case.name, None, None) for case in answer.cases[:MOST_DRAWN]]
    places = [f"{levels[0].condition} ({levels[0].train_speed_km_h:.4g} km/h)" for levels in conditions]
    elements: list[Element] = []
    marked: list[np.ndarray] = []
    wide = _GROUP / len(shown)
    for number, (name, slot, off) in enumerate(shown):
        held = [_of_case(levels, name) for levels in conditions]
        elements.append(Bars(places, _off_db(held), name, _lengths(held), slot))
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
        Axis(say("Less at ") + answer.surface, "dB"),
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


def _table(answer: WhatIfAnswer, name: str, caption: str, levels: Iterable[WhatIfLevel]) -> Table:
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
            Column("change_high_db", "to", "dB", 1, "number"),
            Column("fit_change_low_db", say("Fit alone from"), "dB", 1, "number"),
            Column("fit_change_high_db", "to", "dB", 1, "number"),
            Column("level_low_db", say("Level 95 % from"), "dB", 1, "number"),
            Column("level_high_db", "to", "dB", 1, "number"),
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
    return Table(
        name, caption, columns, rows, csv=say("{name}.csv", name=name) if everywhere else None, origin="calculated"
    )

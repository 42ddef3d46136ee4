"""Sentences on what changes of the drive do: the cases, what each does in a condition, and what to begin with."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

from tdacoustic.drive.what_if import (
    STEPS_DB,
    WhatIfAnswer,
    WhatIfLevel,
    off_name,
    step_name,
)
from tdacoustic.fleet import Fleet, WhatIf
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.gear_words import named_conditions, sentence
from tdacoustic.reporting.sections.parameters import keyed_words
from tdacoustic.reporting.sections.words import joined, pretty_signs
from tdacoustic.studies.words import unit_of

__all__ = [
    "alone_words",
    "cases_words",
    "condition_words",
    "effects",
    "first_words",
    "little_words",
]

SOURCES: Final = {"motor": mark("the motor"), "mesh": mark("the meshing noise"), "structure": mark("the structure")}

MOST_NAMED: Final = 4
"""Cases of the fleet that a sentence names; the table has all."""

LITTLE_DB: Final = 1.0
"""What a source left out takes off, below which others come first [assumed]."""

SMALLEST_DB: Final = 0.05
"""Changes that are none at the decimals shown."""


def cases_words(answer: WhatIfAnswer, fleet: Fleet) -> str:
    """Return what is changed in each case."""
    if not answer.assumed:
        cases = joined([f"{_quoted(case.name)} ({_case_words(case, fleet)})" for case in answer.cases])
        return say("The cases are those of the fleet's [[what_if]]: {cases}.", cases=cases)
    return say(
        "The fleet asks for no case of its own ([[what_if]]): each source of the total is taken "
        "{steps} dB down [assumed steps] and left out.",
        steps=joined([f"{abs(step):g}" for step in STEPS_DB]),
    )


def _quoted(name: str) -> str:
    return say("“{name}”", name=name)


def _case_words(case: WhatIf, fleet: Fleet) -> str:
    """What a case changes."""
    changes = {path: case.gain_db(path) for path in case.stated_paths}
    parts = [
        say("{path} off", path=path) if change == -math.inf else f"{path} {change:+g} dB"
        for path, change in changes.items()
    ]
    parts += [f"{keyed_words(key, fleet)} = {_value_words(key, value)}" for key, value in case.parameters]
    said = pretty_signs(", ".join(parts))
    if case.conditions is None:
        return said
    return ", ".join([said, say("in {conditions} only", conditions=named_conditions(case.conditions))])


def _value_words(key: str, value: Any) -> str:
    unit = unit_of(key)
    return f"{_plain(value)}{unit if unit in ('', '°') else f' {unit}'}"


def _plain(value: Any) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(_plain(entry) for entry in value)}]"
    return f"{value:g}"


# ---------------------------------------------------------------- a condition


def condition_words(answer: WhatIfAnswer, levels: Sequence[WhatIfLevel]) -> str:
    """Return what the cases do in a condition.

    Parameters
    ----------
    answer : WhatIfAnswer
    levels : sequence of WhatIfLevel
        Unweighted at the surface, of one condition.
    """
    start = say(
        "condition {name} ({speed:.4g} km/h), {level:.1f} dB at {surface}",
        name=levels[0].condition,
        speed=levels[0].train_speed_km_h,
        level=levels[0].before_db,
        surface=answer.surface,
    )
    return sentence(f"{start}: {alone_words(answer, levels) or '; '.join(effects(answer, levels))}")


def alone_words(answer: WhatIfAnswer, levels: Sequence[WhatIfLevel]) -> str:
    """Return that one path alone sounds in a condition, where the usual cases show it; else empty."""
    held = {level.case: level for level in levels}
    for path in answer.paths if answer.assumed else ():
        if off_name(path) in held and held[off_name(path)].level_db is None:
            return say(
                "{source} is all that sounds in the model, each decibel less of it is one less at {surface}",
                source=say(SOURCES[path]),
                surface=answer.surface,
            )
    return ""


def effects(answer: WhatIfAnswer, levels: Sequence[WhatIfLevel], with_off: bool = True) -> list[str]:
    """Return what each case does in a condition: of the usual ones the larger step, and without the source."""
    held = {level.case: level for level in levels}
    if not answer.assumed:
        said = [_effect(_quoted(name), held[name]) for name in list(held)[:MOST_NAMED]]
        return [*said, say("more in the table")] if len(held) > MOST_NAMED else said
    found = []
    for path in answer.paths:
        step = held[step_name(path, STEPS_DB[0])]
        off = held[off_name(path)]
        change = say("{step:g} dB less from {source}", step=abs(STEPS_DB[0]), source=say(SOURCES[path]))
        clauses = [_effect(change, step)]
        if with_off and off.change_db is not None and (step.change_db or 0.0) - off.change_db >= SMALLEST_DB:
            clauses.append(say("{taken} if it were silent", taken=_taken(off)))
        found.append(", ".join(clauses))
    return found


def _effect(case: str, level: WhatIfLevel) -> str:
    """What a case does to a level, with its interval."""
    change, ends = level.change_db, level.change_95_db
    if change is None:
        return say("{case} leaves nothing that sounds", case=case)
    low, high = (change, change) if ends is None else ends
    if low <= -SMALLEST_DB and high >= SMALLEST_DB:
        about = f"{change:+.1f}" if abs(change) >= SMALLEST_DB else "0.0"
        about, lowest, highest = (pretty_signs(number) for number in (about, f"{low:+.1f}", f"{high:+.1f}"))
        return say(
            "{case} changes it by {change} dB ({low} to {high})", case=case, change=about, low=lowest, high=highest
        )
    if max(-low, high) < SMALLEST_DB:
        return say("{case} changes nothing", case=case)
    if high >= SMALLEST_DB:
        return say("{case} adds {added}", case=case, added=_taken(level, -1.0))
    return say("{case} takes {taken} off", case=case, taken=_taken(level))


def _taken(level: WhatIfLevel, sign: float = 1.0) -> str:
    """What a change takes off, or with -1 adds, with its interval where that says more."""
    assert level.change_db is not None  # asked by the caller
    ends = level.change_95_db or (level.change_db, level.change_db)
    low, high = (f"{abs(max(end, 0.0)):.1f}" for end in sorted(-sign * end for end in ends))  # no "-0.0"
    value = f"{abs(max(-sign * level.change_db, 0.0)):.1f}"
    if {low, high} == {value}:
        return f"{value} dB"
    return say("{change} dB ({low} to {high})", change=value, low=low, high=high)


# ---------------------------------------------------------------- over the conditions


def first_words(answer: WhatIfAnswer, conditions: Sequence[Sequence[WhatIfLevel]]) -> str:
    """Return from which source most is gained, and where the intervals leave that open; empty of one source."""
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
        say("at {source} in {conditions}", source=say(SOURCES[path]), conditions=named_conditions(names))
        for path, names in named.items()
    ]
    clauses = [say("{step:g} dB less bring most {places}", step=abs(STEPS_DB[0]), places=joined(parts))]
    if unsure and answer.basis is not None:
        clauses.append(
            say(
                "in {conditions} the intervals overlap, and which source to begin with is not decided",
                conditions=named_conditions(unsure),
            )
        )
    return f"{'; '.join(clauses)}."


def _overlap(first: WhatIfLevel, second: WhatIfLevel) -> bool:
    if first.change_95_db is None or second.change_95_db is None:
        return False
    return first.change_95_db[1] > second.change_95_db[0]


def little_words(answer: WhatIfAnswer, conditions: Sequence[Sequence[WhatIfLevel]]) -> list[str]:
    """Return where a source left out takes next to nothing off, and where only the intervals leave more open."""
    if not answer.assumed or len(answer.paths) < 2:
        return []
    little: dict[str, list[str]] = {}
    perhaps: dict[str, list[str]] = {}
    most_db = 0.0
    for levels in conditions:
        held = {level.case: level for level in levels}
        for path in answer.paths if not alone_words(answer, levels) else ():
            off = held[off_name(path)]
            if off.change_db is None or -off.change_db >= LITTLE_DB:
                continue
            at_most_db = -off.change_db if off.change_95_db is None else -off.change_95_db[0]
            if at_most_db < LITTLE_DB:
                little.setdefault(path, []).append(levels[0].condition)
            else:
                perhaps.setdefault(path, []).append(levels[0].condition)
                most_db = max(most_db, at_most_db)
    found = []
    if little:
        found.append(
            say(
                "Left out altogether, less than {little:g} dB is gained from {sources}: others come first.",
                little=LITTLE_DB,
                sources=_where_from(little),
            )
        )
    if perhaps:
        found.append(
            say(
                "Left out altogether, less than {little:g} dB is gained from {sources} by the fitted values, but up to "
                "{most:.1f} dB by the intervals.",
                little=LITTLE_DB,
                sources=_where_from(perhaps),
                most=most_db,
            )
        )
    return found


def _where_from(named: Mapping[str, Sequence[str]]) -> str:
    return joined(
        [
            say("{source} in {conditions}", source=say(SOURCES[path]), conditions=named_conditions(names))
            for path, names in named.items()
        ]
    )

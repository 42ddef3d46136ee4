"""Plain sentences on which parameters of a study decide the level."""

from __future__ import annotations

from typing import Final

import numpy as np

from tdacoustic.fleet import Fleet
from tdacoustic.reporting.language import say
from tdacoustic.reporting.sections.gear_words import sentence
from tdacoustic.reporting.sections.words import joined, pretty_signs
from tdacoustic.studies import LevelInStudy, SweepSensitivity
from tdacoustic.studies.designs import seed_of
from tdacoustic.studies.indices import CONFIDENCE, FEWEST_ROWS
from tdacoustic.studies.words import number_words

__all__ = ["left_out_words", "level_words", "method_words", "study_words"]

MOST_NAMED: Final = 3
COUNTS: Final = 0.05
"""Part of the variance below which a parameter is said not to matter [assumed]."""
WIDE: Final = 0.2
"""Length of an interval of an index from which more points are advised [assumed]."""
STRAIGHT: Final = 0.7
"""R² from which a straight line is taken to explain a level [assumed; usual in sensitivity analysis]."""


def method_words(study: SweepSensitivity) -> str:
    """Return what was computed and how the numbers come from it."""
    sweep = study.found.sweep
    n = len(study.found.points)
    interval = say("Intervals hold {confidence:g} %, from resampled rows", confidence=100.0 * CONFIDENCE)
    stated = "" if sweep.seed is not None else say(", made of the ranges")
    seed = say("the seed is {seed_of}{stated}", seed_of=seed_of(sweep), stated=stated)
    if sweep.sampling == "saltelli":
        return say(
            "{n} points by Saltelli's design of {base_points} base points; {seed}. The "
            "first-order index is the part of the level's variance that goes when a parameter is "
            "known, the total index the part that stays when all others are known: what lies "
            "between is interaction. {interval}.",
            n=n,
            base_points=sweep.base_points,
            seed=seed,
            interval=interval,
        )
    return say(
        "{n} points of a Latin hypercube, in cubes of up to 100 points each; {seed}. A "
        "standardised regression coefficient says by how many of its standard deviations the "
        "level moves with one of the parameter, along a straight line; R² says how much of the "
        'variance that line has. Interaction is no part of it: sampling = "saltelli" tells it. '
        "{interval} as if they were independent, which makes them rather too wide here.",
        n=n,
        seed=seed,
        interval=interval,
    )


def left_out_words(study: SweepSensitivity) -> str:
    """Return how many points a level lacks where gears rattle or nothing sounds; empty of none."""
    told = []
    for level in study.levels:
        if level.condition is None:
            continue
        reasons = {"rattle": level.n_rattling, "make no sound": level.n_silent}
        words = [f"{number} {why}" for why, number in reasons.items() if number]
        if words:
            told.append(say("in condition {condition} {words}", condition=level.condition, words=joined(words)))
    if not told:
        return ""
    of = len(study.found.points)
    return say(
        "Of {of} points {told}. Where the harmonic balance finds no stable motion a study "
        "integrates none in time, which takes seconds each (a grid does): these points are left "
        "out; what is said holds for the others.",
        of=of,
        told=joined(told),
    )


def study_words(fleet: Fleet, study: SweepSensitivity) -> list[str]:
    """Return what decides the level, one sentence each."""
    level = study.overall
    if level is None:
        return []
    name = level_words(level)
    if level.weights is None:
        least = max(FEWEST_ROWS, 3 * len(study.keys))
        rows = (
            say("{fewest_rows} base points", fewest_rows=FEWEST_ROWS)
            if study.found.sweep.sampling == "saltelli"
            else say("{least} points", least=least)
        )
        return [
            say(
                "Nothing can be said of the {name}: it does not vary, or fewer than {rows} have it.",
                name=name,
                rows=rows,
            )
        ]
    held = level.level_db[np.isfinite(level.level_db)]
    low, middle, high = np.percentile(held, [5.0, 50.0, 95.0])
    said = [
        say(
            "The {name} lies between {low:.1f} and {high:.1f} dB at 90 % of the points, with a "
            "median of {middle:.1f} dB.",
            name=name,
            low=low,
            high=high,
            middle=middle,
        )
    ]
    said += _of_variance(fleet, study, level) if level.total is not None else _of_line(fleet, study, level)
    return [pretty_signs(text) for text in said]


def level_words(level: LevelInStudy) -> str:
    """Return which level it is."""
    return (
        say("energy mean over the conditions")
        if level.condition is None
        else say("level in condition {condition}", condition=level.condition)
    )


def _of_variance(fleet: Fleet, study: SweepSensitivity, level: LevelInStudy) -> list[str]:
    own, total = level.first_order, level.total
    assert own is not None and total is not None
    counting = [place for place in study.ranking() if total.value[place] >= COUNTS]
    named = [
        say(
            "{number} with {percent} of its variance ({percent_2} to {percent_3})",
            number=number_words(study.keys[place], fleet),
            percent=_percent(total.value[place]),
            percent_2=_percent(total.low[place]),
            percent_3=_percent(total.high[place]),
        )
        for place in counting[:MOST_NAMED]
    ]
    said = [say("It is decided by {named}, interactions with others included.", named=joined(named))]
    alone = float(np.clip(own.value.sum(), 0.0, 1.0))
    said.append(
        say(
            "Parameters on their own make about {percent} of the variance, interactions the rest.",
            percent=_percent(alone),
        )
    )
    acting = [number_words(study.keys[place], fleet) for place in counting if total.low[place] > own.high[place]]
    if acting:
        said.append(
            sentence(
                say(
                    "beyond the intervals {acting} also act through others: total above first order",
                    acting=joined(acting),
                )
            )
        )
    least = [number_words(key, fleet) for key, high in zip(study.keys, total.high, strict=True) if high < COUNTS]
    if least:
        said.append(
            sentence(
                say(
                    "{least} could lie anywhere in the range: total index below {percent}",
                    least=joined(least),
                    percent=_percent(COUNTS),
                )
            )
        )
    widest = counting[0]
    if total.high[widest] - total.low[widest] > WIDE:
        said.append(say("These intervals are wide; four times as many base points halve them."))
    return said


def _of_line(fleet: Fleet, study: SweepSensitivity, level: LevelInStudy) -> list[str]:
    regression = level.regression
    assert regression is not None
    slope, standardised = regression.slope, regression.standardised
    told = [place for place in study.ranking() if standardised.low[place] * standardised.high[place] > 0.0]
    named = [
        say(
            "{number} ({value:+.1f} dB over its range, {low:+.1f} to {high:+.1f})",
            number=number_words(study.keys[place], fleet),
            value=slope.value[place],
            low=slope.low[place],
            high=slope.high[place],
        )
        for place in told[:MOST_NAMED]
    ]
    said = [say("Along a straight line it moves most with {named}.", named=joined(named))] if named else []
    constant = np.isnan(standardised.value)
    unclear = [number_words(key, fleet) for n, key in enumerate(study.keys) if n not in told and not constant[n]]
    if unclear:
        said.append(sentence(say("of {unclear} the intervals leave open even the sign", unclear=joined(unclear))))
    still = [number_words(key, fleet) for key, one in zip(study.keys, constant, strict=True) if one]
    if still:
        said.append(
            sentence(
                say("of {still} nothing can be said: at all points that can be it is the same", still=joined(still))
            )
        )
    explained = say("The line has {percent} of the variance (R²)", percent=_percent(regression.explained))
    if regression.explained >= STRAIGHT:
        return [*said, say("{explained}, so that the coefficients describe it.", explained=explained)]
    if regression.explained_ranks >= STRAIGHT:
        ranks = say(
            "{explained}, a line between ranks {percent}",
            explained=explained,
            percent=_percent(regression.explained_ranks),
        )
        return [
            *said,
            say("{ranks}: the level bends, but mostly only rises or falls; go by the rank correlations.", ranks=ranks),
        ]
    return [
        *said,
        say(
            "{explained}: it bends, turns or interacts too much for coefficients to tell what "
            'decides it. Take sampling = "saltelli".',
            explained=explained,
        ),
    ]


def _percent(part: float) -> str:
    return f"{max(0.0, 100.0 * part):.0f} %"

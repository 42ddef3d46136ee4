"""Plain sentences on which parameters of a study decide the level."""

from __future__ import annotations

from typing import Final

import numpy as np

from tdacoustic.fleet import Fleet
from tdacoustic.reporting.language import say, say_count
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
    seed = (
        say("the seed is {seed}, made of the ranges", seed=seed_of(sweep))
        if sweep.seed is None
        else say("the seed is {seed}", seed=seed_of(sweep))
    )
    confidence = 100.0 * CONFIDENCE
    if sweep.sampling == "saltelli":
        return say(
            "{points} points by Saltelli's design of {base_points} base points; {seed}. The "
            "first-order index is the part of the level's variance that goes when a parameter is "
            "known, the total index the part that stays when all others are known: what lies "
            "between is interaction. Intervals hold {confidence:g} %, from resampled rows.",
            points=n,
            base_points=sweep.base_points,
            seed=seed,
            confidence=confidence,
        )
    return say(
        "{points} points of a Latin hypercube, in cubes of up to 100 points each; {seed}. A "
        "standardised regression coefficient says by how many of its standard deviations the "
        "level moves with one of the parameter, along a straight line; R² says how much of the "
        'variance that line has. Interaction is no part of it: sampling = "saltelli" tells it. '
        "Intervals hold {confidence:g} %, from resampled rows as if they were independent, which makes them rather "
        "too wide here.",
        points=n,
        seed=seed,
        confidence=confidence,
    )


def left_out_words(study: SweepSensitivity) -> str:
    """Return how many points a level lacks where gears rattle or nothing sounds; empty of none."""
    told = []
    for level in study.levels:
        if level.condition is None:
            continue
        words = []
        if level.n_rattling:
            words.append(say_count("{count} rattles", "{count} rattle", level.n_rattling))
        if level.n_silent:
            words.append(say_count("{count} makes no sound", "{count} make no sound", level.n_silent))
        if words:
            told.append(say("in condition {condition} {points}", condition=level.condition, points=joined(words)))
    if not told:
        return ""
    return say_count(
        "Of {count} point {conditions}. Where the harmonic balance finds no stable motion a study "
        "integrates none in time, which takes seconds each (a grid does): these points are left "
        "out; what is said holds for the others.",
        "Of {count} points {conditions}. Where the harmonic balance finds no stable motion a study "
        "integrates none in time, which takes seconds each (a grid does): these points are left "
        "out; what is said holds for the others.",
        len(study.found.points),
        conditions=joined(told),
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
            say_count("{count} base point", "{count} base points", FEWEST_ROWS)
            if study.found.sweep.sampling == "saltelli"
            else say_count("{count} point", "{count} points", least)
        )
        return [
            say(
                "Nothing can be said of the {level}: it does not vary, or fewer than {points} have it.",
                level=name,
                points=rows,
            )
        ]
    held = level.level_db[np.isfinite(level.level_db)]
    low, middle, high = np.percentile(held, [5.0, 50.0, 95.0])
    said = [
        say(
            "The {level} lies between {low:.1f} and {high:.1f} dB at 90 % of the points, with a "
            "median of {median:.1f} dB.",
            level=name,
            low=low,
            high=high,
            median=middle,
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
            "{parameter} with {share} of its variance ({low} to {high})",
            parameter=number_words(study.keys[place], fleet),
            share=_percent(total.value[place]),
            low=_percent(total.low[place]),
            high=_percent(total.high[place]),
        )
        for place in counting[:MOST_NAMED]
    ]
    said = [say("It is decided by {parameters}, interactions with others included.", parameters=joined(named))]
    alone = float(np.clip(own.value.sum(), 0.0, 1.0))
    said.append(
        say(
            "Parameters on their own make about {share} of the variance, interactions the rest.",
            share=_percent(alone),
        )
    )
    acting = [number_words(study.keys[place], fleet) for place in counting if total.low[place] > own.high[place]]
    if acting:
        said.append(
            say(
                "Beyond the intervals {parameters} also act through others: total above first order.",
                parameters=joined(acting),
            )
        )
    least = [number_words(key, fleet) for key, high in zip(study.keys, total.high, strict=True) if high < COUNTS]
    if least:
        said.append(
            sentence(
                say(
                    "{parameters} could lie anywhere in the range: total index below {share}.",
                    parameters=joined(least),
                    share=_percent(COUNTS),
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
            "{parameter} ({change:+.1f} dB over its range, {low:+.1f} to {high:+.1f})",
            parameter=number_words(study.keys[place], fleet),
            change=slope.value[place],
            low=slope.low[place],
            high=slope.high[place],
        )
        for place in told[:MOST_NAMED]
    ]
    said = []
    if named:
        said.append(say("Along a straight line it moves most with {parameters}.", parameters=joined(named)))
    constant = np.isnan(standardised.value)
    unclear = [number_words(key, fleet) for n, key in enumerate(study.keys) if n not in told and not constant[n]]
    if unclear:
        said.append(say("Of {parameters} the intervals leave open even the sign.", parameters=joined(unclear)))
    still = [number_words(key, fleet) for key, one in zip(study.keys, constant, strict=True) if one]
    if still:
        said.append(
            say(
                "Of {parameters} nothing can be said: at all points that can be it is the same.",
                parameters=joined(still),
            )
        )
    return [*said, _explained_words(regression.explained, regression.explained_ranks)]


def _explained_words(line: float, ranks: float) -> str:
    """How much of the variance a line has, and what to go by."""
    if line >= STRAIGHT:
        return say(
            "The line has {share} of the variance (R²), so that the coefficients describe it.", share=_percent(line)
        )
    if ranks >= STRAIGHT:
        return say(
            "The line has {share} of the variance (R²), a line between ranks {share_of_ranks}: the level bends, but "
            "mostly only rises or falls; go by the rank correlations.",
            share=_percent(line),
            share_of_ranks=_percent(ranks),
        )
    return say(
        "The line has {share} of the variance (R²): it bends, turns or interacts too much for coefficients to tell "
        'what decides it. Take sampling = "saltelli".',
        share=_percent(line),
    )


def _percent(part: float) -> str:
    return f"{max(0.0, 100.0 * part):.0f} %"

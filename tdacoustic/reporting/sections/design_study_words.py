"""Plain sentences on which parameters of a study decide the level."""

from __future__ import annotations

from typing import Final

import numpy as np

from tdacoustic.fleet import Fleet
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
    interval = f"Intervals hold {100.0 * CONFIDENCE:g} %, from resampled rows"
    stated = "" if sweep.seed is not None else ", made of the ranges"
    seed = f"the seed is {seed_of(sweep)}{stated}"
    if sweep.sampling == "saltelli":
        return (
            f"{n} points by Saltelli's design of {sweep.base_points} base points; {seed}. The first-order index is the "
            "part of the level's variance that goes when a parameter is known, the total index the part that stays "
            f"when all others are known: what lies between is interaction. {interval}."
        )
    return (
        f"{n} points of a Latin hypercube, in cubes of up to 100 points each; {seed}. A standardised regression "
        "coefficient says by how many of its standard deviations the level moves with one of the parameter, along a "
        "straight line; R² says how much of the variance that line has. Interaction is no part of it: sampling = "
        f'"saltelli" tells it. {interval} as if they were independent, which makes them rather too wide here.'
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
            told.append(f"in condition {level.condition} {joined(words)}")
    if not told:
        return ""
    of = len(study.found.points)
    return (
        f"Of {of} points {joined(told)}. Where the harmonic balance finds no stable motion a study integrates none in "
        "time, which takes seconds each (a grid does): these points are left out; what is said holds for the others."
    )


def study_words(fleet: Fleet, study: SweepSensitivity) -> list[str]:
    """Return what decides the level, one sentence each."""
    level = study.overall
    if level is None:
        return []
    name = level_words(level)
    if level.weights is None:
        least = max(FEWEST_ROWS, 3 * len(study.keys))
        rows = f"{FEWEST_ROWS} base points" if study.found.sweep.sampling == "saltelli" else f"{least} points"
        return [f"Nothing can be said of the {name}: it does not vary, or fewer than {rows} have it."]
    held = level.level_db[np.isfinite(level.level_db)]
    low, middle, high = np.percentile(held, [5.0, 50.0, 95.0])
    said = [
        f"The {name} lies between {low:.1f} and {high:.1f} dB at 90 % of the points, with a median of {middle:.1f} dB."
    ]
    said += _of_variance(fleet, study, level) if level.total is not None else _of_line(fleet, study, level)
    return [pretty_signs(text) for text in said]


def level_words(level: LevelInStudy) -> str:
    """Return which level it is."""
    return "energy mean over the conditions" if level.condition is None else f"level in condition {level.condition}"


def _of_variance(fleet: Fleet, study: SweepSensitivity, level: LevelInStudy) -> list[str]:
    own, total = level.first_order, level.total
    assert own is not None and total is not None
    counting = [place for place in study.ranking() if total.value[place] >= COUNTS]
    named = [
        f"{number_words(study.keys[place], fleet)} with {_percent(total.value[place])} of its variance "
        f"({_percent(total.low[place])} to {_percent(total.high[place])})"
        for place in counting[:MOST_NAMED]
    ]
    said = [f"It is decided by {joined(named)}, interactions with others included."]
    alone = float(np.clip(own.value.sum(), 0.0, 1.0))
    said.append(f"Parameters on their own make about {_percent(alone)} of the variance, interactions the rest.")
    acting = [number_words(study.keys[place], fleet) for place in counting if total.low[place] > own.high[place]]
    if acting:
        said.append(sentence(f"beyond the intervals {joined(acting)} also act through others: total above first order"))
    least = [number_words(key, fleet) for key, high in zip(study.keys, total.high, strict=True) if high < COUNTS]
    if least:
        said.append(sentence(f"{joined(least)} could lie anywhere in the range: total index below {_percent(COUNTS)}"))
    widest = counting[0]
    if total.high[widest] - total.low[widest] > WIDE:
        said.append("These intervals are wide; four times as many base points halve them.")
    return said


def _of_line(fleet: Fleet, study: SweepSensitivity, level: LevelInStudy) -> list[str]:
    regression = level.regression
    assert regression is not None
    slope, standardised = regression.slope, regression.standardised
    told = [place for place in study.ranking() if standardised.low[place] * standardised.high[place] > 0.0]
    named = [
        f"{number_words(study.keys[place], fleet)} ({slope.value[place]:+.1f} dB over its range, "
        f"{slope.low[place]:+.1f} to {slope.high[place]:+.1f})"
        for place in told[:MOST_NAMED]
    ]
    said = [f"Along a straight line it moves most with {joined(named)}."] if named else []
    constant = np.isnan(standardised.value)
    unclear = [number_words(key, fleet) for n, key in enumerate(study.keys) if n not in told and not constant[n]]
    if unclear:
        said.append(sentence(f"of {joined(unclear)} the intervals leave open even the sign"))
    still = [number_words(key, fleet) for key, one in zip(study.keys, constant, strict=True) if one]
    if still:
        said.append(sentence(f"of {joined(still)} nothing can be said: at all points that can be it is the same"))
    explained = f"The line has {_percent(regression.explained)} of the variance (R²)"
    if regression.explained >= STRAIGHT:
        return [*said, f"{explained}, so that the coefficients describe it."]
    if regression.explained_ranks >= STRAIGHT:
        ranks = f"{explained}, a line between ranks {_percent(regression.explained_ranks)}"
        return [*said, f"{ranks}: the level bends, but mostly only rises or falls; go by the rank correlations."]
    return [
        *said,
        f"{explained}: it bends, turns or interacts too much for coefficients to tell what decides it. Take sampling = "
        '"saltelli".',
    ]


def _percent(part: float) -> str:
    return f"{max(0.0, 100.0 * part):.0f} %"

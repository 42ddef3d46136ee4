"""Levels at 4 m over speed and over years, each origin by itself."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from tdacoustic.gathering.gathered import Gathering
from tdacoustic.gathering.levels import BandMedian, LevelPoint, band_medians, grouped, level_points, year_medians
from tdacoustic.gathering.outliers import BAND_KM_H
from tdacoustic.gathering.overview import Origin
from tdacoustic.gathering.speed_bands import SpeedBand, band_at, band_width
from tdacoustic.reporting.document import Block, FigureBlock, Paragraph, Section
from tdacoustic.reporting.figure import Axis, Band, Figure, Line, Markers, Symbol
from tdacoustic.reporting.language import mark, say, say_count
from tdacoustic.reporting.sections.campaigns_levels_table import levels_table
from tdacoustic.reporting.sections.campaigns_rows import (
    MOST_POINTS,
    short,
    shown_of,
    spread_out,
    when,
)
from tdacoustic.reporting.shown import ORIGIN_WORDS

__all__ = ["campaigns_levels"]

MOST_LINES: Final = 6
"""Trains, or fleets, that a figure draws one by one; the seventh and eighth colours are the single values'."""

OVER_YEARS: Final = 4
GREY: Final = 7

_EXPLAINED: Final = mark(
    "The unweighted level at 4 m of a condition is the energy mean over its runs and over the microphones within 5 % "
    "of 4 m, corrected for background where background was recorded; channels that are bad do not enter. Levels that a "
    "campaign states instead of recording them are drawn as crosses. A level of a result without distances of its "
    "microphones is not here."
)
_SHOWN: Final = mark("Shown are {shown} of {held} recorded values; all are in dataset/{table}.parquet.")


def campaigns_levels(gathering: Gathering) -> Section | None:
    """Return the section on levels; None where no campaign has one at 4 m."""
    found = [(origin, level_points(gathering.results, origin)) for origin in gathering.origins]
    held = [(origin, points) for origin, points in found if points]
    if not held:
        return None
    blocks: list[Block] = [Paragraph(say(_EXPLAINED))]
    for origin, points in held:
        blocks += [_over_speed(origin, points), *_over_years(origin, points), levels_table(gathering, origin, points)]
    return Section("levels", say("Levels at 4 m"), blocks)


# ---------------------------------------------------------------- over speed


def _over_speed(origin: Origin, points: Sequence[LevelPoint]) -> FigureBlock:
    recorded = [point for point in points if point.row.level_from == "recorded"]
    stated = [point for point in points if point.row.level_from == "stated"]
    trains = grouped(points, _train)
    few = len(trains) <= MOST_LINES
    groups = _trains(recorded) if few else _fleets(recorded)
    single = any(each.n > 1 for _, held in groups for each in band_medians(held, BAND_KM_H))
    shown = spread_out(recorded) if single else []
    elements: list[Markers | Line | Band] = [_values(shown, say("single conditions"), "circle")] if shown else []
    for slot, (name, held) in enumerate(groups[:MOST_LINES]):
        elements += _line(name, band_medians(held, BAND_KM_H if few else _width(points)), slot, not few)
    if stated:
        elements.append(_values(spread_out(stated), say("stated levels"), "x"))
    words = [_values_words(len(points), len(trains))]
    if groups and few:
        words.append(say("Lines are medians in bands of {width:g} km/h.", width=BAND_KM_H))
    elif groups:
        words.append(
            say(
                "Lines are medians of a fleet in bands of {width:g} km/h, with the range that 80 % of the values of a "
                "band lie in.",
                width=_width(points),
            )
        )
    left = len(groups) - MOST_LINES
    if not few and left > 0:
        words.append(
            say_count(
                "{count} fleet with fewer values has no line.", "{count} fleets with fewer values have no line.", left
            )
        )
    if single and len(shown) < len(recorded):
        words.append(shown_of(len(shown), len(recorded), _SHOWN, "overview"))
    figure = Figure(
        f"levels-over-speed-{origin}",
        say("Level at 4 m over speed, {origin}", origin=say(ORIGIN_WORDS[origin])),
        " ".join(words),
        Axis(say("Train speed"), "km/h"),
        _level_axis(),
        elements,
        height=440,
    )
    return FigureBlock(figure, origin)


def _values_words(values: int, trains: int) -> str:
    """How many values of how many trains a figure has."""
    whose = say_count("{count} train or campaign", "{count} trains or campaigns", trains)
    return say_count("{count} value of {trains}.", "{count} values of {trains}.", values, trains=whose)


def _level_axis() -> Axis:
    return Axis(say("Level at 4 m"), "dB", reference="20 µPa")


def _train(point: LevelPoint) -> tuple[str, str]:
    return point.result.train, point.result.fleet


def _trains(points: Sequence[LevelPoint]) -> list[tuple[str, list[LevelPoint]]]:
    """Points by train; one that several fleets have with the fleet's name."""
    found = grouped(points, _train)
    names = [train for train, _ in found]
    no_fleet = say("no fleet")
    return [
        (train if names.count(train) == 1 else f"{train}, {fleet or no_fleet}", held)
        for (train, fleet), held in found.items()
    ]


def _width(points: Sequence[LevelPoint]) -> float:
    return band_width((point.speed_km_h for point in points), 20)


def _fleets(points: Sequence[LevelPoint]) -> list[tuple[str, list[LevelPoint]]]:
    """Points by fleet, the largest first."""
    found = grouped(points, lambda point: point.result.fleet or say("no fleet"))
    return sorted(found.items(), key=lambda item: -len(item[1]))


def _line(name: str, medians: Sequence[BandMedian], slot: int, ranges: bool) -> list[Line | Band]:
    speeds = np.array([each.speed_km_h for each in medians])
    line = Line(speeds, np.array([each.level_db for each in medians]), short(name, 40), color=slot, points=True)
    wide = [each for each in medians if each.low_db is not None and each.high_db is not None]
    if not ranges or len(wide) < 2:
        return [line]
    low, high = ([getattr(each, key) for each in wide] for key in ("low_db", "high_db"))
    band = Band(
        np.array([each.speed_km_h for each in wide]),
        np.array(low),
        np.array(high),
        f"{short(name, 40)}, 80 %",
        color=slot,
    )
    return [band, line]


def _values(points: Sequence[LevelPoint], name: str, symbol: Symbol) -> Markers:
    return Markers(
        np.array([point.speed_km_h for point in points]),
        np.array([point.level_db for point in points]),
        name,
        texts=[_hover(point) for point in points],
        symbol=symbol,
        color=GREY,
    )


def _hover(point: LevelPoint) -> str:
    parts = (
        short(point.result.train, 40),
        say("condition {condition}", condition=short(point.row.condition, 24)),
        when(point.result),
    )
    return ", ".join(part for part in parts if part)


# ---------------------------------------------------------------- over years


def _over_years(origin: Origin, points: Sequence[LevelPoint]) -> list[FigureBlock | Paragraph]:
    dated = [point for point in points if point.year is not None and point.row.level_from == "recorded"]
    years = {point.result.identity.year for point in dated}
    if len(years) < 2:
        return [Paragraph(_no_years(origin, years))]
    groups = grouped(dated, lambda point: (point.result.fleet, band_at(point.speed_km_h, BAND_KM_H)))
    usable = {key: held for key, held in groups.items() if len({p.result.identity.year for p in held}) > 1}
    if not usable:
        return [
            Paragraph(
                say(
                    "Levels over years, {origin}: no speed was recorded in two years, so there is no figure.",
                    origin=say(ORIGIN_WORDS[origin]),
                )
            )
        ]
    several = len({fleet for fleet, _ in usable}) > 1
    largest = _chosen(usable)
    elements: list[Markers | Line] = []
    for slot, (fleet, band) in enumerate(sorted(largest)):
        held = usable[fleet, band]
        name = short(fleet or say("no fleet"), 32) if several else f"{band.words} km/h"
        shown = spread_out(held, MOST_POINTS // OVER_YEARS)
        elements.append(
            Markers(
                np.array([point.year for point in shown], dtype=np.float64),
                np.array([point.level_db for point in shown]),
                say("{name}, single", name=name),
                texts=[_hover(point) for point in shown],
                color=slot,
                symbol=("circle", "square", "diamond", "triangle")[slot],
            )
        )
        medians = year_medians(held)
        times, levels = (np.array(values) for values in zip(*medians, strict=True))
        elements.append(Line(times, levels, say("{name}, median", name=name), color=slot))
    words = [
        say(
            "Single conditions where their day is known at that day, else in the middle of their year; lines are "
            "medians of a year. A level may change with the track, the load and the place as well as with the train."
        )
    ]
    rest = len(usable) - len(largest)
    if rest:
        words.append(
            say_count(
                "{count} more speed of a fleet was recorded in several years.",
                "{count} more speeds of a fleet were recorded in several years.",
                rest,
            )
        )
    return [
        FigureBlock(
            Figure(
                f"levels-over-years-{origin}",
                _years_title(origin, largest[0][1] if several else None),
                " ".join(words),
                Axis(say("Year")),
                _level_axis(),
                elements,
                height=400,
            ),
            origin,
        )
    ]


def _no_years(origin: Origin, years: set[int | None]) -> str:
    """Why there is no figure over years where levels are of one year, or of none that is known."""
    words = say(ORIGIN_WORDS[origin])
    if years:
        return say(
            "Levels over years, {origin}: recorded levels are known of {year} alone, so there is no figure.",
            origin=words,
            year=next(iter(years)),
        )
    return say("Levels over years, {origin}: no year is known of recorded ones, so there is no figure.", origin=words)


def _years_title(origin: Origin, band: SpeedBand | None) -> str:
    words = say(ORIGIN_WORDS[origin])
    if band is None:
        return say("Level at 4 m over the years, {origin}", origin=words)
    return say("Level at 4 m over the years at {speeds} km/h, {origin}", speeds=band.words, origin=words)


def _chosen(usable: dict[tuple[str, SpeedBand], list[LevelPoint]]) -> list[tuple[str, SpeedBand]]:
    """Of one fleet its most frequent speeds; of several the most frequent speed, at which they can be compared."""
    ranked = sorted(usable, key=lambda key: (-len(usable[key]), key))
    if len({fleet for fleet, _ in usable}) > 1:
        counts: dict[SpeedBand, int] = {}
        for fleet, band in usable:
            counts[band] = counts.get(band, 0) + len(usable[fleet, band])
        common = max(counts, key=lambda band: (counts[band], band))
        ranked = [key for key in ranked if key[1] == common]
    return ranked[:OVER_YEARS]

"""Levels at 4 m by speed band, train by train."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from typing import Final

from tdacoustic.gathering.gathered import Gathering
from tdacoustic.gathering.levels import LevelPoint, grouped
from tdacoustic.gathering.overview import Origin
from tdacoustic.gathering.speed_bands import band_at, band_width
from tdacoustic.reporting.document import Cell, Column, Table
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.campaigns_rows import MOST_ROWS, SHOWN_ROWS, captioned, name_cell, shown_of
from tdacoustic.reporting.shown import ORIGIN_WORDS

__all__ = ["levels_table"]

MOST_BANDS: Final = 10

_LEVEL_FROM: Final = {"recorded": mark("recorded"), "stated": mark("stated")}
_CORRECTIONS: Final = {
    "none": mark("none"),
    "applied": mark("applied"),
    "marginal": mark("marginal"),
    "impossible": mark("impossible"),
}


def levels_table(gathering: Gathering, origin: Origin, points: Sequence[LevelPoint]) -> Table:
    """Return the medians of levels at 4 m, a row a train, recorded and stated ones apart."""
    width = band_width((point.speed_km_h for point in points), MOST_BANDS)
    bands = sorted({band_at(point.speed_km_h, width) for point in points})
    trains = grouped(points, _whose)
    stated = any(point.row.level_from == "stated" for point in points)
    corrected = any(point.row.correction != "none" for point in points)
    columns = [
        Column("train", say("Train, else campaign")),
        Column("fleet", say("Fleet")),
        *([Column("level_from", say("Levels"))] if stated else []),
        Column("years", say("Years")),
        Column("values", say("Values"), kind="number", digits=0),
        *(Column(f"band_{band.low:.16g}_km_h", band.words, "km/h", digits=1, kind="number") for band in bands),
        *([Column("corrected", say("Background correction"))] if corrected else []),
    ]
    rows: list[list[Cell]] = []
    for key in sorted(trains)[:MOST_ROWS]:
        fleet, *_, level_from = key
        held = trains[key]
        levels = grouped(held, lambda point: band_at(point.speed_km_h, width))
        medians: list[Cell] = [
            statistics.median(point.level_db for point in levels[band]) if band in levels else None for band in bands
        ]
        results = list({id(point.result): point.result for point in held}.values())
        corrections = [say(_CORRECTIONS.get(word, word)) for word in sorted({point.row.correction for point in held})]
        years = sorted({result.identity.year for result in results if result.identity.year is not None})
        span = "" if not years else str(years[0]) if len(years) == 1 else f"{years[0]}–{years[-1]}"
        whose: list[Cell] = [
            name_cell(gathering, results),
            fleet or None,
            *([say(_LEVEL_FROM.get(level_from, level_from))] if stated else []),
        ]
        rows.append([*whose, span or None, len(held), *medians, *([", ".join(corrections)] if corrected else [])])
    left_out = shown_of(len(rows), len(trains), SHOWN_ROWS, "overview")
    caption = say("Levels at 4 m in dB re 20 µPa by speed band, {origin}: medians", origin=say(ORIGIN_WORDS[origin]))
    return Table(f"levels-{origin}", captioned(caption, left_out), columns, rows, origin=origin)


def _whose(point: LevelPoint) -> tuple[str, bool, str, str]:
    """What makes a row: recorded and stated levels are not mixed."""
    result = point.result
    return result.fleet, not result.identity.train, result.train, point.row.level_from

"""Who dominates over speed: a matrix of trains and speed bands, and the verdicts counted."""

from __future__ import annotations

from typing import Final

import numpy as np

from tdacoustic.gathering.gathered import Gathering
from tdacoustic.gathering.overview import Origin
from tdacoustic.gathering.speed_bands import SpeedBand, band_width
from tdacoustic.gathering.verdicts import Matrix, Row, Tally, has_verdict, tallies, verdict_rows
from tdacoustic.reporting.document import Block, Cell, Column, FigureBlock, Paragraph, Section, Table
from tdacoustic.reporting.figure import Axis, Bars, Figure
from tdacoustic.reporting.language import mark, say, say_count
from tdacoustic.reporting.sections.campaigns_rows import (
    MOST_ROWS,
    SHOWN_ROWS,
    campaigns_words,
    captioned,
    name_cell,
    shown_of,
)
from tdacoustic.reporting.sections.words import (
    OWNER_HATCHES,
    OWNER_SLOT_OTHER,
    OWNER_SLOTS,
    probability_words,
    source_word,
)
from tdacoustic.reporting.shown import ORIGIN_WORDS

__all__ = ["MOST_BANDS", "campaigns_dominance", "matrix_width", "tally_words"]

MOST_BANDS: Final = 10
"""Speed bands of the matrix."""

_FEW: Final = 8
"""Verdicts up to which each whole number stands on the axis."""

MIXED: Final = mark("mixed")
"""What is said of verdicts of which none has more than half."""

_EXPLAINED: Final = mark(
    "A cell is the verdict of the campaigns' own analyses: the source that has most of the sound energy in the noise "
    "lines, with the probability that it has (of several conditions the smallest, and in brackets how many there are). "
    "Where verdicts differ, each is counted; undecided is what stays below a probability of 0.9. An empty "
    "cell has no verdict: no condition, no noise line, or no fleet that says whose order a line is."
)


def matrix_width(gathering: Gathering) -> float:
    """Return the width of the speed bands of the matrix, in km/h."""
    speeds = (row.train_speed_km_h for result in gathering.results for row in result.conditions if has_verdict(row))
    return band_width((speed for speed in speeds if speed is not None), MOST_BANDS)


def tally_words(tally: Tally | None) -> str | None:
    """Return some verdicts in words, None of none.

    Examples
    --------
    >>> tally_words(Tally((("motor", 1),), (0.97, 0.97)))
    'motor 0.97'
    >>> tally_words(Tally((("gearbox", 3), ("undecided", 1)), (0.92, 0.98)))
    'gearbox 3, undecided 1'
    >>> tally_words(Tally((("gearbox", 1), ("undecided", 1)), (0.92, 0.92)))
    'mixed: gearbox 1, undecided 1'
    """
    if tally is None or not tally.words:
        return None
    if len(tally.words) > 1:
        counts = ", ".join(f"{source_word(word)} {count}" for word, count in tally.words)
        return counts if tally.majority else f"{say(MIXED)}: {counts}"
    word, count = tally.words[0]
    said = [source_word(word)]
    if word != "undecided":
        said.append(_sure(tally))
    elif count == 1 and tally.leading:
        said = [f"{said[0]}:", source_word(tally.leading), _sure(tally)]
    if count > 1:
        said.append(f"({count})")
    return " ".join(part for part in said if part)


def _sure(tally: Tally) -> str:
    if tally.confidence is None:
        return ""
    low, high = map(probability_words, tally.confidence)
    return low if low == high else f"≥ {low}"


def campaigns_dominance(gathering: Gathering) -> Section | None:
    """Return the section on dominant sources; None where no campaign has a verdict."""
    width = matrix_width(gathering)
    rows = verdict_rows(gathering.results, width)
    if not rows:
        return None
    blocks: list[Block] = [Paragraph(say(_EXPLAINED))]
    for origin in gathering.origins:
        figure = _figure(gathering, origin, width)
        if figure is not None:
            blocks.append(figure)
    blocks.append(_matrix(gathering, rows))
    return Section("dominance", say("Dominant source over speed"), blocks)


def _matrix(gathering: Gathering, rows: Matrix) -> Table:
    bands: list[SpeedBand] = sorted({band for _, cells in rows.values() for band in cells})
    order = list(gathering.origins)
    names: list[Row] = sorted(rows, key=lambda row: (order.index(row.origin), row.fleet, not row.is_train))
    columns = [
        Column("train", say("Train, else campaign")),
        Column("origin", say("Origin"), kind="origin"),
        Column("fleet", say("Fleet")),
        *(Column(f"band_{band.low:.16g}_km_h", band.words, "km/h", kind="source") for band in bands),
    ]
    cells: list[list[Cell]] = []
    for row in names[:MOST_ROWS]:
        results, tally = rows[row]
        verdicts = [tally_words(tally.get(band)) for band in bands]
        cells.append([name_cell(gathering, results), row.origin, row.fleet or None, *verdicts])
    left_out = shown_of(len(cells), len(names), SHOWN_ROWS, "overview")
    caption = captioned(say("Dominant source with its probability"), left_out)
    return Table("dominance-matrix", caption, columns, cells)


def _figure(gathering: Gathering, origin: Origin, width: float) -> FigureBlock | None:
    results = gathering.of_origin(origin)
    found = tallies(results, width)
    if len(found) < 2:
        return None
    counts = {band: dict(tally.words) for band, tally in found.items()}
    named = sorted({word for held in counts.values() for word in held}, key=_place)
    others = [word for word in named if _place(word) == len(_KNOWN)]
    bars = [
        Bars(
            [band.words for band in found],
            np.array([float(held.get(word, 0)) for held in counts.values()]),
            source_word(word),
            color=OWNER_SLOTS.get(word, 7 if word == "undecided" else None),
            hatch=OWNER_HATCHES.get(word),
        )
        for word in named
        if word not in others
    ]
    if others:
        values = np.array([float(sum(held.get(word, 0) for word in others)) for held in counts.values()])
        name = others[0] if len(others) == 1 else say("another component")
        bars.append(Bars([band.words for band in found], values, name, color=OWNER_SLOT_OTHER))
    n = sum(tally.n for tally in found.values())
    most = max(tally.n for tally in found.values())
    return FigureBlock(
        Figure(
            f"dominance-{origin}",
            say("Verdicts by speed, {origin}", origin=say(ORIGIN_WORDS[origin])),
            say_count(
                "{count} verdict of {campaigns}, one a condition.",
                "{count} verdicts of {campaigns}, one a condition.",
                n,
                campaigns=campaigns_words(len(results), origin),
            ),
            Axis(say("Train speed"), "km/h"),
            Axis(say("Verdicts"), names=[str(count) for count in range(most + 1)] if most <= _FEW else ()),
            bars,
            height=320,
            bar_mode="stack",
        ),
        origin,
    )


_KNOWN: Final = ("motor", "gearbox", "undecided")


def _place(word: str) -> int:
    return _KNOWN.index(word) if word in _KNOWN else len(_KNOWN)

"""What the sections of the fleet view share: whose a row is, where its report is, and how many rows a page holds."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from typing import Final, TypeVar

from tdacoustic.gathering.gathered import Gathering
from tdacoustic.gathering.overview import Origin
from tdacoustic.gathering.result import GatheredResult
from tdacoustic.reporting.document import Cell, Link
from tdacoustic.reporting.language import mark, say, say_count
from tdacoustic.reporting.shown import ORIGIN_WORDS

__all__ = [
    "MOST_POINTS",
    "MOST_ROWS",
    "SHOWN_CAMPAIGNS",
    "SHOWN_ROWS",
    "campaigns_words",
    "captioned",
    "name_cell",
    "short",
    "shown_of",
    "spread_out",
    "when",
    "years_words",
]

MOST_ROWS: Final = 200
"""Rows of a table in the page; the dataset has them all."""

MOST_POINTS: Final = 2000
"""Single values of a figure."""

SHOWN_ROWS: Final = mark("Shown are {shown} of {held} rows; all are in dataset/{table}.parquet.")
SHOWN_CAMPAIGNS: Final = mark("Shown are {shown} of {held} campaigns; all are in dataset/{table}.parquet.")

T = TypeVar("T")


def when(result: GatheredResult) -> str:
    """Return the day of a result, or its year, as far as it is known."""
    found = result.identity
    return found.date.isoformat() if found.date is not None else "" if found.year is None else str(found.year)


def name_cell(gathering: Gathering, results: Sequence[GatheredResult]) -> Cell:
    """Return the train (or campaign) of results, leading to their own report; of several to that of the newest."""
    newest = max(results, key=lambda result: (result.result in gathering.links, when(result)))
    link = gathering.links.get(newest.result)
    return newest.train if link is None else Link(newest.train, link)


def campaigns_words(count: int, origin: Origin) -> str:
    """Return how many campaigns of an origin.

    Examples
    --------
    >>> campaigns_words(1, "printed"), campaigns_words(3, "measured")
    ('1 printed campaign', '3 measured campaigns')
    """
    return say_count("{count} {origin} campaign", "{count} {origin} campaigns", count, origin=say(ORIGIN_WORDS[origin]))


def years_words(years: Collection[int]) -> str:
    """Return some years in words, from the first to the last; empty of none.

    Examples
    --------
    >>> years_words({2021}), years_words({2021, 2019})
    ('2021', '2019 to 2021')
    """
    if not years:
        return ""
    first, last = min(years), max(years)
    return str(first) if first == last else say("{first} to {last}", first=first, last=last)


def short(text: str, most: int = 28) -> str:
    """Return a name cut for an axis.

    Examples
    --------
    >>> short("a" * 40)
    'aaaaaaaaaaaaaaaaaaaaaaaaaaa…'
    """
    plain = re.sub(r"\s+", " ", text)
    return plain if len(plain) <= most else f"{plain[: most - 1]}…"


def shown_of(shown: int, held: int, words: str, table: str) -> str:
    """Say what a table or figure leaves out; empty where it is nothing.

    Parameters
    ----------
    shown, held : int
    words : str
        The sentence, such as `SHOWN_ROWS`.
    table : str
        Of the dataset, that has all.

    Examples
    --------
    >>> shown_of(3, 3, SHOWN_ROWS, "overview")
    ''
    >>> shown_of(200, 512, SHOWN_ROWS, "overview")
    'Shown are 200 of 512 rows; all are in dataset/overview.parquet.'
    """
    return "" if shown >= held else say(words, shown=shown, held=held, table=table)


def captioned(caption: str, left_out: str) -> str:
    """Return the caption of a table with what the table leaves out, and no full stop at the end.

    Examples
    --------
    >>> captioned("Levels", ""), captioned("Levels", "Shown are 200 of 512 rows.")
    ('Levels', 'Levels. Shown are 200 of 512 rows')
    """
    return f"{caption}. {left_out.removesuffix('.')}" if left_out else caption


def spread_out(values: Sequence[T], most: int = MOST_POINTS) -> list[T]:
    """Return at most so many of some values, evenly from first to last.

    Examples
    --------
    >>> spread_out([0, 1, 2, 3, 4, 5, 6, 7, 8], 3)
    [0, 4, 8]
    """
    if len(values) <= most:
        return list(values)
    return [values[round(i * (len(values) - 1) / (most - 1))] for i in range(most)]

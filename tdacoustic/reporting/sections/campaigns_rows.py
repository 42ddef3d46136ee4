"""What the sections of the fleet view share: whose a row is, where its report is, and how many rows a page holds."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final, TypeVar

from tdacoustic.gathering.gathered import Gathering
from tdacoustic.gathering.result import GatheredResult
from tdacoustic.reporting.document import Cell, Link
from tdacoustic.reporting.language import say

__all__ = [
    "MOST_POINTS",
    "MOST_ROWS",
    "name_cell",
    "plural",
    "short",
    "shown_of",
    "spread_out",
    "when",
]

MOST_ROWS: Final = 200
"""Rows of a table in the page; the dataset has them all."""

MOST_POINTS: Final = 2000
"""Single values of a figure."""

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


def plural(count: int, one: str, many: str | None = None) -> str:
    """Return a count with its noun.

    Examples
    --------
    >>> plural(1, "campaign"), plural(3, "campaign")
    ('1 campaign', '3 campaigns')
    """
    return f"{count} {one if count == 1 else many or one + 's'}"


def short(text: str, most: int = 28) -> str:
    """Return a name cut for an axis.

    Examples
    --------
    >>> short("a" * 40)
    'aaaaaaaaaaaaaaaaaaaaaaaaaaa…'
    """
    plain = re.sub(r"\s+", " ", text)
    return plain if len(plain) <= most else f"{plain[: most - 1]}…"


def shown_of(shown: int, held: int, what: str, table: str) -> str:
    """Say what a table or figure leaves out; empty where it is nothing.

    Examples
    --------
    >>> shown_of(3, 3, "trains", "overview")
    ''
    >>> shown_of(200, 512, "trains", "overview")
    ' Shown are 200 of 512 trains; all are in dataset/overview.parquet.'
    """
    return (
        ""
        if shown >= held
        else say(
            " Shown are {shown} of {held} {what}; all are in dataset/{table}.parquet.",
            shown=shown,
            held=held,
            what=what,
            table=table,
        )
    )


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

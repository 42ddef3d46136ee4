"""What does not all stand in sight: tables with many rows, figures of many channels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from tdacoustic.reporting.document import Alternatives, Block, Details, Table
from tdacoustic.reporting.language import say, say_count

__all__ = ["MOST_ROWS", "chosen", "few", "in_sight", "rows_words"]

MOST_ROWS: Final = 24
"""Rows of a table that stands in sight: about a page."""


def in_sight(table: Table, what: str) -> Block:
    """Return a table as it is, or folded away below one line where it has more than a page of rows.

    Parameters
    ----------
    table : Table
    what : str
        The line's words before the number of rows.

    Examples
    --------
    >>> from tdacoustic.reporting.document import Column
    >>> columns = [Column("run", "Run")]
    >>> in_sight(Table("few", "Few", columns, [["a"]]), "Runs").name
    'few'
    >>> in_sight(Table("many", "Many", columns, [["a"]] * 40), "Runs").summary
    'Runs, 40 rows'
    """
    return table if len(table.rows) <= MOST_ROWS else Details(rows_words(what, len(table.rows)), [table])


def rows_words(what: str, count: int) -> str:
    """Return the line below which rows are folded away.

    Examples
    --------
    >>> rows_words("Runs", 40)
    'Runs, 40 rows'
    """
    return say_count("{what}, {count} row", "{what}, {count} rows", count, what=what)


def few(names: Sequence[str], most: int, between: str = ", ") -> str:
    """Return the first of some names, and how many more there are.

    Parameters
    ----------
    names : sequence of str
    most : int
        Names that are named.
    between : str

    Examples
    --------
    >>> few(["a", "b"], 2), few(["a", "b", "c", "d"], 2)
    ('a, b', 'a, b and 2 more')
    """
    if len(names) <= most:
        return between.join(names)
    return say("{names} and {count} more", names=between.join(names[:most]), count=len(names) - most)


def chosen(label: str, views: Sequence[tuple[str, Sequence[Block]]]) -> list[Block]:
    """Return views of which the reader chooses one; a single one as it is, nothing of none.

    Parameters
    ----------
    label : str
        What is chosen, ``"Channel"``.
    views : sequence of (str, sequence of blocks)
    """
    if len(views) < 2:
        return [block for _, blocks in views for block in blocks]
    return [Alternatives(label, views)]

"""A table of items: each column beside what it shows of one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

from tdacoustic.reporting.document import Cell, Column, Origin, Table

__all__ = ["item_table"]

Item = TypeVar("Item")


def item_table(
    name: str,
    caption: str,
    items: Iterable[Item],
    columns: Sequence[tuple[Column, Callable[[Item], Cell]]],
    origin: Origin | None = None,
) -> Table:
    """Return a table with one row an item.

    Parameters
    ----------
    name, caption : str
    items : iterable
    columns : sequence of (Column, callable)
        The callable returns an item's cell.
    origin : str, optional
        Of the numbers in it.

    Examples
    --------
    >>> item_table("squares", "Squares", [2, 3], [(Column("square", "Square", "", 0, "number"), lambda n: n * n)]).rows
    ((4,), (9,))
    """
    rows = [[cell(item) for _, cell in columns] for item in items]
    return Table(name, caption, [column for column, _ in columns], rows, origin=origin)

"""What a page holds at most, so that it opens at once and can be sent; what it leaves out, it says."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final

from tdacoustic.reporting.language import say, say_count

__all__ = ["PAGE_LIMITS", "PageLimits", "left_out_words", "rows_that_fit"]

FEWEST_ROWS: Final = 12
"""Rows of a table that are always shown."""
BYTES_A_CELL: Final = 12
"""Of the marks around a cell's text."""


@dataclass(frozen=True)
class PageLimits:
    """How much a page holds.

    Parameters
    ----------
    interactive : int
        Figures that can be zoomed; later ones are still pictures.
    figure_bytes : int
        Data of all figures that can be zoomed.
    picture_bytes : int
        Still pictures; the figures after that are left out.
    one_table_bytes, table_bytes : int
        Of a table, and of all; of what is longer the first rows are shown.
    sound_bytes : int
        Of all sounds; later ones are left out.
    """

    interactive: int = 100
    figure_bytes: int = 12_000_000
    picture_bytes: int = 8_000_000
    one_table_bytes: int = 500_000
    table_bytes: int = 4_000_000
    sound_bytes: int = 4_000_000

    @property
    def most_bytes(self) -> int:
        """Of all these together."""
        return self.figure_bytes + self.picture_bytes + self.table_bytes + self.sound_bytes


PAGE_LIMITS: Final = PageLimits()


def rows_that_fit(rows: Iterable[list[dict[str, Any]]], most: int) -> tuple[list[list[dict[str, Any]]], int]:
    """Return the first rows of a table that fit into a number of bytes, at least a few, and their bytes.

    Parameters
    ----------
    rows : iterable of list of dict
        Views of cells.
    most : int
    """
    kept: list[list[dict[str, Any]]] = []
    taken = 0
    for row in rows:
        size = sum(BYTES_A_CELL + len(cell["text"].encode()) + len(cell.get("raw") or "") for cell in row)
        if len(kept) >= FEWEST_ROWS and taken + size > most:
            break
        kept.append(row)
        taken += size
    return kept, taken


def left_out_words(figures: int, interactive: int, left_out: int, cut_tables: int) -> str:
    """What a page says of what it does not hold; nothing where it holds all.

    Parameters
    ----------
    figures : int
        Of the report.
    interactive : int
        That can be zoomed; as many as `figures` where all can.
    left_out : int
        That are not even pictures.
    cut_tables : int
        Of which the first rows are shown.
    """
    said = []
    if interactive < figures:
        said.append(
            say(
                "Of the {all} figures of this page the first {count} can be zoomed; the others are still pictures, "
                "which keeps the page small.",
                all=figures,
                count=interactive,
            )
        )
    if left_out:
        said.append(
            say_count(
                "The last one is left out; what it shows is in result.h5 and the tables.",
                "The last {count} are left out; what they show is in result.h5 and the tables.",
                left_out,
            )
        )
    if cut_tables:
        said.append(
            say_count(
                "Of one long table the first rows alone are shown; the files beside this page have all.",
                "Of {count} long tables the first rows alone are shown; the files beside this page have all.",
                cut_tables,
            )
        )
    return " ".join(said)

"""What a page holds at most, so that it opens at once and can be sent; what it leaves out, it says."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final

from tdacoustic.reporting.language import say, say_count

__all__ = ["PAGE_LIMITS", "Held", "PageLimits", "Room", "left_out_words", "rows_that_fit"]

FEWEST_ROWS: Final = 12
"""Rows of a table that are always shown."""
BYTES_A_CELL: Final = 24
"""Of the marks around a cell's text."""
USUAL_WORDS_BYTES: Final = 2_200_000
"""Of a page without figures, tables and sounds; nearly all of it is plotly's script."""


@dataclass(frozen=True)
class Held:
    """What a page holds of what makes pages heavy, in bytes, and what it had no room for.

    Parameters
    ----------
    table_bytes, sound_bytes, picture_bytes, zoomed_bytes : int
        Of the rows of its tables, its sounds, its pictures, and the data of the figures that can be zoomed.
    zoomed : int
        Figures that can be zoomed.
    still : int
        Figures that are pictures alone.
    left_out : int
        Figures that are not even pictures.
    cut_tables : int
        Tables of which the first rows are shown.
    silent : int
        Sounds that are left out.
    """

    table_bytes: int = 0
    sound_bytes: int = 0
    picture_bytes: int = 0
    zoomed_bytes: int = 0
    zoomed: int = 0
    still: int = 0
    left_out: int = 0
    cut_tables: int = 0
    silent: int = 0

    @property
    def all_bytes(self) -> int:
        """Of all these together."""
        return self.table_bytes + self.sound_bytes + self.picture_bytes + self.zoomed_bytes

    @property
    def lacks(self) -> bool:
        """Whether something of the report is not in the page."""
        return bool(self.left_out or self.cut_tables or self.silent)


@dataclass(frozen=True)
class Room:
    """Bytes that a page has for each kind of what makes it heavy.

    Parameters
    ----------
    tables, one_table, sounds : int
        Of all tables, of one, and of all sounds.
    figures : int
        Of pictures and data of all figures.
    zoomed : int
        Of these, data of the figures that can be zoomed.
    """

    tables: int
    one_table: int
    sounds: int
    figures: int
    zoomed: int


@dataclass(frozen=True)
class PageLimits:
    """How much a page holds.

    Parameters
    ----------
    page_bytes : int
        The whole page, with plotly's script.
    interactive : int
        Figures that can be zoomed; later ones are still pictures.
    tables, one_table, sounds : float
        Shares of the page's free bytes that all tables, one table, and all sounds take at most.
    zoomed : float
        Share that data of zoomed figures take at most where not all figures have room as pictures.
    """

    page_bytes: int = 15_000_000
    interactive: int = 150
    tables: float = 0.15
    one_table: float = 0.03
    sounds: float = 0.15
    zoomed: float = 0.3

    def room(self, words_bytes: int = USUAL_WORDS_BYTES, tried: Held | None = None) -> Room:
        """Return the room of a page.

        Parameters
        ----------
        words_bytes : int
            Of all that is neither figure nor table nor sound.
        tried : Held, optional
            What the page held when it was made before: what tables and sounds do not need, figures have; what figures
            do not need, sounds have.
        """
        free = max(self.page_bytes - words_bytes - self.page_bytes // 200, 0)
        tables, sounds = int(self.tables * free), int(self.sounds * free)
        if tried is None:
            figures = zoomed = free - tables - sounds
        else:
            spare = max(free - tried.all_bytes, 0)
            sounds += 0 if tried.left_out else int(0.9 * spare)
            # the first rows of many tables can need more than their share
            needed = tried.table_bytes + (sounds if tried.silent else tried.sound_bytes)
            figures = max(free - needed, 0)
            zoomed = int(self.zoomed * free) if tried.left_out else figures
        return Room(tables, int(self.one_table * free), sounds, figures, zoomed)


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


def left_out_words(held: Held) -> str:
    """What a page says of what it does not hold, or not as it could be; nothing where it holds all.

    Parameters
    ----------
    held : Held
    """
    said = []
    if held.left_out:
        said.append(
            say(
                "Of the {all} figures of this report the first {zoomed} can be zoomed, the next {still} are still "
                "pictures, and the last {left_out} are left out, which keeps the page small; what those show is in "
                "result.h5 and the tables.",
                all=held.zoomed + held.still + held.left_out,
                zoomed=held.zoomed,
                still=held.still,
                left_out=held.left_out,
            )
        )
    elif held.still:
        said.append(
            say(
                "Of the {all} figures of this page the first {count} can be zoomed; the others are still pictures, "
                "which keeps the page small.",
                all=held.zoomed + held.still,
                count=held.zoomed,
            )
        )
    if held.cut_tables:
        said.append(
            say_count(
                "Of one long table the first rows alone are shown; the files beside this page have all.",
                "Of {count} long tables the first rows alone are shown; the files beside this page have all.",
                held.cut_tables,
            )
        )
    if held.silent:
        said.append(
            say_count(
                "One sound is left out: the page holds no more.",
                "{count} sounds are left out: the page holds no more.",
                held.silent,
            )
        )
    return " ".join(said)

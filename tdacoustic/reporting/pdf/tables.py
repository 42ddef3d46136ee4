"""Tables of the PDF: as wide as the page allows, on a page across where they are wider, in parts where that is not
enough; broken over pages with their header, and shortened where they are long.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from reportlab.lib.colors import HexColor
from reportlab.platypus import LongTable, Paragraph

from tdacoustic.reporting.decimate import FloatArray
from tdacoustic.reporting.document import Cell, Column, Link, Table
from tdacoustic.reporting.language import say_count
from tdacoustic.reporting.layout import cut_text
from tdacoustic.reporting.palette import colour
from tdacoustic.reporting.pdf.fonts import REGULAR, Fonts
from tdacoustic.reporting.pdf.text import CELL, markup, muted, style
from tdacoustic.reporting.shown import cell_text

__all__ = ["MOST_ROWS", "LeftTable", "Part", "laid_out"]

MOST_ROWS: Final = 120
"""Rows that are printed of a table: about three pages."""
_MOST_IN_HEAD: Final = 90
"""Columns of the title of a column: a header, which stands on each page, must leave room for rows."""
MOST_SIGNS: Final = 600
"""Signs that are printed of a cell."""
_PADS: Final = (3.0, 1.8)
"""Points beside the text of a cell, in a table and in one of many columns."""
_MANY_COLUMNS: Final = 10
_WIDEST_WORD, _NARROW_WORD = 130.0, 80.0
"""Points of a word that is not broken; of one where the table would not fit on an upright page otherwise."""
_APART: Final = 3.0
"""Points more before a text that follows a column of numbers: both end where they meet."""
_FILLED: Final = 0.8
"""Part of a line that words fill, where they go over several [assumed]."""
_FEWEST_LINES, _MOST_LINES = 1e-3, 1e6


class LeftTable(LongTable):
    """A table at the left margin, its parts on further pages too: reportlab centres those of a row that it breaks."""

    def wrap(self, availWidth: float, availHeight: float) -> tuple[float, float]:
        """Lay it out."""
        self.hAlign = "LEFT"
        width, height = super().wrap(availWidth, availHeight)
        return width, height


@dataclass(frozen=True)
class Part:
    """Some columns of a table, laid out.

    Parameters
    ----------
    flowable : LongTable
    across : bool
        Whether it needs a page in landscape.
    start_height : float
        Of its header and its first rows, in points.
    columns : (int, int) or None
        Places of its first and last column from 1, where the table is in parts.
    """

    flowable: LongTable
    across: bool
    start_height: float
    columns: tuple[int, int] | None


def laid_out(table: Table, fonts: Fonts, upright: float, across: float) -> list[Part]:
    """Lay a table out.

    Parameters
    ----------
    table : Table
    fonts : Fonts
    upright, across : float
        Width of the text on a page and on a page in landscape, in points.

    Returns
    -------
    list of Part
        One, or several that each begin with the table's first column.
    """
    rows = table.rows[:MOST_ROWS]
    pad = _PADS[len(table.columns) >= _MANY_COLUMNS]
    pads = _left_pads(table.columns, pad)
    asks = [
        _Asked.of(column, [row[place] for row in rows], fonts, pads[place] + pad)
        for place, column in enumerate(table.columns)
    ]
    for widest, room in ((_WIDEST_WORD, upright), (_NARROW_WORD, upright), (_WIDEST_WORD, across)):
        asked = [replace(one, least=min(one.least, widest)) for one in asks]
        least = [one.least for one in asked]
        if sum(least) <= room:
            return [_part(table, rows, range(len(least)), _widths(asked, room), room == across, fonts, pad, whole=True)]
    parts = []
    for places in _groups(least, across):
        widths = _widths([asked[i] for i in places], across)
        parts.append(_part(table, rows, places, widths, True, fonts, pad, whole=False))
    return parts


@dataclass(frozen=True)
class _Asked:
    """Widths that a column asks for, in points: of its widest word, of its widest text, of each of its texts."""

    least: float
    most: float
    each: FloatArray

    @classmethod
    def of(cls, column: Column, cells: Sequence[Cell], fonts: Fonts, pads: float) -> _Asked:
        texts = [_shortened(cell_text(column, cell)) for cell in cells]
        words = {word for text in texts for word in text.split()} | set(_unbroken(column.unit).split(" "))
        heads = [fonts.width(word, CELL, bold=True) for word in column.title.split()]
        word = max((*heads, *(fonts.width(word, CELL) for word in _longest(words))), default=0.0)
        head = max(fonts.width(column.title, CELL, bold=True), fonts.width(column.unit, CELL))
        widest = max((fonts.width(text, CELL) for text in _longest(set(texts))), default=0.0)
        lengths = np.array([len(text) for text in texts], dtype=np.float64)
        each = lengths * (widest / max(lengths.max(initial=0.0), 1.0))
        beside = pads + 1.0
        most = max(widest, min(head, 60.0), word)
        return cls(word + beside, most + beside, each + beside * (lengths > 0))

    def usual(self) -> tuple[float, ...]:
        """Widths of a usual text: the mean, that of texts which are not empty, the root mean square."""
        filled = self.each[self.each > 0]
        if not filled.size:
            return (0.0, 0.0, 0.0)
        return float(self.each.mean()), float(filled.mean()), math.sqrt(float(np.mean(self.each**2)))


def _unbroken(unit: str) -> str:
    """A unit whose reference stays on one line, as 20 \u00b5Pa."""
    return re.sub(r"(?<=\d) ", "\u00a0", unit)


def _longest(texts: set[str]) -> list[str]:
    """The few texts that can be the widest: not each of thousands is measured."""
    return sorted(texts, key=lambda text: (-len(text), text))[:12]


def _widths(asked: Sequence[_Asked], room: float) -> list[float]:
    """Widths within the room: as asked where all fit, else those of a few shares of it that make the lowest table.

    No column is narrower than its widest word.
    """
    if sum(one.most for one in asked) <= room:
        return [one.most for one in asked]
    shares = [_shared(asked, usual, room) for usual in zip(*(one.usual() for one in asked), strict=True)]
    return min(shares, key=lambda widths: _lines(asked, widths))


def _lines(asked: Sequence[_Asked], widths: Sequence[float]) -> float:
    """Lines of all rows, about: a line ends before its edge, as words are not broken."""
    full = [one.each / width for one, width in zip(asked, widths, strict=True)]
    rows = [np.where(part <= 1.0, 1.0, np.ceil(part / _FILLED)) for part in full]
    return float(np.max(rows, axis=0).sum())


def _shared(asked: Sequence[_Asked], usual: Sequence[float], room: float) -> list[float]:
    """Widths that let the usual text of each column take as many lines; their number is found by halving."""

    def of(lines: float) -> list[float]:
        return [min(max(one.least, width / lines), one.most) for one, width in zip(asked, usual, strict=True)]

    few, many = _FEWEST_LINES, _MOST_LINES
    for _ in range(60):
        middle = math.sqrt(few * many)
        few, many = (middle, many) if sum(of(middle)) > room else (few, middle)
    return of(many)


def _groups(least: Sequence[float], room: float) -> list[list[int]]:
    """Columns in as many groups as the room makes necessary; each begins with the first column."""
    groups: list[list[int]] = []
    for place in range(1, len(least)):
        if groups and sum(least[i] for i in groups[-1]) + least[place] <= room:
            groups[-1].append(place)
        else:
            groups.append([0, place])
    return groups


def _part(
    table: Table,
    rows: Sequence[Sequence[Cell]],
    places: Sequence[int],
    widths: Sequence[float],
    across: bool,
    fonts: Fonts,
    pad: float,
    whole: bool,
) -> Part:
    columns = [table.columns[place] for place in places]
    lefts = [_left_pads(table.columns, pad)[place] for place in places]
    rooms = [width - left - pad for width, left in zip(widths, lefts, strict=True)]
    head = [_head(column, fonts) for column in columns]
    body = [
        [_cell(column, row[place], room, fonts) for column, place, room in zip(columns, places, rooms, strict=True)]
        for row in rows
    ]
    made = LeftTable([head, *body], colWidths=list(widths), repeatRows=1, splitInRow=1, spaceAfter=8.0)
    made.setStyle(_look(columns, lefts, pad))
    start = sum(max(_height(cell, room) for cell, room in zip(line, rooms, strict=True)) for line in (head, *body[:3]))
    return Part(made, across, start, None if whole else (places[1] + 1, places[-1] + 1))


def _left_pads(columns: Sequence[Column], pad: float) -> list[float]:
    """Points left of the text of each column."""
    sides = [column.side for column in columns]
    return [pad + _APART * (at > 0 and side == "left" and sides[at - 1] == "right") for at, side in enumerate(sides)]


def _paragraph(marked: str, align: str) -> Paragraph:
    return Paragraph(marked, style("cell" if align == "left" else f"cell-{align}"))


def _head(column: Column, fonts: Fonts) -> Paragraph:
    title, unit = (cut_text(text, _MOST_IN_HEAD) for text in (column.title, column.unit))
    below = f"<br/>{muted(markup(_unbroken(unit), fonts))}" if unit else ""
    return _paragraph(f"{markup(title, fonts, bold=True)}{below}", column.side)


def _shortened(text: str) -> str:
    if len(text) <= MOST_SIGNS:
        return text
    left = len(text) - MOST_SIGNS
    more = say_count("{count} more sign", "{count} more signs", left)
    return f"{text[:MOST_SIGNS]}\u2026 ({more})"


def _cell(column: Column, cell: Cell, room: float, fonts: Fonts) -> Any:
    """A cell as text where it fits on a line in the regular font, else as a paragraph."""
    text = _shortened(cell_text(column, cell))
    if isinstance(cell, Link):
        return _paragraph(f'<a href="{cell.href}" color="{colour("series-0")}">{markup(text, fonts)}</a>', column.side)
    if fonts.simple(text) and fonts.width(text, CELL) <= room:
        return text
    return _paragraph(markup(text, fonts), column.side)


def _height(cell: Any, room: float) -> float:
    if isinstance(cell, str):
        return 8.8 + 2 * 1.8
    return float(cell.wrap(room, 10_000.0)[1]) + 2 * 1.8


def _look(columns: Sequence[Column], lefts: Sequence[float], pad: float) -> list[tuple[Any, ...]]:
    line, head = HexColor(colour("grid")), HexColor(colour("axis"))
    look: list[tuple[Any, ...]] = [
        ("FONT", (0, 0), (-1, -1), REGULAR, CELL, 8.8),
        ("TEXTCOLOR", (0, 0), (-1, -1), HexColor(colour("ink"))),
        ("VALIGN", (0, 0), (-1, 0), "BOTTOM"),
        ("VALIGN", (0, 1), (-1, -1), "TOP"),
        ("TOPPADDING", (0, 0), (-1, -1), 1.8),
        ("BOTTOMPADDING", (0, 0), (-1, -1), 1.8),
        ("RIGHTPADDING", (0, 0), (-1, -1), pad),
        ("LINEABOVE", (0, 0), (-1, 0), 0.8, head),
        ("LINEBELOW", (0, 0), (-1, 0), 0.8, head),
        ("LINEBELOW", (0, 1), (-1, -1), 0.3, line),
    ]
    look += [("LEFTPADDING", (i, 0), (i, -1), left) for i, left in enumerate(lefts)]
    look += [("ALIGN", (i, 0), (i, -1), column.side.upper()) for i, column in enumerate(columns)]
    return look

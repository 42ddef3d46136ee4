"""What a reader sees of a cell, a notice and an origin, the same on a page and on paper."""

from __future__ import annotations

from typing import Final

from tdacoustic.reporting.document import Cell, Column, Link, Shown
from tdacoustic.reporting.language import mark, say

__all__ = ["NOTICE_WORDS", "ORIGIN_SENTENCES", "ORIGIN_WORDS", "cell_text", "number_text", "range_text"]

NOTICE_WORDS: Final = {
    "info": mark("Note"),
    "warning": mark("Warning"),
    "bad": mark("Problem"),
    "synthetic": mark("Synthetic"),
    "assumed": mark("Assumed"),
}
"""What a notice of each kind begins with."""
ORIGIN_WORDS: Final = {
    "measured": mark("measured"),
    "synthetic": mark("synthetic"),
    "printed": mark("printed"),
    "assumed": mark("assumed"),
    "calculated": mark("calculated"),
    "mixed": mark("mixed"),
}
"""Where a number comes from, as tags say it."""
ORIGIN_SENTENCES: Final = {
    "measured": mark("The data of this report were measured."),
    "synthetic": mark("The data of this report were made by a program. They are not measurements."),
    "printed": mark("The data of this report were taken from a publication."),
    "assumed": mark("The data of this report are assumptions."),
    "calculated": mark("The data of this report were calculated by a model. They are not measurements."),
    "mixed": mark("The data of this report are of several origins. Each number says its own."),
}
"""What a report of each origin says of itself."""
_CHIP_WORDS: Final = ORIGIN_WORDS | {
    "ok": mark("ok"),
    "warning": mark("warning"),
    "bad": mark("bad"),
    "motor": mark("motor"),
    "gearbox": mark("gearbox"),
    "undecided": mark("undecided"),
    "torque": mark("torque"),
    "speed": mark("speed"),
}
"""Words of the tables that stand in a tag; files have them in English."""


def number_text(value: float, digits: int | None) -> str:
    """Write a number for reading, with a true minus sign.

    Parameters
    ----------
    value : float
    digits : int or None
        Decimals; None: six significant digits.

    Examples
    --------
    >>> number_text(-3.256, 1), number_text(-0.01, 1)
    ('−3.3', '0.0')
    """
    text = f"{value:.{digits}f}" if digits is not None else f"{value:.6g}"
    if text.startswith("-") and not text.strip("-0."):
        text = text[1:]
    return text.replace("-", "\u2212")


def range_text(low: str, high: str) -> str:
    """Return a range between two numbers that are written already, without or with their unit.

    Examples
    --------
    >>> range_text("300", "1500 rpm")
    '300 to 1500 rpm'
    """
    return say("{low} to {high}", low=low, high=high)


def cell_text(column: Column, cell: Cell) -> str:
    """Write a cell of a table for reading; a number that is not determined is a dash.

    Examples
    --------
    >>> cell_text(Column("valid", "Valid"), True), cell_text(Column("level_db", "Level", kind="number"), None)
    ('yes', '–')
    """
    if cell is None:
        return "\u2013" if column.kind == "number" else ""
    if isinstance(cell, Link | Shown):
        return cell.text
    if isinstance(cell, bool):
        return say("yes") if cell else say("no")
    if isinstance(cell, str):
        return say(_CHIP_WORDS.get(cell, cell)) if column.kind in ("origin", "verdict") else cell
    return number_text(cell, column.digits)

"""Paragraphs of the PDF: their styles, and text made safe for reportlab's markup."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final
from xml.sax.saxutils import escape

from reportlab.lib.styles import ParagraphStyle
from reportlab.platypus import Paragraph

from tdacoustic.reporting.palette import colour
from tdacoustic.reporting.pdf.fonts import BOLD, REGULAR, Fonts

__all__ = ["BODY", "CELL", "Anchored", "markup", "muted", "style"]

BODY: Final = 9.0
"""Size of the text in points."""
CELL: Final = 7.0
"""Size of the text of tables in points."""

_INK, _MUTED = colour("ink"), colour("muted")


def _styles() -> dict[str, ParagraphStyle]:
    base: dict[str, Any] = {
        "fontName": REGULAR,
        "bulletFontName": REGULAR,
        "textColor": _INK,
        "splitLongWords": 1,
        "allowWidows": 0,
    }
    said: dict[str, dict[str, Any]] = {
        "body": {"fontSize": BODY, "leading": 13.0, "spaceAfter": 6.0, "rightIndent": 24.0},
        "bullet": {"fontSize": BODY, "leading": 13.0, "spaceAfter": 3.0, "rightIndent": 24.0, "leftIndent": 12.0},
        "title": {"fontName": BOLD, "fontSize": 19.0, "leading": 24.0, "spaceAfter": 4.0},
        "subtitle": {"fontSize": 11.0, "leading": 15.0, "spaceAfter": 8.0, "textColor": _MUTED},
        "h0": {"fontName": BOLD, "fontSize": 14.0, "leading": 18.0, "spaceBefore": 16.0, "spaceAfter": 7.0},
        "h1": {"fontName": BOLD, "fontSize": 11.5, "leading": 15.0, "spaceBefore": 13.0, "spaceAfter": 5.0},
        "h2": {"fontName": BOLD, "fontSize": 10.0, "leading": 13.0, "spaceBefore": 10.0, "spaceAfter": 4.0},
        "fold": {"fontName": BOLD, "fontSize": BODY, "leading": 12.0, "spaceBefore": 8.0, "spaceAfter": 4.0},
        "caption": {"fontSize": 8.0, "leading": 11.0, "spaceBefore": 4.0, "spaceAfter": 12.0, "rightIndent": 24.0},
        "above": {"fontSize": 8.0, "leading": 11.0, "spaceBefore": 6.0, "spaceAfter": 4.0, "rightIndent": 24.0},
        "small": {"fontSize": 7.5, "leading": 10.0, "spaceBefore": 3.0, "spaceAfter": 8.0, "textColor": _MUTED},
        "cell": {"fontSize": CELL, "leading": 8.8},
        "cell-right": {"fontSize": CELL, "leading": 8.8, "alignment": 2},
        "cell-center": {"fontSize": CELL, "leading": 8.8, "alignment": 1},
        "fact": {"fontSize": 8.5, "leading": 11.5},
        "contents-0": {"fontName": BOLD, "fontSize": 9.0, "leading": 12.0},
        "contents-1": {"fontSize": 8.5, "leading": 11.0, "leftIndent": 12.0},
        "contents-2": {"fontSize": 8.0, "leading": 10.0, "leftIndent": 26.0},
        "page-number": {"fontSize": 8.5, "leading": 11.0, "alignment": 2},
    }
    return {name: ParagraphStyle(name, **{**base, **more}) for name, more in said.items()}


_STYLES: Final[Mapping[str, ParagraphStyle]] = _styles()


def style(name: str) -> ParagraphStyle:
    """Return a paragraph style by its name."""
    return _STYLES[name]


def markup(text: str, fonts: Fonts, bold: bool = False) -> str:
    """Return a text as reportlab's markup that shows it literally, each part in a font that has its signs.

    Parameters
    ----------
    text : str
    fonts : Fonts
    bold : bool
    """
    own = BOLD if bold else REGULAR
    parts = []
    for font, part in fonts.runs(text, bold):
        safe = escape(part)
        parts.append(safe if font == own and not bold else f'<font name="{font}">{safe}</font>')
    return "".join(parts)


def muted(marked: str) -> str:
    """Return markup in the colour of what is said beside."""
    return f'<font color="{_MUTED}">{marked}</font>'


class Anchored(Paragraph):
    """A paragraph that links lead to; a heading is also an entry of the bookmarks and of the contents.

    `anchor` names it; `entry`, of a heading, is its depth from 0, its text, and its markup for the contents.
    """

    anchor: str | None = None
    entry: tuple[int, str, str] | None = None

    def split(self, availWidth: float, availHeight: float) -> list[Any]:
        """Split as a paragraph does; links lead to the first part."""
        parts = super().split(availWidth, availHeight)
        if parts:
            parts[0].anchor, parts[0].entry = self.anchor, self.entry
        return list(parts)

    def draw(self) -> None:
        """Draw it, and mark the place."""
        if self.anchor is not None:
            self.canv.bookmarkHorizontal(self.anchor, 0, self.height + 6.0)
            if self.entry is not None:
                depth, text, _ = self.entry
                self.canv.addOutlineEntry(text, self.anchor, depth, closed=depth > 0)
        super().draw()

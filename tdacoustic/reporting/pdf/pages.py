"""The pages of the PDF: A4, upright or across; each says whose report it is, where its data come from, its number."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any, Final

from reportlab.lib.colors import HexColor
from reportlab.lib.pagesizes import A4, landscape
from reportlab.pdfbase.pdfdoc import PDFDictionary, PDFInfo, PDFString
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import BaseDocTemplate, Flowable, Frame, PageTemplate, Paragraph
from reportlab.platypus import Table as Grid
from reportlab.platypus.doctemplate import IndexingFlowable
from reportlab.platypus.tableofcontents import TableOfContents

from tdacoustic import __version__
from tdacoustic.reporting.document import Document
from tdacoustic.reporting.language import say, spoken
from tdacoustic.reporting.palette import colour
from tdacoustic.reporting.pdf.fonts import REGULAR, Fonts, plain
from tdacoustic.reporting.pdf.text import Anchored, style
from tdacoustic.reporting.shown import ORIGIN_WORDS

__all__ = ["ACROSS", "LOWEST", "UPRIGHT", "WIDTHS", "Book", "Contents"]

_SIDE: Final = (A4[0] - 7.2 * 72.0) / 2.0
"""Margin that leaves a figure the 7.2 inches it is drawn for."""
_TOP, _BOTTOM = 62.0, 52.0
WIDTHS: Final = (A4[0] - 2 * _SIDE, A4[1] - 2 * _SIDE)
"""Of the text on a page and on one in landscape, in points."""
LOWEST: Final = min(A4) - _TOP - _BOTTOM
"""Height of the text on a page in landscape, the lower of the two."""
UPRIGHT, ACROSS = "upright", "across"
"""Names of the two kinds of page."""


class _Info(PDFInfo):
    """What a file says of itself, without the dates that reportlab invents."""

    def format(self, document: Any) -> Any:
        said = {"Title": self.title, "Subject": self.subject, "Keywords": self.keywords}
        said |= {"Creator": self.creator, "Producer": self.producer}
        return PDFDictionary({key: PDFString(value) for key, value in said.items() if value}).format(document)


class _PageCount(IndexingFlowable):
    """Takes no room; asks for another pass until the number of pages is the one that was printed."""

    def __init__(self) -> None:
        super().__init__()
        self.printed, self.counted = 0, -1

    def isSatisfied(self) -> bool:
        return self.printed == self.counted

    def wrap(self, availWidth: float, availHeight: float) -> tuple[float, float]:
        return 0.0, 0.0

    def draw(self) -> None:
        pass


class Contents(TableOfContents):
    """The headings with the pages they stand on, both links; without the rows of dots, which are read as text."""

    def wrap(self, availWidth: float, availHeight: float) -> tuple[float, float]:
        """Lay out what the pass before found; nothing in the first."""
        rows = [
            [
                Paragraph(f'<a href="#{key}">{marked}</a>', style(f"contents-{depth}")),
                Paragraph(f'<a href="#{key}">{page}</a>', style("page-number")),
            ]
            for depth, marked, page, key in self._lastEntries
        ] or [["", ""]]
        self._table = Grid(rows, colWidths=[availWidth - 30.0, 30.0])
        above = [("TOPPADDING", (0, at), (-1, at), 5.0) for at, entry in enumerate(self._lastEntries) if not entry[0]]
        sides = [(f"{side}PADDING", (0, 0), (-1, -1), 0.8) for side in ("LEFT", "RIGHT", "TOP", "BOTTOM")]
        self._table.setStyle(
            [("FONTNAME", (0, 0), (-1, -1), REGULAR), *sides, *above, ("VALIGN", (0, 0), (-1, -1), "BOTTOM")]
        )
        self.width, self.height = self._table.wrapOn(self.canv, availWidth, availHeight)
        return self.width, self.height


class Book(BaseDocTemplate):
    """Pages with header and number; tells the contents where headings came to stand.

    Parameters
    ----------
    target : BytesIO
    document : Document
        For the header, and for what the file says of itself.
    fonts : Fonts
    """

    def __init__(self, target: io.BytesIO, document: Document, fonts: Fonts) -> None:
        super().__init__(
            target,
            pagesize=A4,
            title=plain(document.title),
            subject=plain(document.subtitle),
            author="",
            keywords=say("data: {origin}", origin=say(ORIGIN_WORDS[document.origin])),
            creator=f"tdacoustic {__version__}",
            lang=spoken().code,
            invariant=1,
            pageCompression=1,
            displayDocTitle=True,
            initialFontName=REGULAR,
        )
        self.count = _PageCount()
        self._fonts = fonts
        self._whose = document.title
        self._data = say("data: {origin}", origin=say(ORIGIN_WORDS[document.origin]))
        self.addPageTemplates([self._template(UPRIGHT, A4), self._template(ACROSS, landscape(A4))])

    def _template(self, name: str, size: tuple[float, float]) -> PageTemplate:
        frame = Frame(_SIDE, _BOTTOM, size[0] - 2 * _SIDE, size[1] - _TOP - _BOTTOM, 0, 0, 0, 0, id=f"frame-{name}")
        return PageTemplate(name, [frame], onPage=self._dress, pagesize=size)

    def _dress(self, canvas: Canvas, book: BaseDocTemplate) -> None:
        """Draw header and number of a page."""
        width, height = canvas._pagesize
        canvas.saveState()
        canvas.setFillColor(HexColor(colour("muted")))
        right = self._fonts.width(self._data, 7.5, bold=True)
        title = _fitting(self._whose, width - 2 * _SIDE - right - 24.0, self._fonts)
        _line(canvas, _SIDE, height - 38.0, self._fonts.runs(title))
        _line(canvas, width - _SIDE - right, height - 38.0, self._fonts.runs(self._data, bold=True))
        pages = self.count.printed or "?"
        number = say("page {page} of {pages}", page=book.page, pages=pages)
        _line(canvas, width - _SIDE - self._fonts.width(number, 7.5), 30.0, self._fonts.runs(number))
        canvas.setStrokeColor(HexColor(colour("grid")))
        canvas.line(_SIDE, height - 44.0, width - _SIDE, height - 44.0)
        canvas.restoreState()

    def beforeDocument(self) -> None:
        """Begin a pass: what the file says of itself, and the bookmarks in sight."""
        self.count.printed = max(self.count.counted, 0)
        info = _Info()
        info.__dict__.update(self.canv._doc.info.__dict__)
        self.canv._doc.info = info
        self.canv.showOutline()

    def afterFlowable(self, flowable: Flowable) -> None:
        """Tell the contents of a heading."""
        if isinstance(flowable, Anchored) and flowable.entry is not None and flowable.entry[2]:
            depth, _, marked = flowable.entry
            self.notify("TOCEntry", (depth, marked, self.page, flowable.anchor))

    def _endBuild(self) -> None:
        super()._endBuild()
        self.count.counted = self.page


def _line(canvas: Canvas, x: float, y: float, runs: Sequence[tuple[str, str]]) -> None:
    text = canvas.beginText(x, y)
    for font, words in runs:
        text.setFont(font, 7.5)
        text.textOut(words)
    canvas.drawText(text)


def _fitting(text: str, room: float, fonts: Fonts) -> str:
    """As much of a text as there is room for, with a mark where it is cut."""
    if fonts.width(text[:400], 7.5) <= room and len(text) <= 400:
        return text
    kept = text[:400]
    while kept and fonts.width(f"{kept}\u2026", 7.5) > room:
        kept = kept[:-1]
    return f"{kept}\u2026"

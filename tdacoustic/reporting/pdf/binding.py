"""A document as a PDF: its head, its summary, the contents, its sections."""

from __future__ import annotations

import dataclasses
import io
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from reportlab.platypus import CondPageBreak, Flowable, Image, NextPageTemplate, PageBreak, Paragraph

from tdacoustic.reporting.document import Document, House, Notice, Section
from tdacoustic.reporting.language import mark, say, spoken
from tdacoustic.reporting.pdf.fonts import Fonts, prepared
from tdacoustic.reporting.pdf.pages import ACROSS, LOWEST, UPRIGHT, WIDTHS, Book, Contents
from tdacoustic.reporting.pdf.story import Piece, Story, section_numbers
from tdacoustic.reporting.pdf.text import markup, style
from tdacoustic.reporting.shown import ORIGIN_SENTENCES

__all__ = ["bound"]

_LOGO: Final = (150.0, 42.0)
"""The most that a logo is wide and high, in points."""
_MOST_PASSES: Final = 8
_NOT_EMBEDDED: Final = mark(
    "Chinese signs are shown by the program that opens this file, if it has a font for them. "
    "pip install 'tdacoustic[pdf]' installs one that is put into the file."
)
_CODED: Final = mark("A sign that no font of this file has is shown by its code, such as [U+1F600].")


def bound(document: Document) -> bytes:
    """Return a document as the bytes of a PDF; see `tdacoustic.reporting.pdf.render_pdf`.

    Parameters
    ----------
    document : Document
    """
    fonts = prepared([*_texts(document), *_translations()])
    story = Story(fonts, WIDTHS, section_numbers(document.sections), document.lineage)
    _head(story, document, fonts)
    if document.summary:
        story.section(Section("summary", say("Summary"), document.summary), 0)
    if document.sections:
        story.pieces.append(Piece(Paragraph(markup(say("Contents"), fonts, bold=True), style("h0")), 40.0, leads=True))
        story.pieces.append(Piece(Contents(), 80.0))
    for section in document.sections:
        story.section(section, 0)
    for line in document.footer:
        story.text(line, "small")
    target = io.BytesIO()
    book = Book(target, document, fonts)
    book.multiBuild([*_flow(story.pieces), book.count], maxPasses=_MOST_PASSES)
    return target.getvalue()


def _texts(value: Any) -> Iterator[str]:
    """Every text of a document, those of its figures too."""
    if isinstance(value, str):
        yield value
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        for field in dataclasses.fields(value):
            yield from _texts(getattr(value, field.name))
    elif isinstance(value, Sequence) and not isinstance(value, bytes):
        for item in value:
            yield from _texts(item)
    elif isinstance(value, Mapping):
        yield from _texts(tuple(value.values()))


def _translations() -> Iterator[str]:
    """All texts of the language: the pages say some that no block of a document holds, as their numbers."""
    yield from spoken().texts.values()
    for forms in spoken().counted.values():
        yield from forms


def _head(story: Story, document: Document, fonts: Fonts) -> None:
    """Whose report it is, what it is called, where its data come from, and what must not be missed."""
    house = document.house
    if house is not None:
        story.pieces += [Piece(logo, 0.0) for logo in _logo(house)]
        if house.company:
            story.text(house.company, "fold", bold=True)
        for line in house.lines:
            story.text(line, "small")
    story.text(say(ORIGIN_SENTENCES[document.origin]), "small")
    story.text(document.title, "title", bold=True)
    if document.subtitle:
        story.text(document.subtitle, "subtitle")
    story.facts(document.facts)
    notices = [*document.notices]
    notices += [] if fonts.embedded else [Notice("info", say(_NOT_EMBEDDED))]
    notices += [Notice("info", say(_CODED))] if fonts.coded else []
    for notice in notices:
        story.notice(notice)


def _logo(house: House) -> list[Flowable]:
    if not house.logo:
        return []
    picture = Image(io.BytesIO(house.logo), hAlign="LEFT", mask="auto")
    picture._restrictSize(*_LOGO)
    return [picture]


def _flow(pieces: Sequence[Piece]) -> list[Flowable]:
    """Pieces in order, with page breaks where one does not begin well on what is left of a page.

    What leads goes with what it leads to, onto a page in landscape too.
    """
    flow: list[Flowable] = []
    led: list[Piece] = []
    across = False
    for piece in pieces:
        if piece.leads:
            led.append(piece)
            continue
        if piece.across != across:
            across = piece.across
            flow += [NextPageTemplate(ACROSS if across else UPRIGHT), PageBreak()]
        need = sum(one.need for one in led) + piece.need
        if need:
            flow.append(CondPageBreak(min(need, 0.94 * LOWEST)))
        flow += [one.flowable for one in (*led, piece)]
        led = []
    return [*flow, *(one.flowable for one in led)]

"""The blocks of a document as what flows over the pages of the PDF."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from reportlab.lib.colors import HexColor
from reportlab.platypus import Flowable, Paragraph

from tdacoustic.reporting.document import (
    Alternatives,
    Details,
    Fact,
    Facts,
    FigureBlock,
    Notice,
    Section,
    Sentences,
    Sound,
    Table,
)
from tdacoustic.reporting.document import Paragraph as Words
from tdacoustic.reporting.figure import ReportError
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.layout import cut_text
from tdacoustic.reporting.matplotlib_renderer import is_thinned
from tdacoustic.reporting.palette import colour
from tdacoustic.reporting.pdf.figures import kept_figure
from tdacoustic.reporting.pdf.fonts import REGULAR, Fonts
from tdacoustic.reporting.pdf.tables import MOST_ROWS, LeftTable, laid_out
from tdacoustic.reporting.pdf.text import Anchored, markup, muted, style
from tdacoustic.reporting.shown import NOTICE_WORDS, ORIGIN_WORDS

__all__ = ["Piece", "Story", "section_numbers"]

_DEEPEST_IN_CONTENTS: Final = 2
_LONGEST_IN_CONTENTS: Final = 400
"""Signs of a title in the contents; a row of them is not broken over pages."""
_FONT: Final = ("FONTNAME", (0, 0), (-1, -1), REGULAR)
"""reportlab's own default is not embedded, and would be named in the file though nothing is set in it."""
_NUMBERED: Final = {
    "figure": mark("Figure {number}."),
    "table": mark("Table {number}."),
    "sound": mark("Sound {number}."),
}
"""What a caption begins with."""
_NOTICE_COLOURS: Final = {"info": "series-0", "warning": "series-4", "bad": "series-1", "synthetic": "series-3"}


@dataclass(frozen=True)
class Piece:
    """Something that flows over the pages.

    Parameters
    ----------
    flowable : Flowable
    need : float
        Height that must be left on a page for it to begin there, in points.
    across : bool
        Whether it stands on a page in landscape.
    leads : bool
        Whether it must not be the last thing on a page: a heading, the caption above a table.
    """

    flowable: Flowable
    need: float
    across: bool = False
    leads: bool = False


def section_numbers(sections: Sequence[Section]) -> dict[str, str]:
    """Return the number of each section by its id, as the HTML page has them.

    Parameters
    ----------
    sections : sequence of Section
        Of a document.

    Examples
    --------
    >>> section_numbers([Section("one", "One", []), Section("two", "Two", [Section("inner", "Inner", [])])])
    {'one': '1', 'two': '2', 'inner': '2.1'}
    """
    numbers: dict[str, str] = {}

    def inside(block: Any, number: str) -> None:
        if isinstance(block, Section):
            numbers[block.id] = number
        if isinstance(block, Section | Details):
            below(block.blocks, number)
        elif isinstance(block, Alternatives):
            for _, blocks in block.views:
                below(blocks, number)

    def below(blocks: Sequence[Any], number: str) -> None:
        count = 0
        for block in blocks:
            count += isinstance(block, Section)
            inside(block, f"{number}.{count}")

    for count, section in enumerate(sections, start=1):
        inside(section, str(count))
    return numbers


class Story:
    """Turns blocks into pieces; counts figures, tables and sounds as the HTML page does.

    Parameters
    ----------
    fonts : Fonts
    widths : (float, float)
        Of the text on a page and on one in landscape, in points.
    numbers : mapping of str to str
        Of the sections by their ids.
    lineage : mapping of str to str
        As of a `Document`.
    """

    def __init__(
        self, fonts: Fonts, widths: tuple[float, float], numbers: Mapping[str, str], lineage: Mapping[str, str]
    ) -> None:
        self.pieces: list[Piece] = []
        self._fonts = fonts
        self._widths = widths
        self._numbers = numbers
        self._lineage = lineage
        self._behind: str | None = None
        self._counts = {"figure": 0, "table": 0, "sound": 0}
        self._add: dict[type, Callable[[Any, int], None]] = {
            Words: self._words,
            Sentences: self._sentences,
            Notice: lambda block, depth: self.notice(block),
            Facts: lambda block, depth: self.facts(block.pairs),
            Table: self._table,
            FigureBlock: self._figure,
            Sound: self._sound,
            Details: self._details,
            Alternatives: self._alternatives,
            Section: self.section,
        }

    def add(self, block: Any, depth: int) -> None:
        """Add a block inside a section of this depth from 0.

        Raises
        ------
        ReportError
            It is of a kind that is not known here: nothing is left out in silence.
        """
        known = self._add.get(type(block))
        if known is None:
            raise ReportError(f"the PDF has no way to show a block of kind {type(block).__name__!r}")
        known(block, depth)

    def section(self, section: Section, depth: int) -> None:
        """Add a section, its heading first."""
        number = self._numbers.get(section.id, "")
        head = f"{number}\u2002{section.title}" if number else section.title
        paragraph = Anchored(markup(head, self._fonts, bold=True), style(f"h{min(depth, 2)}"))
        paragraph.anchor = section.id
        contents = markup(cut_text(head, _LONGEST_IN_CONTENTS), self._fonts, bold=depth == 0)
        paragraph.entry = (depth, head, contents if depth <= _DEEPEST_IN_CONTENTS else "")
        self._lead(paragraph)
        outside, self._behind = self._behind, self._lineage.get(section.id, self._behind)
        for block in section.blocks:
            self.add(block, depth + 1)
        self._behind = outside

    def text(self, text: str, name: str, bold: bool = False) -> None:
        """Add a paragraph of a style."""
        self._flowing(Paragraph(markup(text, self._fonts, bold), style(name)))

    def notice(self, notice: Notice) -> None:
        """Add a notice: a bar, the word that says what sort it is, its text."""
        word = markup(say(NOTICE_WORDS[notice.kind]), self._fonts, bold=True)
        said = Paragraph(f"{word}\u2002{markup(notice.text, self._fonts)}", style("fact"))
        bar = HexColor(colour(_NOTICE_COLOURS.get(notice.kind, "series-7")))
        grid = LeftTable([[said]], colWidths=[self._widths[0]], splitInRow=1, spaceBefore=2.0, spaceAfter=4.0)
        grid.setStyle([_FONT, ("LINEBEFORE", (0, 0), (0, -1), 2.5, bar), ("LEFTPADDING", (0, 0), (-1, -1), 8.0)])
        self._put(grid, 40.0)

    def facts(self, facts: Sequence[Any]) -> None:
        """Add keys and values."""
        rows = [[self._plain(fact.key, bold=False, soft=True), self._value(fact)] for fact in facts]
        if not rows:
            return
        keys = max(self._fonts.width(fact.key, 8.5) for fact in facts) + 10.0
        widths = [min(keys, 0.3 * self._widths[0]), 0.0]
        widths[1] = 0.92 * self._widths[0] - widths[0]
        grid = LeftTable(rows, colWidths=widths, splitInRow=1, spaceAfter=8.0)
        grid.setStyle(
            [_FONT, ("VALIGN", (0, 0), (-1, -1), "TOP"), ("LEFTPADDING", (0, 0), (-1, -1), 0.0)]
            + [(f"{side}PADDING", (0, 0), (-1, -1), 1.2) for side in ("TOP", "BOTTOM")]
        )
        self._put(grid, 40.0)

    def _plain(self, text: str, bold: bool = False, soft: bool = False) -> Paragraph:
        marked = markup(text, self._fonts, bold)
        return Paragraph(muted(marked) if soft else marked, style("fact"))

    def _value(self, fact: Fact) -> Paragraph:
        return Paragraph(f"{markup(fact.value, self._fonts)}{self._origin(fact.origin)}", style("fact"))

    def _origin(self, origin: str | None) -> str:
        """An origin in words, as it follows what it is of."""
        return f" {muted(markup(f'[{say(ORIGIN_WORDS[origin])}]', self._fonts, bold=True))}" if origin else ""

    def _came_about(self) -> str:
        """The link to how something came about, as it ends a caption."""
        if self._behind is None:
            return ""
        words, number = say("How it came about"), self._numbers.get(self._behind, "")
        where = markup(f"{words}: {number}" if number else words, self._fonts)
        return f' <a href="#{self._behind}" color="{colour("series-0")}">{where}</a>'

    def _put(self, flowable: Flowable, need: float, across: bool = False) -> None:
        self.pieces.append(Piece(flowable, need, across))

    def _flowing(self, paragraph: Paragraph) -> None:
        """Add a paragraph that begins where two of its lines fit, or all of a short one: it leaves no single line."""
        height = paragraph.wrap(self._widths[0], 10_000.0)[1]
        leading = paragraph.style.leading
        self._put(paragraph, height if height < 3.5 * leading else 2 * leading)

    def _lead(self, paragraph: Paragraph) -> None:
        height = paragraph.wrap(self._widths[0], 10_000.0)[1] + paragraph.style.spaceBefore + paragraph.style.spaceAfter
        self.pieces.append(Piece(paragraph, height, leads=True))

    def _words(self, block: Words, depth: int) -> None:
        self.text(block.text, "body")

    def _sentences(self, block: Sentences, depth: int) -> None:
        for item in block.items:
            self._flowing(Paragraph(markup(item, self._fonts), style("bullet"), bulletText="\u2022"))

    def _details(self, block: Details, depth: int) -> None:
        self._lead(Paragraph(markup(block.summary, self._fonts, bold=True), style("fold")))
        for inside in block.blocks:
            self.add(inside, depth)

    def _alternatives(self, block: Alternatives, depth: int) -> None:
        for name, blocks in block.views:
            self._lead(Paragraph(markup(f"{block.label}: {name}", self._fonts, bold=True), style("fold")))
            for inside in blocks:
                self.add(inside, depth)

    def _caption(self, kind: str, anchor: str, marked: str, name: str) -> Anchored:
        self._counts[kind] += 1
        number = markup(say(_NUMBERED[kind], number=self._counts[kind]), self._fonts, bold=True)
        made = Anchored(f"{number} {marked}", style(name))
        made.anchor = anchor
        return made

    def _titled(self, title: str, origin: str | None, caption: str) -> str:
        said = f" {markup(caption, self._fonts)}" if caption else ""
        return f"{markup(title.rstrip('.') + '.', self._fonts, bold=True)}{self._origin(origin)}{said}"

    def _figure(self, block: FigureBlock, depth: int) -> None:
        figure = block.figure
        marked = self._titled(figure.title, block.origin, figure.caption) + self._came_about()
        if is_thinned(figure):
            marked += muted(
                markup(" " + say("Drawn with fewer points than the data have; every maximum is kept."), self._fonts)
            )
        caption = self._caption("figure", f"fig-{figure.name}", marked, "caption")
        picture = kept_figure(figure, self._fonts)
        beside = min(caption.wrap(self._widths[0], 10_000.0)[1], 80.0) + 10.0
        self._put(picture, picture.wrap(self._widths[0], 10_000.0)[1] + beside)
        self._put(caption, 0.0)

    def _sound(self, block: Sound, depth: int) -> None:
        tracks = "; ".join(f"{track.label}: {track.text}" if track.text else track.label for track in block.tracks)
        heard = say("To be heard in the HTML page: {tracks}.", tracks=tracks.rstrip("."))
        marked = self._titled(block.title, block.origin, f"{block.caption} {heard}".strip()) + self._came_about()
        self._put(self._caption("sound", f"sound-{block.name}", marked, "caption"), 30.0)

    def _table(self, block: Table, depth: int) -> None:
        marked = markup(block.caption, self._fonts) + self._origin(block.origin) + self._came_about()
        caption = self._caption("table", f"tab-{block.name}", marked, "above")
        self._lead(caption)
        if len(block.rows) > MOST_ROWS:
            held = say(
                "The first {shown} of {rows} rows; the HTML page has all and saves them as {file}.",
                shown=MOST_ROWS,
                rows=len(block.rows),
                file=block.csv_name,
            )
            self._lead(Paragraph(markup(held, self._fonts), style("small")))
        parts = laid_out(block, self._fonts, *self._widths)
        for part in parts:
            if part.columns is not None:
                words = say(
                    "Columns {first} to {last} of {count}.",
                    first=part.columns[0],
                    last=part.columns[1],
                    count=len(block.columns),
                )
                self._lead(Paragraph(markup(words, self._fonts), style("small")))
            self._put(part.flowable, part.start_height, part.across)
        if not block.rows:
            self._put(Paragraph(markup(say("No rows."), self._fonts), style("small")), 0.0, parts[-1].across)

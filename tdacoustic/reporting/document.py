"""What a report says, independent of how a page shows it.

A `Document` is made of sections, a section of blocks: paragraphs, lists, facts, tables,
figures, notices. All text is plain text; the page escapes it. Where a number comes from is
said by its `Origin`, which the page shows as a tag with words, never by colour alone.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from tdacoustic.reporting.figure import Figure, ReportError, check_slug

__all__ = [
    "ORIGINS",
    "Alternatives",
    "Block",
    "Cell",
    "Column",
    "Details",
    "Document",
    "Fact",
    "Facts",
    "FigureBlock",
    "House",
    "Link",
    "Notice",
    "Origin",
    "Paragraph",
    "Section",
    "Sentences",
    "Shown",
    "Sound",
    "SoundStrip",
    "SoundTrack",
    "Table",
    "walk",
]

Origin = Literal["measured", "synthetic", "printed", "assumed", "calculated"]
ORIGINS: Final[tuple[str, ...]] = get_args(Origin)
DocumentOrigin = Literal["measured", "synthetic", "printed", "assumed", "calculated", "mixed"]
NoticeKind = Literal["info", "warning", "bad", "synthetic", "assumed"]
ColumnKind = Literal["number", "text", "origin", "verdict", "source"]


@dataclass(frozen=True)
class Link:
    """A cell that leads to a file beside the page.

    Parameters
    ----------
    text : str
        What is shown, sorted by and downloaded.
    href : str
        A relative path in the signs of URLs, ``"../a%20b/report.html"``.

    Raises
    ------
    ReportError
        It leads anywhere else: a scheme, a host, an absolute path.
    """

    text: str
    href: str

    def __post_init__(self) -> None:
        if not re.fullmatch(r"(?!/)[A-Za-z0-9%._~/-]+", self.href):
            raise ReportError(f"a link must be a relative path in the signs of URLs, got {self.href!r}")


@dataclass(frozen=True)
class Shown:
    """A cell whose number is shown in words: an interval, a bound, a probability that is never 1.

    The download has both, the number under the column's key and the words under the key with ``_text`` behind it.

    Parameters
    ----------
    text : str
        What is read, ``"> 0.99"``; said in the reader's language already.
    value : float or None
        The number itself, ``0.9973``; None (also NaN) where there is none: refused, or nothing but a bound known.
    order : float or None
        What it is sorted by where `value` is None: that of the bound. A bound is no value, so it is not downloaded as
        one. Where both are None it comes last, whichever way the column is sorted.

    Examples
    --------
    >>> Shown("> 0.99", 0.9973).value, Shown("< 61.2", order=61.2).value
    (0.9973, None)
    """

    text: str
    value: float | None = None
    order: float | None = None

    def __post_init__(self) -> None:
        for name in ("value", "order"):
            number = getattr(self, name)
            plain = None if number is None or not math.isfinite(number) else float(number)
            object.__setattr__(self, name, plain)


Cell: TypeAlias = str | float | int | bool | Link | Shown | None


def _check_origin(origin: str | None, what: str) -> None:
    if origin is not None and origin not in ORIGINS:
        raise ReportError(f"origin of {what} must be one of {', '.join(ORIGINS)}, got {origin!r}")


@dataclass(frozen=True)
class Paragraph:
    """A paragraph of plain text."""

    text: str


@dataclass(frozen=True)
class Sentences:
    """A list of sentences, one a bullet."""

    items: Sequence[str]

    def __post_init__(self) -> None:
        object.__setattr__(self, "items", tuple(self.items))


@dataclass(frozen=True)
class Notice:
    """Something the reader must not miss.

    Parameters
    ----------
    kind : {"info", "warning", "bad", "synthetic", "assumed"}
        Says in one word, which the page prints, what sort of notice it is.
    text : str
        One or two sentences.
    """

    kind: NoticeKind
    text: str

    def __post_init__(self) -> None:
        if self.kind not in get_args(NoticeKind):
            raise ReportError(f"kind of a notice must be one of {get_args(NoticeKind)}, got {self.kind!r}")


@dataclass(frozen=True)
class Fact:
    """A key and its value in words, with the origin of the value where it matters."""

    key: str
    value: str
    origin: Origin | None = None

    def __post_init__(self) -> None:
        _check_origin(self.origin, f"fact {self.key!r}")


@dataclass(frozen=True)
class Facts:
    """Keys and values.

    Parameters
    ----------
    pairs : sequence of Fact, (key, value) or (key, value, origin)
        In the order in which they are shown.
    """

    pairs: Sequence[Fact | tuple[str, str] | tuple[str, str, Origin | None]]

    def __post_init__(self) -> None:
        facts = tuple(pair if isinstance(pair, Fact) else Fact(*pair) for pair in self.pairs)
        object.__setattr__(self, "pairs", facts)


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Parameters
    ----------
    key : str
        Its header in the downloaded CSV, ``"level_db"``.
    title : str
        Its header in the page, ``"Level"``.
    unit : str
        Shown below the title, ``"dB re 20 uPa"``.
    digits : int, optional
        Decimals of its numbers; default: six significant digits.
    kind : {"number", "text", "origin", "verdict", "source"}
        ``"origin"`` cells are one of `ORIGINS`, ``"verdict"`` cells are ``ok``, ``warning``,
        ``bad`` or another word, ``"source"`` cells begin with a source of noise (``motor 97 %``);
        all are shown as tags.
    align : {"left", "right", "center"}, optional
        Default: numbers to the right, all else to the left.
    """

    key: str
    title: str
    unit: str = ""
    digits: int | None = None
    kind: ColumnKind = "text"
    align: Literal["left", "right", "center"] | None = None

    def __post_init__(self) -> None:
        if self.kind not in get_args(ColumnKind):
            raise ReportError(f"kind of column {self.key!r} must be one of {get_args(ColumnKind)}, got {self.kind!r}")
        if self.digits is not None and not 0 <= self.digits <= 12:
            raise ReportError(f"digits of column {self.key!r} must be 0 to 12, got {self.digits}")

    @property
    def side(self) -> str:
        """Where its cells are aligned to."""
        return self.align or ("right" if self.kind == "number" else "left")


@dataclass(frozen=True)
class Table:
    """A table that can be sorted and downloaded.

    Parameters
    ----------
    name : str
        Unique in a document; anchor of the table.
    caption : str
        Shown above it.
    columns : sequence of Column
        At least one, with different keys.
    rows : sequence of sequences
        One cell a column: text, number, bool, `Link`, `Shown`, or None (also NaN) for not determined.
    origin : str, optional
        Of the numbers in it.

    Raises
    ------
    ReportError
        A row has not as many cells as there are columns, a number column holds text, or another a number in words.
    """

    name: str
    caption: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[Cell]]
    origin: Origin | None = None

    def __post_init__(self) -> None:
        check_slug(self.name, "name of a table")
        _check_origin(self.origin, f"table {self.name!r}")
        columns = tuple(self.columns)
        rows = tuple(tuple(_plain(cell) for cell in row) for row in self.rows)
        if not columns or len({column.key for column in columns}) < len(columns):
            raise ReportError(f"table {self.name!r} needs columns with different keys")
        for number, row in enumerate(rows):
            if len(row) != len(columns):
                raise ReportError(f"row {number} of table {self.name!r} has {len(row)} cells, expected {len(columns)}")
            for column, cell in zip(columns, row, strict=True):
                if column.kind == "number" and isinstance(cell, str | Link):
                    raise ReportError(f"column {column.key!r} of table {self.name!r} is of numbers, got {cell!r}")
                if column.kind != "number" and isinstance(cell, Shown):
                    raise ReportError(f"column {column.key!r} of table {self.name!r} is not of numbers, got {cell!r}")
                if column.kind == "origin" and cell is not None:
                    _check_origin(str(cell), f"row {number} of table {self.name!r}")
        object.__setattr__(self, "columns", columns)
        object.__setattr__(self, "rows", rows)

    @property
    def csv_name(self) -> str:
        """Name of the downloaded file; no file beside a page has it, for those hold other rows and columns."""
        return f"table-{self.name}.csv"


def _plain(cell: object) -> Cell:
    """Turn a numpy scalar into Python's own; NaN and infinity become None."""
    value = cell.item() if hasattr(cell, "item") else cell
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if value is None or isinstance(value, str | bool | int | float | Link | Shown):
        return value
    raise ReportError(f"a cell is text, a number, a bool, a link, a number in words or None, got {value!r}")


@dataclass(frozen=True)
class FigureBlock:
    """A figure in its place, with the origin of what it shows."""

    figure: Figure
    origin: Origin | None = None

    def __post_init__(self) -> None:
        _check_origin(self.origin, f"figure {self.figure.name!r}")


@dataclass(frozen=True)
class Details:
    """Blocks that are folded away below one line until the reader opens them; printed open."""

    summary: str
    blocks: Sequence[Block]

    def __post_init__(self) -> None:
        object.__setattr__(self, "blocks", tuple(self.blocks))


@dataclass(frozen=True)
class Alternatives:
    """Blocks of the same kind for several channels or conditions, of which the reader has one at a time before them.

    On paper, and where no scripts run, all are shown one after the other.

    Parameters
    ----------
    label : str
        What is chosen, ``"Channel"``.
    views : sequence of (str, sequence of blocks)
        Name of each choice, and what it shows; the first is shown at first.

    Raises
    ------
    ReportError
        There is no view, or two have the same name.
    """

    label: str
    views: Sequence[tuple[str, Sequence[Block]]]

    def __post_init__(self) -> None:
        views = tuple((name, tuple(blocks)) for name, blocks in self.views)
        if not views or len({name for name, _ in views}) < len(views):
            raise ReportError(f"alternatives by {self.label!r} need views with different names")
        object.__setattr__(self, "views", views)


@dataclass(frozen=True)
class SoundTrack:
    """Something to play.

    Parameters
    ----------
    label : str
        ``"As recorded"``.
    mp3 : bytes
    text : str
        What it is, with its level.
    """

    label: str
    mp3: bytes
    text: str = ""


@dataclass(frozen=True)
class SoundStrip:
    """What sounds when, over frequency, and a line in it that is marked.

    Parameters
    ----------
    level_db : ndarray, shape (n_frequencies, n_times)
        From 0 Hz to `highest_hz`, and over the whole sound; re any reference.
    duration_s, highest_hz : float
    times_s, frequency_hz : sequence of float
        The marked line; NaN where there is none, empty without one.
    label : str
        Name of the line.
    """

    level_db: NDArray[np.float64]
    duration_s: float
    highest_hz: float
    times_s: Sequence[float] = ()
    frequency_hz: Sequence[float] = ()
    label: str = ""


@dataclass(frozen=True)
class Sound:
    """Sounds of the same seconds, played in turn; a page keeps the place when the reader changes from one to another.

    Parameters
    ----------
    name : str
        Unique in a document; its anchor.
    title, caption : str
    tracks : sequence of SoundTrack
        The first is the whole sound.
    strip : SoundStrip or None
    origin : str, optional
    """

    name: str
    title: str
    caption: str
    tracks: Sequence[SoundTrack]
    strip: SoundStrip | None = None
    origin: Origin | None = None

    def __post_init__(self) -> None:
        check_slug(self.name, "name of a sound")
        _check_origin(self.origin, f"sound {self.name!r}")
        object.__setattr__(self, "tracks", tuple(self.tracks))
        if not self.tracks:
            raise ReportError(f"sound {self.name!r} has nothing to play")


@dataclass(frozen=True)
class Section:
    """A section with a heading; sections among its blocks are its subsections.

    Parameters
    ----------
    id : str
        Unique in a document; its anchor.
    title : str
        Its heading, which the page numbers.
    blocks : sequence of blocks or Section
        What it says, in order.
    """

    id: str
    title: str
    blocks: Sequence[Block]

    def __post_init__(self) -> None:
        check_slug(self.id, "id of a section")
        object.__setattr__(self, "blocks", tuple(self.blocks))


Block: TypeAlias = (
    Paragraph | Sentences | Notice | Facts | Table | FigureBlock | Sound | Details | Alternatives | Section
)


@dataclass(frozen=True)
class House:
    """Whose report it is: what stands above its title.

    Parameters
    ----------
    company : str
    lines : sequence of str
        Department, address, number of the report.
    logo : bytes
        A picture; empty of none.
    logo_type : str
        ``"image/png"`` or ``"image/jpeg"``.
    """

    company: str = ""
    lines: Sequence[str] = ()
    logo: bytes = b""
    logo_type: str = ""


@dataclass(frozen=True)
class Document:
    """A whole report.

    Parameters
    ----------
    title, subtitle : str
        Head of the page.
    origin : {"measured", "synthetic", "printed", "assumed", "calculated", "mixed"}
        Of the data that the report is about; shown beside the title. Of ``"mixed"`` data each number says its own.
    summary : sequence of blocks
        What the reader needs if they read nothing else.
    notices : sequence of Notice
        Shown above the summary.
    sections : sequence of Section
        The body, numbered by the page.
    facts : sequence of facts
        Shown below the title: date, vehicle, program and its version.
    footer : sequence of str
        Lines at the end.
    lineage : mapping of str to str
        By the id of a section, the id of the one that tells how its numbers came about; it holds for the sections
        inside too.
    house : House, optional
        Whose report it is.

    Raises
    ------
    ReportError
        Two sections, tables or figures share a name.
    """

    title: str
    subtitle: str
    origin: DocumentOrigin
    summary: Sequence[Block] = ()
    notices: Sequence[Notice] = ()
    sections: Sequence[Section] = ()
    facts: Sequence[Fact | tuple[str, str] | tuple[str, str, Origin | None]] = ()
    footer: Sequence[str] = ()
    lineage: Mapping[str, str] = field(default_factory=dict)
    house: House | None = None

    def __post_init__(self) -> None:
        if self.origin != "mixed":
            _check_origin(self.origin, "a document")
        object.__setattr__(self, "facts", Facts(self.facts).pairs)
        for key in ("summary", "notices", "sections", "footer"):
            value = getattr(self, key)
            if isinstance(value, str):
                raise ReportError(f"{key} of a document must be a sequence, got text")
            object.__setattr__(self, key, tuple(value))
        names: dict[str, list[str]] = {"section": ["summary"], "table": [], "figure": [], "sound": []}
        for block in walk((*self.summary, *self.sections)):
            if isinstance(block, Section):
                names["section"].append(block.id)
            elif isinstance(block, Table):
                names["table"].append(block.name)
            elif isinstance(block, FigureBlock):
                names["figure"].append(block.figure.name)
            elif isinstance(block, Sound):
                names["sound"].append(block.name)
        for what, found in names.items():
            twice = sorted({name for name in found if found.count(name) > 1})
            if twice:
                raise ReportError(f"two of the document's {what}s are named {', '.join(twice)}")
        lost = sorted({*self.lineage.values()} - {*names["section"]})
        if lost:
            raise ReportError(f"the document has no section {', '.join(lost)} to tell how numbers came about")


def walk(blocks: Sequence[Block]) -> Iterator[Block]:
    """Yield every block in reading order, those inside of sections and details too."""
    for block in blocks:
        yield block
        if isinstance(block, Section | Details):
            yield from walk(block.blocks)
        elif isinstance(block, Alternatives):
            for _, inside in block.views:
                yield from walk(inside)

"""Turn a `Document` into one self-contained HTML page.

The page asks the network for nothing: its policy forbids it, and only the two scripts whose
hashes it names may run. Plotly's script is embedded once, compressed; where a browser cannot
inflate it, or runs no scripts, and on paper, each figure is its static picture.

The same document gives the same bytes.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Any, Final

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from tdacoustic.reporting.document import (
    Alternatives,
    Block,
    Cell,
    Column,
    Details,
    Document,
    Facts,
    FigureBlock,
    House,
    Link,
    Notice,
    Paragraph,
    Section,
    Sentences,
    Sound,
    Table,
    walk,
)
from tdacoustic.reporting.figure import Heatmap
from tdacoustic.reporting.language import say, spoken
from tdacoustic.reporting.layout import figure_width
from tdacoustic.reporting.matplotlib_renderer import render_png
from tdacoustic.reporting.page_limits import PAGE_LIMITS, PageLimits, left_out_words, rows_that_fit
from tdacoustic.reporting.palette import DARK, LIGHT, css_variables
from tdacoustic.reporting.plotly_renderer import is_reduced, render_plotly
from tdacoustic.reporting.shown import NOTICE_WORDS, ORIGIN_SENTENCES, ORIGIN_WORDS, cell_text
from tdacoustic.reporting.sound_view import sound_view
from tdacoustic.tables.writing import csv_cell

__all__ = ["csv_cell", "render_html", "safe_json"]

STATIC_DPI: Final = 150

_SOURCES: Final = frozenset({"motor", "gearbox", "undecided", "mixed"})
"""Sources that have a look of their own."""


def safe_json(value: object) -> str:
    r"""Write JSON that stays inert inside of a ``<script>`` element; NaN is refused.

    Examples
    --------
    >>> safe_json("</script>")
    '"\\u003c/script\\u003e"'
    """
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


@cache
def _template(name: str) -> str:
    source = (files("tdacoustic.reporting") / "templates" / name).read_text(encoding="utf-8")
    return source.replace("\r\n", "\n")


@cache
def _plotly_script() -> tuple[str, str]:
    """Plotly's script, gzipped and in base64, and the hash the page's policy names it by."""
    source = (files("plotly") / "package_data" / "plotly.min.js").read_bytes()
    return base64.b64encode(gzip.compress(source, 9, mtime=0)).decode("ascii"), _script_hash(source)


def _script_hash(source: bytes) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(source).digest()).decode('ascii')}'"


def _policy(script_hashes: Sequence[str]) -> str:
    return (
        f"default-src 'none'; script-src {' '.join(script_hashes)}; style-src 'unsafe-inline'; "
        "img-src data: blob:; media-src data:; base-uri 'none'; form-action 'none'"
    )


def _cell(column: Column, cell: Cell, first: bool) -> dict[str, Any]:
    """What a cell shows, and what it sorts and downloads as (``raw``; None: the same)."""
    align = column.align or ("right" if column.kind == "number" else "left")
    tag = 'th scope="row"' if first and column.kind == "text" else "td"
    view: dict[str, Any] = {"tag": Markup(tag), "end": tag[:2], "align": align, "chip": None, "href": None}
    view["text"] = text = cell_text(column, cell)
    if cell is None:
        return view | {"raw": ""}
    if isinstance(cell, Link):
        return view | {"href": cell.href, "raw": _raw(cell.text, text)}
    if isinstance(cell, bool):
        return view | {"raw": "true" if cell else "false"}
    if not isinstance(cell, str):
        raw = f"{cell:.9g}"
        return view | {"raw": None if raw == text else raw}
    if column.kind == "source" and cell:
        known_source = next((word for word in sorted(_SOURCES) if cell.startswith((word, say(word)))), "other")
        view["chip"] = f"source-{known_source}"
    if column.kind in ("origin", "verdict") and cell:
        known = column.kind == "origin" or cell in ("ok", "warning", "bad")
        view["chip"] = f"{column.kind}-{cell}" if known else "verdict-other"
    return view | {"raw": _raw(cell, text)}


def _raw(text: str, shown: str) -> str | None:
    """What a text downloads as; None: as it is shown."""
    raw = csv_cell(text)
    return None if raw == shown.strip() else raw


def _table(table: Table, most_bytes: int) -> tuple[dict[str, Any], int]:
    """A table with the rows that fit, and their bytes."""
    columns = [
        {
            "key": column.key,
            "title": column.title,
            "unit": column.unit,
            "kind": column.kind,
            "align": column.align or ("right" if column.kind == "number" else "left"),
        }
        for column in table.columns
    ]
    made = (
        [_cell(column, cell, index == 0) for index, (column, cell) in enumerate(zip(table.columns, row, strict=True))]
        for row in table.rows
    )
    rows, taken = rows_that_fit(made, most_bytes)
    view = {
        "type": "table",
        "name": table.name,
        "caption": table.caption,
        "columns": columns,
        "rows": rows,
        "all_rows": len(table.rows),
        "file": table.csv_name,
        "origin": table.origin,
    }
    return view, taken


def _png_size(png: bytes) -> tuple[int, int]:
    width, height = struct.unpack(">II", png[16:24])
    return int(width), int(height)


@dataclass
class _Views:
    """Blocks as the template reads them; counts figures and tables, and what the figures weigh."""

    limits: PageLimits
    figures: int = 0
    picture_bytes: int = 0
    left_out: int = 0
    tables: int = 0
    table_bytes: int = 0
    cut_tables: int = 0
    sounds: int = 0
    sound_bytes: int = 0
    alternatives: int = 0
    interactive: int = 0
    figure_bytes: int = 0
    full: bool = False
    lineage: Mapping[str, str] = field(default_factory=dict)
    behind: str | None = None
    sections: list[dict[str, Any]] = field(default_factory=list)

    def figure(self, block: FigureBlock) -> dict[str, Any]:
        figure = block.figure
        self.figures += 1
        if self.picture_bytes > self.limits.picture_bytes:
            self.left_out += 1
            return {"type": "left_out", "number": self.figures, "name": figure.name, "title": figure.title.rstrip(".")}
        heat = any(isinstance(element, Heatmap) for element in figure.elements)
        png = render_png(figure, STATIC_DPI, colours=96 if heat else 48)
        width, height = _png_size(png)
        packed = base64.b64encode(png).decode("ascii")
        self.picture_bytes += len(packed)
        return {
            "type": "figure",
            "number": self.figures,
            "name": figure.name,
            "title": figure.title.rstrip("."),
            "caption": figure.caption,
            "alt": say(
                "{title}: {y_axis} over {x_axis}",
                title=figure.title,
                y_axis=figure.y_axis.caption,
                x_axis=figure.x_axis.caption,
            ),
            "origin": block.origin,
            "png": Markup(packed),
            "width": width,
            "height": height,
            "narrow": figure_width(figure) if figure.equal else None,
            "reduced": is_reduced(figure),
            "behind": self.behind,
            "json": self.payload(block),
        }

    def payload(self, block: FigureBlock) -> Markup | None:
        """The figure's data for the page's script, or None once the page is full."""
        if self.full or self.interactive >= self.limits.interactive:
            self.full = True
            return None
        text = safe_json(render_plotly(block.figure, scheme="css"))
        if self.figure_bytes + len(text) > self.limits.figure_bytes:
            self.full = True
            return None
        self.interactive += 1
        self.figure_bytes += len(text)
        return Markup(text)

    def table(self, block: Table) -> dict[str, Any]:
        self.tables += 1
        left = self.limits.table_bytes - self.table_bytes
        view, taken = _table(block, min(self.limits.one_table_bytes, left))
        self.table_bytes += taken
        self.cut_tables += len(view["rows"]) < view["all_rows"]
        return view | {"number": self.tables, "behind": self.behind}

    def block(self, block: Block, level: int, number: str) -> dict[str, Any]:
        if isinstance(block, Paragraph):
            return {"type": "paragraph", "text": block.text}
        if isinstance(block, Sentences):
            return {"type": "sentences", "items": block.items}
        if isinstance(block, Notice):
            return {"type": "notice", "kind": block.kind, "texts": [block.text]}
        if isinstance(block, Facts):
            return {"type": "facts", "pairs": block.pairs}
        if isinstance(block, FigureBlock):
            return self.figure(block)
        if isinstance(block, Sound):
            self.sounds += 1
            self.sound_bytes, view = sound_view(block, self.sounds, self.sound_bytes, self.limits.sound_bytes)
            return view | {"behind": self.behind}
        if isinstance(block, Table):
            return self.table(block)
        if isinstance(block, Details):
            return {"type": "details", "summary": block.summary, "blocks": self.blocks(block.blocks, level, number)}
        if isinstance(block, Alternatives):
            self.alternatives += 1
            number_here = self.alternatives
            views = [(name, self.blocks(blocks, level, number)) for name, blocks in block.views]
            return {"type": "alternatives", "label": block.label, "views": views, "number": number_here}
        return self.section(block, level, number)

    def blocks(self, blocks: Sequence[Block], level: int, number: str) -> list[dict[str, Any]]:
        views, below = [], 0
        for block in blocks:
            if isinstance(block, Notice) and views and views[-1].get("kind") == block.kind:
                views[-1]["texts"].append(block.text)  # one box for those of a kind that follow each other
                continue
            below += isinstance(block, Section)
            views.append(self.block(block, level + 1, f"{number}.{below}" if number else ""))
        return views

    def section(self, section: Section, level: int, number: str) -> dict[str, Any]:
        outside, self.behind = self.behind, self.lineage.get(section.id, self.behind)
        blocks = self.blocks(section.blocks, level, number)
        self.behind = outside
        return {
            "type": "section",
            "id": section.id,
            "title": section.title,
            "number": number,
            "level": min(level, 4),
            "blocks": blocks,
            "subsections": [view for view in blocks if view["type"] == "section"] if level == 2 else [],
        }


def _house(house: House | None) -> dict[str, Any] | None:
    if house is None or not (house.company or house.lines or house.logo):
        return None
    logo = f"data:{house.logo_type};base64,{base64.b64encode(house.logo).decode('ascii')}" if house.logo else ""
    return {"company": house.company, "lines": house.lines, "logo": Markup(logo)}


def _sections(document: Document, views: _Views) -> list[dict[str, Any]]:
    sections = []
    if document.summary:
        sections.append(views.section(Section("summary", say("Summary"), document.summary), 2, ""))
    sections += [views.section(section, 2, str(n)) for n, section in enumerate(document.sections, start=1)]
    return sections


def render_html(document: Document, limits: PageLimits = PAGE_LIMITS) -> str:
    """Write a document as one HTML page that needs nothing else.

    Parameters
    ----------
    document : Document
        What it says.
    limits : PageLimits
        How much of it the page holds at most; what it leaves out, it says.

    Returns
    -------
    str
        HTML, to be written in UTF-8 without translation of line ends.

    Examples
    --------
    >>> from tdacoustic.reporting.document import Document, Paragraph, Section
    >>> page = render_html(Document("Report", "", "measured", sections=[Section("one", "One", [Paragraph("a < b")])]))
    >>> "a &lt; b" in page
    True
    """
    views = _Views(limits, lineage=document.lineage)
    sections = _sections(document, views)
    figures = sum(isinstance(block, FigureBlock) for block in walk((*document.summary, *document.sections)))
    said = left_out_words(figures, views.interactive if views.full else figures, views.left_out, views.cut_tables)
    # the answer comes first: what is merely no longer zoomed is said at the end
    lacks = bool(views.left_out or views.cut_tables)
    notices = (*document.notices, *([Notice("info", said)] if lacks else []))
    footer = (*document.footer, *([said] if said and not lacks else []))
    packed, plotly_hash = _plotly_script() if views.interactive else ("", "")
    script = _template("page.js")
    hashes = [_script_hash(script.encode("utf-8")), *([plotly_hash] if packed else [])]
    dark = f"@media screen and (prefers-color-scheme: dark) {{ :root {{ {css_variables('dark')} }} }}\n"
    environment = Environment(autoescape=True, undefined=StrictUndefined)
    page = environment.from_string(_template("page.html.j2"))
    return page.render(
        document={
            "title": document.title,
            "subtitle": document.subtitle,
            "origin": document.origin,
            "facts": document.facts,
            "notices": views.blocks(notices, 2, ""),
            "footer": footer,
            "house": _house(document.house),
        },
        origin_words=say(ORIGIN_SENTENCES[document.origin]),
        sections=sections,
        words=NOTICE_WORDS,
        origins=ORIGIN_WORDS,
        say=say,
        language=spoken().code,
        policy=Markup(_policy(hashes)),
        css=Markup(f":root {{ {css_variables('light')} }}\n{dark}{_template('page.css')}"),
        js=Markup(script),
        palette=Markup(safe_json({"light": dict(LIGHT), "dark": dict(DARK)})),
        plotly=Markup(packed),
    )

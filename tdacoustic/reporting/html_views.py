"""Blocks of a `Document` as the page's template reads them, within the room that the page has."""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

from markupsafe import Markup

from tdacoustic.reporting.document import (
    Alternatives,
    Block,
    Cell,
    Column,
    Details,
    Facts,
    FigureBlock,
    Link,
    Notice,
    Paragraph,
    Section,
    Sentences,
    Shown,
    Sound,
    Table,
)
from tdacoustic.reporting.figure import Figure, Heatmap
from tdacoustic.reporting.language import say
from tdacoustic.reporting.layout import figure_width
from tdacoustic.reporting.matplotlib_renderer import render_png
from tdacoustic.reporting.page_limits import Held, Room, rows_that_fit
from tdacoustic.reporting.plotly_renderer import is_reduced, render_plotly
from tdacoustic.reporting.shown import cell_text
from tdacoustic.reporting.sound_view import sound_view
from tdacoustic.tables.writing import csv_cell

__all__ = ["Views", "safe_json"]

STATIC_DPI: Final = 150

_SOURCES: Final = frozenset({"motor", "gearbox", "undecided", "mixed"})
"""Sources that have a look of their own."""
_LOOKS: Final = ((40, "long"), (14, "some"))
"""Signs from which on a text asks for a width, so that it is not broken into a word a line."""


def safe_json(value: object) -> str:
    r"""Write JSON that stays inert inside of a ``<script>`` element; NaN is refused.

    Examples
    --------
    >>> safe_json("</script>")
    '"\\u003c/script\\u003e"'
    """
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _cell(column: Column, cell: Cell, first: bool) -> dict[str, Any]:
    """What a cell shows, and what it sorts and downloads as (``raw``; None: the same).

    ``order``: what it is sorted by where that is something else; ``words``: what its text downloads as, for a number
    in words.
    """
    align = column.side
    tag = 'th scope="row"' if first and column.kind == "text" else "td"
    view: dict[str, Any] = {"tag": Markup(tag), "end": tag[:2], "align": align}
    view |= dict.fromkeys(("chip", "href", "order", "words"))
    view["text"] = text = cell_text(column, cell)
    view["look"] = align if align != "left" else next((look for most, look in _LOOKS if len(text) > most), "")
    if cell is None:
        return view | {"raw": ""}
    if isinstance(cell, Link):
        return view | {"href": cell.href, "raw": _raw(cell.text, text)}
    if isinstance(cell, Shown):
        order = None if cell.order is None or cell.value is not None else f"{cell.order:.9g}"
        raw = "" if cell.value is None else f"{cell.value:.9g}"
        return view | {"raw": raw, "order": order, "words": _raw(cell.text, text)}
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
            "align": column.side,
            "worded": any(isinstance(row[place], Shown) for row in table.rows),
        }
        for place, column in enumerate(table.columns)
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
class Views:
    """Blocks as the template reads them; counts figures and tables, and what they weigh.

    Parameters
    ----------
    room : Room
        Bytes that figures, tables and sounds have.
    most_zoomed : int
        Figures that can be zoomed.
    pictures : dict
        Packed pictures of figures by name, kept for when the page is made again.
    lineage : Mapping
        By section: the section that says how it came about.
    """

    room: Room
    most_zoomed: int
    pictures: dict[str, str] = field(default_factory=dict)
    lineage: Mapping[str, str] = field(default_factory=dict)
    held: Held = field(default_factory=Held)
    figures: int = 0
    tables: int = 0
    sounds: int = 0
    alternatives: int = 0
    behind: str | None = None

    def _add(self, **more: int) -> None:
        self.held = replace(self.held, **{name: getattr(self.held, name) + count for name, count in more.items()})

    def _figure(self, block: FigureBlock) -> dict[str, Any]:
        figure = block.figure
        self.figures += 1
        packed = "" if self.held.left_out else self._picture(figure)
        left = self.room.figures - self.held.picture_bytes - self.held.zoomed_bytes - len(packed)
        named = {"number": self.figures, "name": figure.name, "title": figure.title.rstrip(".")}
        if self.held.left_out or left < 0:
            self._add(left_out=1)
            return {"type": "left_out", "figures": [named]}
        self._add(picture_bytes=len(packed))
        width, height = _png_size(base64.b64decode(packed[:64]))
        return {
            "type": "figure",
            **named,
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
            "json": self._payload(figure, left),
        }

    def _picture(self, figure: Figure) -> str:
        """A figure's still picture in base64."""
        if figure.name not in self.pictures:
            heat = any(isinstance(element, Heatmap) for element in figure.elements)
            png = render_png(figure, STATIC_DPI, colours=96 if heat else 48)
            self.pictures[figure.name] = base64.b64encode(png).decode("ascii")
        return self.pictures[figure.name]

    def _payload(self, figure: Figure, left: int) -> Markup | None:
        """The figure's data for the page's script, or None once the page is full."""
        if not self.held.still and self.held.zoomed < self.most_zoomed:
            text = safe_json(render_plotly(figure, scheme="css"))
            if len(text) <= min(left, self.room.zoomed - self.held.zoomed_bytes):
                self._add(zoomed=1, zoomed_bytes=len(text))
                return Markup(text)
        self._add(still=1)
        return None

    def _table(self, block: Table) -> dict[str, Any]:
        self.tables += 1
        left = self.room.tables - self.held.table_bytes
        view, taken = _table(block, min(self.room.one_table, left))
        self._add(table_bytes=taken, cut_tables=int(len(view["rows"]) < view["all_rows"]))
        return view | {"number": self.tables, "behind": self.behind}

    def _sound(self, block: Sound) -> dict[str, Any]:
        self.sounds += 1
        taken, view = sound_view(block, self.sounds, self.room.sounds - self.held.sound_bytes)
        self._add(sound_bytes=taken, silent=int(not view["tracks"]))
        return view | {"behind": self.behind}

    def _block(self, block: Block, level: int, number: str) -> dict[str, Any]:
        if isinstance(block, Paragraph):
            return {"type": "paragraph", "text": block.text}
        if isinstance(block, Sentences):
            return {"type": "sentences", "items": block.items}
        if isinstance(block, Notice):
            return {"type": "notice", "kind": block.kind, "texts": [block.text]}
        if isinstance(block, Facts):
            return {"type": "facts", "pairs": block.pairs}
        if isinstance(block, FigureBlock):
            return self._figure(block)
        if isinstance(block, Sound):
            return self._sound(block)
        if isinstance(block, Table):
            return self._table(block)
        if isinstance(block, Details):
            return {"type": "details", "summary": block.summary, "blocks": self.blocks(block.blocks, level, number)}
        if isinstance(block, Alternatives):
            self.alternatives += 1
            number_here = self.alternatives
            views = [(name, self.blocks(blocks, level, number)) for name, blocks in block.views]
            return {"type": "alternatives", "label": block.label, "views": views, "number": number_here}
        return self.section(block, level, number)

    def blocks(self, blocks: Sequence[Block], level: int, number: str) -> list[dict[str, Any]]:
        """Return the views of blocks under a heading of a level and number."""
        views: list[dict[str, Any]] = []
        below = 0
        for block in blocks:
            if isinstance(block, Notice) and views and views[-1].get("kind") == block.kind:
                views[-1]["texts"].append(block.text)  # one box for those of a kind that follow each other
                continue
            below += isinstance(block, Section)
            view = self._block(block, level + 1, f"{number}.{below}" if number else "")
            if view["type"] == "left_out" and views and views[-1]["type"] == "left_out":
                views[-1]["figures"].extend(view["figures"])
                continue
            views.append(view)
        return views

    def section(self, section: Section, level: int, number: str) -> dict[str, Any]:
        """Return the view of a section with all that it holds."""
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

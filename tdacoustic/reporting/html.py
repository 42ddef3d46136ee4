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
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from typing import Any, Final

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from tdacoustic.reporting.document import Document, House, Notice, Section
from tdacoustic.reporting.html_views import Views, safe_json
from tdacoustic.reporting.language import say, spoken
from tdacoustic.reporting.page_limits import PAGE_LIMITS, PageLimits, left_out_words
from tdacoustic.reporting.palette import DARK, LIGHT, css_variables
from tdacoustic.reporting.shown import NOTICE_WORDS, ORIGIN_SENTENCES, ORIGIN_WORDS

__all__ = ["render_html"]

MOST_ATTEMPTS: Final = 4
"""A page that is too large is made again with less room for what makes it heavy."""


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


def _house(house: House | None) -> dict[str, Any] | None:
    if house is None or not (house.company or house.lines or house.logo):
        return None
    logo = f"data:{house.logo_type};base64,{base64.b64encode(house.logo).decode('ascii')}" if house.logo else ""
    return {"company": house.company, "lines": house.lines, "logo": Markup(logo)}


def _sections(document: Document, views: Views) -> list[dict[str, Any]]:
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
    pictures: dict[str, str] = {}
    room = limits.room()
    for attempt in range(MOST_ATTEMPTS):
        views = Views(room, limits.interactive, pictures, document.lineage)
        page = _page(document, views)
        size = len(page.encode())
        if size <= limits.page_bytes and (attempt or not views.held.lacks):
            break
        room = limits.room(size - views.held.all_bytes, views.held)
    return page


def _page(document: Document, views: Views) -> str:
    sections = _sections(document, views)
    said = left_out_words(views.held)
    # the answer comes first, then what is not here; what is merely no longer zoomed is said at the end
    if views.held.lacks:
        sections[0]["blocks"] += views.blocks([Notice("info", said)], 2, "")
    footer = (*document.footer, *([said] if said and not views.held.lacks else []))
    packed, plotly_hash = _plotly_script() if views.held.zoomed else ("", "")
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
            "notices": views.blocks(document.notices, 2, ""),
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

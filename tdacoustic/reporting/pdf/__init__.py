"""The report as a PDF for paper: the content of the HTML page, laid out on A4 by reportlab.

reportlab is pure Python under a BSD licence: `pip` alone installs it on every system, where the alternative that reads
HTML, weasyprint, needs the Pango library of the system. Text, links, contents and tables are its own; figures are drawn
by matplotlib, as lines and text rather than as pictures.

The same document gives the same bytes.
"""

from __future__ import annotations

from importlib.util import find_spec

from tdacoustic.errors import MissingPackageError
from tdacoustic.reporting.document import Document

__all__ = ["check_reportlab", "render_pdf"]


def check_reportlab() -> None:
    """Raise `MissingPackageError` where reportlab is not installed."""
    if find_spec("reportlab") is None:
        raise MissingPackageError("a PDF report needs reportlab: pip install 'tdacoustic[pdf]'")


def render_pdf(document: Document) -> bytes:
    """Lay a document out on pages of A4.

    Parameters
    ----------
    document : Document
        What it says; `tdacoustic.reporting.html.render_html` shows the same on a page.

    Returns
    -------
    bytes
        A PDF with contents, bookmarks and links inside, its fonts embedded, and no date.

    Raises
    ------
    MissingPackageError
        reportlab is not installed.
    ReportError
        The document holds a block that this renderer does not know.
    """
    check_reportlab()
    from tdacoustic.reporting.pdf.binding import bound

    return bound(document)

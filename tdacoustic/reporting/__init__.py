"""Reports: one description of figures and documents, drawn as a page or as pictures.

Nothing here computes a result; figures and tables show what other parts have found.
Drawing libraries are imported when something is drawn.
"""

from tdacoustic.reporting.document import (
    Column,
    Details,
    Document,
    Fact,
    Facts,
    FigureBlock,
    Link,
    Notice,
    Paragraph,
    Section,
    Sentences,
    Table,
)
from tdacoustic.reporting.figure import Axis, Band, Bars, Figure, Heatmap, Line, Markers, ReportError, Rule
from tdacoustic.reporting.matplotlib_renderer import plot

__all__ = [
    "Axis",
    "Band",
    "Bars",
    "Column",
    "Details",
    "Document",
    "Fact",
    "Facts",
    "Figure",
    "FigureBlock",
    "Heatmap",
    "Line",
    "Link",
    "Markers",
    "Notice",
    "Paragraph",
    "ReportError",
    "Rule",
    "Section",
    "Sentences",
    "Table",
    "plot",
]

"""From a section of the fleet view back to the results' files, and from a result to what it was made of."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from tdacoustic.gathering.gathered import Gathering
from tdacoustic.reporting.document import Block, Cell, Column, Details, Paragraph, Section, Table
from tdacoustic.reporting.language import say
from tdacoustic.reporting.sections.campaigns_rows import captioned, name_cell

__all__ = ["FILES_OF", "files_behind", "results_behind"]

FILES_OF: Final[Mapping[str, tuple[str, ...]]] = {
    "dominance": ("dominance.csv", "conditions.csv", "levels.csv", "quality.csv"),
    "levels": ("levels.csv", "quality.csv", "conditions.csv"),
    "parameters": ("calibration.json",),
    "outliers": ("levels.csv", "quality.csv", "conditions.csv", "calibration.json"),
    "data": ("quality.csv", "manifest.json"),
    "campaigns": ("levels.csv", "quality.csv", "conditions.csv", "manifest.json"),
}
"""Files of each result that a section of the fleet view is made of, by the section's id."""

MOST_RESULTS: Final = 100
MOST_DIGITS: Final = 12
"""Of a sha256: enough to tell files apart."""


def files_behind(sections: list[Section]) -> list[Block]:
    """Return which files of the results each section is made of.

    Parameters
    ----------
    sections : list of Section
        Of the fleet view.
    """
    rows: list[list[Cell]] = [
        [section.title, ", ".join(FILES_OF[section.id])] for section in sections if section.id in FILES_OF
    ]
    words = say(
        "Every file of a result was held against the sha256 in its manifest.json before a number of it was used. Which "
        "steps, settings and logs a number of a result came of is said in that result's own report, to which the "
        "names lead."
    )
    columns = [Column("section", say("Section")), Column("files", say("Files of each result"))]
    return [Paragraph(words), Table("files-behind", say("What each section is made of"), columns, rows)]


def results_behind(gathering: Gathering) -> Details:
    """Return what each result was made of: its inputs with their sha256, and the program's version.

    Parameters
    ----------
    gathering : Gathering
        Of at least one result.
    """
    columns = [
        Column("train", say("Train, else campaign")),
        Column("result", say("Result")),
        Column("origin", say("Origin"), kind="origin"),
        Column("command", say("Command")),
        Column("version", say("Version of tdacoustic")),
        Column("inputs", say("Files that went in"), kind="number", digits=0),
        Column("bytes", say("Size"), "MB", digits=1, kind="number"),
        Column("sha256", say("sha256 of the files, first digits")),
    ]
    rows: list[list[Cell]] = []
    for result in gathering.results[:MOST_RESULTS]:
        digits = [sha256[:MOST_DIGITS] for sha256, _ in result.inputs]
        size = sum(size for _, size in result.inputs) / 1e6
        shown = " ".join(digits[:3]) + (" …" if len(digits) > 3 else "")
        whose: list[Cell] = [name_cell(gathering, [result]), result.result]
        made: list[Cell] = [result.origin, result.command, result.version or None]
        rows.append([*whose, *made, len(result.inputs), size, shown])
    held = len(gathering.results)
    said = "" if len(rows) == held else say("Shown are {shown} of {held}.", shown=len(rows), held=held)
    caption = captioned(say("What each result was made of; its manifest.json names every file in full"), said)
    return Details(say("Inputs of the results: {count}", count=held), [Table("results-behind", caption, columns, rows)])

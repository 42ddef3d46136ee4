"""Quality: what is doubtful first, every check below."""

from __future__ import annotations

from tdacoustic.reporting.document import Block, Column, Details, Paragraph, Section, Table
from tdacoustic.reporting.language import say
from tdacoustic.reporting.sections.words import pretty_unit
from tdacoustic.results import Analysis

__all__ = ["quality"]

_COLUMNS = (
    Column("run", "Run"),
    Column("channel", "Channel"),
    Column("check", "Check"),
    Column("verdict", "Verdict", kind="verdict"),
    Column("detail", "Finding"),
)


def quality(analysis: Analysis) -> Section:
    """Return the section on quality."""
    rows = [
        (run.name, verdict.channel or say("whole run"), verdict.check, verdict.verdict, pretty_unit(verdict.detail))
        for run in analysis.runs
        for verdict in run.all_verdicts
    ]
    striking = sorted((row for row in rows if row[3] != "ok"), key=lambda row: row[3] != "bad")
    count = say("{n_rows} checks: {value} bad, ", n_rows=len(rows), value=sum(row[3] == "bad" for row in rows))
    count += say("{value} with a warning.", value=sum(row[3] == "warning" for row in rows))
    meaning = say("A channel with a bad check is not used. The limits of the checks are assumed, from practice.")
    blocks: list[Block] = [Paragraph(f"{count} {meaning}")]
    if striking:
        blocks.append(Table("quality-findings", say("What is doubtful or cannot be used"), _COLUMNS, striking))
    if rows:
        blocks.append(
            Details(say("All {n_rows} checks", n_rows=len(rows)), [Table("quality", say("All checks"), _COLUMNS, rows)])
        )
    return Section("quality", say("Quality of the recordings"), blocks)

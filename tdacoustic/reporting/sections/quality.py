"""Quality: what is doubtful first, every check below."""

from __future__ import annotations

from tdacoustic.reporting.document import Block, Column, Details, Paragraph, Section, Table
from tdacoustic.reporting.language import say, say_count
from tdacoustic.reporting.sections.words import pretty_unit
from tdacoustic.results import Analysis

__all__ = ["quality"]


def quality(analysis: Analysis) -> Section:
    """Return the section on quality."""
    rows = [
        (run.name, verdict.channel or say("whole run"), verdict.check, verdict.verdict, pretty_unit(verdict.detail))
        for run in analysis.runs
        for verdict in run.all_verdicts
    ]
    striking = sorted((row for row in rows if row[3] != "ok"), key=lambda row: row[3] != "bad")
    count = say_count(
        "{count} check: {bad} bad, {doubtful} with a warning.",
        "{count} checks: {bad} bad, {doubtful} with a warning.",
        len(rows),
        bad=sum(row[3] == "bad" for row in rows),
        doubtful=sum(row[3] == "warning" for row in rows),
    )
    meaning = say("A channel with a bad check is not used. The limits of the checks are assumed, from practice.")
    blocks: list[Block] = [Paragraph(f"{count} {meaning}")]
    origin = analysis.campaign.origin
    columns = (
        Column("run", say("Run")),
        Column("channel", say("Channel")),
        Column("check", say("Check")),
        Column("verdict", say("Verdict"), kind="verdict"),
        Column("detail", say("Finding")),
    )
    if striking:
        blocks.append(
            Table("quality-findings", say("What is doubtful or cannot be used"), columns, striking, origin=origin)
        )
    if rows:
        table = Table("quality", say("All checks"), columns, rows, origin=origin)
        blocks.append(Details(say_count("{count} check", "All {count} checks", len(rows)), [table]))
    return Section("quality", say("Quality of the recordings"), blocks)

"""All campaigns with their reports, what was left out, and how to ask the dataset more."""

from __future__ import annotations

from typing import Final

from tdacoustic.gathering.gathered import Gathering
from tdacoustic.gathering.result import GatheredResult
from tdacoustic.reporting.document import Block, Cell, Column, Details, Paragraph, Section, Table
from tdacoustic.reporting.language import mark, say, say_count
from tdacoustic.reporting.sections.campaigns_rows import MOST_ROWS, captioned, name_cell, when

__all__ = ["campaigns_list", "campaigns_sources"]

MOST_CAMPAIGNS: Final = 300
MOST_LEFT_OUT: Final = 100

_SHOWN: Final = mark("Shown are {shown} of {held}; all are in results.csv and in dataset/results.parquet.")


def campaigns_list(gathering: Gathering) -> Section:
    """Return the section with a row a campaign: those that something is to be said of first, then the newest."""
    columns = [
        Column("train", say("Train, else campaign")),
        Column("campaign", say("Campaign")),
        Column("date", say("Date")),
        Column("origin", say("Origin"), kind="origin"),
        Column("fleet", say("Fleet")),
        Column("conditions", say("Conditions"), kind="number", digits=0),
        Column("level", say("Loudest at 4 m"), "dB re 20 µPa", digits=1, kind="number"),
        Column("speed", say("At"), "km/h", digits=0, kind="number"),
        Column("runs", say("Runs"), kind="number", digits=0),
        Column("bad", say("Bad"), kind="number", digits=0),
        Column("stands_out", say("Stands out"), kind="number", digits=0),
    ]
    counts: dict[int, int] = {}
    for each in gathering.comparison.outliers:
        counts[id(each.result)] = counts.get(id(each.result), 0) + 1
    ordered = sorted(gathering.results, key=when, reverse=True)
    ordered.sort(key=lambda result: (-counts.get(id(result), 0), -result.runs_bad))
    rows: list[list[Cell]] = []
    for result in ordered[:MOST_CAMPAIGNS]:
        loudest = result.loudest
        level = [None, None] if loudest is None else [loudest.level_4m_db, loudest.train_speed_km_h]
        whose: list[Cell] = [name_cell(gathering, [result]), result.campaign, when(result) or None]
        n: list[Cell] = [result.runs, result.runs_bad, counts.get(id(result), 0)]
        rows.append([*whose, result.origin, result.fleet or None, result.n_conditions, *level, *n])
    held = len(ordered)
    shown = "" if len(rows) == held else say(_SHOWN, shown=len(rows), held=held)
    caption = captioned(say("Campaigns, those with values that stand out or bad runs first, then the newest"), shown)
    return Section("campaigns", say("Campaigns"), [Table("campaigns", caption, columns, rows)])


def campaigns_sources(gathering: Gathering) -> Section:
    """Return the section on where the numbers come from: the dataset, and what was left out of it."""
    words = say(
        "The dataset has a file a table; each row begins with its result, campaign, train, date, year, origin and "
        "fleet. Units and references of levels are in the metadata of the columns."
    )
    tables: list[list[Cell]] = [[name, f"dataset/{name}.parquet", rows] for name, rows in gathering.rows.items()]
    columns = [
        Column("table", say("Table")),
        Column("file", say("File")),
        Column("rows", say("Rows"), kind="number", digits=0),
    ]
    blocks: list[Block] = [Paragraph(words), Table("dataset", say("Tables of the dataset"), columns, tables)]
    known = sum(bool(result.identity.train) for result in gathering.results)
    dated = [result.identity for result in gathering.results if result.identity.year is not None]
    of_logs = sum(each.date_from == "log" for each in dated)
    blocks.append(
        Paragraph(
            say_count(
                "The train is known of {known} of {count} campaign, from their [meta]; the year of {dated}, of "
                "{of_logs} of them from the start that a log states. What is not stated is empty.",
                "The train is known of {known} of {count} campaigns, from their [meta]; the year of {dated}, of "
                "{of_logs} of them from the start that a log states. What is not stated is empty.",
                len(gathering.results),
                known=known,
                dated=len(dated),
                of_logs=of_logs,
            )
        )
    )
    notes = [(result, result.identity.note) for result in gathering.results if result.identity.note]
    if notes:
        blocks.append(_notes(gathering, notes))
    if gathering.left_out:
        blocks.append(_left_out(gathering))
    return Section("sources", say("Where the numbers come from"), blocks)


def _notes(gathering: Gathering, notes: list[tuple[GatheredResult, str]]) -> Details:
    columns = [Column("train", say("Train, else campaign")), Column("note", say("Not used"))]
    rows = [[name_cell(gathering, [result]), note] for result, note in notes[:MOST_ROWS]]
    return Details(
        say("Dates that could not be read: {count}", count=len(notes)),
        [Table("dates", say("Dates"), columns, rows)],
    )


def _left_out(gathering: Gathering) -> Table:
    columns = [Column("folder", say("Folder")), Column("reason", say("Why"))]
    rows = [[each.folder, each.reason] for each in gathering.left_out[:MOST_LEFT_OUT]]
    held = len(gathering.left_out)
    shown = (
        ""
        if len(rows) == held
        else say("Shown are {shown} of {held}; manifest.json names more.", shown=len(rows), held=held)
    )
    return Table("left-out", captioned(say("Folders that are left out"), shown), columns, rows)

"""Data problems over many campaigns: how many runs are bad, and why."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from tdacoustic.gathering.gathered import Gathering
from tdacoustic.gathering.result import GatheredResult
from tdacoustic.reporting.document import Block, Cell, Column, Paragraph, Section, Table
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.campaigns_rows import MOST_ROWS, name_cell, plural, shown_of, when

__all__ = ["bad_words", "campaigns_quality"]

_NOT_A_CHECK: Final = mark("level without log")


def campaigns_quality(gathering: Gathering) -> Section | None:
    """Return the section on data problems; None where no run was checked."""
    if not any(result.runs for result in gathering.results):
        return None
    words = say(
        "{bad} A run counts as bad where a check of it or of one of its channels is bad: then that ",
        bad=bad_words(gathering),
    )
    words += say("channel is not used. Limits of the checks are assumed, from practice.")
    blocks: list[Block] = [Paragraph(words)]
    reasons = _reasons(gathering)
    if reasons is not None:
        blocks.append(reasons)
    worst = _worst(gathering)
    if worst is not None:
        blocks.append(worst)
    return Section("data", say("Data problems"), blocks)


def bad_words(gathering: Gathering) -> str:
    """Return in a sentence an origin how many runs are bad, and most often why."""
    said = []
    for origin in gathering.origins:
        results = gathering.of_origin(origin)
        runs, bad, warned = (sum(getattr(r, key) for r in results) for key in ("runs", "runs_bad", "runs_warned"))
        if not runs:
            continue
        counts: dict[str, int] = {}
        for result in results:
            for count in result.quality:
                if count.verdict == "bad":
                    counts[count.check] = counts.get(count.check, 0) + count.runs
        why = (
            say(", most often for {counts}", counts=max(counts, key=lambda check: (counts[check], check)))
            if bad and counts
            else ""
        )
        said.append(
            say(
                "Of {plural} {bad} {value} bad{why}; {warned} more {value_2} a warning.",
                plural=plural(runs, say("{origin} run", origin=origin)),
                bad=bad,
                value="is" if bad == 1 else "are",
                why=why,
                warned=warned,
                value_2="has" if warned == 1 else "have",
            )
        )
    return " ".join(said)


def _reasons(gathering: Gathering) -> Table | None:
    columns = [
        Column("check", say("Check")),
        Column("origin", say("Origin"), kind="origin"),
        Column("verdict", say("Verdict"), kind="verdict"),
        Column("campaigns", say("Campaigns"), kind="number", digits=0),
        Column("runs", say("Runs"), kind="number", digits=0),
        Column("example", say("For example")),
        Column("detail", say("Finding")),
    ]
    held: dict[tuple[str, str, str], list[tuple[GatheredResult, int, str]]] = {}
    for result in gathering.results:
        for count in result.quality:
            if count.verdict != "ok" and count.check != _NOT_A_CHECK:
                entry = (result, count.runs, count.first_detail)
                held.setdefault((result.origin, count.verdict, count.check), []).append(entry)
    rows: list[list[Cell]] = []
    order = list(gathering.origins)
    for (origin, verdict, check), entries in sorted(
        held.items(),
        key=lambda item: (order.index(item[0][0]), item[0][1] != "bad", -len(item[1])),  # type: ignore[arg-type]
    )[:MOST_ROWS]:
        runs = sum(n for _, n, _ in entries)
        results = [result for result, _, _ in entries]
        counts: list[Cell] = [len(entries), runs]
        rows.append([check, origin, verdict, *counts, name_cell(gathering, results[:1]), entries[0][2][:160]])
    return Table("data-reasons", say("What is bad or doubtful, and how often"), columns, rows) if rows else None


def _worst(gathering: Gathering) -> Table | None:
    columns = [
        Column("train", say("Train, else campaign")),
        Column("campaign", say("Campaign")),
        Column("date", say("Date")),
        Column("origin", say("Origin"), kind="origin"),
        Column("runs", say("Runs"), kind="number", digits=0),
        Column("bad", say("Bad"), kind="number", digits=0),
        Column("warned", say("With a warning"), kind="number", digits=0),
        Column("why", say("Bad checks")),
    ]
    bad = sorted((r for r in gathering.results if r.runs_bad), key=lambda r: (-r.runs_bad / r.runs, -r.runs_bad))
    rows: list[list[Cell]] = []
    for result in bad[:MOST_ROWS]:
        counts: list[Cell] = [result.runs, result.runs_bad, result.runs_warned]
        whose: list[Cell] = [name_cell(gathering, [result]), result.campaign, when(result) or None, result.origin]
        rows.append([*whose, *counts, _why(result)])
    left_out = shown_of(len(rows), len(bad), "campaigns", "results")
    caption = say("Campaigns with bad runs, the largest part first.{left_out}", left_out=left_out).rstrip(".")
    return Table("data-worst", caption, columns, rows) if rows else None


def _why(result: GatheredResult) -> str:
    held: Sequence[str] = [
        f"{count.check} ({count.runs})" if count.runs > 1 else count.check
        for count in sorted(result.quality, key=lambda count: -count.runs)
        if count.verdict == "bad"
    ]
    return ", ".join(held)

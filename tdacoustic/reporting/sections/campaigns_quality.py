"""Data problems over many campaigns: how many runs are bad, and why."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from tdacoustic.gathering.gathered import Gathering
from tdacoustic.gathering.overview import Origin
from tdacoustic.gathering.result import GatheredResult
from tdacoustic.reporting.document import Block, Cell, Column, Paragraph, Section, Table
from tdacoustic.reporting.language import say, say_count
from tdacoustic.reporting.sections.campaigns_rows import (
    MOST_ROWS,
    SHOWN_CAMPAIGNS,
    captioned,
    name_cell,
    shown_of,
    when,
)
from tdacoustic.reporting.shown import ORIGIN_WORDS

__all__ = ["bad_words", "campaigns_quality"]

_NOT_A_CHECK: Final = "level without log"


def campaigns_quality(gathering: Gathering) -> Section | None:
    """Return the section on data problems; None where no run was checked."""
    if not any(result.runs for result in gathering.results):
        return None
    words = say(
        "A run counts as bad where a check of it or of one of its channels is bad: then that channel is not used. "
        "Limits of the checks are assumed, from practice."
    )
    blocks: list[Block] = [Paragraph(f"{bad_words(gathering)} {words}")]
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
        often = max(counts, key=lambda check: (counts[check], check)) if bad and counts else ""
        more = say_count("{count} more has a warning", "{count} more have a warning", warned)
        said.append(f"{_bad_of(runs, bad, origin, often)}; {more}.")
    return " ".join(said)


def _bad_of(runs: int, bad: int, origin: Origin, often: str) -> str:
    """How many runs are bad, and which check says so most often; empty of none."""
    of = say_count("{count} {origin} run", "{count} {origin} runs", runs, origin=say(ORIGIN_WORDS[origin]))
    if not often:
        return say_count("Of {runs} {count} is bad", "Of {runs} {count} are bad", bad, runs=of)
    return say_count(
        "Of {runs} {count} is bad, most often for {check}",
        "Of {runs} {count} are bad, most often for {check}",
        bad,
        runs=of,
        check=often,
    )


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
    left_out = shown_of(len(rows), len(bad), SHOWN_CAMPAIGNS, "results")
    caption = captioned(say("Campaigns with bad runs, the largest part first"), left_out)
    return Table("data-worst", caption, columns, rows) if rows else None


def _why(result: GatheredResult) -> str:
    held: Sequence[str] = [
        f"{count.check} ({count.runs})" if count.runs > 1 else count.check
        for count in sorted(result.quality, key=lambda count: -count.runs)
        if count.verdict == "bad"
    ]
    return ", ".join(held)

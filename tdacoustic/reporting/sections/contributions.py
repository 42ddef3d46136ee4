"""How many decibels come from where: contributions of components to each microphone, and how coherent they are."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from tdacoustic.attribution import CampaignContributions
from tdacoustic.attribution.contribution_spans import NamedSpan
from tdacoustic.attribution.contribution_step import paths_changed
from tdacoustic.contributions import GroupPart, SpanContributions
from tdacoustic.reporting.document import (
    Block,
    Column,
    Details,
    FigureBlock,
    Origin,
    Paragraph,
    Section,
    Sentences,
    Shown,
    Table,
)
from tdacoustic.reporting.language import mark, say, say_count
from tdacoustic.reporting.sections.coherence import coherence, state_speed, state_words
from tdacoustic.reporting.sections.contribution_figures import (
    Row,
    db_words,
    over_frequency,
    over_speed,
    part_words,
)
from tdacoustic.reporting.sections.folding import in_sight
from tdacoustic.reporting.sections.gear_words import begun_large
from tdacoustic.reporting.sections.words import joined, pretty_signs, slug, source_word
from tdacoustic.results import Analysis
from tdacoustic.tables.contributions import power_db

__all__ = ["contributions"]

SPAN_WORDS: Final = {"total": mark("all"), "tones": mark("tones"), "broadband": mark("broadband")}
VERDICTS: Final = (mark("flagged"), mark("refused"))
"""Of parts that a table gives reasons for."""
IN_SIGHT: Final = 3
"""Runs whose figures stand in sight; those of more are folded away."""
MOST: Final = 0.5
"""Part of the sound from which on it is said that no sensor explains it."""

METHOD = mark(
    "A contribution is the power at the microphone that moves with a component's sensors, by transfer paths of all "
    "runs together; cross-talk between the sensors is taken off as far as the runs differ enough in the mix of their "
    "sources to tell it. Known: cross-talk leaves less than 3 dB open. Flagged: more, so the level is what the sensors "
    "explain, cross-talk included, and its range is that of the readings, no confidence interval. Refused: next to "
    "nothing of it is its own; only the upper bound says something. Intervals are of 95 %. Parts and what no sensor "
    "explains may add up to less than was recorded, for a run whose paths are not those of all runs together; the "
    "interval of a known part reaches to where they would add up. What is loud and has no sensor is found under no "
    "component: it is what no sensor explains, or hides in those whose sensors feel it too; "
    "where the paths differ from state to state it is not known, and contributions.csv holds an upper bound."
)


def contributions(analysis: Analysis) -> Section | None:
    """Return the section on contributions and coherence; None where nothing could be held against each other."""
    found = analysis.contributions
    if found is None:
        return None
    rows = list(found.rows())
    receivers = list(dict.fromkeys(parts.receiver for _, _, parts in rows))
    first, others = receivers[0], receivers[1:]
    blocks: list[Block] = [
        *_answer(analysis, found, rows, first),
        *_of_receiver(analysis, found, rows, first, figures=True),
    ]
    for receiver in others:
        blocks.append(
            Details(
                say("The same at {receiver}", receiver=receiver),
                _of_receiver(analysis, found, rows, receiver, figures=False),
            )
        )
    blocks += [Paragraph(say(METHOD))]
    if found.notes:
        blocks.append(Sentences([say("Left out: {note}.", note=note) for note in found.notes]))
    blocks.append(coherence(analysis, found, first))
    return Section("contributions", say("How many decibels come from where"), blocks)


def _of_receiver(
    analysis: Analysis, found: CampaignContributions, rows: Sequence[Row], receiver: str, figures: bool
) -> list[Block]:
    """Tables and figures of one microphone; those over frequency where they are asked for."""
    held = [row for row in rows if row[2].receiver == receiver]
    origin = analysis.campaign.origin
    modes = {run.name: run.run.mode or "" for run in analysis.runs}
    drawn = [FigureBlock(figure, origin) for figure in over_frequency(found, held, receiver)] if figures else []
    blocks: list[Block] = [FigureBlock(figure, origin) for figure in over_speed(found, held, receiver, modes)]
    if len(drawn) <= IN_SIGHT:
        blocks += drawn
    else:
        blocks.append(
            Details(
                say_count(
                    "Contributions over frequency, {count} operating state",
                    "Contributions over frequency, {count} operating states",
                    len(drawn),
                ),
                drawn,
            )
        )
    whole = [row for row in held if row[1].kind in ("total", "tones", "broadband")]
    single = [row for row in held if row[1].kind in ("order", "tone")]
    table = _table(
        analysis, found, whole, slug("contributions", receiver), say("Contributions at {receiver}", receiver=receiver)
    )
    blocks.append(in_sight(table, say("Contributions at {receiver} as a table", receiver=receiver)))
    if single:
        title = say(
            "Contributions at {receiver}, tone by tone: each row is a band around the line or order that it names and "
            "holds all that lies in the band, other lines too",
            receiver=receiver,
        )
        table = _table(analysis, found, single, slug("contributions-of-tones", receiver), title)
        folded = say_count(
            "Tone by tone and order by order, {count} row", "Tone by tone and order by order, {count} rows", len(single)
        )
        blocks.append(Details(folded, [table]))
    return [*blocks, *_reasons(held, receiver, origin)]


# ---------------------------------------------------------------- words


def _answer(analysis: Analysis, found: CampaignContributions, rows: Sequence[Row], receiver: str) -> list[Block]:
    """A sentence a run, at one microphone."""
    sentences = []
    runs = list(dict.fromkeys(state.run for state in found.states))
    for run in runs:
        held = [row for row in rows if row[0].run == run and row[2].receiver == receiver]
        if held:
            sentences.append(pretty_signs(_sentence(held, several=len(runs) > len(analysis.campaign.conditions()))))
    low, high = next(parts.band_hz for _, span, parts in rows if span.kind == "total" and parts.receiver == receiver)
    if len(found.states) == 1:
        words = say(
            "At {receiver}, from a single operating state, which cannot tell cross-talk from a source, "
            "{low:.4g} to {high:.4g} Hz:",
            receiver=receiver,
            low=low,
            high=high,
        )
    else:
        words = say(
            "At {receiver}, by the paths of {count} operating states together, {low:.4g} to {high:.4g} Hz:",
            receiver=receiver,
            count=len(found.states),
            low=low,
            high=high,
        )
    return [Paragraph(words), Sentences(sentences)]


def _sentence(held: Sequence[Row], several: bool) -> str:
    state = held[0][0]
    what = (
        say("Condition {condition}, run {run}", condition=state.condition, run=state.run)
        if several
        else say("Condition {condition}", condition=state.condition)
    )
    if not state.steady:
        return f"{what}, {_run_up_words(held)}."
    if state_words(state):
        what = f"{what} ({state_words(state)})"
    by_kind = {span.kind: parts for _, span, parts in held if span.kind in ("total", "tones", "broadband")}
    total, tones = by_kind["total"], by_kind.get("tones")
    told = total if tones is None else tones
    parts = joined([part_words(name, part) for name, part in told.groups.items()])
    if tones is None:
        said = say("of {level}: {parts}; {rest}.", level=db_words(total.total), parts=parts, rest=_rest_words(total))
        return f"{what}: {said}"
    said = say(
        "of the tones' {level}: {parts}; {rest}.", level=db_words(tones.total), parts=parts, rest=_rest_words(tones)
    )
    return f"{what}: {said} {_whole_words(total)}"


def _rest_words(parts: SpanContributions) -> str:
    """How much no sensor explains, as a clause."""
    if paths_changed(parts):
        return say("the paths differ from state to state, so what no sensor explains is not known")
    return say("no sensor explains {level}", level=_rest_level(parts))


def _whole_words(parts: SpanContributions) -> str:
    """How much of the whole sound no sensor explains, as a sentence."""
    level = db_words(parts.total)
    if paths_changed(parts):
        return say(
            "Of all {level} the paths differ from state to state, so what no sensor explains is not known.", level=level
        )
    return say("Of all {level} no sensor explains {rest}.", level=level, rest=_rest_level(parts))


def _rest_level(parts: SpanContributions) -> str:
    share = parts.residual / parts.total if parts.total > 0.0 else 0.0
    level = db_words(parts.residual)
    return f"{level} ({min(100.0 * share, 100.0):.0f} %)" if 100.0 * share >= 50.0 else level


def _run_up_words(held: Sequence[Row]) -> str:
    """Of a run-up: how often each component's part of the whole is known, and from where to where it goes."""
    rows = [(state, parts) for state, span, parts in held if span.kind == "total"]
    speeds = [speed for state, _ in rows if (speed := state_speed(state)) is not None]
    known = [words for name in rows[0][1].groups if (words := _known_words(name, [parts for _, parts in rows]))]
    said = (
        say("of the whole sound {parts}", parts=joined(known))
        if known
        else say("no component's part is known at any of {count} speeds", count=len(rows))
    )
    clauses = [said]
    most = sum(p.residual > MOST * p.total and not paths_changed(p) for _, p in rows)
    if most:
        clauses.append(say("most of the sound is explained by no sensor at {count} of them", count=most))
    differ = sum(paths_changed(p) for _, p in rows)
    if differ:
        clauses.append(
            say(
                "what no sensor explains is not known at {count}, for the paths differ from state to state",
                count=differ,
            )
        )
    what = (
        say("a run-up from {first} to {last}", first=speeds[0][0], last=" ".join(speeds[-1]))
        if speeds
        else say("a run-up")
    )
    return f"{what}: {'; '.join(clauses)}"


def _known_words(name: str, rows: Sequence[SpanContributions]) -> str:
    """Levels between which a component's part is known; empty where it is nowhere."""
    levels = [power_db(parts.groups[name].mean_square) for parts in rows if parts.groups[name].verdict == "ok"]
    known = [level for level in levels if level is not None]
    if not known:
        return ""
    return say(
        "{component} {lowest:.1f} to {highest:.1f} dB, known at {count} of {all} speeds",
        component=source_word(name),
        lowest=min(known),
        highest=max(known),
        count=len(known),
        all=len(rows),
    )


# ---------------------------------------------------------------- tables


def _table(analysis: Analysis, found: CampaignContributions, rows: Sequence[Row], name: str, title: str) -> Table:
    columns = [
        Column("run", say("Run")),
        Column("speed", say("Speed"), align="right"),
        Column("span", say("Sound")),
        Column("total_db", say("Recorded"), "dB", 1, "number"),
        Column("residual_db", say("No sensor"), "dB", 1, "number"),
        *(
            Column(f"{slug(component)}_db", begun_large(source_word(component)), "dB", kind="number", align="left")
            for component in found.components
        ),
    ]
    cells = [
        [
            state.run,
            state_words(state),
            _span_words(span),
            power_db(parts.total),
            None if paths_changed(parts) else power_db(parts.residual),
            *(_cell(parts.groups[component]) for component in found.components),
        ]
        for state, span, parts in rows
    ]
    return Table(
        name, say("{title} (levels re 20 µPa, 95 %)", title=title), columns, cells, origin=analysis.campaign.origin
    )


def _cell(part: GroupPart) -> Shown:
    """A part in the table: its level and range, or its bound, and its verdict where it is not known."""
    words = _cell_words(part)
    if part.verdict == "refused":
        return Shown(words)
    if part.verdict == "below":
        return Shown(words, None, power_db(part.high))
    return Shown(words, power_db(part.mean_square), power_db(part.high))


def _cell_words(part: GroupPart) -> str:
    low, high = power_db(part.low), power_db(part.high)
    bound = "" if high is None else f"\N{LESS-THAN OR EQUAL TO} {high:.1f}"
    if part.verdict in ("refused", "below"):
        return say("refused, {bound}", bound=bound) if part.verdict == "refused" else bound
    reach = bound if low is None or high is None else say("{low:.1f} to {high:.1f}", low=low, high=high)
    level = power_db(part.mean_square)
    said = "" if level is None else f"{level:.1f}"
    if part.verdict != "flagged":
        return f"{said} ({reach})"
    return say("{level} flagged, {range}", level=said, range=reach) if said else say("flagged, {range}", range=reach)


def _span_words(span: NamedSpan) -> str:
    return say(SPAN_WORDS[span.kind]) if span.kind in SPAN_WORDS else span.span.name


def _reasons(held: Sequence[Row], receiver: str, origin: Origin) -> list[Block]:
    """Why parts are flagged or refused, each reason once, with where."""
    where: dict[tuple[str, str, str], list[str]] = {}
    for state, span, parts in held:
        for name, part in parts.groups.items():
            if part.verdict in VERDICTS and span.kind != "band":
                reason = part.reason.split(":")[0]
                where.setdefault((name, part.verdict, reason), []).append(
                    say("run {run} {span}", run=state.run, span=_span_words(span))
                )
    if not where:
        return []
    columns = (
        Column("part", say("Part")),
        Column("verdict", say("Verdict"), kind="verdict"),
        Column("reason", say("Why")),
        Column("count", say("Times"), "", 0, "number"),
        Column("where", say("Where")),
    )
    rows = [
        (
            source_word(name),
            verdict,
            reason,
            len(places),
            f"{', '.join(places[:4])}{', ...' if len(places) > 4 else ''}",
        )
        for (name, verdict, reason), places in where.items()
    ]
    caption = say("Why parts are flagged or refused")
    table = Table(slug("contribution-reasons", receiver), caption, columns, rows, origin=origin)
    folded = say_count(
        "Why parts are flagged or refused, {count} reason",
        "Why parts are flagged or refused, {count} reasons",
        len(rows),
    )
    return [Details(folded, [table])]

"""How many decibels come from where: contributions of components to each microphone, and how coherent they are."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from tdacoustic.attribution import CampaignContributions
from tdacoustic.attribution.contribution_spans import NamedSpan
from tdacoustic.attribution.contribution_step import paths_changed
from tdacoustic.contributions import GroupPart, SpanContributions
from tdacoustic.reporting.document import Block, Column, Details, FigureBlock, Paragraph, Section, Sentences, Table
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.coherence import coherence, state_words
from tdacoustic.reporting.sections.contribution_figures import (
    Row,
    db_words,
    over_frequency,
    over_speed,
    part_words,
)
from tdacoustic.reporting.sections.folding import in_sight
from tdacoustic.reporting.sections.words import joined, pretty_signs, slug
from tdacoustic.results import Analysis
from tdacoustic.tables.contributions import power_db

__all__ = ["agreement_words", "contributions"]

IN_SIGHT: Final = 3
"""Runs whose figures stand in sight; those of more are folded away."""
MOST: Final = 0.5
"""Part of the sound from which on it is said that no sensor explains it."""

METHOD = mark(
    "A contribution is the power at the microphone that moves with a component's sensors, by transfer paths of all "
    "runs together; cross-talk between the sensors is taken off as far as the runs differ enough in the mix of their "
    "sources to tell it. Known: cross-talk leaves less than 3 dB open. Flagged: more, so the level is what the sensors "
    "explain, cross-talk included, and its range is that of the readings, no confidence interval. Refused: next to "
    "nothing of it is its own; only the upper bound says something. Intervals are of 95 %. What is loud and has no "
    "sensor is found under no component: it is what no sensor explains, or hides in those whose sensors feel it too; "
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
            Details(say("Contributions over frequency, {n_drawn} operating states", n_drawn=len(drawn)), drawn)
        )
    whole = [row for row in held if row[1].kind in ("total", "tones", "broadband")]
    single = [row for row in held if row[1].kind in ("order", "tone")]
    table = _table(
        analysis, found, whole, slug("contributions", receiver), say("Contributions at {receiver}", receiver=receiver)
    )
    blocks.append(in_sight(table, say("Contributions at {receiver} as a table", receiver=receiver)))
    if single:
        title = say("Contributions at {receiver}, tone by tone", receiver=receiver)
        table = _table(analysis, found, single, slug("contributions-of-tones", receiver), title)
        blocks.append(Details(say("Tone by tone and order by order, {n_single} rows", n_single=len(single)), [table]))
    return [*blocks, *_reasons(held, receiver)]


# ---------------------------------------------------------------- words


def _answer(analysis: Analysis, found: CampaignContributions, rows: Sequence[Row], receiver: str) -> list[Block]:
    """A sentence a run, at one microphone."""
    sentences = []
    runs = list(dict.fromkeys(state.run for state in found.states))
    for run in runs:
        held = [row for row in rows if row[0].run == run and row[2].receiver == receiver]
        if held:
            sentences.append(pretty_signs(_sentence(held, several=len(runs) > len(analysis.campaign.conditions()))))
    words = say(
        "At {receiver}, by the paths of {n_states} operating states together",
        receiver=receiver,
        n_states=len(found.states),
    )
    if len(found.states) == 1:
        words = say(
            "At {receiver}, from a single operating state, which cannot tell cross-talk from a source",
            receiver=receiver,
        )
    low, high = next(parts.band_hz for _, span, parts in rows if span.kind == "total" and parts.receiver == receiver)
    return [
        Paragraph(say("{words}, {low:.4g} to {high:.4g} Hz:", words=words, low=low, high=high)),
        Sentences(sentences),
    ]


def _sentence(held: Sequence[Row], several: bool) -> str:
    state = held[0][0]
    what = say("Condition {condition}", condition=state.condition) + (
        say(", run {run}", run=state.run) if several else ""
    )
    if not state.steady:
        return f"{what}, {_run_up_words(held)}"
    speed = f" ({state_words(state)})" if state_words(state) else ""
    by_kind = {span.kind: parts for _, span, parts in held if span.kind in ("total", "tones", "broadband")}
    total, tones = by_kind["total"], by_kind.get("tones")
    said = f"{what}{speed}: "
    if tones is not None:
        told = joined([part_words(name, part) for name, part in tones.groups.items()])
        said += say(
            "of the tones' {db}: {told}; {unexplained}. ",
            db=db_words(tones.total),
            told=told,
            unexplained=_unexplained(tones),
        )
        said += say("Of all {db} ", db=db_words(total.total))
    else:
        told = joined([part_words(name, part) for name, part in total.groups.items()])
        said += say("of {db}: {told}; ", db=db_words(total.total), told=told)
    return said + f"{_unexplained(total)}."


def _unexplained(parts: SpanContributions) -> str:
    if paths_changed(parts):
        return say("the paths differ from state to state, so what no sensor explains is not known")
    share = 100.0 * parts.residual / parts.total if parts.total > 0.0 else 0.0
    return say("no sensor explains {db}", db=db_words(parts.residual)) + (
        f" ({min(share, 100.0):.0f} %)" if share >= 50.0 else ""
    )


def _run_up_words(held: Sequence[Row]) -> str:
    """Of a run-up: how often each component's part of the whole is known, and from where to where it goes."""
    rows = [(state, parts) for state, span, parts in held if span.kind == "total"]
    speeds = [words.removeprefix("motor ") for state, _ in rows if (words := state_words(state))]
    said = []
    for name in rows[0][1].groups:
        levels = [power_db(p.groups[name].mean_square) for _, p in rows if p.groups[name].verdict == "ok"]
        known = [level for level in levels if level is not None]
        if known:
            said.append(
                say(
                    "{name} {known:.1f} to {known_2:.1f} dB, known at {n_known} of {n_rows} speeds",
                    name=name,
                    known=min(known),
                    known_2=max(known),
                    n_known=len(known),
                    n_rows=len(rows),
                )
            )
    known_any = bool(said)
    said = said or [say("no component's part is known at any of {n_rows} speeds", n_rows=len(rows))]
    most = sum(p.residual > MOST * p.total and not paths_changed(p) for _, p in rows)
    end = say("; most of the sound is explained by no sensor at {most} of them", most=most) if most else ""
    differ = sum(paths_changed(p) for _, p in rows)
    if differ:
        end += say(
            "; what no sensor explains is not known at {differ}, for the paths differ from state to state",
            differ=differ,
        )
    ends = say(" from {split} to {speeds}", split=speeds[0].split()[0], speeds=speeds[-1]) if speeds else ""
    return say(
        "a run-up{ends}: {value}{said}{end}.",
        ends=ends,
        value=say("of the whole sound ") if known_any else "",
        said=joined(said),
        end=end,
    )


def agreement_words(analysis: Analysis, condition: str) -> str:
    """Return whether the kinds of evidence on a condition agree, as one sentence; empty where there is nothing to say.

    Parameters
    ----------
    analysis : Analysis
    condition : str
    """
    found = analysis.agreements.get(condition)
    if found is None:
        return ""
    quiet = "contribution" in found.agreement.silent
    doubt = (
        say("contributions: {contribution_words}", contribution_words=found.contribution_words)
        if quiet and found.contribution_words
        else ""
    )
    if found.agreement.word == "silent":
        return f"{doubt[0].upper()}{doubt[1:]}." if doubt else ""
    by_source: dict[str, list[str]] = {}
    for kind, (source, _) in found.agreement.leads.items():
        by_source.setdefault(source, []).append(f"{kind}s")
    said = [say("{kinds} say {source}", kinds=joined(kinds), source=source) for source, kinds in by_source.items()]
    silent = [f"{kind}s" for kind in found.agreement.silent if kind != "contribution"]
    said += [say("{silent} name no source", silent=joined(silent))] if silent else []
    said += [doubt] if doubt else []
    opening = {"agree": say("The kinds of evidence agree"), "disagree": say("The kinds of evidence disagree")}
    return f"{opening.get(found.agreement.word, say('One kind of evidence alone'))}: {'; '.join(said)}."


# ---------------------------------------------------------------- tables


def _table(analysis: Analysis, found: CampaignContributions, rows: Sequence[Row], name: str, title: str) -> Table:
    columns = [
        Column("run", say("Run")),
        Column("speed", say("Speed"), align="right"),
        Column("span", say("Sound")),
        Column("total_db", say("Measured"), "dB", 1, "number"),
        Column("residual_db", say("No sensor"), "dB", 1, "number"),
        *(Column(f"{slug(component)}_db", component.capitalize(), "dB") for component in found.components),
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


def _cell(part: GroupPart) -> str:
    """A part in the table: its level and range, or its bound, and its verdict where it is not known."""
    low, high = power_db(part.low), power_db(part.high)
    bound = "" if high is None else f"\N{LESS-THAN OR EQUAL TO} {high:.1f}"
    if part.verdict in ("refused", "below"):
        return say("refused, {bound}", bound=bound) if part.verdict == "refused" else bound
    reach = bound if low is None or high is None else say("{low:.1f} to {high:.1f}", low=low, high=high)
    level = power_db(part.mean_square)
    said = "" if level is None else f"{level:.1f}"
    return say("{said} flagged, {reach}", said=said, reach=reach) if part.verdict == "flagged" else f"{said} ({reach})"


def _span_words(span: NamedSpan) -> str:
    return {"total": "all", "tones": "tones", "broadband": "broadband"}.get(span.kind, span.span.name)


def _reasons(held: Sequence[Row], receiver: str) -> list[Block]:
    """Why parts are flagged or refused, each reason once, with where."""
    where: dict[tuple[str, str, str], list[str]] = {}
    for state, span, parts in held:
        for name, part in parts.groups.items():
            if part.verdict in ("flagged", "refused") and span.kind != "band":
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
        (name, verdict, reason, len(places), f"{', '.join(places[:4])}{', ...' if len(places) > 4 else ''}")
        for (name, verdict, reason), places in where.items()
    ]
    table = Table(slug("contribution-reasons", receiver), say("Why parts are flagged or refused"), columns, rows)
    return [Details(say("Why parts are flagged or refused, {n_rows} reasons", n_rows=len(rows)), [table])]

"""Every noise line with its source and the evidence for it, as the paper's Table 2 has them."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from tdacoustic.attribution import SourceLine
from tdacoustic.measured.runs import receivers
from tdacoustic.reporting.document import Block, Cell, Column, Details, Paragraph, Section, Sentences, Shown, Table
from tdacoustic.reporting.language import mark, say, say_count
from tdacoustic.reporting.sections.gear_words import begun_large
from tdacoustic.reporting.sections.words import (
    by_frequency,
    condition_words,
    is_override,
    joined,
    pretty_signs,
    probability_words,
    same_line,
    slug,
    source_word,
)
from tdacoustic.results import Analysis
from tdacoustic.units import level_db

__all__ = ["sources"]

METHOD = mark(
    "Two questions are kept apart: which body radiates a line (whose sensors show it over their own local floor) and "
    "what excites it (whose order it is). The source follows the sensors; where both components' sensors or none show "
    "the line, the order decides; where neither does, it stays ambiguous or unassigned. A conflict means that the "
    "sensors and the order speak for different components. The columns Motor and Gearbox are the prominence in that "
    "component's best sensor; a dash stands where the line leaves no trace. "
    "P is the probability that the line is of this source, when segments are resampled; 'set' "
    "where the engineer has set it."
)
IN_SIGHT = 8
"""Sentences of evidence that are not folded away."""
MARKS = {
    (True, False): mark("conflict"),
    (False, True): mark("override"),
    (True, True): mark("conflict, override"),
}
"""What stands beside a line: whether sensors and order conflict, and whether the engineer has set its source."""
NO_LINES = mark("No noise line was found in a steady run, so there is nothing to ascribe.")


def sources(analysis: Analysis) -> Section | None:
    """Return the section on the sources, or None where there is nothing to ascribe: no fleet or no microphone."""
    campaign = analysis.campaign
    asked = analysis.fleet is not None and receivers(analysis.runs)
    if not asked and not campaign.excludes and not campaign.overrides:
        return None
    blocks: list[Block] = [Paragraph(say(METHOD) if analysis.sources else say(NO_LINES))]
    for condition in campaign.conditions():
        held = [source for source in analysis.sources if source.line.condition == condition]
        if held:
            blocks += [_table(analysis, condition, held), _evidence(held)]
    blocks += _overrides(analysis) + _excludes(analysis)
    return Section("sources", say("Sources of the noise lines"), blocks)


def _table(analysis: Analysis, condition: str, held: Sequence[SourceLine]) -> Table:
    components = _components(analysis)
    marked = any(source.conflict or is_override(source) for source in held)
    several = len({source.line.channel for source in analysis.sources}) > 1
    columns = [
        Column("frequency_hz", say("Line"), "Hz", 1, "number"),
        *([Column("channel", say("Receiver"))] if several else []),
        Column("level_db", say("Level"), "dB", 1, "number"),
        *(
            Column(f"{slug(name)}_prominence_db", begun_large(source_word(name)), "dB", 0, "number")
            for name in components
        ),
        Column("radiator", say("Radiator")),
        Column("excitation", say("Excitation")),
        Column("source", say("Source"), kind="verdict"),
        *([Column("mark", say("Mark"), kind="verdict")] if marked else []),
        Column("confidence", "P", kind="number"),
    ]
    rows = []
    for source in by_frequency(held):
        prominence = source.line.component_prominence_db()
        cells: dict[str, Cell] = {
            f"{slug(name)}_prominence_db": prominence.get(name) for name in components
        }  # minus infinity, no trace, is shown as a dash
        cells |= {
            "frequency_hz": source.line.frequency_hz,
            "channel": source.line.channel,
            "level_db": level_db(math.sqrt(source.line.mean_square), "sound_pressure"),
            "radiator": source.radiator or say("not asked"),
            "excitation": _excitation_words(source),
            "source": source.source,
            "mark": MARKS.get((source.conflict, is_override(source)), ""),
            "confidence": _probability_cell(source),
        }
        rows.append([cells[column.key] for column in columns])
    title = say("Noise lines, {condition}", condition=condition_words(analysis, condition))
    verdict = next((v.dominant for v in analysis.dominance if v.condition == condition), None)
    if verdict is not None and analysis.fleet is not None:
        title += f": {source_word(verdict)}"
    return Table(slug("sources", condition), title, columns, rows, origin=analysis.campaign.origin)


def _probability_cell(source: SourceLine) -> Shown | None:
    if is_override(source):
        return Shown(say("set"))
    return None if source.confidence is None else Shown(probability_words(source.confidence), source.confidence)


def _evidence(held: Sequence[SourceLine]) -> Block:
    """The evidence as a sentence a line, receivers of whom the same is true together; folded away where it is long."""
    groups: list[tuple[SourceLine, list[str]]] = []
    for source in by_frequency(held):
        if groups and same_line(source, groups[-1][0]) and _words(source) == _words(groups[-1][0]):
            groups[-1][1].append(source.line.channel)
        else:
            groups.append((source, [source.line.channel]))
    several = len({source.line.channel for source in held}) > 1
    sentences = Sentences([_evidence_words(first, who if several else []) for first, who in groups])
    count = len(sentences.items)
    if count <= IN_SIGHT:
        return sentences
    return Details(say_count("Evidence, {count} sentence", "Evidence, {count} sentences", count), [sentences])


def _evidence_words(source: SourceLine, who: Sequence[str]) -> str:
    frequency, evidence = source.line.frequency_hz, _words(source)
    if not who:
        return f"{frequency:.1f} Hz: {evidence}"
    return say(
        "{frequency:.1f} Hz at {channels}: {evidence}", frequency=frequency, channels=joined(who), evidence=evidence
    )


def _words(source: SourceLine) -> str:
    return pretty_signs(re.sub(r"\([+-]0\.0 Hz\)", lambda _: say("(0.0 Hz off)"), source.evidence))


def _components(analysis: Analysis) -> list[str]:
    """Components whose sensors were asked, motor and gearbox first."""
    found = {view.component for source in analysis.sources for view in source.line.views()}
    first = [name for name in ("motor", "gearbox") if name in found]
    return first + sorted(found - set(first))


def _excitation_words(source: SourceLine) -> str:
    if source.excitation_name is None:
        return source.excitation
    return source.excitation_name


def _overrides(analysis: Analysis) -> list[Block]:
    rows = []
    for override in analysis.campaign.overrides:
        struck = [
            say("{frequency:.1f} Hz at {channel}", frequency=source.line.frequency_hz, channel=source.line.channel)
            for source in analysis.sources
            if source.line.condition == override.condition
            and is_override(source)
            and override.reason in source.evidence
            and source.source == override.source
        ]
        effect = joined(struck) if struck else say("no such noise line was found")
        rows.append((override.condition, override.frequency_hz, override.source, override.reason, effect))
    columns = (
        Column("condition", say("Condition")),
        Column("frequency_hz", say("Line"), "Hz", None, "number"),
        Column("source", say("Source"), kind="verdict"),
        Column("reason", say("Reason")),
        Column("lines", say("Lines it was given to")),
    )
    return [Table("overrides", say("Overrides by the engineer"), columns, rows)] if rows else []


def _excludes(analysis: Analysis) -> list[Block]:
    table = analysis.tables["lines"]
    table = table[table["component"].isna() | ~table["component"].isin(["motor", "gearbox"])]
    microphones = {channel.name for channel in analysis.campaign.channels if channel.role in (None, "receiver")}
    rows = []
    for exclude in analysis.campaign.excludes:
        low, high = exclude.frequency_hz
        inside = table[(table["condition"] == exclude.condition) & table["frequency_hz"].between(low, high)]
        inside = inside[inside["channel"].isin(microphones if exclude.channel is None else [exclude.channel])]
        lines = [
            say(
                "{frequency:.1f} Hz at {channel}, {level:.1f} dB",
                frequency=row["frequency_hz"],
                channel=row["channel"],
                level=row["level_db"],
            )
            for row in inside.to_dict("records")
        ]
        effect = "; ".join(dict.fromkeys(lines)) or say("no noise line lies in it")
        rows.append(
            (
                exclude.condition,
                exclude.channel or say("all"),
                say("{low:g} to {high:g}", low=low, high=high),
                exclude.reason,
                effect,
            )
        )
    columns = (
        Column("condition", say("Condition")),
        Column("channel", say("Channel")),
        Column("frequency_hz", say("Band"), "Hz"),
        Column("reason", say("Reason")),
        Column("lines", say("Noise lines left out")),
    )
    return [Table("exclusions", say("Exclusions by the engineer"), columns, rows)] if rows else []

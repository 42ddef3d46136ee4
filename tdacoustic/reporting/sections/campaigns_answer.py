"""The fleet view's answer first: how much was gathered, who dominates when, how loud, and what does not fit."""

from __future__ import annotations

import itertools
from collections.abc import Mapping

from tdacoustic.gathering.gathered import Gathering
from tdacoustic.gathering.levels import level_points
from tdacoustic.gathering.overview import Origin
from tdacoustic.gathering.speed_bands import SpeedBand
from tdacoustic.gathering.verdicts import Tally, tallies
from tdacoustic.reporting.document import Block, Notice, Paragraph, Sentences
from tdacoustic.reporting.language import say, say_count
from tdacoustic.reporting.sections.campaigns_dominance import matrix_width
from tdacoustic.reporting.sections.campaigns_outliers import outlier_words
from tdacoustic.reporting.sections.campaigns_quality import bad_words
from tdacoustic.reporting.sections.campaigns_rows import campaigns_words, years_words
from tdacoustic.reporting.sections.words import joined, source_word
from tdacoustic.reporting.shown import ORIGIN_WORDS

__all__ = ["campaigns_answer", "how_many"]


def campaigns_answer(gathering: Gathering) -> list[Block]:
    """Return the summary."""
    said = [how_many(gathering)]
    for origin in gathering.origins:
        said += [text for text in (_dominance(gathering, origin), _levels(gathering, origin)) if text]
    said.append(outlier_words(gathering))
    quality = bad_words(gathering)
    if quality:
        said.append(quality)
    blocks: list[Block] = [Sentences(said)]
    if gathering.links:
        words = say(
            "In the tables, a name leads to the campaign's own report; where a row is of several, to the newest one's."
        )
        blocks.append(Paragraph(words))
    if gathering.left_out:
        first = gathering.left_out[0]
        text = say_count(
            "One folder is left out: {folder}: {reason}.",
            "{count} folders left out, among them {folder}: {reason}.",
            len(gathering.left_out),
            folder=first.folder,
            reason=first.reason,
        )
        blocks.append(Notice("warning", text))
    return blocks


def how_many(gathering: Gathering) -> str:
    """Return in a sentence how many campaigns of how many trains and years there are, each origin by itself."""
    parts = []
    for origin in gathering.origins:
        results = gathering.of_origin(origin)
        if results:
            parts.append(campaigns_words(len(results), origin))
    trains = {result.identity.train for result in gathering.results if result.identity.train}
    years = {result.identity.year for result in gathering.results if result.identity.year is not None}
    fleets = {result.fleet for result in gathering.results if result.fleet}
    said = [joined(parts)]
    if trains:
        said = [
            say_count(
                "{campaigns} of {count} train", "{campaigns} of {count} trains", len(trains), campaigns=joined(parts)
            )
        ]
    if fleets:
        said.append(say_count("{count} fleet", "{count} fleets", len(fleets)))
    if years:
        said.append(years_words(years))
    return f"{', '.join(said)}."


def _dominance(gathering: Gathering, origin: Origin) -> str:
    results = gathering.of_origin(origin)
    found = tallies(results, matrix_width(gathering))
    if not found:
        return ""
    counts: dict[str, int] = {}
    for tally in found.values():
        for word, count in tally.words:
            counts[word] = counts.get(word, 0) + count
    named = sorted((item for item in counts.items() if item[0] != "undecided"), key=lambda item: -item[1])
    total = sum(counts.values())
    parts = [say("the {source} in {count}", source=source_word(word), count=count) for word, count in named]
    words = say(ORIGIN_WORDS[origin])
    if not parts:
        return say_count(
            "None of {count} {origin} condition has a named source: all are undecided.",
            "None of {count} {origin} conditions has a named source: all are undecided.",
            total,
            origin=words,
        )
    clauses = [
        say_count(
            "Most of the noise lines' energy is of {sources} of {count} {origin} condition with a verdict",
            "Most of the noise lines' energy is of {sources} of {count} {origin} conditions with a verdict",
            total,
            sources=joined(parts),
            origin=words,
        )
    ]
    undecided = counts.get("undecided", 0)
    if undecided:
        clauses.append(say_count("{count} is undecided", "{count} are undecided", undecided))
    return " ".join(part for part in (f"{'; '.join(clauses)}.", _over_speed(found)) if part)


def _over_speed(found: Mapping[SpeedBand, Tally]) -> str:
    """Where which source has more than half of the verdicts; empty where that says nothing."""
    parts = []
    for majority, bands in itertools.groupby(found.items(), key=lambda item: item[1].majority):
        held = [band for band, _ in bands]
        if majority:
            parts.append(
                say(
                    "the {source} from {low:g} to {high:g} km/h",
                    source=source_word(majority),
                    low=held[0].low,
                    high=held[-1].high,
                )
            )
    if len(found) < 2 or not parts:
        return ""
    return say("More than half of the verdicts name {sources}.", sources=joined(parts))


def _levels(gathering: Gathering, origin: Origin) -> str:
    points = level_points(gathering.results, origin)
    if not points:
        return ""
    low, high = (pick(points, key=lambda point: point.level_db) for pick in (min, max))
    words = say(ORIGIN_WORDS[origin])
    if len(points) == 1:
        return say(
            "The one {origin} level at 4 m is {level:.1f} dB re 20 µPa at {speed:.0f} km/h.",
            origin=words,
            level=high.level_db,
            speed=high.speed_km_h,
        )
    return say(
        "The {count} {origin} levels at 4 m go from {lowest:.1f} dB re 20 µPa ({lowest_train}, "
        "{lowest_speed:.0f} km/h) to {highest:.1f} dB ({highest_train}, {highest_speed:.0f} km/h).",
        count=len(points),
        origin=words,
        lowest=low.level_db,
        lowest_train=low.result.train,
        lowest_speed=low.speed_km_h,
        highest=high.level_db,
        highest_train=high.result.train,
        highest_speed=high.speed_km_h,
    )

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
from tdacoustic.reporting.language import say
from tdacoustic.reporting.sections.campaigns_dominance import matrix_width
from tdacoustic.reporting.sections.campaigns_outliers import outlier_words
from tdacoustic.reporting.sections.campaigns_quality import bad_words
from tdacoustic.reporting.sections.campaigns_rows import plural
from tdacoustic.reporting.sections.words import joined

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
        count = len(gathering.left_out)
        first = gathering.left_out[0]
        text = say(
            "{plural} left out, among them {folder}: {reason}.",
            plural=plural(count, "folder"),
            folder=first.folder,
            reason=first.reason,
        )
        if count == 1:
            text = say("One folder is left out: {folder}: {reason}.", folder=first.folder, reason=first.reason)
        blocks.append(Notice("warning", text))
    return blocks


def how_many(gathering: Gathering) -> str:
    """Return in a sentence how many campaigns of how many trains and years there are, each origin by itself."""
    parts = []
    for origin in gathering.origins:
        results = gathering.of_origin(origin)
        if results:
            parts.append(plural(len(results), say("{origin} campaign", origin=origin)))
    trains = {result.identity.train for result in gathering.results if result.identity.train}
    years = sorted({result.identity.year for result in gathering.results if result.identity.year is not None})
    fleets = {result.fleet for result in gathering.results if result.fleet}
    said = joined(parts)
    if trains:
        said += say(" of {plural}", plural=plural(len(trains), "train"))
    if fleets:
        said += f", {plural(len(fleets), 'fleet')}"
    if years:
        said += f", {years[0]}" if len(years) == 1 else say(", {years} to {years_2}", years=years[0], years_2=years[-1])
    return f"{said}."


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
    parts = [say("the {word} in {count}", word=word, count=count) for word, count in named]
    undecided = counts.get("undecided", 0)
    if not parts:
        return say(
            "None of {plural} has a named source: all are undecided.",
            plural=plural(total, say("{origin} condition", origin=origin)),
        )
    said = say(
        "Most of the noise lines' energy is of {parts} of {plural}",
        parts=joined(parts),
        plural=plural(total, say("{origin} condition", origin=origin)),
    )
    said += (
        say(
            " with a verdict; {undecided} {value} undecided.",
            undecided=undecided,
            value="is" if undecided == 1 else "are",
        )
        if undecided
        else say(" with a verdict.")
    )
    return f"{said}{_over_speed(found)}"


def _over_speed(found: Mapping[SpeedBand, Tally]) -> str:
    """Where which source has more than half of the verdicts."""
    parts = []
    for majority, bands in itertools.groupby(found.items(), key=lambda item: item[1].majority):
        held = [band for band, _ in bands]
        if majority:
            parts.append(
                say(
                    "the {majority} from {low:g} to {high:g} km/h",
                    majority=majority,
                    low=held[0].low,
                    high=held[-1].high,
                )
            )
    if len(found) < 2 or not parts:
        return ""
    return say(" More than half of the verdicts name {parts}.", parts=joined(parts))


def _levels(gathering: Gathering, origin: Origin) -> str:
    points = level_points(gathering.results, origin)
    if not points:
        return ""
    low, high = (pick(points, key=lambda point: point.level_db) for pick in (min, max))
    if len(points) == 1:
        return say(
            "The one {origin} level at 4 m is {level_db:.1f} dB re 20 µPa at {speed_km_h:.0f} km/h.",
            origin=origin,
            level_db=high.level_db,
            speed_km_h=high.speed_km_h,
        )
    return say(
        "The {n_points} {origin} levels at 4 m go from {level_db:.1f} dB re 20 µPa ({train}, "
        "{speed_km_h:.0f} km/h) to {level_db_2:.1f} dB ({train_2}, {speed_km_h_2:.0f} km/h).",
        n_points=len(points),
        origin=origin,
        level_db=low.level_db,
        train=low.result.train,
        speed_km_h=low.speed_km_h,
        level_db_2=high.level_db,
        train_2=high.result.train,
        speed_km_h_2=high.speed_km_h,
    )

"""Is it tonal: one sentence a condition and receiver, where the tones lie, whose they are, what the methods know."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from tdacoustic.measured.runs import receivers
from tdacoustic.measured.tonality import RunTonality, RunTone, Tonality
from tdacoustic.reporting.document import (
    Block,
    Cell,
    Column,
    Details,
    FigureBlock,
    Paragraph,
    Section,
    Sentences,
    Shown,
    Table,
)
from tdacoustic.reporting.language import mark, say, say_count
from tdacoustic.reporting.sections.folding import few, in_sight
from tdacoustic.reporting.sections.item_tables import item_table
from tdacoustic.reporting.sections.tones_figures import audibility_figure, criterion_figure, run_up_figures
from tdacoustic.reporting.sections.tones_words import (
    DIN,
    ECMA,
    ISO,
    VERDICTS,
    is_silent,
    most_audible,
    origin_words,
    rated_runs,
    span_words,
    tone_words,
    tones_answer,
    tones_sentences,
    verdict_of,
)
from tdacoustic.reporting.sections.words import pretty_signs, tested_runs
from tdacoustic.results import Analysis

__all__ = ["tones"]

NAMED_PLACES = 6
MORE_THAN_ALL = 0.99
SILENT = mark(
    "A dash in the audibility stands where no tone is audible; the standard then sets it to \N{MINUS SIGN}10 dB."
)
"""What a dash in the table means."""


def tones(analysis: Analysis) -> Section | None:
    """Return the section on tones, or None where no microphone was there to be rated."""
    found = analysis.tonality
    if found is None or not found.ratings:
        return None
    microphones = receivers(analysis.runs) or tuple(dict.fromkeys(rating.channel for rating in found.ratings))
    blocks: list[Block] = [Paragraph(tones_answer(analysis, found, microphones))]
    said = list(tones_sentences(analysis, found, microphones))
    if said:
        blocks.append(Sentences([loudest for loudest, *_ in said]))
    others = [sentence for _, *rest in said for sentence in rest]
    if others:
        folded = say_count(
            "The other microphones, {count} sentence", "The other microphones, {count} sentences", len(others)
        )
        blocks.append(Details(folded, [Sentences(others)]))
    blocks += _figures(analysis, found, microphones)
    blocks.append(in_sight(_table(analysis, found), say("How tonal each microphone is")))
    doubts = _notes(found.ratings)
    if doubts:
        blocks.append(Details(say("What to know about these ratings"), [Sentences(doubts)]))
    blocks += _more_tables(analysis, found)
    limits = [f"{method}: {limit}" for method, of in found.limits for limit in of]
    if limits:
        blocks.append(Details(say("What the methods cannot do, and how far they are known here"), [Sentences(limits)]))
    return Section("tones", say("Is it tonal?"), blocks)


# ---------------------------------------------------------------- figures and tables


def _figures(analysis: Analysis, found: Tonality, microphones: Sequence[str]) -> list[Block]:
    origin = analysis.campaign.origin
    blocks: list[Block] = []
    overview = audibility_figure(analysis, found, microphones, ISO)
    if overview is not None:
        blocks.append(FigureBlock(overview, origin))
    spectra = []
    for condition in analysis.campaign.conditions():
        held = [
            (rating.mean_audibility_db or -100.0, run.name, name)
            for run in rated_runs(analysis, condition)
            for name in microphones
            if (rating := found.rating(run.name, name, ISO)) is not None
        ]
        for audibility, run, name in sorted(held, reverse=True):
            figure = criterion_figure(analysis, found, run, name)
            if figure is not None:
                spectra.append((audibility, FigureBlock(figure, origin)))
                break
    if spectra:
        best = max(range(len(spectra)), key=lambda index: spectra[index][0])
        blocks.append(spectra[best][1])
        others = [block for index, (_, block) in enumerate(spectra) if index != best]
        if others:
            words = say_count("The same of {count} more condition", "The same of {count} more conditions", len(others))
            blocks.append(Details(words, others))
    moving = [figure for run in tested_runs(analysis) for figure in run_up_figures(found, run.name, microphones, ISO)]
    return [*blocks, *(FigureBlock(figure, origin) for figure in moving)]


def _audibility() -> list[tuple[Column, Callable[[RunTonality], Cell]]]:
    return [
        (
            Column("mean_audibility_db", say("Mean audibility"), "dB", 1, "number"),
            lambda rating: _unless_silent(rating, rating.mean_audibility_db),
        ),
        (
            Column("uncertainty_db", "\N{PLUS-MINUS SIGN}", "90 %, dB", 1, "number"),
            lambda rating: _unless_silent(rating, rating.uncertainty_db),
        ),
    ]


def _unless_silent(rating: RunTonality, value: float | None) -> Cell:
    """A number of a rating; a dash where no tone is audible, the standard's own value in the download."""
    return Shown("\N{EN DASH}", value) if is_silent(rating) else value


def _table(analysis: Analysis, found: Tonality) -> Table:
    """One row a microphone of a run."""
    rated = [rating for rating in found.ratings if rating.method == ISO and rating.speed is None]

    def adjustment(rating: RunTonality) -> float | None:
        din = found.rating(rating.run, rating.channel, DIN)
        return None if din is None else din.adjustment_db

    def strongest(rating: RunTonality) -> str:
        tones = most_audible(found.of(rating.run, rating.channel, ISO))
        return tone_words(tones[0]) if tones else say("none")

    columns: list[tuple[Column, Callable[[RunTonality], Cell]]] = [
        (Column("condition", say("Condition")), lambda rating: rating.condition),
        (Column("run", say("Run")), lambda rating: rating.run),
        (Column("channel", say("Microphone")), lambda rating: rating.channel),
        (Column("verdict", say("By ISO/TS 20065")), lambda rating: say(VERDICTS[verdict_of(rating)])),
        *_audibility(),
        (Column("adjustment_db", say("Adjustment"), say("DIN 45681, dB"), 0, "number"), adjustment),
        (Column("n_spectra", say("Spectra"), "", 0, "number"), lambda rating: rating.n_spectra),
        (Column("most_audible", say("Most audible")), strongest),
        (Column("prominent", say("Prominent by ECMA-418-1")), lambda rating: _prominent_cell(found, rating)),
    ]
    caption = say("How tonal each microphone is")
    if any(is_silent(rating) for rating in rated):
        caption = " ".join([f"{caption}.", say(SILENT)])
    return item_table("tonality", caption, rated, columns, analysis.campaign.origin)


def _prominent_cell(found: Tonality, rating: RunTonality) -> str:
    of_ecma = found.rating(rating.run, rating.channel, ECMA)
    if of_ecma is None or not of_ecma.n_spectra:
        return say("not rated")
    held = [tone for tone in found.tones if (tone.run, tone.channel) == (rating.run, rating.channel) and tone.prominent]
    return ", ".join(dict.fromkeys(f"{tone.frequency_hz:.0f} Hz" for tone in held)) or say("none")


def _notes(ratings: Sequence[RunTonality]) -> list[str]:
    """Each note once, with the runs and microphones that it is of where it is not of all."""
    rated = [rating for rating in ratings if rating.speed is None and rating.method != ECMA]
    places: dict[str, list[str]] = {}
    for rating in rated:
        for note in rating.notes:
            places.setdefault(note, []).append(say("run {run}, {channel}", run=rating.run, channel=rating.channel))
    everywhere = {say("run {run}, {channel}", run=rating.run, channel=rating.channel) for rating in rated}
    said = []
    for note, held in places.items():
        own = list(dict.fromkeys(held))
        of_all = len(own) >= MORE_THAN_ALL * len(everywhere)
        where = say("All") if of_all else few(own, NAMED_PLACES, between="; ")
        said.append(pretty_signs(f"{where}: {note}."))
    return said


def _more_tables(analysis: Analysis, found: Tonality) -> list[Block]:
    """Every tone, and the speed classes of run-ups, folded away."""
    blocks: list[Block] = []
    classes = [rating for rating in found.ratings if rating.speed is not None and rating.method == ISO]
    if classes:
        columns: list[tuple[Column, Callable[[RunTonality], Cell]]] = [
            (Column("run", say("Run")), lambda rating: rating.run),
            (Column("channel", say("Microphone")), lambda rating: rating.channel),
            (Column("speed", say("Speed")), lambda rating: span_words(rating.speed)),
            *_audibility(),
            (Column("n_spectra", say("Spectra"), "", 0, "number"), lambda rating: rating.n_spectra),
        ]
        caption = say("Audibility by speed class ({method})", method=ISO)
        if any(is_silent(rating) for rating in classes):
            caption = " ".join([f"{caption}.", say(SILENT)])
        table = item_table("tonality-classes", caption, classes, columns, analysis.campaign.origin)
        words = say_count("Run-ups: {count} speed class", "Run-ups: {count} speed classes", len(classes))
        blocks.append(Details(words, [table]))
    if found.tones:
        words = say_count("{count} rating of tones", "All {count} ratings of tones", len(found.tones))
        blocks.append(Details(words, [_tone_table(analysis, found.tones)]))
    return blocks


def _tone_table(analysis: Analysis, held: Sequence[RunTone]) -> Table:
    columns: list[tuple[Column, Callable[[RunTone], Cell]]] = [
        (Column("run", say("Run")), lambda tone: tone.run),
        (Column("channel", say("Microphone")), lambda tone: tone.channel),
        (Column("method", say("Method")), lambda tone: tone.method),
        (Column("speed", say("Speed")), lambda tone: span_words(tone.speed)),
        (Column("frequency_hz", say("Frequency"), "Hz", 1, "number"), lambda tone: tone.frequency_hz),
        (Column("level_db", say("Level"), "dB re 20 µPa", 1, "number"), lambda tone: tone.level_db),
        (Column("weighting", say("Weighting")), lambda tone: tone.weighting),
        (Column("value_db", say("Value"), "dB", 1, "number"), lambda tone: tone.value_db),
        (Column("criterion_db", say("Criterion"), "dB", 1, "number"), lambda tone: tone.criterion_db),
        (Column("verdict", say("Verdict")), _tone_verdict),
        (Column("origin", say("Order and owner")), origin_words),
        (Column("notes", say("Notes")), lambda tone: "; ".join(tone.notes)),
    ]
    return item_table("tones", say("Tones by all methods"), held, columns, analysis.campaign.origin)


def _tone_verdict(tone: RunTone) -> str:
    if tone.weighting == "Z":
        if tone.prominent is None:
            return say(VERDICTS["not rated"])
        return say("prominent") if tone.prominent else say("not prominent")
    if tone.audible is None:
        return say("not known")
    return say("audible") if tone.audible else say("not audible")

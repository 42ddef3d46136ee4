"""Is it tonal: one sentence a condition and receiver, where the tones lie, whose they are, what the methods know."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence

from tdacoustic.measured.runs import MeasuredRun, receivers
from tdacoustic.measured.tonality import RunTonality, RunTone, SpeedSpan, Tonality
from tdacoustic.reporting.document import (
    Block,
    Cell,
    Column,
    Details,
    FigureBlock,
    Paragraph,
    Section,
    Sentences,
    Table,
)
from tdacoustic.reporting.language import say
from tdacoustic.reporting.sections.folding import in_sight
from tdacoustic.reporting.sections.item_tables import item_table
from tdacoustic.reporting.sections.tones_figures import audibility_figure, criterion_figure, run_up_figures
from tdacoustic.reporting.sections.words import condition_words, joined, pretty_signs, tested_runs
from tdacoustic.results import Analysis

__all__ = ["tones"]

ISO, DIN, ECMA = "ISO/TS 20065:2022", "DIN 45681:2005-03", "ECMA-418-1:2024"
"""Methods, as the tables have them."""
NAMED_TONES = 3
MORE_THAN_ALL = 0.99


def tones(analysis: Analysis) -> Section | None:
    """Return the section on tones, or None where no microphone was there to be rated."""
    found = analysis.tonality
    if found is None or not found.ratings:
        return None
    microphones = receivers(analysis.runs) or tuple(dict.fromkeys(rating.channel for rating in found.ratings))
    blocks: list[Block] = [Paragraph(_answer(analysis, found, microphones))]
    said = list(_sentences(analysis, found, microphones))
    if said:
        blocks.append(Sentences([loudest for loudest, *_ in said]))
    others = [sentence for _, *rest in said for sentence in rest]
    if others:
        blocks.append(
            Details(say("The other microphones, {n_others} sentences", n_others=len(others)), [Sentences(others)])
        )
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


# ---------------------------------------------------------------- the answer


def _verdict(rating: RunTonality | None) -> str:
    """``tonal``, ``not tonal``, ``open`` within the uncertainty; ``run-up``, which has none; or ``not rated``."""
    if rating is None or rating.mean_audibility_db is None:
        return say("not rated")
    if rating.run_up:
        return "run-up"
    mean, around = rating.mean_audibility_db, rating.uncertainty_db or 0.0
    if mean - around > 0.0:
        return "tonal"
    return "open" if mean + around > 0.0 else say("not tonal")


def _rated_runs(analysis: Analysis, condition: str) -> list[MeasuredRun]:
    return [run for run in tested_runs(analysis) if run.run.condition == condition]


def _answer(analysis: Analysis, found: Tonality, microphones: Sequence[str]) -> str:
    """The whole campaign in two sentences."""
    tonal: dict[str, list[str]] = {}
    prominent: list[str] = []
    for condition in analysis.campaign.conditions():
        runs = _rated_runs(analysis, condition)
        verdicts = {_verdict(found.rating(run.name, name, ISO)) for run in runs for name in microphones}
        for word in ("tonal", "open", say("not tonal"), "run-up", say("not rated")):
            if word in verdicts:
                tonal.setdefault(word, []).append(condition)
                break
        if any(tone.prominent and tone.condition == condition and tone.channel in microphones for tone in found.tones):
            prominent.append(condition)
    words = {
        "tonal": say("tonal at a receiver at least"),
        "open": say("open, within the uncertainty of the audibility"),
        "not tonal": say("not tonal"),
        "run-up": say("rated spectrum by spectrum, for the speed changes, and without a verdict"),
        "not rated": say("not rated"),
    }
    parts = [f"{_conditions(tonal[word])}: {words[word]}" for word in words if word in tonal]
    answer = say("By {iso} (tonal: a mean audibility above 0 dB): {parts}.", iso=ISO, parts="; ".join(parts))
    if prominent:
        return say(
            "{answer} By {ecma} a tone is prominent in {conditions}.",
            answer=answer,
            ecma=ECMA,
            conditions=_conditions(prominent),
        )
    if not any(tone.prominent is not None for tone in found.tones):
        return answer
    return say("{answer} No tone is prominent by {ecma}.", answer=answer, ecma=ECMA)


def _conditions(names: Sequence[str]) -> str:
    return say("condition{value} {list}", value="s" if len(names) > 1 else "", list=joined(list(names)))


def _sentences(analysis: Analysis, found: Tonality, microphones: Sequence[str]) -> Iterator[list[str]]:
    """A condition's sentences, one a microphone, the one with the most audible tones first."""
    for condition in analysis.campaign.conditions():
        runs = _rated_runs(analysis, condition)
        words = condition_words(analysis, condition)
        said: list[tuple[float, str]] = []
        for name in microphones:
            rated = [(run, rating) for run in runs if (rating := found.rating(run.name, name, ISO)) is not None]
            if rated:
                audible = [r.mean_audibility_db for _, r in rated if r.mean_audibility_db is not None]
                sentence = pretty_signs(f"{words}, {name}: {_of_receiver(found, name, rated)}")
                said.append((max(audible, default=-math.inf), sentence))
        if said:
            yield [sentence for _, sentence in sorted(said, key=lambda item: -item[0])]


def _of_receiver(found: Tonality, name: str, rated: Sequence[tuple[MeasuredRun, RunTonality]]) -> str:
    """What the runs of a condition say of one receiver."""
    known = [(run, rating) for run, rating in rated if rating.mean_audibility_db is not None]
    if not known:
        notes = [note.removeprefix("not rated, ") for _, rating in rated for note in rating.notes]
        return say("not rated, {fromkeys}.", fromkeys="; ".join(dict.fromkeys(notes)))
    run, rating = max(known, key=lambda pair: pair[1].mean_audibility_db or 0.0)
    if rating.run_up:
        return _of_run_up(found, run, name)
    verdicts = [_verdict(one) for _, one in known]
    verdict = {"open": say("open, within its uncertainty")}.get(_verdict(rating), _verdict(rating))
    of_runs = (
        say(" in {count} of {n_known} runs", count=verdicts.count("tonal"), n_known=len(known))
        if len(known) > 1 and verdict == "tonal"
        else ""
    )
    highest = say(", run ") + run.name + " highest" if len(known) > 1 else ""
    mean = say(
        "mean audibility {mean_audibility_db:.1f} ± {uncertainty_db:.1f} dB",
        mean_audibility_db=rating.mean_audibility_db,
        uncertainty_db=rating.uncertainty_db or 0.0,
    )
    said = [
        say(
            "{verdict}{of_runs}, {mean}{highest} (ISO/TS 20065)",
            verdict=verdict,
            of_runs=of_runs,
            mean=mean,
            highest=highest,
        )
    ]
    strongest = _most_audible(found.of(run.name, name, ISO))
    if strongest:
        said.append(say("most audible {tone}", tone=joined([_tone_words(tone) for tone in strongest])))
    din = found.rating(run.name, name, DIN)
    if din is not None and din.adjustment_db is not None:
        said.append(say("tone adjustment {adjustment_db} dB (DIN 45681)", adjustment_db=din.adjustment_db))
    said.append(_prominent_words(found, run.name, name))
    return "; ".join(said) + "."


def _of_run_up(found: Tonality, run: MeasuredRun, name: str) -> str:
    hearing = found.hearing.get(run.name)
    rated = None if hearing is None else hearing.rated(name, ISO)
    if rated is None:
        return say("not rated.")
    audible = int((rated.decisive_db > 0.0).sum())
    said = [
        say(
            "a run-up, a tone is audible in {audible} of {size} spectra (ISO/TS 20065)",
            audible=audible,
            size=rated.decisive_db.size,
        )
    ]
    strongest = _most_audible(found.of(run.name, name, ISO))
    if strongest:
        said.append(say("most audible {tone}", tone=joined([_tone_words(tone) for tone in strongest])))
    smeared = next((note for note in _notes_on(found, run.name, name) if note.startswith("the speed changes")), None)
    return "; ".join([*said, *([smeared] if smeared else [])]) + "."


def _notes_on(found: Tonality, run: str, name: str) -> tuple[str, ...]:
    """Notes on a microphone of a run."""
    rating = found.rating(run, name, ISO)
    return () if rating is None else rating.notes


def _most_audible(held: Iterable[RunTone]) -> list[RunTone]:
    ranked = sorted((tone for tone in held if tone.audible is not False), key=lambda tone: -(tone.value_db or 0.0))
    return ranked[:NAMED_TONES]


def _tone_words(tone: RunTone) -> str:
    speed = say(" at {words}", words=tone.speed.words()) if tone.speed is not None else ""
    return f"{tone.frequency_hz:.0f} Hz{speed} ({_origin_words(tone)})"


def _origin_words(tone: RunTone) -> str:
    """Order and owner in words; what nobody knows is said."""
    if tone.owner == "unassigned" and tone.excitation == "unknown":
        return say("origin unknown")
    excitation = say("order unknown") if tone.excitation == "unknown" else tone.excitation
    owner = say("owner unknown") if tone.owner == "unassigned" else tone.owner
    return f"{excitation}, {owner}"


def _prominent_words(found: Tonality, run: str, channel: str) -> str:
    held = [tone for tone in found.tones if (tone.run, tone.channel) == (run, channel) and tone.weighting == "Z"]
    if not held:
        rating = found.rating(run, channel, ECMA)
        if rating is not None and rating.n_spectra:
            return say("no tone for ECMA-418-1")
        return say("ECMA-418-1 rates steady speeds alone")
    prominent = {round(tone.frequency_hz, 3): tone for tone in held if tone.prominent}
    if prominent:
        names = [_tone_words(tone) for tone in list(prominent.values())[:NAMED_TONES]]
        more = (
            say(" and {named_tones} more", named_tones=len(prominent) - NAMED_TONES)
            if len(prominent) > NAMED_TONES
            else ""
        )
        return say("prominent by ECMA-418-1: {names}{more}", names=", ".join(names), more=more)
    rated = [tone for tone in held if tone.value_db is not None]
    if not rated:
        return say("no ratio by ECMA-418-1")
    nearest = max(rated, key=lambda tone: (tone.value_db or 0.0) - tone.criterion_db)
    ratio = nearest.method.removeprefix(f"{ECMA} ")
    return say(
        "no tone prominent by ECMA-418-1 (nearest: {frequency_hz:.0f} Hz, {ratio} {value_db:.1f} "
        "dB of {criterion_db:.1f} dB)",
        frequency_hz=nearest.frequency_hz,
        ratio=ratio,
        value_db=nearest.value_db,
        criterion_db=nearest.criterion_db,
    )


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
            for run in _rated_runs(analysis, condition)
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
            blocks.append(Details(say("The same of {n_others} more conditions", n_others=len(others)), others))
    moving = [figure for run in tested_runs(analysis) for figure in run_up_figures(found, run.name, microphones, ISO)]
    return [*blocks, *(FigureBlock(figure, origin) for figure in moving)]


_AUDIBILITY: tuple[tuple[Column, Callable[[RunTonality], Cell]], ...] = (
    (Column("mean_audibility_db", "Mean audibility", "dB", 1, "number"), lambda rating: rating.mean_audibility_db),
    (Column("uncertainty_db", "\N{PLUS-MINUS SIGN}", "90 %, dB", 1, "number"), lambda rating: rating.uncertainty_db),
)


def _table(analysis: Analysis, found: Tonality) -> Table:
    """One row a microphone of a run."""
    rated = [rating for rating in found.ratings if rating.method == ISO and rating.speed is None]

    def adjustment(rating: RunTonality) -> float | None:
        din = found.rating(rating.run, rating.channel, DIN)
        return None if din is None else din.adjustment_db

    def strongest(rating: RunTonality) -> str:
        tones = _most_audible(found.of(rating.run, rating.channel, ISO))
        return _tone_words(tones[0]) if tones else "none"

    columns: list[tuple[Column, Callable[[RunTonality], Cell]]] = [
        (Column("condition", say("Condition")), lambda rating: rating.condition),
        (Column("run", say("Run")), lambda rating: rating.run),
        (Column("channel", say("Microphone")), lambda rating: rating.channel),
        (Column("verdict", say("By ISO/TS 20065")), _verdict),
        *_AUDIBILITY,
        (Column("adjustment_db", say("Adjustment"), say("DIN 45681, dB"), 0, "number"), adjustment),
        (Column("n_spectra", say("Spectra"), "", 0, "number"), lambda rating: rating.n_spectra),
        (Column("most_audible", say("Most audible")), strongest),
        (Column("prominent", say("Prominent by ECMA-418-1")), lambda rating: _prominent_cell(found, rating)),
    ]
    return item_table("tonality", say("How tonal each microphone is"), rated, columns, analysis.campaign.origin)


def _prominent_cell(found: Tonality, rating: RunTonality) -> str:
    of_ecma = found.rating(rating.run, rating.channel, ECMA)
    if of_ecma is None or not of_ecma.n_spectra:
        return say("not rated")
    held = [tone for tone in found.tones if (tone.run, tone.channel) == (rating.run, rating.channel) and tone.prominent]
    return ", ".join(dict.fromkeys(f"{tone.frequency_hz:.0f} Hz" for tone in held)) or "none"


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
        where = say("All") if len(own) >= MORE_THAN_ALL * len(everywhere) else "; ".join(own[:6])
        more = say(" and {n_own} more", n_own=len(own) - 6) if where != "All" and len(own) > 6 else ""
        said.append(pretty_signs(f"{where}{more}: {note}."))
    return said


def _more_tables(analysis: Analysis, found: Tonality) -> list[Block]:
    """Every tone, and the speed classes of run-ups, folded away."""
    blocks: list[Block] = []
    classes = [rating for rating in found.ratings if rating.speed is not None and rating.method == ISO]
    if classes:
        columns: list[tuple[Column, Callable[[RunTonality], Cell]]] = [
            (Column("run", say("Run")), lambda rating: rating.run),
            (Column("channel", say("Microphone")), lambda rating: rating.channel),
            (Column("speed", say("Speed")), lambda rating: _speed(rating.speed)),
            *_AUDIBILITY,
            (Column("n_spectra", say("Spectra"), "", 0, "number"), lambda rating: rating.n_spectra),
        ]
        table = item_table("tonality-classes", say("Audibility by speed class ({iso})", iso=ISO), classes, columns)
        blocks.append(Details(say("Run-ups: {n_classes} speed classes", n_classes=len(classes)), [table]))
    if found.tones:
        blocks.append(
            Details(
                say("All {n_tones} ratings of tones", n_tones=len(found.tones)), [_tone_table(analysis, found.tones)]
            )
        )
    return blocks


def _tone_table(analysis: Analysis, held: Sequence[RunTone]) -> Table:
    columns: list[tuple[Column, Callable[[RunTone], Cell]]] = [
        (Column("run", say("Run")), lambda tone: tone.run),
        (Column("channel", say("Microphone")), lambda tone: tone.channel),
        (Column("method", say("Method")), lambda tone: tone.method),
        (Column("speed", say("Speed")), lambda tone: _speed(tone.speed)),
        (Column("frequency_hz", say("Frequency"), "Hz", 1, "number"), lambda tone: tone.frequency_hz),
        (Column("level_db", say("Level"), "dB re 20 µPa", 1, "number"), lambda tone: tone.level_db),
        (Column("weighting", say("Weighting")), lambda tone: tone.weighting),
        (Column("value_db", say("Value"), "dB", 1, "number"), lambda tone: tone.value_db),
        (Column("criterion_db", say("Criterion"), "dB", 1, "number"), lambda tone: tone.criterion_db),
        (Column("verdict", say("Verdict")), _tone_verdict),
        (Column("origin", say("Order and owner")), _origin_words),
        (Column("notes", say("Notes")), lambda tone: "; ".join(tone.notes)),
    ]
    return item_table("tones", say("Tones by all methods"), held, columns, analysis.campaign.origin)


def _speed(span: SpeedSpan | None) -> str:
    return "" if span is None else span.words()


def _tone_verdict(tone: RunTone) -> str:
    if tone.weighting == "Z":
        return say("not rated") if tone.prominent is None else "prominent" if tone.prominent else say("not prominent")
    return say("not known") if tone.audible is None else "audible" if tone.audible else say("not audible")

"""Is it tonal, in words: one sentence a condition and receiver, the most audible tones, whose they are."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

from tdacoustic.measured.runs import MeasuredRun
from tdacoustic.measured.tonality import RunTonality, RunTone, SpeedSpan, Tonality
from tdacoustic.reporting.language import mark, say, say_count
from tdacoustic.reporting.sections.folding import few
from tdacoustic.reporting.sections.words import condition_words, joined, pretty_signs, source_word, tested_runs
from tdacoustic.reporting.shown import range_text
from tdacoustic.results import Analysis
from tdacoustic.tones.audibility import NO_TONE_DB

__all__ = [
    "DIN",
    "ECMA",
    "ISO",
    "VERDICTS",
    "is_silent",
    "most_audible",
    "origin_words",
    "rated_runs",
    "span_words",
    "tone_words",
    "tones_answer",
    "tones_sentences",
    "verdict_of",
]

ISO, DIN, ECMA = "ISO/TS 20065:2022", "DIN 45681:2005-03", "ECMA-418-1:2024"
"""Methods, as the tables have them."""
NAMED_TONES = 3
ROUNDING_DB = 1e-6
"""Of a mean over equal levels."""

VERDICTS = {
    "tonal": mark("tonal"),
    "open": mark("open"),
    "not tonal": mark("not tonal"),
    "run-up": mark("run-up"),
    "not rated": mark("not rated"),
}
"""Of a microphone in a run."""
OF_CONDITIONS = {
    "tonal": mark("tonal at a receiver at least"),
    "open": mark("open, within the uncertainty of the audibility"),
    "not tonal": mark("not tonal"),
    "run-up": mark("rated spectrum by spectrum, for the speed changes, and without a verdict"),
    "not rated": mark("not rated"),
}
"""The same of all microphones in all runs of a condition: that of the most tonal."""
RATIOS = (mark("tone-to-noise ratio"), mark("prominence ratio"))
"""Of ECMA-418-1, as the names of its methods end."""


def verdict_of(rating: RunTonality | None) -> str:
    """Key of `VERDICTS`; ``open`` within the uncertainty, ``run-up`` of one, which has no verdict."""
    if rating is None or rating.mean_audibility_db is None:
        return "not rated"
    if rating.run_up:
        return "run-up"
    mean, around = rating.mean_audibility_db, rating.uncertainty_db or 0.0
    if mean - around > 0.0:
        return "tonal"
    return "open" if mean + around > 0.0 else "not tonal"


def is_silent(rating: RunTonality) -> bool:
    """Return whether no tone is audible in any spectrum, so that the mean is the value the standard sets for none."""
    return rating.mean_audibility_db is not None and rating.mean_audibility_db <= NO_TONE_DB + ROUNDING_DB


def rated_runs(analysis: Analysis, condition: str) -> list[MeasuredRun]:
    """Return the test runs of a condition that were measured."""
    return [run for run in tested_runs(analysis) if run.run.condition == condition]


def tones_answer(analysis: Analysis, found: Tonality, microphones: Sequence[str]) -> str:
    """The whole campaign in two sentences."""
    tonal: dict[str, list[str]] = {}
    prominent: list[str] = []
    for condition in analysis.campaign.conditions():
        runs = rated_runs(analysis, condition)
        verdicts = {verdict_of(found.rating(run.name, name, ISO)) for run in runs for name in microphones}
        for word in VERDICTS:
            if word in verdicts:
                tonal.setdefault(word, []).append(condition)
                break
        if any(tone.prominent and tone.condition == condition and tone.channel in microphones for tone in found.tones):
            prominent.append(condition)
    verdicts_said = [
        say_count(
            "condition {conditions}: {verdict}",
            "conditions {conditions}: {verdict}",
            len(tonal[word]),
            conditions=joined(tonal[word]),
            verdict=say(words),
        )
        for word, words in OF_CONDITIONS.items()
        if word in tonal
    ]
    sentences = [
        say(
            "By {method} (tonal: a mean audibility above 0 dB): {verdicts}.",
            method=ISO,
            verdicts="; ".join(verdicts_said),
        )
    ]
    if prominent:
        sentences.append(
            say_count(
                "By {method} a tone is prominent in condition {conditions}.",
                "By {method} a tone is prominent in conditions {conditions}.",
                len(prominent),
                method=ECMA,
                conditions=joined(prominent),
            )
        )
    elif any(tone.prominent is not None for tone in found.tones):
        sentences.append(say("No tone is prominent by {method}.", method=ECMA))
    return " ".join(sentences)


def tones_sentences(analysis: Analysis, found: Tonality, microphones: Sequence[str]) -> Iterator[list[str]]:
    """A condition's sentences, one a microphone, the one with the most audible tones first."""
    for condition in analysis.campaign.conditions():
        runs = rated_runs(analysis, condition)
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
        return say("not rated, {reasons}.", reasons="; ".join(dict.fromkeys(notes)))
    run, rating = max(known, key=lambda pair: pair[1].mean_audibility_db or 0.0)
    if rating.run_up:
        return _of_run_up(found, run, name)
    said = [_verdict_words(run, rating, [verdict_of(one) for _, one in known])]
    strongest = most_audible(found.of(run.name, name, ISO))
    if strongest:
        said.append(say("most audible {tones}", tones=joined([tone_words(tone) for tone in strongest])))
    din = found.rating(run.name, name, DIN)
    if din is not None and din.adjustment_db is not None:
        said.append(say("tone adjustment {adjustment} dB (DIN 45681)", adjustment=din.adjustment_db))
    said.append(_prominent_words(found, run.name, name))
    return "; ".join(said) + "."


def _verdict_words(run: MeasuredRun, rating: RunTonality, verdicts: Sequence[str]) -> str:
    """Verdict on the run with the highest audibility, among those of all runs of its condition."""
    verdict = verdict_of(rating)
    words = say("open, within its uncertainty") if verdict == "open" else say(VERDICTS[verdict])
    mean, around = rating.mean_audibility_db, rating.uncertainty_db or 0.0
    if is_silent(rating):  # of the highest, so of all of them
        return say("{verdict}, no audible tone (ISO/TS 20065)", verdict=words)
    if len(verdicts) == 1:
        known = say("mean audibility {mean:.1f} ± {uncertainty:.1f} dB (ISO/TS 20065)", mean=mean, uncertainty=around)
        return f"{words}, {known}"
    if verdict == "tonal":
        words = say("tonal in {count} of {runs} runs", count=verdicts.count("tonal"), runs=len(verdicts))
    known = say(
        "mean audibility {mean:.1f} ± {uncertainty:.1f} dB, run {run} highest (ISO/TS 20065)",
        mean=mean,
        uncertainty=around,
        run=run.name,
    )
    return f"{words}, {known}"


def _of_run_up(found: Tonality, run: MeasuredRun, name: str) -> str:
    hearing = found.hearing.get(run.name)
    rated = None if hearing is None else hearing.rated(name, ISO)
    if rated is None:
        return f"{say(VERDICTS['not rated'])}."
    audible = int((rated.decisive_db > 0.0).sum())
    said = [
        say(
            "a run-up, a tone is audible in {count} of {spectra} spectra (ISO/TS 20065)",
            count=audible,
            spectra=rated.decisive_db.size,
        )
    ]
    strongest = most_audible(found.of(run.name, name, ISO))
    if strongest:
        said.append(say("most audible {tones}", tones=joined([tone_words(tone) for tone in strongest])))
    smeared = next((note for note in _notes_on(found, run.name, name) if note.startswith("the speed changes")), None)
    return "; ".join([*said, *([smeared] if smeared else [])]) + "."


def _notes_on(found: Tonality, run: str, name: str) -> tuple[str, ...]:
    """Notes on a microphone of a run."""
    rating = found.rating(run, name, ISO)
    return () if rating is None else rating.notes


def most_audible(held: Iterable[RunTone]) -> list[RunTone]:
    """Return the few tones of the highest audibility, the highest first."""
    ranked = sorted((tone for tone in held if tone.audible is not False), key=lambda tone: -(tone.value_db or 0.0))
    return ranked[:NAMED_TONES]


def tone_words(tone: RunTone) -> str:
    """Return frequency, speed and origin of a tone in words."""
    if tone.speed is None:
        return f"{tone.frequency_hz:.0f} Hz ({origin_words(tone)})"
    return say(
        "{frequency:.0f} Hz at {speed} ({origin})",
        frequency=tone.frequency_hz,
        speed=span_words(tone.speed),
        origin=origin_words(tone),
    )


def origin_words(tone: RunTone) -> str:
    """Order and owner in words; what nobody knows is said."""
    if tone.owner == "unassigned" and tone.excitation == "unknown":
        return say("origin unknown")
    excitation = say("order unknown") if tone.excitation == "unknown" else tone.excitation
    owner = say("owner unknown") if tone.owner == "unassigned" else source_word(tone.owner)
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
        names = [tone_words(tone) for tone in prominent.values()]
        return say("prominent by ECMA-418-1: {tones}", tones=few(names, NAMED_TONES))
    rated = [tone for tone in held if tone.value_db is not None]
    if not rated:
        return say("no ratio by ECMA-418-1")
    nearest = max(rated, key=lambda tone: (tone.value_db or 0.0) - tone.criterion_db)
    ratio = nearest.method.removeprefix(f"{ECMA} ")
    return say(
        "no tone prominent by ECMA-418-1 (nearest: {frequency:.0f} Hz, {ratio} {level:.1f} dB of {criterion:.1f} dB)",
        frequency=nearest.frequency_hz,
        ratio=say(ratio) if ratio in RATIOS else ratio,
        level=nearest.value_db,
        criterion=nearest.criterion_db,
    )


def span_words(span: SpeedSpan | None) -> str:
    """Return a class of speed as a sentence has it; nothing of none."""
    if span is None:
        return ""
    digits = 0 if span.unit == "rpm" else 1
    return range_text(f"{span.low:.{digits}f}", f"{span.high:.{digits}f} {span.unit}")

"""Speed over time in words: who tells it, how sure it is, where it is not known, what is wrong with it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from tdacoustic.measured.runs import MeasuredRun
from tdacoustic.reporting.language import mark, say, say_count
from tdacoustic.reporting.sections.words import SHAFT_WORDS, pretty_signs, pretty_unit
from tdacoustic.reporting.shown import range_text
from tdacoustic.speed import SpeedProfile

__all__ = [
    "Held",
    "faults_said",
    "percent_words",
    "profiles_of",
    "reasons_of",
    "runs_words",
    "scale_of",
    "shaft_of",
    "tellers_said",
    "unknown_said",
]

MOST_SENTENCES = MOST_FAULTS = 6
_KINDS = {"tacho": mark("The tacho"), "channel": mark("The speed channel")}

Held = list[tuple[MeasuredRun, SpeedProfile]]


def profiles_of(run: MeasuredRun) -> tuple[SpeedProfile, ...]:
    """Return the speeds of a run over time, from channels and from lines."""
    return () if run.measurement is None else run.measurement.speed.profiles


def reasons_of(run: MeasuredRun) -> list[str]:
    """Why speeds that were looked for could not be had."""
    if run.measurement is None:
        return []
    speeds = run.measurement.speed
    found = [reason for _, reason in speeds.problems]
    return found + ([speeds.lines.reason] if speeds.lines is not None and speeds.lines.reason is not None else [])


def scale_of(si_symbol: str) -> tuple[float, str]:
    """Return the factor from 1/s or m/s to the unit that is shown, and that unit."""
    return (60.0, "rpm") if si_symbol == "1/s" else (3.6, "km/h")


def shaft_of(shaft: str, si_symbol: str) -> str:
    """Return of what a speed is, in words: the train, a shaft."""
    if si_symbol == "m/s":
        return say("the train")
    return say("the {shaft} shaft", shaft=say(SHAFT_WORDS.get(shaft, shaft))) if shaft else say("a shaft")


def tellers_said(by_teller: Mapping[tuple[str, str, str], Held]) -> Iterator[str]:
    """One sentence for each channel, and one for each run whose speed comes from lines."""
    for (teller, shaft, si_symbol), held in by_teller.items():
        if teller == "lines":
            yield from (_of_lines(run, profile) for run, profile in held[:MOST_SENTENCES])
            if len(held) > MOST_SENTENCES:
                yield say_count(
                    "So it is in {count} more run; the table has them all.",
                    "So it is in {count} more runs; the table has them all.",
                    len(held) - MOST_SENTENCES,
                )
            continue
        yield _of_channel(teller, shaft, si_symbol, held)


def _of_channel(teller: str, shaft: str, si_symbol: str, held: Held) -> str:
    factor, unit = scale_of(si_symbol)
    low = min(float(profile.speed.min()) for _, profile in held) * factor
    high = max(float(profile.speed.max()) for _, profile in held) * factor
    source = held[0][1].source
    kind, what, runs = say(_KINDS[source]), shaft_of(shaft, si_symbol), runs_words([run.name for run, _ in held])
    if low == high == 0.0:
        return say(
            "{kind} “{channel}” tells the speed of {shaft} in {runs}, which stands.",
            kind=kind,
            channel=teller,
            shaft=what,
            runs=runs,
        )
    speeds = pretty_signs(range_text(f"{low:.4g}", f"{high:.4g} {unit}"))
    clauses = [
        say(
            "{kind} “{channel}” tells the speed of {shaft} in {runs}, {speeds}",
            kind=kind,
            channel=teller,
            shaft=what,
            runs=runs,
            speeds=speeds,
        )
    ]
    errors = [_relative_error(profile) for _, profile in held if profile.error is not None]
    errors = [error for error in errors if np.isfinite(error)]
    if errors:
        error = percent_words(max(errors))
        clauses.append(
            say("a value's standard error is {error}, by the scatter of its edges", error=error)
            if source == "tacho"
            else say("a value's standard error is {error}, by its own scatter", error=error)
        )
    return "; ".join(clauses) + "."


def runs_words(runs: Sequence[str]) -> str:
    """Return a single run by its name, several by their number."""
    names = list(dict.fromkeys(runs))
    return say("run {run}", run=names[0]) if len(names) == 1 else say_count("{count} run", "{count} runs", len(names))


def _relative_error(profile: SpeedProfile) -> float:
    """Median of error over speed where the shaft turns."""
    assert profile.error is not None
    turning = np.abs(profile.speed) > 0.05 * np.max(np.abs(profile.speed), initial=0.0)
    return float(np.median(profile.error[turning] / np.abs(profile.speed[turning]))) if turning.any() else float("nan")


def percent_words(part: float) -> str:
    """Return a small part of one as a percentage."""
    return say("less than 0.01 %") if part < 1e-4 else f"{100.0 * part:.2g} %"


def _of_lines(run: MeasuredRun, profile: SpeedProfile) -> str:
    factor, unit = scale_of(profile.si_symbol)
    low, high = factor * float(profile.speed.min()), factor * float(profile.speed.max())
    facts = [range_text(f"{low:.4g}", f"{high:.4g} {unit}")]
    if profile.confidence is not None:
        facts.append(say("median confidence {confidence:.2f}", confidence=float(np.median(profile.confidence))))
    if profile.error is not None:
        facts.append(say("standard error {error}", error=percent_words(_relative_error(profile))))
    share = 1.0 if run.span_s is None else profile.known_share(*run.span_s)
    facts.append(say("known in {share:.0f} % of the run", share=100.0 * share))
    clauses = [", ".join(facts)]
    others = [other for other in profiles_of(run) if other.source != "lines" and other.shaft == profile.shaft]
    off = _off(profile, others[0]) if others else None
    if off is not None:
        clauses.append(
            say("it lies {distance:.2g} % (rms) beside {channel}", distance=100.0 * off, channel=others[0].channel)
        )
    facts_said = "; ".join(clauses)
    if any(other.source != "lines" for other in profiles_of(run)):
        return say(
            "The motor's speed in run {run}, beside its channels, is read from the {lines}: {facts}.",
            run=run.name,
            lines=profile.channel,
            facts=facts_said,
        )
    return say(
        "The motor's speed in run {run}, which no channel tells, is read from the {lines}: {facts}.",
        run=run.name,
        lines=profile.channel,
        facts=facts_said,
    )


def _off(profile: SpeedProfile, other: SpeedProfile) -> float | None:
    """Relative rms distance between two speeds of one shaft."""
    beside = np.abs(other.speed_at(profile.times_s))
    both = np.isfinite(beside) & (beside > 0.0)
    if not both.any():
        return None
    return float(np.sqrt(np.mean((np.abs(profile.speed[both]) / beside[both] - 1.0) ** 2)))


def unknown_said(runs: Sequence[MeasuredRun]) -> Iterator[str]:
    """One sentence for each run of which a speed was looked for and not found."""
    for run in runs:
        reasons = "; ".join(reasons_of(run))
        yield (
            say("Run {run}: {reason}.", run=run.name, reason=reasons)
            if profiles_of(run)
            else say("The speed is not known in run {run}: {reason}.", run=run.name, reason=reasons)
        )


def faults_said(runs: Sequence[MeasuredRun]) -> Iterator[str]:
    """One sentence for each speed with faults, up to a few."""
    found = [
        pretty_unit(
            say(
                "Run {run}, {channel}: {faults}.",
                run=run.name,
                channel=profile.channel,
                faults="; ".join(profile.faults),
            )
        )
        for run in runs
        for profile in profiles_of(run)
        if profile.faults
    ]
    yield from found[:MOST_FAULTS]
    if len(found) > MOST_FAULTS:
        yield say_count(
            "{count} more speed has faults, which stand under quality.",
            "{count} more speeds have faults, which stand under quality.",
            len(found) - MOST_FAULTS,
        )

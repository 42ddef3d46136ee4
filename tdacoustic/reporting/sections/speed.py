"""Speed over time: who tells it, how sure it is, where it is not known, and the slip of the wheels."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tdacoustic.attribution import RunSlip
from tdacoustic.measured.runs import MeasuredRun
from tdacoustic.reporting.document import Block, Column, Details, FigureBlock, Section, Sentences, Table
from tdacoustic.reporting.figure import Axis, Band, Element, Figure, Line
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.palette import SERIES_SLOTS
from tdacoustic.reporting.sections.speed_sentences import (
    Held,
    faults_said,
    percent_words,
    profiles_of,
    reasons_of,
    runs_words,
    scale_of,
    shaft_of,
    tellers_said,
    unknown_said,
)
from tdacoustic.reporting.sections.words import joined, pretty_signs, pretty_unit, slug, tested_runs
from tdacoustic.reporting.shown import range_text
from tdacoustic.results import Analysis
from tdacoustic.speed import SpeedProfile, WheelSlip

__all__ = ["speed"]

Array = NDArray[np.float64]

SIGMAS = 2.0
VISIBLE = 0.004
"""Half width of a band, over the range of what is drawn, from which it can be seen."""
MOST_BANDS = 4
_EVENTS = {"slip": mark("slip"), "slide": mark("slide")}


def speed(analysis: Analysis) -> Section | None:
    """Return the section on speed, or None where no run's speed was measured or sought."""
    runs = tested_runs(analysis)
    by_teller: dict[tuple[str, str, str], Held] = {}
    for run in runs:
        for profile in profiles_of(run):
            teller = "lines" if profile.source == "lines" else profile.channel
            by_teller.setdefault((teller, profile.shaft or "", profile.si_symbol), []).append((run, profile))
    sought = [run for run in runs if reasons_of(run)]
    if not by_teller and not sought:
        return None
    blocks: list[Block] = [Sentences([*tellers_said(by_teller), *unknown_said(sought), *faults_said(runs)])]
    for (teller, shaft, si_symbol), held in by_teller.items():
        blocks += [FigureBlock(figure, analysis.campaign.origin) for figure in _figures(teller, shaft, si_symbol, held)]
    if analysis.slips:
        blocks += _slip_blocks(analysis)
    blocks.append(Details(say("All speeds as a table"), [_table(analysis)]))
    return Section("speed", say("Speed over time"), blocks)


# ---------------------------------------------------------------- figures


def _figures(teller: str, shaft: str, si_symbol: str, held: Held) -> Iterator[Figure]:
    """Speed over time of all runs; of lines their confidence too."""
    factor, unit = scale_of(si_symbol)
    label = say("Train speed") if si_symbol == "m/s" else say("Speed of {shaft}", shaft=shaft_of(shaft, si_symbol))
    elements: list[Element] = []
    drawn = factor * np.concatenate([profile.speed for _, profile in held])
    visible = VISIBLE * float(np.ptp(drawn)) if len(held) <= MOST_BANDS else float("inf")
    for number, (run, profile) in enumerate(held):
        elements += _drawn(run, profile, factor, number % SERIES_SLOTS, visible)
    lines = teller == "lines"
    banded = any(isinstance(element, Band) for element in elements)
    told = [say("Read from the lines of the drive's orders.") if lines else say("As the channel tells it.")]
    if banded:
        told.append(say("The band is {sigmas:g} standard errors to each side.", sigmas=SIGMAS))
    if any(profile.unknown for _, profile in held):
        told.append(say("Where a trace breaks off, the speed is not known."))
    title = say("Speed over time, from lines") if lines else say("Speed over time, channel {channel}", channel=teller)
    time = Axis(say("Time from the start of the run"), "s")
    yield Figure(slug("speed", teller), title, " ".join(told), time, Axis(label, unit), elements, height=320)
    if lines:
        traces = [
            Line(*_broken(profile, profile.confidence), say("run {run}", run=run.name), color=number % SERIES_SLOTS)
            for number, (run, profile) in enumerate(held)
            if profile.confidence is not None
        ]
        if traces:
            words = say("Probability that the speed is read from the right lines, by how well others would fit.")
            axis = Axis(say("Confidence"), limits=(0.0, 1.05))
            yield Figure(
                "speed-confidence", say("How sure the speed from lines is"), words, time, axis, traces, height=200
            )


def _drawn(run: MeasuredRun, profile: SpeedProfile, factor: float, slot: int, visible: float) -> list[Element]:
    """A run's speed, its error where its half width is visible, and beside lines what a channel says."""
    times, values = _broken(profile, factor * profile.speed)
    found: list[Element] = []
    if profile.error is not None:
        _, half = _broken(profile, SIGMAS * factor * profile.error)
        if np.nanmax(half) > visible:
            found.append(Band(times, values - half, values + half, say("run {run}, error", run=run.name), color=slot))
    found.append(Line(times, values, say("run {run}", run=run.name), color=slot))
    others = [other for other in profiles_of(run) if other.source != "lines" and other.shaft == profile.shaft]
    if profile.source == "lines" and others:
        beside = _broken(others[0], factor * np.abs(others[0].speed))
        found.append(
            Line(
                *beside,
                say("run {run}, {channel}", run=run.name, channel=others[0].channel),
                style="dashed",
                color=slot,
            )
        )
    return found


def _broken(profile: SpeedProfile, values: Array | None) -> tuple[Array, Array]:
    """Times and values with a gap where the speed is not known."""
    assert values is not None
    middle = np.array([0.5 * (first + last) for first, last, _ in profile.unknown])
    places = np.searchsorted(profile.times_s, middle)
    inside = (places > 0) & (places < profile.times_s.size)
    return (
        np.insert(profile.times_s, places[inside], middle[inside]),
        np.insert(np.asarray(values, dtype=np.float64), places[inside], np.nan),
    )


# ---------------------------------------------------------------- slip


def _slip_blocks(analysis: Analysis) -> list[Block]:
    held = [(run, item) for run, items in analysis.slips.items() for item in _told_best(items)]
    found: list[Block] = [Sentences(list(_slip_words(held)))]
    traces: list[Element] = []
    one = len({(item.shaft_channel, item.train_channel) for _, item in held}) == 1
    for number, (run, item) in enumerate(held):
        if item.slip is not None:
            name = (
                say("run {run}", run=run)
                if one
                else say(
                    "run {run}, {shaft} against {train}",
                    run=run,
                    shaft=item.shaft_channel,
                    train=item.train_channel,
                )
            )
            traces.append(Line(item.slip.times_s, 100.0 * item.slip.slip, name, color=number % SERIES_SLOTS))
    if traces:
        caption = say(
            "Rim speed of the wheel over the train's, minus one. A wrong wheel diameter or a wrong scale of either "
            "speed moves the whole trace."
        )
        time, axis = Axis(say("Time from the start of the run"), "s"), Axis(say("Slip"), "%")
        figure = Figure("slip", say("Slip of the wheels over time"), caption, time, axis, traces, height=280)
        found.append(FigureBlock(figure, analysis.campaign.origin))
    return found


def _told_best(items: Sequence[RunSlip]) -> list[RunSlip]:
    """One for each train speed and shaft: that of a channel rather than that of lines."""
    found: dict[tuple[str, str], RunSlip] = {}
    for item in sorted(items, key=lambda item: (item.slip is None, item.shaft_channel.startswith("lines of "))):
        found.setdefault((item.train_channel, item.shaft), item)
    return list(found.values())


def _slip_words(held: Sequence[tuple[str, RunSlip]]) -> Iterator[str]:
    """Each run whose wheels lose adhesion or whose slip is not known, and one sentence on all others."""
    told = [(run, item, item.slip) for run, item in held if item.slip is not None]
    for run, item, slip in told:
        if slip.events:
            worst = max(slip.events, key=lambda event: abs(event.peak))
            kinds = joined(
                [f"{sum(e.kind == kind for e in slip.events)} × {say(_EVENTS[kind])}" for kind in _kinds(slip)]
            )
            peak = pretty_signs(f"{100.0 * worst.peak:+.2g} %")
            yield (
                say(
                    "Run {run}: the wheels lose adhesion ({events}, by {shaft} against {train}), at worst {peak} "
                    "beside the usual slip, from {start:.1f} s to {end:.1f} s.",
                    run=run,
                    events=kinds,
                    shaft=item.shaft_channel,
                    train=item.train_channel,
                    peak=peak,
                    start=worst.first_s,
                    end=worst.last_s,
                )
            )
    if told:
        yield _usual_slip_words(told)
    yield from (say("Run {run}: {reason}.", run=run, reason=item.reason) for run, item in held if item.slip is None)


def _usual_slip_words(told: Sequence[tuple[str, RunSlip, WheelSlip]]) -> str:
    usual = [100.0 * slip.usual for _, _, slip in told]
    low, high = (pretty_signs(f"{end:+.2f} %") for end in (min(usual), max(usual)))
    runs, span = runs_words([run for run, _, _ in told]), range_text(low, high) if len(usual) > 1 else low
    errors = [float(np.median(slip.error)) for _, _, slip in told if slip.error is not None]
    clauses = [
        say(
            "The usual slip of {runs} is {slip}, one value ± {error} (1 σ)",
            runs=runs,
            slip=span,
            error=percent_words(max(errors)),
        )
        if errors
        else say("The usual slip of {runs} is {slip}", runs=runs, slip=span)
    ]
    if not any(slip.events for _, _, slip in told):
        clauses.append(say("adhesion is never lost"))
    alike = say("Creep, wear of the wheel and a wrong scale of either speed look alike in it.")
    return f"{'; '.join(clauses)}. {alike}"


def _kinds(slip: WheelSlip) -> list[str]:
    return list(dict.fromkeys(event.kind for event in slip.events))


# ---------------------------------------------------------------- table


def _table(analysis: Analysis) -> Table:
    columns = [
        Column("run", say("Run")),
        Column("channel", say("Channel")),
        Column("source", say("Source")),
        Column("shaft", say("Shaft")),
        Column("mean", say("Mean"), "", 1, "number"),
        Column("min", say("Least"), "", 1, "number"),
        Column("max", say("Most"), "", 1, "number"),
        Column("unit", say("Unit")),
        Column("error", "±", "1 σ", 3, "number"),
        Column("confidence", say("Confidence"), "", 2, "number"),
        Column("known_percent", say("Known"), say("% of the run"), 0, "number"),
        Column("remarks", say("Remarks")),
    ]
    rows = [[_cell(row, column.key) for column in columns] for row in analysis.tables["speeds"].to_dict("records")]
    caption = say("Speeds by run and source; stated ones are the campaign's")
    return Table("speeds", caption, columns, rows, origin=analysis.campaign.origin)


def _cell(row: Mapping[Hashable, Any], key: str) -> str | float | None:
    if key == "known_percent":
        return None if row["known_share"] is None else 100.0 * float(row["known_share"])
    if key == "remarks":
        said = (str(row[part]) for part in ("reason", "notes") if isinstance(row[part], str) and row[part])
        return pretty_unit("; ".join(said))
    value = row[key]
    return value if isinstance(value, str | float) else None

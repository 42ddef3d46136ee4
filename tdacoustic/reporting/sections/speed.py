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
from tdacoustic.reporting.sections.words import joined, pretty_signs, pretty_unit, slug, tested_runs
from tdacoustic.results import Analysis
from tdacoustic.speed import SpeedProfile, WheelSlip

__all__ = ["speed"]

Array = NDArray[np.float64]

SIGMAS = 2.0
VISIBLE = 0.004
"""Half width of a band, over the range of what is drawn, from which it can be seen."""
MOST_BANDS = 4
MOST_SENTENCES = MOST_FAULTS = 6
_KINDS = {"tacho": mark("tacho"), "channel": mark("speed channel"), "lines": mark("lines of vibration")}

Held = list[tuple[MeasuredRun, SpeedProfile]]


def speed(analysis: Analysis) -> Section | None:
    """Return the section on speed, or None where no run's speed was measured or sought."""
    runs = tested_runs(analysis)
    by_teller: dict[tuple[str, str, str], Held] = {}
    for run in runs:
        for profile in _profiles(run):
            teller = "lines" if profile.source == "lines" else profile.channel
            by_teller.setdefault((teller, profile.shaft or "", profile.si_symbol), []).append((run, profile))
    sought = [run for run in runs if _reasons(run)]
    if not by_teller and not sought:
        return None
    blocks: list[Block] = [Sentences([*_said(by_teller), *_not_found(sought), *_faults(runs)])]
    for (teller, shaft, si_symbol), held in by_teller.items():
        blocks += [FigureBlock(figure, analysis.campaign.origin) for figure in _figures(teller, shaft, si_symbol, held)]
    if analysis.slips:
        blocks += _slip_blocks(analysis)
    blocks.append(Details(say("All speeds as a table"), [_table(analysis)]))
    return Section("speed", say("Speed over time"), blocks)


def _profiles(run: MeasuredRun) -> tuple[SpeedProfile, ...]:
    return () if run.measurement is None else run.measurement.speed.profiles


def _reasons(run: MeasuredRun) -> list[str]:
    """Why speeds that were looked for could not be had."""
    if run.measurement is None:
        return []
    speeds = run.measurement.speed
    found = [reason for _, reason in speeds.problems]
    return found + ([speeds.lines.reason] if speeds.lines is not None and speeds.lines.reason is not None else [])


def _scale(si_symbol: str) -> tuple[float, str]:
    return (60.0, "rpm") if si_symbol == "1/s" else (3.6, "km/h")


def _of_what(shaft: str, si_symbol: str) -> str:
    return (
        say("the train") if si_symbol == "m/s" else say("the {shaft} shaft", shaft=shaft) if shaft else say("a shaft")
    )


# ---------------------------------------------------------------- sentences


def _said(by_teller: Mapping[tuple[str, str, str], Held]) -> Iterator[str]:
    """One sentence for each channel, and one for each run whose speed comes from lines."""
    for (teller, shaft, si_symbol), held in by_teller.items():
        if teller == "lines":
            yield from (_of_lines(run, profile) for run, profile in held[:MOST_SENTENCES])
            if len(held) > MOST_SENTENCES:
                yield say(
                    "So it is in {most_sentences} more runs; the table has them all.",
                    most_sentences=len(held) - MOST_SENTENCES,
                )
            continue
        factor, unit = _scale(si_symbol)
        low = min(float(profile.speed.min()) for _, profile in held) * factor
        high = max(float(profile.speed.max()) for _, profile in held) * factor
        kind = say(_KINDS[held[0][1].source]).capitalize()
        words = say(
            "{kind} {teller} tells the speed of {of_what} in {counted}, ",
            kind=kind,
            teller=teller,
            of_what=_of_what(shaft, si_symbol),
            counted=_counted(held),
        )
        words += (
            say("which stands")
            if low == high == 0.0
            else pretty_signs(say("{low:.4g} to {high:.4g} {unit}", low=low, high=high, unit=unit))
        )
        errors = [_relative_error(profile) for _, profile in held if profile.error is not None]
        errors = [error for error in errors if np.isfinite(error)]
        if errors and not low == high == 0.0:
            words += say("; a value's standard error is {percent}", percent=_percent(max(errors)))
            words += (
                say(", by the scatter of its edges") if held[0][1].source == "tacho" else say(", by its own scatter")
            )
        yield f"{words}."


def _counted(held: Held) -> str:
    return say("{n_held} runs", n_held=len(held)) if len(held) > 1 else say("run {name}", name=held[0][0].name)


def _relative_error(profile: SpeedProfile) -> float:
    """Median of error over speed where the shaft turns."""
    assert profile.error is not None
    turning = np.abs(profile.speed) > 0.05 * np.max(np.abs(profile.speed), initial=0.0)
    return float(np.median(profile.error[turning] / np.abs(profile.speed[turning]))) if turning.any() else float("nan")


def _percent(part: float) -> str:
    return say("less than 0.01 %") if part < 1e-4 else f"{100.0 * part:.2g} %"


def _of_lines(run: MeasuredRun, profile: SpeedProfile) -> str:
    factor, unit = _scale(profile.si_symbol)
    told = any(other.source != "lines" for other in _profiles(run))
    beside = say("beside its channels") if told else say("which no channel tells")
    words = say(
        "The motor's speed in run {name}, {beside}, is read from the {channel}: ",
        name=run.name,
        beside=beside,
        channel=profile.channel,
    )
    words += say(
        "{speed:.4g} to {speed_2:.4g} {unit}",
        speed=factor * float(profile.speed.min()),
        speed_2=factor * float(profile.speed.max()),
        unit=unit,
    )
    if profile.confidence is not None:
        words += say(", median confidence {median:.2f}", median=float(np.median(profile.confidence)))
    if profile.error is not None:
        words += say(", standard error {percent}", percent=_percent(_relative_error(profile)))
    share = 1.0 if run.span_s is None else profile.known_share(*run.span_s)
    words += say(", known in {share:.0f} % of the run", share=100.0 * share)
    others = [other for other in _profiles(run) if other.source != "lines" and other.shaft == profile.shaft]
    off = _off(profile, others[0]) if others else None
    if off is not None:
        words += say("; it lies {off:.2g} % (rms) beside {channel}", off=100.0 * off, channel=others[0].channel)
    return f"{words}."


def _off(profile: SpeedProfile, other: SpeedProfile) -> float | None:
    """Relative rms distance between two speeds of one shaft."""
    beside = np.abs(other.speed_at(profile.times_s))
    both = np.isfinite(beside) & (beside > 0.0)
    if not both.any():
        return None
    return float(np.sqrt(np.mean((np.abs(profile.speed[both]) / beside[both] - 1.0) ** 2)))


def _not_found(runs: Sequence[MeasuredRun]) -> Iterator[str]:
    for run in runs:
        known = say("Run") if _profiles(run) else say("The speed is not known in run")
        yield f"{known} {run.name}: {'; '.join(_reasons(run))}."


def _faults(runs: Sequence[MeasuredRun]) -> Iterator[str]:
    found = [
        pretty_unit(
            say(
                "Run {name}, {channel}: {faults}.",
                name=run.name,
                channel=profile.channel,
                faults="; ".join(profile.faults),
            )
        )
        for run in runs
        for profile in _profiles(run)
        if profile.faults
    ]
    yield from found[:MOST_FAULTS]
    if len(found) > MOST_FAULTS:
        yield say(
            "{most_faults} more speeds have faults, which stand under quality.", most_faults=len(found) - MOST_FAULTS
        )


# ---------------------------------------------------------------- figures


def _figures(teller: str, shaft: str, si_symbol: str, held: Held) -> Iterator[Figure]:
    """Speed over time of all runs; of lines their confidence too."""
    factor, unit = _scale(si_symbol)
    label = say("Train speed") if si_symbol == "m/s" else say("Speed of {of_what}", of_what=_of_what(shaft, si_symbol))
    elements: list[Element] = []
    drawn = factor * np.concatenate([profile.speed for _, profile in held])
    visible = VISIBLE * float(np.ptp(drawn)) if len(held) <= MOST_BANDS else float("inf")
    for number, (run, profile) in enumerate(held):
        elements += _drawn(run, profile, factor, number % SERIES_SLOTS, visible)
    lines = teller == "lines"
    banded = any(isinstance(element, Band) for element in elements)
    caption = say("Read from the lines of the drive's orders.") if lines else say("As the channel tells it.")
    caption += say(" The band is {sigmas:g} standard errors to each side.", sigmas=SIGMAS) if banded else ""
    if any(profile.unknown for _, profile in held):
        caption += say(" Where a trace breaks off, the speed is not known.")
    title = say("Speed over time, from lines") if lines else say("Speed over time, channel {teller}", teller=teller)
    time = Axis(say("Time from the start of the run"), "s")
    yield Figure(slug("speed", teller), title, caption, time, Axis(label, unit), elements, height=320)
    if lines:
        traces = [
            Line(*_broken(profile, profile.confidence), say("run {name}", name=run.name), color=number % SERIES_SLOTS)
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
            found.append(Band(times, values - half, values + half, say("run {name}, error", name=run.name), color=slot))
    found.append(Line(times, values, say("run {name}", name=run.name), color=slot))
    others = [other for other in _profiles(run) if other.source != "lines" and other.shaft == profile.shaft]
    if profile.source == "lines" and others:
        beside = _broken(others[0], factor * np.abs(others[0].speed))
        found.append(
            Line(
                *beside,
                say("run {name}, {channel}", name=run.name, channel=others[0].channel),
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
                    "run {run}, {shaft_channel} against {train_channel}",
                    run=run,
                    shaft_channel=item.shaft_channel,
                    train_channel=item.train_channel,
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
            kinds = joined([f"{sum(e.kind == kind for e in slip.events)} × {kind}" for kind in _kinds(slip)])
            peak = pretty_signs(f"{100.0 * worst.peak:+.2g} %")
            yield (
                say(
                    "Run {run}: the wheels lose adhesion ({kinds}, by {shaft_channel} against "
                    "{train_channel}), at worst {peak} beside the usual slip, from {first_s:.1f} s "
                    "to {last_s:.1f} s.",
                    run=run,
                    kinds=kinds,
                    shaft_channel=item.shaft_channel,
                    train_channel=item.train_channel,
                    peak=peak,
                    first_s=worst.first_s,
                    last_s=worst.last_s,
                )
            )
    if told:
        usual = [100.0 * slip.usual for _, _, slip in told]
        span = f"{min(usual):+.2f} %" + (say(" to {usual:+.2f} %", usual=max(usual)) if len(usual) > 1 else "")
        errors = [float(np.median(slip.error)) for _, _, slip in told if slip.error is not None]
        known = say(", one value ± {percent} (1 σ)", percent=_percent(max(errors))) if errors else ""
        calm = "" if any(slip.events for _, _, slip in told) else say("; adhesion is never lost")
        yield (
            say(
                "The usual slip of {runs_in} is {span}{known}{calm}. Creep, wear of the wheel and a "
                "wrong scale of either speed look alike in it.",
                runs_in=_runs_in_words([run for run, _, _ in told]),
                span=pretty_signs(span),
                known=known,
                calm=calm,
            )
        )
    yield from (say("Run {run}: {reason}.", run=run, reason=item.reason) for run, item in held if item.slip is None)


def _runs_in_words(runs: Sequence[str]) -> str:
    names = list(dict.fromkeys(runs))
    return say("run {names}", names=names[0]) if len(names) == 1 else say("{n_names} runs", n_names=len(names))


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

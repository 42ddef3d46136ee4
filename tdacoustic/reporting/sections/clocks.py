"""Several logs, one run: how their times lie on one axis, and how well that is known."""

from __future__ import annotations

import numpy as np

from tdacoustic.measured.run_clocks import LogClock, RunClocks
from tdacoustic.reporting.document import Block, Cell, Column, FigureBlock, Notice, Paragraph, Section, Table
from tdacoustic.reporting.figure import Axis, Figure, Line, Markers
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.words import pretty_signs, slug
from tdacoustic.results import Analysis

__all__ = ["clocks"]

_METHODS = {"start": mark("started together"), "time_stamps": mark("time stamps"), "shared": mark("shared signal")}
_METHOD = mark(
    "A log's time is moved and its sampling rate corrected to the reference log's clock; its samples stay as they are. "
    "With a shared signal, windows of one log are sought in the other, then the slope of the cross-spectrum's phase in "
    "many short windows gives the delay along the record, and a robust line through them offset and drift. Errors are "
    "standard errors from what the windows leave. A constant difference of the channels' delays, as of two filters or "
    "of a way that sound takes, cannot be told from an offset. A positive drift is of a log whose clock runs fast."
)


def clocks(analysis: Analysis) -> Section | None:
    """Return the section on the logs' clocks; None where no run has several logs."""
    held = analysis.clocks
    if not held:
        return None
    blocks: list[Block] = [Paragraph(pretty_signs(_sentence(run))) for run in held.values()]
    doubts = [
        say("Run {run}: {doubt}.", run=run.run, doubt=doubt)
        for run in held.values()
        for clock in run.clocks
        for doubt in clock.doubts
    ]
    blocks += [Notice("warning", pretty_signs(doubt)) for doubt in doubts]
    rows = [_cells(run, clock) for run in held.values() for clock in run.clocks]
    origin = analysis.campaign.origin
    blocks.append(Table("clocks", say("Clocks of the logs"), _columns(), rows, origin=origin))
    for run in held.values():
        blocks += [FigureBlock(_figure(run, clock), origin) for clock in run.clocks if _has_figure(clock)]
    blocks.append(Paragraph(say(_METHOD)))
    return Section("clocks", say("Several logs on one time axis"), blocks)


def _columns() -> tuple[Column, ...]:
    return (
        Column("run", say("Run")),
        Column("log", say("Log")),
        Column("reference_log", say("Reference")),
        Column("method", say("Method")),
        Column("offset_s", say("Starts at"), "s", 6, "number"),
        Column("offset_error_us", say("Error"), "µs", 3, "number"),
        Column("drift_ppm", say("Drift"), "ppm", 3, "number"),
        Column("drift_error_ppm", say("Error"), "ppm", 3, "number"),
        Column("axis_error", say("Error of an instant"), say("samples"), 4, "number"),
        Column("coherence", say("Coherence"), "", 3, "number"),
        Column("peak_ratio", say("Peak over next"), "", 2, "number"),
        Column("doubt", say("Doubt")),
    )


def _sentence(run: RunClocks) -> str:
    first = run.clocks[0]
    others = ", ".join(clock.log for clock in run.clocks)
    if run.method == "start":
        return say(
            "Run {run}: {logs} and {reference} are taken as started together; no drift is corrected.",
            run=run.run,
            logs=others,
            reference=first.reference_log,
        )
    if run.method == "time_stamps":
        starts = [say("{log} {offset:.6g} s after it", log=clock.log, offset=clock.offset_s) for clock in run.clocks]
        return say(
            "Run {run}: by their time stamps the logs start at {reference}'s and {starts}; no drift is corrected.",
            run=run.run,
            reference=first.reference_log,
            starts=", ".join(starts),
        )
    errors = [_axis_error(clock) for clock in run.clocks]
    worst = max((error for error in errors if error is not None), default=0.0)
    return say(
        "Run {run}: by the shared signal and {reference}'s clock, {clocks}. Any instant that both logs hold is known "
        "within {error:.2g} samples (standard error); nothing is resampled by that.",
        run=run.run,
        reference=first.reference_log,
        clocks="; ".join(_clock_words(clock) for clock in run.clocks),
        error=worst,
    )


def _clock_words(clock: LogClock) -> str:
    """When a log starts, and how its clock runs."""
    drift_ppm = clock.drift_ppm or 0.0
    words = (
        say(
            "{log} starts at {offset:.6f} s and its clock runs {drift:.3g} ppm fast",
            log=clock.log,
            offset=clock.offset_s,
            drift=abs(drift_ppm),
        )
        if drift_ppm > 0.0
        else say(
            "{log} starts at {offset:.6f} s and its clock runs {drift:.3g} ppm slow",
            log=clock.log,
            offset=clock.offset_s,
            drift=abs(drift_ppm),
        )
    )
    if clock.estimate and clock.estimate.inverted:
        return say("{clock} (its shared channel has the sign turned round)", clock=words)
    return words


def _axis_error(clock: LogClock) -> float | None:
    if clock.estimate is None or clock.sample_rate_hz is None:
        return None
    return clock.estimate.axis_error_s * clock.sample_rate_hz


def _cells(run: RunClocks, clock: LogClock) -> tuple[Cell, ...]:
    found = clock.estimate
    return (
        run.run,
        clock.log,
        clock.reference_log,
        say(_METHODS[clock.method]),
        clock.offset_s,
        None if clock.offset_error_s is None else 1e6 * clock.offset_error_s,
        clock.drift_ppm,
        clock.drift_error_ppm,
        _axis_error(clock),
        None if found is None else found.coherence,
        None if found is None else found.peak_ratio,
        "; ".join(clock.doubts) or None,
    )


def _has_figure(clock: LogClock) -> bool:
    return clock.estimate is not None and clock.estimate.residuals.times_s.size > 1


def _figure(run: RunClocks, clock: LogClock) -> Figure:
    assert clock.estimate is not None
    left = clock.estimate.residuals
    return Figure(
        slug("clock", run.run, clock.log),
        say("What offset and drift leave of the delay of {log}, run {run}", log=clock.log, run=run.run),
        say("Neighbouring windows together, with standard errors. A clock that runs evenly leaves scatter about zero."),
        Axis(say("Time"), "s"),
        Axis(say("Delay"), "µs"),
        (
            Line(left.times_s[[0, -1]], np.zeros(2), say("even clock"), style="dashed"),
            Markers(left.times_s, 1e6 * left.delays_s, say("delay"), errors=1e6 * left.errors_s),
        ),
        height=240,
    )

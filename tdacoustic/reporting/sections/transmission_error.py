"""The dynamic transmission error over time, as in Fig. 11 of the paper."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive import GearState
from tdacoustic.reporting.document import Block, Cell, Column, FigureBlock, Paragraph, Section, Table
from tdacoustic.reporting.figure import Axis, Figure, Line
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.gear_words import (
    by_speed,
    micrometres,
    motion_cells,
    motion_words,
    sentence,
    shown_state,
    state_words,
)
from tdacoustic.reporting.sections.model_parameters import assumed_words
from tdacoustic.reporting.sections.printed import (
    DTE_PP_UM,
    FIGURE_11_CONDITION,
    PAPER,
    is_of_the_paper,
    printed_of,
)
from tdacoustic.results import FleetPrediction

__all__ = ["transmission_error"]

PERIODS = 4
"""Mesh periods drawn at least; a motion that repeats after more is drawn until it does."""
MOST_LINES = 8
"""Conditions of one figure."""

METHOD = mark(
    "The dynamic transmission error (DTE) is δ, the displacement of the two gears towards each other along the normal "
    "line of action, with the vibration of both on their bearings. While teeth stay in contact its mean is half the "
    "backlash and the compression of the teeth under the load. Its peak to peak is taken from the whole series, not "
    "from the points drawn."
)
DASHED = mark(
    "The dashed line is where the flanks that carry begin to touch: half the backlash and the transmission error of "
    "the unloaded gears."
)
BETWEEN = mark("Between the dashed line and the one a backlash away from it the teeth do not touch.")
TOGETHER = mark("δ stays beyond it, so the teeth stay in contact.")


def transmission_error(result: FleetPrediction) -> Section:
    """Return the section on the dynamic transmission error."""
    states = by_speed(result.prediction.conditions)
    moving = [state for state in states if state.steady.method != "at_rest"]
    blocks: list[Block] = [Paragraph(say(METHOD))]
    if moving:
        shown = shown_state(result)
        blocks.append(FigureBlock(_over_time(result, shown if shown in moving else moving[0]), "calculated"))
    if len(moving) > 1:
        blocks.append(FigureBlock(_of_all(moving), "calculated"))
    blocks.append(_table(states))
    blocks += [Paragraph(text) for text in _against_the_paper(result, states)]
    return Section("transmission-error", say("Dynamic transmission error"), blocks)


def _waveform(state: GearState) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Time in mesh periods and δ in µm, over `PERIODS` or as many as the motion takes to repeat."""
    held = state.steady.waveform_m
    repeats = 1 if state.steady.repeats_after is None else math.ceil(PERIODS / held.shape[0])
    delta = np.tile(held.ravel(), repeats)
    return np.arange(delta.size) / held.shape[1], 1e6 * delta


def _over_time(result: FleetPrediction, state: GearState) -> Figure:
    """δ of one condition, with the edges of the gap that the teeth leave each other at."""
    system = result.prediction.unit.system
    time, delta = _waveform(state)
    ms = 1e3 * time / state.mesh_hz
    error = system.transmission_error_at(time)
    side = math.copysign(1.0, state.steady.torque_n_m)
    edge = 1e6 * (error + side * system.half_backlash_m)
    lines = [
        Line(ms, delta, "δ(t)"),
        Line(ms, edge, say("edge of the gap, flanks that carry"), style="dashed", color=7),
    ]
    if (side * (delta - 1e6 * error)).min() < 0.0:
        other = 1e6 * (error - side * system.half_backlash_m)
        lines.append(Line(ms, other, say("edge of the gap, other flanks"), style="dotted", color=7))
    caption = [
        sentence(motion_words(state.steady)),
        say("Peak to peak {length}.", length=micrometres(state.steady.dte_pp_m)),
        say(DASHED),
        say(BETWEEN) if state.steady.separates else say(TOGETHER),
    ]
    if state.steady.repeats_after is None:
        caption.append(say("The first mesh periods of the record."))
    return Figure(
        "dte-over-time",
        say("Dynamic transmission error over time, {condition}", condition=state_words(state)),
        " ".join(caption),
        Axis(say("Time"), "ms"),
        Axis(say("DTE δ"), "µm"),
        lines,
        height=380,
    )


def _of_all(moving: list[GearState]) -> Figure:
    places = np.unique(np.linspace(0, len(moving) - 1, min(MOST_LINES, len(moving))).round().astype(int))
    lines = []
    for place in places:
        state = moving[place]
        time, delta = _waveform(state)
        lines.append(Line(time, delta - delta.mean(), state.condition.name))
    caption = [say("Each without its mean.")]
    if len(places) < len(moving):
        caption.append(say("{count} of {all} conditions are drawn.", count=len(places), all=len(moving)))
    return Figure(
        "dte-conditions",
        say("Dynamic transmission error of the conditions over mesh periods"),
        " ".join(caption),
        Axis(say("Time"), say("mesh periods")),
        Axis(say("δ without its mean"), "µm"),
        lines,
        height=380,
    )


def _table(states: list[GearState]) -> Table:
    columns = (
        Column("condition", say("Condition")),
        Column("mesh_frequency_hz", say("Mesh"), "Hz", 1, "number"),
        Column("dte_pp_um", say("Peak to peak"), "µm", 2, "number"),
        Column("mean_um", say("Mean"), "µm", 1, "number"),
        Column("static_compression_um", "F₀ / k̄", "µm", 1, "number"),
        Column("contact_percent", say("Contact"), say("% of time"), 1, "number"),
        Column("floquet_max", say("Floquet"), say("largest"), 3, "number"),
        Column("motion", say("Motion")),
        Column("method", say("Found by")),
    )
    rows: list[list[Cell]] = [
        [
            state.condition.name,
            state.mesh_hz,
            1e6 * state.steady.dte_pp_m,
            1e6 * state.steady.mean_displacement_m,
            1e6 * state.steady.static_compression_m,
            100.0 * state.steady.contact_part,
            state.steady.floquet_max,
            *motion_cells(state.steady),
        ]
        for state in states
    ]
    return Table("dte", say("Dynamic transmission error of the conditions"), columns, rows, origin="calculated")


def _against_the_paper(result: FleetPrediction, states: list[GearState]) -> list[str]:
    if not is_of_the_paper(result.fleet):
        return []
    for state in states:
        row = printed_of(state)
        if row is not None and row.condition == FIGURE_11_CONDITION and state.steady.dte_pp_m > 0.0:
            return [
                say(
                    "The paper ({paper}, section 4.3 and Fig. 11) prints {printed:g} µm peak to "
                    "peak for its condition {name}; here it is {calculated:.2f} µm. The "
                    "two cannot check each other: the paper prints no transmission error, torque, "
                    "inertia, bearing or damping. The figure here depends on what is assumed: "
                    "{assumed}.",
                    paper=say(PAPER),
                    printed=DTE_PP_UM,
                    name=FIGURE_11_CONDITION,
                    calculated=1e6 * state.steady.dte_pp_m,
                    assumed=assumed_words(result.fleet),
                )
            ]
    return []

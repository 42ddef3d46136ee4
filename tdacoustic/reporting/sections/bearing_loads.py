"""Bearing forces: their spectra condition by condition, as in Fig. 9 of the paper."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive import GearState
from tdacoustic.gears import DIRECTIONS, GEARS, SteadyState, sampling_points
from tdacoustic.reporting.document import Block, Details, FigureBlock, Paragraph, Section
from tdacoustic.reporting.figure import Axis, Element, Figure, Line, Markers
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.gear_words import (
    DIRECTION_SLOTS,
    DIRECTION_SYMBOLS,
    by_speed,
    conditions_words,
    gear_word,
    hertz,
    largest_line,
    newtons,
    sentence,
    shown_state,
    state_words,
)
from tdacoustic.reporting.sections.loads_over_speed import loads_over_speed
from tdacoustic.reporting.sections.words import slug
from tdacoustic.results import FleetPrediction

__all__ = ["bearing_loads"]

HARMONICS_AT_LEAST = 5
"""Mesh harmonics that a spectrum shows in any case."""
DECADES = 5
"""Of the strongest line, that a spectrum shows."""
EDGE = 1.3
"""Where a point without a force is drawn, over the lower end of the axis."""
SAME = 1e-3
"""Relative difference below which a sampling point is the line at it."""

FORCE = mark("A force is what the shaft exerts on its bearings through their springs and dampers, K x + C x'.")
NOT_SPLIT = mark(
    "It is the total of all bearings of a gear: how it is split between the two bearings of a shaft is not modelled."
)
SPLIT = mark(
    "It is the total of all bearings of a gear; only for the housing is it split between the two bearings of a shaft."
)
AXES = mark(
    "x lies along the line of centres, y is tangential, z lies along the shafts. Amplitudes are peak values of a line."
)
NOTHING_BETWEEN = mark(
    "The motion repeats with each mesh period, so it has nothing between the mesh harmonics: at the sampling points "
    "there the force is zero, which a logarithmic axis cannot show; crosses at its lower edge mark them. What the "
    "paper reads at its points between the harmonics belongs to its record (length, window, what is left of the "
    "start), not to a motion like this one."
)
NOT_REPEATING = mark(
    "The motion does not repeat. The lines are the mesh harmonics and the strongest others of a record of it; what is "
    "broadband has no line, so a sampling point holds only the part of its band that is in lines."
)


def bearing_loads(result: FleetPrediction) -> Section:
    """Return the section on bearing forces."""
    states = by_speed(result.prediction.conditions)
    loaded = [state for state in states if largest_line(state) is not None]
    split = say(NOT_SPLIT) if result.prediction.housing is None else say(SPLIT)
    blocks: list[Block] = [Paragraph(f"{say(FORCE)} {split} {say(AXES)}")]
    still = [state for state in states if state not in loaded]
    if still:
        without = say("without torque the teeth of the model do not touch, and there is no force")
        blocks.append(Paragraph(sentence(f"{conditions_words(still)}: {without}")))
    if loaded:
        blocks += [_spectra(result, loaded), loads_over_speed(result, loaded)]
    return Section("bearing-forces", say("Bearing forces"), blocks)


def _spectra(result: FleetPrediction, loaded: list[GearState]) -> Section:
    shown = shown_state(result)
    shown = shown if shown in loaded else loaded[len(loaded) // 2]
    others: list[Block] = []
    for state in loaded:
        if state is not shown:
            others += _of_condition(result, state)
    blocks = _of_condition(result, shown)
    if others:
        rest = [state for state in loaded if state is not shown]
        blocks.append(Details(say("Spectra of {conditions}", conditions=conditions_words(rest)), others))
    return Section("force-spectra", say("Spectra"), blocks)


def _of_condition(result: FleetPrediction, state: GearState) -> list[Block]:
    highest = max(result.fleet.radiation.max_frequency_hz.value, HARMONICS_AT_LEAST * state.mesh_hz * (1.0 + 1e-9))
    figures = [FigureBlock(_figure(state, gear, highest), "calculated") for gear in range(len(GEARS))]
    return [Paragraph(sentence(f"{state_words(state)}: {_words(state)}")), *figures]


def _words(state: GearState) -> str:
    largest = largest_line(state)
    assert largest is not None
    gear, direction, force, frequency = largest
    text = say(
        "the largest line is {force} at {frequency} ({gear}, {direction}).",
        force=newtons(force),
        frequency=hertz(frequency),
        gear=gear,
        direction=direction,
    )
    return f"{text} {_between_words(state.steady)}"


def _between_words(steady: SteadyState) -> str:
    if steady.repeats_after == 1:
        return say(NOTHING_BETWEEN)
    if steady.repeats_after is None:
        return say(NOT_REPEATING)
    return say(
        "The motion repeats only after {count} mesh periods, so it has lines at every "
        "multiple of {frequency}, between the mesh harmonics too, and the sampling points there hold "
        "them.",
        count=steady.repeats_after,
        frequency=hertz(steady.mesh_hz / steady.repeats_after),
    )


def _figure(state: GearState, gear: int, highest_hz: float) -> Figure:
    forces = state.forces
    held = forces.frequency_hz <= highest_hz
    frequencies, amplitudes = forces.frequency_hz[held], np.abs(forces.amplitude_n[gear][:, held])
    top = float(amplitudes.max())
    bottom = 10.0 ** math.floor(math.log10(top) - DECADES)
    drawn = np.where(amplitudes >= bottom, amplitudes, np.nan)
    elements: list[Element] = [_stems(frequencies, drawn, bottom)]
    for direction, values in zip(DIRECTIONS, drawn, strict=True):
        slot, symbol = DIRECTION_SLOTS[direction], DIRECTION_SYMBOLS[direction]
        elements.append(Markers(frequencies, values, direction, symbol=symbol, color=slot))
    elements += _sampled(state, gear, highest_hz, bottom)
    name = GEARS[gear]
    return Figure(
        slug("spectrum", name, state.condition.name),
        say("Forces on the bearings of the {gear}, {condition}", gear=gear_word(name), condition=state_words(state)),
        say(
            "Lines up to {highest}; those {decades} decades below the strongest are left out. The "
            "sampling points of Fig. 9 are the mesh harmonics ({mesh}) and three between each two "
            "of them, each with the energy of the lines around it; a cross marks those that are not "
            "a line themselves, at the lower edge those without a force.",
            highest=hertz(highest_hz),
            decades=DECADES,
            mesh=hertz(state.mesh_hz),
        ),
        Axis(say("Frequency"), "Hz", limits=(0.0, 1.02 * highest_hz)),
        Axis(say("Force"), "N", "log", limits=(bottom, 3.0 * top), note=say("peak amplitude")),
        elements,
        height=380,
    )


def _stems(frequencies: NDArray[np.float64], values: NDArray[np.float64], bottom: float) -> Line:
    """A thin line from the bottom to the largest direction of each spectral line."""
    tops = np.fmax.reduce(values, axis=0)
    gaps = np.full(tops.size, np.nan)
    y = np.stack([np.where(np.isfinite(tops), bottom, np.nan), tops, gaps], axis=1)
    return Line(np.repeat(frequencies, 3), y.ravel(), say("lines"), color=7, width=1.0)


def _sampled(state: GearState, gear: int, highest_hz: float, bottom: float) -> list[Markers]:
    """The paper's sampling points: those without a force at the lower edge, those with more than one line at theirs."""
    points = sampling_points(state.mesh_hz, highest_hz)
    values = state.forces.sampled_n(points)[gear]
    empty = values.max(axis=0) < bottom
    found = []
    if empty.any():
        edge = np.full(int(empty.sum()), EDGE * bottom)
        found.append(Markers(points[empty], edge, say("sampled: zero"), symbol="x", color=7))
    lines = state.forces.frequency_hz
    nearest = np.abs(lines[None, :] - points[:, None]).argmin(axis=1)
    alone = np.abs(lines[nearest] / points - 1.0) < SAME
    alone = alone & np.isclose(values, np.abs(state.forces.amplitude_n[gear][:, nearest]), rtol=SAME)
    gathered = np.where(alone | (values < bottom), np.nan, values)
    if np.isfinite(gathered).any():
        texts = [say("direction {direction}", direction=direction) for direction in DIRECTIONS for _ in points]
        x = np.tile(points, len(DIRECTIONS))
        found.append(Markers(x, gathered.ravel(), say("sampled"), texts=texts, symbol="x", color=3))
    return found

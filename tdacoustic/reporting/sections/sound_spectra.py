"""The tones of motor, mesh and structure over frequency, condition by condition."""

from __future__ import annotations

import math

import numpy as np

from tdacoustic.drive import DriveSound, GearState, SoundSource
from tdacoustic.reporting.document import Block, Details, FigureBlock, Paragraph, Section
from tdacoustic.reporting.figure import Axis, Element, Figure, Line, Markers, Rule
from tdacoustic.reporting.language import say, say_count
from tdacoustic.reporting.sections.gear_words import by_speed, conditions_words, shown_state, state_words
from tdacoustic.reporting.sections.sound_paths import PATHS
from tdacoustic.reporting.sections.words import slug
from tdacoustic.results import FleetPrediction

__all__ = ["sound_spectra"]

FEWEST = 3
"""Tones of a condition from which a picture says more than the levels do."""
SHOWN_DB = 80.0
"""Below the strongest tone, that a figure shows."""


def sound_spectra(result: FleetPrediction) -> Section | None:
    """Return the section on the tones; None where no condition has more than two."""
    prediction = result.prediction
    heard = [
        (state, sound)
        for state in by_speed(prediction.conditions)
        if (sound := prediction.sound_of(state.condition.name)) is not None and sound.sources
    ]
    if not any(len(sound.sources) >= FEWEST for _, sound in heard):
        return None
    shown = next((pair for pair in heard if pair[0] is shown_state(result)), heard[len(heard) // 2])
    said = say(
        "Unweighted level of each tone alone at {surface}, the mean in energy over the surface. "
        "Whether the total adds a path is said above.",
        surface=prediction.surface,
    )
    blocks: list[Block] = [Paragraph(said), FigureBlock(_figure(result, *shown), "calculated")]
    others = [pair for pair in heard if pair is not shown]
    if others:
        folded = [FigureBlock(_figure(result, *pair), "calculated") for pair in others]
        rest = conditions_words([state for state, _ in others])
        blocks.append(Details(say("Tones of {conditions}", conditions=rest), folded))
    return Section("sound-tones", say("Tones of each path"), blocks)


def _figure(result: FleetPrediction, state: GearState, sound: DriveSound) -> Figure:
    tones = list(zip(sound.sources, sound.surface_db, strict=True))
    top = 10.0 * math.ceil(0.1 * max(sound.surface_db) + 0.5)
    bottom = max(10.0 * math.floor(0.1 * min(sound.surface_db) - 0.5), top - SHOWN_DB)
    drawn = [(source, level) for source, level in tones if level > bottom]
    elements: list[Element] = [_stems(drawn, bottom)]
    for path in PATHS:
        held = [(source, level) for source, level in drawn if source.path == path.key]
        if held:
            frequencies, levels = np.array([(source.frequency_hz, level) for source, level in held]).T
            names = [source.name for source, _ in held]
            labels = [name.removeprefix("mesh ") for name in names]
            markers = Markers(frequencies, levels, path.name, labels, names, symbol=path.symbol, color=path.slot)
            elements.append(markers)
    highest = max(source.frequency_hz for source, _ in drawn)
    housing = result.prediction.housing
    if housing is not None and highest > housing.range_hz[1]:
        elements.append(Rule(housing.range_hz[1], say("end of the housing's range")))
    left_out = len(tones) - len(drawn)
    return Figure(
        slug("tones", state.condition.name),
        say(
            "Tones of the drive at {surface}, {condition}",
            surface=result.prediction.surface,
            condition=state_words(state),
        ),
        say_count("{count} weaker tone is left out.", "{count} weaker tones are left out.", left_out)
        if left_out
        else "",
        Axis(say("Frequency"), "Hz", limits=(0.0, 1.05 * highest)),
        Axis(say("Level"), "dB", limits=(bottom, top), reference="20 µPa"),
        elements,
        height=300,
    )


def _stems(tones: list[tuple[SoundSource, float]], bottom: float) -> Line:
    """A thin line from the lower edge to each tone."""
    frequencies = np.repeat([source.frequency_hz for source, _ in tones], 3)
    levels = [(bottom, level, math.nan) for _, level in tones]
    return Line(frequencies, np.array(levels).ravel(), say("tones"), color=7, width=1.0)

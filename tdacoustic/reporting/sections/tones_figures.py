"""Figures of the section on tones: audibility over runs, tones against their criterion, tones over the speed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tdacoustic.measured.tonality import RunTone, Tonality
from tdacoustic.reporting.figure import Axis, Bars, Element, Figure, Line, Markers
from tdacoustic.reporting.language import say
from tdacoustic.reporting.sections.spectra import density_levels, level_axis
from tdacoustic.reporting.sections.words import (
    OWNER_SLOT_OTHER,
    OWNER_SLOTS,
    condition_words,
    slug,
    source_word,
    tested_runs,
)
from tdacoustic.results import Analysis

__all__ = ["audibility_figure", "criterion_figure", "run_up_figures"]

LOWEST_HZ = 40.0
HIGHEST_HZ = 16000.0
NAMED_TONES = 6
"""Tones named on one picture; all have their words under the pointer."""
TRACE_SLOT, CRITERION_SLOT = 7, 6
HEADROOM = 0.25
"""Height over what is drawn, of the range of levels, that names need."""
MOST_RUNS = 40


def audibility_figure(analysis: Analysis, found: Tonality, microphones: Sequence[str], method: str) -> Figure | None:
    """Return the mean audibility of each run at each receiver, or None of less than two runs."""
    runs = [run for run in tested_runs(analysis) if any(found.rating(run.name, m, method) for m in microphones)]
    if not 2 <= len(runs) <= MOST_RUNS:
        return None
    bars = []
    for name in microphones:
        ratings = [found.rating(run.name, name, method) for run in runs]
        values = [np.nan if r is None or r.mean_audibility_db is None else r.mean_audibility_db for r in ratings]
        errors = [0.0 if r is None or r.uncertainty_db is None else r.uncertainty_db for r in ratings]
        bars.append(Bars([run.name for run in runs], np.array(values), name, np.array(errors)))
    if all(np.isnan(bar.values).all() for bar in bars):
        return None
    return Figure(
        "audibility",
        say("Mean audibility by run, {method}", method=method),
        say(
            "Above 0 dB a tone is audible over the noise that masks it; \N{MINUS SIGN}10 dB stands for no audible "
            "tone. The bars' errors are the 90 % interval."
        ),
        Axis(say("Run")),
        Axis(say("Mean audibility"), "dB"),
        bars,
        height=340,
    )


def criterion_figure(analysis: Analysis, found: Tonality, run: str, channel: str) -> Figure | None:
    """Return a spectrum with its tones, and from which level on a tone would be prominent; None of a run-up."""
    curve = next((c for c in found.curves if (c.run, c.channel) == (run, channel)), None)
    spectrum = None if curve is None else analysis.result(run, channel).spectrum  # of a silent channel there is neither
    if curve is None or spectrum is None:
        return None
    held = [
        tone
        for tone in found.tones
        if (tone.run, tone.channel) == (run, channel) and tone.weighting == "Z" and "tone-to-noise" in tone.method
    ]
    low, high = LOWEST_HZ, min(HIGHEST_HZ, float(spectrum.frequencies_hz[-1]))
    kept = (spectrum.frequencies_hz >= low) & (spectrum.frequencies_hz <= high)
    levels = density_levels(spectrum, spectrum.density)[kept]
    elements: list[Element] = [
        Line(spectrum.frequencies_hz[kept], levels, channel, color=TRACE_SLOT, width=1.0),
        Line(curve.frequency_hz, curve.prominent_db, say("prominent from here"), "dashed", CRITERION_SLOT, 1.5),
        Line(curve.frequency_hz, curve.audible_db, say("audible from here"), "dotted", CRITERION_SLOT, 1.5),
        *_tone_markers(found, held),
    ]
    name = next(measured for measured in tested_runs(analysis) if measured.name == run)
    axis = level_axis(spectrum)
    drawn = np.concatenate((levels, curve.prominent_db, curve.audible_db))
    bottom, top = float(np.nanmin(drawn)), float(np.nanmax(drawn))
    span = max(top - bottom, 1.0)
    return Figure(
        slug("tones", run, channel),
        say(
            "Tones against their criterion: {condition}, run {run}, {channel}",
            condition=condition_words(analysis, name.run.condition or ""),
            run=run,
            channel=channel,
        ),
        say(
            "Line spacing {spacing:.3g} Hz. Points are the tones' levels; their colour is their owner. Both curves "
            "start from the noise in the critical band under the lines: plus the masking index of ISO/TS 20065 a tone "
            "is audible, plus the criterion of the tone-to-noise ratio (ECMA-418-1) it is prominent. The ratings "
            "stand under each point; they take the noise as each standard does.",
            spacing=spectrum.resolution_hz,
        ),
        Axis(say("Frequency"), "Hz", "log", limits=(low, high)),
        Axis(
            axis.label, axis.unit, axis.scale, (bottom - 0.05 * span, top + HEADROOM * span), axis.reference, axis.note
        ),
        elements,
        height=420,
    )


def _tone_markers(found: Tonality, held: Sequence[RunTone]) -> list[Markers]:
    """Tones by owner; the nearest to their criterion are named."""
    ranked = sorted(
        held, key=lambda tone: -((tone.value_db if tone.value_db is not None else -99.0) - tone.criterion_db)
    )
    named = {id(tone) for tone in ranked[:NAMED_TONES]}
    markers = []
    for owner in dict.fromkeys([*OWNER_SLOTS, *(tone.owner for tone in held)]):
        own = [tone for tone in held if tone.owner == owner]
        if own:
            labels = [f"{t.frequency_hz:.0f} Hz {_short(t)}" if id(t) in named else "" for t in own]
            markers.append(
                Markers(
                    np.array([tone.frequency_hz for tone in own]),
                    np.array([tone.level_db for tone in own]),
                    _owner_words(owner),
                    labels,
                    [_words(found, tone) for tone in own],
                    color=OWNER_SLOTS.get(owner, OWNER_SLOT_OTHER),
                )
            )
    return markers


def _owner_words(owner: str) -> str:
    return say("owner unknown") if owner == "unassigned" else say("owner {owner}", owner=source_word(owner))


def _short(tone: RunTone) -> str:
    return "?" if tone.excitation == "unknown" else tone.excitation


def _words(found: Tonality, tone: RunTone) -> str:
    """What stands under the pointer: all ratings of one tone."""
    words = [f"{tone.frequency_hz:.1f} Hz, {_short(tone)}"]
    for other in found.tones:
        near = abs(other.frequency_hz - tone.frequency_hz) <= 1.5
        if (other.run, other.channel) == (tone.run, tone.channel) and near and other.value_db is not None:
            words.append(
                say(
                    "{method}: {level:.1f} dB (from {criterion:.1f} dB)",
                    method=other.method,
                    level=other.value_db,
                    criterion=other.criterion_db,
                )
            )
    return "\n".join([*words, *tone.notes])


def run_up_figures(found: Tonality, run: str, microphones: Sequence[str], method: str) -> list[Figure]:
    """Return the audibility over time of a run-up, and its tones over the speed; nothing of a steady run."""
    moving = [tone for tone in found.tones if tone.run == run and tone.speed is not None and tone.method == method]
    hearing = found.hearing.get(run)
    if hearing is None or not any(r.run == run and r.speed is not None for r in found.ratings):
        return []
    lines: list[Element] = []
    for name in microphones:
        rated = hearing.rated(name, method)
        start_s = next((raster.start_s for raster in hearing.rasters if name in raster.channels), 0.0)
        if rated is not None and (rated.decisive_db > 0.0).any():  # else the sentence says that none is audible
            times = start_s + rated.starts_s + 0.5 * rated.averaging_s
            lines.append(Line(times, rated.decisive_db, name, points=True))
    figures = []
    if lines:
        figures.append(
            Figure(
                slug("audibility", run),
                say("Audibility over time, run {run}, {method}", run=run, method=method),
                say("Of the most audible tone of each short-time spectrum; \N{MINUS SIGN}10 dB where none is audible."),
                Axis(say("Time"), "s"),
                Axis(say("Audibility"), "dB"),
                lines,
                height=300,
            )
        )
    shown = [tone for tone in moving if tone.channel in microphones]
    if shown:
        figures.append(_tones_over_speed(run, shown, method))
    return figures


def _tones_over_speed(run: str, shown: Sequence[RunTone], method: str) -> Figure:
    unit = next(tone.speed.unit for tone in shown if tone.speed is not None)
    markers = []
    for owner in dict.fromkeys([*OWNER_SLOTS, *(tone.owner for tone in shown)]):
        own = [tone for tone in shown if tone.owner == owner and tone.speed is not None]
        if own:
            middles = [0.5 * (t.speed.low + t.speed.high) for t in own if t.speed is not None]
            markers.append(
                Markers(
                    np.array(middles),
                    np.array([tone.frequency_hz for tone in own]),
                    _owner_words(owner),
                    texts=[_words_over_speed(tone) for tone in own],
                    color=OWNER_SLOTS.get(owner, OWNER_SLOT_OTHER),
                )
            )
    return Figure(
        slug("tones-over-speed", run),
        say("Audible tones over the speed, run {run}, {method}", run=run, method=method),
        say(
            "At the middle of the speed class that each was heard in. Tones at one height stand still; tones that "
            "climb with the speed follow an order."
        ),
        Axis(say("Speed"), unit),
        Axis(say("Frequency"), "Hz", "log"),
        markers,
        height=360,
    )


def _words_over_speed(tone: RunTone) -> str:
    """What stands under the pointer: whose tone it is, how audible."""
    frequency = f"{tone.frequency_hz:.1f} Hz"
    if tone.order is not None:
        frequency = say("{frequency} ({order:.2f} per motor turn)", frequency=frequency, order=tone.order)
    audibility = say("audibility {level:.1f} dB", level=tone.value_db or 0.0)
    return f"{frequency}, {_short(tone)}, {tone.channel}\n{audibility}"

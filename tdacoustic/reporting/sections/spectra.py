"""Spectra with their lines named, and maps of run-ups."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tdacoustic.lines import Line as SpectralLine
from tdacoustic.measured import ChannelResult
from tdacoustic.measured.runs import MeasuredRun
from tdacoustic.recording import Channel
from tdacoustic.reporting.document import Block, Column, Details, FigureBlock, Paragraph, Section, Table
from tdacoustic.reporting.figure import Axis, Element, Figure, Heatmap, Line, Markers
from tdacoustic.reporting.language import mark, say, say_count
from tdacoustic.reporting.sections.folding import chosen
from tdacoustic.reporting.sections.gear_words import begun_large
from tdacoustic.reporting.sections.words import (
    condition_words,
    measured_channels,
    pretty_signs,
    pretty_unit,
    quantity_word,
    slug,
    speed_words,
    tested_runs,
)
from tdacoustic.results import Analysis
from tdacoustic.spectra import Spectrum
from tdacoustic.units import REFERENCES, level_db, reference_label

__all__ = ["density_levels", "level_axis", "quantity_title", "single_spectrum_figure", "spectra"]

TRACES = 4
"""Channels drawn in one figure."""
NAMED_LINES = 8
"""Lines named on one picture; all have their names under the pointer and in the table."""
LOWEST_HZ = 10.0

LEVEL_TITLES = {"sound_pressure": mark("Sound pressure level"), "acceleration": mark("Acceleration level")}


def spectra(analysis: Analysis, fold: bool = False) -> Section:
    """Return the section on spectra and lines, each run folded away where another section shows what matters."""
    blocks: list[Block] = []
    for run in tested_runs(analysis):
        figures = _run_figures(analysis, run)
        if figures:
            table = _line_table(analysis, run)
            parts: list[Block] = [*figures, *([table] if table is not None else [])]
            title = say("Run {run}: {speed}", run=run.name, speed=speed_words(run))
            folded = Details(say("{title}: all channels and lines", title=title), parts)
            blocks.append(folded if fold else Section(slug("run", run.name), title, parts))
    if not blocks:
        blocks = [Paragraph(say("No channel gave a spectrum."))]
    method = say(
        "Hann window, averaged in energy over overlapping frames; a steady sinusoid shows its rms at its line. "
        "A line has to stand over its local floor (dotted, a running median) by the prominence set in the campaign. "
        "A run whose speed is not constant is shown over time and not averaged."
    )
    return Section("spectra", say("Spectra and lines"), [Paragraph(method), *blocks])


def _run_figures(analysis: Analysis, run: MeasuredRun) -> list[Block]:
    by_quantity: dict[str, list[tuple[Channel, ChannelResult]]] = {}
    for channel, result in measured_channels(run):
        by_quantity.setdefault(channel.quantity, []).append((channel, result))
    ordered = sorted(by_quantity.items(), key=lambda item: (item[0] != "sound_pressure", item[0]))
    figures: list[Block] = []
    for quantity, members in ordered:
        steady = [member for member in members if member[1].spectrum is not None]
        groups: list[tuple[str, Sequence[Block]]] = []
        for start in range(0, len(steady), TRACES):
            part = "" if len(steady) <= TRACES else f"-{start // TRACES + 1}"
            some = steady[start : start + TRACES]
            figure = _spectrum_figure(analysis, run, quantity, some, part)
            names = ", ".join(channel.name for channel, _ in some)
            groups.append((names, [FigureBlock(figure, analysis.campaign.origin)]))
        figures += chosen(say("Channels"), groups)
        drawn = [member for member in members if member[1].map is not None and member[1].map.times_s.size > 1]
        figures += chosen(
            say("Channel"),
            [(member[0].name, [FigureBlock(_map_figure(run, *member), analysis.campaign.origin)]) for member in drawn],
        )
    return figures


def single_spectrum_figure(spectrum: Spectrum, lines: Sequence[SpectralLine] = ()) -> Figure:
    """Return the figure of one spectrum with its lines, as notebooks plot it."""
    first = max(1, math.ceil(LOWEST_HZ / spectrum.resolution_hz))
    elements: list[Element] = [
        Line(
            spectrum.frequencies_hz[first:],
            density_levels(spectrum, spectrum.density)[first:],
            spectrum.name,
            color=0,
            width=1.0,
        )
    ]
    elements += _line_markers(spectrum.name, spectrum.quantity, lines, 0, _named([lines])[0], None)
    return Figure(
        slug("spectrum", spectrum.name),
        say("Spectrum of {name}", name=spectrum.name),
        " ".join([say("Line spacing {spacing:.4g} Hz.", spacing=spectrum.resolution_hz), _interval_words(spectrum)]),
        Axis(say("Frequency"), "Hz", "log"),
        level_axis(spectrum),
        elements,
    )


def level_axis(spectrum: Spectrum) -> Axis:
    """Return the axis of a spectrum: level re its reference, else the quantity itself."""
    reference = pretty_unit(reference_label(spectrum.quantity) or "") or None
    title = quantity_title(spectrum.quantity)
    note = say("rms in {bandwidth:.3g} Hz", bandwidth=spectrum.noise_bandwidth_hz)
    if reference is None:
        return Axis(title, pretty_unit(spectrum.si_symbol), "log", note=note)
    level = LEVEL_TITLES.get(spectrum.quantity)
    return Axis(say(level) if level else say("{quantity} level", quantity=title), "dB", reference=reference, note=note)


def _interval_words(spectrum: Spectrum) -> str:
    low, high = (10.0 * math.log10(factor) for factor in spectrum.interval())
    return say(
        "With {averages:.3g} independent averages the true density of noise lies within "
        "{low} and {high} dB of the trace (95 %).",
        averages=spectrum.averages,
        low=pretty_signs(f"{low:.1f}"),
        high=pretty_signs(f"{high:+.1f}"),
    )


def quantity_title(quantity: str) -> str:
    """Name of a quantity as an axis has it."""
    return begun_large(quantity_word(quantity))


def density_levels(spectrum: Spectrum, density: np.ndarray) -> np.ndarray:
    """Level (or rms, where the quantity has no level) of a density in one noise bandwidth."""
    power = density * spectrum.noise_bandwidth_hz
    with np.errstate(divide="ignore", invalid="ignore"):
        reference = REFERENCES.get(spectrum.quantity)
        values = np.sqrt(power) if reference is None else 10.0 * np.log10(power / reference**2)
    return np.where(np.isfinite(values), values, np.nan)


def _spectrum_figure(
    analysis: Analysis, run: MeasuredRun, quantity: str, members: list[tuple[Channel, ChannelResult]], part: str
) -> Figure:
    elements: list[Element] = []
    held = [(channel, result, result.spectrum) for channel, result in members if result.spectrum is not None]
    named = _named([result.lines for _, result, _ in held])
    for slot, (channel, result, spectrum) in enumerate(held):
        first = max(1, math.ceil(LOWEST_HZ / spectrum.resolution_hz))
        frequencies = spectrum.frequencies_hz[first:]
        elements.append(
            Line(frequencies, density_levels(spectrum, spectrum.density)[first:], channel.name, color=slot, width=1.0)
        )
        if result.floor is not None and len(held) == 1:
            floor = density_levels(spectrum, result.floor)[first:]
            elements.append(Line(frequencies, floor, say("local floor"), style="dotted", color=slot, opacity=0.7))
        elements += _line_markers(channel.name, quantity, result.lines, slot, named[slot], run.motor_speed_hz)
    spectrum = held[0][2]
    return Figure(
        slug("spectrum", run.name, quantity) + part,
        _spectrum_title(analysis, run, quantity, [channel.name for channel, _, _ in held] if part else []),
        " ".join(
            [
                say("Line spacing {spacing:.4g} Hz.", spacing=spectrum.resolution_hz),
                say("Points are the lines found; the most prominent are named."),
                _interval_words(spectrum),
            ]
        ),
        Axis(say("Frequency"), "Hz", "log"),
        level_axis(spectrum),
        elements,
        height=440,
    )


def _spectrum_title(analysis: Analysis, run: MeasuredRun, quantity: str, channels: Sequence[str]) -> str:
    """What a figure is of; its channels where the run needs several figures for them."""
    values = {
        "quantity": quantity_title(quantity),
        "condition": condition_words(analysis, run.run.condition or ""),
        "run": run.name,
    }
    if not channels:
        return say("{quantity}, {condition}, run {run}", **values)
    return say("{quantity}, {condition}, run {run}: {channels}", channels=", ".join(channels), **values)


def _line_markers(
    name: str,
    quantity: str,
    lines: Sequence[SpectralLine],
    slot: int,
    named: set[int],
    turns_hz: float | None,
) -> list[Markers]:
    if not lines:
        return []
    heights = [level_db(line.rms, quantity) for line in lines]
    y = [line.rms if height is None else height for line, height in zip(lines, heights, strict=True)]
    return [
        Markers(
            np.array([line.frequency_hz for line in lines]),
            np.array(y),
            say("lines of {channel}", channel=name),
            labels=[f"{line.frequency_hz:.0f} Hz" if i in named else "" for i, line in enumerate(lines)],
            texts=[_line_words(line, turns_hz) for line in lines],
            color=slot,
        )
    ]


def _named(lines: Sequence[Sequence[SpectralLine]]) -> list[set[int]]:
    """Choose the lines named on a picture: the most prominent of all channels, each frequency once."""
    ranked = sorted(
        (
            (line.prominence_db, line.frequency_hz, slot, index)
            for slot, held in enumerate(lines)
            for index, line in enumerate(held)
        ),
        reverse=True,
    )
    named: list[set[int]] = [set() for _ in lines]
    taken: list[float] = []
    for _, frequency_hz, slot, index in ranked:
        if len(taken) < NAMED_LINES and all(abs(frequency_hz - other) > 0.01 * other for other in taken):
            named[slot].add(index)
            taken.append(frequency_hz)
    return named


def _line_words(line: SpectralLine, turns_hz: float | None) -> str:
    words = [f"{line.frequency_hz:.1f} Hz ± {line.frequency_error_hz:.2g} Hz"]
    words += [say("order {order:.2f}", order=line.frequency_hz / turns_hz)] if turns_hz else []
    words.append(say("{prominence:.1f} dB over the floor", prominence=line.prominence_db))
    return ", ".join(words)


def _map_figure(run: MeasuredRun, channel: Channel, result: ChannelResult) -> Figure:
    held = result.map
    assert held is not None
    reference = REFERENCES.get(channel.quantity)
    with np.errstate(divide="ignore"):
        z = 10.0 * np.log10(held.density / (reference or 1.0) ** 2)
    z = np.where(np.isfinite(z), z, np.nan)
    top = float(np.nanmax(z)) if np.isfinite(z).any() else 0.0
    label = pretty_unit(reference_label(channel.quantity) or f"1 {channel.si_symbol}")
    z_axis = Axis(
        say("Density level"), "dB", limits=(top - 60.0, top), reference=say("{reference} per Hz", reference=label)
    )
    return Figure(
        slug("map", run.name, channel.name),
        say("Over time, run {run}, {channel}: {speed}", run=run.name, channel=channel.name, speed=speed_words(run)),
        say(
            "Density over time and frequency; each cell is the highest of the lines it covers. Lines that slope "
            "follow the speed, level ones stay at their frequency."
        ),
        Axis(say("Time"), "s"),
        Axis(say("Frequency"), "Hz"),
        [Heatmap(held.times_s, held.frequencies_hz, z, channel.name, z_axis)],
        height=460,
    )


def _line_table(analysis: Analysis, run: MeasuredRun) -> Details | None:
    table = analysis.tables["lines"]
    held = table[table["run"] == run.name]
    if not len(held):
        return None
    columns = (
        Column("channel", say("Channel")),
        Column("frequency_hz", say("Frequency"), "Hz", 2, "number"),
        Column("frequency_error_hz", "± (1 σ)", "Hz", 3, "number"),
        Column("level_db", say("Level"), "dB", 1, "number"),
        Column("prominence_db", say("Over the floor"), "dB", 1, "number"),
        Column("order", say("Order"), say("per motor turn"), 3, "number"),
        Column("family", say("Family")),
    )
    rows = [
        [row[column.key] if isinstance(row[column.key], str) or column.kind == "number" else "" for column in columns]
        for row in held.to_dict("records")
    ]
    name = slug("lines", run.name)
    return Details(
        say_count("{count} line of run {run}", "{count} lines of run {run}", len(rows), run=run.name),
        [Table(name, say("Lines of run {run}", run=run.name), columns, rows, origin=analysis.campaign.origin)],
    )

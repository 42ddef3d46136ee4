"""Motor, gearbox and noise of each condition over the same frequencies, every line marked and named."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tdacoustic.attribution import SourceLine
from tdacoustic.attribution.evidence import LineEvidence
from tdacoustic.attribution.excitation import owner_of
from tdacoustic.lines import Line as SpectralLine
from tdacoustic.measured import ChannelResult
from tdacoustic.measured.runs import MeasuredRun, receivers
from tdacoustic.reporting.document import Block, FigureBlock, Paragraph, Section
from tdacoustic.reporting.figure import Axis, Element, Figure, Line, Markers, Rule, Symbol
from tdacoustic.reporting.language import mark, say, say_count
from tdacoustic.reporting.sections.gear_words import begun_large
from tdacoustic.reporting.sections.spectra import density_levels, level_axis
from tdacoustic.reporting.sections.words import (
    OWNER_SLOT_OTHER,
    OWNER_SLOTS,
    condition_words,
    joined,
    measured_channels,
    quantity_word,
    slug,
    source_word,
    tested_runs,
)
from tdacoustic.results import Analysis
from tdacoustic.spectra import Spectrum
from tdacoustic.units import level_db

__all__ = ["side_by_side"]

LOWEST_HZ = 20.0
BEYOND = 1.3
"""The axis ends this far over the highest noise line."""
MESH_HARMONICS = 4
"""Calculated mesh harmonics that are drawn."""
HEADROOM = 0.35
"""Height over the highest line, of the range of levels, that names of lines and rules need."""
OTHER_NAMED = 5
"""Lines of a sensor that are no noise lines and have their name on the picture; all have it under the pointer."""

METHOD = mark(
    "One condition after the other: a sensor of the motor, one of the gearbox and one receiver over the same "
    "frequencies. Of each component that sensor is drawn which shows the noise lines best. Broken lines are the "
    "calculated mesh harmonics. A line is named by its frequency and by the order that owns it; '?' where no known "
    "order does. The colour of a noise line is its source; in the sensors it says which noise line is found there too."
)


def side_by_side(analysis: Analysis) -> Section | None:
    """Return the section with three spectra a condition, or None without a fleet or a receiver's spectrum."""
    if analysis.fleet is None:
        return None
    blocks: list[Block] = []
    for condition in analysis.campaign.conditions():
        view = _chosen(analysis, condition)
        if view is not None:
            words = condition_words(analysis, condition)
            blocks.append(Section(slug("beside", condition), words, list(view.blocks())))
    return (
        Section("side-by-side", say("Motor, gearbox and noise side by side"), [Paragraph(say(METHOD)), *blocks])
        if blocks
        else None
    )


def _chosen(analysis: Analysis, condition: str) -> _View | None:
    """The steady run of a condition that shows most of its noise lines, at its first receiver."""
    views = []
    for run in tested_runs(analysis):
        names = [name for name in receivers(analysis.runs) if name in run.usable_channels]
        if run.run.condition == condition and run.measurement is not None and run.measurement.steady and names:
            view = _View(analysis, run, names[0])
            if view.receiver.spectrum is not None:
                views.append(view)
    return max(views, key=lambda view: len(view.noise), default=None)


class _View:
    """One run at one receiver."""

    def __init__(self, analysis: Analysis, run: MeasuredRun, receiver: str) -> None:
        self.analysis, self.run = analysis, run
        self.receiver = analysis.result(run.name, receiver)
        self.kinematics = analysis.kinematics.get(run.name)
        self.noise: list[tuple[SourceLine, LineEvidence]] = [
            (source, evidence)
            for source in analysis.sources
            if (source.line.condition, source.line.channel) == (run.run.condition, receiver)
            for name, evidence in source.line.members
            if name == run.name
        ]
        self.limits = self._limits()

    def _limits(self) -> tuple[float, float]:
        assert self.receiver.spectrum is not None
        top = float(self.receiver.spectrum.frequencies_hz[-1])
        highest = max((evidence.line.frequency_hz for _, evidence in self.noise), default=0.0)
        if not highest:
            highest = MESH_HARMONICS * self.kinematics.mesh_hz if self.kinematics else self.receiver.level_band_hz[1]
        return LOWEST_HZ, max(2.0 * LOWEST_HZ, min(top, BEYOND * highest))

    def blocks(self) -> Sequence[Block]:
        figures = []
        for component in self._components():
            sensors = self._sensors(component)
            figures.append(self._sensor_figure(component, self._best(sensors), [sensor.channel for sensor in sensors]))
        figures.append(self._noise_figure())
        return [FigureBlock(figure, self.analysis.campaign.origin) for figure in figures]

    def _components(self) -> list[str]:
        radiators = [source.radiator for source, _ in self.noise if source.radiator not in (None, "both", "neither")]
        return [name for name in dict.fromkeys(["motor", "gearbox", *map(str, radiators)]) if self._sensors(name)]

    def _sensors(self, component: str) -> list[ChannelResult]:
        return [
            result
            for channel, result in measured_channels(self.run)
            if (channel.component, channel.quantity) == (component, "acceleration") and result.spectrum is not None
        ]

    def _best(self, sensors: Sequence[ChannelResult]) -> ChannelResult:
        """The sensor that shows most noise lines, and of several the one over whose floor they stand highest."""

        def shows(sensor: ChannelResult) -> tuple[int, float]:
            assert sensor.spectrum is not None
            shared = [line for line in sensor.lines if self._noise_line_at(line, sensor.spectrum) is not None]
            return len(shared), sum(line.prominence_db for line in shared)

        return max(sensors, key=shows)

    def _rules(self) -> list[Element]:
        if self.kinematics is None:
            return []
        marks = [(n, n * self.kinematics.mesh_hz) for n in range(1, MESH_HARMONICS + 1)]
        low, high = self.limits
        return [Rule(x, "mesh x1" if n == 1 else f"x{n}") for n, x in marks if low < x < high]

    def _trace(self, spectrum: Spectrum, name: str) -> list[Element]:
        kept = (spectrum.frequencies_hz >= 0.5 * LOWEST_HZ) & (spectrum.frequencies_hz <= 1.02 * self.limits[1])
        levels = density_levels(spectrum, spectrum.density)
        return [Line(spectrum.frequencies_hz[kept], levels[kept], name, color=7, width=1.0)]

    def _figure(
        self, what: str, heading: str, caption: str, result: ChannelResult, elements: Sequence[Element]
    ) -> Figure:
        assert result.spectrum is not None
        condition = self.run.run.condition or ""
        quantity = quantity_word(result.spectrum.quantity)
        return Figure(
            slug("beside", condition, what),
            f"{heading}: {quantity}, {result.channel}, {condition_words(self.analysis, condition)}",
            caption,
            Axis(say("Frequency"), "Hz", limits=self.limits),
            self._axis_of(result.spectrum),
            elements,
            height=330,
        )

    def _axis_of(self, spectrum: Spectrum) -> Axis:
        """The level axis with room for the names of lines and rules."""
        low, high = self.limits
        kept = (spectrum.frequencies_hz >= low) & (spectrum.frequencies_hz <= high)
        levels = density_levels(spectrum, spectrum.density)[kept]
        axis = level_axis(spectrum)
        if axis.log or not np.isfinite(levels).any():
            return axis
        bottom, top = float(np.nanmin(levels)), float(np.nanmax(levels))
        span = max(top - bottom, 1.0)
        return replace(axis, limits=(bottom - 0.05 * span, top + HEADROOM * span))

    def _noise_figure(self) -> Figure:
        result = self.receiver
        assert result.spectrum is not None
        elements = self._trace(result.spectrum, result.channel)
        for owner in dict.fromkeys([*OWNER_SLOTS, *(source.source for source, _ in self.noise)]):
            held = [(source, evidence.line) for source, evidence in self.noise if source.source == owner]
            if held:
                elements.append(
                    _markers(
                        [line for _, line in held],
                        "sound_pressure",
                        say("source {source}", source=source_word(owner)),
                        [_label(line, source.excitation_name) for source, line in held],
                        [_noise_words(source, line) for source, line in held],
                        OWNER_SLOTS.get(owner, OWNER_SLOT_OTHER),
                    )
                )
        known = {evidence.line.frequency_hz for _, evidence in self.noise}
        left = [line for line in result.lines if line.frequency_hz not in known]
        if left:
            labels = [say("{frequency:.0f} Hz left out", frequency=line.frequency_hz) for line in left]
            texts = [say("left out: see the exclusions")] * len(left)
            elements.append(_markers(left, "sound_pressure", say("left out"), labels, texts, 4, "x"))
        shown = say("Receiver {channel}, run {run}.", channel=result.channel, run=self.run.name)
        said = [shown, _spacing(result.spectrum), self._mesh_words()]
        caption = " ".join(text for text in said if text)
        return self._figure("noise", say("Noise"), caption, result, [*elements, *self._rules()])

    def _sensor_figure(self, component: str, result: ChannelResult, of: Sequence[str]) -> Figure:
        spectrum = result.spectrum
        assert spectrum is not None
        quantity = spectrum.quantity
        elements = self._trace(spectrum, result.channel)
        found = {line.frequency_hz: self._noise_line_at(line, spectrum) for line in result.lines}
        for owner in dict.fromkeys([*OWNER_SLOTS, *(source.source for source, _ in self.noise)]):
            shared = [
                (line, source)
                for line in result.lines
                if (source := found[line.frequency_hz]) is not None and source.source == owner
            ]
            if shared:
                labels = [_label(line, source.excitation_name) for line, source in shared]
                texts = [
                    say("{line}; at the noise line {frequency}", line=_line_words(line), frequency=_hz(source))
                    for line, source in shared
                ]
                slot = OWNER_SLOTS.get(owner, OWNER_SLOT_OTHER)
                lines = [line for line, _ in shared]
                name = say("noise line, source {source}", source=source_word(owner))
                elements.append(_markers(lines, quantity, name, labels, texts, slot))
        low, high = self.limits
        alone = [line for line in result.lines if found[line.frequency_hz] is None and low <= line.frequency_hz <= high]
        if alone:
            names = [self._order_name(line) for line in alone]
            loudest = sorted(range(len(alone)), key=lambda index: -alone[index].prominence_db)[:OTHER_NAMED]
            labels = [_label(alone[i], names[i]) if i in loudest else "" for i in range(len(alone))]
            unknown = say("no known order")
            texts = [f"{_line_words(line)}; {name or unknown}" for line, name in zip(alone, names, strict=True)]
            elements.append(_markers(alone, quantity, say("line, not in the noise"), labels, texts, 2, "diamond"))
        return self._figure(
            component,
            begun_large(source_word(component)),
            self._sensor_words(result, of, [_hz(source) for source, _ in self.noise if source not in found.values()]),
            result,
            [*elements, *self._rules()],
        )

    def _sensor_words(self, result: ChannelResult, of: Sequence[str], missing: Sequence[str]) -> str:
        """Which sensor of how many is drawn, and at which noise lines it has none."""
        run, channel = self.run.name, result.channel
        shown = (
            say("Sensor {channel} of {channels}, run {run}.", channel=channel, channels=joined(of), run=run)
            if len(of) > 1
            else say("Sensor {channel}, run {run}.", channel=channel, run=run)
        )
        if not missing:
            return shown
        lines = say_count(
            "No line is found here at the noise line {lines}.",
            "No line is found here at the noise lines {lines}.",
            len(missing),
            lines=joined(missing),
        )
        return f"{shown} {lines}"

    def _noise_line_at(self, line: SpectralLine, spectrum: Spectrum) -> SourceLine | None:
        """The noise line at the frequency of a sensor's line, within two lines of either spectrum."""
        assert self.receiver.spectrum is not None
        reach = 2.0 * max(spectrum.resolution_hz, self.receiver.spectrum.resolution_hz)
        near = [
            (abs(evidence.line.frequency_hz - line.frequency_hz), source)
            for source, evidence in self.noise
            if abs(evidence.line.frequency_hz - line.frequency_hz) <= reach
        ]
        return min(near, key=lambda pair: pair[0])[1] if near else None

    def _order_name(self, line: SpectralLine) -> str | None:
        if self.kinematics is None:
            return None
        match, _ = owner_of(line.frequency_hz, line.frequency_error_hz, self.kinematics.expected)
        return None if match is None else match.expected.name

    def _mesh_words(self) -> str:
        if self.kinematics is None:
            return ""
        mesh = self.kinematics.mesh_hz
        if self.kinematics.motor_hz_stated is not None:
            return say("Mesh calculated from the stated speed: {frequency:.1f} Hz.", frequency=mesh)
        return say("Mesh calculated from the recorded speed: {frequency:.1f} Hz.", frequency=mesh)


def _markers(
    lines: Sequence[SpectralLine],
    quantity: str,
    name: str,
    labels: Sequence[str],
    texts: Sequence[str],
    slot: int,
    symbol: Symbol = "circle",
) -> Markers:
    levels = [level_db(line.rms, quantity) for line in lines]
    y = [line.rms if level is None else level for line, level in zip(lines, levels, strict=True)]
    x = np.array([line.frequency_hz for line in lines])
    return Markers(x, np.array(y), name, labels, texts, symbol, color=slot)


def _label(line: SpectralLine, name: str | None) -> str:
    return f"{line.frequency_hz:.0f} Hz {name or '?'}"


def _hz(source: SourceLine) -> str:
    return f"{source.line.frequency_hz:.0f} Hz"


def _line_words(line: SpectralLine) -> str:
    return say(
        "{frequency:.1f} Hz, {prominence:.0f} dB over the floor",
        frequency=line.frequency_hz,
        prominence=line.prominence_db,
    )


def _noise_words(source: SourceLine, line: SpectralLine) -> str:
    prominence = source.line.component_prominence_db().items()
    sensors = [
        f"{source_word(name)} {level:.0f} dB"
        if math.isfinite(level)
        else say("{component} no trace", component=source_word(name))
        for name, level in prominence
    ]
    words = [
        _line_words(line),
        source.excitation_name or say("no known order"),
        say("source {source}", source=source_word(source.source)),
    ]
    if sensors:
        words.append(say("over the floor of the sensors: {sensors}", sensors=", ".join(sensors)))
    return "\n".join([*words, *([say("conflict")] if source.conflict else [])])


def _spacing(spectrum: Spectrum) -> str:
    return say("Line spacing {spacing:.3g} Hz.", spacing=spectrum.resolution_hz)

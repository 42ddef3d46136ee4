"""What was done to the recordings, told from the results themselves: frames, windows, averages, bands, angles."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any, Final

from tdacoustic.measured.order_pass import LINES_A_BANDWIDTH
from tdacoustic.measured.runs import MeasuredRun
from tdacoustic.reporting.document import Block, Column, Paragraph, Section, Table
from tdacoustic.reporting.language import say
from tdacoustic.reporting.sections.folding import few
from tdacoustic.reporting.sections.words import SHAFT_WORDS, measured_channels, tested_runs
from tdacoustic.reporting.shown import range_text
from tdacoustic.results import Analysis

__all__ = ["method_of_measurement"]

WINDOW: Final = "Hann"
"""Of all spectra (`tdacoustic.spectra`, `tdacoustic.orders`)."""
HALF: Final = 50.0
"""Overlap of the frames of audible tones and of maps over frequency, %."""
TURNS_OVERLAP: Final = 75.0
"""Overlap of frames over a shaft's angle, %."""
MOST_NAMED: Final = 8
"""Runs and channels named one by one."""

Row = tuple[str | float | None, ...]


def method_of_measurement(analysis: Analysis) -> list[Block]:
    """Return the section on what was done to the recordings; nothing where none was measured.

    Parameters
    ----------
    analysis : Analysis
    """
    blocks = [*_spectra(analysis), *_other_spectra(analysis), *_orders(analysis)]
    return [Section("method", say("What was done to the recordings"), blocks)] if blocks else []


def _spectra(analysis: Analysis) -> list[Block]:
    found = _alike((of, row) for run in tested_runs(analysis) for of, row in _frames(run))
    if not found:
        return []
    columns = (
        Column("window", say("Window")),
        Column("frame_s", say("Frame"), "s", 3, "number"),
        Column("resolution_hz", say("Line spacing"), "Hz", 3, "number"),
        Column("noise_bandwidth_hz", say("Noise bandwidth"), "Hz", 3, "number"),
        Column("averages", say("Independent averages"), "", 1, "number"),
        Column("band_hz", say("Level band"), "Hz"),
        Column("sample_rate_hz", say("Sampling rate"), "Hz", 0, "number"),
        Column("of", say("Runs and channels")),
    )
    overlap = analysis.settings.get("analysis.overlap")
    caption = (
        say("Averaged spectra as they were made; frames overlap by {overlap:.3g} %.", overlap=100.0 * overlap)
        if isinstance(overlap, int | float)
        else say("Averaged spectra as they were made.")
    )
    return [Table("spectra-as-made", caption, columns, [(*row, of) for row, of in found])]


def _frames(run: MeasuredRun) -> Iterator[tuple[tuple[str, str], Row]]:
    for channel, result in measured_channels(run):
        spectrum = result.spectrum
        if spectrum is not None:
            lowest, highest = (f"{limit:.6g}" for limit in result.level_band_hz)
            yield (
                (run.name, channel.name),
                (
                    WINDOW,
                    spectrum.duration_s,
                    spectrum.resolution_hz,
                    spectrum.noise_bandwidth_hz,
                    round(spectrum.averages, 1),
                    range_text(lowest, highest),
                    channel.sample_rate_hz,
                ),
            )


def _other_spectra(analysis: Analysis) -> list[Block]:
    """Frames of all that is not read from the averaged spectra."""
    rows: dict[Row, list[str]] = {}
    for run, row in (*_over_time(analysis), *_crossed(analysis), *_heard(analysis), *_mapped(analysis)):
        rows.setdefault(row, []).append(run)
    if not rows:
        return []
    columns = (
        Column("analysis", say("Of")),
        Column("runs", say("Runs")),
        Column("window", say("Window")),
        Column("frame_s", say("Frame"), "s", 3, "number"),
        Column("resolution_hz", say("Line spacing"), "Hz", 3, "number"),
        Column("overlap_percent", say("Overlap"), "%", 0, "number"),
        Column("averaging", say("Averaged")),
    )
    caption = say("Frames of the other spectra; those in steps of a shaft's angle are told below")
    told = [(row[0], few(runs, MOST_NAMED), *row[1:]) for row, runs in rows.items()]
    return [Table("other-spectra-as-made", caption, columns, told)]


def _asked(analysis: Analysis, step: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """The settings of a step, by run."""
    runs = {f"run {run.name}": run.name for run in analysis.runs}
    for _, record in analysis.records:
        if record.step == step and record.label in runs:
            yield runs[record.label], json.loads(record.settings)["fields"]


def _over_time(analysis: Analysis) -> Iterator[tuple[str, Row]]:
    """Runs whose spectra are shown over time and not averaged."""
    shown = {run.name for run in analysis.runs if any(found.map is not None for _, found in measured_channels(run))}
    for run, settings in _asked(analysis, "survey"):
        if run in shown:
            frames = settings["frames"]["fields"]
            spacing = max(frames["resolution_hz"], frames["run_up_resolution_hz"])
            averaged = say("in segments, one after the other")
            yield run, (say("spectra over time"), *_framed(spacing, 100.0 * frames["overlap"]), averaged)


def _crossed(analysis: Analysis) -> Iterator[tuple[str, Row]]:
    for run, settings in _asked(analysis, "cross spectra"):
        averaged = say("in {count} segments at most, from whose scatter intervals come", count=settings["max_segments"])
        framed = _framed(settings["resolution_hz"], 100.0 * settings["overlap"])
        yield run, (say("cross spectra, for coherence and contributions"), *framed, averaged)


def _heard(analysis: Analysis) -> Iterator[tuple[str, Row]]:
    for run, hearing in ({} if analysis.tonality is None else analysis.tonality.hearing).items():
        for found in {(one.line_spacing_hz, one.averaging_s): one for one in hearing.audibility}.values():
            averaged = say("over stretches of {seconds:.3g} s each", seconds=found.averaging_s)
            yield run, (say("audible tones"), *_framed(found.line_spacing_hz, HALF), averaged)


def _mapped(analysis: Analysis) -> Iterator[tuple[str, Row]]:
    for run, orders in analysis.orders.items():
        spacings = {held.resolution for one in orders.channels for held in one.maps if held.domain == "frequency"}
        for spacing in sorted(spacings):
            averaged = say("over classes of speed")
            yield run, (say("maps over frequency and speed"), *_framed(spacing, HALF), averaged)


def _framed(spacing_hz: float, overlap_percent: float) -> tuple[str, float, float, float]:
    """Window, length, line spacing and overlap of frames."""
    return WINDOW, 1.0 / spacing_hz, spacing_hz, overlap_percent


def _orders(analysis: Analysis) -> list[Block]:
    """How the angle was told, and in what steps."""
    rows: list[Row] = [
        (
            name,
            say(SHAFT_WORDS.get(found.shaft, found.shaft)) if found.shaft else say("not named"),
            found.speed_source,
            60.0 * found.lowest_hz,
            60.0 * found.highest_hz,
            found.bandwidth,
            found.highest_order,
        )
        for name, found in analysis.orders.items()
    ]
    if not rows:
        return []
    columns = (
        Column("run", say("Run")),
        Column("shaft", say("Angle of the shaft")),
        Column("speed_source", say("Told by")),
        Column("lowest_rpm", say("Slowest"), "rpm", 1, "number"),
        Column("highest_rpm", say("Fastest"), "rpm", 1, "number"),
        Column("bandwidth", say("Bandwidth"), say("orders"), 3, "number"),
        Column("highest_order", say("Highest order"), "", 1, "number"),
    )
    text = say(
        "Orders are cut from the signals resampled to even steps of a shaft's angle: {window} frames that overlap by "
        "{overlap:.3g} %, {count:.3g} lines a bandwidth (fewer where the run has too few turns), averaged over each "
        "class of speed, or over the whole of a run of constant speed.",
        window=WINDOW,
        overlap=TURNS_OVERLAP,
        count=LINES_A_BANDWIDTH,
    )
    return [Paragraph(text), Table("orders-as-made", say("Orders as they were cut"), columns, rows)]


def _alike(items: Iterator[tuple[tuple[str, str], Row]]) -> list[tuple[Row, str]]:
    """Gather what was done alike: each way with the runs and channels it was done to."""
    held: dict[Row, dict[str, list[str]]] = {}
    for (run, channel), row in items:
        held.setdefault(row, {}).setdefault(run, []).append(channel)
    return [(row, _named(runs)) for row, runs in held.items()]


def _named(runs: dict[str, list[str]]) -> str:
    by_channels: dict[tuple[str, ...], list[str]] = {}
    for run, channels in runs.items():
        by_channels.setdefault(tuple(channels), []).append(run)
    return "; ".join(
        say("run {runs}: {channels}", runs=few(names, MOST_NAMED), channels=few(channels, MOST_NAMED))
        for channels, names in by_channels.items()
    )

"""What was done to the recordings, told from the results themselves: frames, windows, averages, bands, angles."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from tdacoustic.measured.runs import MeasuredRun
from tdacoustic.reporting.document import Block, Column, Paragraph, Section, Table
from tdacoustic.reporting.language import say
from tdacoustic.reporting.sections.folding import few
from tdacoustic.reporting.sections.words import SHAFT_WORDS, measured_channels, tested_runs
from tdacoustic.reporting.shown import range_text
from tdacoustic.results import Analysis

__all__ = ["method_of_measurement"]

WINDOW: Final = "Hann"
"""Of all averaged spectra (`tdacoustic.spectra`)."""
MOST_NAMED: Final = 8
"""Runs and channels named one by one."""

Row = tuple[str | float | None, ...]


def method_of_measurement(analysis: Analysis) -> list[Block]:
    """Return the section on what was done to the recordings; nothing where none was measured.

    Parameters
    ----------
    analysis : Analysis
    """
    blocks = [*_spectra(analysis), *_orders(analysis)]
    return [Section("method", say("What was done to the recordings"), blocks)] if blocks else []


def _spectra(analysis: Analysis) -> list[Block]:
    found = _alike((of, row) for run in tested_runs(analysis) for of, row in _frames(run))
    if not found:
        return []
    columns = (
        Column("of", say("Runs and channels")),
        Column("sample_rate_hz", say("Sampling rate"), "Hz", 0, "number"),
        Column("window", say("Window")),
        Column("frame_s", say("Frame"), "s", 3, "number"),
        Column("resolution_hz", say("Line spacing"), "Hz", 3, "number"),
        Column("noise_bandwidth_hz", say("Noise bandwidth"), "Hz", 3, "number"),
        Column("averages", say("Independent averages"), "", 1, "number"),
        Column("band_hz", say("Level band"), "Hz"),
    )
    overlap = analysis.settings.get("analysis.overlap")
    caption = (
        say("Averaged spectra as they were made; frames overlap by {overlap:.3g} %.", overlap=100.0 * overlap)
        if isinstance(overlap, int | float)
        else say("Averaged spectra as they were made.")
    )
    return [Table("spectra-as-made", caption, columns, [(of, *row) for row, of in found])]


def _frames(run: MeasuredRun) -> Iterator[tuple[tuple[str, str], Row]]:
    for channel, result in measured_channels(run):
        spectrum = result.spectrum
        if spectrum is not None:
            lowest, highest = (f"{limit:.6g}" for limit in result.level_band_hz)
            yield (
                (run.name, channel.name),
                (
                    channel.sample_rate_hz,
                    WINDOW,
                    spectrum.duration_s,
                    spectrum.resolution_hz,
                    spectrum.noise_bandwidth_hz,
                    round(spectrum.averages, 1),
                    range_text(lowest, highest),
                ),
            )


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
    text = say("Orders are cut from the signals resampled to even steps of a shaft's angle.")
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

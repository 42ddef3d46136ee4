"""Levels and third octaves."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping
from typing import Any

import numpy as np

from tdacoustic.measured.runs import receivers
from tdacoustic.reporting.document import Block, Column, Details, FigureBlock, Paragraph, Section, Table
from tdacoustic.reporting.figure import Axis, Bars, Figure, Line, Markers
from tdacoustic.reporting.language import say, say_count
from tdacoustic.reporting.sections.words import measured_channels, pretty_unit, quantity_word, slug, tested_runs
from tdacoustic.results import Analysis
from tdacoustic.units import REFERENCES, level_db, reference_label

__all__ = ["levels"]


def levels(analysis: Analysis) -> Section:
    """Return the section on levels and third octaves."""
    blocks: list[Block] = []
    figure = _overview(analysis)
    if figure is not None:
        blocks.append(FigureBlock(figure, analysis.campaign.origin))
    blocks.append(_table(analysis))
    blocks.append(
        Paragraph(
            say(
                "The rms is of the whole record after its mean is removed; the level is that rms, corrected for "
                "background where background runs exist, and so are the A-weighted level and that in the band, each "
                "by its own; rms and third octaves are as recorded. The A-weighted level applies the analytic curve "
                "of IEC 61672-1 to the spectrum. The level in the band leaves out what lies outside the band "
                "given beside it."
            )
        )
    )
    blocks.append(Paragraph(_uncertainty_words(analysis)))
    blocks += _bands(analysis)
    return Section("levels", say("Levels"), blocks)


def _uncertainty_words(analysis: Analysis) -> str:
    """How sure a level of sound pressure is: instruments, and runs of the same condition."""
    stated = "level_sigma_db" in analysis.campaign.calibration.model_fields_set
    values = {"sigma": analysis.campaign.calibration.level_sigma_db}
    instruments = (
        say(
            "Instruments and their calibration leave ± {sigma:.2g} dB (1 σ) open in a sound pressure level, by "
            "level_sigma_db in [calibration] of the campaign.",
            **values,
        )
        if stated
        else say(
            "Instruments and their calibration are assumed to leave ± {sigma:.2g} dB (1 σ) open in a sound pressure "
            "level; level_sigma_db in [calibration] of the campaign would state it.",
            **values,
        )
    )
    if not _spreads(analysis):
        once = say("No condition was run twice, so how well its level repeats is not known.")
        return f"{instruments} {once}"
    runs = say("How far the runs of a condition lie apart at a channel stands in the table.")
    return f"{instruments} {runs}"


def _spreads(analysis: Analysis) -> dict[tuple[str, str], float]:
    """Largest less smallest level by condition and channel, where there are several runs."""
    table = analysis.tables["levels"]
    held = table[table["level_db"].notna() & table["condition"].notna()].groupby(["condition", "channel"])["level_db"]
    return {(str(c), str(n)): float(own.max() - own.min()) for (c, n), own in held if len(own) > 1}


def _overview(analysis: Analysis) -> Figure | None:
    table = analysis.tables["levels"]
    table = table[(table["quantity"] == "sound_pressure")]
    microphones = receivers(analysis.runs) or tuple(dict.fromkeys(table["channel"]))
    runs = list(dict.fromkeys(table["run"]))
    if len(runs) < 2 or not microphones or table["level_db"].isna().all():
        return None
    bars = []
    for name in microphones:
        held = table[table["channel"] == name].set_index("run")
        bars.append(Bars(runs, np.array([held["level_db"].get(run, np.nan) for run in runs]), name))
    return Figure(
        "sound-pressure-levels",
        say("Sound pressure level by run"),
        say("Unweighted level of the whole run, corrected for background where that was recorded."),
        Axis(say("Run")),
        Axis(say("Sound pressure level"), "dB", reference="20 µPa"),
        bars,
        height=320,
    )


def _table(analysis: Analysis) -> Table:
    table = analysis.tables["levels"]
    with_background = bool(table["background_db"].notna().any())
    bands = {_band_words(row) for row in table.to_dict("records")} - {""}
    columns = [
        Column("run", say("Run")),
        Column("channel", say("Channel")),
        Column("quantity", say("Quantity")),
        Column("rms", say("rms"), say("SI"), 4, "number"),
        Column("si_unit", say("Unit")),
        Column("level_db", say("Level"), "dB", 1, "number"),
        Column("laeq_db", say("A-weighted"), "dB(A)", 1, "number"),
        Column("level_band_db", say("In the band"), "dB", 1, "number"),
    ]
    spreads = _spreads(analysis)
    if spreads:
        columns.append(Column("spread_db", say("Runs apart"), "dB", 1, "number"))
    if len(bands) > 1:
        columns.append(Column("band", say("Band")))
    if (table["calibration"] == "doubtful").any():
        columns.append(Column("calibration", say("Calibrators")))
    if with_background:
        columns += [
            Column("background_db", say("Background"), "dB", 1, "number"),
            Column("correction", say("Correction")),
        ]
    records = [
        {**row, "spread_db": spreads.get((str(row["condition"]), str(row["channel"])))}
        for row in table.to_dict("records")
    ]
    rows = [[_cell(row, column) for column in columns] for row in records]
    of = [say("sound pressure re 20 µPa, acceleration re 1 µm/s²")]
    of += [say("the band is {band}", band=band) for band in bands] if len(bands) == 1 else []
    return Table(
        "levels",
        say("Levels ({details})", details="; ".join(of)),
        columns,
        rows,
        origin=analysis.campaign.origin,
    )


def _band_words(row: Mapping[Hashable, Any]) -> str:
    if math.isnan(row["level_band_from_hz"]):
        return ""
    return say("{lowest:.4g} to {highest:.5g} Hz", lowest=row["level_band_from_hz"], highest=row["level_band_to_hz"])


def _cell(row: Mapping[Hashable, Any], column: Column) -> Any:
    if column.key == "band":
        return _band_words(row)
    value = row[column.key]
    if column.kind == "number":
        return value
    words = value if isinstance(value, str) else ""
    if column.key == "si_unit":
        return pretty_unit(words)
    return quantity_word(words) if column.key == "quantity" else words


def _bands(analysis: Analysis) -> list[Block]:
    """One figure a channel, all runs in it: microphones in sight, the rest folded away."""
    by_channel: dict[str, list[Line | Markers]] = {}
    quantities: dict[str, str] = {}
    for run in tested_runs(analysis):
        for channel, result in measured_channels(run):
            if not result.bands or channel.quantity not in REFERENCES:
                continue
            x = np.array([band.nominal_hz for band in result.bands])
            found = [level_db(math.sqrt(band.mean_square), channel.quantity) for band in result.bands]
            y = np.array([np.nan if level is None else level for level in found])
            slot = len([e for e in by_channel.get(channel.name, []) if isinstance(e, Line)]) % 8
            elements = by_channel.setdefault(channel.name, [])
            elements.append(Line(x, y, say("run {run}", run=run.name), style="steps", color=slot))
            doubtful = [index for index, band in enumerate(result.bands) if band.filter_dependent]
            if doubtful:
                elements.append(
                    Markers(
                        x[doubtful],
                        y[doubtful],
                        say("run {run}: depends on the filter", run=run.name),
                        symbol="x",
                        color=slot,
                    )
                )
            quantities[channel.name] = channel.quantity
    figures = {
        name: FigureBlock(_band_figure(name, quantities[name], elements), analysis.campaign.origin)
        for name, elements in by_channel.items()
    }
    near = [figures[name] for name in figures if quantities[name] == "sound_pressure"]
    far = [figures[name] for name in figures if quantities[name] != "sound_pressure"]
    blocks: list[Block] = [*near]
    if far:
        folded = say_count(
            "Third octaves of {count} vibration channel", "Third octaves of {count} vibration channels", len(far)
        )
        blocks.append(Details(folded, far))
    return [Section("third-octaves", say("Third octaves"), blocks)] if blocks else []


def _band_figure(name: str, quantity: str, elements: list[Line | Markers]) -> Figure:
    label = say("Sound pressure level") if quantity == "sound_pressure" else say("Acceleration level")
    return Figure(
        slug("bands", name),
        say("Third-octave levels, {channel}", channel=name),
        say(
            "Class-1 filters (IEC 61260-1). A cross marks a band within three bands of a line that is more than 15 dB "
            "stronger: its level depends on the skirts of the filter, and another analyser may show several dB more or "
            "less."
        ),
        Axis(say("Frequency"), "Hz", "log"),
        Axis(label, "dB", reference=pretty_unit(reference_label(quantity) or ""), note=say("in third octaves")),
        elements,
        height=360,
    )

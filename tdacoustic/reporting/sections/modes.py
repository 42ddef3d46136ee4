"""What comes and goes with the torque: traction, braking and coasting at one speed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from tdacoustic.attribution.mode_comparison import SpeedModes
from tdacoustic.contributions import ModePart
from tdacoustic.reporting.document import (
    Block,
    Column,
    Details,
    FigureBlock,
    Notice,
    Paragraph,
    Section,
    Sentences,
    Table,
)
from tdacoustic.reporting.figure import Axis, Bars, Figure
from tdacoustic.reporting.sections.words import joined, slug
from tdacoustic.results import Analysis
from tdacoustic.tables.contributions import power_db

__all__ = ["modes"]

IN_SIGHT: Final = 4
METHOD = (
    "At one speed wheel and rail, fans on the shaft and windage go on while the drive coasts; the motor's forces, the "
    "inverter and the load of the teeth do not. What traction or braking adds to coasting is the part of the torque. "
    "It takes in blowers that follow the load and, in braking, friction brakes; energies are taken to add."
)


def modes(analysis: Analysis) -> Section | None:
    """Return the section on modes; None where no runs could be compared."""
    if analysis.modes is None:
        return None
    if not analysis.modes:
        text = "The campaign has loaded runs and coasting or hauled ones, but no speed that both went through."
        return Section("modes", "What comes and goes with the torque", [Notice("info", text)])
    compared = [item for item in analysis.modes if item.comparison is not None]
    first = analysis.modes[0].channel
    blocks: list[Block] = [Sentences([_sentence(item) for item in analysis.modes if item.channel == first])]
    figures: list[Block] = [
        FigureBlock(_figure(item), analysis.campaign.origin) for item in compared if item.channel == first
    ]
    blocks += figures if len(figures) <= IN_SIGHT else [Details(f"Bands at {len(figures)} speeds", figures)]
    blocks.append(_table(analysis, compared))
    doubts = list(dict.fromkeys(d for item in compared if item.comparison is not None for d in item.comparison.doubts))
    blocks += [Sentences([f"{doubt[0].upper()}{doubt[1:]}." for doubt in doubts])] if doubts else []
    return Section("modes", "What comes and goes with the torque", [*blocks, Paragraph(METHOD)])


def _speed_words(item: SpeedModes) -> str:
    return f"{item.speed:.3g} km/h" if item.unit == "km/h" else f"motor {60.0 * item.speed:.4g} rpm"


def _sentence(item: SpeedModes) -> str:
    held = f"{_speed_words(item)} at {item.channel}"
    if item.comparison is None:
        return f"{held}: not compared, {item.reason}."
    said = []
    for part in _totals(item.comparison.parts):
        loaded, free = power_db(part.mean_square), power_db(part.speed_part)
        levels = "" if loaded is None or free is None else f"{loaded:.1f} dB against {free:.1f} dB without torque; "
        said.append(f"{part.mode} {levels}{part.words}")
    return f"{held}: {'. '.join(f'{text[0].upper()}{text[1:]}' if n else text for n, text in enumerate(said))}."


def _totals(parts: Sequence[ModePart]) -> list[ModePart]:
    return [part for part in parts if part.band == "total"]


def _figure(item: SpeedModes) -> Figure:
    """Levels in bands, of each loaded mode and without torque."""
    assert item.comparison is not None
    parts = [part for part in item.comparison.parts if part.band != "total"]
    bands = list(dict.fromkeys(part.band for part in parts))
    loaded = list(dict.fromkeys(part.mode for part in parts))
    of_first = {part.band: part for part in parts if part.mode == loaded[0]}
    bars = [Bars(bands, _levels([of_first[band].speed_part for band in bands]), "without torque", color=7)]
    for number, mode in enumerate(loaded):
        held = {part.band: part for part in parts if part.mode == mode}
        bars.append(Bars(bands, _levels([held[band].mean_square for band in bands]), mode, color=number))
    runs = joined([f"{mode} {run}" for mode, run in item.runs])
    return Figure(
        slug("modes", item.channel, f"{item.speed:.4g}"),
        f"Bands with and without torque at {_speed_words(item)}, {item.channel}",
        f"Runs: {runs}. A bar that stands 3 dB over the grey one owes half of its power to the torque.",
        Axis("Band"),
        Axis("Sound pressure level", "dB", reference="20 µPa", limits=_limits(bars)),
        bars,
        height=340,
    )


def _levels(powers: Sequence[float]) -> np.ndarray:
    return np.array([power_db(power) for power in powers], dtype=np.float64)


def _limits(bars: Sequence[Bars]) -> tuple[float, float]:
    values = np.concatenate([bar.values for bar in bars])
    values = values[np.isfinite(values)]
    return (float(values.min()) - 6.0, float(values.max()) + 3.0) if values.size else (0.0, 1.0)


def _table(analysis: Analysis, compared: Sequence[SpeedModes]) -> Table:
    columns = (
        Column("speed", "Speed", align="right"),
        Column("channel", "Microphone"),
        Column("band", "Band"),
        Column("mode", "Mode"),
        Column("level_db", "Level", "dB", 1, "number"),
        Column("free_db", "Without torque", "dB", 1, "number"),
        Column("share", "Of the torque", "%", 0, "number"),
        Column("interval", "", "95 %", align="right"),
        Column("depends_on", "Depends on", kind="verdict"),
    )
    rows = []
    for item in compared:
        assert item.comparison is not None
        for part in sorted(item.comparison.parts, key=lambda part: part.band != "total"):
            rows.append(
                (
                    _speed_words(item),
                    item.channel,
                    "all" if part.band == "total" else part.band,
                    part.mode,
                    power_db(part.mean_square),
                    power_db(part.speed_part),
                    100.0 * part.torque_share,
                    f"{100.0 * part.share_low:.0f} to {100.0 * part.share_high:.0f}",
                    part.depends_on,
                )
            )
    title = "What comes and goes with the torque (levels re 20 µPa)"
    return Table("modes", title, columns, rows, origin=analysis.campaign.origin)

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
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.folding import in_sight
from tdacoustic.reporting.sections.words import joined, slug
from tdacoustic.results import Analysis
from tdacoustic.tables.contributions import power_db

__all__ = ["modes"]

IN_SIGHT: Final = 4
"""Speeds whose sentences and figures stand in sight."""
NAMED_BANDS: Final = 4
VERDICTS: Final = {
    "torque": mark("most of it depends on the torque"),
    "speed": mark("most of it is there without torque"),
    "undecided": mark("not decided"),
}
METHOD = mark(
    "At one speed wheel and rail, fans on the shaft and windage go on while the drive coasts; the motor's forces, the "
    "inverter and the load of the teeth do not. What traction or braking adds to coasting is the part of the torque. "
    "It takes in blowers that follow the load and, in braking, friction brakes; energies are taken to add."
)


def modes(analysis: Analysis) -> Section | None:
    """Return the section on modes; None where no runs could be compared."""
    if analysis.modes is None:
        return None
    if not analysis.modes:
        text = say("The campaign has loaded runs and coasting or hauled ones, but no speed that both went through.")
        return Section("modes", say("What comes and goes with the torque"), [Notice("info", text)])
    compared = [item for item in analysis.modes if item.comparison is not None]
    first = analysis.modes[0].channel
    blocks: list[Block] = _answer([item for item in analysis.modes if item.channel == first])
    figures: list[Block] = [
        FigureBlock(_figure(item), analysis.campaign.origin) for item in compared if item.channel == first
    ]
    blocks += (
        figures
        if len(figures) <= IN_SIGHT
        else [Details(say("Bands at {n_figures} speeds", n_figures=len(figures)), figures)]
    )
    blocks.append(in_sight(_table(analysis, compared, of_bands=False), say("All bands together")))
    of_bands = _table(analysis, compared, of_bands=True)
    blocks.append(Details(say("Band by band, {n_rows} rows", n_rows=len(of_bands.rows)), [of_bands]))
    doubts = list(dict.fromkeys(d for item in compared if item.comparison is not None for d in item.comparison.doubts))
    blocks += [Sentences([f"{doubt[0].upper()}{doubt[1:]}." for doubt in doubts])] if doubts else []
    return Section("modes", say("What comes and goes with the torque"), [*blocks, Paragraph(say(METHOD))])


def _speed_words(item: SpeedModes) -> str:
    return f"{item.speed:.3g} km/h" if item.unit == "km/h" else say("motor {speed:.4g} rpm", speed=60.0 * item.speed)


def _answer(items: Sequence[SpeedModes]) -> list[Block]:
    """A sentence a speed, those of run-ups, which are many and short, folded away."""
    sentences = [_sentence(item) for item in items]
    if len(sentences) <= IN_SIGHT:
        return [Sentences(sentences)]
    said = [sentence for mode in _modes(items) for sentence in _over_speeds(items, mode)]
    return [
        Sentences(said),
        Details(say("Speed by speed, {n_sentences} sentences", n_sentences=len(sentences)), [Sentences(sentences)]),
    ]


def _modes(items: Sequence[SpeedModes]) -> list[str]:
    return list(dict.fromkeys(part.mode for item in items if item.comparison for part in item.comparison.parts))


def _over_speeds(items: Sequence[SpeedModes], mode: str) -> list[str]:
    """One mode over all speeds: what its whole sound depends on, and which bands."""
    held = [(item, _of_mode(item, mode)) for item in items if _of_mode(item, mode)]
    found: dict[str, list[tuple[SpeedModes, ModePart]]] = {}
    for item, parts in held:
        for part in _totals(parts):
            found.setdefault(part.depends_on, []).append((item, part))
    said = []
    for depends_on, group in found.items():
        shares = [part.torque_share for _, part in group]
        ends = [_speed_words(item) for item, _ in (group[0], group[-1])]
        where = (
            say("at {ends}", ends=ends[0])
            if len(group) == 1
            else say("at {n_group} speeds, {ends} to {ends_2}", n_group=len(group), ends=ends[0], ends_2=ends[1])
        )
        share = " to ".join(dict.fromkeys(f"{100.0 * end:.0f}" for end in (min(shares), max(shares))))
        verdict = say(VERDICTS.get(depends_on, depends_on))
        said.append(
            say(
                "{mode} at {channel}, {where}: {verdict}, {share} % of the sound comes with the torque",
                mode=mode,
                channel=held[0][0].channel,
                where=where,
                verdict=verdict,
                share=share,
            )
        )
    bands: dict[str, int] = {}
    for _, parts in held:
        for part in parts:
            if part.band != "total" and part.depends_on == "torque":
                bands[part.band] = bands.get(part.band, 0) + 1
    often = [
        say("{band} at {count}", band=band, count=count)
        for band, count in sorted(bands.items(), key=lambda entry: -entry[1])[:NAMED_BANDS]
    ]
    end = (
        say("; most of the band comes with it in {often} of {n_held} speeds", often=joined(often), n_held=len(held))
        if often
        else ""
    )
    return [f"{text[0].upper()}{text[1:]}{end if n == 0 else ''}." for n, text in enumerate(said)]


def _of_mode(item: SpeedModes, mode: str) -> list[ModePart]:
    return [] if item.comparison is None else [part for part in item.comparison.parts if part.mode == mode]


def _sentence(item: SpeedModes) -> str:
    held = say("{speed} at {channel}", speed=_speed_words(item), channel=item.channel)
    if item.comparison is None:
        return say("{held}: not compared, {reason}.", held=held, reason=item.reason)
    said = []
    for part in _totals(item.comparison.parts):
        loaded, free = power_db(part.mean_square), power_db(part.speed_part)
        levels = (
            ""
            if loaded is None or free is None
            else say("{loaded:.1f} dB against {free:.1f} dB without torque; ", loaded=loaded, free=free)
        )
        own = [p.band for p in _of_mode(item, part.mode) if p.band != "total" and p.depends_on == "torque"]
        bands = (
            say("; most of it in the band{value} {own}", value="s" if len(own) > 1 else "", own=joined(own))
            if own
            else ""
        )
        said.append(f"{part.mode} {levels}{part.words}{bands}")
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
    bars = [Bars(bands, _levels([of_first[band].speed_part for band in bands]), say("without torque"), color=7)]
    for number, mode in enumerate(loaded):
        held = {part.band: part for part in parts if part.mode == mode}
        bars.append(Bars(bands, _levels([held[band].mean_square for band in bands]), mode, color=number))
    runs = joined([f"{mode} {run}" for mode, run in item.runs])
    return Figure(
        slug("modes", item.channel, f"{item.speed:.4g}"),
        say("Bands with and without torque at {speed}, {channel}", speed=_speed_words(item), channel=item.channel),
        say("Runs: {runs}. A bar that stands 3 dB over the grey one owes half of its power to the torque.", runs=runs),
        Axis(say("Band")),
        Axis(say("Sound pressure level"), "dB", reference="20 µPa", limits=_limits(bars)),
        bars,
        height=340,
    )


def _levels(powers: Sequence[float]) -> np.ndarray:
    return np.array([power_db(power) for power in powers], dtype=np.float64)


def _limits(bars: Sequence[Bars]) -> tuple[float, float]:
    values = np.concatenate([bar.values for bar in bars])
    values = values[np.isfinite(values)]
    return (float(values.min()) - 6.0, float(values.max()) + 3.0) if values.size else (0.0, 1.0)


def _table(analysis: Analysis, compared: Sequence[SpeedModes], of_bands: bool) -> Table:
    columns = (
        Column("speed", say("Speed"), align="right"),
        Column("channel", say("Microphone")),
        Column("band", say("Band")),
        Column("mode", say("Mode")),
        Column("level_db", say("Level"), "dB", 1, "number"),
        Column("free_db", say("Without torque"), "dB", 1, "number"),
        Column("share", say("Of the torque"), "%", 0, "number"),
        Column("interval", "", "95 %", align="right"),
        Column("depends_on", say("Depends on"), kind="verdict"),
    )
    rows = []
    for item in compared:
        assert item.comparison is not None
        for part in item.comparison.parts:
            if (part.band != "total") != of_bands:
                continue
            rows.append(
                (
                    _speed_words(item),
                    item.channel,
                    "all" if part.band == "total" else part.band,
                    part.mode,
                    power_db(part.mean_square),
                    power_db(part.speed_part),
                    100.0 * part.torque_share,
                    say(
                        "{share_low:.0f} to {share_high:.0f}",
                        share_low=100.0 * part.share_low,
                        share_high=100.0 * part.share_high,
                    ),
                    part.depends_on,
                )
            )
    title = say(
        "What comes and goes with the torque{value} (levels re 20 µPa)", value=say(", band by band") if of_bands else ""
    )
    return Table("modes-of-bands" if of_bands else "modes", title, columns, rows, origin=analysis.campaign.origin)

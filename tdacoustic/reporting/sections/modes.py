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
from tdacoustic.reporting.language import mark, say, say_count
from tdacoustic.reporting.sections.folding import in_sight, rows_words
from tdacoustic.reporting.sections.words import joined, slug
from tdacoustic.reporting.shown import range_text
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
MODE_WORDS: Final = {
    "traction": mark("traction"),
    "brake": mark("brake"),
    "coast": mark("coast"),
    "hauled": mark("hauled"),
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
        else [Details(say_count("Bands at {count} speed", "Bands at {count} speeds", len(figures)), figures)]
    )
    blocks.append(in_sight(_table(analysis, compared, of_bands=False), say("All bands together")))
    of_bands = _table(analysis, compared, of_bands=True)
    blocks.append(Details(rows_words(say("Band by band"), len(of_bands.rows)), [of_bands]))
    doubts = list(dict.fromkeys(d for item in compared if item.comparison is not None for d in item.comparison.doubts))
    blocks += [Sentences([f"{doubt[0].upper()}{doubt[1:]}." for doubt in doubts])] if doubts else []
    return Section("modes", say("What comes and goes with the torque"), [*blocks, Paragraph(say(METHOD))])


def _speed_words(item: SpeedModes) -> str:
    if item.unit == "km/h":
        return f"{item.speed:.3g} km/h"
    return say("motor {speed:.4g} rpm", speed=60.0 * item.speed)


def _answer(items: Sequence[SpeedModes]) -> list[Block]:
    """A sentence a speed, those of run-ups, which are many and short, folded away."""
    sentences = [_sentence(item) for item in items]
    if len(sentences) <= IN_SIGHT:
        return [Sentences(sentences)]
    said = [sentence for mode in _modes(items) for sentence in _over_speeds(items, mode)]
    folded = say_count("Speed by speed, {count} sentence", "Speed by speed, {count} sentences", len(sentences))
    return [Sentences(said), Details(folded, [Sentences(sentences)])]


def _mode_word(mode: str) -> str:
    return say(MODE_WORDS.get(mode, mode))


def _modes(items: Sequence[SpeedModes]) -> list[str]:
    return list(dict.fromkeys(part.mode for item in items if item.comparison for part in item.comparison.parts))


def _over_speeds(items: Sequence[SpeedModes], mode: str) -> list[str]:
    """One mode over all speeds: what its whole sound depends on, and which bands."""
    held = [(item, _of_mode(item, mode)) for item in items if _of_mode(item, mode)]
    found: dict[str, list[tuple[SpeedModes, ModePart]]] = {}
    for item, parts in held:
        for part in _totals(parts):
            found.setdefault(part.depends_on, []).append((item, part))
    said = [_share_words(mode, depends_on, group) for depends_on, group in found.items()]
    bands: dict[str, int] = {}
    for _, parts in held:
        for part in parts:
            if part.band != "total" and part.depends_on == "torque":
                bands[part.band] = bands.get(part.band, 0) + 1
    often = [
        say("{band} at {count}", band=band, count=count)
        for band, count in sorted(bands.items(), key=lambda entry: -entry[1])[:NAMED_BANDS]
    ]
    if said and often:
        of_bands = say(
            "most of the band comes with it in {bands} of {speeds} speeds", bands=joined(often), speeds=len(held)
        )
        said[0] = f"{said[0]}; {of_bands}"
    return [f"{text[0].upper()}{text[1:]}." for text in said]


def _share_words(mode: str, depends_on: str, group: Sequence[tuple[SpeedModes, ModePart]]) -> str:
    """What a mode's sound depends on alike at some speeds, and how much of it comes with the torque."""
    shares = [part.torque_share for _, part in group]
    least, most = (f"{100.0 * end:.0f}" for end in (min(shares), max(shares)))
    first, last = (item for item, _ in (group[0], group[-1]))
    verdict = say(VERDICTS.get(depends_on, depends_on))
    share = least if least == most else range_text(least, most)
    if len(group) == 1:
        return say(
            "{mode} at {channel}, at {speed}: {verdict}, {share} % of the sound comes with the torque",
            mode=_mode_word(mode),
            channel=first.channel,
            speed=_speed_words(first),
            verdict=verdict,
            share=share,
        )
    return say(
        "{mode} at {channel}, at {count} speeds, {speeds}: {verdict}, {share} % of the sound comes with the torque",
        mode=_mode_word(mode),
        channel=first.channel,
        count=len(group),
        speeds=range_text(_speed_words(first), _speed_words(last)),
        verdict=verdict,
        share=share,
    )


def _of_mode(item: SpeedModes, mode: str) -> list[ModePart]:
    return [] if item.comparison is None else [part for part in item.comparison.parts if part.mode == mode]


def _sentence(item: SpeedModes) -> str:
    held = say("{speed} at {channel}", speed=_speed_words(item), channel=item.channel)
    if item.comparison is None:
        return say("{place}: not compared, {reason}.", place=held, reason=item.reason)
    said = []
    for part in _totals(item.comparison.parts):
        loaded, free = power_db(part.mean_square), power_db(part.speed_part)
        mode = _mode_word(part.mode)
        clauses = (
            [f"{mode} {part.words}"]
            if loaded is None or free is None
            else [
                say("{mode} {loaded:.1f} dB against {free:.1f} dB without torque", mode=mode, loaded=loaded, free=free),
                part.words,
            ]
        )
        own = [p.band for p in _of_mode(item, part.mode) if p.band != "total" and p.depends_on == "torque"]
        if own:
            clauses.append(
                say_count(
                    "most of it in the band {bands}", "most of it in the bands {bands}", len(own), bands=joined(own)
                )
            )
        said.append("; ".join(clauses))
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
        bars.append(Bars(bands, _levels([held[band].mean_square for band in bands]), _mode_word(mode), color=number))
    runs = joined([f"{_mode_word(mode)} {run}" for mode, run in item.runs])
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
                    say("all") if part.band == "total" else part.band,
                    part.mode,
                    power_db(part.mean_square),
                    power_db(part.speed_part),
                    100.0 * part.torque_share,
                    range_text(f"{100.0 * part.share_low:.0f}", f"{100.0 * part.share_high:.0f}"),
                    part.depends_on,
                )
            )
    title = (
        say("What comes and goes with the torque, band by band (levels re 20 µPa)")
        if of_bands
        else say("What comes and goes with the torque (levels re 20 µPa)")
    )
    return Table("modes-of-bands" if of_bands else "modes", title, columns, rows, origin=analysis.campaign.origin)

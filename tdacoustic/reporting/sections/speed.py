"""Speed over time."""

from __future__ import annotations

from tdacoustic.reporting.document import Block, FigureBlock, Section
from tdacoustic.reporting.figure import Axis, Figure, Line
from tdacoustic.reporting.sections.words import slug
from tdacoustic.results import Analysis

__all__ = ["speed"]


def speed(analysis: Analysis) -> Section | None:
    """Return the section on speed, or None where no channel told it: one figure a speed channel, all runs in it."""
    by_channel: dict[tuple[str, str, str], list[Line]] = {}
    for run in analysis.runs:
        for profile in run.measurement.speed.profiles if run.measurement is not None else ():
            factor = 60.0 if profile.si_symbol == "1/s" else 3.6
            key = (profile.channel, profile.shaft or "", profile.si_symbol)
            line = Line(profile.times_s, factor * profile.speed, f"run {run.name}")
            by_channel.setdefault(key, []).append(line)
    if not by_channel:
        return None
    blocks: list[Block] = []
    for (channel, shaft, si_symbol), lines in by_channel.items():
        label, unit = (f"Speed of the {shaft} shaft" if shaft else "Speed", "rpm")
        if si_symbol == "m/s":
            label, unit = "Train speed", "km/h"
        figure = Figure(
            slug("speed", channel),
            f"Speed over time, channel {channel}",
            "As the channel tells it; missing and double pulses of a tacho are mended and counted under quality.",
            Axis("Time from the start of the run", "s"),
            Axis(label, unit),
            lines,
            height=320,
        )
        blocks.append(FigureBlock(figure, analysis.campaign.origin))
    return Section("speed", "Speed over time", blocks)

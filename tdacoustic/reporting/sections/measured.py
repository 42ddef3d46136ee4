"""What was recorded: the campaign, its channels and its runs."""

from __future__ import annotations

from tdacoustic.recording import Channel
from tdacoustic.reporting.document import Block, Column, Facts, Section, Table
from tdacoustic.reporting.language import say
from tdacoustic.reporting.sections.words import pretty_unit, quantity_word, speed_words
from tdacoustic.results import Analysis

__all__ = ["measured"]


def measured(analysis: Analysis) -> Section:
    """Return the section on channels and runs."""
    blocks: list[Block] = []
    if analysis.campaign.meta:
        blocks.append(Facts(list(analysis.campaign.meta)))
    if analysis.runs:
        blocks.append(_runs(analysis))
    if analysis.campaign.channels:
        blocks.append(_channels(analysis))
    if analysis.campaign.levels:
        blocks.append(_known_levels(analysis))
    return Section("measured", say("What was recorded"), blocks)


def _runs(analysis: Analysis) -> Table:
    rows = []
    for run in analysis.runs:
        state = say("left out")
        if run.measurement is not None:
            state = say("steady") if run.measurement.steady else say("run-up")
        duration = max((c.duration_s for c in run.recording.channels), default=None) if run.recording else None
        rows.append(
            (
                run.name,
                run.run.condition or "",
                run.run.kind,
                run.run.mode or "",
                speed_words(run),
                duration,
                state,
                ", ".join(log.text for log in run.run.logs),
            )
        )
    columns = (
        Column("run", say("Run")),
        Column("condition", say("Condition")),
        Column("kind", say("Kind")),
        Column("mode", say("Mode")),
        Column("speed", say("Speed")),
        Column("duration_s", say("Length"), "s", 2, "number"),
        Column("state", say("State")),
        Column("logs", say("Logs")),
    )
    return Table("runs", say("Runs"), columns, rows)


def _channels(analysis: Analysis) -> Table:
    bound: dict[str, Channel] = {}
    scalings: dict[str, dict[str, None]] = {}
    for run in sorted(analysis.runs, key=lambda run: run.run.kind != "test"):
        for channel in run.recording.channels if run.recording is not None else ():
            bound.setdefault(channel.name, channel)
            if run.run.kind == "test":
                scalings.setdefault(channel.name, {})[pretty_unit(channel.scaling)] = None
    rows = []
    for stated in analysis.campaign.channels:
        used = bound.get(stated.name)
        place = [stated.component or "", stated.direction or "", stated.role or "", stated.side or ""]
        rows.append(
            (
                stated.name,
                quantity_word(used.quantity if used else stated.quantity or ""),
                " ".join(word for word in place if word),
                stated.distance_m,
                used.sample_rate_hz if used else None,
                pretty_unit(used.si_symbol) if used else "",
                analysis.sensors.scale_from(stated),
                " | ".join(scalings.get(stated.name, [pretty_unit(used.scaling)])) if used else say("not used"),
            )
        )
    columns = (
        Column("channel", say("Channel")),
        Column("quantity", say("Quantity")),
        Column("place", say("Place")),
        Column("distance_m", say("Distance"), "m", None, "number"),
        Column("sample_rate_hz", say("Rate"), "Hz", None, "number"),
        Column("unit", say("SI unit")),
        Column("scale_from", say("Scale from")),
        Column("scaling", say("Conversion of the log's numbers")),
    )
    return Table("channels", say("Channels"), columns, rows)


def _known_levels(analysis: Analysis) -> Table:
    rows = [
        (
            level.condition,
            level.distance_m,
            level.level_db,
            level.sigma_db,
            level.weighting,
            level.origin or say("not stated"),
        )
        for level in analysis.campaign.levels
    ]
    columns = (
        Column("condition", say("Condition")),
        Column("distance_m", say("Distance"), "m", None, "number"),
        Column("level_db", say("Level"), "dB re 20 µPa", 1, "number"),
        Column("sigma_db", say("Standard deviation"), "dB", 1, "number"),
        Column("weighting", say("Weighting")),
        Column("origin", say("Origin")),
    )
    return Table("known-levels", say("Levels known without logs"), columns, rows, origin="printed")

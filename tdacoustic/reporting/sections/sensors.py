"""Sensors: whence their sensitivities are, and what calibrators say of them."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from typing import Any

from tdacoustic.reporting.document import Block, Cell, Column, Notice, Paragraph, Section, Table
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.words import joined, pretty_signs, pretty_unit
from tdacoustic.results import Analysis
from tdacoustic.sensors import LIMIT_DB
from tdacoustic.sensors.channel_calibration import ChannelCalibration

__all__ = ["doubtful_channels", "sensors"]

RULE = mark(
    "ISO 3095 and ISO 3381 ask for a check with a calibrator before and after a series of measurements, and do not "
    "accept what was measured between two checks that differ by more than {limit:g} dB."
)
_ACTIONS = {"set": mark("set"), "checked": mark("checked"), "reported": mark("as stated")}


def _of_readings() -> tuple[Column, ...]:
    return (
        Column("channel", say("Channel")),
        Column("run", say("Run")),
        Column("calibrator", say("Calibrator")),
        Column("frequency_hz", say("Frequency"), "Hz", 1, "number"),
        Column("read", say("Read"), "rms", 4, "number"),
        Column("unit", say("Unit")),
        Column("deviation_db", say("Deviation"), "dB", 2, "number"),
        *_findings(),
    )


def _of_channels() -> tuple[Column, ...]:
    return (
        Column("channel", say("Channel")),
        Column("series", say("Series"), "", 0, "number"),
        Column("action", say("Scale is")),
        Column("deviation_db", say("Deviation"), "dB", 2, "number"),
        Column("drift_db", say("Drift"), "dB", 2, "number"),
        Column("sigma_db", say("Uncertainty"), "dB", 2, "number"),
        *_findings(),
    )


def _of_database() -> tuple[Column, ...]:
    return (
        Column("channel", say("Channel")),
        Column("sensor", say("Sensor")),
        Column("sensitivity_stated", say("Sensitivity")),
        Column("calibrated_on", say("Calibrated on")),
        Column("due_on", say("Due on")),
        Column("scale_from", say("Scale from")),
        *_findings(),
    )


def _findings() -> tuple[Column, ...]:
    return Column("verdict", say("Verdict"), kind="verdict"), Column("reason", say("Finding"))


def doubtful_channels(analysis: Analysis) -> tuple[str, ...]:
    """Return the channels of whose levels calibrators say that they are doubtful."""
    return tuple(
        dict.fromkeys(item.channel for item in analysis.sensors.calibrations if item.verdict != "ok" and _counts(item))
    )


def _counts(item: ChannelCalibration) -> bool:
    return item.action != "reported" or any(check.verdict == "bad" for check in item.checks)


def sensors(analysis: Analysis) -> Section | None:
    """Return the section on sensors; None of a campaign without calibrator runs and without a sensor database."""
    found = analysis.sensors
    if "sensors" not in analysis.tables:
        return None
    rows = analysis.tables["sensors"].to_dict("records")
    blocks: list[Block] = []
    if found.calibrations or found.problems:
        blocks.append(Paragraph(pretty_signs(_answer(found.calibrations))))
        doubtful = doubtful_channels(analysis)
        rule = say(RULE, limit=LIMIT_DB)
        if doubtful:
            text = say(
                "Levels of {channels} are doubtful; they stand marked in the table of levels.",
                channels=joined(doubtful),
            )
            blocks.append(Notice("warning", f"{text} {rule}"))
        else:
            blocks.append(Paragraph(rule))
    if found.calibrations:
        origin = analysis.campaign.origin
        held = [_of_channel(item) for item in found.calibrations]
        blocks.append(
            Table("sensor-scales", say("What calibrators say of each channel"), _of_channels(), held, origin=origin)
        )
        columns = _of_readings()
        read = [_cells(row, columns) for row in rows if str(row["kind"]).startswith("calibration_")]
        blocks.append(Table("calibrator-readings", say("Readings of calibrators"), columns, read, origin=origin))
        blocks.append(Paragraph(say(_METHOD)))
    if found.database:
        table = analysis.campaign.sensor_table
        caption = (
            say("From the sensor database")
            if table is None
            else say("From the sensor database {file}", file=table.text)
        )
        columns = _of_database()
        held = [_cells(row, columns) for row in rows if row["kind"] == "database"]
        blocks.append(Table("sensor-database", caption, columns, held, origin="printed"))
    return Section("sensors", say("Sensors and calibrators"), blocks)


_METHOD = mark(
    "The calibrator's tone is read where it keeps its level, at the frequency that it is found at, free of window and "
    "of noise beside it. A scale that nobody states is set by the energy mean of the readings before and after; a "
    'stated one is only checked, unless [analysis] calibrators = "set". The deviation is what is read by the stated '
    "scale over what the calibrator gives, the drift what is read after over before. The standard uncertainty is that "
    "of a class 1 sound calibrator (IEC 60942) or 3 % of a vibration calibrator [assumed], with the steadiness of the "
    "tone and half of the drift."
)


def _answer(calibrations: tuple[ChannelCalibration, ...]) -> str:
    """The findings in one or two sentences."""
    done = {
        action: list(dict.fromkeys(item.channel for item in calibrations if item.action == action))
        for action in ("set", "checked")
    }
    parts = []
    if done["checked"]:
        worst = max((item for item in calibrations if item.action == "checked"), key=_off)
        parts.append(
            say(
                "Calibrators check the sensitivity of {channels}: the largest deviation is {deviation:+.2f} dB "
                "({channel}).",
                channels=joined(done["checked"]),
                deviation=worst.deviation_db or 0.0,
                channel=worst.channel,
            )
        )
    if done["set"]:
        channels = joined(done["set"])
        parts.append(
            say("They set that of {channels}.", channels=channels)
            if parts
            else say("Calibrators set the sensitivity of {channels}.", channels=channels)
        )
    drifts = [item for item in calibrations if item.drift_db is not None]
    if drifts:
        most = max(drifts, key=lambda item: abs(item.drift_db or 0.0))
        parts.append(
            say(
                "Between before and after the largest drift is {drift:+.2f} dB ({channel}), more than the {limit:g} dB "
                "that standards allow.",
                drift=most.drift_db,
                channel=most.channel,
                limit=LIMIT_DB,
            )
            if abs(most.drift_db or 0.0) > LIMIT_DB
            else say(
                "Between before and after the largest drift is {drift:+.2f} dB ({channel}), no more than the "
                "{limit:g} dB that standards allow.",
                drift=most.drift_db,
                channel=most.channel,
                limit=LIMIT_DB,
            )
        )
    elif parts:
        parts.append(say("Drift is not known: no channel was read both before and after."))
    return " ".join(parts) or say("No calibrator run could set or check a sensitivity.")


def _off(item: ChannelCalibration) -> float:
    return abs(item.deviation_db or 0.0)


def _of_channel(item: ChannelCalibration) -> tuple[Cell, ...]:
    return (
        item.channel,
        item.series,
        say(_ACTIONS[item.action]),
        item.deviation_db,
        item.drift_db,
        item.sigma_db,
        item.verdict,
        pretty_signs(pretty_unit(item.reason)),
    )


def _cells(row: Mapping[Hashable, Any], columns: tuple[Column, ...]) -> tuple[Cell, ...]:
    return tuple(_cell(row[column.key], column) for column in columns)


def _cell(value: Any, column: Column) -> Cell:
    if column.kind == "number":
        return float(value)
    return pretty_signs(pretty_unit(value)) if isinstance(value, str) else ""

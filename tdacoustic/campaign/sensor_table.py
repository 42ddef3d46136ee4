"""``sensors.csv``: a laboratory's sensor database, and the channels that take their sensitivity from it."""

from __future__ import annotations

import csv
import datetime
import io
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from pydantic import ValidationError

from tdacoustic.campaign.channels import CampaignChannel
from tdacoustic.campaign.scale import physical_unit_text
from tdacoustic.campaign.sensor_columns import SENSOR_COLUMNS, sensor_columns
from tdacoustic.campaign.values import WrittenPath
from tdacoustic.errors import CampaignError, MissingFileError, UnitError
from tdacoustic.sensors import SensorEntry, entries_of
from tdacoustic.toml_models import shown, small_file
from tdacoustic.units import QUANTITIES, parse_sensitivity, quantity_of_unit

__all__ = ["MAX_BYTES", "MAX_ROWS", "read_sensor_table", "with_sensors"]

MAX_BYTES: Final = 4 << 20
MAX_ROWS: Final = 20_000
MAX_CELL: Final = 500

_NUMBER: Final = re.compile(r"\d+(\.\d+)?([eE][-+]?\d+)?")
_DECIMAL_COMMA: Final = re.compile(r"\d+,\d+\b")
_FORMULA: Final = re.compile(r"\s*[=+\-@].*\S")


def read_sensor_table(path: Path) -> tuple[SensorEntry, ...]:
    """Read a sensor database: one calibration of one sensor a row.

    UTF-8, separated by ``,`` or ``;``. Columns ``serial`` and ``sensitivity`` (as ``"10.2 mV/(m/s^2)"``; or a number,
    with ``unit`` or the unit in brackets behind the header) are needed; ``date``, ``due`` (as 2026-05-04),
    ``quantity``, ``type`` and ``note`` are read where they stand, further ones are not. Other spellings of the headers:
    see `tdacoustic.campaign.sensor_columns`.

    Parameters
    ----------
    path : Path

    Raises
    ------
    MissingFileError
        There is no such file.
    CampaignError
        Something in it cannot be understood; the message names file and line.
    """
    if not path.is_file():
        raise MissingFileError(f"{path}: no such file (sensors = ... in the campaign file names it)")
    raw = small_file(path, CampaignError)
    if len(raw) > MAX_BYTES:
        raise CampaignError(f"{path}: has {len(raw)} bytes, allowed for a sensor database are {MAX_BYTES}")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise CampaignError(f"{path}: is not UTF-8 (byte {error.start}); save it as CSV UTF-8") from error
    if "\0" in text:
        raise CampaignError(f"{path}: is no text; save it as CSV UTF-8")
    first = text.split("\n", 1)[0]
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=";" if first.count(";") > first.count(",") else ",")
    columns: list[str] | None = None
    unit: str | None = None
    entries: list[SensorEntry] = []
    try:
        for cells in reader:
            if not any(cell.strip() for cell in cells):
                continue
            if columns is None:
                columns, unit = sensor_columns(path, cells)
            elif len(cells) != len(columns):
                raise CampaignError(
                    f"{path}: line {reader.line_num} has {len(cells)} cells, the header {len(columns)}"
                    "; a decimal comma has to be a point"
                )
            elif len(entries) >= MAX_ROWS:
                raise CampaignError(f"{path}: has more than {MAX_ROWS} rows")
            else:
                row = {column: cell.strip() for column, cell in zip(columns, cells, strict=True)}
                row["unit"] = row.get("unit") or unit or ""
                entries.append(_entry(f"{path}: line {reader.line_num}", row, reader.line_num))
    except csv.Error as error:
        raise CampaignError(f"{path}: line {reader.line_num}: {error}") from error
    if not entries:
        raise CampaignError(f"{path}: no sensor in it")
    _check_twice(path, entries)
    return tuple(entries)


def _entry(place: str, row: Mapping[str, str], line: int) -> SensorEntry:
    for column in SENSOR_COLUMNS:
        cell = row.get(column, "")
        if len(cell) > MAX_CELL or any(ord(character) < 0x20 for character in cell):
            raise CampaignError(f"{place}: {column} is too long or has control characters")
        if _FORMULA.fullmatch(cell):
            raise CampaignError(f"{place}: {column} is a formula of a spreadsheet, {shown(cell)}; write its value")
    if not row["serial"]:
        raise CampaignError(f"{place}: serial is empty")
    quantity = "_".join(row.get("quantity", "").lower().split()) or None
    if quantity is not None and quantity not in QUANTITIES:
        raise CampaignError(f"{place}: quantity must be one of {', '.join(QUANTITIES)}, got {shown(quantity)}")
    sensitivity = _sensitivity(place, row)
    implied = quantity_of_unit(physical_unit_text(sensitivity))
    if quantity is not None and implied is not None and quantity != implied:
        raise CampaignError(f"{place}: sensitivity {shown(sensitivity)} does not fit quantity {quantity!r}")
    date, due = _day(place, "date", row.get("date", "")), _day(place, "due", row.get("due", ""))
    if date is not None and due is not None and due < date:
        raise CampaignError(f"{place}: due on {due}, before the calibration of {date}")
    return SensorEntry(
        serial=row["serial"],
        sensitivity=sensitivity,
        date=date,
        due=due,
        quantity=quantity or implied,
        type=row.get("type", ""),
        note=row.get("note", ""),
        line=line,
    )


def _sensitivity(place: str, row: Mapping[str, str]) -> str:
    text, unit = row["sensitivity"], row.get("unit", "")
    if not text:
        raise CampaignError(f"{place}: sensitivity is empty")
    if _DECIMAL_COMMA.search(text):
        raise CampaignError(f"{place}: sensitivity {shown(text)} has a decimal comma; write a point")
    if _NUMBER.fullmatch(text):
        if not unit:
            raise CampaignError(f"{place}: sensitivity {shown(text)} has no unit; add it, or a column 'unit'")
        text = f"{text} {unit}"
    try:
        parse_sensitivity(text)
    except UnitError as error:
        raise CampaignError(f"{place}: {error}") from error
    return text


def _day(place: str, column: str, text: str) -> datetime.date | None:
    if not text:
        return None
    try:
        return datetime.date.fromisoformat(text)
    except ValueError:
        raise CampaignError(f"{place}: {column} must be a day as 2026-05-04, got {shown(text)}") from None


def _check_twice(path: Path, entries: Sequence[SensorEntry]) -> None:
    """Raise where one sensor has two calibrations of one day, or calibrations of two quantities."""
    by_serial: dict[str, list[SensorEntry]] = {}
    for entry in entries:
        for other in by_serial.get(entry.serial, ()):
            both = f"lines {other.line} and {entry.line}"
            if other.date == entry.date:
                day = "no date" if entry.date is None else f"the same date {entry.date}"
                raise CampaignError(f"{path}: {both}: sensor {shown(entry.serial)} stands twice with {day}")
            if other.quantity != entry.quantity:
                raise CampaignError(f"{path}: {both}: sensor {shown(entry.serial)} measures two quantities")
        by_serial.setdefault(entry.serial, []).append(entry)


def with_sensors(
    path: Path,
    channels: Sequence[CampaignChannel],
    entries: Sequence[SensorEntry],
    table: WrittenPath | None,
) -> tuple[CampaignChannel, ...]:
    """Return the channels with what their sensors imply: the quantity.

    Parameters
    ----------
    path : Path
        Of the campaign, for messages.
    channels : sequence of CampaignChannel
    entries : sequence of SensorEntry
    table : WrittenPath or None
        None: the campaign names no sensor database.

    Raises
    ------
    CampaignError
        A sensor is not in the database, or does not fit its channel.
    """
    return tuple(
        channel if channel.sensor is None else _with_sensor(path, channel, channel.sensor, entries, table)
        for channel in channels
    )


def _with_sensor(
    path: Path, channel: CampaignChannel, sensor: str, entries: Sequence[SensorEntry], table: WrittenPath | None
) -> CampaignChannel:
    where = f"{path}: channel {channel.name!r}"
    if table is None:
        raise CampaignError(f'{where}: sensor = {sensor!r} needs the sensor database, add sensors = "sensors.csv"')
    try:
        entry = entries_of(entries, sensor)[-1]
    except CampaignError as error:
        raise CampaignError(f"{where}: {error} ({table.text})") from None
    stated = channel.scale.stated_quantity()
    if stated is not None:
        if entry.quantity is not None and stated != entry.quantity:
            raise CampaignError(
                f"{where}: is a {stated}, but sensor {sensor!r} of {table.text} is for {entry.quantity}"
            )
        return channel
    if entry.quantity is None:
        raise CampaignError(f"{where}: sensor {sensor!r} of {table.text} implies no quantity; add quantity = ...")
    try:
        return CampaignChannel.model_validate({**channel.model_dump(), "quantity": entry.quantity})
    except ValidationError as error:
        raise CampaignError(f"{where}: with sensor {sensor!r} of {table.text}: {error.errors()[0]['msg']}") from None

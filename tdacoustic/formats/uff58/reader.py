"""Universal file, data set 58 (ASCII) and 58b (binary): time records.

The records are walked without reading their values (`records`), the values
are read in blocks (`values`); `pyuff` takes whole files into memory and is the
oracle of the tests. What is no real, evenly spaced time signal is left out with a
flag, and refused where nothing else is in the file.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FormatError
from tdacoustic.formats.blocks import check_request, rebuffered, unique_names
from tdacoustic.formats.rates import snap_rate
from tdacoustic.formats.uff58.records import (
    Header58,
    Record,
    find_terminator,
    parse_header,
    read_identifier,
    start_time_of,
)
from tdacoustic.formats.uff58.values import AsciiValues, BinaryValues, LooseValues, count_loose_values
from tdacoustic.recording import Log, LogChannel, Raster
from tdacoustic.units import quantity_of_unit

__all__ = ["UffReader", "scan_file"]

FUNCTIONS = {
    2: "an auto spectrum",
    3: "a cross spectrum",
    4: "a frequency response function",
    5: "a transmissibility",
    6: "a coherence",
    7: "an auto correlation",
    8: "a cross correlation",
    9: "a power spectral density",
    10: "an energy spectral density",
    12: "a spectrum",
    27: "an order function",
}
TIME_RESPONSE, TIME_AXIS, FREQUENCY_AXIS = 1, 17, 18
REAL_SINGLE, REAL_DOUBLE = 2, 4
SECONDS = {"s": 1.0, "sec": 1.0, "seconds": 1.0, "second": 1.0, "ms": 1e-3, "us": 1e-6}
QUANTITY_OF_TYPE = {12: "acceleration", 13: "force", 19: "speed", 11: "other"}
DIRECTIONS = {0: "", 1: "+X", 2: "+Y", 3: "+Z", -1: "-X", -2: "-Y", -3: "-Z"}
SEARCH_BYTES = 1 << 16

Values = BinaryValues | AsciiValues | LooseValues


@dataclass(frozen=True)
class UffReader:
    """Reads blocks of records."""

    path: Path
    values: tuple[Values, ...]
    n_values: tuple[int, ...]

    def blocks(self, columns: Sequence[int], start: int, stop: int, block_size: int) -> Iterator[NDArray[np.float64]]:
        """Yield float64 arrays of shape (len(columns), n); see `tdacoustic.recording.log.Reader`.

        Raises
        ------
        FormatError
            The file ends before `stop`, or a value is no number.
        """
        check_request(self.path, min((self.n_values[column] for column in columns), default=0), start, stop, block_size)
        parts = [
            rebuffered(
                (piece[np.newaxis] for piece in self.values[column].pieces(self.path, start, stop)),
                block_size,
            )
            for column in columns
        ]
        for rows in zip(*parts, strict=True):
            yield rows[0] if len(rows) == 1 else np.concatenate(rows)


@dataclass(frozen=True)
class _Found:
    """A time record."""

    header: Header58
    values: Values
    flags: tuple[str, ...]


def scan_file(path: Path) -> Log:
    """Walk the records of a universal file.

    Returns
    -------
    Log

    Raises
    ------
    FormatError
        Truncated, or without a real time signal of even spacing.
    """
    found: list[_Found] = []
    left_out: list[str] = []
    flags: list[str] = []
    position = 0
    with path.open("rb") as stream:
        size = path.stat().st_size
        index = 0
        while (record := read_identifier(path, stream, position)) is not None:
            index += 1
            if record.number != 58:
                position = _skip(path, stream, record, size, index, flags)
                continue
            position = _read_58(path, stream, record, size, index, found, left_out, flags)
    if not found:
        reasons = "; ".join(left_out) or "no data set 58 in it"
        raise FormatError(f"{path}: no time signal: {reasons}")
    names, name_flags = unique_names(_names([item.header for item in found]))
    channels = tuple(_channel(item, name, flag) for item, name, flag in zip(found, names, name_flags, strict=True))
    starts = {start_time_of(item.header.id_lines[2]) for item in found}
    if len(starts) > 1:
        flags.append("the records state different start times: none is taken")
    return Log(
        path,
        "uff58",
        channels,
        UffReader(path, tuple(item.values for item in found), tuple(item.header.n_values for item in found)),
        start_time=starts.pop() if len(starts) == 1 else None,
        flags=(*left_out, *flags),
        metadata=tuple(
            (f"ID line {number}", line)
            for number, line in enumerate(found[0].header.id_lines, 1)
            if line and line.upper() != "NONE"
        ),
    )


def _skip(path: Path, stream: BinaryIO, record: Record, size: int, index: int, flags: list[str]) -> int:
    """Offset behind a record that is not read."""
    position = record.body
    if record.binary:
        stream.seek(position)
        for _ in range(record.header_lines):
            stream.readline(1 << 16)
        position = stream.tell() + record.n_bytes
    end = find_terminator(stream, position)
    if end is None:
        flags.append(f"record {index} (data set {record.number}) has no closing -1: the file may have been cut off")
        return size
    return end[1]


def _read_58(
    path: Path,
    stream: BinaryIO,
    record: Record,
    size: int,
    index: int,
    found: list[_Found],
    left_out: list[str],
    flags: list[str],
) -> int:
    """Add one data set 58 to `found` or `left_out`; returns the offset behind it."""
    header, offset = parse_header(path, stream, record, index)
    label = f"record {index} ({header.entity or header.id_lines[0]!r})"
    reason = _reason_to_leave_out(header)
    if record.binary:
        values, position, notes = _binary(path, stream, record, header, offset, size, label)
    elif reason is None:
        values, position, notes = _ascii(path, stream, header, offset, size, label)
    else:
        left_out.append(f"{label} is left out: {reason}")
        return _skip(path, stream, record, size, index, flags)
    if reason is not None or values is None:
        left_out.append(f"{label} is left out: {reason}")
    else:
        found.append(_Found(header, values, tuple(notes)))
    return position


def _reason_to_leave_out(header: Header58) -> str | None:
    """Why a record is no time signal that can be read, None if it is one."""
    unit = (header.abscissa.unit or "").strip().lower()
    if header.function_type in FUNCTIONS or header.abscissa.data_type == FREQUENCY_AXIS or unit in ("hz", "khz"):
        what = FUNCTIONS.get(header.function_type, "a function of frequency")
        return (
            f"data set 58 holds {what} (a spectrum), not a time signal"
            if "spectr" not in what
            else (f"data set 58 holds {what}, not a time signal")
        )
    if header.function_type not in (0, TIME_RESPONSE):
        return f"data set 58 holds function type {header.function_type}, not a time signal"
    if header.function_type == 0 and header.abscissa.data_type != TIME_AXIS and unit not in SECONDS:
        return "data set 58 holds a general function whose abscissa is not time"
    if header.data_type not in (REAL_SINGLE, REAL_DOUBLE):
        return f"its values are complex or of unknown kind (ordinate data type {header.data_type})"
    if not header.even:
        return "its abscissa is unevenly spaced; it is not resampled silently"
    if header.n_values == 0:
        return "it holds no values"
    if unit and unit not in SECONDS:
        return f"its abscissa is in {header.abscissa.unit!r}, not a time"
    return None


def _binary(
    path: Path, stream: BinaryIO, record: Record, header: Header58, offset: int, size: int, label: str
) -> tuple[Values | None, int, list[str]]:
    """Values of a 58b record, the offset behind it, and what is odd about it."""
    if record.float_format != 2:
        raise FormatError(f"{path}: {label}: float format {record.float_format} is not IEEE 754 (2) and cannot be read")
    if record.byte_order not in (1, 2):
        raise FormatError(f"{path}: {label}: byte order must be 1 or 2, got {record.byte_order}")
    notes: list[str] = []
    width = 8 if header.data_type in (REAL_DOUBLE, 6) else 4
    per_value = (1 if header.even else 2) * (2 if header.data_type in (5, 6) else 1)
    n_bytes = header.n_values * width * per_value
    if record.n_bytes != n_bytes:
        other = 12 - width
        if record.n_bytes == header.n_values * other * per_value:
            notes.append(f"the type of its values says {width} bytes, their number {other}: {other} are taken")
            width, n_bytes = other, record.n_bytes
        elif 0 < record.n_bytes < n_bytes:
            raise FormatError(
                f"{path}: {label} claims {header.n_values} values, "
                f"but {record.n_bytes} bytes for them instead of {n_bytes}"
            )
        else:
            notes.append(f"it claims {record.n_bytes} bytes for {header.n_values} values of {width} bytes")
    if offset + n_bytes > size:
        held = max(0, size - offset) // (width * per_value)
        raise FormatError(f"{path}: truncated: {label} claims {header.n_values} values, the file holds {held}")
    behind = _behind_values(stream, offset + n_bytes, size)
    doubled = _behind_values(stream, offset + 2 * n_bytes, size) if behind is None and width == 4 else None
    if doubled is not None and offset + 2 * n_bytes <= size:
        notes.append("it says single precision but holds twice the bytes: read as double precision")
        width, behind = 8, doubled
    if behind is None:
        end = find_terminator(stream, offset + n_bytes)
        stray = (size if end is None else end[0]) - offset - n_bytes
        notes.append(f"{stray} bytes that belong to nothing follow its values")
        behind = (size, False) if end is None else (end[1], True)
    if not behind[1]:
        notes.append("it has no closing -1")
    values = BinaryValues(offset, ("<" if record.byte_order == 1 else ">") + f"f{width}")
    return values, behind[0], notes


def _behind_values(stream: BinaryIO, position: int, size: int) -> tuple[int, bool] | None:
    """Offset behind a record whose values end at `position`, and whether it was closed.

    The closing ``-1`` may be glued to the values, on a line of its own, or absent.
    None where something else stands there.
    """
    if position > size:
        return None
    stream.seek(position)
    text = stream.read(SEARCH_BYTES)
    if not text.strip():
        return size, False
    closing = re.match(rb"\s*-1(?:[ \t]*(?:\r?\n|\Z)|(?=[ \t]+-1))", text)
    if closing is None:
        return None
    following = re.match(rb"\s*(\S+)", text[closing.end() :])
    if following is None or following[1] == b"-1":
        return position + closing.end(), True
    return position, False


def _ascii(
    path: Path, stream: BinaryIO, header: Header58, offset: int, size: int, label: str
) -> tuple[Values, int, list[str]]:
    """Values of an ASCII record, the offset behind it, and what is odd about it."""
    stream.seek(offset)
    first = stream.readline(4096)
    width, per_line = (20, 4) if header.data_type == REAL_DOUBLE else (13, 6)
    text = first.rstrip(b"\r\n")
    if len(text) >= 80 and header.data_type == REAL_SINGLE and len(text.split()) == 4:
        width, per_line = 20, 4
    elif header.data_type == REAL_DOUBLE and len(text.split()) == 6 and 78 <= len(text.rstrip()) < 80:
        width, per_line = 13, 6
    per_line = min(per_line, header.n_values)
    n_lines = -(-header.n_values // per_line)
    in_last = header.n_values - (n_lines - 1) * per_line
    values_end = offset + (n_lines - 1) * len(first) + in_last * width
    if values_end <= size and len(text) >= per_line * width:
        behind = _behind_values(stream, values_end, size)
        stream.seek(values_end - in_last * width - 1)
        if behind is not None and stream.read(1) == b"\n":
            notes = [] if behind[1] else ["it has no closing -1: the file may have been cut off behind it"]
            return AsciiValues(offset, width, per_line, len(first)), behind[0], notes
    end = find_terminator(stream, offset)
    stop = size if end is None else end[0]
    try:
        count, checkpoints = count_loose_values(path, stream, offset, stop, width)
    except FormatError:
        if end is not None:
            raise
        count, checkpoints = (stop - offset) // len(first) * per_line, ()
    if count < header.n_values or end is None:
        raise FormatError(f"{path}: truncated: {label} claims {header.n_values} values, the file holds {count}")
    if count > header.n_values:
        raise FormatError(f"{path}: {label} claims {header.n_values} values, but {count} stand in it")
    return LooseValues(checkpoints, width), end[1], []


def _names(headers: Sequence[Header58]) -> list[str]:
    """One name for each record, from the first place that tells all of them apart."""
    entities = [header.entity for header in headers]
    titles = [None if header.id_lines[0].upper() in ("", "NONE") else header.id_lines[0] for header in headers]
    degrees = [_degree_of_freedom(header) if header.node and len(headers) > 1 else None for header in headers]
    for candidates in (entities, titles, degrees):
        told = [candidate for candidate in candidates if candidate]
        if len(told) == len(headers) and len(set(told)) == len(told):
            return told
    return [
        entity or title or f"ch{index}" for index, (entity, title) in enumerate(zip(entities, titles, strict=True), 1)
    ]


def _degree_of_freedom(header: Header58) -> str:
    entity = f"{header.entity}:" if header.entity else ""
    return f"{entity}{header.node}:{DIRECTIONS.get(header.direction, header.direction)}"


def _channel(item: _Found, name: str, name_flag: str | None) -> LogChannel:
    header = item.header
    flags = [*item.flags, *(() if name_flag is None else (name_flag,))]
    axis = header.abscissa
    factor = SECONDS.get((axis.unit or "").strip().lower(), 1.0)
    labelled_time = (axis.label or "").strip().lower() in ("time", "zeit", "temps")
    rate, raw = None, None
    if axis.unit is None and axis.data_type != TIME_AXIS and not labelled_time:
        flags.append("its abscissa has neither unit nor type: an index, not a time; the sampling rate is not known")
        factor = 0.0
    elif not header.abscissa_step > 0.0:
        flags.append(f"its abscissa increment is {header.abscissa_step}: the sampling rate is not known")
    else:
        rate, raw = snap_rate(1.0 / (header.abscissa_step * factor), header.step_resolution)
    unit = header.ordinate.unit
    return LogChannel(
        name,
        Raster(rate, header.n_values, header.abscissa_start * factor, raw),
        unit=unit,
        quantity=quantity_of_unit(unit) or QUANTITY_OF_TYPE.get(header.ordinate.data_type),
        flags=tuple(flags),
    )

"""Universal file, data set 58 (ASCII) and 58b (binary): time records.

The records are walked without reading their values (`records`), the values
are read in blocks (`values`); `pyuff` takes whole files into memory and is the
oracle of the tests. What is no real, evenly spaced time signal is left out with a
flag, and refused where nothing else is in the file.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FormatError, UnitError
from tdacoustic.formats.blocks import check_request, rebuffered, unique_names
from tdacoustic.formats.rates import snap_rate
from tdacoustic.formats.uff58.binary import behind_values, binary_values
from tdacoustic.formats.uff58.records import (
    Header58,
    Record,
    find_terminator,
    parse_header,
    read_identifier,
    read_units,
    start_time_of,
)
from tdacoustic.formats.uff58.values import SLAB_VALUES, AsciiValues, LooseValues, Values, count_loose_values
from tdacoustic.recording import Log, LogChannel, Raster
from tdacoustic.units import parse_unit, quantity_of_unit

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
EXPONENTS_OF_TYPE = {
    **{2: (-2, 1), 6: (1, 1), 8: (1, 0), 9: (0, 1), 11: (1, 0), 12: (1, 0), 13: (0, 1), 15: (-2, 1)},
}
"""Exponents of length and force of a specific data type (table of addendum A); of others they stand in the record."""
MAX_VALUES_AT_ONCE = 1 << 22
"""Values that the pieces of all records that are read together may have."""


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
        slab = max(1 << 12, min(SLAB_VALUES, MAX_VALUES_AT_ONCE // max(1, len(columns))))
        with self.path.open("rb") as stream:
            parts = [
                rebuffered(
                    (piece[np.newaxis] for piece in self.values[column].pieces(self.path, stream, start, stop, slab)),
                    block_size,
                )
                for column in columns
            ]
            for rows in zip(*parts, strict=True):
                yield rows[0] if len(rows) == 1 else np.concatenate(rows)


@dataclass(frozen=True)
class _Found:
    """A time record, and the factors of length and force of the data set 164 before it."""

    header: Header58
    values: Values
    flags: tuple[str, ...]
    units: tuple[float, float] | None


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
    units: tuple[float, float] | None = None
    with path.open("rb") as stream:
        size = path.stat().st_size
        index = 0
        while (record := read_identifier(path, stream, position)) is not None:
            index += 1
            if record.number == 164:
                units = read_units(stream, record)
            if record.number != 58:
                position = _skip(path, stream, record, size, index, flags)
                continue
            position = _read_58(path, stream, record, size, index, units, found, left_out, flags)
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
    units: tuple[float, float] | None,
    found: list[_Found],
    left_out: list[str],
    flags: list[str],
) -> int:
    """Add one data set 58 to `found` or `left_out`; returns the offset behind it."""
    header, offset = parse_header(path, stream, record, index)
    label = f"record {index} ({header.entity or header.id_lines[0]!r})"
    reason = _reason_to_leave_out(header)
    values: Values
    if record.binary:
        values, position, notes = binary_values(path, stream, record, header, offset, size, label)
    elif reason is None:
        values, position, notes = _ascii(path, stream, header, offset, size, label)
    else:
        left_out.append(f"{label} is left out: {reason}")
        return _skip(path, stream, record, size, index, flags)
    if reason is not None:
        left_out.append(f"{label} is left out: {reason}")
    else:
        found.append(_Found(header, values, tuple(notes), units))
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
        behind = behind_values(stream, values_end, size)
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
    elif not 0.0 < 1.0 / (header.abscissa_step * factor or math.inf) < math.inf:
        flags.append(f"its abscissa increment of {header.abscissa_step} is no sampling interval: the rate is not known")
    else:
        rate, raw = snap_rate(1.0 / (header.abscissa_step * factor), header.step_resolution)
    start = header.abscissa_start * factor
    if not math.isfinite(start):
        flags.append(f"its abscissa begins at {header.abscissa_start}: its start is taken as 0")
        start = 0.0
    unit = header.ordinate.unit
    flags += _unit_flags(header, item.units)
    return LogChannel(
        name,
        Raster(rate, header.n_values, start, raw),
        unit=unit,
        quantity=quantity_of_unit(unit) or QUANTITY_OF_TYPE.get(header.ordinate.data_type),
        flags=tuple(flags),
    )


def _unit_flags(header: Header58, units: tuple[float, float] | None) -> list[str]:
    """Say where data set 164 contradicts the ordinate's unit, or states other units than SI where there is none.

    The label of an axis takes precedence over the file's units (note to record 8 of data set 58).
    """
    if units is None:
        return []
    length, force = EXPONENTS_OF_TYPE.get(header.ordinate.data_type, header.ordinate.exponents[:2])
    if (length, force) == (0, 0) or max(abs(length), abs(force)) > 9:
        return []
    stated = units[0] ** -length * units[1] ** -force
    unit = header.ordinate.unit
    if unit is None:
        same = math.isclose(stated, 1.0, rel_tol=1e-4)
        return [] if same else [f"it names no unit; data set 164 says that its numbers are in {stated:.6g} times SI"]
    try:
        known = parse_unit(unit)
    except UnitError:
        return []
    if known.si_symbol in ("V", "A", "C", "1") or math.isclose(stated, known.factor, rel_tol=1e-4):
        return []
    return [
        f"its unit is {unit!r}, data set 164 says that its numbers are in {stated:.6g} times SI: the unit of its own "
        "label is taken"
    ]

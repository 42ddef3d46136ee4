"""CSV, TSV and other texts of numbers in columns.

Encoding, delimiter, decimal mark and heading are found out
(`tdacoustic.formats.delimited.layout`), the rows are counted and checked in one pass
over the bytes (`rows`), those of a large text without one and checked while they are read (`placing`); a time column
gives the raster and is checked while the rows are read (`time_column`). The numbers are parsed by pandas' C engine.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FormatError
from tdacoustic.formats.blocks import check_request, rebuffered, unique_names
from tdacoustic.formats.delimited.layout import WHITESPACE, Layout, is_number, read_layout, split_row
from tdacoustic.formats.delimited.placing import open_checked, place_rows
from tdacoustic.formats.delimited.rows import Rows, count_rows
from tdacoustic.formats.delimited.stream import decoded, open_text_bytes
from tdacoustic.formats.delimited.time_column import (
    TimeAxis,
    TimeCheck,
    claimed_rows,
    find_time_field,
    is_counter,
    nanoseconds_of,
    seconds_of,
    stated_rate_hz,
    stated_start,
    written_resolution,
)
from tdacoustic.formats.rates import snap_rate
from tdacoustic.recording import Log, LogChannel, Raster
from tdacoustic.units import quantity_of_unit

__all__ = ["DelimitedReader", "scan_file"]

SLAB_CELLS = 1 << 18
END_ROWS = 4096
"""Rows at either end that a scan reads."""


@dataclass(frozen=True)
class DelimitedReader:
    """Reads blocks of a text.

    Parameters
    ----------
    path : Path
    layout : Layout
    rows : Rows
    fields : tuple of int
        Field of each channel.
    time : TimeAxis or None
        The time column, checked while reading.
    """

    path: Path
    layout: Layout
    rows: Rows
    fields: tuple[int, ...]
    time: TimeAxis | None = None

    def blocks(self, columns: Sequence[int], start: int, stop: int, block_size: int) -> Iterator[NDArray[np.float64]]:
        """Yield float64 arrays of shape (len(columns), n); see `tdacoustic.recording.log.Reader`.

        Raises
        ------
        FormatError
            A cell is no number, the time column has a gap, or the file has changed; names the line.
        """
        check_request(self.path, self.rows.n_rows, start, stop, block_size)
        fields = [self.fields[column] for column in columns]
        yield from rebuffered(self._checked(fields, start, stop), block_size)

    def _checked(self, fields: Sequence[int], start: int, stop: int) -> Iterator[NDArray[np.float64]]:
        if self.time is None:
            for _, values, _ in self.pieces(fields, None, start, stop):
                yield values
            return
        check = TimeCheck(self.path, self.time, self.layout.first_line)
        for row, values, times in self.pieces(fields, self.time, start, stop):
            try:
                check(row, times)
            except FormatError:
                self.refuse_gap(self.time)
                raise
            yield values

    def refuse_gap(self, axis: TimeAxis) -> None:
        """Go through the time column to name the line at which its step changes.

        Raises
        ------
        FormatError
            Where a step differs from those at the column's beginning; none does where the clock drifts.
        """
        n_rows = min(self.rows.n_rows, END_ROWS)
        first = np.concatenate([times for _, _, times in self.pieces((), axis, 0, n_rows)])
        local = replace(axis, step=float(np.median(np.diff(first))))
        check = TimeCheck(self.path, local, self.layout.first_line, by_step_only=True)
        for row, _, times in self.pieces((), local, 0, self.rows.n_rows):
            check(row, times)

    def pieces(
        self, fields: Sequence[int], time: TimeAxis | None, start: int, stop: int
    ) -> Iterator[tuple[int, NDArray[np.float64], NDArray[np.float64]]]:
        """Yield first row, values and times of pieces of any length."""
        import pandas

        if start == stop:
            return
        layout = self.layout
        moments = {time.field} if time is not None and time.origin is not None else set()
        needed = sorted({*fields, *(() if time is None else (time.field,))})
        checkpoint, offset = self.rows.before(start)
        position = start
        try:
            with (
                self._opened(checkpoint, offset) as stream,
                pandas.read_csv(
                    stream,
                    **_dialect_options(layout),
                    usecols=needed,
                    dtype={field: "str" if field in moments else np.float64 for field in needed},
                    skiprows=start - checkpoint,
                    nrows=stop - start,
                    chunksize=max(1, SLAB_CELLS // layout.n_fields),
                ) as frames,
            ):
                for frame in frames:
                    values = np.empty((len(fields), len(frame)))
                    for row, field in enumerate(fields):
                        values[row] = frame[field].to_numpy()
                    times = np.zeros(0)
                    if time is not None:
                        column = frame[time.field]
                        if time.origin is None:
                            times = column.to_numpy(dtype=np.float64)
                        else:
                            times = seconds_of(column, time.origin)
                    yield position, values, times
                    position += len(frame)
        except (ValueError, pandas.errors.ParserError) as error:
            if isinstance(error, FormatError):
                raise
            raise self._bad_cell(needed, moments, position, error) from error
        if position != stop:
            raise FormatError(f"{self.path}: the file ends at row {position}, {stop} were asked for: it has changed")

    def _opened(self, row: int, offset: int) -> BinaryIO:
        if self.rows.checked:
            return open_text_bytes(self.path, self.layout.encoding, offset)
        return open_checked(self.path, self.layout, row, offset)

    def _bad_cell(self, fields: Sequence[int], moments: set[int], row: int, error: Exception) -> FormatError:
        """Find the cell over which pandas stumbled, at or after a row."""
        layout = self.layout
        at, offset = self.rows.before(row)
        with open_text_bytes(self.path, layout.encoding, offset) as stream:
            for raw in stream:
                cells = split_row(decoded(raw, layout.encoding).strip("\r\n"), layout.delimiter)
                line = layout.first_line + at
                if len(cells) != layout.n_fields:
                    return FormatError(f"{self.path}: line {line} has {len(cells)} fields instead of {layout.n_fields}")
                for field in fields:
                    cell = cells[field]
                    if field not in moments and cell and not is_number(cell, layout.decimal):
                        name = layout.names[field] or f"column {field + 1}"
                        return FormatError(f"{self.path}: line {line}: {cell[:40]!r} in {name!r} is no number")
                at += 1
        return FormatError(f"{self.path}: cannot be read at or after line {layout.first_line + row} ({error})")


def _dialect_options(layout: Layout) -> dict[str, Any]:
    return {
        "sep": r"\s+" if layout.delimiter == WHITESPACE else layout.delimiter,
        "header": None,
        "names": range(layout.n_fields),
        "index_col": False,
        "decimal": layout.decimal,
        "encoding": "latin-1" if layout.encoding == "latin-1" else "utf-8",
        "encoding_errors": "replace",
        "engine": "c",
        "keep_default_na": False,
        "na_values": ["", "NaN", "nan", "NAN"],
        "quoting": csv.QUOTE_MINIMAL if layout.quoted else csv.QUOTE_NONE,
        "skipinitialspace": True,
    }


def scan_file(path: Path) -> Log:
    """Find out the layout of a text, count its rows, and read both ends.

    Returns
    -------
    Log

    Raises
    ------
    FormatError
        No rows of numbers, rows of different length, a text among numbers, or times that are not equidistant.
    """
    layout = read_layout(path)
    rows = place_rows(path, layout) or count_rows(path, layout)
    claimed = claimed_rows(layout)
    if claimed is not None and claimed > rows.n_rows:
        raise FormatError(f"{path}: truncated: the heading claims {claimed} samples, the file holds {rows.n_rows}")
    flags = list(layout.flags)
    if not rows.ends_in_newline:
        flags.append("the last line has no line end: the file may have been cut off")
    reader = DelimitedReader(path, layout, rows, ())
    time, raster, time_flags = _raster(reader)
    fields = _signal_fields(layout, time, flags)
    flags += time_flags
    reader = replace(reader, fields=tuple(fields), time=time)
    for begin, end in _ends(rows.n_rows):
        for _ in reader.blocks(range(len(fields)), begin, end, END_ROWS):
            pass
    if time is None:
        flags += _ramps(layout, fields)
    start_time = (
        layout.first_cells[0][time.field].strip('"') if time and time.kind == "moment" else stated_start(layout)
    )
    return Log(
        path,
        "delimited",
        _channels(layout, fields, raster),
        reader,
        start_time=start_time.replace(" ", "T", 1).replace(",", ".") if start_time else None,
        flags=tuple(flags),
        metadata=layout.metadata,
    )


def _ends(n_rows: int) -> list[tuple[int, int]]:
    if n_rows <= 2 * END_ROWS:
        return [(0, n_rows)]
    return [(0, END_ROWS), (n_rows - END_ROWS, n_rows)]


def _signal_fields(layout: Layout, time: TimeAxis | None, flags: list[str]) -> list[int]:
    fields = []
    for field in range(layout.n_fields):
        label = layout.names[field] or f"column {field + 1}"
        if time is not None and field == time.field:
            continue
        if not layout.numeric[field]:
            if any(row[field] for row in layout.first_cells):
                flags.append(f"{label!r} holds text and was skipped")
        elif is_counter(layout, field):
            flags.append(f"{label!r} only counts the rows and was skipped")
        else:
            fields.append(field)
    return fields


def _channels(layout: Layout, fields: Sequence[int], raster: Raster) -> tuple[LogChannel, ...]:
    given = [layout.names[field] or f"ch{index}" for index, field in enumerate(fields, 1)]
    names, flags = unique_names(given)
    return tuple(
        LogChannel(
            name,
            raster,
            unit=layout.units[field],
            quantity=quantity_of_unit(layout.units[field]),
            flags=() if flag is None else (flag,),
        )
        for name, field, flag in zip(names, fields, flags, strict=True)
    )


def _raster(reader: DelimitedReader) -> tuple[TimeAxis | None, Raster, list[str]]:
    """Raster from the time column, else from the heading."""
    layout, n_rows = reader.layout, reader.rows.n_rows
    stated, flags = stated_rate_hz(layout)
    notes = list(flags)
    found = find_time_field(layout)
    axis = None if found is None or n_rows < 2 else _time_axis(reader, found)
    if found is None or axis is None:
        rate, raw = (None, None) if stated is None else snap_rate(stated)
        return None, Raster(rate, n_rows, 0.0, raw), notes
    unit_s = found[1]
    duration = axis.step * (n_rows - 1)
    rate, raw = snap_rate(1.0 / (axis.step * unit_s), 2.0 * axis.resolution / duration)
    if layout.units[axis.field] is None and axis.kind == "number" and unit_s == 1.0:
        notes.append(f"the time column {layout.names[axis.field]!r} has no unit: taken as seconds")
    if axis.resolution >= 0.5 * axis.step:
        notes.append("the times are written too coarsely to tell single samples apart")
    if stated is not None and abs(stated - rate) > 1e-3 * rate:
        notes.append(f"the heading states {stated:.9g} Hz, the time column gives {rate:.9g} Hz: the column is taken")
    start_s = axis.start * unit_s if axis.kind == "number" else 0.0
    return axis, Raster(rate, n_rows, start_s, raw), notes


def _time_axis(reader: DelimitedReader, found: tuple[int, float, str, bool]) -> TimeAxis | None:
    """Straight line through the time column; the ends are checked here, the rest while reading."""
    field, _, kind, certain = found
    n_rows = reader.rows.n_rows
    origin = nanoseconds_of([reader.layout.first_cells[0][field]])[0] if kind == "moment" else None
    any_axis = TimeAxis(field, kind, 0.0, 1.0, 0.0, origin)
    ends = [(begin, _times(reader, any_axis, begin, end)) for begin, end in _ends(n_rows)]
    first, last = ends[0][1], ends[-1][1]
    step = (last[-1] - first[0]) / (n_rows - 1)
    line = reader.layout.first_line
    if not (np.isfinite(step) and step > 0.0):
        if not certain:
            return None
        raise FormatError(
            f"{reader.path}: the time column does not rise: line {line} has {first[0]:.9g}, "
            f"line {line + n_rows - 1} {last[-1]:.9g}"
        )
    axis = TimeAxis(field, kind, float(first[0]), float(step), _resolution(reader, field), origin)
    try:
        for begin, times in ends:
            TimeCheck(reader.path, axis, line)(begin, times)
    except FormatError:
        if not certain:
            return None
        reader.refuse_gap(axis)
        raise
    return axis


def _times(reader: DelimitedReader, axis: TimeAxis, start: int, stop: int) -> NDArray[np.float64]:
    return np.concatenate([times for _, _, times in reader.pieces((), axis, start, stop)])


def _resolution(reader: DelimitedReader, field: int) -> float:
    """Half a unit of the last digit of the times, the coarser of both ends of the file."""
    layout = reader.layout
    row, offset = reader.rows.before(max(0, reader.rows.n_rows - 1))
    tail: list[str] = []
    with open_text_bytes(reader.path, layout.encoding, offset) as stream:
        for raw in stream:
            cells = split_row(decoded(raw, layout.encoding).strip("\r\n"), layout.delimiter)
            if len(cells) == layout.n_fields:
                tail.append(cells[field])
            row += 1
            if row >= reader.rows.n_rows or len(tail) >= END_ROWS:
                break
    first = [cells[field] for cells in layout.first_cells]
    return max(written_resolution(first), written_resolution(tail[-len(first) :]))


def _ramps(layout: Layout, fields: Sequence[int]) -> list[str]:
    """Name the first column if it rises in equal steps: it may be a time without a name."""
    if not fields or len(fields) < 2 or layout.names[fields[0]] is not None or len(layout.first_cells) < 10:
        return []
    cells = [row[fields[0]].replace(",", ".") for row in layout.first_cells]
    if not all(is_number(cell) for cell in cells):
        return []
    steps = np.diff([float(cell) for cell in cells])
    even = bool(steps.min() > 0.0 and np.ptp(steps) <= 1e-3 * steps.max())
    return ["ch1 rises in equal steps: it may be a time column, but nothing says so"] if even else []

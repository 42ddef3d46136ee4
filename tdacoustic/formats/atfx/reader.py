"""ASAM ODS ATFX: measurements in XML, their values there or in component files beside it.

What is read, in the words of the ODS base model: the local columns of the submatrices of all measurements. The
independent column of a submatrix is the axis and gives the sampling rate. Values may be explicit, implicit
(constant, linear) or raw (linear, polynomial, calibrated), in the XML or in component files. A value whose flag says
that it is not valid is NaN. Units stay as the file names them.

The layout was learnt from public examples of the openATFX project (among them logs of IPETRONIK and PAK) and from the
ASAM ODS base model; no code of theirs is used.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from datetime import datetime
from itertools import chain
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FormatError
from tdacoustic.formats.atfx.axis import Axis, NoTimeSignalError, Read, axis_of
from tdacoustic.formats.atfx.columns import DEFINED, VALID, Column, Source, read_column
from tdacoustic.formats.atfx.components import ComponentFiles, own_file
from tdacoustic.formats.atfx.document import Instance, read_document
from tdacoustic.formats.atfx.graph import Graph
from tdacoustic.formats.atfx.values import (
    SLAB_BYTES,
    Component,
    Implicit,
    Part,
    component_pieces,
    pieces,
)
from tdacoustic.formats.blocks import check_request, in_asked_order, rebuffered, unique_names
from tdacoustic.recording import Log, LogChannel, Raster
from tdacoustic.units import quantity_of_unit

__all__ = ["AtfxReader", "scan_file"]

MAX_CHANNELS_AT_ONCE_BYTES = 64 << 20
"""What the pieces of all channels that are read together may take."""
CHECKED_VALUES = 256
MAX_NAMES_IN_A_FLAG = 8
UNSET_YEARS = (1601, 1900, 1904, 1970)
"""Years in which clocks begin: the first instant of one of them is no date."""


@dataclass(frozen=True)
class AtfxReader:
    """Reads blocks of local columns.

    Parameters
    ----------
    path : Path
    sources : tuple of Source
    identities : tuple of (str, int, int)
        Name, size and time of change of each file when it was scanned; the log's own name is empty.
    """

    path: Path
    sources: tuple[Source, ...]
    identities: tuple[tuple[str, int, int], ...]

    def blocks(self, columns: Sequence[int], start: int, stop: int, block_size: int) -> Iterator[NDArray[np.float64]]:
        """Yield float64 arrays of shape (len(columns), n); see `tdacoustic.recording.log.Reader`.

        Raises
        ------
        FormatError
            A file has changed since it was scanned, or a value is no number.
        """
        chosen = [self.sources[column] for column in columns]
        check_request(self.path, min((source.n_values for source in chosen), default=0), start, stop, block_size)
        groups = _grouped(chosen)
        slab = max(1 << 13, min(SLAB_BYTES, MAX_CHANNELS_AT_ONCE_BYTES // max(1, len(chosen))))
        with ExitStack() as stack:
            streams = _Streams(self.path, self.identities, stack)
            parts = [self._pieces(streams, [chosen[row] for row in group], start, stop, slab) for group in groups]
            yield from in_asked_order(parts, groups, block_size)

    def _pieces(
        self, streams: _Streams, sources: Sequence[Source], start: int, stop: int, slab: int
    ) -> Iterator[NDArray[np.float64]]:
        """Yield values of sources that share their blocks, or of one source, in pieces of any length."""
        components = [part for source in sources for part in source.parts if isinstance(part, Component)]
        if len(sources) > 1:
            stream = streams.of(components[0])
            for arrays in component_pieces(self.path, stream, components, start, stop, slab):
                yield np.stack([_scaled(*pair) for pair in zip(sources, arrays, strict=True)])
            return
        source = sources[0]
        values = self._of_parts(streams, source.parts, start, stop, slab)
        if not source.flags:
            for array in values:
                yield _scaled(source, array)
            return
        marks = self._of_parts(streams, source.flags, start, stop, slab)
        for array, mark in zip(rebuffered(values, slab // 8), rebuffered(marks, slab // 8), strict=True):
            bits = np.where(np.abs(mark) < 2.0**15, mark, 0.0).astype(np.int64)  # a flag is a 16-bit number
            valid = (bits & VALID != 0) & (bits & DEFINED != 0)
            yield np.where(valid, _scaled(source, array), np.nan)

    def _of_parts(
        self, streams: _Streams, parts: Sequence[Part], start: int, stop: int, slab: int
    ) -> Iterator[NDArray[np.float64]]:
        """Yield the values of parts that follow each other, as rows."""
        before = 0
        for part in parts:
            first, last = max(0, start - before), min(part.n_values, stop - before)
            if first < last:
                for array in pieces(self.path, streams.of(part), part, first, last, slab):
                    yield array[np.newaxis]
            before += part.n_values


class _Streams:
    """The log and its component files, each opened once and only where it is as it was."""

    def __init__(self, path: Path, identities: tuple[tuple[str, int, int], ...], stack: ExitStack) -> None:
        self._path = path
        self._stack = stack
        self._identities = {name: (size, changed) for name, size, changed in identities}
        self._open: dict[str, BinaryIO] = {}
        self._of_name("")

    def of(self, part: Part) -> BinaryIO:
        """Return the file that holds a part."""
        return self._of_name(part.name if isinstance(part, Component) else "")

    def _of_name(self, name: str) -> BinaryIO:
        if name not in self._open:
            path = own_file(self._path, name) if name else self._path
            if _identity(self._path, path) != self._identities[name]:
                what = f"its component file {name!r}" if name else "the file"
                raise FormatError(f"{self._path}: {what} has changed since it was scanned")
            self._open[name] = self._stack.enter_context(path.open("rb"))
        return self._open[name]


def _identity(log: Path, path: Path) -> tuple[int, int]:
    try:
        stat = path.stat()
    except OSError as error:
        raise FormatError(f"{log}: {path.name!r} cannot be read ({error.strerror})") from error
    return stat.st_size, stat.st_mtime_ns


def _scaled(source: Source, stored: NDArray[np.float64]) -> NDArray[np.float64]:
    if not source.coefficients:
        return stored
    values = np.full_like(stored, source.coefficients[-1])
    with np.errstate(over="ignore", invalid="ignore"):  # stored numbers that are no samples may be as large as any
        for coefficient in source.coefficients[-2::-1]:
            values = values * stored + coefficient
    return values


def _grouped(sources: Sequence[Source]) -> list[list[int]]:
    """Rows of the sources that are read together: those that share their blocks, the others each alone."""
    alone: list[list[int]] = []
    sharing: dict[tuple[str, int, int, int], list[tuple[int, int]]] = {}
    for row, source in enumerate(sources):
        part = source.parts[0] if len(source.parts) == 1 and not source.flags else None
        if isinstance(part, Component) and part.is_interleaved:
            key = (part.name, part.n_values, part.block_size, part.per_block)
            sharing.setdefault(key, []).append((part.address, row))
        else:
            alone.append([row])
    for (_, _, block_size, _), members in sharing.items():
        begin = -block_size
        for address, row in sorted(members):
            if address - begin >= block_size:
                begin = address
                alone.append([])
            alone[-1].append(row)
    return alone


@dataclass(frozen=True)
class _Channel:
    """A column that is a channel, its axis, and the start of its measurement."""

    column: Column
    source: Source
    axis: Axis
    begin: str | None


def scan_file(path: Path) -> Log:
    """Read the XML of an ATFX file, and compare what it claims with its component files.

    Returns
    -------
    Log

    Raises
    ------
    FormatError
        The XML is damaged, claims what is not there, or holds no evenly sampled time signal.
    """
    document = read_document(path)
    graph = Graph(path, document)
    files = ComponentFiles(path, graph)
    found: list[_Channel] = []
    left_out: dict[str, list[str]] = {}
    with path.open("rb") as stream:
        for submatrix, columns in _submatrices(graph):
            n_rows = None
            if submatrix is not None and submatrix.attributes.get("number_of_rows"):
                n_rows = graph.count(submatrix, "number_of_rows")
            read = [read_column(path, stream, graph, files, column, n_rows) for column in columns]
            begin = _begin(graph, submatrix)
            _add_submatrix(path, read, begin, found, left_out)
    if not found:
        reasons = "; ".join(_left_out(left_out)) or "no local column in it"
        raise FormatError(f"{path}: no time signal: {reasons}")
    flags = list(_left_out(left_out))
    start_time, shifts, note = _starts([item.begin for item in found], flags)
    names, name_flags = unique_names([item.column.name or f"ch{n}" for n, item in enumerate(found, 1)])
    reader = _reader(path, [item.source for item in found])
    channels = []
    for number, item in enumerate(found):
        note_of_name = name_flags[number]
        more = [*((note_of_name,) if note_of_name else ()), *_range_flags(reader, number, item.column)]
        channels.append(_log_channel(item, names[number], shifts[number], more))
    return Log(
        path,
        "atfx",
        tuple(channels),
        reader,
        start_time=start_time,
        flags=tuple(flags),
        metadata=(*document.shown, *_measurements(graph), *note),
        companions=tuple(path.parent / name for name, _, _ in reader.identities if name),
    )


def _submatrices(graph: Graph) -> Iterator[tuple[Instance | None, list[Instance]]]:
    """Yield the submatrices with their local columns, then the columns that are of none."""
    taken: set[int] = set()
    for submatrix in graph.of("aosubmatrix"):
        columns = graph.related(submatrix, "local_columns", "aolocalcolumn", "submatrix")
        for column in columns:
            if id(column) in taken:
                graph.only(column, "submatrix", "aosubmatrix", "local_columns")
            taken.add(id(column))
        yield submatrix, columns
    for column in graph.of("aolocalcolumn"):
        if id(column) not in taken:
            yield None, [column]


def _add_submatrix(
    path: Path,
    columns: Sequence[Column],
    begin: str | None,
    found: list[_Channel],
    left_out: dict[str, list[str]],
) -> None:
    """Add the channels of a submatrix to `found`, what is none to `left_out`."""

    def reading(source: Source) -> Read:
        reader = _reader(path, [source])
        return lambda first, last: _first_block(reader, 0, first, last)

    try:
        axis, reason = axis_of(columns, reading), ""
    except NoTimeSignalError as error:
        axis, reason = Axis(None), str(error)
    for column in columns:
        why = column.reason or reason
        if column is axis.column or (reason and column.independent):
            continue
        if column.source is None or why:
            left_out.setdefault(why, []).append(column.name)
        elif column.source.n_values == 0:
            left_out.setdefault("it holds no values", []).append(column.name)
        else:
            found.append(_Channel(column, column.source, axis, begin))


def _left_out(left_out: dict[str, list[str]]) -> Iterator[str]:
    for reason, names in left_out.items():
        shown = ", ".join(repr(name) for name in names[:MAX_NAMES_IN_A_FLAG])
        more = f" and {len(names) - MAX_NAMES_IN_A_FLAG} more" if len(names) > MAX_NAMES_IN_A_FLAG else ""
        yield f"{shown}{more} {'is' if len(names) == 1 else 'are'} left out: {reason}"


def _first_block(reader: AtfxReader, column: int, start: int, stop: int) -> NDArray[np.float64]:
    (block,) = reader.blocks([column], start, stop, stop - start)
    return block[0]


def _reader(path: Path, sources: Sequence[Source]) -> AtfxReader:
    names = dict.fromkeys(
        part.name for source in sources for part in chain(source.parts, source.flags) if isinstance(part, Component)
    )
    identities = [("", *_identity(path, path)), *((name, *_identity(path, path.parent / name)) for name in names)]
    return AtfxReader(path, tuple(sources), tuple(identities))


def _log_channel(item: _Channel, name: str, shift_s: float, more: Sequence[str]) -> LogChannel:
    column, axis = item.column, item.axis
    raster = Raster(
        axis.sample_rate_hz, item.source.n_values, axis.start_s + shift_s, sample_rate_raw_hz=axis.sample_rate_raw_hz
    )
    return LogChannel(
        name,
        raster,
        unit=column.unit.name,
        quantity=quantity_of_unit(column.unit.name),
        full_scale=column.full_scale,
        limits=column.limits,
        flags=(*column.flags, *axis.flags, *more),
    )


def _range_flags(reader: AtfxReader, number: int, column: Column) -> Iterator[str]:
    """Flag a channel whose first values are outside the range that the file states: swapped bytes, a wrong scaling."""
    source = reader.sources[number]
    if column.stated_range is None or isinstance(source.parts[0], Implicit):
        return
    low, high = column.stated_range
    first = _first_block(reader, number, 0, min(CHECKED_VALUES, source.n_values))
    slack = 1e-3 * (high - low)
    outside = first[(first < low - slack) | (first > high + slack)]
    if outside.size:
        yield (
            f"the file says that its values are between {low:g} and {high:g}, but one of the first is {outside[0]:g}: "
            "the byte order or the scaling may be wrong"
        )


def _begin(graph: Graph, submatrix: Instance | None) -> str | None:
    if submatrix is None:
        return None
    measurement = graph.only(submatrix, "measurement", "aomeasurement", "submatrices")
    return None if measurement is None else measurement.attributes.get("measurement_begin") or None


def _measurements(graph: Graph) -> Iterator[tuple[str, str]]:
    names = dict.fromkeys(item.attributes.get("name", "") for item in graph.of("aomeasurement"))
    shown = [name for name in names if name][:MAX_NAMES_IN_A_FLAG]
    if shown:
        yield "measurement", ", ".join(shown)


def _starts(begins: Sequence[str | None], flags: list[str]) -> tuple[str | None, list[float], list[tuple[str, str]]]:
    """Start of the log, how much later each channel's measurement began, and what to say of it."""
    none = [0.0] * len(begins)
    texts = list(dict.fromkeys(begins))
    moments = {text: moment_of(text) for text in texts if text is not None}
    for text, moment in moments.items():
        if moment is None:
            flags.append(f"measurement_begin {text[:40]!r} is no instant to the second: it is not used")
    known = [moment for moment in moments.values() if moment is not None]
    if not known:
        return None, none, []
    if len(known) < len(texts):
        flags.append("not all measurements state when they began: none of the starts is taken")
        return None, none, []
    start = min(known)
    shifts = [(moments[text] - start).total_seconds() for text in begins]  # type: ignore[index, operator]
    note = ("measurement_begin", f"{next(text for text in texts if moments[text] == start)} (time zone not stated)")  # type: ignore[index]
    return start.isoformat(), shifts, [note]


def moment_of(text: str) -> datetime | None:
    """Return the instant of an ODS date, YYYYMMDDhhmmss and any decimals of a second; None where it is none.

    Examples
    --------
    >>> moment_of("20141007171440250").isoformat()
    '2014-10-07T17:14:40.250000'
    """
    match = re.fullmatch(r"(\d{4})(\d\d)(\d\d)(\d\d)(\d\d)(\d\d)(\d{0,9})", text.strip(), re.ASCII)
    if match is None:
        return None
    year, month, day, hour, minute, second = (int(group) for group in match.groups()[:6])
    try:
        moment = datetime(year, month, day, hour, minute, second, int(match[7][:6].ljust(6, "0")))
    except ValueError:
        return None
    return None if year in UNSET_YEARS and moment == datetime(year, 1, 1) else moment

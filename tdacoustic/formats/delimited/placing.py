"""Where the rows of a large text begin, without reading all of it.

A text whose time column rises evenly says itself which row stands where: some thousand short looks at it place its
rows, and its last line gives their number. That the rows between are as even is checked while they are read
(`tdacoustic.formats.delimited.time_column.TimeCheck`), as is that each has all its fields (`open_checked`). Where that
does not work, and in a text without a time, line ends are counted; where lines and rows may differ, nothing is placed
and the rows are counted one by one.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from tdacoustic.formats.delimited.layout import Layout, is_number, split_row
from tdacoustic.formats.delimited.rows import MAX_LINE_BYTES, RowChecker, Rows
from tdacoustic.formats.delimited.stream import decoded, open_text_bytes
from tdacoustic.formats.delimited.time_column import find_time_field, nanoseconds_of, seconds_of, written_resolution

__all__ = ["open_checked", "place_rows"]

LARGE_BYTES = 64 << 20
"""From here on: counting the rows of less takes a third of a second."""
HEAD_BYTES = 1 << 20
LOOK_BYTES = 1 << 16
LOOKS = 2048
LEAST_APART = 4 << 20
LINES_A_LOOK = 8
CHUNK_BYTES = 4 << 20
CHECKED_BYTES = 1 << 20
NEAR_ROW = 0.25
"""Part of a row by which a time may miss one and still tell which it is."""
EVEN_BYTES = 1.25
"""Bytes a row between two looks, over those of all rows: beyond, rows are missing or are no rows."""


@dataclass(frozen=True)
class _Look:
    """Lines from an offset on: the offset of the first, and the cells of the time of all."""

    offset: int
    cells: tuple[str, ...]


def place_rows(path: Path, layout: Layout) -> Rows | None:
    """Return the rows of a large text, not checked yet; None where they must be counted one by one.

    Parameters
    ----------
    path : Path
    layout : Layout
    """
    size = path.stat().st_size
    if size - layout.offset < LARGE_BYTES or layout.quoted or layout.encoding.startswith("utf-16"):
        return None
    with path.open("rb") as stream:
        return _by_time(stream, layout, size) or _by_line_ends(stream, layout)


# ---------------------------------------------------------------- by the time column


def _by_time(stream: BinaryIO, layout: Layout, size: int) -> Rows | None:
    found = find_time_field(layout)
    if found is None or not found[3]:
        return None
    field, _, kind, _ = found
    head = _look(stream, layout, field, layout.offset, HEAD_BYTES, at_line=True, most=1 << 30)
    tail = _tail(stream, layout, field, size)
    if head is None or tail is None or len(head.cells) < 2:
        return None
    looks = [_look(stream, layout, field, offset, LOOK_BYTES) for offset in _places(layout.offset, size)]
    if any(look is None for look in looks):
        return None
    every = [*(look for look in looks if look is not None and look.offset < tail.offset), tail]
    times = _seconds([head.cells[0], head.cells[-1], *(look.cells[0] for look in every)], kind)
    rows = _rows_of(head, every, times)
    if rows is None or not _even(layout.offset, rows):
        return None
    stream.seek(size - 1)
    last = rows[-1][0]
    return Rows(last + 1, ((0, layout.offset), *rows), stream.read(1) == b"\n", checked=False)


def _places(offset: int, size: int) -> Iterator[int]:
    """Offsets to look at: ever farther from the beginning, then evenly."""
    apart = max(LEAST_APART, (size - offset) // LOOKS)
    place = HEAD_BYTES
    while place < apart:
        yield offset + place
        place *= 4
    yield from range(offset + apart, size - LOOK_BYTES, apart)


def _look(
    stream: BinaryIO,
    layout: Layout,
    field: int,
    offset: int,
    n_bytes: int,
    *,
    at_line: bool = False,
    most: int = LINES_A_LOOK,
) -> _Look | None:
    """The first whole lines from an offset on; None where they are no rows."""
    stream.seek(offset)
    lines = stream.read(n_bytes).split(b"\n")
    if not at_line:
        offset += len(lines[0]) + 1
        lines = lines[1:]
    cells = _cells(lines[:-1][:most], layout, field)
    return None if cells is None else _Look(offset, cells)


def _tail(stream: BinaryIO, layout: Layout, field: int, size: int) -> _Look | None:
    """The last row, with the times of some rows before it, last first."""
    begin = max(layout.offset, size - HEAD_BYTES)
    stream.seek(begin)
    text = stream.read(size - begin)
    lines = text.rstrip(b"\r\n\t ").split(b"\n")[1:]
    cells = _cells(lines[-LINES_A_LOOK:], layout, field)
    if cells is None:
        return None
    return _Look(begin + len(text.rstrip(b"\r\n\t ")) - len(lines[-1]), cells[::-1])


def _cells(lines: list[bytes], layout: Layout, field: int) -> tuple[str, ...] | None:
    """Cells of the time; None where there is no line, or one without all fields."""
    rows = [split_row(decoded(line, layout.encoding).strip("\r\n"), layout.delimiter) for line in lines]
    if not rows or any(len(row) != layout.n_fields for row in rows):
        return None
    cells = tuple(row[field] for row in rows)
    if layout.numeric[field]:
        if not all(is_number(cell, layout.decimal) for cell in cells):
            return None
        cells = tuple(cell.replace(",", ".") for cell in cells)
    return cells


def _seconds(cells: list[str], kind: str) -> NDArray[np.float64]:
    if kind == "number":
        return np.array([float(cell) for cell in cells])
    return seconds_of(cells, nanoseconds_of(cells[:1])[0])


def _rows_of(head: _Look, looks: list[_Look], times: NDArray[np.float64]) -> tuple[tuple[int, int], ...] | None:
    """Row and offset of each look; None where a time leaves a doubt.

    Each row that is known makes the step finer, and so reaches farther.
    """
    first, known = float(times[0]), float(times[1])
    row = len(head.cells) - 1
    resolution = written_resolution(head.cells[:LINES_A_LOOK] + head.cells[-LINES_A_LOOK:])
    found: list[tuple[int, int]] = []
    for look, time in zip(looks, times[2:], strict=True):
        resolution = max(resolution, written_resolution(look.cells))
        step = (known - first) / row
        if not (np.isfinite(time) and step > 0.0 and time > known):
            return None
        place = (float(time) - first) / step
        doubt = 2.0 * resolution / (known - first) * place + resolution / step
        if doubt > NEAR_ROW or abs(place - round(place)) > NEAR_ROW:
            return None
        row, known = round(place), float(time)
        found.append((row, look.offset))
    return tuple(found)


def _even(offset: int, rows: tuple[tuple[int, int], ...]) -> bool:
    """Whether as many bytes make a row everywhere."""
    places = np.array([(0, offset), *rows], dtype=np.float64)
    lengths = np.diff(places[:, 1]) / np.diff(places[:, 0])
    whole = (places[-1, 1] - places[0, 1]) / places[-1, 0]
    long = np.diff(places[:, 1]) > LOOK_BYTES
    return bool(np.all(np.abs(np.log(lengths[long] / whole)) < np.log(EVEN_BYTES)))


# ---------------------------------------------------------------- by line ends


def _by_line_ends(stream: BinaryIO, layout: Layout) -> Rows | None:
    """Count line ends before the last content, as empty lines at the end do not count; None where a line has none."""
    stream.seek(layout.offset)
    blanks = b"\r\n " if layout.delimiter == "\t" else b"\r\n\t "
    offset, ends, n_rows, last = layout.offset, 0, 0, b""
    begun = offset  # where the newest line begins
    checkpoints: list[tuple[int, int]] = [(0, offset)]
    while chunk := stream.read(CHUNK_BYTES):
        text = chunk.rstrip(blanks)
        begin = text.rfind(b"\n") + 1
        before = ends + text.count(b"\n")
        newest = chunk.rfind(b"\n") + 1
        begun = offset + newest if newest else begun
        if offset + len(chunk) - begun > MAX_LINE_BYTES:
            return None
        if text:
            n_rows = before + 1
        if begin:
            checkpoints.append((before, offset + begin))
        ends += chunk.count(b"\n")
        offset, last = offset + len(chunk), chunk[-1:]
    return Rows(n_rows, tuple(checkpoints), last == b"\n", checked=False)


# ---------------------------------------------------------------- checking while reading


def open_checked(path: Path, layout: Layout, row: int, offset: int) -> BinaryIO:
    """Open a text at a row; what is read of it is checked to have all fields in each line.

    Parameters
    ----------
    path : Path
    layout : Layout
    row, offset : int
        Where to begin.
    """
    stream = open_text_bytes(path, layout.encoding, offset)
    return io.BufferedReader(_CheckedLines(stream, RowChecker(path, layout, row, offset)), CHECKED_BYTES)


class _CheckedLines(io.RawIOBase):
    """A stream of lines that refuses one with too few or too many fields."""

    def __init__(self, stream: BinaryIO, checker: RowChecker) -> None:
        self._stream, self._checker, self._carry = stream, checker, b""

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        """Read what the stream gives, and check the lines that it completes."""
        data = self._stream.read(len(buffer))
        buffer[: len(data)] = data
        self._carry += data
        cut = self._carry.rfind(b"\n") + 1 if data else len(self._carry)
        if cut:
            self._checker.add(self._carry[:cut])
            self._carry = self._carry[cut:]
        return len(data)

    def close(self) -> None:
        """Close the stream too."""
        self._stream.close()
        super().close()

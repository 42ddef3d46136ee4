"""Counting the rows of a text, and checking that each has all its fields."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tdacoustic.errors import FormatError
from tdacoustic.formats.delimited.layout import WHITESPACE, Layout
from tdacoustic.formats.delimited.stream import open_text_bytes

__all__ = ["RowChecker", "Rows", "count_rows"]

CHUNK_BYTES = 4 << 20
MAX_LINE_BYTES = 16 << 20
LF, CR, BLANK, QUOTE = 10, 13, 32, 34


@dataclass(frozen=True)
class Rows:
    """How many rows there are, and where some of them begin.

    Parameters
    ----------
    n_rows : int
    checkpoints : tuple of (int, int)
        Row and byte offset, ascending; begins with the first row.
    ends_in_newline : bool
    checked : bool
        Whether each row is known to have all its fields.
    """

    n_rows: int
    checkpoints: tuple[tuple[int, int], ...]
    ends_in_newline: bool
    checked: bool = True

    def before(self, row: int) -> tuple[int, int]:
        """Last checkpoint at or before a row."""
        from bisect import bisect_right

        return self.checkpoints[bisect_right(self.checkpoints, (row, 1 << 62)) - 1]


def count_rows(path: Path, layout: Layout) -> Rows:
    """Count the rows to the file's end, in pieces.

    Empty lines at the end do not count; a last line without a line end does.

    Raises
    ------
    FormatError
        A row with too few or too many fields, an empty line among the rows, a quote that is not closed; names the line.
    """
    counter = RowChecker(path, layout)
    carry = b""
    ends_in_newline = True
    with open_text_bytes(path, layout.encoding, layout.offset) as stream:
        while chunk := stream.read(CHUNK_BYTES):
            ends_in_newline = chunk.endswith(b"\n")
            carry += chunk
            cut = carry.rfind(b"\n") + 1
            if cut:
                counter.add(carry[:cut])
                carry = carry[cut:]
            elif len(carry) > MAX_LINE_BYTES:
                raise FormatError(
                    f"{path}: line {layout.first_line + counter.rows} is longer than {MAX_LINE_BYTES} bytes"
                )
    if carry:
        counter.add(carry)
    return Rows(counter.rows, tuple(counter.checkpoints), ends_in_newline)


class RowChecker:
    """Counts rows in pieces of whole lines, and refuses one that has not all its fields.

    Parameters
    ----------
    path : Path
    layout : Layout
    row, offset : int or None
        Of the first line; None is that of the text.
    """

    def __init__(self, path: Path, layout: Layout, row: int = 0, offset: int | None = None) -> None:
        self.path, self.layout = path, layout
        self.rows, self.offset = row, layout.offset if offset is None else offset
        self.checkpoints: list[tuple[int, int]] = [(0, layout.offset)]
        self._blank_pending = False
        self._strip = b"\r\n " if layout.delimiter == "\t" else b"\r\n\t "
        self._seekable = not layout.encoding.startswith("utf-16")

    def add(self, lines: bytes) -> None:
        """Count some more lines, the last of which may be without its end."""
        content = lines.rstrip(self._strip)
        if content:
            if self._blank_pending:
                raise FormatError(f"{self.path}: line {self.layout.first_line + self.rows} is empty, rows follow it")
            if self.rows and self._seekable:
                self.checkpoints.append((self.rows, self.offset))
            n_rows = content.count(b"\n") + 1
            if self.layout.quoted and b'"' in content:
                self._refuse_open_quote(content)
            if not self._fields_are_right(content):
                self._refuse(content)
            self.rows += n_rows
        self._blank_pending = self._blank_pending or lines[len(content) :].count(b"\n") > (1 if content else 0)
        self.offset += len(lines)

    def _fields_are_right(self, content: bytes) -> bool:
        """Whether every row has as many fields as the first; every n-th mark must then be a line's end."""
        layout = self.layout
        if layout.quoted or layout.n_fields == 1:
            return bool((_fields(content, layout) == layout.n_fields).all())
        codes = np.frombuffer(content, np.uint8)
        if layout.delimiter == WHITESPACE:
            period, between = layout.n_fields + 1, _begins_of_words(codes)
        else:
            period, between = layout.n_fields, codes == ord(layout.delimiter)
        marks = codes[between | (codes == LF)]
        ends = marks == LF
        rows, rest = divmod(len(marks) + 1, period)
        return rest == 0 and int(np.count_nonzero(ends)) == rows - 1 and bool(ends[period - 1 :: period].all())

    def _refuse_open_quote(self, content: bytes) -> None:
        """Raise where a line opens a quote and does not close it: all that follows would be one cell."""
        codes = np.frombuffer(content, np.uint8)
        total = np.concatenate([[0], np.cumsum(codes == QUOTE)])
        ends = np.append(np.flatnonzero(codes == LF), len(codes))
        odd = np.flatnonzero(np.diff(total[ends], prepend=0) % 2)
        if odd.size:
            line = self.layout.first_line + self.rows + int(odd[0])
            raise FormatError(f"{self.path}: line {line}: a quote is opened and not closed")

    def _refuse(self, content: bytes) -> None:
        fields = _fields(content, self.layout)
        wrong = np.flatnonzero(fields != self.layout.n_fields)
        if not wrong.size:
            return
        row = int(wrong[0])
        line = self.layout.first_line + self.rows + row
        if not content.split(b"\n", row + 1)[row].strip():
            raise FormatError(f"{self.path}: line {line} is empty, rows follow it")
        raise FormatError(
            f"{self.path}: line {line} has {fields[row]} fields, the rows before it {self.layout.n_fields}"
        )


def _fields(content: bytes, layout: Layout) -> np.ndarray:
    """Fields of each line."""
    codes = np.frombuffer(content, np.uint8)
    ends = np.append(np.flatnonzero(codes == LF), len(codes))
    if layout.delimiter == WHITESPACE:
        marks = _begins_of_words(codes)
        extra = 0
    else:
        marks = codes == ord(layout.delimiter)
        if layout.quoted:
            marks &= np.cumsum(codes == QUOTE) % 2 == 0
        extra = 1
    total = np.concatenate([[0], np.cumsum(marks)])
    begins = np.concatenate([[0], ends[:-1] + 1])
    fields: np.ndarray = total[ends] - total[begins] + extra
    if layout.n_fields == 1:
        empty = (ends == begins) | ((ends == begins + 1) & (codes[np.minimum(begins, len(codes) - 1)] == CR))
        fields = np.where(empty, 0, 1)
    return fields


def _begins_of_words(codes: np.ndarray) -> np.ndarray:
    ink = codes > BLANK
    ink[1:] &= ~(codes[:-1] > BLANK)
    return ink

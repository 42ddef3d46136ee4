"""The values of a data set 58, in blocks: binary, ASCII in lines of one length, ASCII in any lines."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Protocol

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FormatError

__all__ = ["AsciiValues", "BinaryValues", "LooseValues", "Values", "count_loose_values", "parse_fixed"]

SLAB_VALUES = 1 << 18
LF, ZERO, NINE, MINUS, PLUS, BLANK, POINT = (ord(character) for character in "\n09-+ .")
EXACT_POWERS = 10.0 ** np.arange(23)
LOOSE_NUMBER = re.compile(rb"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?|[+-]?nan|[+-]?inf(?:inity)?", re.IGNORECASE)


class Values(Protocol):
    """Where the values of a record are."""

    def pieces(
        self, path: Path, stream: BinaryIO, start: int, stop: int, slab: int = SLAB_VALUES
    ) -> Iterator[NDArray[np.float64]]:
        """Yield the values from `start` to `stop`, in pieces of any length.

        Parameters
        ----------
        path : Path
            For messages.
        stream : BinaryIO
            The file; others may move it between two pieces.
        start, stop : int
        slab : int
            About how many values a piece may have.
        """
        ...


@dataclass(frozen=True)
class BinaryValues:
    """Values of a 58b record: `dtype` from `offset` on."""

    offset: int
    dtype: str

    def pieces(
        self, path: Path, stream: BinaryIO, start: int, stop: int, slab: int = SLAB_VALUES
    ) -> Iterator[NDArray[np.float64]]:
        """Yield the values from `start` to `stop`, in pieces of any length; see `Values`.

        Raises
        ------
        FormatError
            The file ends before `stop`.
        """
        width = np.dtype(self.dtype).itemsize
        for first in range(start, stop, slab):
            wanted = min(slab, stop - first)
            stream.seek(self.offset + first * width)
            raw = stream.read(wanted * width)
            if len(raw) != wanted * width:
                raise FormatError(f"{path}: truncated: the file ends at value {first + len(raw) // width}")
            with np.errstate(invalid="ignore"):  # a signalling NaN becomes a quiet one
                values = np.frombuffer(raw, self.dtype).astype(np.float64)
            yield values


@dataclass(frozen=True)
class AsciiValues:
    """Values in columns of `width` characters, `per_line` a line, all lines of `line_bytes` with their end."""

    offset: int
    width: int
    per_line: int
    line_bytes: int

    def pieces(
        self, path: Path, stream: BinaryIO, start: int, stop: int, slab: int = SLAB_VALUES
    ) -> Iterator[NDArray[np.float64]]:
        """Yield the values from `start` to `stop`, in pieces of any length; see `Values`.

        Raises
        ------
        FormatError
            The file ends before `stop`, a line has another length, or a value is no number.
        """
        slab_lines = max(1, slab // self.per_line)
        first_line, last_line = start // self.per_line, -(-stop // self.per_line)
        for line in range(first_line, last_line, slab_lines):
            n_lines = min(slab_lines, last_line - line)
            values = self._lines(path, stream, line, n_lines, stop)
            begin = max(0, start - line * self.per_line)
            yield values[begin : stop - line * self.per_line]

    def _lines(self, path: Path, stream: BinaryIO, line: int, n_lines: int, stop: int) -> NDArray[np.float64]:
        """Values of some whole lines; the very last one may be short."""
        stream.seek(self.offset + line * self.line_bytes)
        raw = stream.read(n_lines * self.line_bytes)
        in_last = min(self.per_line, stop - (line + n_lines - 1) * self.per_line)
        whole = n_lines - 1 if in_last < self.per_line else n_lines
        needed = (n_lines - 1) * self.line_bytes + in_last * self.width
        if len(raw) < needed:
            raise FormatError(
                f"{path}: truncated: the file ends in line {line + len(raw) // self.line_bytes} of a record"
            )
        raw = raw.ljust(n_lines * self.line_bytes, b" ")
        grid = np.frombuffer(raw, np.uint8).reshape(n_lines, self.line_bytes)
        if whole > 1 and not (grid[: whole - 1, -1] == LF).all():
            raise FormatError(f"{path}: the lines of a record are of different length near line {line} of its values")
        fields = grid[:, : self.per_line * self.width].reshape(-1, self.width)
        n_values = whole * self.per_line + (in_last if whole < n_lines else 0)
        return parse_fixed(path, fields[:n_values])


def parse_fixed(path: Path, fields: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Parse decimal numbers in fields of one width.

    Where all have their point, their ``E`` and their digits in the same columns, the digits are summed column by
    column, and scaled by a power of ten that float64 holds exactly, so that the result is correctly rounded.

    Parameters
    ----------
    path : Path
        For messages.
    fields : ndarray of uint8, shape (n, width)

    Raises
    ------
    FormatError
        A field is no number.
    """
    values = _parse_aligned(np.ascontiguousarray(fields.T)) if len(fields) else np.zeros(0)
    if values is not None:
        return values
    texts = np.ascontiguousarray(fields).view(f"S{fields.shape[1]}").ravel()
    if (fields == ord("_")).any():
        raise FormatError(f"{path}: a value of a record is no number: an underscore stands in it")
    try:
        return texts.astype(np.float64)
    except ValueError:
        pass
    try:
        return np.array([_float(text) for text in texts.tolist()])
    except ValueError as error:
        raise FormatError(f"{path}: a value of a record is no number ({error})") from error


def _float(text: bytes) -> float:
    """Read what Fortran prints: ``D`` for ``E``, and no letter at all before an exponent of three digits."""
    text = text.strip().upper().replace(b"D", b"E")
    return float(re.sub(rb"(?<=\d|\.)([+-]\d{3})\Z", rb"E\1", text))


def _parse_aligned(columns: NDArray[np.uint8]) -> NDArray[np.float64] | None:
    """Parse fields given as columns, None where they are not aligned."""
    first = bytes(columns[:, 0])
    match = re.fullmatch(rb"( *)([-+ ]?)(\d*)\.(\d+)[eEdD]([-+])(\d{2,3})( *)", first)
    if match is None or match.end(4) - match.start(3) > 16 or match.start(3) < 1:
        return None
    is_digit = (columns >= ZERO) & (columns <= NINE)
    digit_columns = [*range(match.start(3), match.end(3)), *range(match.start(4), match.end(4))]
    exponent_columns = list(range(match.start(6), match.end(6)))
    if not is_digit[digit_columns + exponent_columns].all() or not (columns[match.end(3)] == POINT).all():
        return None
    if not ((columns[match.end(4)] | 32) == (first[match.end(4)] | 32)).all():
        return None
    sign_column, exponent_sign = columns[match.start(3) - 1], columns[match.start(5)]
    blank = columns[: match.start(3) - 1]
    if not np.isin(sign_column, (MINUS, PLUS, BLANK)).all() or not (blank == BLANK).all():
        return None
    if not np.isin(exponent_sign, (MINUS, PLUS)).all() or not (columns[match.end(6) :] == BLANK).all():
        return None
    mantissa = np.zeros(columns.shape[1])
    for column in digit_columns:
        mantissa *= 10.0
        mantissa += columns[column] - np.uint8(ZERO)
    exponent = np.zeros(columns.shape[1], np.int64)
    for column in exponent_columns:
        exponent *= 10
        exponent += columns[column] - np.uint8(ZERO)
    exponent = np.where(exponent_sign == MINUS, -exponent, exponent) - (match.end(4) - match.start(4))
    if mantissa.max() >= 2.0**53 or ((np.abs(exponent) > 22) & (mantissa != 0.0)).any():
        return None
    power = EXACT_POWERS[np.minimum(np.abs(exponent), 22)]
    values = np.where(exponent < 0, mantissa / power, mantissa * power)
    return np.where(sign_column == MINUS, -values, values)


def _line_values(line: bytes, width: int) -> list[float]:
    """Values of a line: in columns where it divides into such, else in words."""
    bare = line.rstrip()
    if bare and len(bare) % width == 0:
        cells = [bare[at : at + width].strip() for at in range(0, len(bare), width)]
        if all(LOOSE_NUMBER.fullmatch(cell) for cell in cells):
            return [float(cell.upper().replace(b"D", b"E")) for cell in cells]
    cells = bare.split()
    if not all(LOOSE_NUMBER.fullmatch(cell) for cell in cells):
        raise ValueError("a word that is no number")
    return [float(cell.upper().replace(b"D", b"E")) for cell in cells]


def count_loose_values(
    path: Path, stream: BinaryIO, start: int, stop: int, width: int
) -> tuple[int, tuple[tuple[int, int], ...]]:
    """Count the values between two offsets line by line.

    Returns
    -------
    int
    tuple of (int, int)
        Value and offset of the beginning of some lines.

    Raises
    ------
    FormatError
        Something is no number.
    """
    stream.seek(start)
    position, count = start, 0
    checkpoints = [(0, start)]
    while position < stop:
        line = stream.readline(min(1 << 16, stop - position))
        if not line:
            break
        try:
            count += len(_line_values(line, width))
        except ValueError as error:
            raise FormatError(f"{path}: byte {position}: {line.strip()[:40]!r} is no row of numbers") from error
        position += len(line)
        if count - checkpoints[-1][0] >= SLAB_VALUES:
            checkpoints.append((count, position))
    return count, tuple(checkpoints)


@dataclass(frozen=True)
class LooseValues:
    """Values in lines of any length, found again from `checkpoints`."""

    checkpoints: tuple[tuple[int, int], ...]
    width: int

    def pieces(
        self, path: Path, stream: BinaryIO, start: int, stop: int, slab: int = SLAB_VALUES
    ) -> Iterator[NDArray[np.float64]]:
        """Yield the values from `start` to `stop`, in pieces of any length; see `Values`.

        Raises
        ------
        FormatError
            The file ends before `stop`.
        """
        count, offset = [point for point in self.checkpoints if point[0] <= start][-1]
        held: list[float] = []
        stream.seek(offset)
        while count + len(held) < stop:
            line = stream.readline(1 << 16)
            if not line:
                raise FormatError(f"{path}: truncated: the file ends at value {count + len(held)} of a record")
            offset += len(line)
            try:
                held += _line_values(line, self.width)
            except ValueError as error:
                raise FormatError(
                    f"{path}: {line.strip()[:40]!r} is no row of numbers: the file has changed"
                ) from error
            if len(held) >= slab:
                yield np.array(held[max(0, start - count) : stop - count])
                count, held = count + len(held), []
                stream.seek(offset)  # others read from the same stream in between
        if held:
            yield np.array(held[max(0, start - count) : stop - count])

"""The numbers of a local column, in blocks: from a component file, from the XML itself, or computed.

Numbers in a component file may lie in blocks: `per_block` values one after the other, the next of them `block_size`
bytes further, and other columns between. Columns that share their blocks are read together.
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

__all__ = ["Component", "Implicit", "Inline", "Part", "component_pieces", "find_inline", "pieces"]

SLAB_BYTES = 1 << 20
"""What is read at a time from a component file; a block that is longer is not read whole."""
CHUNK_BYTES = 1 << 18
CHECKPOINT_VALUES = 1 << 16
MAX_NUMBER = 64
"""Characters of a number in the XML."""
NUMBER = re.compile(rb"[+-]?(?:(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|nan|inf(?:inity)?)", re.IGNORECASE)
PLAIN_NUMBERS = b"0123456789.eE+- \t\r\n"


@dataclass(frozen=True)
class Component:
    """Values in a component file.

    Parameters
    ----------
    name : str
        Of the file, beside the log.
    dtype : str
        numpy's, with the byte order.
    address : int
        Offset of the first value.
    n_values : int
    block_size : int
        Bytes from one block to the next.
    per_block : int
        Values of a block, one after the other.
    """

    name: str
    dtype: str
    address: int
    n_values: int
    block_size: int
    per_block: int

    @property
    def width(self) -> int:
        """Bytes of a value."""
        return np.dtype(self.dtype).itemsize

    @property
    def end(self) -> int:
        """Offset behind the last value."""
        if self.n_values == 0:
            return self.address
        block, place = divmod(self.n_values - 1, self.per_block)
        return self.address + block * self.block_size + (place + 1) * self.width

    @property
    def is_interleaved(self) -> bool:
        """Whether others may lie between its values, in blocks short enough to be read whole."""
        return not self.is_flat and self.block_size <= SLAB_BYTES

    @property
    def is_flat(self) -> bool:
        """Whether all its values lie one after the other."""
        return self.per_block >= self.n_values or self.block_size == self.per_block * self.width


@dataclass(frozen=True)
class Inline:
    """Values in the XML: where their text lies, and the offsets of some of them.

    Parameters
    ----------
    end : int
        Offset behind the text.
    n_values : int
    checkpoints : tuple of (int, int)
        Index and offset, the first one 0 and the begin of the text.
    """

    end: int
    n_values: int
    checkpoints: tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class Implicit:
    """Values ``first + index * step``."""

    first: float
    step: float
    n_values: int


Part = Component | Inline | Implicit


def pieces(
    path: Path, stream: BinaryIO, part: Part, start: int, stop: int, slab_bytes: int = SLAB_BYTES
) -> Iterator[NDArray[np.float64]]:
    """Yield the values of a part from `start` to `stop`, in pieces of any length.

    Parameters
    ----------
    path : Path
        For messages.
    stream : BinaryIO
        The component file, or the log itself; others may move it between two pieces.
    part : Component, Inline or Implicit
    start, stop : int
    slab_bytes : int
        About what a piece may take.

    Raises
    ------
    FormatError
        A file ends before `stop`, or something is no number.
    """
    if isinstance(part, Component):
        for arrays in component_pieces(path, stream, [part], start, stop, slab_bytes):
            yield arrays[0]
    elif isinstance(part, Inline):
        yield from _inline_pieces(path, stream, part, start, stop)
    else:
        n_piece = max(1, slab_bytes // 8)
        for first in range(start, stop, n_piece):
            index = np.arange(first, min(first + n_piece, stop), dtype=np.float64)
            yield part.first + part.step * index


def component_pieces(
    path: Path, stream: BinaryIO, members: Sequence[Component], start: int, stop: int, slab_bytes: int = SLAB_BYTES
) -> Iterator[list[NDArray[np.float64]]]:
    """Yield the values of components that lie in the same blocks, one array each, in pieces of any length.

    Parameters
    ----------
    path, stream, start, stop, slab_bytes
        See `pieces`.
    members : sequence of Component
        Alike in all but `address` and `dtype`; their addresses less than a block apart.

    Raises
    ------
    FormatError
        The file ends before `stop`.
    """
    first = members[0]
    if len(members) == 1 and (first.is_flat or first.block_size > slab_bytes):
        for address, count in _runs(first, start, stop, max(1, slab_bytes // first.width)):
            raw = _read(path, stream, first.name, address, count * first.width)
            yield [_as_float64(np.frombuffer(raw, first.dtype))]
        return
    base = min(member.address for member in members)
    n_rows = max(1, slab_bytes // first.block_size)
    for row in range(start // first.per_block, -(-stop // first.per_block), n_rows):
        yield _rows(path, stream, members, base, row, n_rows, start, stop)


def _rows(
    path: Path,
    stream: BinaryIO,
    members: Sequence[Component],
    base: int,
    row: int,
    n_rows: int,
    start: int,
    stop: int,
) -> list[NDArray[np.float64]]:
    """Values of some blocks, from the block `row` on."""
    size, per_block = members[0].block_size, members[0].per_block
    n_rows = min(n_rows, -(-stop // per_block) - row)
    in_last = min(per_block, stop - (row + n_rows - 1) * per_block)
    needed = (n_rows - 1) * size + max(member.address - base + in_last * member.width for member in members)
    raw = _read(path, stream, members[0].name, base + row * size, needed)
    whole = (n_rows - 1) * size + max(member.address - base + per_block * member.width for member in members)
    buffer = raw.ljust(whole, b"\0")  # the last block of a file may be cut short behind its last value
    begin, end = max(0, start - row * per_block), min(n_rows * per_block, stop - row * per_block)
    arrays = []
    for member in members:
        grid: NDArray[np.generic] = np.ndarray(
            (n_rows, per_block), member.dtype, buffer, member.address - base, (size, member.width)
        )
        arrays.append(_as_float64(grid).reshape(-1)[begin:end])
    return arrays


def _as_float64(stored: NDArray[np.generic]) -> NDArray[np.float64]:
    with np.errstate(invalid="ignore"):  # a signalling NaN becomes a quiet one
        return stored.astype(np.float64)


def _runs(part: Component, start: int, stop: int, longest: int) -> Iterator[tuple[int, int]]:
    """Address and number of values that lie one after the other."""
    joined = part.block_size == part.per_block * part.width
    at = start
    while at < stop:
        block, place = divmod(at, part.per_block)
        count = min(longest, stop - at) if joined else min(longest, stop - at, part.per_block - place)
        yield part.address + block * part.block_size + place * part.width, count
        at += count


def _read(path: Path, stream: BinaryIO, name: str, address: int, n_bytes: int) -> bytes:
    stream.seek(address)
    raw = stream.read(n_bytes)
    if len(raw) != n_bytes:
        raise FormatError(
            f"{path}: truncated: its component file {name!r} ends {n_bytes - len(raw)} bytes before the values do"
        )
    return raw


def find_inline(path: Path, stream: BinaryIO, start: int, end: int) -> Inline:
    """Count the numbers of an element of the XML, without reading them as numbers.

    Parameters
    ----------
    path : Path
    stream : BinaryIO
    start, end : int
        Offsets of its opening tag and of its closing tag.
    """
    stream.seek(start)
    tag = stream.read(min(1 << 12, max(0, end - start)))
    begin = start + tag.find(b">") + 1 if b">" in tag else end
    checkpoints = [(0, begin)]
    count, position, before = 0, begin, True
    stream.seek(begin)
    while position < end:
        chunk = np.frombuffer(stream.read(min(CHUNK_BYTES, end - position)), np.uint8)
        if not chunk.size:
            raise FormatError(f"{path}: truncated: the file ends at byte {position}")
        blank = chunk <= 32
        begins = np.flatnonzero(~blank & np.concatenate([[before], blank[:-1]]))
        if begins.size and count - checkpoints[-1][0] >= CHECKPOINT_VALUES:
            checkpoints.append((count, position + int(begins[0])))
        count += int(begins.size)
        before = bool(blank[-1])
        position += chunk.size
    return Inline(end, count, tuple(checkpoints))


def _inline_pieces(path: Path, stream: BinaryIO, part: Inline, start: int, stop: int) -> Iterator[NDArray[np.float64]]:
    count, position = [point for point in part.checkpoints if point[0] <= start][-1]
    rest = b""
    while count < stop:
        stream.seek(position)
        chunk = stream.read(min(CHUNK_BYTES, part.end - position))
        position += len(chunk)
        text = rest + chunk
        if not chunk:
            words, rest = text.split(), b""
        else:
            cut = max(text.rfind(blank) for blank in (b" ", b"\n", b"\t", b"\r")) + 1
            words, rest = text[:cut].split(), text[cut:]
            if len(rest) > MAX_NUMBER:
                raise FormatError(f"{path}: {rest[:40]!r} among its values is no number")
        if words:
            begin, end = max(0, start - count), min(len(words), stop - count)
            if begin < end:
                yield numbers_of(path, words[begin:end])
            count += len(words)
        elif not chunk:
            raise FormatError(f"{path}: truncated: {part.n_values} values were found, {count} are there now")


def numbers_of(path: Path, words: Sequence[bytes]) -> NDArray[np.float64]:
    """Read decimal numbers.

    Raises
    ------
    FormatError
        One is none.
    """
    joined = b" ".join(words)
    if joined.translate(None, PLAIN_NUMBERS) or max(map(len, words)) > MAX_NUMBER:
        wrong = next((word for word in words if len(word) > MAX_NUMBER or not NUMBER.fullmatch(word)), None)
        if wrong is not None:
            raise FormatError(f"{path}: {wrong[:40]!r} among its values is no number")
    try:
        return np.fromiter(map(float, words), np.float64, len(words))
    except ValueError as error:
        raise FormatError(f"{path}: a value in its XML is no number ({error})") from error

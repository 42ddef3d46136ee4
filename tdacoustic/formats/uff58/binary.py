"""Where the values of a 58b record end, and what they are, where its header says something else."""

from __future__ import annotations

import re
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FormatError
from tdacoustic.formats.uff58.records import Header58, Record, find_terminator
from tdacoustic.formats.uff58.values import BinaryValues

__all__ = ["behind_values", "binary_values"]

SEARCH_BYTES = 1 << 16
CHECKED_VALUES = 512
LARGEST, SMALLEST = 1e15, 1e-20
"""Beyond these, numbers of a signal are taken for those of another byte order, if in that one none is [assumed]."""
NEXT_RECORD = re.compile(rb"[ \t]*-1[ \t]*\r?\n\s*-1[ \t]*\r?\n[ \t]*\d{1,6}[bB]?[ \t\r\n]")


def binary_values(
    path: Path, stream: BinaryIO, record: Record, header: Header58, offset: int, size: int, label: str
) -> tuple[BinaryValues, int, list[str]]:
    """Find the values of a 58b record.

    Returns
    -------
    BinaryValues
    int
        Offset behind the record.
    list of str
        What is odd about it.

    Raises
    ------
    FormatError
        It claims what is not there, or its values cannot be told from what follows.
    """
    if record.float_format != 2:
        raise FormatError(f"{path}: {label}: float format {record.float_format} is not IEEE 754 (2) and cannot be read")
    if record.byte_order not in (1, 2):
        raise FormatError(f"{path}: {label}: byte order must be 1 or 2, got {record.byte_order}")
    notes: list[str] = []
    width = 8 if header.data_type in (4, 6) else 4
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
    behind = behind_values(stream, offset + n_bytes, size)
    doubled = behind_values(stream, offset + 2 * n_bytes, size) if behind is None and width == 4 else None
    if doubled is not None and offset + 2 * n_bytes <= size:
        notes.append("it says single precision but holds twice the bytes: read as double precision")
        width, n_bytes, behind = 8, 2 * n_bytes, doubled
    if behind is None:
        behind = _behind_stray(path, stream, offset, n_bytes, size, label, notes)
    if not behind[1]:
        notes.append("it has no closing -1")
    order = _order(stream, offset, header.n_values, width, record.byte_order, notes)
    return BinaryValues(offset, f"{order}f{width}"), behind[0], notes


def behind_values(stream: BinaryIO, position: int, size: int) -> tuple[int, bool] | None:
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


def _behind_stray(
    path: Path, stream: BinaryIO, offset: int, n_bytes: int, size: int, label: str, notes: list[str]
) -> tuple[int, bool]:
    """Offset behind a record whose values are followed by bytes that belong to nothing.

    Raises
    ------
    FormatError
        The record has ended before, or its values are not what they were: line ends were changed in them.
    """
    if _a_record_begins(stream, offset, offset + n_bytes):
        raise FormatError(f"{path}: {label} claims {n_bytes} bytes of values, but the next record begins within them")
    end = find_terminator(stream, offset + n_bytes)
    stop = size if end is None else end[0]
    stray = stop - offset - n_bytes
    pairs, bare = _line_ends(stream, offset, stop)
    if pairs and pairs + 2 >= stray and not bare:  # two: the line end before the closing -1
        raise FormatError(
            f"{path}: {label} has {stray} bytes too many, and each LF among its values has a CR: it was transferred as "
            "text, which spoils binary values"
        )
    notes.append(f"{stray} bytes that belong to nothing follow its values")
    return (size, False) if end is None else (end[1], True)


def _a_record_begins(stream: BinaryIO, start: int, stop: int) -> bool:
    """Whether a record ends and another one begins between two offsets."""
    for position in range(start, stop, SEARCH_BYTES):
        stream.seek(position)
        match = NEXT_RECORD.search(stream.read(SEARCH_BYTES + 200))
        if match is not None and position + match.start() < stop:
            return True
    return False


def _line_ends(stream: BinaryIO, start: int, stop: int) -> tuple[int, int]:
    """Count CR LF and LF alone between two offsets."""
    pairs, all_ends, last = 0, 0, b""
    stream.seek(start)
    position = start
    while position < stop:
        chunk = stream.read(min(1 << 20, stop - position))
        if not chunk:
            break
        pairs += (last + chunk).count(b"\r\n")
        all_ends += chunk.count(b"\n")
        last = chunk[-1:] if chunk[-1:] == b"\r" else b""
        position += len(chunk)
    return pairs, all_ends - pairs


def _order(stream: BinaryIO, offset: int, n_values: int, width: int, stated: int, notes: list[str]) -> str:
    """Byte order of the values: the stated one, unless they make sense in the other one alone."""
    order, other = ("<", ">") if stated == 1 else (">", "<")
    sample = b""
    for first in sorted({0, max(0, n_values // 2), max(0, n_values - CHECKED_VALUES)}):
        stream.seek(offset + first * width)
        sample += stream.read(min(CHECKED_VALUES, n_values - first) * width)
    if not _is_signal(np.frombuffer(sample, f"{order}f{width}")) and _is_signal(
        np.frombuffer(sample, f"{other}f{width}")
    ):
        word = "little" if other == "<" else "big"
        notes.append(f"byte order {stated} gives no sensible numbers, the other one does: read as {word}-endian")
        return other
    return order


def _is_signal(values: NDArray[np.floating]) -> bool:
    """Whether numbers could be samples of a signal, by their size."""
    if not np.isfinite(values).all():
        return False
    size = np.abs(values[values != 0.0].astype(np.float64))
    return not size.size or bool(size.max() <= LARGEST and np.mean(size < SMALLEST) < 0.1)

"""Damage to the bytes of a log: anywhere, and where a format keeps its sizes and offsets."""

import re
import struct
from collections.abc import Callable
from dataclasses import dataclass

SIZES = (0, 1, 2, 7, 8, 255, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x7FFFFFFFFFFFFFFF, 0xFFFFFFFFFFFFFFFF)
"""What a size can be that makes trouble."""

MARKS = re.compile(
    rb"TREE|SNOD|HEAP|OHDR|OCHK|GCOL|FRHP|FHIB|FADB|FSHD|BTHD|BTLF|\x89HDF"  # HDF5
    rb"|TDSm|##[A-Z]{2}|MDF     |fmt |data|ds64|LEA |le\d\d|RIFF|RF64|fLaC"  # TDMS, MDF, audio
    rb"|MATLAB 5|IM|MI|\x0e\x00\x00\x00|\x0f\x00\x00\x00|\x06\x00\x00\x00\x08\x00\x00\x00"  # MATLAB 5
    rb"|    58|    -1|<[a-z_/]+|\n"  # UFF, ATFX, texts
)
"""Where a structure of one of the formats begins; its sizes stand behind."""


@dataclass(frozen=True)
class Change:
    """One change: what, where (a part of the whole, or which mark and how far behind it), and with what."""

    what: str
    place: float
    behind: int
    number: int
    text: bytes


def position(blob: bytes, change: Change) -> int:
    """Byte at which a change is made: every second one behind a mark."""
    if change.behind >= 0:
        marks = [match.start() for match in MARKS.finditer(blob[:100_000])]
        if marks:
            return min(len(blob) - 1, marks[int(change.place * (len(marks) - 1))] + change.behind)
    return int(change.place * (len(blob) - 1))


def changed(blob: bytes, change: Change, other: bytes = b"") -> bytes:
    """Return the bytes with one change."""
    if len(blob) < 2:
        return blob
    at = position(blob, change)
    return CHANGES[change.what](blob, at, change, other)


def _flip(blob: bytes, at: int, change: Change, other: bytes) -> bytes:
    return blob[:at] + bytes([blob[at] ^ (1 << change.number % 8)]) + blob[at + 1 :]


def _size(blob: bytes, at: int, change: Change, other: bytes) -> bytes:
    width, order = (1, 2, 4, 8)[change.number % 4], "<>"[change.number // 4 % 2]
    value = SIZES[change.number // 8 % len(SIZES)] & (256**width - 1)
    return blob[:at] + struct.pack(order + "BHIQ"[change.number % 4], value) + blob[at + width :]


def _nudge(blob: bytes, at: int, change: Change, other: bytes) -> bytes:
    width = (1, 2, 4, 8)[change.number % 4]
    held = int.from_bytes(blob[at : at + width], "little")
    step = (1, -1, 8, -8, held or 1, -(held // 2))[change.number // 4 % 6]
    return blob[:at] + ((held + step) % 256**width).to_bytes(width, "little") + blob[at + width :]


def _cut(blob: bytes, at: int, change: Change, other: bytes) -> bytes:
    return blob[: max(1, at)]


def _insert(blob: bytes, at: int, change: Change, other: bytes) -> bytes:
    return blob[:at] + change.text + blob[at:]


def _overwrite(blob: bytes, at: int, change: Change, other: bytes) -> bytes:
    return blob[:at] + change.text + blob[at + len(change.text) :]


def _delete(blob: bytes, at: int, change: Change, other: bytes) -> bytes:
    return blob[:at] + blob[at + 1 + change.number % 300 :]


def _repeat(blob: bytes, at: int, change: Change, other: bytes) -> bytes:
    length = 1 + change.number % 300
    return blob[: at + length] + blob[at : at + length] * (1 + change.number % 5) + blob[at + length :]


def _splice(blob: bytes, at: int, change: Change, other: bytes) -> bytes:
    return blob[:at] + other[min(at, len(other) // 2) :]


CHANGES: dict[str, Callable[[bytes, int, Change, bytes], bytes]] = {
    "flip": _flip, "size": _size, "nudge": _nudge, "cut": _cut, "insert": _insert, "overwrite": _overwrite,
    "delete": _delete, "repeat": _repeat, "splice": _splice,
}  # fmt: skip

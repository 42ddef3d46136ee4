"""The bytes of a group's records: data blocks, lists of them and packed ones, as one run of bytes.

A list of data blocks is gone through without reading the data. What is unpacked is bounded by what the block claims
(at most `MAX_UNPACKED`), and what it claims by what deflate can reach.
"""

from __future__ import annotations

import zlib
from bisect import bisect_right
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Final

import numpy as np

from tdacoustic.errors import FormatError
from tdacoustic.formats.mdf4.walk import HEAD_BYTES, Block, Walk

__all__ = ["Fragment", "Run", "RunReader", "read_run"]

MAX_UNPACKED: Final = 32 << 20
"""Of one packed block; the standard allows 4 MB."""

MAX_RATIO: Final = 1033
"""Deflate makes at most 1032 bytes of one (its manual, *maximum compression factor*)."""

_PLAIN: Final = ("DT", "DV", "DI")
_PACKINGS: Final = {2: "Zstandard", 3: "Zstandard", 4: "LZ4", 5: "LZ4"}


@dataclass(frozen=True)
class Fragment:
    """The bytes of one data block.

    Parameters
    ----------
    start, length : int
        Its place in the run, in bytes as unpacked.
    address : int
        Of its first stored byte.
    packed : int
        Stored bytes where it is packed, else 0.
    columns : int
        Length of the rows that were transposed before packing, 0 for none.
    """

    start: int
    length: int
    address: int
    packed: int = 0
    columns: int = 0


@dataclass(frozen=True)
class Run:
    """One run of bytes.

    Parameters
    ----------
    fragments : tuple of Fragment
    """

    fragments: tuple[Fragment, ...] = ()

    @property
    def length(self) -> int:
        """Bytes in it."""
        return self.fragments[-1].start + self.fragments[-1].length if self.fragments else 0

    @property
    def longest_packed(self) -> int:
        """Bytes of its longest packed block, unpacked."""
        return max((fragment.length for fragment in self.fragments if fragment.packed), default=0)


def read_run(walk: Walk, address: int, open_ended: bool) -> tuple[Run, Run, bool]:
    """Find the data blocks of a data group.

    Parameters
    ----------
    walk : Walk
    address : int
        0 for none.
    open_ended : bool
        The writer did not come to state the length of the last block: it ends with the file.

    Returns
    -------
    values : Run
        Records.
    invalid : Run
        Invalidation bytes where these lie apart.
    apart : bool
        Records and invalidation bytes are stored apart (MDF 4.2, blocks DV and DI).

    Raises
    ------
    FormatError
        Damaged or truncated, or packed in a way that is not read.
    """
    if not address:
        return Run(), Run(), False
    kind = walk.head(address, (*_PLAIN, "DZ", "DL", "LD", "HL"), "data")[0]
    values: list[int] = []
    invalid: list[int] = []
    if kind == "HL":
        address = walk.block(address, ("HL",), "data list").link(0)
        kind = walk.head(address, ("DL", "LD"), "data list")[0] if address else "DL"
    if kind in ("DL", "LD"):
        for block in walk.chain(address, kind, "data list"):
            found = _entries(walk, block)
            values += found[0]
            invalid += found[1]
    else:
        values.append(address)
    if len(set(values) | set(invalid)) < len(values) + len(invalid):
        raise FormatError(f"{walk.path}: damaged: a data block belongs twice to the data at {address:#x}")
    last = max(values, default=0) if open_ended else 0
    run, apart = _run(walk, values, last)
    return run, _run(walk, invalid, 0)[0], apart or kind == "LD"


def _entries(walk: Walk, block: Block) -> tuple[list[int], list[int]]:
    """Return what one list names: data blocks, and blocks of invalidation bytes."""
    if block.kind == "DL":
        (count,) = block.fields("<I", 4)
        found, invalid = block.links[1 : 1 + count], block.links[0:0]
    else:
        flags, count = block.fields("<II")
        found = block.links[1 : 1 + count]
        invalid = block.links[1 + count : 1 + 2 * count] if flags & 0x80000000 else block.links[0:0]
    if len(found) != count or 0 in found or (invalid and len(invalid) != count):
        raise FormatError(
            f"{walk.path}: damaged: the data list at {block.address:#x} claims {count} data blocks and names "
            f"{sum(link > 0 for link in found)}"
        )
    return list(found), [link for link in invalid if link]


def _run(walk: Walk, addresses: list[int], open_ended: int) -> tuple[Run, bool]:
    fragments: list[Fragment] = []
    start = 0
    apart = False
    for address in addresses:
        kind, length, n_links = walk.head(address, (*_PLAIN, "DZ"), "data block")
        offset = HEAD_BYTES + 8 * n_links
        if kind == "DZ":
            walk.check_inside(address, length, "data block")
            fragment = _packed(walk, walk.stream.read(24 + 8 * n_links)[8 * n_links :], address, length, offset, start)
        else:
            if address == open_ended:
                length = walk.size - address
            walk.check_inside(address, max(length, offset), "data block")
            fragment = Fragment(start, length - offset, address + offset)
        apart = apart or kind in ("DV", "DI")
        if fragment.length:
            fragments.append(fragment)
        start += fragment.length
    return Run(tuple(fragments)), apart


def _packed(walk: Walk, head: bytes, address: int, length: int, offset: int, start: int) -> Fragment:
    place = f"{walk.path}: the packed block at {address:#x}"
    if len(head) < 24 or length < offset + 24:
        raise FormatError(f"{place} is too short: damaged")
    packing, columns = head[2], int.from_bytes(head[4:8], "little")
    unpacked, packed = (int.from_bytes(head[at : at + 8], "little") for at in (8, 16))
    if packing in _PACKINGS:
        raise FormatError(f"{place} is packed with {_PACKINGS[packing]}, which is not read: save it with deflate")
    if packing > 1:
        raise FormatError(f"{place} is packed in the unknown way {packing}: damaged")
    if offset + 24 + packed > length:
        raise FormatError(f"{place} claims {packed} bytes, it holds {length - offset - 24}: damaged")
    if unpacked > MAX_UNPACKED or unpacked > MAX_RATIO * packed + 64:
        raise FormatError(
            f"{place} claims {unpacked} bytes packed in {packed}; {MAX_UNPACKED} at most are unpacked, and deflate "
            f"reaches {MAX_RATIO - 1} to 1: damaged, or made to exhaust the memory"
        )
    if packing == 1 and not 0 < columns <= max(unpacked, 1):
        raise FormatError(f"{place} claims rows of {columns} bytes in {unpacked}: damaged")
    return Fragment(start, unpacked, address + offset + 24, max(packed, 1), columns if packing == 1 else 0)


class RunReader:
    """Reads bytes of a run.

    Parameters
    ----------
    path : Path
    stream : BinaryIO
    run : Run
    keeps : bool
        The last block unpacked is kept: nothing is then unpacked twice when read in order.
    """

    def __init__(self, path: Path, stream: BinaryIO, run: Run, keeps: bool = True) -> None:
        self.path, self.stream, self.run, self.keeps = path, stream, run, keeps
        self._starts = [fragment.start for fragment in run.fragments]
        self._kept: tuple[int, bytes] = (-1, b"")

    def read(self, first: int, last: int) -> bytearray:
        """Return the bytes from `first` to `last`.

        Raises
        ------
        FormatError
            The file ends before, or a packed block cannot be unpacked to what it claims.
        """
        found = bytearray(last - first)
        view = memoryview(found)
        index = max(0, bisect_right(self._starts, first) - 1)
        while first < last:
            if index >= len(self.run.fragments):
                raise FormatError(f"{self.path}: damaged: its records end at byte {first}, {last} were asked for")
            fragment = self.run.fragments[index]
            count = min(last, fragment.start + fragment.length) - first
            into = view[len(view) - (last - first) :][:count]
            within = first - fragment.start
            if fragment.packed:
                into[:] = memoryview(self._unpacked(index))[within : within + count]
            else:
                self.stream.seek(fragment.address + within)
                if self.stream.readinto(into) != count:  # type: ignore[attr-defined]  # every binary file has it
                    raise FormatError(
                        f"{self.path}: truncated: the file ends in the data block at {fragment.address:#x}"
                    )
            first += count
            index += 1
        return found

    def _unpacked(self, index: int) -> bytes:
        if self._kept[0] == index:
            return self._kept[1]
        self._kept = (-1, b"")
        fragment = self.run.fragments[index]
        self.stream.seek(fragment.address)
        unpacker = zlib.decompressobj()
        place = f"{self.path}: the packed block at {fragment.address:#x}"
        try:
            found = unpacker.decompress(self.stream.read(fragment.packed), fragment.length + 1)
        except zlib.error as error:
            raise FormatError(f"{place} cannot be unpacked ({error}): damaged") from None
        if len(found) != fragment.length or not unpacker.eof:
            many = "more" if len(found) > fragment.length else len(found)
            raise FormatError(f"{place} claims {fragment.length} bytes, {many} were unpacked: damaged")
        if fragment.columns:
            n_rows = fragment.length // fragment.columns
            whole = n_rows * fragment.columns
            rows = np.frombuffer(found, np.uint8, whole).reshape(fragment.columns, n_rows).T
            found = rows.tobytes() + found[whole:]
        if self.keeps:
            self._kept = (index, found)
        return found

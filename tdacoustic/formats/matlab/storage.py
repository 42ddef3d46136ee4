"""Bytes of one variable of a MAT-file: as they lie in the file, or unpacked on the way.

A packed variable (``-v7``) is one deflate stream. It is never held whole: a
`PackedBytes` unpacks piece by piece, and remembers the state of the unpacking
every `SPACING` bytes, so that a later reading of the same process begins near
its place instead of at the beginning. What the stream gives is held against
what its first tag claims, and its checksum is compared once.
"""

from __future__ import annotations

import os
import zlib
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO, Protocol

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FormatError

__all__ = ["Budget", "Cursor", "FileBytes", "PackedBytes", "Place", "Storage", "storage_of"]

TAG_BYTES = 8
FEED_BYTES = 1 << 15
PIECE_BYTES = 1 << 18
MAX_UNPACKING = 1040
"""Deflate makes at most 1032 bytes of one."""

SPACING = 16 << 20
MAX_STATES = 160
"""States of unpacking that are kept, about 80 kB each, the oldest variable's given up first."""

MAX_KNOWN = 2000
"""Packed variables of which anything is remembered."""


@dataclass(frozen=True)
class Place:
    """Where a variable lies in the file.

    Parameters
    ----------
    offset : int
        Of its first byte: of its tag, or of the packed stream.
    n_bytes : int
        Tag included, or of the packed stream.
    packed : bool
    """

    offset: int
    n_bytes: int
    packed: bool


class Cursor(Protocol):
    """Reads on from a place."""

    def read_into(self, target: NDArray[Any]) -> None:
        """Fill an array."""
        ...


class Storage(Protocol):
    """Bytes of one variable."""

    size: int
    """Bytes that the variable has, its tag included."""

    def read(self, position: int, n_bytes: int) -> bytes:
        """Return ``n_bytes`` from ``position`` on; quick where places are asked for in ascending order."""
        ...

    def cursors(self, positions: Sequence[int]) -> list[Cursor]:
        """Begin a reading of its own at each of the places, which ascend."""
        ...

    def verify(self) -> None:
        """Compare the checksum, where there is one and it was not compared yet."""
        ...


@dataclass
class Budget:
    """Bytes that a scan may unpack: what a structure holds behind its samples can only be found by unpacking them.

    Parameters
    ----------
    path : Path
    left : int
    """

    path: Path
    left: int

    def take(self, n_bytes: int) -> None:
        """Count bytes that were unpacked.

        Raises
        ------
        FormatError
            There were too many.
        """
        self.left -= n_bytes
        if self.left < 0:
            raise FormatError(
                f"{self.path}: its packed variables unpack to far more than recordings do: damaged, or made to exhaust "
                "the memory"
            )


@dataclass
class FileBytes:
    """Bytes as they lie in the file."""

    path: Path
    stream: BinaryIO
    offset: int
    size: int

    def read(self, position: int, n_bytes: int) -> bytes:
        """See `Storage`."""
        self.stream.seek(self.offset + position)
        data = self.stream.read(n_bytes)
        if len(data) < n_bytes:
            raise self._truncated(position + n_bytes)
        return data

    def cursors(self, positions: Sequence[int]) -> list[Cursor]:
        """See `Storage`."""
        return [_FileCursor(self, position) for position in positions]

    def verify(self) -> None:
        """See `Storage`: there is no checksum."""

    def _truncated(self, end: int) -> FormatError:
        return FormatError(
            f"{self.path}: truncated: byte {self.offset + end} was asked for, the file ends before it: it has changed"
        )


@dataclass
class _FileCursor:
    of: FileBytes
    position: int

    def read_into(self, target: NDArray[Any]) -> None:
        """See `Cursor`."""
        view = target.reshape(-1).view(np.uint8).data
        self.of.stream.seek(self.of.offset + self.position)
        if self.of.stream.readinto(view) < len(view):  # type: ignore[attr-defined]
            raise self.of._truncated(self.position + len(view))
        self.position += len(view)


@dataclass(frozen=True)
class _State:
    """How far an unpacking has come: bytes taken from the file, bytes given, and the state of zlib."""

    taken: int
    position: int
    inflate: Any


@dataclass
class _Known:
    """What this process knows of one packed variable."""

    states: list[_State] = field(default_factory=list)
    verified: bool = False


_KNOWN: OrderedDict[tuple[str, int, int, int], _Known] = OrderedDict()
"""By path, time of change, size and offset; states of zlib cannot be pickled, so they belong to no reader."""


class _Unpacking:
    """An unpacking on its way, from the beginning or from a state."""

    def __init__(self, owner: PackedBytes, state: _State | None = None) -> None:
        self.owner = owner
        self.taken = 0 if state is None else state.taken
        self.position = 0 if state is None else state.position
        self._inflate = zlib.decompressobj() if state is None else state.inflate.copy()

    def state(self) -> _State:
        """Where it stands."""
        return _State(self.taken, self.position, self._inflate.copy())

    def piece(self, most: int) -> bytes:
        """Unpack up to `most` bytes; empty at the end of the stream."""
        owner = self.owner
        while not self._inflate.eof:
            fed = self._inflate.unconsumed_tail
            if not fed:
                owner.stream.seek(owner.place.offset + self.taken)
                fed = owner.stream.read(min(FEED_BYTES, owner.place.n_bytes - self.taken))
                self.taken += len(fed)
            try:
                data = self._inflate.decompress(fed, most)
            except zlib.error as error:
                raise FormatError(
                    f"{owner.path}: {owner.label}: its packed data are damaged ({str(error).rpartition(': ')[2]})"
                ) from error
            if data:
                self.position += len(data)
                if owner.budget is not None:
                    owner.budget.take(len(data))
                return data
            if not fed:
                raise FormatError(f"{owner.path}: {owner.label}: truncated: its packed data end before their end")
        return b""

    def read_into(self, target: NDArray[Any]) -> None:
        """See `Cursor`."""
        view = target.reshape(-1).view(np.uint8).data
        at = 0
        while at < len(view):
            data = self.piece(min(PIECE_BYTES, len(view) - at))
            if not data:
                raise self.owner.too_short(self.position)
            view[at : at + len(data)] = data
            at += len(data)
        self.owner.remember(self)

    def skip_to(self, position: int) -> None:
        """Unpack up to a place, remembering states on the way."""
        while self.position < position:
            if not self.piece(min(PIECE_BYTES, position - self.position)):
                raise self.owner.too_short(self.position)
            self.owner.remember(self)


class PackedBytes:
    """Bytes of a packed variable.

    Parameters
    ----------
    path : Path
    stream : file
    place : Place
    label : str
        What the variable is called in messages.
    budget : Budget or None
        Of a scan.

    Raises
    ------
    FormatError
        The stream is no packed variable, or claims more than it can unpack to.
    """

    def __init__(self, path: Path, stream: BinaryIO, place: Place, label: str, budget: Budget | None = None) -> None:
        self.path, self.stream, self.place, self.label, self.budget = path, stream, place, label, budget
        status = os.fstat(stream.fileno())
        key = (str(path), status.st_mtime_ns, status.st_size, place.offset)
        self._known = _KNOWN.setdefault(key, _Known())
        _KNOWN.move_to_end(key)
        while len(_KNOWN) > MAX_KNOWN:
            _KNOWN.popitem(last=False)
        self.size = 0
        self.spacing = SPACING
        self._running = _Unpacking(self)

    def claim(self, n_bytes: int) -> None:
        """Take the size that the stream's first tag claims, that tag included."""
        if n_bytes > MAX_UNPACKING * self.place.n_bytes + TAG_BYTES:
            raise FormatError(
                f"{self.path}: {self.label} claims {n_bytes} bytes, more than its {self.place.n_bytes} packed bytes "
                "can hold"
            )
        self.size = n_bytes
        self.spacing = max(SPACING, n_bytes // (MAX_STATES // 2))

    def too_short(self, position: int) -> FormatError:
        """The error of a stream that ends before what it claims."""
        return FormatError(
            f"{self.path}: truncated: {self.label} claims {self.size} bytes, its packed data give {position}"
        )

    def remember(self, state: _Unpacking) -> None:
        """Keep a state of unpacking for later readings."""
        states = self._known.states
        if state.position < (states[-1].position if states else 0) + self.spacing:
            return
        states.append(state.state())
        total = sum(len(known.states) for known in _KNOWN.values())
        for key, known in list(_KNOWN.items()):
            if total <= MAX_STATES:
                break
            if known is not self._known:
                total -= len(known.states)
                del _KNOWN[key]

    def _nearest(self, position: int) -> _Unpacking:
        before = [state for state in self._known.states if state.position <= position]
        return _Unpacking(self, before[-1] if before else None)

    def read(self, position: int, n_bytes: int) -> bytes:
        """See `Storage`."""
        if self._running.position > position:
            self._running = self._nearest(position)
        elif position - self._running.position > self.spacing:
            nearest = self._nearest(position)
            if nearest.position > self._running.position:
                self._running = nearest
        self._running.skip_to(position)
        data = np.empty(n_bytes, np.uint8)
        self._running.read_into(data)
        return data.tobytes()

    def cursors(self, positions: Sequence[int]) -> list[Cursor]:
        """See `Storage`: one unpacking up to the last place serves all of them."""
        result: list[Cursor] = []
        running: _Unpacking | None = None
        for position in positions:
            nearest = self._nearest(position)
            if running is None or nearest.position > running.position:
                running = nearest
            running.skip_to(position)
            result.append(_Unpacking(self, running.state()))
        return result

    def verify(self) -> None:
        """Unpack to the end, which compares the checksum, once in a process.

        Raises
        ------
        FormatError
            The data are damaged, or more or fewer than claimed.
        """
        if self._known.verified:
            return
        state = self._nearest(self.size)
        state.skip_to(self.size)
        behind = 0
        while data := state.piece(PIECE_BYTES):
            behind += len(data)
            if behind >= TAG_BYTES:
                raise FormatError(
                    f"{self.path}: {self.label} claims {self.size} bytes, its packed data give more: damaged"
                )
        self._known.verified = True


def storage_of(
    path: Path, stream: BinaryIO, place: Place, label: str, size: int = 0, budget: Budget | None = None
) -> Storage:
    """Bytes of a variable.

    Parameters
    ----------
    path : Path
    stream : file
    place : Place
    label : str
    size : int
        Of the unpacked variable where it is known already.
    budget : Budget or None

    Raises
    ------
    FormatError
        The file ends before the place does.
    """
    held = os.fstat(stream.fileno()).st_size
    if place.offset + place.n_bytes > held:
        raise FormatError(
            f"{path}: truncated: {label} claims {place.n_bytes} bytes from byte {place.offset} on, "
            f"the file holds {max(0, held - place.offset)}"
        )
    if not place.packed:
        return FileBytes(path, stream, place.offset, place.n_bytes)
    packed = PackedBytes(path, stream, place, label, budget)
    if size:
        packed.claim(size)
    return packed

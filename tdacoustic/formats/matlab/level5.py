"""MAT-files of level 5 (MATLAB 5 and later, -v6 and -v7): the data elements, walked without reading samples.

After the public MAT-File Format document of The MathWorks. A file is a header of
128 bytes and a row of data elements; each is a tag (type, number of bytes) and
its data, or, where these are at most four bytes, both in eight bytes. A variable
is an element of type miMATRIX, or one of type miCOMPRESSED with a miMATRIX packed
in it; what is in a matrix depends on its class. The numbers of an array may be
stored in a smaller type than its class has.

Nothing is built from a file but structures, numbers and texts: objects, function
handles and MATLAB's opaque classes are named, and left out.
"""

from __future__ import annotations

import math
import struct as packing
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from tdacoustic.errors import FormatError
from tdacoustic.formats.bounds import MAX_NAME, clean_text
from tdacoustic.formats.matlab.storage import TAG_BYTES, Budget, PackedBytes, Place, Storage, storage_of
from tdacoustic.formats.matlab.values import Values
from tdacoustic.formats.matlab.workspace import LEFT_OUT, MAX_TEXT, Array, Struct, Workspace, reason_of_shape

__all__ = ["read_workspace"]

HEADER_BYTES = 128
MI_MATRIX, MI_COMPRESSED = 14, 15
STORED_AS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
INT8, INT32, UINT32 = 1, 5, 6
ENCODINGS = {1: "latin-1", 2: "latin-1", 3: "utf-16", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
CELL, STRUCT, OBJECT, CHAR, SPARSE, FUNCTION, OPAQUE, OBJECT_2 = 1, 2, 3, 4, 5, 16, 17, 18
CLASSES = {
    6: "f8",
    7: "f4",
    8: "i1",
    9: "u1",
    10: "i2",
    11: "u2",
    12: "i4",
    13: "u4",
    14: "i8",
    15: "u8",
}
COMPLEX, LOGICAL = 0x0800, 0x0200
MAX_NAME_BYTES = 4096
MAX_DIMENSIONS = 32
MAX_DEPTH = 32
MAX_ELEMENTS = 100_000
MAX_CELLS = 1024
VERIFIED_AT_ONCE = 1 << 20
UNPACKED_ALWAYS, UNPACKED_A_BYTE = 2 << 30, 60
"""What a scan may unpack, in bytes and in bytes for each of the file: recordings pack to a fifth at best [assumed]."""


@dataclass(frozen=True)
class _Element:
    """A data element: its type, and where its data lie."""

    type: int
    position: int
    n_bytes: int
    next: int


def read_workspace(path: Path, stream: BinaryIO) -> Workspace:
    """Walk the variables of a level 5 file.

    Returns
    -------
    Workspace
        Whose arrays' keys are `Values`.

    Raises
    ------
    FormatError
        Truncated, or not what it claims to be.
    """
    stream.seek(0, 2)
    size = stream.tell()
    stream.seek(0)
    header = stream.read(HEADER_BYTES)
    if len(header) < HEADER_BYTES:
        raise FormatError(f"{path}: truncated: a MAT-file's header has {HEADER_BYTES} bytes, the file {len(header)}")
    order = "<" if header[126:128] == b"IM" else ">"
    version = packing.unpack(order + "H", header[124:126])[0]
    if header[126:128] not in (b"IM", b"MI") or version >> 8 != 1:
        raise FormatError(f"{path}: no MAT-file of level 5: its header ends in {header[124:128]!r}")
    workspace = Workspace()
    text = header[:116].split(b"\0")[0].decode("latin-1").strip()
    workspace.metadata.append(("header", text))
    subsystem = packing.unpack(order + "Q", header[116:124])[0]
    walk = _Walk(path, stream, order, workspace, Budget(path, max(UNPACKED_ALWAYS, UNPACKED_A_BYTE * size)))
    position, count = HEADER_BYTES, 0
    while position < size:
        count += 1
        if size - position < TAG_BYTES:
            workspace.flags.append(f"{size - position} bytes follow the last variable: the file may be cut off")
            break
        if not walk.count():
            break
        position = walk.variable(position, size, count, position == subsystem)
    return workspace


class _Walk:
    """One walk through a file."""

    def __init__(self, path: Path, stream: BinaryIO, order: str, workspace: Workspace, budget: Budget) -> None:
        self.path, self.stream, self.order, self.workspace, self.budget = path, stream, order, workspace, budget
        self.elements = 0

    def variable(self, position: int, size: int, number: int, is_subsystem: bool) -> int:
        """Read one variable's head and what is in it; returns the offset behind it."""
        self.stream.seek(position)
        kind, n_bytes = packing.unpack(self.order + "II", self.stream.read(TAG_BYTES))
        end = position + TAG_BYTES + n_bytes
        if kind not in (MI_MATRIX, MI_COMPRESSED):
            raise FormatError(
                f"{self.path}: damaged: at byte {position} a variable has to begin, a data element of type {kind} does"
            )
        label = f"variable {number}"
        if kind == MI_MATRIX:
            place = Place(position, TAG_BYTES + n_bytes, packed=False)
        else:
            place = Place(position + TAG_BYTES, n_bytes, packed=True)
        if end > size:
            label = self._name_of_truncated(place, size, label)
            raise FormatError(
                f"{self.path}: truncated: {label} claims {n_bytes} bytes from byte {position + TAG_BYTES} on, "
                f"the file holds {size - position - TAG_BYTES}"
            )
        storage = storage_of(self.path, self.stream, place, label, budget=self.budget)
        if not is_subsystem:  # that is MATLAB's own storage of what belongs to function handles and objects
            _Variable(self, storage, place, label).read()
        return end

    def _name_of_truncated(self, place: Place, size: int, label: str) -> str:
        held = Place(place.offset, size - place.offset, place.packed)
        try:
            storage = storage_of(self.path, self.stream, held, label, budget=self.budget)
            variable = _Variable(self, storage, held, label)
            variable.end = place.n_bytes
            variable.begin(bounded=False)
            return f"variable {variable.head(0, variable.end)[2]!r}"
        except (FormatError, packing.error):
            return label

    def count(self) -> bool:
        """Count a variable or a field; False where there are too many."""
        self.elements += 1
        if self.elements == MAX_ELEMENTS:
            self.workspace.flags.append(f"more than {MAX_ELEMENTS} elements: the rest is not read")
        return self.elements < MAX_ELEMENTS


class _Variable:
    """One variable of a file, and the reading of the elements in it."""

    def __init__(self, walk: _Walk, storage: Storage, place: Place, label: str) -> None:
        self.walk, self.storage, self.place, self.label = walk, storage, place, label
        self.end = storage.size

    def error(self, text: str) -> FormatError:
        """An error that names the file and the variable."""
        return FormatError(f"{self.walk.path}: {self.label}: {text}")

    def begin(self, bounded: bool = True) -> None:
        """Take the size of a packed variable from its first tag."""
        if isinstance(self.storage, PackedBytes):
            kind, n_bytes = packing.unpack(self.walk.order + "II", self.storage.read(0, TAG_BYTES))
            if kind != MI_MATRIX:
                raise self.error(f"no variable is packed in it, but a data element of type {kind}")
            if bounded:
                self.storage.claim(n_bytes + TAG_BYTES)
            self.end = n_bytes + TAG_BYTES

    def read(self) -> None:
        """Read it into the workspace."""
        self.begin()
        self._matrix(0, self.end, self.walk.workspace.root, None, 0)
        if self.end <= VERIFIED_AT_ONCE:
            self.storage.verify()

    def element(self, position: int, end: int) -> _Element:
        """The data element at a position, which has to end before `end`."""
        if position + TAG_BYTES > end:
            raise self.error(f"damaged: at byte {position} of {end} a data element has to begin")
        tag = self.storage.read(position, TAG_BYTES)
        kind, n_bytes = packing.unpack(self.walk.order + "II", tag)
        if kind >> 16:
            kind, n_bytes = kind & 0xFFFF, kind >> 16
            if n_bytes > 4:
                raise self.error(f"damaged: a small data element at byte {position} claims {n_bytes} bytes, 4 fit in")
            return _Element(kind, position + 4, n_bytes, position + TAG_BYTES)
        start = position + TAG_BYTES
        if start + n_bytes > end:
            raise self.error(
                f"damaged: a data element at byte {position} claims {n_bytes} bytes, {end - start} are left"
            )
        padded = n_bytes if kind == MI_MATRIX else -(-n_bytes // 8) * 8
        return _Element(kind, start, n_bytes, min(start + padded, end))

    def head(self, position: int, end: int) -> tuple[int, tuple[int, ...], str, int, int]:
        """Flags, dimensions, name, the position behind them, and the matrix's end; the flags are 0 of an empty one."""
        matrix = self.element(position, end)
        if matrix.type != MI_MATRIX:
            raise self.error(
                f"damaged: a matrix has to begin at byte {position}, an element of type {matrix.type} does"
            )
        stop = matrix.position + matrix.n_bytes
        if matrix.n_bytes == 0:
            return 0, (0, 0), "", stop, stop
        flags = self.element(matrix.position, stop)
        if flags.type not in (UINT32, INT32) or flags.n_bytes != 8:
            raise self.error(f"damaged: no array flags at byte {matrix.position}")
        bits = packing.unpack(self.walk.order + "I", self.storage.read(flags.position, 4))[0]
        if bits & 0xFF == 0:
            raise self.error(f"damaged: the matrix at byte {position} is of no class")
        at, shape = flags.next, (1, 1)
        if bits & 0xFF != OPAQUE:
            dimensions = self.element(at, stop)
            n = dimensions.n_bytes // 4
            if dimensions.type not in (INT32, UINT32) or dimensions.n_bytes % 4 or not 1 <= n <= MAX_DIMENSIONS:
                raise self.error(f"damaged: no dimensions at byte {at}")
            shape = packing.unpack(f"{self.walk.order}{n}i", self.storage.read(dimensions.position, 4 * n))
            if min(shape) < 0:
                raise self.error(f"damaged: its dimensions are {' x '.join(map(str, shape))}")
            at = dimensions.next
        name, at = self.text(at, stop)
        return bits, shape, name, at, stop

    def text(self, position: int, end: int) -> tuple[str, int]:
        """A name, and the position behind it."""
        element = self.element(position, end)
        if element.type not in (INT8, 2, 16) or element.n_bytes > MAX_NAME_BYTES:
            raise self.error(f"damaged: no name at byte {position}")
        raw = self.storage.read(element.position, element.n_bytes).rstrip(b"\0")
        try:
            name = raw.decode("utf-8")
        except UnicodeDecodeError:
            name = raw.decode("latin-1")
        return clean_text(name, MAX_NAME), element.next

    def _matrix(self, position: int, end: int, owner: Struct, field: str | None, depth: int) -> int:
        """Read one matrix into a structure; returns the position behind it."""
        flags, shape, own_name, at, stop = self.head(position, end)
        name = own_name if field is None else field
        if field is None and name:
            self.label = f"variable {name!r}"
            if isinstance(self.storage, PackedBytes):
                self.storage.label = self.label
        kind = flags & 0xFF
        if flags == 0:
            return stop
        if field is None and not name:
            self.walk.workspace.leave_out("have no name", self.label)
            return stop
        if math.prod(shape) == 0 and kind not in (OPAQUE, FUNCTION):
            return stop
        if depth > MAX_DEPTH:
            self.walk.workspace.leave_out(f"are nested more than {MAX_DEPTH} deep", owner.path(name))
        elif kind in CLASSES:
            self._numbers(flags, shape, name, at, stop, owner)
        elif kind == CHAR:
            text = self._characters(shape, at, stop)
            owner.texts.append((name, text))
        elif kind == STRUCT:
            self._struct(shape, name, at, stop, owner, depth)
        elif kind == CELL:
            self._cell(shape, name, at, stop, owner)
        elif kind in (OBJECT, OPAQUE, OBJECT_2):
            self._object(kind, name, at, stop, owner)
        elif kind in (SPARSE, FUNCTION):
            self.walk.workspace.leave_out("sparse" if kind == SPARSE else "function_handle", owner.path(name))
        else:
            raise self.error(f"damaged: {owner.path(name)!r} is of class {kind}, which there is not")
        return stop

    def _numbers(self, flags: int, shape: tuple[int, ...], name: str, at: int, stop: int, owner: Struct) -> None:
        """A numeric array: a number, or something that can be a channel."""
        path = owner.path(name)
        element = self.element(at, stop)
        stored = STORED_AS.get(element.type)
        if stored is None:
            raise self.error(f"damaged: the values of {path!r} are of data type {element.type}, which is no number")
        count, width = math.prod(shape), int(stored[1])
        if count * width != element.n_bytes:
            raise self.error(
                f"damaged: {path!r} claims {' x '.join(map(str, shape))} values of {width} bytes, "
                f"it holds {element.n_bytes} bytes"
            )
        workspace, dtype = self.walk.workspace, self.walk.order + stored
        while len(shape) > 2 and shape[-1] == 1:
            shape = shape[:-1]
        shape = shape if len(shape) > 1 else (shape[0], 1)
        if flags & COMPLEX:
            workspace.leave_out("complex", path)
        elif count == 1:
            owner.numbers.append((name, float(np.frombuffer(self.storage.read(element.position, width), dtype)[0])))
        elif (reason := reason_of_shape(shape)) is not None:
            workspace.leave_out(reason, path)
        else:
            values = Values(self.place, self.end, element.position, dtype, (shape[0], shape[1]), path)
            storage = self.storage

            def sample(index: int) -> float:
                return float(np.frombuffer(storage.read(element.position + index * width, width), dtype)[0])

            owner.arrays.append(
                Array(name, values.shape, np.dtype(CLASSES[flags & 0xFF]), bool(flags & LOGICAL), values, sample)
            )

    def _characters(self, shape: tuple[int, ...], at: int, stop: int) -> str:
        """A text; of several rows the first ones, on one line."""
        element = self.element(at, stop)
        encoding = ENCODINGS.get(element.type)
        if encoding is None:
            raise self.error(f"damaged: a text of data type {element.type}")
        if encoding in ("utf-16", "utf-32"):
            encoding += "-le" if self.walk.order == "<" else "-be"
        raw = self.storage.read(element.position, min(element.n_bytes, 4 * MAX_TEXT))
        text = raw.decode(encoding, errors="replace")[:MAX_TEXT]
        rows = shape[0]
        if rows > 1 and len(shape) == 2 and len(text) == math.prod(shape):
            text = " ".join(text[row::rows].strip() for row in range(rows))
        return text.strip("\0 \t\r\n")

    def _fields(self, at: int, stop: int) -> tuple[list[str], int]:
        """Names of a structure's fields, and the position behind them."""
        length = self.element(at, stop)
        if length.n_bytes != 4 or length.type not in (INT32, UINT32):
            raise self.error(f"damaged: no length of field names at byte {at}")
        width = packing.unpack(self.walk.order + "i", self.storage.read(length.position, 4))[0]
        names = self.element(length.next, stop)
        if not 1 <= width <= MAX_NAME_BYTES or names.type not in (INT8, 2, 16) or names.n_bytes % width:
            raise self.error(f"damaged: field names of {width} bytes in {names.n_bytes} bytes")
        if names.n_bytes // width > MAX_ELEMENTS:
            raise self.error(f"claims {names.n_bytes // width} fields; {MAX_ELEMENTS} are read")
        raw = self.storage.read(names.position, names.n_bytes)
        fields = [raw[i : i + width].split(b"\0")[0].decode("latin-1") for i in range(0, len(raw), width)]
        return [clean_text(field, MAX_NAME) for field in fields], names.next

    def _struct(self, shape: tuple[int, ...], name: str, at: int, stop: int, owner: Struct, depth: int) -> None:
        """A structure; an array of structures is left out where numbers or more would be lost."""
        fields, at = self._fields(at, stop)
        count = math.prod(shape)
        self._fits(count * len(fields), at, stop, owner.path(name))
        inner = Struct(name, owner)
        if count == 1:
            owner.structs.append(inner)
            for field in fields:
                if not self.walk.count():
                    return
                at = self._matrix(at, stop, inner, field, depth + 1)
            return
        if count * max(1, len(fields)) > MAX_CELLS or self._holds_more_than_words(count * len(fields), at, stop):
            self.walk.workspace.leave_out("struct array", owner.path(name))

    def _cell(self, shape: tuple[int, ...], name: str, at: int, stop: int, owner: Struct) -> None:
        """A cell array: read where it is a list of texts, left out otherwise."""
        count = math.prod(shape)
        self._fits(count, at, stop, owner.path(name))
        if count > MAX_CELLS:
            self.walk.workspace.leave_out("cell", owner.path(name))
            return
        texts = []
        for _ in range(count):
            flags, inner_shape, _, inner_at, inner_stop = self.head(at, stop)
            if flags & 0xFF != CHAR:
                self.walk.workspace.leave_out("cell", owner.path(name))
                return
            texts.append(self._characters(inner_shape, inner_at, inner_stop) if math.prod(inner_shape) else "")
            at = inner_stop
        owner.lists.append((name, tuple(texts)))

    def _fits(self, count: int, at: int, stop: int, path: str) -> None:
        if count * TAG_BYTES > stop - at:
            raise self.error(f"damaged: {path!r} claims {count} elements, {stop - at} bytes are left for them")

    def _holds_more_than_words(self, count: int, at: int, stop: int) -> bool:
        """Whether one of the elements is more than a number or a text."""
        for _ in range(count):
            flags, shape, _, _, at = self.head(at, stop)
            kind = flags & 0xFF
            if flags and not (kind == CHAR or math.prod(shape) == 0 or (kind in CLASSES and math.prod(shape) == 1)):
                return True
        return False

    def _object(self, kind: int, name: str, at: int, stop: int, owner: Struct) -> None:
        """Name what an object is; it is never built."""
        class_name = ""
        try:
            if kind == OPAQUE:
                _, at = self.text(at, stop)
            class_name = self.text(at, stop)[0]
        except FormatError:
            pass
        known = class_name if class_name in LEFT_OUT else "object"
        called = (
            owner.path(name) if known == class_name else f"{owner.path(name)} ({class_name or 'of no named class'})"
        )
        self.walk.workspace.leave_out(known, called)

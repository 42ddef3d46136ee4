"""MAT-files of level 4 (-v4): a row of matrices, each a head of 20 bytes, a name and its values.

After the public MAT-File Format document of The MathWorks. The first number of a
head has the decimal digits M (byte order), O (0), P (how the values are stored)
and T (full matrix, text or sparse matrix).
"""

from __future__ import annotations

import struct as packing
from pathlib import Path
from typing import BinaryIO

import numpy as np

from tdacoustic.errors import FormatError
from tdacoustic.formats.bounds import clean_text
from tdacoustic.formats.matlab.storage import Place
from tdacoustic.formats.matlab.values import Values
from tdacoustic.formats.matlab.workspace import MAX_TEXT, Array, Workspace, reason_of_shape

__all__ = ["is_level4", "read_workspace"]

HEAD_BYTES = 20
STORED_AS = {0: "f8", 1: "f4", 2: "i4", 3: "i2", 4: "u2", 5: "u1"}
FULL, TEXT, SPARSE = 0, 1, 2
MAX_NAME = 256
MAX_VARIABLES = 100_000

Head = tuple[str, int, int, int, int, bool, int]


def _head(raw: bytes) -> Head | None:
    """Byte order, P, T, rows, columns, whether complex, length of the name; None where it is no head."""
    if len(raw) < HEAD_BYTES:
        return None
    for order in "<>":
        mopt, rows, columns, imaginary, length = packing.unpack(order + "5i", raw[:HEAD_BYTES])
        machine, zero, stored, kind = mopt // 1000, mopt // 100 % 10, mopt // 10 % 10, mopt % 10
        if (
            0 <= mopt <= 1052
            and machine == (0 if order == "<" else 1)
            and zero == 0
            and stored in STORED_AS
            and kind in (FULL, TEXT, SPARSE)
            and imaginary in (0, 1)
            and 1 < length <= MAX_NAME
            and min(rows, columns) >= 0
        ):
            return order, stored, kind, rows, columns, bool(imaginary), length
    return None


def is_level4(beginning: bytes) -> bool:
    """Whether a file that begins so is a MAT-file of level 4: a head, and a name that MATLAB allows."""
    head = _head(beginning)
    if head is None:
        return False
    name = beginning[HEAD_BYTES : HEAD_BYTES + head[-1]]
    return len(name) == head[-1] and name[-1] == 0 and name[:-1].isascii() and name[:-1].decode("ascii").isidentifier()


def read_workspace(path: Path, stream: BinaryIO) -> Workspace:
    """Walk the matrices of a level 4 file.

    Returns
    -------
    Workspace
        Whose arrays' keys are `Values`.

    Raises
    ------
    FormatError
        Truncated, or not what it claims to be.
    """
    size = stream.seek(0, 2)
    workspace = Workspace(metadata=[("header", "MAT-file of level 4")])
    position = 0
    for count in range(1, MAX_VARIABLES + 1):
        if position == size:
            return workspace
        position = _variable(path, stream, position, size, count, workspace)
    workspace.flags.append(f"more than {MAX_VARIABLES} variables: the rest is not read")
    return workspace


def _variable(path: Path, stream: BinaryIO, position: int, size: int, count: int, workspace: Workspace) -> int:
    """Read one matrix's head; returns the offset behind the matrix."""
    stream.seek(position)
    raw = stream.read(HEAD_BYTES)
    if len(raw) < HEAD_BYTES:
        raise FormatError(f"{path}: truncated: {len(raw)} bytes are left of the head of variable {count}")
    head = _head(raw)
    if head is None:
        raise FormatError(f"{path}: damaged: at byte {position} no matrix of level 4 begins")
    order, stored, kind, rows, columns, is_complex, length = head
    name = clean_text(stream.read(length).split(b"\0")[0].decode("latin-1"), MAX_NAME)
    dtype = order + STORED_AS[stored]
    width = int(dtype[2])
    start = position + HEAD_BYTES + length
    n_bytes = rows * columns * width * (2 if is_complex else 1)
    if start + n_bytes > size:
        raise FormatError(
            f"{path}: truncated: variable {name!r} claims {rows} x {columns} values, {n_bytes} bytes, "
            f"the file holds {max(0, size - start)}"
        )
    root = workspace.root
    if rows * columns == 0:
        pass
    elif kind == SPARSE:
        workspace.leave_out("sparse", name)
    elif kind == TEXT:
        codes = np.frombuffer(stream.read(min(MAX_TEXT, rows * columns) * width), dtype)
        root.texts.append((name, "".join(chr(int(code) & 0xFF) for code in np.nan_to_num(codes)).strip("\0 ")))
    elif is_complex:
        workspace.leave_out("complex", name)
    elif rows * columns == 1:
        root.numbers.append((name, float(np.frombuffer(stream.read(width), dtype)[0])))
    elif (reason := reason_of_shape((rows, columns))) is not None:
        workspace.leave_out(reason, name)
    else:
        place = Place(start, n_bytes, packed=False)
        values = Values(place, n_bytes, 0, dtype, (rows, columns), name)

        def sample(index: int) -> float:
            stream.seek(start + index * width)
            return float(np.frombuffer(stream.read(width), dtype)[0])

        root.arrays.append(Array(name, (rows, columns), np.dtype("f8"), False, values, sample))
    return start + n_bytes

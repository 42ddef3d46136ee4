"""The objects that a TDMS segment lists: their paths, where their values lie, their properties.

Structure: National Instruments, "TDMS file format internal structure"; the raw data
index of DAQmx values, which that page leaves open, as npTDMS reads it.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Final, NamedTuple

from tdacoustic.formats.tdms.paths import label

__all__ = [
    "MAX_PROPERTIES",
    "SAME",
    "DamagedError",
    "Instant",
    "ListedObject",
    "OutOfBytesError",
    "RawIndex",
    "Scaler",
    "Spot",
    "parse_objects",
    "read_value",
]

SAME: Final = -1
"""In place of a raw data index: the object's index is the one it had before."""

NO_DATA, MATCHES_PREVIOUS = 0xFFFFFFFF, 0
FORMAT_CHANGING, DIGITAL_LINE = 0x1269, 0x126A
MAX_PLAIN_INDEX = 64
MAX_SCALERS = 64
MAX_BUFFERS = 4096
MAX_PROPERTIES = 300_000
DAQMX_RAW = 0xFFFFFFFF

TYPES: Final[dict[int, tuple[str, int | None, str | None]]] = {
    0x00: ("nothing", 0, None),
    0x01: ("8-bit integers", 1, "i1"),
    0x02: ("16-bit integers", 2, "i2"),
    0x03: ("32-bit integers", 4, "i4"),
    0x04: ("64-bit integers", 8, "i8"),
    0x05: ("unsigned 8-bit integers", 1, "u1"),
    0x06: ("unsigned 16-bit integers", 2, "u2"),
    0x07: ("unsigned 32-bit integers", 4, "u4"),
    0x08: ("unsigned 64-bit integers", 8, "u8"),
    0x09: ("single-precision numbers", 4, "f4"),
    0x0A: ("double-precision numbers", 8, "f8"),
    0x0B: ("extended-precision numbers", None, None),
    0x19: ("single-precision numbers", 4, "f4"),
    0x1A: ("double-precision numbers", 8, "f8"),
    0x1B: ("extended-precision numbers", None, None),
    0x20: ("text", None, None),
    0x21: ("true or false", 1, "?"),
    0x44: ("instants", 16, None),
    0x4F: ("fixed-point numbers", None, None),
    0x08000C: ("complex numbers", 8, None),
    0x10000D: ("complex numbers", 16, None),
    DAQMX_RAW: ("DAQmx raw data", 0, None),
}
"""Type code -> words, bytes a value (None where the code does not fix them), numpy type of real numbers and of true
and false."""

TEXT = 0x20
SCALER_TYPES: Final = dict(enumerate(("u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f4", "f8")))
"""DAQmx numbers its types in its own way."""


class DamagedError(Exception):
    """What is wrong with a segment, in words; the caller says where."""


class OutOfBytesError(Exception):
    """The objects go on behind the bytes given."""


class Instant(NamedTuple):
    """Seconds since 1904-01-01 00:00 UTC, and 2**-64 s."""

    seconds: int
    fraction: int

    @property
    def ticks(self) -> int:
        """In units of 2**-64 s."""
        return (self.seconds << 64) + self.fraction


class Scaler(NamedTuple):
    """One stored number of a DAQmx channel.

    `offset` is in bytes within a row of `buffer`; `bit` is the bit of a digital line.
    """

    scale_id: int
    dtype: str
    buffer: int
    offset: int
    bit: int | None


@dataclass(frozen=True)
class RawIndex:
    """How an object's values lie in a chunk.

    Parameters
    ----------
    type_code : int
        A key of `TYPES`.
    n_values : int
        In a chunk.
    n_bytes : int or None
        In a chunk; None where the type does not fix it, and for DAQmx, whose rows are shared.
    scalers : tuple of Scaler
        Of DAQmx; empty otherwise.
    widths : tuple of int
        Bytes a row of each DAQmx buffer.
    is_daqmx : bool
    """

    type_code: int
    n_values: int
    n_bytes: int | None
    scalers: tuple[Scaler, ...] = ()
    widths: tuple[int, ...] = ()
    is_daqmx: bool = False


PropertyValue = str | int | float | bool | Instant | None


class ListedObject(NamedTuple):
    """An object as one segment lists it; `raw_index` is None where it has no values in the segment."""

    path: str
    raw_index: RawIndex | int | None
    properties: tuple[tuple[str, PropertyValue], ...]


class Spot(NamedTuple):
    """Where a value of fixed length lies: its type code at `start`, its end at `stop`."""

    start: int
    stop: int
    path: str
    name: str


_FIXED: Final = {
    order: {
        code: struct.Struct(order + letter)
        for code, letter in {
            **dict(zip(range(1, 11), "bhiqBHIQfd", strict=True)),
            0x19: "f",
            0x1A: "d",
            0x21: "?",
        }.items()
    }
    for order in "<>"
}
_U32: Final = {order: struct.Struct(order + "I") for order in "<>"}
_PLAIN: Final = {order: struct.Struct(order + "IIQ") for order in "<>"}
_U64: Final = {order: struct.Struct(order + "Q") for order in "<>"}
_DAQMX: Final = {order: struct.Struct(order + "IIQI") for order in "<>"}
_SCALER: Final = {order: struct.Struct(order + "IIIII") for order in "<>"}
_LINE: Final = {order: struct.Struct(order + "IIIBI") for order in "<>"}


def parse_objects(data: bytes, order: str) -> tuple[tuple[ListedObject, ...], tuple[Spot, ...], int]:
    """Parse the metadata of a segment.

    Parameters
    ----------
    data : bytes
        From the first byte behind the lead-in.
    order : str
        ``"<"`` or ``">"``.

    Returns
    -------
    objects : tuple of ListedObject
    spots : tuple of Spot
        Where a later segment of the same shape may differ.
    end : int
        Bytes they take.

    Raises
    ------
    OutOfBytesError
        They go on behind `data`.
    DamagedError
        A type, a size or a path that cannot be.
    """
    try:
        (count,) = _U32[order].unpack_from(data, 0)
        at = 4
        objects = []
        spots: list[Spot] = []
        total = 0
        for _ in range(count):
            listed, at = _object(data, at, order, spots)
            objects.append(listed)
            total += len(listed.properties)
            if total > MAX_PROPERTIES:
                raise DamagedError(f"more than {MAX_PROPERTIES} properties")
    except struct.error as error:
        raise OutOfBytesError from error
    return tuple(objects), tuple(spots), at


def _text(data: bytes, at: int, order: str) -> tuple[str, int]:
    (length,) = _U32[order].unpack_from(data, at)
    at += 4
    raw = data[at : at + length]
    if len(raw) < length:
        raise OutOfBytesError
    try:
        return raw.decode("utf-8"), at + length
    except UnicodeDecodeError:  # older programs write the code page of their Windows
        return raw.decode("cp1252", errors="replace"), at + length


def _object(data: bytes, at: int, order: str, spots: list[Spot]) -> tuple[ListedObject, int]:
    path, at = _text(data, at, order)
    (header,) = _U32[order].unpack_from(data, at)
    at += 4
    index: RawIndex | int | None
    try:
        if header == NO_DATA:
            index = None
        elif header == MATCHES_PREVIOUS:
            index = SAME
        elif header in (FORMAT_CHANGING, DIGITAL_LINE):
            index, at = _daqmx_index(data, at, order, header == DIGITAL_LINE)
        elif header <= MAX_PLAIN_INDEX:
            index, at = _plain_index(data, at, order)
        else:
            raise DamagedError(f"a raw data index of {header} bytes")
    except DamagedError as error:
        raise DamagedError(f"{label(path)} lists {error}") from None
    (count,) = _U32[order].unpack_from(data, at)
    at += 4
    if count > MAX_PROPERTIES:
        raise DamagedError(f"{label(path)} lists {count} properties; at most {MAX_PROPERTIES} are read")
    properties = []
    for _ in range(count):
        name, at = _text(data, at, order)
        start = at
        value, at = read_value(data, at, order)
        properties.append((name, value))
        if not isinstance(value, str):
            spots.append(Spot(start, at, path, name))
    return ListedObject(path, index, tuple(properties)), at


def read_value(data: bytes, at: int, order: str) -> tuple[PropertyValue, int]:
    """Value of a property, whose type code is at `at`, and the offset behind it.

    Raises
    ------
    struct.error, OutOfBytesError
        It goes on behind `data`.
    DamagedError
        Its size is not known.
    """
    (code,) = _U32[order].unpack_from(data, at)
    at += 4
    packed = _FIXED[order].get(code)
    if packed is not None:
        return packed.unpack_from(data, at)[0], at + packed.size
    if code == TEXT:
        return _text(data, at, order)
    if code == 0x44:
        if order == "<":
            fraction, seconds = struct.unpack_from("<Qq", data, at)
        else:
            seconds, fraction = struct.unpack_from(">qQ", data, at)
        return Instant(seconds, fraction), at + 16
    size = TYPES[code][1] if code in TYPES else None
    if size is None or code == DAQMX_RAW:
        raise DamagedError(f"a property of the type 0x{code:X}, whose size is not known")
    if at + size > len(data):
        raise OutOfBytesError
    return None, at + size


def _check_dimension(dimension: int) -> None:
    if dimension != 1:
        raise DamagedError(f"values of {dimension} dimensions; a channel has one")


def _plain_index(data: bytes, at: int, order: str) -> tuple[RawIndex, int]:
    code, dimension, n_values = _PLAIN[order].unpack_from(data, at)
    at += 16
    if code not in TYPES or code == DAQMX_RAW:
        raise DamagedError(f"values of the type 0x{code:X}, which there is not")
    _check_dimension(dimension)
    words, size, _ = TYPES[code]
    if code == TEXT:
        (n_bytes,) = _U64[order].unpack_from(data, at)
        return RawIndex(code, n_values, n_bytes), at + 8
    if size is None:
        if n_values:
            raise DamagedError(
                f"{n_values} {words}, whose size depends on the program that wrote them: "
                "write them as double precision there"
            )
        size = 0
    if size == 0 and n_values:
        raise DamagedError(f"{n_values} values of the type 'nothing'")
    return RawIndex(code, n_values, n_values * size), at


def _daqmx_index(data: bytes, at: int, order: str, is_line: bool) -> tuple[RawIndex, int]:
    code, dimension, n_values, n_scalers = _DAQMX[order].unpack_from(data, at)
    at += 20
    if code not in TYPES:
        raise DamagedError(f"values of the type 0x{code:X}, which there is not")
    _check_dimension(dimension)
    if n_scalers > MAX_SCALERS:
        raise DamagedError(f"{n_scalers} DAQmx scalers in one channel; at most {MAX_SCALERS} are read")
    packed = (_LINE if is_line else _SCALER)[order]
    stored = []
    for _ in range(n_scalers):
        scaler_type, buffer, offset, _, scale_id = packed.unpack_from(data, at)
        at += packed.size
        stored.append((scaler_type, buffer, offset, scale_id))
    (n_widths,) = _U32[order].unpack_from(data, at)
    at += 4
    if n_widths > MAX_BUFFERS:
        raise DamagedError(f"{n_widths} DAQmx buffers; at most {MAX_BUFFERS} are read")
    widths = struct.unpack_from(f"{order}{n_widths}I", data, at)
    scalers = tuple(_scaler(*scaler, widths, is_line) for scaler in stored)
    if code != DAQMX_RAW and n_scalers != 1:
        raise DamagedError(f"{n_scalers} DAQmx scalers in a channel of {TYPES[code][0]}, which has one")
    return RawIndex(code, n_values, None, scalers, widths, is_daqmx=True), at + 4 * n_widths


def _scaler(code: int, buffer: int, offset: int, scale_id: int, widths: tuple[int, ...], is_line: bool) -> Scaler:
    dtype = SCALER_TYPES.get(code)
    if dtype is None:
        raise DamagedError(f"a DAQmx scaler of the type {code}, which cannot be read")
    bit = offset % 8 if is_line else None
    if is_line:
        offset //= 8
        if dtype[0] == "f":
            raise DamagedError("a digital line whose values are no integers")
    if buffer >= len(widths):
        raise DamagedError(f"a DAQmx scaler in buffer {buffer} of {len(widths)}")
    if offset + int(dtype[1:]) > widths[buffer]:
        raise DamagedError(
            f"a DAQmx scaler at bytes {offset} to {offset + int(dtype[1:])} of a row of {widths[buffer]} bytes"
        )
    return Scaler(scale_id, dtype, buffer, offset, bit)

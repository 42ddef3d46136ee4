"""The chunks of a RIFF, RIFX, RF64 or BW64 file, walked without trusting them.

Sources: Microsoft/IBM *Multimedia Programming Interface and Data Specifications
1.0* (RIFF), EBU Tech 3306 (RF64), ITU-R BS.2088 (BW64), EBU Tech 3285 (`bext`).
The vendor chunk ``LEA `` carries name, unit and full scale of each channel; its
layout was read off a published file (ansys/example-data, ``accel_with_rpm.wav``).
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from tdacoustic.errors import FormatError

__all__ = ["LeaChannel", "WaveHeader", "parse_lea", "read_wave_header", "start_time_of_bext"]

MAX_CHUNKS = 10_000
MAX_KEPT_BYTES = 1 << 20
KEPT_CHUNKS = (b"LEA ", b"bext", b"LIST")
STREAMING_SIZES = (0, 0xFFFFFFFF, 0x7FFFF000)
"""What programs that write into a pipe put where the size belongs (ffmpeg the second, sox the third)."""

EXTENSIBLE = 0xFFFE


@dataclass
class WaveHeader:
    """What the chunks of a WAV file say.

    Parameters
    ----------
    file_size : int
    byte_order : str
        ``"<"`` or ``">"`` (RIFX).
    format_tag, n_channels, sample_rate_hz, block_align, bits, valid_bits : int
        Of the ``fmt `` chunk; `valid_bits` is below `bits` where the container is wider than the value.
    data_offset, data_size : int
        Where the samples lie.
    kept : dict
        Bodies of the chunks in `KEPT_CHUNKS`.
    flags : list of str
    """

    file_size: int
    byte_order: str
    format_tag: int = 0
    n_channels: int = 0
    sample_rate_hz: int = 0
    block_align: int = 0
    bits: int = 0
    valid_bits: int = 0
    data_offset: int = 0
    data_size: int = 0
    kept: dict[bytes, bytes] = field(default_factory=dict)
    flags: list[str] = field(default_factory=list)


def _is_chunk_id(text: bytes) -> bool:
    return len(text) == 4 and all(0x20 <= byte <= 0x7E for byte in text)


def read_wave_header(path: Path) -> WaveHeader:
    """Walk the chunks of a WAV file.

    Parameters
    ----------
    path : Path

    Returns
    -------
    WaveHeader

    Raises
    ------
    FormatError
        No ``fmt `` or no ``data`` chunk, or the data chunk claims more than the file holds.
    """
    file_size = path.stat().st_size
    with path.open("rb") as stream:
        head = stream.read(12)
        if len(head) < 12 or head[8:12] != b"WAVE":
            raise FormatError(f"{path}: no WAV file; it begins with {head!r}")
        header = WaveHeader(file_size, ">" if head[:4] == b"RIFX" else "<")
        _walk(path, stream, header)
    claimed = struct.unpack(header.byte_order + "I", head[4:8])[0]
    if claimed not in STREAMING_SIZES and claimed + 8 > file_size + 1:
        header.flags.append(f"the header claims {claimed + 8} bytes in all, the file holds {file_size}")
    if not header.data_offset:
        raise FormatError(f"{path}: truncated or damaged: no data chunk in {file_size} bytes")
    if not header.n_channels:
        raise FormatError(f"{path}: damaged: no fmt chunk")
    _check_data_size(path, header)
    return header


def _walk(path: Path, stream: BinaryIO, header: WaveHeader) -> None:
    position, ds64_data_size = 12, None
    for _ in range(MAX_CHUNKS):
        if position + 8 > header.file_size:
            if position < header.file_size and header.data_offset:
                header.flags.append(f"{header.file_size - position} bytes at the end belong to no chunk")
            return
        stream.seek(position)
        name, size = struct.unpack(header.byte_order + "4sI", stream.read(8))
        body = position + 8
        if not _is_chunk_id(name):
            left = f"{header.file_size - position} bytes from byte {position} on belong to no chunk"
            if not header.data_offset:
                raise FormatError(f"{path}: damaged: {left}, and no data chunk before them")
            header.flags.append(left)
            return
        if name == b"ds64" and size >= 16:
            sizes = stream.read(16)
            if len(sizes) < 16:
                raise FormatError(f"{path}: truncated: the file ends in its ds64 chunk")
            ds64_data_size = struct.unpack("<QQ", sizes)[1]
        elif name == b"fmt " and not header.n_channels:
            _read_fmt(path, stream.read(min(size, 64)), header)
        elif name == b"data" and not header.data_offset:
            size, streaming = _data_size(stream, header.file_size - body, size, ds64_data_size)
            header.data_offset, header.data_size = body, size
            if streaming:
                header.flags.append("the header does not say how long the data are (streamed): read to the file's end")
        elif name == b"data":
            header.flags.append("there is a second data chunk: it is not read")
        elif body + size > header.file_size:
            label = name.decode("ascii").strip()
            if not header.data_offset:
                raise FormatError(
                    f"{path}: truncated: chunk {label!r} claims {size} bytes, the file holds "
                    f"{header.file_size - body}, and no data chunk before it"
                )
            header.flags.append(f"chunk {label!r} behind the data is cut off and not used")
            return
        elif name in KEPT_CHUNKS and size <= MAX_KEPT_BYTES and name not in header.kept:
            header.kept[name] = stream.read(size)
        position = body + size
        if size % 2 and position < header.file_size:
            position += _padding(stream, position)
    header.flags.append(f"more than {MAX_CHUNKS} chunks: the rest is not read")


def _padding(stream: BinaryIO, end: int) -> int:
    """One byte after an odd chunk, unless the writer forgot it."""
    stream.seek(end)
    following = stream.read(5)
    return 0 if _is_chunk_id(following[:4]) and not _is_chunk_id(following[1:]) else 1


def _data_size(stream: BinaryIO, held: int, size: int, ds64_size: int | None) -> tuple[int, bool]:
    """Size that the data chunk claims, and whether it is a placeholder (then what the file holds)."""
    if ds64_size is not None and size == 0xFFFFFFFF:
        return (held, True) if ds64_size in (0, 0xFFFFFFFFFFFFFFFF) and held else (ds64_size, False)
    if size not in STREAMING_SIZES or size == held:
        return size, False
    if size == 0:
        following = stream.read(8)
        if len(following) < 8:
            return 0, False
        name, next_size = struct.unpack("<4sI", following)
        if _is_chunk_id(name) and 8 + next_size <= held:
            return 0, False
    return held, True


def _read_fmt(path: Path, body: bytes, header: WaveHeader) -> None:
    if len(body) < 16:
        raise FormatError(f"{path}: damaged: the fmt chunk has {len(body)} bytes, at least 16 are needed")
    tag, n_channels, rate, _, block_align, bits = struct.unpack(header.byte_order + "HHIIHH", body[:16])
    valid_bits = bits
    if tag == EXTENSIBLE and len(body) >= 40:
        valid_bits = struct.unpack(header.byte_order + "H", body[18:20])[0] or bits
        tag = struct.unpack("<H", body[24:26])[0]
    if n_channels == 0 or rate == 0 or block_align == 0:
        raise FormatError(
            f"{path}: damaged fmt chunk: {n_channels} channels, {rate} Hz, {block_align} bytes a sample of all channels"
        )
    header.format_tag, header.n_channels, header.sample_rate_hz = tag, n_channels, rate
    header.block_align, header.bits, header.valid_bits = block_align, bits, min(valid_bits, bits)


def _check_data_size(path: Path, header: WaveHeader) -> None:
    held = header.file_size - header.data_offset
    if header.data_size > held:
        claimed_samples, held_samples = header.data_size // header.block_align, held // header.block_align
        raise FormatError(
            f"{path}: truncated: the header claims {claimed_samples} samples, the file holds {held_samples}"
        )


@dataclass(frozen=True)
class LeaChannel:
    """Name, unit and full scale (the value of a stored 1.0) of a channel, from the ``LEA `` chunk."""

    name: str
    unit: str
    full_scale: float


def parse_lea(body: bytes, n_channels: int) -> tuple[LeaChannel, ...] | None:
    """Read the vendor chunk ``LEA ``; None where it is damaged or is of another number of channels."""
    channels: list[LeaChannel] = []
    at = 0
    try:
        for _ in range(n_channels):
            tag, length, full_scale, name_length = struct.unpack_from("<4sIfH", body, at)
            end = at + 8 + length
            name_end = at + 14 + name_length
            unit_length = struct.unpack_from("<H", body, name_end)[0]
            unit_end = name_end + 2 + unit_length
            if tag[:2] != b"le" or end > len(body) or unit_end > end:
                return None
            if not (math.isfinite(full_scale) and full_scale > 0.0):
                return None
            name, unit = (_text(part) for part in (body[at + 14 : name_end], body[name_end + 2 : unit_end]))
            channels.append(LeaChannel(name, unit, float(full_scale)))
            at = end
    except struct.error:
        return None
    return tuple(channels)


def _text(raw: bytes) -> str:
    raw = raw.split(b"\x00")[0]
    try:
        return raw.decode("utf-8").strip()
    except UnicodeDecodeError:
        return raw.decode("latin-1").strip()


def start_time_of_bext(body: bytes) -> str | None:
    r"""Origination date and time of a ``bext`` chunk as ISO 8601, None where they are no date.

    Examples
    --------
    >>> start_time_of_bext(b"\0" * 320 + b"2024-06-05" + b"13:49:58")
    '2024-06-05T13:49:58'
    """
    from datetime import datetime

    date, time = body[320:330].decode("latin-1"), body[330:338].decode("latin-1")
    digits = (date[:4], date[5:7], date[8:10], time[:2], time[3:5], time[6:8])
    if not all(part.isascii() and part.isdigit() for part in digits):
        return None
    try:
        moment = datetime(*(int(part) for part in digits))  # type: ignore[arg-type]
    except ValueError:
        return None
    return moment.isoformat() if 1980 <= moment.year <= 2200 else None

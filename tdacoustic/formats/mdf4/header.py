"""The head of an MDF 4 file: version, whether it was finished, when it began."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, timezone
from typing import Final

from tdacoustic.errors import FormatError
from tdacoustic.formats.mdf4.walk import Block, Walk

__all__ = ["Header", "read_header"]

ID_BYTES: Final = 64
_COUNTERS, _REDUCED_COUNTERS, _LAST_LENGTH = 1, 2, 4
_UNFINISHED: Final = (
    "the numbers of records",
    "the numbers of reduced records",
    "the length of the last data block",
    "the length of the last block of reduced records",
    "the last list of data blocks",
    "the lengths of values of variable length",
    "the places of values of variable length",
)
_LOCAL, _OFFSETS_VALID = 1, 2
_NEVER_SET: Final = 315_532_800
"""1980-01-01T00:00:00 in seconds after 1970: where the calendar of MS-DOS begins, and what converters from MDF 3 write
where there is no date."""


@dataclass(frozen=True)
class Header:
    """What the head says.

    Parameters
    ----------
    first_group : int
        Address of the first data group.
    counts_missing : bool
        The writer did not come to state the numbers of records.
    length_missing : bool
        Nor the length of the last data block.
    start_time : str or None
        ISO 8601.
    flags : tuple of str
    metadata : tuple of (str, str)
    """

    first_group: int
    counts_missing: bool
    length_missing: bool
    start_time: str | None
    flags: tuple[str, ...]
    metadata: tuple[tuple[str, str], ...]


def read_header(walk: Walk) -> Header:
    """Read the identification and the header block.

    Raises
    ------
    FormatError
        Another version, truncated, or unfinished in a way that leaves the data in doubt.
    """
    walk.stream.seek(0)
    raw = walk.stream.read(ID_BYTES)
    if len(raw) < ID_BYTES:
        raise FormatError(f"{walk.path}: truncated: {len(raw)} bytes, the identification alone has {ID_BYTES}")
    written = raw[8:16].partition(b"\0")[0].decode("latin-1").strip()
    (version,) = struct.unpack_from("<H", raw, 28)
    if written[:1] in ("2", "3") or (200 <= version < 400):
        raise FormatError(
            f"{walk.path}: is MDF {written or version / 100:}, which is not read: save it as MDF 4 with the logger's "
            "program, or with asammdf: MDF(path).convert('4.10').save(new_path)"
        )
    if written[:1] != "4":
        raise FormatError(f"{walk.path}: is MDF of the unknown version {written!r}: versions 4.0 to 4.3 are read")
    open_points = _open_points(walk, raw)
    block = walk.block(ID_BYTES, ("HD",), "header")
    flags = []
    if open_points is not None:
        what = (
            ", ".join(text for bit, text in enumerate(_UNFINISHED) if open_points >> bit & 1) or "nothing that is said"
        )
        flags.append(f"the recording was not finished: its writer left open {what}")
    program = raw[16:24].partition(b"\0")[0].decode("latin-1").strip()
    fields = (("MDF version", written), ("written by", program), ("comment", walk.text(block.link(5)) or ""))
    return Header(
        block.link(0),
        bool((open_points or 0) & _COUNTERS),
        bool((open_points or 0) & _LAST_LENGTH),
        _start_time(block, flags),
        tuple(flags),
        tuple((key, value) for key, value in fields if value),
    )


def _open_points(walk: Walk, raw: bytes) -> int | None:
    """Return what an unfinished file leaves open, None for a finished one."""
    if raw[:8] != b"UnFinMF ":
        return None
    standard, custom = struct.unpack_from("<HH", raw, 60)
    fatal = standard & ~(_COUNTERS | _REDUCED_COUNTERS | _LAST_LENGTH)
    if fatal or custom:
        what = ", ".join(text for bit, text in enumerate(_UNFINISHED) if fatal >> bit & 1)
        raise FormatError(
            f"{walk.path}: the recording was not finished: its writer left open {what or 'points of its own'} "
            f"(flags {standard:#x}, own flags {custom:#x}); finish it with the logger's program"
        )
    return int(standard)


def _start_time(block: Block, flags: list[str]) -> str | None:
    """Return the start as ISO 8601: with its offset from UTC, or without one where it is local time."""
    nanoseconds, zone, summer, time_flags = block.fields("<QhhB")
    if nanoseconds == 0:
        return None
    if nanoseconds == _NEVER_SET * 10**9:
        flags.append("its start is 1980-01-01, the date of a clock that was never set: it is not used")
        return None
    try:
        moment = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=nanoseconds // 1000)
        if time_flags & _LOCAL:
            return moment.replace(tzinfo=None).isoformat()
        if time_flags & _OFFSETS_VALID:
            moment = moment.astimezone(timezone(timedelta(minutes=zone + summer)))
    except (OverflowError, ValueError):
        flags.append(f"its start, {nanoseconds} ns after 1970 with an offset of {zone + summer} min, is no date")
        return None
    return moment.isoformat()

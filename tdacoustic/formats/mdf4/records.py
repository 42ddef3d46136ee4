"""The records of a group, read in steps from its run of bytes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FormatError
from tdacoustic.formats.mdf4.data import Run, RunReader

__all__ = ["RecordReader", "Records"]

Bytes = NDArray[np.uint8]


@dataclass(frozen=True)
class Records:
    """Where a group's records lie.

    Parameters
    ----------
    label : str
        Of the group.
    values, invalid : Run
        Records, and their invalidation bytes where these lie apart.
    apart : bool
    n_records : int
    id_bytes, record_id : int
    data_bytes, invalid_bytes : int
        Of a record.
    """

    label: str
    values: Run
    invalid: Run
    apart: bool
    n_records: int
    id_bytes: int
    record_id: int
    data_bytes: int
    invalid_bytes: int

    @property
    def record_bytes(self) -> int:
        """From one record to the next."""
        return self.id_bytes + self.data_bytes + (0 if self.apart else self.invalid_bytes)

    @property
    def longest_packed(self) -> int:
        """Bytes that are kept in memory where packed blocks are."""
        return self.values.longest_packed + self.invalid.longest_packed


class RecordReader:
    """Reads records of an open file.

    Parameters
    ----------
    path : Path
    stream : BinaryIO
    records : Records
    keeps : bool
        See `RunReader`.
    """

    def __init__(self, path: Path, stream: BinaryIO, records: Records, keeps: bool = True) -> None:
        self.path, self.records = path, records
        self._values = RunReader(path, stream, records.values, keeps)
        self._invalid = RunReader(path, stream, records.invalid, keeps)

    def read(self, first: int, last: int) -> tuple[Bytes, Bytes | None]:
        """Return the bytes of records without their ids, and their invalidation bytes.

        Raises
        ------
        FormatError
            The file ends before, cannot be unpacked, or the records are another group's.
        """
        held = self.records
        size = held.record_bytes
        raw = np.frombuffer(self._values.read(first * size, last * size), np.uint8).reshape(last - first, size)
        if held.id_bytes:
            ids = raw[:, : held.id_bytes]
            own = np.frombuffer(held.record_id.to_bytes(8, "little"), np.uint8)[: held.id_bytes]
            other = np.flatnonzero((ids != own).any(axis=1))
            if len(other):
                number = first + int(other[0])
                raise FormatError(
                    f"{self.path}: damaged: record {number} of {held.label!r} has the id of another group"
                )
        behind = held.id_bytes + held.data_bytes
        if not held.apart:
            return raw[:, held.id_bytes : behind], raw[:, behind:] if held.invalid_bytes else None
        if not (held.invalid_bytes and held.invalid.length):
            return raw[:, held.id_bytes : behind], None
        width = held.invalid_bytes
        marks = np.frombuffer(self._invalid.read(first * width, last * width), np.uint8)
        return raw[:, held.id_bytes : behind], marks.reshape(last - first, width)

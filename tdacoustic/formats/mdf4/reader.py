"""MDF 4 (ASAM), of any rasters.

Every channel group is a raster of its own: its master channel says rate and start, and groups are never joined. The
blocks are walked and the records read here, with `asammdf` as the oracle of the tests: that library sorts and unpacks
into temporary files and compiles formulas that a file holds, and its memory grows with the length of what is read.

Left out with a flag are texts, arrays, structures, values of variable length, frames of a bus, groups whose instants
are not even, and groups whose records lie mixed (unsorted files). Samples that a record marks invalid are NaN. What
the writer did not finish (``UnFinMF``) is read where the number of records follows from the bytes, with a flag.
Groups in columns (MDF 4.2) are read after the standard's layout alone: no program that writes them could be had.
Attachments are not touched. MDF 3 is refused. A formula is computed by `formula`, never executed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FormatError
from tdacoustic.formats.blocks import by_origin, check_request, in_asked_order, spans
from tdacoustic.formats.mdf4.clocks import Clock
from tdacoustic.formats.mdf4.fields import Field
from tdacoustic.formats.mdf4.header import read_header
from tdacoustic.formats.mdf4.rasters import read_channels
from tdacoustic.formats.mdf4.records import RecordReader, Records
from tdacoustic.formats.mdf4.walk import Walk
from tdacoustic.recording import Log

__all__ = ["Mdf4Reader", "Source", "scan_file"]

SLAB_BYTES: Final = 4 << 20
"""Of records that are read at a time, from all groups together."""

LEAST_ROWS: Final = 256
MAX_KEPT: Final = 128 << 20
"""Where the unpacked blocks of all groups together exceed this, none is kept: they are unpacked more than once."""


@dataclass(frozen=True)
class Source:
    """Where a channel's samples lie.

    Parameters
    ----------
    group : int
        Index into `Mdf4Reader.groups`.
    field : Field
    """

    group: int
    field: Field


@dataclass(frozen=True)
class Timed:
    """The records of a group and the clock they follow.

    Parameters
    ----------
    records : Records
    clock : Clock or None
        None where no master says when.
    master : Records or None
        Where the master lies in another group.
    """

    records: Records
    clock: Clock | None = None
    master: Records | None = None


@dataclass(frozen=True)
class Mdf4Reader:
    """Reads blocks of channels.

    Parameters
    ----------
    path : Path
    groups : tuple of Timed
    sources : tuple of Source
        Of each channel.
    """

    path: Path
    groups: tuple[Timed, ...]
    sources: tuple[Source, ...]

    def blocks(self, columns: Sequence[int], start: int, stop: int, block_size: int) -> Iterator[NDArray[np.float64]]:
        """Yield float64 arrays of shape (len(columns), n); see `tdacoustic.recording.log.Reader`.

        Raises
        ------
        FormatError
            The file ends before `stop`, is damaged, or instants are not even that were not looked at before.
        """
        chosen = [self.sources[column] for column in columns]
        n_samples = min((self.groups[source.group].records.n_records for source in chosen), default=0)
        check_request(self.path, n_samples, start, stop, block_size)
        rows = by_origin(source.group for source in chosen)
        keeps = sum(self.groups[group].records.longest_packed for group in rows) <= MAX_KEPT
        with _opened(self.path) as stream:
            slabs = [
                self._slabs(stream, group, [chosen[row].field for row in members], start, stop, len(rows), keeps)
                for group, members in rows.items()
            ]
            yield from in_asked_order(slabs, rows.values(), block_size)

    def _slabs(
        self,
        stream: BinaryIO,
        group: int,
        fields: Sequence[Field],
        start: int,
        stop: int,
        n_groups: int,
        keeps: bool,
    ) -> Iterator[NDArray[np.float64]]:
        """Yield the values of one group's channels."""
        timed = self.groups[group]
        reader = RecordReader(self.path, stream, timed.records, keeps)
        master = None if timed.master is None else RecordReader(self.path, stream, timed.master, keeps)
        n_rows = max(LEAST_ROWS, SLAB_BYTES // (n_groups * timed.records.record_bytes))
        n_rows = min(n_rows, max(1, 4 * SLAB_BYTES // max(timed.records.record_bytes, 8 * len(fields))))
        for first, last in spans(start, stop, n_rows):
            records, invalid = reader.read(first, last)
            if timed.clock is not None:
                self._check_even(timed, first, records if master is None else master.read(first, last)[0])
            found = np.empty((len(fields), last - first))
            for row, field in enumerate(fields):
                found[row] = field.values(records, invalid)
            yield found

    def _check_even(self, timed: Timed, first: int, records: NDArray[np.uint8]) -> None:
        clock = timed.clock
        assert clock is not None
        times = clock.times_s(records)
        broken = clock.first_break(first, times)
        if broken is not None:
            raise FormatError(
                f"{self.path}: {timed.records.label!r} is not evenly sampled: sample {broken} is at "
                f"{times[broken - first]:.9g} s, {clock.start_s + broken * clock.step_s:.9g} s was expected; "
                "it is not resampled silently"
            )


@contextmanager
def _opened(path: Path) -> Iterator[BinaryIO]:
    try:
        with path.open("rb") as stream:
            yield stream
    except OSError as error:
        raise FormatError(f"{path}: cannot be read ({error.strerror})") from error


def scan_file(path: Path) -> Log:
    """Walk the blocks of an MDF 4 file.

    Returns
    -------
    Log

    Raises
    ------
    FormatError
        Truncated, damaged, of another version, or without a channel that can be read.
    """
    with _opened(path) as stream:
        walk = Walk(path, stream, path.stat().st_size)
        header = read_header(walk)
        found = read_channels(walk, header)
    if not found.channels:
        raise FormatError(f"{path}: no channel in it that can be read: {'; '.join(found.flags) or 'it has none'}")
    groups = tuple(Timed(group.records, group.clock, group.master) for group in found.groups)
    sources = tuple(Source(group, field) for group, field in found.fields)
    return Log(
        path,
        "mdf4",
        found.channels,
        Mdf4Reader(path, groups, sources),
        start_time=header.start_time,
        flags=(*header.flags, *found.flags),
        metadata=header.metadata,
    )

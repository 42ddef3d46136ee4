"""TDMS: the logs of LabVIEW, DAQmx, SignalExpress, FlexLogger and DIAdem.

The segments are walked (`walk`) and the values read (`tracks`) here: npTDMS reads
truncated files without a word, holds an object for every segment, and reads a block of
a file of many small segments slowly. Of npTDMS come the scalings of sensors, and it is
the oracle of the tests. An index beside the log (``.tdms_index``) is not read.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FormatError
from tdacoustic.formats.blocks import by_origin, check_request, in_asked_order
from tdacoustic.formats.tdms.channels import (
    Found,
    Inventory,
    flag_joins_and_lengths,
    flag_time_columns,
    join_starts,
    left_out_flags,
    log_channels,
    take_inventory,
)
from tdacoustic.formats.tdms.copies import leave_out_copies
from tdacoustic.formats.tdms.metadata import Instant, PropertyValue
from tdacoustic.formats.tdms.timing import instant_text
from tdacoustic.formats.tdms.tracks import Member, Track
from tdacoustic.formats.tdms.walk import walk
from tdacoustic.recording import Log

__all__ = ["TdmsReader", "scan_file"]

INDEX_TAG = b"TDSh"
MAX_METADATA_ROWS = 20
MAX_TEXT = 200


@dataclass(frozen=True)
class TdmsReader:
    """Reads blocks of channels.

    Parameters
    ----------
    path : Path
    size : int
        Bytes of the file when it was scanned.
    tracks : tuple of Track
    channels : tuple of ((int, int), Member)
        Track and row of each channel.
    """

    path: Path
    size: int
    tracks: tuple[Track, ...]
    channels: tuple[tuple[tuple[int, int], Member], ...]

    def blocks(self, columns: Sequence[int], start: int, stop: int, block_size: int) -> Iterator[NDArray[np.float64]]:
        """Yield float64 arrays of shape (len(columns), n); see `tdacoustic.recording.log.Reader`.

        Raises
        ------
        FormatError
            The file ends before `stop`, or a value cannot be scaled.
        """
        chosen = [self.channels[column] for column in columns]
        shortest = min((self.tracks[place[0]].n_values for place, _ in chosen), default=0)
        check_request(self.path, shortest, start, stop, block_size)
        rows = by_origin(place[0] for place, _ in chosen)
        try:
            with self.path.open("rb", buffering=0) as stream:
                size = stream.seek(0, 2)
                if size < self.size:
                    raise FormatError(
                        f"{self.path}: the file has {size} bytes, and had {self.size} when it was scanned"
                    )
                pieces = []
                for track, members in rows.items():
                    wanted = [(chosen[row][0][1], chosen[row][1]) for row in members]
                    pieces.append(self.tracks[track].pieces(self.path, stream, wanted, start, stop))
                yield from in_asked_order(pieces, rows.values(), block_size)
        except OSError as error:
            raise FormatError(f"{self.path}: cannot be read ({error.strerror})") from error


def scan_file(path: Path) -> Log:
    """Walk the segments of a TDMS file.

    Returns
    -------
    Log

    Raises
    ------
    FormatError
        Truncated, damaged, an index, or without a channel of real numbers.
    """
    with path.open("rb") as stream:
        if stream.read(4) == INDEX_TAG:
            log = path.with_name(path.name.removesuffix("_index"))
            beside = (
                f"open {log.name!r}, which lies beside it"
                if log != path and log.is_file()
                else "open the .tdms beside it"
            )
            raise FormatError(f"{path}: an index of a TDMS file, without its values: {beside}")
    structure = walk(path)
    inventory = take_inventory(structure)
    leave_out_copies(inventory, lambda item, start, stop: _values(path, inventory, item, start, stop))
    join_starts(inventory)
    flag_joins_and_lengths(inventory)
    flag_time_columns(inventory)
    channels, start_time, date_flags = log_channels(inventory.found)
    flags = (*left_out_flags(inventory), *structure.flags, *date_flags)
    if not channels:
        raise FormatError(f"{path}: no channel of real numbers ({'; '.join(flags) or 'nothing in it'})")
    members = tuple(
        (item.place, Member(channel.name, item.scaling))
        for item, channel in zip(inventory.found, channels, strict=True)
    )
    return Log(
        path,
        "tdms",
        channels,
        TdmsReader(path, structure.size, tuple(inventory.tracks), members),
        start_time=start_time,
        flags=flags,
        metadata=_metadata(structure.properties.get("/", {})),
    )


def _values(path: Path, inventory: Inventory, item: Found, start: int, stop: int) -> NDArray[np.float64]:
    """A few values of a channel, to compare a copy with its original."""
    with path.open("rb", buffering=0) as stream:
        rows = [(item.place[1], Member(item.channel, item.scaling))]
        pieces = list(inventory.tracks[item.place[0]].pieces(path, stream, rows, start, stop))
    return np.concatenate(pieces, axis=1)[0]


def _metadata(properties: dict[str, PropertyValue]) -> tuple[tuple[str, str], ...]:
    rows = []
    for name, value in properties.items():
        if isinstance(value, Instant):
            text = instant_text(value.ticks)
        else:
            text = str(value).strip("\x00 \t\r\n") if value is not None else ""
        if text:
            rows.append((name[:MAX_TEXT], text[:MAX_TEXT]))
    return tuple(rows[:MAX_METADATA_ROWS])

"""Values of the arrays of MAT-files of level 4 and 5, in blocks.

An array lies column after column. Where each column is a channel, a channel is
one run of bytes; where each row is one, the channels are interleaved. The columns
of a packed array that were asked for are unpacked side by side, each from its own
place: one unpacking finds the places, a second one gives the values.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FormatError
from tdacoustic.formats.blocks import by_origin, check_request, in_asked_order
from tdacoustic.formats.matlab.storage import Place, storage_of

__all__ = ["MatReader", "Source", "Values"]

SLAB_BYTES = 8 << 20
"""What is read at a time from all arrays together."""


@dataclass(frozen=True)
class Values:
    """Where the values of an array lie.

    Parameters
    ----------
    place : Place
        Of the variable.
    size : int
        Bytes of the unpacked variable.
    position : int
        Of the first value in it.
    dtype : str
        As stored, with the byte order.
    shape : (int, int)
        Rows and columns; column after column.
    name : str
        For messages.
    """

    place: Place
    size: int
    position: int
    dtype: str
    shape: tuple[int, int]
    name: str


@dataclass(frozen=True)
class Source:
    """A channel of an array: ``value = stored * scale``.

    Parameters
    ----------
    values : Values
    time_axis : int
        0 where a column is a channel, 1 where a row is.
    column : int
        Which of them.
    scale : float
    """

    values: Values
    time_axis: int
    column: int
    scale: float = 1.0

    @property
    def n_samples(self) -> int:
        """Length of the channel."""
        return self.values.shape[self.time_axis]


@dataclass(frozen=True)
class MatReader:
    """Reads blocks of arrays."""

    path: Path
    sources: tuple[Source, ...]

    def blocks(self, columns: Sequence[int], start: int, stop: int, block_size: int) -> Iterator[NDArray[np.float64]]:
        """Yield float64 arrays of shape (len(columns), n); see `tdacoustic.recording.log.Reader`.

        Raises
        ------
        FormatError
            The file ends before `stop`, or what is packed is damaged.
        """
        chosen = [self.sources[column] for column in columns]
        check_request(self.path, min((source.n_samples for source in chosen), default=0), start, stop, block_size)
        rows = by_origin((source.values, source.time_axis) for source in chosen)
        if start == stop or not chosen:
            return
        try:
            with self.path.open("rb") as stream:
                slabs = [
                    self._slabs(stream, [chosen[row] for row in members], start, stop, len(chosen))
                    for members in rows.values()
                ]
                yield from in_asked_order(slabs, rows.values(), block_size)
        except OSError as error:
            raise FormatError(f"{self.path}: cannot be read ({error.strerror})") from error

    def _slabs(
        self, stream: BinaryIO, sources: Sequence[Source], start: int, stop: int, n_channels: int
    ) -> Iterator[NDArray[np.float64]]:
        """Yield the values of one array's channels."""
        values = sources[0].values
        storage = storage_of(self.path, stream, values.place, f"variable {values.name!r}", values.size)
        dtype = np.dtype(values.dtype)
        wanted = sorted({source.column for source in sources})
        place_of = {column: place for place, column in enumerate(wanted)}
        picked = [place_of[source.column] for source in sources]
        scale = np.array([[source.scale] for source in sources])
        interleaved = sources[0].time_axis == 1 and values.shape[0] > 1
        n_rows = values.shape[0]
        if interleaved:
            begins = [values.position + start * n_rows * dtype.itemsize]
            step = max(1, SLAB_BYTES * len(sources) // (n_channels * max(dtype.itemsize, 8) * n_rows))
        else:
            length = sources[0].n_samples
            begins = [values.position + (column * length + start) * dtype.itemsize for column in wanted]
            step = max(1, SLAB_BYTES // (n_channels * 8))
        cursors = storage.cursors(begins)
        for first in range(start, stop, step):
            count = min(step, stop - first)
            if interleaved:
                stored = np.empty((count, n_rows), dtype)
                cursors[0].read_into(stored)
                data = stored.T[[source.column for source in sources]].astype(np.float64)
            else:
                slab = np.empty((len(wanted), count), dtype)
                for row, cursor in zip(slab, cursors, strict=True):
                    cursor.read_into(row)
                data = slab.astype(np.float64, copy=False)
                data = data if picked == list(range(len(wanted))) else data[picked]
            if first + count == stop:
                storage.verify()
            yield data * scale if np.any(scale != 1.0) else data

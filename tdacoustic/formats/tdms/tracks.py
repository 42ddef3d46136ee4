"""Channels whose values lie in the same chunks, and how their values are read.

Segments of one layout at equal distances are one run, so that a file of very many
small segments is read in long stretches like a file of one. Where a run does not go on,
one segment is read at a time.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FormatError
from tdacoustic.formats.tdms.layouts import Column
from tdacoustic.formats.tdms.paths import shown
from tdacoustic.formats.tdms.scalings import Scaling
from tdacoustic.formats.tdms.structure import Structure

__all__ = ["Member", "Track", "tracks_of"]

Integers = NDArray[np.int64]
Values = NDArray[np.float64]

PIECE_BYTES: Final = 1 << 21
"""Of the values that are made at a time, all channels together."""

SPAN_BYTES: Final = 1 << 22
"""Most that is read at once where it is not all wanted."""

READ_COST_BYTES: Final = 1 << 14
"""Bytes that could be read in the time that one more call takes [assumed]."""


@dataclass(frozen=True)
class Member:
    """A channel of a track: its name, and how its stored numbers become values."""

    name: str
    scaling: Scaling | None = None


@dataclass(frozen=True)
class Track:
    """Runs of chunks with the same channels.

    Parameters
    ----------
    positions, strides, n_chunks : ndarray of int, shape (runs,)
        First byte of a run's first chunk, bytes from one chunk to the next, and how many.
    kinds : ndarray of int, shape (runs,)
        Which of `columns` and `counts`.
    firsts : ndarray of int, shape (runs + 1,)
        Number of the first value of each run, and of all.
    columns : tuple
        For each kind and each channel, where its numbers lie in a chunk.
    counts : tuple of int
        Values a chunk, for each kind.
    """

    positions: Integers
    strides: Integers
    n_chunks: Integers
    kinds: Integers
    firsts: Integers
    columns: tuple[tuple[tuple[Column, ...], ...], ...]
    counts: tuple[int, ...]

    @property
    def n_values(self) -> int:
        """Of each of its channels."""
        return int(self.firsts[-1])

    def pieces(
        self, path: Path, stream: BinaryIO, rows: Sequence[tuple[int, Member]], start: int, stop: int
    ) -> Iterator[Values]:
        """Yield the values of some of its channels, float64 of shape (len(rows), n) with any n each.

        Raises
        ------
        FormatError
            The file ends before `stop`, or a value cannot be scaled.
        """
        source = _Source(path, stream)
        run = int(np.searchsorted(self.firsts, start, side="right")) - 1
        limit = max(1, PIECE_BYTES // (8 * len(rows)))
        at = start
        while at < stop:
            while at >= self.firsts[run + 1]:
                run += 1
            count = self.counts[int(self.kinds[run])]
            first, step = int(self.positions[run]), int(self.strides[run])
            columns = [self.columns[int(self.kinds[run])][row] for row, _ in rows]
            chunk, within = divmod(at - int(self.firsts[run]), count)
            end = min(stop, int(self.firsts[run + 1])) - int(self.firsts[run])
            widest = max(column.step for parts in columns for column in parts)
            most = max(1, min(limit, SPAN_BYTES // widest))
            n_chunks = min(max(1, most // count), max(1, SPAN_BYTES // step), end // count - chunk)
            if within or count > most or n_chunks < 1:
                n_chunks, n = 1, min(count - within, most, end - chunk * count - within)
            else:
                n = count
            base = first + chunk * step
            values = np.empty((len(rows), n_chunks * n))
            views = source.views(columns, base, step, n_chunks, within, n)
            for row, (view, (_, member)) in enumerate(zip(views, rows, strict=True)):
                self._fill(values[row].reshape(n_chunks, n), view, member, path)
            yield values
            at += n_chunks * n

    def _fill(self, values: Values, view: dict[int, NDArray[np.generic]], member: Member, path: Path) -> None:
        if member.scaling is None:
            with np.errstate(invalid="ignore"):  # NaN of single precision may say so
                values[...] = next(iter(view.values()))
            return
        with np.errstate(invalid="ignore"):
            flat = {scale_id: numbers.astype(np.float64).reshape(-1) for scale_id, numbers in view.items()}
        try:
            values[...] = member.scaling.apply(flat).reshape(values.shape)
        except ValueError as error:
            raise FormatError(f"{path}: channel {shown(member.name)}: a value cannot be scaled ({error})") from error


class _Source:
    """Reads stretches of the file into one buffer that it keeps."""

    def __init__(self, path: Path, stream: BinaryIO) -> None:
        self.path = path
        self.stream = stream
        self.buffer = np.empty(0, dtype=np.uint8)

    def _read(self, position: int, target: NDArray[np.uint8]) -> None:
        self.stream.seek(position)
        filled = 0
        while filled < target.size:
            got = self.stream.readinto(target.data[filled:])  # type: ignore[attr-defined]
            if not got:
                raise FormatError(
                    f"{self.path}: the file ends at byte {position + filled}, values were to be read up to byte "
                    f"{position + target.size}: it has changed since it was scanned"
                )
            filled += got

    def _space(self, n_bytes: int) -> NDArray[np.uint8]:
        if self.buffer.size < n_bytes:
            self.buffer = np.empty(n_bytes, dtype=np.uint8)
        return self.buffer[:n_bytes]

    def views(
        self, columns: Sequence[tuple[Column, ...]], base: int, stride: int, n_chunks: int, within: int, n: int
    ) -> list[dict[int, NDArray[np.generic]]]:
        """Stored numbers of each channel, shape (n_chunks, n), by scale; they last until the next call."""
        spans = [_span(column, within, n) for parts in columns for column in parts]
        low, high = min(span[0] for span in spans), max(span[1] for span in spans)
        together = (n_chunks - 1) * stride + high - low
        wanted = sum(last - first for first, last in set(spans)) * n_chunks
        if together <= 1.5 * wanted + READ_COST_BYTES * len(set(spans)) * n_chunks:
            space = self._space(together)
            self._read(base + low, space)
            return [
                {
                    column.scale_id: _view(space, column, within * column.step - low, stride, n_chunks, n)
                    for column in parts
                }
                for parts in columns
            ]
        return [
            {column.scale_id: self._alone(column, base, stride, n_chunks, within, n) for column in parts}
            for parts in columns
        ]

    def _alone(self, column: Column, base: int, stride: int, n_chunks: int, within: int, n: int) -> NDArray[np.generic]:
        """Numbers of one column, each chunk by a call of its own."""
        first, last = _span(column, within, n)
        space = np.empty((n_chunks, last - first), dtype=np.uint8)
        for chunk in range(n_chunks):
            self._read(base + chunk * stride + first, space[chunk])
        return _view(space.reshape(-1), column, -column.offset, last - first, n_chunks, n)


def _span(column: Column, within: int, n: int) -> tuple[int, int]:
    """First byte of a column's numbers in a chunk, and one past the last."""
    first = column.offset + within * column.step
    return first, first + (n - 1) * column.step + np.dtype(column.dtype).itemsize


def _view(
    space: NDArray[np.uint8], column: Column, shift: int, stride: int, n_chunks: int, n: int
) -> NDArray[np.generic]:
    view: NDArray[np.generic] = np.ndarray(
        (n_chunks, n), column.dtype, space.data, column.offset + shift, (stride, column.step)
    )
    if column.bit is not None:
        view = np.right_shift(view, column.bit) & 1
    return view


def tracks_of(structure: Structure) -> tuple[list[Track], dict[int, tuple[int, int]], dict[int, Integers]]:
    """Group the channels whose values lie in the same chunks.

    Returns
    -------
    tracks : list of Track
    places : dict
        Object -> (track, row in the track), of those that hold real numbers.
    stretches : dict
        Track -> numbers of the stretches of `Structure` that it is in.
    """
    holds: dict[int, list[tuple[int, int]]] = {}
    columns = [layout.columns(structure.indexes) for layout in structure.layouts]
    for number, layout in enumerate(structure.layouts):
        for channel, count in layout.counts(structure.indexes):
            if count and columns[number].get(channel):
                holds.setdefault(channel, []).append((number, count))
    layouts = np.asarray(structure.segment_layouts, dtype=np.int64)
    ends = np.cumsum(np.bincount(layouts, minlength=len(structure.layouts)))
    by_layout = np.split(np.argsort(layouts, kind="stable"), ends[:-1]) if structure.layouts else []
    together: dict[tuple[tuple[int, int], ...], list[int]] = {}
    for channel, parts in holds.items():
        present = tuple(part for part in parts if len(by_layout[part[0]]))
        if present:
            together.setdefault(present, []).append(channel)
    tracks: list[Track] = []
    places: dict[int, tuple[int, int]] = {}
    stretches: dict[int, Integers] = {}
    for present, channels in together.items():
        for row, channel in enumerate(channels):
            places[channel] = (len(tracks), row)
        kinds = tuple(tuple(columns[number][channel] for channel in channels) for number, _ in present)
        track, stretch = _track(structure, by_layout, present, kinds)
        stretches[len(tracks)] = stretch
        tracks.append(track)
    return tracks, places, stretches


def _track(
    structure: Structure,
    by_layout: Sequence[Integers],
    present: tuple[tuple[int, int], ...],
    columns: tuple[tuple[tuple[Column, ...], ...], ...],
) -> tuple[Track, Integers]:
    """Join the segments of one layout at equal distances to runs."""
    stretch = np.concatenate([by_layout[number] for number, _ in present])
    kinds = np.repeat(np.arange(len(present)), [len(by_layout[number]) for number, _ in present])
    in_order = np.argsort(stretch)
    stretch, kinds = stretch[in_order], kinds[in_order]
    positions = np.asarray(structure.positions, dtype=np.int64)[stretch]
    chunks = np.asarray(structure.chunks, dtype=np.int64)[stretch]
    steps = np.diff(positions)
    joined = (kinds[1:] == kinds[:-1]) & (chunks[1:] == 1) & (chunks[:-1] == 1)
    joined[1:] &= ~joined[:-1] | (steps[1:] == steps[:-1])
    heads = np.flatnonzero(np.concatenate(([True], ~joined)))
    length = np.diff(np.append(heads, len(positions)))
    sizes = [
        structure.layouts[number].part_bytes or structure.layouts[number].chunk_bytes(structure.indexes)
        for number, _ in present
    ]
    strides = np.array(sizes, dtype=np.int64)[kinds[heads]]
    long = length > 1
    strides[long] = steps[heads[long]]
    counts = np.array([count for _, count in present], dtype=np.int64)
    n_chunks = np.where(long, length, chunks[heads])
    firsts = np.concatenate(([0], np.cumsum(n_chunks * counts[kinds[heads]])))
    track = Track(
        positions[heads], strides, n_chunks, kinds[heads], firsts, columns, tuple(int(count) for count in counts)
    )
    return track, stretch

"""Where each channel's values lie within a chunk of raw data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from tdacoustic.formats.tdms.metadata import DAQMX_RAW, TEXT, TYPES, DamagedError, RawIndex

__all__ = ["Column", "Layout"]

RAW = 0xFFFFFFFF
"""What the scalings call the values of a channel that are not DAQmx raw data."""


class Column(NamedTuple):
    """The numbers of a channel in a chunk: the k-th one at byte ``offset + k * step``."""

    offset: int
    step: int
    dtype: str
    bit: int | None
    scale_id: int


@dataclass(frozen=True)
class Layout:
    """A chunk: which objects have values in it, and in which order.

    Parameters
    ----------
    entries : tuple of (int, int)
        Number of the object and of its raw data index, in the order of the values.
    order : str
        ``"<"`` or ``">"``.
    interleaved : bool
        One value of each channel after the other, rather than all of one channel.
    part_bytes : int
        Of a last chunk that is shorter than its index says; 0 for a whole one.
    """

    entries: tuple[tuple[int, int], ...]
    order: str
    interleaved: bool
    part_bytes: int = 0

    def is_daqmx(self, indexes: Sequence[RawIndex]) -> bool:
        """Whether its values are in rows of DAQmx buffers.

        Raises
        ------
        DamagedError
            Only some of them are.
        """
        kinds = {indexes[index].is_daqmx for _, index in self.entries}
        if len(kinds) > 1:
            raise DamagedError("DAQmx raw data and other values in one segment")
        return True in kinds

    def buffers(self, indexes: Sequence[RawIndex]) -> list[tuple[int, int]]:
        """Rows and bytes a row of each DAQmx buffer.

        Raises
        ------
        DamagedError
            The channels do not agree on the rows.
        """
        widths = {indexes[index].widths for _, index in self.entries}
        if len(widths) != 1:
            raise DamagedError("DAQmx channels of one segment state different rows")
        rows = [0] * len(next(iter(widths)))
        for _, index in self.entries:
            for scaler in indexes[index].scalers:
                rows[scaler.buffer] = max(rows[scaler.buffer], indexes[index].n_values)
        return list(zip(rows, next(iter(widths)), strict=True))

    def chunk_bytes(self, indexes: Sequence[RawIndex]) -> int:
        """Bytes of a whole chunk.

        Raises
        ------
        DamagedError
            The objects contradict each other.
        """
        if not self.entries:
            return 0
        if self.is_daqmx(indexes):
            return sum(rows * width for rows, width in self.buffers(indexes))
        if self.interleaved:
            if len({indexes[index].n_values for _, index in self.entries}) > 1:
                raise DamagedError("interleaved channels of different lengths")
            if any(indexes[index].type_code == TEXT for _, index in self.entries):
                raise DamagedError("interleaved text")
        return sum(indexes[index].n_bytes or 0 for _, index in self.entries)

    def split_part(self, rest: int, indexes: Sequence[RawIndex]) -> int | None:
        """How many bytes of a last, shorter chunk hold one and the same number of values of every channel.

        None where the values in it cannot be told apart.
        """
        if self.is_daqmx(indexes):
            used = [(rows, width) for rows, width in self.buffers(indexes) if rows]
            row = used[0][1] if len(used) == 1 else 0
        elif self.interleaved:
            row = sum(TYPES[indexes[index].type_code][1] or 0 for _, index in self.entries)
        else:
            whole = self.chunk_bytes(indexes)
            if any(indexes[index].type_code == TEXT for _, index in self.entries):
                return None
            exact = all(indexes[index].n_values * rest % whole == 0 for _, index in self.entries)
            return rest if exact else None
        return rest // row * row if row else None

    def counts(self, indexes: Sequence[RawIndex]) -> list[tuple[int, int]]:
        """Number of the object, and how many values of it a chunk holds."""
        if not self.part_bytes:
            return [(channel, indexes[index].n_values) for channel, index in self.entries]
        if self.is_daqmx(indexes):
            rows = next(self.part_bytes // width for rows, width in self.buffers(indexes) if rows)
            return [(channel, min(rows, indexes[index].n_values)) for channel, index in self.entries]
        whole = Layout(self.entries, self.order, self.interleaved).chunk_bytes(indexes)
        return [(channel, indexes[index].n_values * self.part_bytes // whole) for channel, index in self.entries]

    def columns(self, indexes: Sequence[RawIndex]) -> dict[int, tuple[Column, ...]]:
        """Object -> where its numbers lie; none for what is no real number."""
        if self.is_daqmx(indexes):
            return self._daqmx_columns(indexes)
        found: dict[int, tuple[Column, ...]] = {}
        at = 0
        row = sum(TYPES[indexes[index].type_code][1] or 0 for _, index in self.entries)
        for (channel, index), (_, count) in zip(self.entries, self.counts(indexes), strict=True):
            _, size, dtype = TYPES[indexes[index].type_code]
            step = row if self.interleaved else size or 0
            if dtype is not None:
                found[channel] = (Column(at, step, self.order + dtype, None, RAW),)
            if self.interleaved:
                at += size or 0
            else:
                at += count * size if size is not None else indexes[index].n_bytes or 0
        return found

    def _daqmx_columns(self, indexes: Sequence[RawIndex]) -> dict[int, tuple[Column, ...]]:
        starts, at = [], 0
        buffers = self.buffers(indexes)
        for rows, width in buffers:
            starts.append(at)
            at += rows * width
        return {
            channel: tuple(
                Column(
                    starts[scaler.buffer] + scaler.offset,
                    buffers[scaler.buffer][1],
                    self.order + scaler.dtype,
                    scaler.bit,
                    scaler.scale_id if indexes[index].type_code == DAQMX_RAW else RAW,
                )
                for scaler in indexes[index].scalers
            )
            for channel, index in self.entries
        }

"""A channel's record as the estimate reads it: in blocks, and in windows along it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

__all__ = ["ArrayRecord", "SharedRecord", "own_span", "windows_of"]

Array = NDArray[np.float64]

BLOCK_SAMPLES: Final = 2**18


class SharedRecord(Protocol):
    """One channel of one recorder. Its sample n lies at ``start_s + n / sample_rate_hz`` of the recorder's own time."""

    @property
    def sample_rate_hz(self) -> float:
        """As the recorder states it."""
        ...

    @property
    def n_samples(self) -> int:
        """Length."""
        ...

    @property
    def start_s(self) -> float:
        """Instant of the first sample."""
        ...

    def blocks(self, start: int, stop: int, block_size: int) -> Iterator[Array]:
        """Yield samples from `start` up to `stop`, shape (n,), ``n == block_size`` but for the last block."""
        ...


@dataclass(frozen=True)
class ArrayRecord:
    """A record that is in memory.

    Examples
    --------
    >>> ArrayRecord(np.zeros(10), 5.0).sample_rate_hz
    5.0
    """

    samples: Array
    sample_rate_hz: float
    start_s: float = 0.0

    @property
    def n_samples(self) -> int:
        """Length."""
        return int(self.samples.size)

    def blocks(self, start: int, stop: int, block_size: int) -> Iterator[Array]:
        """Yield samples from `start` up to `stop`."""
        for first in range(start, stop, block_size):
            yield self.samples[first : min(stop, first + block_size)]


def own_span(record: SharedRecord) -> tuple[float, float]:
    """Return the instants of a record's first sample and of one past its last."""
    return record.start_s, record.start_s + record.n_samples / record.sample_rate_hz


def windows_of(record: SharedRecord, starts: Sequence[int] | NDArray[np.int64], length: int) -> Iterator[Array]:
    """Yield windows of a record in one pass over it; what is no number is taken as zero.

    Parameters
    ----------
    record : SharedRecord
    starts : sequence of int
        First samples, ascending, within the record.
    length : int
        Samples a window; one that the record's end cuts is filled with zeros.
    """
    if not len(starts):
        return
    first, stop = int(starts[0]), min(record.n_samples, int(starts[-1]) + length)
    blocks = record.blocks(first, stop, BLOCK_SAMPLES)
    held: list[Array] = []
    held_from, held_to = first, first
    for start in starts:
        end = min(stop, int(start) + length)
        while held_to < end:
            block = next(blocks)
            held.append(block)
            held_to += block.size
        while held and held_from + held[0].size <= start:
            held_from += held.pop(0).size
        joined = np.concatenate(held) if len(held) > 1 else held[0]
        window = np.zeros(length)
        window[: end - start] = joined[start - held_from : end - held_from]
        if not np.isfinite(window).all():
            window = np.nan_to_num(window, nan=0.0, posinf=0.0, neginf=0.0)
        yield window

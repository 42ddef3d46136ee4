"""A log as it lies on disk: its channels in their own units, and how to read them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tdacoustic.recording.raster import Raster

__all__ = ["Log", "LogChannel", "Reader"]


class Reader(Protocol):
    """Reads blocks of a log's channels. Picklable; opens the file for each call and closes it after."""

    def blocks(self, columns: Sequence[int], start: int, stop: int, block_size: int) -> Iterator[NDArray[np.float64]]:
        """Yield float64 arrays of shape (len(columns), n), time last.

        Every array has ``n == block_size`` but the last one. Values are in the
        channel's own unit (`LogChannel.unit`); where that is None, they are the
        stored numbers, and `LogChannel.full_scale` says which number is full scale.

        Parameters
        ----------
        columns : sequence of int
            Indices into `Log.channels`; all on one raster.
        start, stop : int
            First sample and one past the last.
        block_size : int
            Samples a block.

        Raises
        ------
        FormatError
            The file ends before `stop`, or a value cannot be read.
        """
        ...


@dataclass(frozen=True)
class LogChannel:
    """One channel of a log, in the log's own words.

    Parameters
    ----------
    name : str
        As the log has it; ``ch1``, ``ch2``, ... where it has none.
    raster : Raster
    unit : str or None
        The log's spelling, None where it does not say.
    quantity : str or None
        One of `tdacoustic.units.QUANTITIES` where the log says it, else None.
    full_scale : float or None
        The number that means full scale, where the stored numbers are fractions
        of a full scale that the log does not state (1.0 for PCM audio, 32768 for
        16-bit integers without scaling). None where the numbers are in `unit`.
    limits : (float, float) or None
        Smallest and largest value that the stored type can hold, in the values
        that the reader yields; reaching them is clipping. None for floats.
    flags : tuple of str
        What is odd about it, one sentence each.
    """

    name: str
    raster: Raster
    unit: str | None = None
    quantity: str | None = None
    full_scale: float | None = None
    limits: tuple[float, float] | None = None
    flags: tuple[str, ...] = ()


@dataclass(frozen=True)
class Log:
    """What a scan of a log's headers found.

    Parameters
    ----------
    path : Path
    format : str
        Name of the format, a key of `tdacoustic.formats.FORMATS`.
    channels : tuple of LogChannel
    reader : Reader
    start_time : str or None
        ISO 8601 instant of the first sample where the log states one.
    flags : tuple of str
        What is odd about the file, one sentence each.
    metadata : tuple of (str, str)
        Further header fields worth showing.
    companions : tuple of Path
        Further files that the log consists of, in the log's own folder: its samples change where theirs do.
    """

    path: Path
    format: str
    channels: tuple[LogChannel, ...]
    reader: Reader
    start_time: str | None = None
    flags: tuple[str, ...] = ()
    metadata: tuple[tuple[str, str], ...] = ()
    companions: tuple[Path, ...] = ()

"""What is in a log, in its own units.

The samples of a small log are read whole. A large one is read in short stretches spread evenly over it, so that the
answer comes at once whatever its length; the statistics are then of these, and a flag on each channel says so.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from tdacoustic.recording import Log, LogChannel

__all__ = ["ChannelInfo", "LogInfo", "describe_log", "info_text"]

BLOCK_BYTES: Final = 8 * 2**20

WHOLE_VALUES: Final = 10_000_000
"""Samples of all channels together up to which a log is read whole: a second or two of the slowest format, text."""
STRETCHES: Final = 32
STRETCH_SAMPLES: Final = 2**14
"""Of each channel in each stretch, at most; fewer where the channels are so many that they exceed `WHOLE_VALUES`."""
LEAST_SAMPLES: Final = 16


MOST_METADATA = 20
"""Header fields of a log that the text shows."""


@dataclass(frozen=True)
class ChannelInfo:
    """One channel of a log; statistics over its finite samples, None where it has none.

    `rms` is the root of the mean square, the mean included. `n_read` is how many of the samples the statistics are of,
    the same as `n_samples` where the log was read whole.
    """

    name: str
    unit: str | None
    quantity: str | None
    sample_rate_hz: float | None
    n_samples: int
    start: str | None
    mean: float | None
    rms: float | None
    min: float | None
    max: float | None
    flags: tuple[str, ...]
    n_read: int


@dataclass(frozen=True)
class LogInfo:
    """A log and its channels, as ``tdacoustic info --json`` prints it."""

    file: str
    format: str
    channels: tuple[ChannelInfo, ...]
    flags: tuple[str, ...]
    metadata: dict[str, str] = field(default_factory=dict)
    companions: tuple[str, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """Return plain lists, dicts and numbers."""
        return asdict(self)


@dataclass(frozen=True)
class _Stretches:
    """Which samples of a raster are read: `count` stretches of `length`, evenly spread from its first to its last."""

    n_samples: int
    count: int
    length: int

    @property
    def n_read(self) -> int:
        return self.count * self.length

    def spans(self) -> Iterator[tuple[int, int]]:
        room = self.n_samples - self.length
        for number in range(self.count):
            first = room * number // max(1, self.count - 1)
            yield first, first + self.length


def _stretches(n_samples: int, whole: bool, length: int) -> _Stretches:
    if whole or n_samples <= STRETCHES * length:
        return _Stretches(n_samples, 1, n_samples)
    return _Stretches(n_samples, STRETCHES, length)


def describe_log(
    path: str | Path, progress: Callable[[float], None] | None = None, *, every_sample: bool = False
) -> LogInfo:
    """Say what is in a log, with statistics of all its samples or of some.

    Parameters
    ----------
    path : str or Path
    progress : callable, optional
        Called with the part done.
    every_sample : bool
        Read all samples of a large log too. Without it, a log of more than `WHOLE_VALUES` samples, all channels
        together, is read in `STRETCHES` short stretches.

    Raises
    ------
    TdacousticError
        It cannot be read.
    """
    from tdacoustic.formats import scan

    log = scan(path)
    rasters: dict[Any, list[int]] = {}
    for index, channel in enumerate(log.channels):
        rasters.setdefault(channel.raster, []).append(index)
    values = sum(channel.raster.n_samples for channel in log.channels)
    whole = every_sample or values <= WHOLE_VALUES
    length = max(LEAST_SAMPLES, min(STRETCH_SAMPLES, WHOLE_VALUES // (STRETCHES * max(1, len(log.channels)))))
    parts = {raster: _stretches(raster.n_samples, whole, length) for raster in rasters}
    total = sum(len(columns) * parts[raster].n_read for raster, columns in rasters.items())
    found: dict[int, ChannelInfo] = {}
    done = 0
    for raster, columns in rasters.items():
        for size in _describe(log, columns, parts[raster], found):
            done += size
            if progress is not None:
                progress(done / max(1, total))
    return LogInfo(
        str(path),
        log.format,
        tuple(found[index] for index in range(len(log.channels))),
        log.flags,
        dict(log.metadata),
        tuple(companion.name for companion in log.companions),
    )


def _describe(log: Log, columns: Sequence[int], part: _Stretches, found: dict[int, ChannelInfo]) -> Iterator[int]:
    """Read the channels of one raster, filling `found`; yields how many values were read."""
    import numpy as np

    count, total, square = (np.zeros(len(columns)) for _ in range(3))
    low, high = np.full(len(columns), math.inf), np.full(len(columns), -math.inf)
    size = max(1024, BLOCK_BYTES // (8 * len(columns)))
    for block in (block for span in part.spans() for block in log.reader.blocks(columns, *span, size)):
        finite = np.isfinite(block)
        held = np.where(finite, block, 0.0)
        count += finite.sum(axis=1)
        total += held.sum(axis=1)
        square += np.einsum("ij,ij->i", held, held)
        low = np.minimum(low, np.where(finite, block, math.inf).min(axis=1))
        high = np.maximum(high, np.where(finite, block, -math.inf).max(axis=1))
        yield block.size
    for place, column in enumerate(columns):
        found[column] = _channel_info(
            log, log.channels[column], part, float(count[place]), float(total[place]), float(square[place]),
            float(low[place]), float(high[place]),
        )  # fmt: skip


def _channel_info(
    log: Log, channel: LogChannel, part: _Stretches, count: float, total: float, square: float, low: float, high: float
) -> ChannelInfo:
    flags = list(channel.flags)
    if part.n_read < part.n_samples:
        flags.append(
            f"mean, rms, min and max are of {part.n_read} of {part.n_samples} samples, in {part.count} stretches "
            "spread evenly; --all reads every sample"
        )
    if count < part.n_read:
        flags.append(f"{int(part.n_read - count)} of {part.n_read} samples are no numbers (NaN or infinite)")
    if channel.full_scale is not None:
        numbers = "fractions" if channel.full_scale == 1.0 else f"integers, {channel.full_scale:g} parts"
        flags.append(f"{numbers} of a full scale that the log does not state")
    raw = channel.raster.sample_rate_raw_hz
    if raw is not None:
        flags.append(f"the log gives a rate of {raw:.9g} Hz, taken as {channel.raster.sample_rate_hz:.9g} Hz")
    return ChannelInfo(
        name=channel.name,
        unit=channel.unit,
        quantity=channel.quantity,
        sample_rate_hz=channel.raster.sample_rate_hz,
        n_samples=part.n_samples,
        start=_start(log.start_time, channel.raster.start_s),
        mean=total / count if count else None,
        rms=math.sqrt(square / count) if count else None,
        min=low if count else None,
        max=high if count else None,
        flags=tuple(flags),
        n_read=part.n_read,
    )


def _start(log_start: str | None, start_s: float) -> str | None:
    """Return the instant of the first sample, ISO 8601, where the log states its start."""
    if log_start is None or start_s == 0.0:
        return log_start
    try:
        return (datetime.fromisoformat(log_start) + timedelta(seconds=start_s)).isoformat()
    except (ValueError, OverflowError):
        return log_start


def info_text(log: LogInfo) -> str:
    """Return a log's contents as a table for a terminal."""

    def shown(value: float | None) -> str:
        return "" if value is None else f"{value:.6g}"

    header = ("channel", "unit", "quantity", "rate / Hz", "samples", "mean", "rms", "min", "max")
    rows = [
        (
            channel.name,
            channel.unit or "?",
            channel.quantity or "?",
            shown(channel.sample_rate_hz) or "?",
            str(channel.n_samples),
            *(shown(value) for value in (channel.mean, channel.rms, channel.min, channel.max)),
        )
        for channel in log.channels
    ]
    widths = [max(len(row[i]) for row in (header, *rows)) for i in range(len(header))]
    lines = [f"{log.file}: {log.format}"]
    start = next((channel.start for channel in log.channels if channel.start), None)
    if start:
        lines[0] += f", from {start}"
    for row in (header, *rows):
        cells = [cell.ljust(w) if i < 3 else cell.rjust(w) for i, (cell, w) in enumerate(zip(row, widths, strict=True))]
        lines.append("  " + "  ".join(cells).rstrip())
    lines += [f"  {key}: {value}" for key, value in list(log.metadata.items())[:MOST_METADATA]]
    if len(log.metadata) > MOST_METADATA:
        lines.append(f"  and {len(log.metadata) - MOST_METADATA} further header fields (--json shows them)")
    if log.companions:
        lines.append(f"  with {', '.join(log.companions)}")
    lines += [f"  note: {flag}" for flag in log.flags]
    of_channel: dict[str, list[str]] = {}
    for channel in log.channels:
        for flag in channel.flags:
            of_channel.setdefault(flag, []).append(channel.name)
    for flag, names in of_channel.items():
        every = len(names) == len(log.channels) > 1
        lines += [f"  note: all channels: {flag}"] if every else [f"  note: {name}: {flag}" for name in names]
    return "\n".join(lines)

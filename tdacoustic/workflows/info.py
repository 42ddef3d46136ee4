"""What is in a log, in its own units."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tdacoustic.recording import Log, LogChannel

__all__ = ["ChannelInfo", "LogInfo", "describe_log", "info_text"]

BLOCK_BYTES = 8 * 2**20


@dataclass(frozen=True)
class ChannelInfo:
    """One channel of a log; statistics over its finite samples, None where it has none.

    `rms` is the root of the mean square, the mean included.
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


@dataclass(frozen=True)
class LogInfo:
    """A log and its channels, as ``tdacoustic info --json`` prints it."""

    file: str
    format: str
    channels: tuple[ChannelInfo, ...]
    flags: tuple[str, ...]

    def as_json(self) -> dict[str, Any]:
        """Return plain lists, dicts and numbers."""
        return asdict(self)


def describe_log(path: str | Path, progress: Callable[[float], None] | None = None) -> LogInfo:
    """Read a log and say what is in it.

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
    found: dict[int, ChannelInfo] = {}
    total = sum(channel.raster.n_samples for channel in log.channels)
    done = 0
    for columns in rasters.values():
        for size in _describe(log, columns, found):
            done += size
            if progress is not None:
                progress(done / max(1, total))
    return LogInfo(str(path), log.format, tuple(found[index] for index in range(len(log.channels))), log.flags)


def _describe(log: Log, columns: Sequence[int], found: dict[int, ChannelInfo]) -> Any:
    """Read the channels of one raster, filling `found`; yields how many values were read."""
    import numpy as np

    n_samples = log.channels[columns[0]].raster.n_samples
    count, total, square = (np.zeros(len(columns)) for _ in range(3))
    low, high = np.full(len(columns), math.inf), np.full(len(columns), -math.inf)
    for block in log.reader.blocks(columns, 0, n_samples, max(1024, BLOCK_BYTES // (8 * len(columns)))):
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
            log, log.channels[column], n_samples, float(count[place]), float(total[place]), float(square[place]),
            float(low[place]), float(high[place]),
        )  # fmt: skip


def _channel_info(
    log: Log, channel: LogChannel, n_samples: int, count: float, total: float, square: float, low: float, high: float
) -> ChannelInfo:
    flags = list(channel.flags)
    if count < n_samples:
        flags.append(f"{int(n_samples - count)} of {n_samples} samples are no numbers (NaN or infinite)")
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
        n_samples=n_samples,
        start=_start(log.start_time, channel.raster.start_s),
        mean=total / count if count else None,
        rms=math.sqrt(square / count) if count else None,
        min=low if count else None,
        max=high if count else None,
        flags=tuple(flags),
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
    lines += [f"  note: {flag}" for flag in log.flags]
    lines += [f"  note: {channel.name}: {flag}" for channel in log.channels for flag in channel.flags]
    return "\n".join(lines)

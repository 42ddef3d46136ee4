"""A recording: the channels of one run, named, in SI, readable in blocks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.recording.log import Log

__all__ = ["Channel", "Recording", "span_of"]


@dataclass(frozen=True)
class Channel:
    """One channel of a recording: what it measures and where its samples are.

    ``value_si = value_in_log * gain + offset``.

    Parameters
    ----------
    name : str
        Its name in every table.
    quantity : str
        One of `tdacoustic.units.QUANTITIES`.
    si_symbol : str
        Unit of the values that `Recording.blocks` yields.
    log_index, column : int
        Which log of the recording, and which channel in it.
    sample_rate_hz : float
    start_sample, n_samples : int
        The cut of the log that belongs to the recording.
    start_s : float
        Instant of its first sample on the recording's time axis.
    gain, offset : float
        Conversion of the log's values to SI.
    scaling : str
        The conversion in words, for the report.
    limits : (float, float) or None
        Smallest and largest value the logger could store, in SI.
    component, drive, role, direction, shaft : str or None
        As the campaign says.
    position_m : (float, float, float) or None
        In the drive's frame.
    distance_m : float or None
        Of a microphone from the drive's centre.
    pulses_per_rev : float or None
        Of a tacho.
    flags : tuple of str
        What is odd about it.
    """

    name: str
    quantity: str
    si_symbol: str
    log_index: int
    column: int
    sample_rate_hz: float
    start_sample: int
    n_samples: int
    start_s: float = 0.0
    gain: float = 1.0
    offset: float = 0.0
    scaling: str = ""
    limits: tuple[float, float] | None = None
    component: str | None = None
    drive: str = "1"
    role: str | None = None
    direction: str | None = None
    shaft: str | None = None
    position_m: tuple[float, float, float] | None = None
    distance_m: float | None = None
    pulses_per_rev: float | None = None
    flags: tuple[str, ...] = ()

    @property
    def duration_s(self) -> float:
        """Length in seconds."""
        return self.n_samples / self.sample_rate_hz

    @property
    def is_speed(self) -> bool:
        """Whether it tells the speed rather than a signal to be analysed."""
        return self.quantity in ("speed", "tacho")

    @property
    def raster_key(self) -> tuple[int, float, int, int, float]:
        """Channels with the same key can be read together."""
        return (self.log_index, self.sample_rate_hz, self.start_sample, self.n_samples, self.start_s)


def span_of(channels: Sequence[Channel]) -> tuple[float, float] | None:
    """Return the first and the last instant of any channel on the recording's time axis; None of no channel."""
    if not channels:
        return None
    return min(item.start_s for item in channels), max(item.start_s + item.duration_s for item in channels)


@dataclass(frozen=True)
class Recording:
    """The channels of one run and the logs they lie in.

    Examples
    --------
    ``recording["mic_1"]`` is a channel; ``recording.samples("mic_1")`` its values in SI;
    ``recording.blocks(["mic_1", "mic_2"], 65536)`` the same in pieces.
    """

    name: str
    logs: tuple[Log, ...]
    channels: tuple[Channel, ...]

    def __getitem__(self, name: str) -> Channel:
        for channel in self.channels:
            if channel.name == name:
                return channel
        raise AnalysisError(
            f"no channel {name!r} in {self.name}; there are {', '.join(c.name for c in self.channels) or 'none'}"
        )

    def only(self, names: Sequence[str]) -> Recording:
        """Return the recording with these channels alone."""
        return replace(self, channels=tuple(self[name] for name in names))

    def rasters(self) -> tuple[tuple[str, ...], ...]:
        """Names of the channels, grouped by what can be read together."""
        groups: dict[tuple[int, float, int, int, float], list[str]] = {}
        for channel in self.channels:
            groups.setdefault(channel.raster_key, []).append(channel.name)
        return tuple(tuple(names) for names in groups.values())

    def blocks(self, names: Sequence[str], block_size: int) -> Iterator[NDArray[np.float64]]:
        """Yield blocks in SI of channels that share a raster.

        Yields
        ------
        ndarray, float64, shape (len(names), n)
            ``n == block_size`` but for the last block.

        Raises
        ------
        AnalysisError
            The channels lie on different rasters.
        """
        channels = [self[name] for name in names]
        if not channels:
            return
        first = channels[0]
        for channel in channels[1:]:
            if channel.raster_key != first.raster_key:
                raise AnalysisError(
                    f"channels {first.name!r} and {channel.name!r} of {self.name} are on different rasters "
                    "and cannot be read together; they are not resampled silently"
                )
        gain = np.array([[channel.gain] for channel in channels])
        offset = np.array([[channel.offset] for channel in channels])
        scaled = bool(np.any(gain != 1.0) or np.any(offset != 0.0))
        stop = first.start_sample + first.n_samples
        columns = [channel.column for channel in channels]
        reader = self.logs[first.log_index].reader
        for block in reader.blocks(columns, first.start_sample, stop, block_size):
            yield block * gain + offset if scaled else block

    def samples(self, name: str) -> NDArray[np.float64]:
        """Return all values of one channel, in SI, shape (n_samples,)."""
        channel = self[name]
        blocks = [block[0] for block in self.blocks([name], max(1, min(channel.n_samples, 1 << 20)))]
        return np.concatenate(blocks) if blocks else np.zeros(0)

    def times_s(self, name: str) -> NDArray[np.float64]:
        """Return the instants of a channel's samples on the recording's time axis."""
        channel = self[name]
        return channel.start_s + np.arange(channel.n_samples) / channel.sample_rate_hz

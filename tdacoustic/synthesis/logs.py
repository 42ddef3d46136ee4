"""Integer logs in HDF5: quantisation without clipping, and files whose bytes repeat."""

from __future__ import annotations

import datetime
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from tdacoustic.synthesis.recipe import ChannelRecipe

__all__ = ["LOG_SCHEMA", "StoredChannel", "quantise", "write_log"]

LOG_SCHEMA = "tdacoustic-log/1"

_HEADROOM = 1.1
_CHUNK_SAMPLES = 65536


@dataclass(frozen=True)
class StoredChannel:
    """A channel as it goes into a log: ``value in unit = integers * scale``."""

    channel: ChannelRecipe
    integers: NDArray[np.signedinteger]
    scale: float
    bits: int
    sample_rate_hz: float

    @property
    def quantisation_density(self) -> float:
        """One-sided density of the rounding's scatter, scale²/12 over half the rate, in unit² per Hz."""
        return self.scale**2 / 12.0 / (0.5 * self.sample_rate_hz)


def quantise(channel: ChannelRecipe, values: NDArray, bits: int, sample_rate_hz: float) -> StoredChannel:
    """Round a channel to integers of so many bits; the largest value stays 10 % below full scale.

    Parameters
    ----------
    channel : ChannelRecipe
    values : ndarray, shape (n,)
        In the unit of the log.
    bits : int
        Up to 8 are stored in one byte a sample, up to 16 in two, more in four.
    sample_rate_hz : float
        Of these values.
    """
    largest = 2 ** (bits - 1) - 1
    peak = float(np.max(np.abs(values), initial=0.0))
    scale = float(f"{_HEADROOM * peak / largest:.3e}") if peak > 0.0 else 1.0
    kind: type[np.signedinteger] = np.int8 if bits <= 8 else np.int16 if bits <= 16 else np.int32
    return StoredChannel(channel, np.rint(values / scale).astype(kind), scale, bits, sample_rate_hz)


def write_log(
    path: Path, channels: list[StoredChannel], *, title: str, start_time: datetime.datetime | None = None
) -> None:
    """Write one log: a dataset a channel, with the attributes `unit`, `quantity`, `sample_rate_hz`, `start_s`, `scale`.

    The root says `schema`, `origin` (``synthetic``), `title` and, where known, `start_time`. No times of creation are
    kept, so equal content gives equal bytes.
    """
    with h5py.File(path, "w", libver=("earliest", "v110")) as log:
        log.attrs["schema"] = LOG_SCHEMA
        log.attrs["origin"] = "synthetic"
        log.attrs["title"] = title
        if start_time is not None:
            log.attrs["start_time"] = start_time.isoformat()
        for stored in channels:
            dataset = log.create_dataset(
                stored.channel.name,
                data=stored.integers,
                chunks=(min(stored.integers.size, _CHUNK_SAMPLES),),
                shuffle=stored.integers.dtype.itemsize > 1,
                compression="gzip",
                compression_opts=6,
                track_times=False,
            )
            dataset.attrs["unit"] = stored.channel.stored_unit
            dataset.attrs["quantity"] = stored.channel.quantity
            dataset.attrs["sample_rate_hz"] = float(stored.sample_rate_hz)
            dataset.attrs["start_s"] = 0.0
            dataset.attrs["scale"] = stored.scale

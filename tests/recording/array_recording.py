"""Recordings of arrays, for tests that need no file."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tdacoustic.recording import Channel, Log, LogChannel, Raster, Recording


@dataclass
class ArrayReader:
    """Reads blocks of an array of shape (n_channels, n)."""

    data: np.ndarray

    def blocks(self, columns, start, stop, block_size):
        for at in range(start, stop, block_size):
            yield np.asarray(self.data[list(columns), at : min(at + block_size, stop)], dtype=float)


def recording_of(data, rate, quantity="sound_pressure", **options):
    """A recording of one log; `options` go to every channel, those of tuples one each."""
    data = np.atleast_2d(data)
    count, n_samples = data.shape
    symbols = {"sound_pressure": "Pa", "acceleration": "m/s^2", "voltage": "V", "speed": "1/s", "tacho": "V"}
    quantities = [quantity] * count if isinstance(quantity, str) else list(quantity)
    log = Log(
        Path("array"),
        "array",
        tuple(LogChannel(f"c{k}", Raster(rate, n_samples)) for k in range(count)),
        ArrayReader(data),
    )
    channels = tuple(
        Channel(
            name=f"c{k}",
            quantity=quantities[k],
            si_symbol=symbols[quantities[k]],
            log_index=0,
            column=k,
            sample_rate_hz=rate,
            start_sample=0,
            n_samples=n_samples,
            **options,
        )
        for k in range(count)
    )
    return Recording("run", (log,), channels)

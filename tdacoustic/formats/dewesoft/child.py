"""The process in which the maker's library runs: what it finds goes to the parent in frames.

A frame is a letter, its length (u64, little endian) and its bytes: ``J`` what was asked for as JSON, ``S`` samples as
float64, ``E`` why it cannot be had, ``M`` the library is not there, ``Z`` the end. Nothing of it is a pickle: the
library may have been taken over by what it reads.
"""

from __future__ import annotations

import json
import math
import os
import struct
import sys
from datetime import datetime
from typing import Any, BinaryIO, Final

import numpy as np

from tdacoustic.isolation import bound_memory, end_with_the_parent

__all__ = ["serve"]

_SYNCHRONOUS: Final = 0
_KINDS: Final = {1: "are asynchronous: not evenly sampled", 2: "are single values"}
_STORED_AT_FULL_RATE: Final = 0


def serve() -> None:
    """Do what the arguments ask for: the entry of the child process."""
    path, job = sys.argv[1], json.loads(sys.argv[2])
    end_with_the_parent()
    bound_memory(job["most_bytes"])
    with os.fdopen(os.dup(1), "wb") as out:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # whatever the library prints
        try:
            _serve(path, job, out)
        except ModuleNotFoundError as error:
            _send(out, b"M", str(error.name).encode())
        except (NotImplementedError, ImportError) as error:
            _send(out, b"M", f"for this platform: {error}".encode())
        except BrokenPipeError:
            os._exit(1)
        except BaseException as error:
            text = getattr(error, "message", "") or str(error)
            _send(out, b"E", f"{text or type(error).__name__}".encode()[:1000])
        out.flush()
    os._exit(0)  # without the clean-up of a library that may be in disorder


def _send(out: BinaryIO, kind: bytes, content: bytes | memoryview) -> None:
    out.write(kind + struct.pack("<Q", len(content)))
    out.write(content)
    out.flush()


def _serve(path: str, job: dict[str, Any], out: BinaryIO) -> None:
    import dwdatareader

    with dwdatareader.DWFile(path) as file:
        channels = list(file.values())
        if job["task"] == "scan":
            _send(out, b"J", json.dumps(_found(file, channels)).encode())
        else:
            _samples(channels, job, out)
    _send(out, b"Z", b"")


def _found(file: Any, channels: list[Any]) -> dict[str, Any]:
    """Return what the headers say, in numbers and texts."""
    info = file.info
    start = info.start_store_time
    return {
        "rate_hz": float(info.sample_rate),
        "start": start.isoformat() if isinstance(start, datetime) and start.year > 1900 else None,
        "full_rate": int(file.storing_type) == _STORED_AT_FULL_RATE,
        "channels": [_channel(channel) for channel in channels],
    }


def _channel(channel: Any) -> dict[str, Any]:
    """Return one channel: its raster, or why it cannot be read."""
    found: dict[str, Any] = {"name": channel.long_name or channel.name, "unit": channel.unit, "reason": None}
    try:
        if type(channel).__name__ != "DWChannel":
            found["reason"] = "are complex" if "Complex" in type(channel).__name__ else "are bytes of no numeric type"
        elif int(channel.channel_type) != _SYNCHRONOUS:
            found["reason"] = _KINDS.get(int(channel.channel_type), "are of an unknown kind")
        elif channel.array_size != 1:
            found["reason"] = "are arrays"
        elif channel.number_of_samples <= 0:
            found["reason"] = "hold no samples"
        else:
            found |= _raster(channel)
    except RuntimeError as error:  # DWError: an operation that the library refuses on this channel
        found["reason"] = f"cannot be read by the maker's library ({getattr(error, 'message', '') or error})"
    return found


def _raster(channel: Any) -> dict[str, Any]:
    rate, count = float(channel.sample_rate), int(channel.number_of_samples)
    if not (math.isfinite(rate) and rate > 0.0):
        return {"reason": f"have a sampling rate of {rate} Hz"}
    ends = [float(_read(channel, at, 1)[0][0]) for at in (0, count - 1)]
    return {"rate_hz": rate, "n_samples": count, "first_s": ends[0], "last_s": ends[1]}


def _read(channel: Any, first: int, count: int) -> tuple[Any, Any]:
    """Return instants and values; half a sample is added because the library cuts ``T1 * rate`` to a whole number."""
    times, values = channel.scaled(T1=(first + 0.5) / channel.sample_rate, count=count)
    if len(times) != count or len(values) != count:
        raise RuntimeError(f"{count} samples from {first} on were asked for, {len(values)} came")
    return times, values


def _samples(channels: list[Any], job: dict[str, Any], out: BinaryIO) -> None:
    """Send the samples of some channels, block by block; their instants are held against the raster."""
    chosen = [channels[index] for index in job["channels"]]
    for channel, wanted in zip(chosen, job["counts"], strict=True):
        if channel.number_of_samples != wanted:
            raise RuntimeError(f"{channel.name!r} holds {channel.number_of_samples} samples, it held {wanted}")
    for first in range(job["start"], job["stop"], job["step"]):
        count = min(job["step"], job["stop"] - first)
        block = np.empty((len(chosen), count))
        for row, (channel, rate, start) in enumerate(zip(chosen, job["rates"], job["starts"], strict=True)):
            times, block[row] = _read(channel, first, count)
            off = np.abs(np.asarray(times) - (start + np.arange(first, first + count) / rate))
            broken = np.flatnonzero(~(off <= 0.5 / rate))
            if len(broken):
                number = int(broken[0])
                raise RuntimeError(
                    f"{channel.name!r} is not evenly sampled: sample {first + number} is at {times[number]:.9g} s, "
                    f"{start + (first + number) / rate:.9g} s was expected"
                )
        _send(out, b"S", block.data.cast("B"))

"""Dewesoft DXD and D7D, read by the maker's closed library in a process of its own.

The format is not published; the library comes with the package `dwdatareader` (extra ``dewesoft``). A damaged file can
end it (its first bytes and zeros behind them do), so it runs in a child (`child`) that is bounded in memory and
time, and what the child sends is checked as any input is. Synchronous channels are read; asynchronous, array, complex
and binary ones, single values and channels without samples are left out with a flag.

Not verified on any real recording, because none could be had: reading as a whole is tested against a stand-in that
behaves as the package's source says, the real library only with damaged files. Open in particular are whether the start
is UTC (as the package takes it to be) and whether instants count from there, whether the library reads long files in
bounded memory, and what it does with channels of files that were stored on a trigger (these are flagged).
"""

from __future__ import annotations

import json
import math
import struct
import subprocess
import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import IO, Any, Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FormatError, MissingPackageError
from tdacoustic.formats.blocks import check_request, rebuffered, unique_names
from tdacoustic.formats.rates import snap_rate
from tdacoustic.isolation import PYTHON, child_environment
from tdacoustic.recording import Log, LogChannel, Raster
from tdacoustic.units import quantity_of_unit

__all__ = ["DewesoftReader", "Source", "scan_file"]

MOST_S: Final = 60.0
"""For opening a file, and for each step of reading [assumed]."""

MOST_BYTES: Final = 4_000_000_000
"""Of the child's address space, besides the file itself, which the library may map [assumed]."""

STEP_VALUES: Final = 1 << 19
MAX_FRAME: Final = 64 << 20
NAMES_IN_A_FLAG: Final = 5
UNVERIFIED: Final = "read by the maker's library in a way that could not be verified on a real recording"

_CODE: Final = "from tdacoustic.formats.dewesoft.child import serve; serve()"
_HEAD: Final = struct.Struct("<cQ")


@dataclass(frozen=True)
class Source:
    """A channel as the library counts it.

    Parameters
    ----------
    index : int
    n_samples : int
    rate_hz, start_s : float
        Before any rounding of the rate.
    """

    index: int
    n_samples: int
    rate_hz: float
    start_s: float


@dataclass(frozen=True)
class DewesoftReader:
    """Reads blocks of channels.

    Parameters
    ----------
    path : Path
    sources : tuple of Source
        Of each channel.
    """

    path: Path
    sources: tuple[Source, ...]

    def blocks(self, columns: Sequence[int], start: int, stop: int, block_size: int) -> Iterator[NDArray[np.float64]]:
        """Yield float64 arrays of shape (len(columns), n); see `tdacoustic.recording.log.Reader`.

        Raises
        ------
        FormatError
            The file has changed or is damaged, its instants are not even, or the library failed.
        MissingPackageError
            The library is not there.
        """
        chosen = [self.sources[column] for column in columns]
        check_request(self.path, min((source.n_samples for source in chosen), default=0), start, stop, block_size)
        yield from rebuffered(self._frames(chosen, start, stop), block_size)

    def _frames(self, chosen: Sequence[Source], start: int, stop: int) -> Iterator[NDArray[np.float64]]:
        if start == stop:
            return
        step = max(1, STEP_VALUES // len(chosen))
        job = {
            "task": "read",
            "channels": [source.index for source in chosen],
            "counts": [source.n_samples for source in chosen],
            "rates": [source.rate_hz for source in chosen],
            "starts": [source.start_s for source in chosen],
            "start": start,
            "stop": stop,
            "step": step,
        }
        with _child(self.path, job) as frames:
            for first in range(start, stop, step):
                count = min(step, stop - first)
                content = _expected(self.path, frames, b"S", 8 * len(chosen) * count)
                yield np.frombuffer(content, np.float64).reshape(len(chosen), count)


class _Frames:
    """The frames of a child that is ended when one takes too long."""

    def __init__(self, child: subprocess.Popen[bytes], stream: IO[bytes]) -> None:
        self._child, self._stream = child, stream
        self.is_late = False

    def next(self) -> tuple[bytes, bytes] | None:
        """Return the letter and the content of a frame, None where the child ended before."""
        watch = threading.Timer(MOST_S, self._end)
        watch.daemon = True
        watch.start()
        try:
            head = self._stream.read(_HEAD.size)
            if len(head) < _HEAD.size:
                return None
            kind, length = _HEAD.unpack(head)
            if length > MAX_FRAME:
                return None
            content = self._stream.read(length)
            return (kind, content) if len(content) == length else None
        finally:
            watch.cancel()

    def _end(self) -> None:
        self.is_late = True
        self._child.kill()

    def exit_status(self) -> int:
        """End the child and return its status."""
        try:
            return self._child.wait(5.0)
        except subprocess.TimeoutExpired:
            self._child.kill()
            return self._child.wait()


@contextmanager
def _child(path: Path, job: dict[str, Any]) -> Iterator[_Frames]:
    """Start the process in which the library runs; its temporary files are removed with it."""
    if find_spec("dwdatareader") is None:
        raise ModuleNotFoundError("No module named 'dwdatareader'", name="dwdatareader")
    try:
        size = path.stat().st_size
    except OSError as error:
        raise FormatError(f"{path}: cannot be read ({error.strerror})") from error
    job = job | {"most_bytes": MOST_BYTES + size}
    with tempfile.TemporaryDirectory(prefix="tdacoustic-") as folder:
        threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
        with subprocess.Popen(
            [*PYTHON, "-c", _CODE, str(path.resolve()), json.dumps(job)],
            stdin=subprocess.PIPE,  # its end tells the child that its parent is gone
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            cwd=folder,
            env=child_environment(threads | dict.fromkeys(("TMPDIR", "TMP", "TEMP"), folder)),
        ) as child:
            assert child.stdout is not None
            try:
                yield _Frames(child, child.stdout)
            finally:
                child.kill()


def _expected(path: Path, frames: _Frames, wanted: bytes, length: int | None = None) -> bytes:
    """Return the content of the next frame.

    Raises
    ------
    FormatError
        It is another one, or none came.
    MissingPackageError
        The library is not there.
    """
    frame = frames.next()
    if frame is None:
        if frames.is_late:
            raise FormatError(f"{path}: the maker's library took more than {MOST_S:.0f} s and was ended")
        raise FormatError(
            f"{path}: the maker's library crashed (exit status {frames.exit_status()}): the file is damaged or "
            "truncated, or there is too little memory"
        )
    kind, content = frame
    text = content[:1000].decode("utf-8", errors="replace") if kind in b"EM" else ""
    if kind == b"M":
        raise MissingPackageError(
            f"{path}: reading Dewesoft needs the package dwdatareader with its library, which is not there ({text}): "
            "pip install 'tdacoustic[dewesoft]' on Linux or Windows of 64 bits, or export the log as MATLAB or UFF 58b"
        )
    if kind == b"E":
        raise FormatError(f"{path}: the maker's library refuses it: {' '.join(text.split())}")
    if kind != wanted or (length is not None and len(content) != length):
        raise FormatError(f"{path}: the maker's library sent {len(content)} bytes that were not asked for")
    return content


def scan_file(path: Path) -> Log:
    """Read the headers of a Dewesoft file.

    Returns
    -------
    Log

    Raises
    ------
    FormatError
        Damaged, or without a channel that can be read; or the library failed.
    MissingPackageError
        The library is not there.
    """
    with _child(path, {"task": "scan"}) as frames:
        content = _expected(path, frames, b"J")
    try:
        found = json.loads(content)
        return _log(path, found, found["channels"])
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        if isinstance(error, FormatError):
            raise
        raise FormatError(f"{path}: the maker's library sent what makes no sense ({error})") from error


def _log(path: Path, found: dict[str, Any], entries: list[dict[str, Any]]) -> Log:
    flags: list[str] = []
    left_out: dict[str, list[str]] = {}
    made: list[LogChannel] = []
    sources: list[Source] = []
    for index, entry in enumerate(entries):
        reason = entry["reason"] or _uneven(entry)
        if reason is not None:
            left_out.setdefault(reason, []).append(str(entry["name"]))
            continue
        source = Source(index, int(entry["n_samples"]), float(entry["rate_hz"]), float(entry["first_s"]))
        rate, raw = snap_rate(source.rate_hz)
        unit = str(entry["unit"]).strip() or None
        raster = Raster(rate, source.n_samples, source.start_s, raw)
        made.append(LogChannel(str(entry["name"]), raster, unit=unit, quantity=quantity_of_unit(unit)))
        sources.append(source)
    for reason, names in left_out.items():
        shown = ", ".join(repr(name) for name in names[:NAMES_IN_A_FLAG]) + (", ..." * (len(names) > NAMES_IN_A_FLAG))
        flags.append(f"{len(names)} left out, they {reason}: {shown}")
    if not made:
        raise FormatError(f"{path}: no channel in it that can be read: {'; '.join(flags) or 'it has none'}")
    if not found["full_rate"]:
        flags.append("it was not stored at full rate throughout (on a trigger, or reduced): look at its gaps")
    names, notes = unique_names([channel.name for channel in made])
    channels = tuple(
        LogChannel(name, channel.raster, channel.unit, channel.quantity, flags=() if note is None else (note,))
        for channel, name, note in zip(made, names, notes, strict=True)
    )
    start = found["start"]
    return Log(
        path,
        "dewesoft",
        channels,
        DewesoftReader(path, tuple(sources)),
        start_time=start if isinstance(start, str) else None,
        flags=(UNVERIFIED, *flags),
    )


def _uneven(entry: dict[str, Any]) -> str | None:
    """Why a raster that the library states is none: its ends against its rate."""
    rate, count = float(entry["rate_hz"]), int(entry["n_samples"])
    first, last = float(entry["first_s"]), float(entry["last_s"])
    if not (math.isfinite(rate) and rate > 0.0):
        return f"have a sampling rate of {rate} Hz"
    if not (math.isfinite(first) and math.isfinite(last)):
        return "have instants that are no numbers"
    if abs(last - first - (count - 1) / rate) > 0.5 / rate:
        return (
            f"are not evenly sampled: {count} samples at {rate:.9g} Hz from {first:.9g} s to {last:.9g} s; "
            "they are not resampled silently"
        )
    return None

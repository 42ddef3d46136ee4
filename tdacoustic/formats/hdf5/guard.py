"""A first look at an HDF5 file, in a process that may be lost.

On some damaged files the HDF5 library runs for ever or ends the process, with nothing that Python could catch (three
and one of 18,000 files of one wrong bit each, libhdf5 2.0). So before this process walks through such a file, a child
does the very same scan (`child`), bounded in time and memory. If it comes to its end, this process scans as well; if
not, the file is refused. One child serves all files of a process. What was found good is handed on to processes that
this one starts.

Samples are read without a guard.
"""

from __future__ import annotations

import atexit
import hashlib
import json
import os
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import IO, Final

from tdacoustic.errors import FormatError
from tdacoustic.isolation import PYTHON, child_environment

__all__ = ["MOST_S", "examine"]

MOST_S = 20.0
"""For the scan of a small file [assumed]."""

MOST_S_PER_MB: Final = 10.0
"""More for each MB of the file, up to `MOST_MORE_S` [assumed]; 9000 channels of ten samples each took 2.3 s a MB."""

MOST_MORE_S: Final = 100.0
MOST_BYTES: Final = 4_000_000_000
"""Of the child's address space [assumed]."""

FOUND_GOOD: Final = "TDACOUSTIC_HDF5_FOUND_GOOD"
"""Environment variable: what this process and those above it have found good, as far back as `MOST_FOUND`."""

MOST_FOUND: Final = 1000
MAX_ANSWER: Final = 1 << 16
_RACY_S: Final = 2.0
"""A file changed this shortly before it was looked at could change again within one tick of its time stamp."""

_CODE: Final = "from tdacoustic.formats.hdf5.child import serve; serve()"


class _Lost(Exception):
    """The child did not answer."""


class _Child:
    """The child, started where it is needed."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._unavailable = bool(getattr(sys, "frozen", False)) or not sys.executable

    def ask(self, job: dict[str, str | float]) -> dict[str, object] | None:
        """Return the child's answer, or None where there can be no child.

        Raises
        ------
        _Lost
        """
        if self._process is not None and self._process.poll() is not None:  # ended since it answered last
            self.end()
        if self._process is None and not self._unavailable:
            self._start()
        if self._process is None or self._process.stdin is None or self._process.stdout is None:
            return None
        try:
            with suppress(OSError):  # it is gone, as the reading of its answer shows
                self._process.stdin.write(json.dumps(job).encode("ascii") + b"\n")
            import h5py  # noqa: F401 - the time while the child starts

            if not self._is_ready(self._process.stdout):
                return None
            answer = _line(self._process.stdout)
        except BaseException:  # Ctrl-C too: what it would still answer is nobody's
            self.end()
            raise
        if answer is None or not (answer.get("done") is True or isinstance(answer.get("refused"), str)):
            self.end()
            raise _Lost
        return answer

    def _start(self) -> None:
        self._ready = False
        try:
            self._process = subprocess.Popen(
                [*PYTHON, "-c", _CODE, str(MOST_BYTES)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                bufsize=0,
                env=child_environment({"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}),
            )
        except OSError:
            self._unavailable = True

    def _is_ready(self, stream: IO[bytes]) -> bool:
        """Whether the child has started; one that cannot is not tried again."""
        if not self._ready:
            self._ready = _line(stream) == {"ready": True}
        if not self._ready:
            self._unavailable = True
            self.end()
        return self._ready

    def end(self, wait_s: float = 0.0) -> None:
        """End the child, after some time in which it may end by itself."""
        process, self._process = self._process, None
        if process is None:
            return
        if process.stdin is not None:
            with suppress(OSError):
                process.stdin.close()
        with suppress(subprocess.TimeoutExpired):
            process.wait(wait_s)
        process.kill()
        process.wait()
        if process.stdout is not None:
            process.stdout.close()

    def forget(self) -> None:
        """Leave the child to the process that this one was forked from."""
        self.lock = threading.Lock()
        process, self._process = self._process, None
        if process is not None:
            process.returncode = 0  # nothing to wait for
            for stream in (process.stdin, process.stdout):
                if stream is not None:
                    stream.close()


def _line(stream: IO[bytes]) -> dict[str, object] | None:
    """Return what a line says; None at the end of the stream, or where it says nothing sensible."""
    line = stream.readline(MAX_ANSWER)
    try:
        said = json.loads(line)
    except ValueError:
        return None
    return said if isinstance(said, dict) else None


_CHILD: Final = _Child()
atexit.register(lambda: _CHILD.end(1.0))
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_CHILD.forget)


def examine(path: Path, kind: str) -> None:
    """Have a file scanned by the child, unless it has been found good before.

    Where no child can be had (no interpreter to start), nothing happens.

    Parameters
    ----------
    path : Path
    kind : str
        Which scan: a key of `tdacoustic.formats.hdf5.child.SCANS`.

    Raises
    ------
    FormatError
        The scan refuses the file, or does not come to its end.
    """
    absolute = str(path.absolute())
    with _CHILD.lock:
        try:
            stat = path.stat()
        except OSError:  # which the scan tells of
            return
        known = _digest(absolute, kind, stat)
        if known in os.environ.get(FOUND_GOOD, "").split():
            return
        most_s = MOST_S + min(MOST_MORE_S, MOST_S_PER_MB * stat.st_size / 1e6)
        began = time.monotonic()
        try:
            answer = _CHILD.ask({"path": absolute, "kind": kind, "most_s": most_s})
        except _Lost:
            if time.monotonic() - began >= most_s:
                what = f"did not come to an end within {most_s:.3g} s while reading its structure"
            else:
                what = "ended the process that read its structure"
            raise FormatError(f"{path}: damaged: the HDF5 library {what}") from None
        if answer is None:
            return
        refused = answer.get("refused")
        if isinstance(refused, str):
            raise FormatError(refused.replace(absolute, str(path)))
        if time.time_ns() - max(stat.st_mtime_ns, stat.st_ctime_ns) > _RACY_S * 1e9:
            _remember(known)


def _digest(absolute: str, kind: str, stat: os.stat_result) -> str:
    identity = (absolute, kind, stat.st_dev, stat.st_ino, stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns)
    return hashlib.blake2b(repr(identity).encode(), digest_size=8).hexdigest()


def _remember(digest: str) -> None:
    found = os.environ.get(FOUND_GOOD, "").split()
    os.environ[FOUND_GOOD] = " ".join([*found[1 - MOST_FOUND :], digest])

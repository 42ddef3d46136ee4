"""The process that scans HDF5 files first, and may be lost over it; see `guard`.

Each line of its input asks for one scan, in JSON; the answer is a line too: ``done``, or ``refused`` with the words of
the `FormatError`.
"""

from __future__ import annotations

import faulthandler
import json
import os
import signal
import sys
from importlib import import_module
from pathlib import Path
from typing import Any, BinaryIO, Final

from tdacoustic.isolation import bound_memory

__all__ = ["SCANS", "serve"]

SCANS: Final = {
    "hdf5": ("tdacoustic.formats.hdf5.reader", "scan_here"),
    "matlab": ("tdacoustic.formats.matlab.reader", "scan_hdf5_here"),
}
"""Which function scans which kind of file."""

_MOST_START_S: Final = 60.0


def serve() -> None:
    """Answer until the input ends, which the parent holds open as long as it lives: the entry of the child."""
    with Path(os.devnull).open("wb") as nowhere, os.fdopen(os.dup(1), "wb") as out:
        os.dup2(nowhere.fileno(), 1)  # whatever the library prints
        # A watchdog outside of Python: the library holds the interpreter while it runs for ever.
        faulthandler.dump_traceback_later(_MOST_START_S, exit=True, file=nowhere)
        # Ctrl-C is the parent's, who ends this process; under Windows the parent can only wait while this one lives.
        signal.signal(signal.SIGINT, signal.SIG_DFL if sys.platform == "win32" else signal.SIG_IGN)
        bound_memory(int(sys.argv[1]))
        import h5py  # noqa: F401 - before the first answer is timed

        _send(out, {"ready": True})
        faulthandler.cancel_dump_traceback_later()
        for line in sys.stdin.buffer:
            job = json.loads(line)
            faulthandler.dump_traceback_later(job["most_s"], exit=True, file=nowhere)
            answer = _scanned(job)
            faulthandler.cancel_dump_traceback_later()
            _send(out, answer)
    os._exit(0)  # without the clean-up of a library that may be in disorder


def _scanned(job: dict[str, Any]) -> dict[str, object]:
    """Scan; an error that is no `FormatError` is a defect, and the parent will come upon it by itself."""
    from tdacoustic.errors import FormatError

    module, function = SCANS[job["kind"]]
    try:
        getattr(import_module(module), function)(Path(job["path"]))
    except FormatError as error:
        return {"refused": str(error)}
    except MemoryError:
        return {"refused": f"{job['path']}: reading its structure takes too much memory"}
    except Exception:
        return {"done": True}
    return {"done": True}


def _send(out: BinaryIO, answer: dict[str, object]) -> None:
    try:
        out.write(json.dumps(answer).encode("ascii") + b"\n")
        out.flush()
    except OSError:  # the parent is gone
        os._exit(1)

"""A process that reads damaged logs, one a line of its input, and says how each ended.

Damage can end the process itself, in the C libraries behind HDF5 (in reading samples; scans are guarded) and audio, or
keep it busy for ever: neither must take the test along. Its memory is bounded.
"""

import faulthandler
import json
import os
import re
import resource
import select
import subprocess
import sys
import tempfile
import time
import traceback
from pathlib import Path

MOST_BYTES = 2 << 30
MOST_VALUES = 200_000
GUARD_S = 2.0
"""What the scan of an HDF5 file may take before its guard refuses it; less than a `Reader` waits."""

STEERING = re.compile("[\x00-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069]")
"""Signs that break a line, turn its direction or steer a terminal."""

ROOT = Path(__file__).resolve().parents[2]


def read_log(path: str) -> str:
    """Scan a log and read the beginning of its channels; returns what came of it in a word."""
    import numpy as np

    from tdacoustic.errors import TdacousticError
    from tdacoustic.formats import scan

    try:
        log = scan(path)
    except TdacousticError as error:
        return _checked(error, path)
    assert 0 < len(log.channels) <= 10_000
    texts = [log.start_time or "", *log.flags, *(text for pair in log.metadata for text in pair)]
    for channel in log.channels:
        texts += [channel.name, channel.unit or "", *channel.flags]
        rate = channel.raster.sample_rate_hz
        assert channel.name and (rate is None or (rate > 0.0 and np.isfinite(rate))) and channel.raster.n_samples >= 0
        assert np.isfinite(channel.raster.start_s), "a start that is no number"
    assert all(len(text) <= 1000 and "\x1b" not in text and "\u202e" not in text for text in texts)
    values = 0
    for column, channel in enumerate(log.channels[:8]):
        stop = min(channel.raster.n_samples, MOST_VALUES)
        count = 0
        try:
            for block in log.reader.blocks([column], 0, stop, 1000):
                assert block.dtype == np.float64 and block.shape[0] == 1 and block.shape[1] <= 1000
                count += block.shape[1]
            assert count == stop, f"{count} samples came of {stop}"
        except TdacousticError as error:
            return _checked(error, path)
        values += count
    return "read"


def _checked(error: Exception, path: str) -> str:
    """Hold the message to one clear line, and its reason to one that the reader has thought of."""
    message = str(error)
    assert Path(path).name in message and len(message) <= 1200, message[:300]
    assert not STEERING.search(message), f"the message steers a terminal: {message[:300]!r}"
    cause = error.__cause__
    if cause is not None and f"({type(cause).__name__}: {cause}"[:50] in message:  # the last resort of `scan`
        place = traceback.extract_tb(cause.__traceback__)[-1]
        raise AssertionError(f"{type(cause).__name__} from a reader at {Path(place.filename).name}:{place.lineno}")
    return "refused"


def serve() -> None:
    """Answer each line of the input, a path, with one line of JSON."""
    resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, MOST_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    faulthandler.enable()
    import h5py  # noqa: F401 - what is read with, before the first answer is timed
    import numpy  # noqa: F401
    import pandas  # noqa: F401
    import soundfile  # noqa: F401

    from tdacoustic.formats.hdf5 import guard

    guard.MOST_S = GUARD_S
    print(json.dumps({"ready": True}), flush=True)
    for line in sys.stdin:
        before, began = _peak_kb(), time.process_time()
        try:
            outcome = read_log(line.rstrip("\n"))
        except MemoryError:
            outcome = "crash: MemoryError"
        except BaseException as error:  # what must not leave a reader
            last = traceback.extract_tb(error.__traceback__)[-1]
            outcome = f"crash: {type(error).__name__}: {str(error)[:200]} at {Path(last.filename).name}:{last.lineno}"
        seconds = time.process_time() - began
        print(json.dumps({"outcome": outcome, "seconds": seconds, "kb": _peak_kb() - before}), flush=True)


def _peak_kb() -> int:
    with Path("/proc/self/status").open() as status:
        return next(int(line.split()[1]) for line in status if line.startswith("VmHWM"))


class Reader:
    """The worker as a function of a path, with a bound on its time; started anew where it was ended."""

    def __init__(self, most_s: float = 10.0) -> None:
        self.most_s = most_s
        self._process: subprocess.Popen | None = None
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - as long as the worker

    def _start(self) -> subprocess.Popen:
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        process = subprocess.Popen(
            [sys.executable, __file__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors,
            env=environment, text=True, bufsize=1,
        )  # fmt: skip
        assert self._line(process, 60.0) == {"ready": True}
        return process

    def _line(self, process: subprocess.Popen, most_s: float) -> dict | None:
        assert process.stdout is not None
        if not select.select([process.stdout], [], [], most_s)[0]:
            return None
        line = process.stdout.readline()
        return json.loads(line) if line else {"outcome": "ended"}

    def __call__(self, path: Path) -> dict:
        """Outcome ``read``, ``refused``, ``crash: ...``, ``killed: ...`` (a signal) or ``hung``; seconds, kilobytes."""
        if self._process is None:
            self._process = self._start()
        assert self._process.stdin is not None
        self._process.stdin.write(f"{path}\n")
        answer = self._line(self._process, self.most_s)
        if answer is None:
            where = self._stack()
            self.close()
            return {"outcome": f"hung: {where}", "seconds": self.most_s, "kb": 0}
        if answer["outcome"] == "ended":
            code = self._process.wait()
            where = self._stack()
            self.close()
            return {"outcome": f"killed: signal {-code} {where}", "seconds": 0.0, "kb": 0}
        return answer

    def _stack(self) -> str:
        """Where Python was when a signal ended it, or ends it now."""
        import signal

        if self._process is not None and self._process.poll() is None:
            self._process.send_signal(signal.SIGABRT)
            self._process.wait()
        self._errors.seek(0)
        text = self._errors.read().decode(errors="replace")
        self._errors.truncate(0)
        frames = [line.strip() for line in text.splitlines() if line.strip().startswith("File")]
        return " < ".join(frame.split("/")[-1].replace('"', "") for frame in frames[:3])

    def close(self) -> None:
        """End the worker."""
        if self._process is not None:
            if self._process.poll() is None:
                self._process.kill()
            self._process.wait()
            for stream in (self._process.stdin, self._process.stdout):
                if stream is not None:
                    stream.close()
            self._process = None


if __name__ == "__main__":
    serve()

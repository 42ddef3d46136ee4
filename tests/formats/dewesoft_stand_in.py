"""A stand-in for the package dwdatareader, written after its source, because no recording of Dewesoft could be had.

`install` makes it importable as ``dwdatareader`` here and in the processes that the reader starts. Its "recordings" are
the format's first bytes and then JSON: what `DWFile` shall find.
"""

import json
from pathlib import Path

MAGIC = b"MULTI_STREAM_FILE_VER0210"

SOURCE = """
import json, os, sys, time
from datetime import datetime, timedelta, timezone
import numpy as np

class DWError(RuntimeError):
    def __init__(self, message):
        super().__init__(6)
        self.message = message

class DWInfo:
    pass

class DWChannel:
    def __init__(self, **given):
        self.__dict__.update(dict(unit="", array_size=1, channel_type=0, start=0.0, fault=None), **given)
        self.long_name = given.get("long_name", given["name"])
        self.sample_rate = given.get("rate", 0.0)
        self.count = given["number_of_samples"]

    @property
    def number_of_samples(self):
        if self.fault == "refused":
            raise DWError("Feature or operation not supported on CAN channel")
        return self.count

    def scaled(self, T1=None, T2=None, count=None):
        n, rate = self.count, self.sample_rate
        first = max(0, min(n, int(T1 * rate))) if T1 is not None else 0
        count = max(0, min(count, n - first))
        at = np.arange(first, first + count)
        if self.fault == "crash" and first > 0 and count > 1:
            os.abort()
        if self.fault == "memory" and count > 1:
            np.ones(10**9)
        if self.fault == "short" and count > 1:
            at = at[:-1]
        print("the library talks")
        sys.stdout.flush()
        os.write(1, b"and so does what is native of it")
        times = self.start + at / rate
        if self.fault == "gap":
            times[(at > n // 2) & (at < n - 1)] += 3.0 / rate
        return times, np.sin(0.01 * at) * self.__dict__.get("gain", 1.0)

class DWComplexChannel(DWChannel):
    pass

class DWBinaryChannel(DWChannel):
    pass

class DWFile(dict):
    def __init__(self, path):
        with open(path, "rb") as stream:
            text = stream.read()[25:]
        try:
            given = json.loads(text)
        except ValueError:
            raise DWError("File is corrupted or has invalid format")
        if given.get("fault") == "crash":
            os.abort()
        if given.get("fault") == "hang":
            time.sleep(3600)
        with open(os.path.join(os.environ["TMPDIR"], "unpacked"), "w") as stream:
            stream.write("left behind")
        self.info = DWInfo()
        self.info.sample_rate = 1000.0
        self.info.start_store_time = datetime(1899, 12, 30, tzinfo=timezone.utc) + timedelta(given.get("start", 0.0))
        self.storing_type = given.get("storing", 0)
        kinds = {"complex": DWComplexChannel, "binary": DWBinaryChannel}
        for number, channel in enumerate(given["channels"]):
            self[number] = kinds.get(channel.pop("kind", ""), DWChannel)(**channel)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.clear()
"""


def install(folder: Path, monkeypatch) -> None:
    package = folder / "stand_in" / "dwdatareader"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text(SOURCE)
    monkeypatch.syspath_prepend(str(package.parent))


def write(path: Path, channels, **given) -> Path:
    path.write_bytes(MAGIC + json.dumps({"channels": channels, **given}).encode())
    return path

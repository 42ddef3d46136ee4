"""Memory does not depend on a log's length: 200 MB are read in far less."""

import struct
import subprocess
import sys

import numpy as np
import pytest
from log_makers import uff_header

BYTES = 200_000_000
ALLOWED_MB = 60

PROGRAM = """
import resource, sys
import h5py, pandas, soundfile, numpy as np
from tdacoustic.formats import scan

def read(path):
    log = scan(path)
    n = log.channels[0].raster.n_samples
    total = 0
    for block in log.reader.blocks(range(len(log.channels)), 0, n, 16384):
        total += block.shape[1]
    assert total == n
    return n

read(sys.argv[1])
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
n = read(sys.argv[2])
print(n, (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024)
"""


def write_wav(path, n_bytes):
    n_bytes = n_bytes // 16 * 16
    fmt = struct.pack("<HHIIHH", 1, 8, 51200, 51200 * 16, 16, 16)
    head = b"RIFF" + struct.pack("<I", n_bytes + 36) + b"WAVEfmt " + struct.pack("<I", 16) + fmt
    with path.open("wb") as stream:
        stream.write(head + b"data" + struct.pack("<I", n_bytes))
        stream.truncate(44 + n_bytes)
    return n_bytes // 16


def write_hdf5(path, n_bytes):
    import h5py

    n = n_bytes // 32
    with h5py.File(path, "w") as file:
        dataset = file.create_dataset("x", (n, 4), "f8", chunks=(4096, 4))
        piece = np.ones((1 << 17, 4))
        for at in range(0, n, 1 << 17):
            dataset[at : at + (1 << 17)] = piece[: n - at]
    return n


def write_csv(path, n_bytes):
    piece = b"".join(b"%.6f,%.6f,%.6f,%.6f\n" % tuple(row) for row in np.random.default_rng(0).normal(size=(5000, 4)))
    with path.open("wb") as stream:
        stream.write(b"a,b,c,d\n")
        for _ in range(n_bytes // len(piece)):
            stream.write(piece)
    return n_bytes // len(piece) * 5000


def write_uff_ascii(path, n_bytes):
    piece = b"".join(
        "".join(f"{v:13.5e}" for v in row).encode() + b"\n" for row in np.random.default_rng(0).normal(size=(5000, 6))
    )
    n = n_bytes // len(piece) * 30_000
    with path.open("wb") as stream:
        stream.write(uff_header(n))
        for _ in range(n // 30_000):
            stream.write(piece)
        stream.write(b"    -1\n")
    return n


def write_uff_binary(path, n_bytes):
    n = n_bytes // 4
    with path.open("wb") as stream:
        stream.write(uff_header(n, binary=4 * n))
        stream.seek(4 * n, 1)
        stream.write(b"    -1\n")
    return n


WRITERS = {
    "wav": write_wav,
    "h5": write_hdf5,
    "csv": write_csv,
    "ascii.uff": write_uff_ascii,
    "binary.uff": write_uff_binary,
}


@pytest.mark.skipif(sys.platform == "win32", reason="the resource module is of POSIX")
@pytest.mark.parametrize("kind", list(WRITERS))
def test_200_mb_are_read_in_little_memory(tmp_path, kind):
    small, large = tmp_path / f"small.{kind}", tmp_path / f"large.{kind}"
    WRITERS[kind](small, 2_000_000)
    n = WRITERS[kind](large, BYTES)
    run = subprocess.run([sys.executable, "-c", PROGRAM, str(small), str(large)], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    count, extra_mb = run.stdout.split()
    large.unlink()
    assert int(count) == n
    assert float(extra_mb) < ALLOWED_MB

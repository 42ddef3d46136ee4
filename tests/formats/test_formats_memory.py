"""Memory does not depend on a log's length: 200 MB are read in far less."""

import struct
import subprocess
import sys
import zlib

import numpy as np
import pytest
from log_makers import uff_header
from makers_atfx import Atfx
from makers_tdms import RAW, plain, segment, wave
from mdf4_parts import TIME, one_group

BYTES = 200_000_000
ALLOWED_MB = 60

PROGRAM = """
import sys
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

def peak_kb():
    try:
        (peak,) = [line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")]
    except OSError:  # no Linux
        import resource
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return int(peak)  # not ru_maxrss: it begins with that of the process that started this one

read(sys.argv[1])
before = peak_kb()
n = read(sys.argv[2])
print(n, (peak_kb() - before) / 1024)
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


def write_mdf4(path, n_bytes):
    n = n_bytes // 32
    channels = [TIME, *((name, 8 * index, {}) for index, name in enumerate("xyz", 1))]
    parts = one_group([], None, channels, raw=b"", n=n, size=32)
    parts.blocks.append(parts.blocks[parts.tags["data"]])  # the records go behind everything else
    parts.tags["data"] = parts.blocks[parts.tags["data group"]][1][2] = len(parts.blocks) - 1
    blob = bytearray(parts.made())
    blob[parts.at("data", 8) : parts.at("data", 16)] = struct.pack("<Q", 24 + 32 * n)
    with path.open("wb") as stream:
        stream.write(blob)
        for at in range(0, n, 1 << 17):
            times = np.arange(at, min(at + (1 << 17), n)) / 51200.0
            stream.write(np.column_stack([times, times, times, times]).tobytes())
    return n


def write_tdms(path, n_bytes):
    """A few long segments of four channels, one channel behind the other in each."""
    n = n_bytes // 128 * 4
    piece = segment([(f"/'g'/'{name}'", plain("f8", n // 4), wave()) for name in "abcd"])
    with path.open("wb") as stream:
        for _ in range(4):
            head = bytearray(piece)
            head[4] |= RAW
            head[12:20] = (len(piece) - 28 + 8 * n).to_bytes(8, "little")
            stream.write(head)
            stream.seek(8 * n - 1, 1)
            stream.write(b"\0")
    return n


def write_small_tdms(path, n_bytes):
    """Very many segments of about 1000 values, each of another length than the one before."""
    total = 0
    with path.open("wb") as stream:
        while stream.tell() < n_bytes:
            n = 1000 - total % 7
            stream.write(segment([("/'g'/'a'", plain("f8", n), wave())], bytes(8 * n)))
            total += n
    return total


def write_atfx(path, n_bytes):
    """Four channels of float32 that share their blocks, in one component file."""
    n = n_bytes // 16
    with path.with_suffix(".bin").open("wb") as stream:
        for at in range(0, n, 1 << 18):
            stream.write(np.ones((min(1 << 18, n - at), 4), "<f4").tobytes())
    atfx = Atfx(files=[("B", path.with_suffix(".bin").name)])
    matrix = atfx.matrix(n)
    atfx.time(matrix, atfx.unit("s", time=True))
    for offset in range(0, 16, 4):
        layout = {"start": 0, "block": 16, "per_block": 1, "offset": offset}
        atfx.column(matrix, f"c{offset}", atfx.unit("V"), atfx.component("values", "B", "ieeefloat4", n, **layout))
    atfx.write(path)
    return n


def write_inline_atfx(path, n_bytes):
    """One channel whose values stand in the XML."""
    piece = " ".join(f"{value:.12e}" for value in np.random.default_rng(0).normal(size=5000)) + "\n"
    n = n_bytes // len(piece)
    atfx = Atfx()
    matrix = atfx.matrix(n * 5000)
    atfx.time(matrix, atfx.unit("s", time=True))
    atfx.column(matrix, "c", atfx.unit("V"), atfx.array("values", "<A_FLOAT64>@</A_FLOAT64>"))
    before, after = atfx.text().split("@")
    with path.open("w", encoding="utf-8") as stream:
        stream.write(before)
        for _ in range(n):
            stream.write(piece)
        stream.write(after)
    return n * 5000


def matlab_head(n, columns, claimed):
    """Header of a MAT-file, and the head of an uncompressed matrix of doubles, all but its values."""
    head = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    inner = struct.pack("<IIII", 6, 8, 6, 0) + struct.pack("<IIii", 5, 8, n, columns)
    inner += struct.pack("<HH4s", 1, 1, b"x") + struct.pack("<II", 9, claimed)
    return head, struct.pack("<II", 14, len(inner) + claimed) + inner


def write_matlab(path, n_bytes):
    n = n_bytes // 32
    with path.open("wb") as stream:
        stream.write(b"".join(matlab_head(n, 4, 32 * n)))
        stream.truncate(stream.tell() + 32 * n)
    return n


def write_matlab_rows(path, n_bytes):
    n = n_bytes // 32
    with path.open("wb") as stream:
        stream.write(b"".join(matlab_head(4, n, 32 * n)))
        stream.truncate(stream.tell() + 32 * n)
    return n


def write_packed_matlab(path, n_bytes):
    n = n_bytes // 32
    head, matrix = matlab_head(n, 4, 32 * n)
    pack = zlib.compressobj(1)
    piece = np.repeat(np.random.default_rng(0).normal(size=256), 64).astype("<f8").tobytes()
    body = pack.compress(matrix)
    for at in range(0, 32 * n, len(piece)):
        body += pack.compress(piece[: 32 * n - at])
    body += pack.flush()
    path.write_bytes(head + struct.pack("<II", 15, len(body)) + body)
    return n


WRITERS = {
    "atfx": write_atfx,
    "inline.atfx": write_inline_atfx,
    "mat": write_matlab,
    "rows.mat": write_matlab_rows,
    "packed.mat": write_packed_matlab,
    "wav": write_wav,
    "h5": write_hdf5,
    "csv": write_csv,
    "ascii.uff": write_uff_ascii,
    "binary.uff": write_uff_binary,
    "tdms": write_tdms,
    "small.tdms": write_small_tdms,
    "mf4": write_mdf4,
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

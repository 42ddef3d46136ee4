"""Reading logs of each format: our scan and blocks beside the format's reference library alone, time and memory.

``python tests/benchmarks/bench_formats.py [megabytes] [repeats] [format ...]`` (one core: ``taskset -c 0``). Each log
holds four channels of noise at 51.2 kHz, once of so many megabytes as float32 and once four times as long, written by
the format's own library where that takes no minutes. Ours is what every step does: `tdacoustic.formats.scan`, then all
channels in blocks of float64. The reference is the library's own way of reading all channels: in pieces where it has
one, else whole; what it gives is turned into float64 too, and nothing else is asked of it (no check, no raster, no
unit). Both read the same file, each in a fresh process that has imported everything and read a small log before, in
turn, several times. Time is that of the processor, so that others at work beside count little; the files were just
written and come out of the page cache, not from the disk.

Memory is how much the peak of the resident memory grows by reading the large log after the small one. Dewesoft's files
are written by its recorder alone and are not among them.
"""

# ruff: noqa: E402 - threads are limited before numpy is imported

from __future__ import annotations

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "formats")]

from figures import note

RATE_HZ, CHANNELS = 51200, 4
BLOCK_BYTES = 8 * 2**20
PIECE = 1 << 18
"""Samples that makers write, and references read, at a time."""
SMALL_SAMPLES = 20_000
LONGER = 4
MiB = 2.0**20

Array = np.ndarray[Any, Any]


def pieces(n_samples: int) -> Iterator[Array]:
    """Yield noise of shape (CHANNELS, n), float32, the same whoever asks."""
    one = (0.1 * np.random.default_rng(1).standard_normal((CHANNELS, PIECE))).astype(np.float32)
    for start in range(0, n_samples, PIECE):
        yield one[:, : n_samples - start]


def names() -> list[str]:
    return [f"ch{index + 1}" for index in range(CHANNELS)]


# ---------------------------------------------------------------- makers


def make_wav(path: Path, n_samples: int, subtype: str = "PCM_16", kind: str = "WAV") -> None:
    import soundfile

    with soundfile.SoundFile(path, "w", RATE_HZ, CHANNELS, subtype=subtype, format=kind) as file:
        for piece in pieces(n_samples):
            file.write(piece.T)


def make_flac(path: Path, n_samples: int) -> None:
    make_wav(path, n_samples, "PCM_24", "FLAC")


def make_hdf5(path: Path, n_samples: int, **storage: Any) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        file.attrs["schema"] = "tdacoustic-log/1"
        for name in names():
            data = file.create_dataset(name, (n_samples,), "f4", **storage)
            data.attrs["sample_rate_hz"], data.attrs["unit"] = float(RATE_HZ), "Pa"
        start = 0
        for piece in pieces(n_samples):
            for name, values in zip(names(), piece, strict=True):
                file[name][start : start + values.size] = values
            start += piece.shape[1]


def make_packed_hdf5(path: Path, n_samples: int) -> None:
    make_hdf5(path, n_samples, chunks=(16384,), compression="gzip", compression_opts=1, shuffle=True)


def make_uff_ascii(path: Path, n_samples: int) -> None:
    """As pyuff writes it, a hundred times as fast."""
    from log_makers import uff_header

    lines = 10_000
    text = b"".join(
        b"".join(b"%13.5e" % value for value in row) + b"\n" for row in next(pieces(6 * lines))[0].reshape(lines, 6)
    )
    n_samples = max(1, round(n_samples / (6 * lines))) * 6 * lines
    with path.open("wb") as stream:
        for name in names():
            stream.write(uff_header(n_samples, entity=name, step=f"{1.0 / RATE_HZ:.5e}"))
            for _ in range(n_samples // (6 * lines)):
                stream.write(text)
            stream.write(b"    -1\n")


def make_uff_binary(path: Path, n_samples: int) -> None:
    from log_makers import uff_header

    with path.open("wb") as stream:
        for index, name in enumerate(names()):
            stream.write(uff_header(n_samples, binary=4 * n_samples, entity=name, step=f"{1.0 / RATE_HZ:.5e}"))
            for piece in pieces(n_samples):
                stream.write(piece[index].astype("<f4").tobytes())
            stream.write(b"    -1\n")


def make_csv(path: Path, n_samples: int) -> None:
    rows = [b"%.6e,%.6e,%.6e,%.6e\n" % tuple(row) for row in next(pieces(20_000)).T.tolist()]
    text = b"".join(rows)
    with path.open("wb") as stream:
        stream.write(b"Sample rate: 51200 Hz\nch1,ch2,ch3,ch4\n")
        for start in range(0, n_samples, len(rows)):
            stream.write(text if n_samples - start >= len(rows) else b"".join(rows[: n_samples - start]))


def make_tdms(path: Path, n_samples: int) -> None:
    from nptdms import ChannelObject, TdmsWriter

    about = {"wf_increment": 1.0 / RATE_HZ, "wf_start_offset": 0.0, "wf_samples": 1, "unit_string": "Pa"}
    with TdmsWriter(str(path)) as writer:
        for piece in pieces(n_samples):
            channels = zip(names(), piece, strict=True)
            writer.write_segment([ChannelObject("log", name, values.copy(), about) for name, values in channels])


def make_mat5(path: Path, n_samples: int) -> None:
    import scipy.io

    scipy.io.savemat(path, {**dict(zip(names(), whole(n_samples), strict=True)), "fs": float(RATE_HZ)})


def make_mat73(path: Path, n_samples: int) -> None:
    """As MATLAB lays it out: HDF5 behind 512 bytes, each variable with the name of its class, a row a column."""
    import h5py

    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Mon Nov 23 12:00:00 2026 HDF5 schema 1.00 ."
    with h5py.File(path, "w", userblock_size=512) as file:
        for name in names():
            data = file.create_dataset(name, (1, n_samples), "f4", chunks=(1, 16384))
            data.attrs["MATLAB_class"] = np.bytes_("single")
        file.create_dataset("fs", data=np.full((1, 1), float(RATE_HZ))).attrs["MATLAB_class"] = np.bytes_("double")
        start = 0
        for piece in pieces(n_samples):
            for name, values in zip(names(), piece, strict=True):
                file[name][0, start : start + values.size] = values
            start += piece.shape[1]
    with path.open("r+b") as stream:
        stream.write(head.ljust(124) + b"\x00\x02IM")


def make_mdf4(path: Path, n_samples: int) -> None:
    from asammdf import MDF, Signal

    times = np.arange(n_samples) / RATE_HZ
    mdf = MDF(version="4.10")
    values = zip(names(), whole(n_samples), strict=True)
    mdf.append([Signal(samples, times, name=name, unit="Pa") for name, samples in values])
    mdf.save(path, overwrite=True)
    mdf.close()


def make_atfx(path: Path, n_samples: int) -> None:
    """As loggers lay it out: the values of all channels by turns in a file beside the XML."""
    from makers_atfx import Atfx

    data = path.with_suffix(".bda")
    with data.open("wb") as stream:
        for piece in pieces(n_samples):
            stream.write(piece.T.astype("<f4").tobytes())
    atfx = Atfx(files=[("data", data.name)])
    matrix = atfx.matrix(n_samples)
    seconds, pascal = atfx.unit("s", time=True), atfx.unit("Pa")
    atfx.time(matrix, seconds, step=1.0 / RATE_HZ)
    for index, name in enumerate(names()):
        layout = {"block": 4 * CHANNELS, "per_block": 1, "offset": 4 * index}
        atfx.column(matrix, name, pascal, atfx.component("values", "data", "ieeefloat4", n_samples, **layout))
    atfx.write(path)


def whole(n_samples: int) -> Array:
    return np.concatenate(list(pieces(n_samples)), axis=1)


# ---------------------------------------------------------------- reference libraries: values read


def by_soundfile(path: Path) -> int:
    import soundfile

    return sum(block.size for block in soundfile.blocks(path, PIECE, dtype="float64"))


def by_h5py(path: Path) -> int:
    import h5py

    read = 0
    with h5py.File(path) as file:
        datasets = [file[name] for name in names()]
        for start in range(0, max(datasets[0].shape), PIECE):
            for data in datasets:
                span = (slice(None), slice(start, start + PIECE)) if data.ndim == 2 else slice(start, start + PIECE)
                read += data[span].astype(np.float64).size
    return read


def by_pyuff(path: Path) -> int:
    import pyuff

    return sum(np.asarray(one["data"], dtype=np.float64).size for one in pyuff.UFF(str(path)).read_sets())


def by_pandas(path: Path) -> int:
    import pandas

    with pandas.read_csv(path, skiprows=1, dtype=np.float64, chunksize=PIECE) as frames:
        return sum(frame.to_numpy().size for frame in frames)


def by_nptdms(path: Path) -> int:
    from nptdms import TdmsFile

    read = 0
    with TdmsFile.open(str(path)) as file:
        for chunk in file.data_chunks():
            for name in names():
                read += chunk["log"][name][:].astype(np.float64).size
    return read


def by_loadmat(path: Path) -> int:
    import scipy.io

    found = scipy.io.loadmat(path, variable_names=names())
    return sum(found[name].astype(np.float64).size for name in names())


def by_numpy(path: Path) -> int:
    return int(np.fromfile(path.with_suffix(".bda"), "<f4").reshape(-1, CHANNELS).T.astype(np.float64).size)


def by_asammdf(path: Path) -> int:
    from asammdf import MDF

    with MDF(path) as mdf:
        return sum(signal.samples.astype(np.float64).size for signal in mdf.select(names()))


@dataclass(frozen=True)
class Contest:
    """A format: how a log of it is made, and how its reference library reads it.

    Parameters
    ----------
    name, suffix : str
    library : str
        Distribution that reads it.
    make : callable
        Writes a log of so many samples a channel.
    reference : callable
        Reads all its channels as float64; returns how many values.
    in_pieces : bool
        Whether the library can read it without holding all of it.
    """

    name: str
    suffix: str
    library: str
    make: Callable[[Path, int], None]
    reference: Callable[[Path], int]
    in_pieces: bool = True


CONTESTS = (
    Contest("WAV, 16 bit", ".wav", "soundfile", make_wav, by_soundfile),
    Contest("FLAC, 24 bit", ".flac", "soundfile", make_flac, by_soundfile),
    Contest("HDF5", ".h5", "h5py", make_hdf5, by_h5py),
    Contest("HDF5, packed", ".h5", "h5py", make_packed_hdf5, by_h5py),
    Contest("UFF 58, text", ".uff", "pyuff", make_uff_ascii, by_pyuff, False),
    Contest("UFF 58b", ".uff", "pyuff", make_uff_binary, by_pyuff, False),
    Contest("CSV", ".csv", "pandas", make_csv, by_pandas),
    Contest("TDMS", ".tdms", "npTDMS", make_tdms, by_nptdms),
    Contest("MATLAB 5", ".mat", "scipy", make_mat5, by_loadmat, False),
    Contest("MATLAB 7.3", ".mat", "h5py", make_mat73, by_h5py),
    Contest("MDF 4", ".mf4", "asammdf", make_mdf4, by_asammdf, False),
    Contest("ATFX", ".atfx", "numpy", make_atfx, by_numpy, False),
)


# ---------------------------------------------------------------- one measurement, in a process of its own


def by_tdacoustic(path: Path) -> int:
    """Scan a log and read all its channels in blocks, raster by raster."""
    from tdacoustic.formats import scan

    log = scan(path)
    rasters: dict[Any, list[int]] = {}
    for index, channel in enumerate(log.channels):
        if channel.raster.n_samples > 1:
            rasters.setdefault(channel.raster, []).append(index)
    read = 0
    for raster, columns in rasters.items():
        size = max(1024, BLOCK_BYTES // (8 * len(columns)))
        read += sum(block.size for block in log.reader.blocks(columns, 0, raster.n_samples, size))
    return read


def peak_mb() -> float:
    status = Path("/proc/self/status")
    if status.exists():  # `ru_maxrss` begins with that of the process that started this one
        (peak,) = [line.split()[1] for line in status.read_text().splitlines() if line.startswith("VmHWM")]
        return int(peak) / 1024.0
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1024.0 if sys.platform != "darwin" else MiB)


def measure(who: str, contest: Contest, small: Path, large: Path) -> None:
    """Print how many values were read, in how many seconds, and by how many MiB the peak grew."""
    read = by_tdacoustic if who == "ours" else contest.reference
    read(small)
    before = peak_mb()
    start = time.process_time()
    count = read(large)
    print(count, time.process_time() - start, peak_mb() - before)


@dataclass(frozen=True)
class Reading:
    """One measurement: values read, seconds, growth of the peak in MiB."""

    count: int
    seconds: float
    growth_mb: float


def measured(who: str, contest: Contest, small: Path, large: Path) -> Reading:
    command = [sys.executable, __file__, "--measure", who, contest.name, str(small), str(large)]
    run = subprocess.run(command, capture_output=True, text=True)
    if run.returncode:
        raise RuntimeError(run.stderr.strip().splitlines()[-1])
    count, seconds, growth = run.stdout.split()[-3:]
    return Reading(int(count), float(seconds), float(growth))


# ---------------------------------------------------------------- the table


def row_of(contest: Contest, folder: Path, n_samples: int, repeats: int) -> Iterable[str]:
    """Measure a format, and return the cells of its row."""
    small, once, longer = (folder / f"{word}{contest.suffix}" for word in ("small", "once", "longer"))
    contest.make(small, SMALL_SAMPLES)
    contest.make(once, n_samples)
    megabytes = sum(part.stat().st_size for part in folder.glob("once*")) / 1e6
    rounds = [[measured(who, contest, small, once) for who in ("ours", "theirs")] for _ in range(repeats)]
    if len({reading.count for pair in rounds for reading in pair}) != 1:
        raise RuntimeError(f"{contest.library} read {rounds[0][1].count} values, we {rounds[0][0].count}")
    for part in folder.glob("once*"):
        part.unlink()
    contest.make(longer, LONGER * n_samples)
    long = [measured(who, contest, small, longer) for who in ("ours", "theirs")]
    ratios = [theirs.seconds / ours.seconds for ours, theirs in rounds]
    for who in (0, 1):
        seconds = statistics.median(pair[who].seconds for pair in rounds)
        yield f"{megabytes / seconds:.0f}"
    yield f"{statistics.median(ratios):.2f}"
    yield f"{min(ratios):.2f} to {max(ratios):.2f}"
    for who in (0, 1):
        growth = statistics.median(pair[who].growth_mb for pair in rounds)
        yield f"{growth:.0f} / {long[who].growth_mb:.0f}"
    yield "in pieces" if contest.in_pieces else "whole"


def main(megabytes: float = 100.0, repeats: int = 5, *only: str) -> None:
    """Measure each format and print its row."""
    n_samples = int(megabytes * 1e6 / (4 * CHANNELS))
    print(
        f"{CHANNELS} channels x {n_samples / RATE_HZ:.0f} s at {RATE_HZ} Hz ({megabytes:g} MB as float32); "
        f"median of {repeats} rounds; MB are those of the file, s of the processor"
    )
    print(
        f"Python {platform.python_version()}, numpy {version('numpy')}; {platform.machine()}, {os.cpu_count()} cores\n"
    )
    print(f"{'':14} {'library':>18} {'MB/s ours':>10} {'library':>8} {'ratio':>6} {'(lowest to highest)':>20}", end="")
    print(f"{f'growth in MiB, 1x / {LONGER}x: ours':>34} {'library':>12}  it reads")
    for contest in CONTESTS:
        if only and not any(word.lower() in contest.name.lower() for word in only):
            continue
        with tempfile.TemporaryDirectory() as folder:
            try:
                library = f"{contest.library} {version(contest.library)}"
                cells = list(row_of(contest, Path(folder), n_samples, repeats))
            except (PackageNotFoundError, ImportError, RuntimeError, OSError) as error:
                print(f"{contest.name:14} not measured: {error}", flush=True)
                continue
        ours, theirs, ratio, spread, own, other, how = cells
        ends = [float(ratio), *(float(end) for end in spread.split(" to "))]
        note(f"reading {contest.name}", float(ours), "MB/s", library, float(theirs), ends)
        print(f"{contest.name:14} {library:>18} {ours:>10} {theirs:>8} {ratio:>6} {spread:>20}", end="")
        print(f"{own:>34} {other:>12}  {how}", flush=True)
    print("\nratio: our speed over the library's; above 1 we are the faster")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--measure"]:
        who, name, *paths = sys.argv[2:]
        measure(who, next(contest for contest in CONTESTS if contest.name == name), *map(Path, paths))
    else:
        sizes = [kind(text) for kind, text in zip((float, int), sys.argv[1:3], strict=False)]
        main(*sizes, *sys.argv[3:])

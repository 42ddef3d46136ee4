"""Time of our survey beside bare transforms, scipy and librosa, as ratios measured in one run.

``python tests/benchmarks/bench_spectra.py [seconds] [repeats]`` (one core: ``taskset -c 0``). The signal is noise
with tones, written as an HDF5 log of four channels at 51.2 kHz, and everything below reads that file or its array.

Budget: spectra and lines take at most 1.5 times (reading once + one bare transform of each frame); with third
octaves and statistics a channel takes at most a hundredth of its duration.
"""

# ruff: noqa: E402 - threads are limited before numpy is imported

from __future__ import annotations

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import platform
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import h5py
import numpy as np
import scipy.fft
from figures import note
from scipy import signal

from tdacoustic.formats import scan
from tdacoustic.ingest.single import bind_log
from tdacoustic.lines import find_lines
from tdacoustic.measured import survey_recording
from tdacoustic.recording import Recording
from tdacoustic.spectra import FramePowerMeter, average_spectrum, plan_frames

RATE, CHANNELS = 51200, 4


def write_log(path: Path, seconds: float) -> None:
    """Write the log that all contestants read."""
    rng = np.random.default_rng(1)
    t = np.arange(int(seconds * RATE)) / RATE
    with h5py.File(path, "w") as file:
        file.attrs["schema"] = "tdacoustic-log/1"
        for channel in range(CHANNELS):
            x = rng.standard_normal(t.size) + np.sin(2.0 * np.pi * (700.0 + 13.0 * channel) * t)
            data = file.create_dataset(f"mic_{channel}", data=x.astype(np.float32))
            data.attrs["unit"], data.attrs["sample_rate_hz"] = "Pa", float(RATE)


def read_once(path: Path) -> np.ndarray:
    with h5py.File(path) as file:
        return np.array([file[f"mic_{channel}"][:] for channel in range(CHANNELS)], dtype=np.float64)


def read_and_transform(path: Path) -> None:
    """Read once, and one bare transform of every frame: what no averaged spectrum can do without."""
    data = read_once(path)
    plan = plan_frames(float(RATE), data.shape[1])
    for row in data:
        for frame in range(plan.n_frames):
            scipy.fft.rfft(row[frame * plan.hop : frame * plan.hop + plan.frame_length])


def spectra_and_lines(recording: Recording) -> None:
    """Frame powers, spectra and lines, block by block from the file."""
    names = [channel.name for channel in recording.channels]
    n_samples = recording.channels[0].n_samples
    meter = FramePowerMeter(plan_frames(float(RATE), n_samples, n_channels=len(names)), len(names))
    for block in recording.blocks(names, 2**18):
        meter.take(block)
    powers = meter.result()
    for index in range(len(names)):
        find_lines(average_spectrum(powers, index, "sound_pressure", "Pa"))


def survey(recording: Recording, bands: bool) -> None:
    powers = survey_recording(recording, bands=bands).rasters[0].powers
    assert powers is not None
    for index in range(CHANNELS):
        find_lines(average_spectrum(powers, index, "sound_pressure", "Pa"))


def welch(path: Path) -> None:
    signal.welch(read_once(path), RATE, "hann", RATE, RATE // 2, axis=-1)


def librosa_stft(path: Path) -> None:
    import librosa

    for row in read_once(path):
        np.mean(np.abs(librosa.stft(row, n_fft=RATE, hop_length=RATE // 2, center=False)) ** 2, axis=1)


def main(seconds: float = 60.0, repeats: int = 5) -> None:
    """Time all contestants in turn, several times, and print medians and ratios."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.h5"
        write_log(path, seconds)
        recording = bind_log(scan(path))
        contestants: dict[str, Callable[[], object]] = {
            "reading once": lambda: read_once(path),
            "reading + one bare rfft a frame": lambda: read_and_transform(path),
            "ours: spectra and lines": lambda: spectra_and_lines(recording),
            "ours: survey without bands (adds statistics)": lambda: survey(recording, False),
            "ours: survey with bands": lambda: survey(recording, True),
            "reading + scipy.signal.welch": lambda: welch(path),
            "reading + librosa.stft, mean of squares": lambda: librosa_stft(path),
        }
        times: dict[str, list[float]] = {name: [] for name in contestants}
        for repeat in range(repeats + 1):
            for name, contestant in contestants.items():
                start = time.perf_counter()
                contestant()
                if repeat:  # the first round warms caches and imports
                    times[name].append(time.perf_counter() - start)
    medians = {name: statistics.median(values) for name, values in times.items()}
    bare = times["reading + one bare rfft a frame"]
    libraries = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "h5py", "librosa", "PyOctaveBand"))
    print(f"{CHANNELS} channels x {seconds:g} s at {RATE} Hz, float32 HDF5; median of {repeats} rounds")
    print(f"Python {platform.python_version()}, {libraries}; {platform.machine()}, {os.cpu_count()} cores\n")
    print(f"{'':46} {'s':>7} {'over bare':>9} {'(lowest to highest)':>20} {'x real time a channel':>22}")
    for name, median in medians.items():
        ratios = [own / other for own, other in zip(times[name], bare, strict=True)]
        spread = f"{min(ratios):.2f} to {max(ratios):.2f}"
        faster = CHANNELS * seconds / median
        print(f"{name:46} {median:7.3f} {statistics.median(ratios):9.2f} {spread:>20} {faster:22.0f}")
    _note(times, seconds)


def _note(times: dict[str, list[float]], seconds: float) -> None:
    """Note what stands against scipy and librosa, and against the budgets."""
    ours = times["ours: spectra and lines"]
    for rival in ("reading + scipy.signal.welch", "reading + librosa.stft, mean of squares"):
        ratios = [theirs / own for own, theirs in zip(ours, times[rival], strict=True)]
        theirs = statistics.median(times[rival])
        note("spectra and lines, 4 channels at 51.2 kHz", statistics.median(ours), "s", rival, theirs, ratios)
    bare = statistics.median(times["reading + one bare rfft a frame"])
    budget = 1.5 * bare
    what = "the same; the budget is 1.5 times reading and one bare FFT pass"
    note(what, statistics.median(ours), "s", "reading + one bare rfft a frame", bare, budget=budget)
    banded = CHANNELS * seconds / statistics.median(times["ours: survey with bands"])
    note("survey with third octaves, 4 channels at 51.2 kHz", banded, "x real time")


if __name__ == "__main__":
    main(*(kind(text) for kind, text in zip((float, int), sys.argv[1:], strict=False)))

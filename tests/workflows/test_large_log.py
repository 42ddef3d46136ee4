"""The memory that a run takes does not grow with its log.

``TDACOUSTIC_LARGE_MB=2000`` runs it on logs of 2 GB (HDF5 and RF64) instead of one of 200 MB (HDF5).
"""

import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
import pytest
import soundfile
from small_campaigns import HEAD, table

pytestmark = pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="measures memory through /proc")

ROOT = Path(__file__).resolve().parents[2]
LARGE_MB = int(os.environ.get("TDACOUSTIC_LARGE_MB", "200"))
LIMIT_MB = 600 if LARGE_MB <= 200 else 1000
GROWTH_MB = 60
RATE_HZ = 51200
UNITS = ("Pa", "m/s^2", "N", "N")
CHANNELS = len(UNITS)


@dataclass(frozen=True)
class Measured:
    seconds: float
    peak_mb: float
    """Of the resident memory of the program and all its worker processes together, sampled."""
    largest_mb: float
    """Of the largest single process, from the kernel."""


def blocks(n_samples):
    """One second of noise and a tone in each channel, over and over, made anew each time it is asked for."""
    t = np.arange(RATE_HZ) / RATE_HZ
    noise = np.random.default_rng(1).standard_normal((CHANNELS, RATE_HZ)) * 0.05
    one = noise + 0.2 * np.sin(2 * np.pi * 300.0 * t)
    for start in range(0, n_samples, RATE_HZ):
        yield start, one[:, : n_samples - start]


def write_hdf5(path, n_bytes):
    n_samples = n_bytes // 8 // CHANNELS
    with h5py.File(path, "w") as file:
        file.attrs["schema"] = "tdacoustic-log/1"
        held = [file.create_dataset(f"ch{i + 1}", (n_samples,), "f8", track_times=False) for i in range(CHANNELS)]
        for dataset, unit in zip(held, UNITS, strict=True):
            dataset.attrs["unit"], dataset.attrs["sample_rate_hz"] = unit, float(RATE_HZ)
        for start, block in blocks(n_samples):
            for dataset, values in zip(held, block, strict=True):
                dataset[start : start + len(values)] = values


def write_rf64(path, n_bytes):
    with soundfile.SoundFile(path, "w", RATE_HZ, CHANNELS, subtype="DOUBLE", format="RF64") as file:
        for _, block in blocks(n_bytes // 8 // CHANNELS):
            file.write(block.T)


WRITERS = {"large.h5": write_hdf5, "large.wav": write_rf64}


def campaign_of(folder, log):
    channels = "".join(
        table("channel", name=f"ch{i + 1}", source=i + 1, **({"full_scale": f"1 {unit}"} if ".wav" in log else {}))
        for i, unit in enumerate(UNITS)
    )
    path = folder / "campaign.toml"
    path.write_text(HEAD + channels + table("run", condition="1", train_speed_km_h=30.0, logs=[log]))
    return path


def resident_mb(session):
    """Resident memory of all processes of a session."""
    total = 0.0
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if int((folder / "stat").read_text().rsplit(")", 1)[1].split()[3]) == session:
                total += int((folder / "statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
        except (OSError, IndexError):
            continue
    return total


MEASURING = """
import resource, sys
from tdacoustic.cli import main
if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    finally:
        peaks = [resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
        print("peak_kb", max(peaks), file=sys.stderr)
"""


def measured_run(folder, campaign, jobs):
    (folder / "measuring.py").write_text(MEASURING)
    arguments = ["run", campaign, "--store", folder / "store", "-o", folder / "result", "--quiet", "--jobs", jobs]
    command = [sys.executable, folder / "measuring.py", *arguments]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    start = time.monotonic()
    process = subprocess.Popen(
        list(map(str, command)), stderr=subprocess.PIPE, env=environment, text=True, start_new_session=True
    )
    peak = 0.0
    while process.poll() is None:
        peak = max(peak, resident_mb(process.pid))
        time.sleep(0.03)
    _, said = process.communicate()
    assert process.returncode == 0, said
    return Measured(time.monotonic() - start, peak, int(said.split()[-1]) * 1.024e-3)


def measured_on(folder, log, megabytes, jobs):
    folder.mkdir()
    WRITERS[log](folder / log, megabytes * 1_000_000)
    try:
        found = measured_run(folder, campaign_of(folder, log), jobs)
    finally:
        (folder / log).unlink()
    print(f"{log}, {megabytes} MB, {jobs} processes: {found}")
    return found


@pytest.mark.parametrize("log", WRITERS if LARGE_MB > 200 else ["large.h5"])
def test_memory_does_not_grow_with_the_log(tmp_path, log):
    half = measured_on(tmp_path / "half", log, LARGE_MB // 2, 1)
    whole = measured_on(tmp_path / "whole", log, LARGE_MB, 1)
    assert whole.peak_mb < LIMIT_MB
    assert whole.peak_mb - half.peak_mb < GROWTH_MB
    assert whole.largest_mb - half.largest_mb < GROWTH_MB


@pytest.mark.skipif(LARGE_MB <= 200, reason="only where TDACOUSTIC_LARGE_MB asks for it")
@pytest.mark.parametrize("log", WRITERS)
def test_memory_with_worker_processes(tmp_path, log):
    assert measured_on(tmp_path / "whole", log, LARGE_MB, 2).peak_mb < LIMIT_MB

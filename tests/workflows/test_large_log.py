"""The memory that a run takes does not grow with its log.

``ride.h5`` holds a ride of run-ups and coast-downs with a tacho: it goes through every step, orders, tones and
contributions among them. ``large.h5`` and ``large.wav`` hold a steady run without one. ``TDACOUSTIC_LARGE_MB=2000``
runs all three with 2 GB each instead of the ride with 120 MB; from 10000 on, the ride is also analysed by a program
that may have no more than a tenth of it as data.
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
LARGE_MB = int(os.environ.get("TDACOUSTIC_LARGE_MB", "120"))
LIMIT_MB = 1000
"""The budget of the design."""
GROWTH_MB = 60
TEN_TIMES_MB = 10_000
RATE_HZ = 51200
UNITS = ("Pa", "m/s^2", "N", "N")
CHANNELS = len(UNITS)
RIDE = {"motor_z": "m/s^2", "gearbox_z": "m/s^2", "mic_left": "Pa", "mic_right": "Pa", "tacho": "V"}
PERIOD_S, SLOWEST_HZ, FASTEST_HZ = 40.0, 10.0, 50.0
"""The motor runs up and coasts down once in so long."""
PULSES = 12


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


def ride_blocks(n_samples):
    """Ten seconds at a time: orders of the motor and of the mesh over a speed that swings, noise, and a tacho."""
    step = 10 * RATE_HZ
    noise = np.random.default_rng(2).standard_normal((len(RIDE), step))
    mean, swing = 0.5 * (FASTEST_HZ + SLOWEST_HZ), 0.5 * (FASTEST_HZ - SLOWEST_HZ)
    for start in range(0, n_samples, step):
        t = np.arange(start, min(start + step, n_samples)) / RATE_HZ
        turns = mean * t - swing * PERIOD_S / (2 * np.pi) * np.sin(2 * np.pi * t / PERIOD_S)
        motor, mesh = np.cos(2 * np.pi * 2 * turns), np.cos(2 * np.pi * 31 * turns)
        pulses = 5.0 * ((PULSES * turns) % 1.0 < 0.5)
        signals = np.array([motor + 0.1 * mesh, mesh + 0.1 * motor, 0.05 * motor + 0.1 * mesh, 0.1 * mesh, pulses])
        scale = np.array([[0.2], [0.2], [0.02], [0.02], [0.02]])
        yield start, signals + scale * np.roll(noise, start // 7, axis=1)[:, : t.size]


def write_ride(path, n_bytes):
    n_samples = n_bytes // 8 // len(RIDE)
    with h5py.File(path, "w") as file:
        file.attrs["schema"] = "tdacoustic-log/1"
        held = [file.create_dataset(name, (n_samples,), "f8", track_times=False) for name in RIDE]
        for dataset, unit in zip(held, RIDE.values(), strict=True):
            dataset.attrs["unit"], dataset.attrs["sample_rate_hz"] = unit, float(RATE_HZ)
        for start, block in ride_blocks(n_samples):
            for dataset, values in zip(held, block, strict=True):
                dataset[start : start + len(values)] = values


WRITERS = {"ride.h5": write_ride, "large.h5": write_hdf5, "large.wav": write_rf64}


def ride_campaign(folder, log):
    (folder / "fleet.toml").write_text((ROOT / "recordings" / "run-up" / "fleet.toml").read_text(encoding="utf-8"))
    sensor = {"quantity": "acceleration", "direction": "z"}
    microphone = {"component": "air", "role": "receiver", "quantity": "sound_pressure", "distance_m": 4.0}
    tacho = {"component": "shaft", "quantity": "tacho", "shaft": "motor", "pulses_per_rev": PULSES}
    channels = [
        table("channel", name="motor_z", component="motor", **sensor),
        table("channel", name="gearbox_z", component="gearbox", **sensor),
        table("channel", name="mic_left", side="left", **microphone),
        table("channel", name="mic_right", side="right", **microphone),
        table("channel", name="tacho", **tacho),
    ]
    path = folder / "campaign.toml"
    head = HEAD + 'fleet = "fleet.toml"\n'
    path.write_text(head + "".join(channels) + table("run", condition="ride", logs=[log]))
    return path


def campaign_of(folder, log):
    if log == "ride.h5":
        return ride_campaign(folder, log)
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
import os, resource, sys
from tdacoustic.cli import main
if __name__ == "__main__":
    allowed = int(os.environ["ALLOWED_MB"]) * 1_000_000
    if allowed:
        resource.setrlimit(resource.RLIMIT_DATA, (allowed, allowed))
    try:
        main(sys.argv[1:])
    finally:
        # not ru_maxrss, which begins with that of the process that started this one
        (own,) = [line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")]
        print("peak_kb", max(int(own), resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss), file=sys.stderr)
"""


def measured_run(folder, campaign, jobs, allowed_mb=0):
    (folder / "measuring.py").write_text(MEASURING)
    arguments = ["run", campaign, "--store", folder / "store", "-o", folder / "result", "--quiet", "--jobs", jobs]
    command = [sys.executable, folder / "measuring.py", *arguments]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "ALLOWED_MB": str(allowed_mb)}
    environment |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
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


def measured_on(folder, log, megabytes, jobs, allowed_mb=0):
    folder.mkdir()
    WRITERS[log](folder / log, megabytes * 1_000_000)
    try:
        found = measured_run(folder, campaign_of(folder, log), jobs, allowed_mb)
    finally:
        (folder / log).unlink()
    print(f"{log}, {megabytes} MB, {jobs} processes: {found}")
    return found


@pytest.mark.parametrize("log", WRITERS if LARGE_MB > 200 else ["ride.h5"])
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


@pytest.mark.skipif(LARGE_MB < TEN_TIMES_MB, reason=f"only where TDACOUSTIC_LARGE_MB asks for {TEN_TIMES_MB} or more")
def test_a_log_ten_times_the_memory(tmp_path):
    """The limit is on data: what the program allocates, libraries' own arrays among it."""
    found = measured_on(tmp_path / "whole", "ride.h5", LARGE_MB, 1, allowed_mb=LARGE_MB // 10)
    assert found.largest_mb < LARGE_MB / 10

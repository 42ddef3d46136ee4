"""Campaigns of the simulated drive on disk: logs in the documented HDF5 layout, a campaign file; truth by condition.

Imports h5py, numpy and the simulated drive, nothing of the package.
"""

from __future__ import annotations

import json
from pathlib import Path

import h5py
import numpy as np
from simulated_drive import RATE, Drive, record

HEAD = 'schema = "tdacoustic-campaign/1"\nname = "Drive"\norigin = "synthetic"\n'
CROSS_TALK = np.array([[1.0, 0.3], [0.2, 1.0]])


def drive(gains=CROSS_TALK, sensor_noise=1e-4, receiver_noise=0.01):
    """Two sources with a sensor each; the paths' delays are far below a frame of 250 ms."""
    return Drive(
        np.asarray(gains, dtype=float),
        np.array([[0.0, 0.002], [0.001, 0.0]])[:, : np.shape(gains)[1]],
        np.array([1.0, 0.8])[: np.shape(gains)[1]],
        np.array([0.004, 0.002])[: np.shape(gains)[1]],
        np.full(2, sensor_noise),
        receiver_noise,
    )


def table(heading, /, **keys):
    return f"[[{heading}]]\n" + "".join(f"{key} = {json.dumps(value)}\n" for key, value in keys.items()) + "\n"


MOTOR = table("channel", name="motor_z", component="motor", quantity="acceleration")
GEARBOX = table("channel", name="gearbox_z", component="gearbox", quantity="acceleration")
MIC = table("channel", name="mic", component="air", role="receiver", quantity="sound_pressure", distance_m=4.0)
UNITS = {"motor_z": "m/s^2", "gearbox_z": "m/s^2", "mic": "Pa"}


def write_log(path, channels, rates=None):
    """`{name: (values, unit)}`, at one rate or by name."""
    with h5py.File(path, "w") as file:
        file.attrs["schema"] = "tdacoustic-log/1"
        for name, (values, unit) in channels.items():
            dataset = file.create_dataset(name, data=np.asarray(values, dtype=np.float32), track_times=False)
            dataset.attrs["sample_rate_hz"] = (rates or {}).get(name, RATE)
            dataset.attrs["unit"] = unit


def decimated(values):
    """Every second sample, what lies above a quarter of the rate taken off first."""
    spectrum = np.fft.rfft(values)
    spectrum[int(0.42 * spectrum.size) :] = 0.0
    return np.fft.irfft(spectrum, values.size)[::2]


def write_campaign(
    folder,
    powers,
    made_by=None,
    seconds=16.0,
    channels=MOTOR + GEARBOX + MIC,
    tones=None,
    run_keys=None,
    text="",
    seed=0,
):
    """A run a row of source powers at 20, 30, ... km/h; returns the campaign file and the records by condition."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    rng, made_by = np.random.default_rng(seed), made_by or drive()
    made, runs = {}, ""
    for number, power in enumerate(powers):
        name = f"{20 + 10 * number}"
        made[name] = record(made_by, power, seconds, rng, () if tones is None else tones[number])
        samples = {channel: (row, UNITS[channel]) for channel, row in zip(UNITS, made[name].samples, strict=True)}
        write_log(folder / f"{name}.h5", samples)
        keys = {"condition": name, "train_speed_km_h": float(name), **((run_keys or {}).get(name, {}))}
        runs += table("run", **{"logs": [f"{name}.h5"], **keys})
    path = folder / "campaign.toml"
    path.write_text(HEAD + text + channels + runs, encoding="utf-8")
    return path, made

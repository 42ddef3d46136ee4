"""Campaigns of two recorders and a calibrator that goes from one to the other; h5py and numpy alone."""

import h5py
import numpy as np
from small_campaigns import HEAD, RATE_HZ, table

GIVEN_PA = 20e-6 * 10 ** (94 / 20)
VOLTS_PER_PA = {"left": 0.05, "right": 0.011}
"""What the microphones have in truth, each on a recorder of its own; 13 dB apart."""


def tone(rms, on_s, seconds, hz=1000.0, floor=1e-6, seed=0):
    """A calibrator's tone that is on for one or several spans, over a floor of noise."""
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    on = np.zeros(t.size, bool)
    for first, last in on_s:
        on |= (t >= first) & (t < last)
    return np.sqrt(2.0) * rms * on * np.sin(2 * np.pi * hz * t) + floor * np.random.default_rng(seed).standard_normal(
        t.size
    )


def write(path, values, start_time=None, channel="ai0", rate_hz=RATE_HZ, **more):
    """A log of a recorder: all recorders name their channels alike."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with h5py.File(path, "w") as file:
        file.attrs["schema"] = "tdacoustic-log/1"
        if start_time is not None:
            file.attrs["start_time"] = start_time
        for name, data in {channel: values, **more}.items():
            dataset = file.create_dataset(name, data=np.asarray(data, dtype=np.float32), track_times=False)
            dataset.attrs["sample_rate_hz"], dataset.attrs["unit"] = rate_hz, "V"


def drive(seed, volts_per_pa, seconds=8.0):
    """1 Pa at 200 Hz."""
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    floor = 1e-4 * np.random.default_rng(seed).standard_normal(t.size)
    return volts_per_pa * (np.sqrt(2.0) * np.sin(2 * np.pi * 200.0 * t) + floor)


def channels(left="ai0", right="ai0", **keys):
    """A microphone on each recorder."""
    common = {"role": "receiver", "quantity": "sound_pressure", "distance_m": 4.0, **keys}
    return table("channel", name="left", source=left, log=1, **common) + table(
        "channel", name="right", source=right, log=2, **common
    )


def calibrator_run(name, logs, kind="calibration_before", **keys):
    return table("run", name=name, kind=kind, logs=logs, calibrator="94 dB", **keys)


def campaign(folder, runs, names=("ai0", "ai0"), head="", text="", **keys):
    """The run between calibrations, on both recorders, and the runs that are given before it."""
    for number, (side, name) in enumerate(zip(("left", "right"), names, strict=True)):
        write(folder / f"{side}.h5", drive(number, VOLTS_PER_PA[side]), channel=name)
    run = table("run", condition="a", logs=["left.h5", "right.h5"], train_speed_km_h=30.0)
    path = folder / "campaign.toml"
    path.write_text(HEAD + head + channels(*names, **keys) + "".join(runs) + run + text, encoding="utf-8")
    return path

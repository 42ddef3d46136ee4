"""Small campaigns with calibrators recorded before and after; h5py and plain numpy, nothing of the program."""

from pathlib import Path

import numpy as np
from small_campaigns import HEAD, RATE_HZ, signal, table, write_log

GIVEN_PA = {"94 dB": 20e-6 * 10 ** (94 / 20), "114 dB": 20e-6 * 10 ** (114 / 20)}
VOLTS_PER_PA = 0.0473
"""What the microphone has in truth."""


def calibrator(rms, on_s=(2.0, 10.0), seconds=12.0, hz=1000.2, floor=2e-5, seed=0, step=None):
    """A tone that is put on and taken off, with handling noise at both; `step` = (instant, factor) turns its level."""
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    on = (t >= on_s[0]) & (t < on_s[1])
    level = np.where(t >= step[0], step[1], 1.0) if step else 1.0
    tone = np.sqrt(2.0) * rms * level * on * np.sin(2 * np.pi * hz * t + 0.4)
    for instant in on_s:
        tone += 3.0 * rms * np.exp(-(((t - instant) / 0.1) ** 2)) * np.sin(2 * np.pi * 17.0 * t)
    return tone + floor * np.random.default_rng(seed).standard_normal(t.size)


def calibrated_campaign(
    folder, sensitivity=None, gives="94 dB", stated="94 dB", drift_db=0.0, text="", channel=None, run=None, **tone
):
    """A microphone in volts, a calibrator before and after, one run of 1 Pa at 200 Hz between them."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    volts = VOLTS_PER_PA * GIVEN_PA[gives]
    quiet = 1e-4 * np.random.default_rng(5).standard_normal(round(12.0 * RATE_HZ))
    for name, factor in (("before", 1.0), ("after", 10 ** (drift_db / 20))):
        write_log(folder / f"{name}.h5", {"mic": (calibrator(factor * volts, **tone), "V"), "other": (quiet, "V")})
    drive = {"mic": (VOLTS_PER_PA * signal(1, 8.0, 200.0, 1.0, 0.01), "V"), "other": (quiet[: round(8 * RATE_HZ)], "V")}
    write_log(folder / "drive.h5", drive)
    keys = {"name": "mic", "role": "receiver", "quantity": "sound_pressure", "distance_m": 4.0}
    keys |= {"sensitivity": sensitivity} if sensitivity else {}
    given = {"calibrator": stated} if stated else {}
    runs = [
        table("run", name="cal before", kind="calibration_before", logs=["before.h5"], **given, **(run or {})),
        table("run", condition="a", logs=["drive.h5"], train_speed_km_h=30.0),
        table("run", name="cal after", kind="calibration_after", logs=["after.h5"], **given, **(run or {})),
    ]
    path = folder / "campaign.toml"
    path.write_text(HEAD + text + table("channel", **keys, **(channel or {})) + "".join(runs), encoding="utf-8")
    return path

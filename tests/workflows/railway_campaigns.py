"""A campaign of railway tests whose levels are known: passages of a line of sources, a standing unit, a start."""

import math

import numpy as np
from small_campaigns import HEAD, RATE_HZ, table, write_log

LENGTH_M, SPEED_KM_H, DISTANCE_M = 100.0, 80.0, 7.5
FRONT_S, SECONDS = 6.0, 17.0
TP_S = LENGTH_M / (SPEED_KM_H / 3.6)
REAR_S = FRONT_S + TP_S


def line_of_sources(t):
    """Mean square of incoherent sources along a moving unit: the angle it is seen under, over pi."""
    x = SPEED_KM_H / 3.6 * (t - FRONT_S)
    return (np.arctan(x / DISTANCE_M) - np.arctan((x - LENGTH_M) / DISTANCE_M)) / math.pi


def sine(seconds, rms, seed=0):
    """A 1 kHz sine, whose A-weighted level is its own, and a little noise."""
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    return math.sqrt(2.0) * rms * np.sin(2.0 * np.pi * 1000.0 * t) + 1e-4 * np.random.default_rng(seed).standard_normal(
        t.size
    )


def passage(rms, seed=0):
    t = np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
    return sine(SECONDS, 1.0, seed) * rms * np.sqrt(line_of_sources(t)) + sine(SECONDS, 1e-5, seed)


def pass_by_level_db(rms):
    t = np.linspace(FRONT_S, REAR_S, 20001)
    return 20.0 * math.log10(rms / 20e-6) + 10.0 * math.log10(float(np.mean(line_of_sources(t))))


def wayside(name, **keys):
    return table(
        "channel", name=name, role="receiver", quantity="sound_pressure", place="wayside",
        **{"distance_m": DISTANCE_M, "height_above_rail_m": 1.2, **keys},
    )  # fmt: skip


def run(name, condition, **keys):
    return table("run", **{"name": name, "condition": condition, "logs": [f"{name}.h5"], **keys})


def pass_by_campaign(folder, rms=((1.0, 0.5), (1.1, 0.55), (0.95, 0.475)), text="", run_keys=None, channels=None):
    """Three passages at two positions; the unit's front and rear are stated."""
    folder.mkdir(parents=True, exist_ok=True)
    keys = {"test": "pass-by", "train_speed_km_h": SPEED_KM_H, "front_s": FRONT_S, "rear_s": REAR_S}
    runs = []
    for number, (left, right) in enumerate(rms, start=1):
        name = f"p{number}"
        logs = {"left": (passage(left, number), "Pa"), "right": (passage(right, number + 10), "Pa")}
        write_log(folder / f"{name}.h5", logs)
        runs.append(run(name, "80", **{**keys, **(run_keys or {})}))
    path = folder / "campaign.toml"
    path.write_text(HEAD + (channels or wayside("left") + wayside("right")) + "".join(runs) + text, encoding="utf-8")
    return path

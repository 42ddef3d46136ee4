"""Makers of small campaigns: h5py and plain text, never the writers under test."""

import json
from pathlib import Path

import h5py
import numpy as np
from plain_fleets import plain_fleet

from tdacoustic.fleet import fleet_toml, load_fleet

REFERENCE = plain_fleet("reference-drive")
RATE_HZ = 4096.0


def signal(seed, seconds, tone_hz, rms=1.0, floor=0.05):
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    noise = np.random.default_rng(seed).standard_normal(t.size)
    return np.sqrt(2.0) * rms * np.sin(2 * np.pi * tone_hz * t) + floor * noise


def write_log(path, channels):
    """Write ``{name: (values, unit)}`` in the documented HDF5 layout."""
    with h5py.File(path, "w") as file:
        file.attrs["schema"] = "tdacoustic-log/1"
        for name, (values, unit) in channels.items():
            dataset = file.create_dataset(name, data=np.asarray(values, dtype=np.float32), track_times=False)
            dataset.attrs["sample_rate_hz"] = RATE_HZ
            if unit is not None:
                dataset.attrs["unit"] = unit


def table(heading, /, **keys):
    """One ``[[heading]]`` of a TOML file; JSON spells these values as TOML does."""
    return f"[[{heading}]]\n" + "".join(f"{key} = {json.dumps(value)}\n" for key, value in keys.items()) + "\n"


MIC = table("channel", name="mic", component="air", role="receiver", quantity="sound_pressure", distance_m=4.0)
MOTOR = table("channel", name="motor", component="motor", quantity="acceleration")
HEAD = 'schema = "tdacoustic-campaign/1"\nname = "Small"\norigin = "measured"\n\n'


def run_table(condition, **keys):
    return table("run", **{"condition": condition, "logs": [f"{condition}.h5"], "train_speed_km_h": 30.0, **keys})


def small_campaign(folder, seconds=2.0, conditions=("a", "b", "c"), channels=MIC, text=""):
    """A campaign of one log a condition, each with a microphone and an accelerometer; returns the campaign file."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for number, condition in enumerate(conditions):
        write_log(
            folder / f"{condition}.h5",
            {
                "mic": (signal(number, seconds, 200.0 + 50.0 * number, 0.2, 0.02), "Pa"),
                "motor": (signal(90 + number, seconds, 320.0, 2.0, 0.1), "m/s^2"),
            },
        )
    path = folder / "campaign.toml"
    path.write_text(HEAD + channels + "".join(map(run_table, conditions)) + text, encoding="utf-8")
    return path


def fleet_campaign(folder, conditions=("a", "b"), fleet=None, channels=MIC):
    """A small campaign with a fleet beside it: that text, else the reference drive at two speeds and one angle."""
    if fleet is None:
        few = {"operation.train_speed_km_h": (30.0, 60.0), "operation.helix_angle_deg": (4.0,)}
        fleet = fleet_toml(load_fleet(REFERENCE).replaced(few, origin="a test"))
    path = small_campaign(folder, conditions=conditions, channels=channels)
    (path.parent / "fleet.toml").write_text(fleet, encoding="utf-8")
    text = path.read_text(encoding="utf-8").replace("\n\n", '\nfleet = "fleet.toml"\n\n', 1)
    path.write_text(text, encoding="utf-8")
    return path


def files_of(folder):
    """Every file of a folder with its bytes."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}

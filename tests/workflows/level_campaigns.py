"""Makers of campaigns whose levels are known: tones over noise, analysed into a store of their own."""

import numpy as np
from plain_fleets import plain_fleet
from small_campaigns import HEAD, RATE_HZ, run_table, table, write_log

from tdacoustic import analyze
from tdacoustic.campaign import load_campaign
from tdacoustic.fleet import load_fleet
from tdacoustic.steps import Store
from tdacoustic.workflows.measured_levels import measured_levels

REFERENCE = plain_fleet("reference-drive")


def pascal(level_db):
    return 20e-6 * 10.0 ** (np.asarray(level_db) / 20.0)


def mic(name, **keys):
    return table("channel", name=name, role="receiver", quantity="sound_pressure", **keys)


def tone(level_db, frequency_hz, seconds=3.0, seed=0, floor_db=20.0):
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    noise = pascal(floor_db) * np.random.default_rng(seed).standard_normal(t.size)
    return np.sqrt(2.0) * pascal(level_db) * np.sin(2.0 * np.pi * frequency_hz * t) + noise


class Made:
    """A campaign of logs `{run: {channel: (values, unit)}}`, analysed."""

    def __init__(self, folder, channels, runs, logs, text="", fleet=None):
        folder.mkdir(parents=True, exist_ok=True)
        for name, held in logs.items():
            write_log(folder / f"{name}.h5", held)
        self.fleet_path = folder / "fleet.toml"
        self.fleet_path.write_text(fleet or REFERENCE.read_text(encoding="utf-8"), encoding="utf-8")
        path = folder / "campaign.toml"
        path.write_text(HEAD + 'fleet = "fleet.toml"\n' + channels + "".join(runs) + text, encoding="utf-8")
        self.campaign, self.fleet = load_campaign(path), load_fleet(self.fleet_path)
        self.store = Store(folder / "store")
        self.analysis = analyze(self.campaign, self.store, jobs=1)

    def levels(self, *data, **options):
        options = {"store": self.store, **options}
        return measured_levels(self.campaign, self.analysis, self.fleet, data or ("surface",), **options)


def run_of(condition, name, **keys):
    return run_table(condition, **{"name": name, "logs": [f"{name}.h5"], **keys})


def campaign_of(folder, levels, channels=None, text="", run_keys=None, frequency_hz=500.0, **options):
    """Runs `{name: (condition, {mic: level})}` with a tone each."""
    names = dict.fromkeys(name for _, held in levels.values() for name in held)
    channels = channels or "".join(mic(name, distance_m=4.0) for name in names)
    logs = {
        run: {name: (tone(level, frequency_hz, seed=k), "Pa") for name, level in held.items()}
        for k, (run, (_, held)) in enumerate(levels.items())
    }
    runs = [run_of(condition, run, **(run_keys or {}).get(run, {})) for run, (condition, _) in levels.items()]
    return Made(folder, channels, runs, logs, text, **options)

"""Random synthetic campaigns, by the protocol of README.md; nothing of the analysis is used here."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tdacoustic.synthesis import synthesize

SAMPLE_RATE_HZ = 8192.0
LOWEST_HZ, HIGHEST_HZ = 40.0, 3200.0
LEAST_DISTANCE_HZ, LEAST_DISTANCE = 8.0, 0.015


@dataclass(frozen=True)
class RandomCampaign:
    """A recipe, its fleet, and what the sampler knows beyond `truth.json`."""

    recipe: dict[str, Any]
    fleet: dict[str, Any]
    wander: float
    tacho: bool
    named: bool


def random_campaign(seed: int) -> RandomCampaign:
    """Draw one campaign."""
    rng = np.random.default_rng([20261122, seed])
    drive = _Drive(rng)
    channels = _channels(rng, drive.tacho)
    n_conditions = int(rng.integers(3, 6))
    speeds = np.sort(rng.uniform(15.0, 120.0, n_conditions))
    conditions = [_condition(rng, drive, channels, str(number + 1), speed) for number, speed in enumerate(speeds)]
    recipe = {
        "schema": "tdacoustic-synthesis/1",
        "name": f"random campaign {seed}",
        "seed": seed,
        "sample_rate_hz": SAMPLE_RATE_HZ,
        "duration_s": 8.0,
        "bits": 16,
        "fleet": "fleet.toml",
        "kinematics": {
            "wheel_diameter_mm": drive.wheel_mm,
            "speed_wander": drive.wander,
            "gear_pair": [{"teeth": list(drive.teeth)}],
        },
        "channel": channels,
        "path": _paths(rng),
        "condition": conditions,
    }
    return RandomCampaign(recipe, drive.fleet(seed), drive.wander, drive.tacho, drive.named)


class _Drive:
    """What does not change within a campaign."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.teeth = (int(rng.integers(17, 36)), int(rng.integers(60, 111)))
        self.wheel_mm = round(float(rng.uniform(850.0, 1250.0)), 1)
        self.wander = float(rng.uniform(0.0, 0.005))
        self.tacho = bool(rng.random() < 2.0 / 3.0)
        self.named = bool(rng.random() < 0.5)
        self.carrier_hz = round(float(rng.uniform(300.0, 900.0)), 1)
        self.slot_order = int(rng.integers(36, 73))

    def motor_hz(self, km_h: float) -> float:
        return km_h / 3.6 / (np.pi * 1e-3 * self.wheel_mm) * self.teeth[1] / self.teeth[0]

    def fleet(self, seed: int) -> dict[str, Any]:
        content: dict[str, Any] = {
            "schema": "tdacoustic-fleet/1",
            "name": f"random fleet {seed}",
            "train": {"wheel_diameter_mm": self.wheel_mm},
            "gear_pair": [{"teeth": list(self.teeth)}],
        }
        if self.named:
            excitations = [{"name": f"carrier x{n}", "carrier": n} for n in range(1, 7)]
            excitations.append({"name": "slots x1", "shaft": self.slot_order})
            content["motor"] = {"carrier_hz": self.carrier_hz, "excitation": excitations}
        return content


def _floor(rng: np.random.Generator, levels: tuple[float, float, float, float]) -> dict[str, Any]:
    points = [[hz, round(level, 2)] for hz, level in zip((10, 100, 700, 4096), levels, strict=True)]
    hump = {
        "frequency_hz": round(float(rng.uniform(200.0, 2500.0)), 1),
        "width_hz": round(float(rng.uniform(80.0, 400.0)), 1),
        "height_db": round(float(rng.uniform(2.0, 8.0)), 2),
    }
    return {"floor": points, "hump": [hump]}


def _channels(rng: np.random.Generator, tacho: bool) -> list[dict[str, Any]]:
    channels: list[dict[str, Any]] = []
    for component in ("motor", "gearbox"):
        base = 78.0 + rng.uniform(-5.0, 5.0, 4)
        gain = float(rng.uniform(0.0, 20.0)) if component == "gearbox" else 0.0
        for direction in "xyz"[: int(rng.integers(1, 4))]:
            levels = tuple(float(level) for level in base + rng.uniform(-2.0, 2.0))
            channels.append(
                {"name": f"{component}_{direction}", "quantity": "acceleration", "component": component}
                | {"direction": direction, "gain_db": round(gain, 2)}
                | _floor(rng, levels)  # type: ignore[arg-type]
            )
    top = rng.uniform(45.0, 60.0)
    for side in ("left", "right")[: int(rng.integers(1, 3))]:
        falls = (rng.uniform(-6.0, 6.0), rng.uniform(-3.0, 3.0), rng.uniform(-12.0, 0.0), rng.uniform(-25.0, -8.0))
        channels.append(
            {"name": f"mic_{side}", "quantity": "sound_pressure", "component": "air", "role": "receiver"}
            | {"side": side, "distance_m": 4.0}
            | _floor(rng, tuple(float(top + fall) for fall in falls))  # type: ignore[arg-type]
        )
    if tacho:
        pulses = int(rng.choice([1, 6, 12]))
        channels.append(
            {"name": "tacho", "quantity": "tacho", "component": "shaft", "shaft": "motor", "pulses_per_rev": pulses}
        )
    return channels


def _paths(rng: np.random.Generator) -> list[dict[str, Any]]:
    paths = []
    for start, end in (("motor", "gearbox"), ("gearbox", "motor")):
        gain = float(rng.uniform(-26.0, -6.0))
        paths.append(
            {"from": start, "to": end, "gain_db": round(gain, 2)}
            | {"broadband_gain_db": round(gain + float(rng.uniform(-2.0, 2.0)), 2)}
            | {"delay_s": float(rng.uniform(0.0, 0.003)), "coherence": float(rng.uniform(0.5, 1.0))}
        )
    return paths


def _condition(
    rng: np.random.Generator, drive: _Drive, channels: list[dict[str, Any]], name: str, km_h: float
) -> dict[str, Any]:
    km_h = round(float(km_h), 2)
    excess = float(rng.uniform(0.0, 0.01))
    motor_hz = drive.motor_hz(km_h) * (1.0 + excess)
    taken: list[float] = []
    lines = []
    for component, kinds in (("motor", _motor_kind), ("gearbox", _gearbox_kind)):
        for heard, count in ((True, int(rng.integers(1, 5))), (False, int(rng.integers(0, 3)))):
            for _ in range(count):
                place = _placed(rng, drive, motor_hz, kinds, taken)
                if place is not None:
                    lines.append(
                        {"source": component, **place, "prominence_db": _levels(rng, channels, component, heard)}
                    )
    for _ in range(int(rng.integers(0, 3))):
        place = _placed(rng, drive, motor_hz, _unknown_hz, taken)
        if place is not None:
            lines.append({"source": "decoy", **place, "prominence_db": _levels(rng, channels, None, True)})
    return {
        "name": name,
        "train_speed_km_h": km_h,
        "mesh_excess": excess,
        "carrier_hz": drive.carrier_hz,
        "line": lines,
    }


def _levels(
    rng: np.random.Generator, channels: list[dict[str, Any]], component: str | None, heard: bool
) -> dict[str, float]:
    own, air = rng.uniform(10.0, 30.0), rng.uniform(0.0, 25.0)
    levels = {}
    for channel in channels:
        if channel["component"] == component:
            levels[channel["name"]] = float(np.clip(own + rng.uniform(-3.0, 3.0), 10.0, 30.0))
        elif channel.get("role") == "receiver" and heard:
            levels[channel["name"]] = float(np.clip(air + rng.uniform(-2.0, 2.0), 0.0, 25.0))
    return {key: round(value, 2) for key, value in levels.items()}


def _unknown_hz(rng: np.random.Generator, drive: _Drive, motor_hz: float) -> tuple[dict[str, Any], float]:
    hz = round(float(np.exp(rng.uniform(np.log(100.0), np.log(3000.0)))), 2)
    return {"frequency_hz": hz}, hz


def _motor_kind(rng: np.random.Generator, drive: _Drive, motor_hz: float) -> tuple[dict[str, Any], float]:
    kind = rng.choice(["carrier", "slots", "shaft", "unknown"], p=[0.45, 0.15, 0.1, 0.3])
    if kind == "carrier":
        number = int(rng.integers(1, 7))
        return {"carrier": number}, number * drive.carrier_hz
    if kind == "unknown":
        return _unknown_hz(rng, drive, motor_hz)
    order = drive.slot_order if kind == "slots" else int(rng.integers(2, 5))
    return {"order": order}, order * motor_hz


def _gearbox_kind(rng: np.random.Generator, drive: _Drive, motor_hz: float) -> tuple[dict[str, Any], float]:
    kind = rng.choice(["mesh", "unknown", "fraction"], p=[0.65, 0.2, 0.15])
    if kind == "mesh":
        number = int(rng.choice(np.arange(1, 8), p=[0.3, 0.25, 0.15, 0.1, 0.08, 0.07, 0.05]))
        return {"mesh": number}, number * drive.teeth[0] * motor_hz
    if kind == "unknown":
        return _unknown_hz(rng, drive, motor_hz)
    order = round(float(rng.uniform(5.0, 90.0)), 3)
    return {"order": order}, order * motor_hz


def _placed(rng: np.random.Generator, drive: _Drive, motor_hz: float, kinds: Any, taken: list[float]) -> Any:
    """Draw a line that lies in the band and keeps its distance; None after 40 trials."""
    for _ in range(40):
        place, hz = kinds(rng, drive, motor_hz)
        apart = all(abs(hz - other) >= max(LEAST_DISTANCE_HZ, LEAST_DISTANCE * max(hz, other)) for other in taken)
        if LOWEST_HZ <= hz <= HIGHEST_HZ and apart:
            taken.append(hz)
            return place
    return None


def write_campaign(campaign: RandomCampaign, folder: Path) -> Path:
    """Write the campaign's files and return the path of `campaign.toml`."""
    folder.mkdir(parents=True, exist_ok=True)
    recipe = folder / "synthesis.toml"
    recipe.write_text(_toml(campaign.recipe), encoding="utf-8")
    (folder / "fleet.toml").write_text(_toml(campaign.fleet), encoding="utf-8")
    return synthesize(recipe, folder, overwrite=True).campaign


def _toml(content: dict[str, Any]) -> str:
    return "".join(f"{key} = {_value(value)}\n" for key, value in content.items())


def _value(value: Any) -> str:
    """Inline TOML, in one line whatever the depth."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{json.dumps(str(key))} = {_value(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    return json.dumps(value) if isinstance(value, str) else repr(value)

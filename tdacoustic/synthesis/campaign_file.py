"""The `campaign.toml` that goes with synthetic logs."""

from __future__ import annotations

import datetime
import json
from collections.abc import Mapping
from typing import Any

from tdacoustic.synthesis.recipe import ChannelRecipe, Recipe
from tdacoustic.synthesis.run import RunPlan

__all__ = ["campaign_toml", "toml_value"]

_CHANNEL_KEYS = ("component", "drive", "role", "quantity", "direction", "position_m", "distance_m")
_CHANNEL_KEYS_AFTER = ("height_above_rail_m", "side")


def toml_value(value: Any) -> str:
    """Write a value as TOML.

    Examples
    --------
    >>> toml_value({"rail": "dry", "n": [1, 2.5]})
    '{ rail = "dry", n = [1, 2.5] }'
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (datetime.datetime, datetime.date, datetime.time)):
        return value.isoformat()
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(key)} = {toml_value(item)}" for key, item in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(toml_value(item) for item in value) + "]"
    return json.dumps(str(value), ensure_ascii=False).replace("\x7f", "\\u007f")


def campaign_toml(recipe: Recipe, runs: list[tuple[RunPlan, str]], recipe_name: str, seed: int) -> str:
    """Return the text of the campaign file.

    Parameters
    ----------
    recipe : Recipe
    runs : list of (RunPlan, str)
        Each run with the name of its log.
    recipe_name : str
        File name of the recipe.
    seed : int
    """
    lines = [
        f"# Synthetic: made by `tdacoustic synthesize` from {recipe_name} with seed {seed}. Nothing here was measured;",
        "# truth.json says what was put in.",
        'schema = "tdacoustic-campaign/1"',
        f"name = {toml_value(recipe.name)}",
        'origin = "synthetic"',
    ]
    if recipe.fleet is not None:
        lines.append(f"fleet = {toml_value(recipe.fleet)}")
    lines += _table("[meta]", {**recipe.meta, "synthesis": f"{recipe_name}, seed {seed}"})
    for channel in recipe.channel:
        lines += _table("[[channel]]", _channel(channel))
    for plan, log in runs:
        lines += _table("[[run]]", _run(plan, log))
    if recipe.analysis:
        lines += _table("[analysis]", recipe.analysis)
    return "\n".join(lines) + "\n"


def _channel(channel: ChannelRecipe) -> dict[str, Any]:
    keys: dict[str, Any] = {"name": channel.name}
    keys |= {key: getattr(channel, key) for key in (*_CHANNEL_KEYS, *_CHANNEL_KEYS_AFTER)}
    if not channel.is_signal and channel.shaft != "train":
        keys["shaft"] = channel.shaft
    if channel.quantity == "tacho":
        keys["pulses_per_rev"] = channel.pulses_per_rev
    return {key: value for key, value in keys.items() if value is not None}


def _run(plan: RunPlan, log: str) -> dict[str, Any]:
    condition = plan.condition
    keys: dict[str, Any] = {"condition": condition.name}
    if plan.name != condition.name:
        keys["name"] = plan.name
    if plan.kind != "test":
        keys["kind"] = plan.kind
    keys |= {"mode": condition.mode, "torque_n_m": condition.torque_n_m}
    if not condition.is_run_up and plan.kind == "test":
        keys["train_speed_km_h"] = condition.train_speed_km_h
    keys["logs"] = [log]
    return {key: value for key, value in keys.items() if value is not None}


def _table(header: str, content: Mapping[str, Any]) -> list[str]:
    return ["", header, *(f"{_key(key)} = {toml_value(value)}" for key, value in content.items())]


def _key(key: str) -> str:
    bare = key.isascii() and key.replace("_", "a").replace("-", "a").isalnum()
    return key if bare else json.dumps(key, ensure_ascii=False)

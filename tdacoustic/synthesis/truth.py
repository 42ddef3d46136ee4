"""The truth about a synthetic campaign: every line in every channel, every level and speed, as plain numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tdacoustic.synthesis.lines import PlacedLine
from tdacoustic.synthesis.logs import StoredChannel
from tdacoustic.synthesis.recipe import ChannelRecipe, Recipe
from tdacoustic.synthesis.run import ChannelSignal, SyntheticRun

__all__ = ["TRUTH_SCHEMA", "doubts_of", "run_truth"]

TRUTH_SCHEMA = "tdacoustic-synthesis-truth/1"

_QUANTISATION_MARGIN_DB = 6.0


def run_truth(recipe: Recipe, run: SyntheticRun, log: str, stored: dict[str, StoredChannel]) -> dict[str, Any]:
    """Return what was put into one run, ready for JSON.

    Parameters
    ----------
    recipe : Recipe
    run : SyntheticRun
    log : str
        File name of its log.
    stored : dict
        The channels as they were quantised.
    """
    motion, plan = run.motion, run.plan
    speed = motion.motor_speed_hz
    nominal = motion.nominal_km_h / 3.6 / (np.pi * 1e-3 * recipe.kinematics.wheel_diameter_mm) * recipe.kinematics.ratio
    signals = recipe.signal_channels
    return {
        "name": plan.name,
        "condition": plan.condition.name,
        "kind": plan.kind,
        "log": log,
        "duration_s": motion.time_s.size / recipe.sample_rate_hz,
        "run_up": plan.condition.is_run_up,
        "train_speed_km_h": _span(motion.nominal_km_h),
        "motor_speed_rpm": {"nominal": 60.0 * float(nominal.mean()), **_span(60.0 * speed)},
        "mesh_excess": motion.mesh_excess,
        "mesh_frequency_hz": {
            pair.name: _span(speed * motion.mesh_order(pair.name)) for pair in recipe.kinematics.gear_pair
        },
        "motor_turns": float(motion.motor_turns[-1]),
        "carrier_hz": plan.condition.carrier_hz,
        "lines": [_line(line, plan.condition.carrier_hz, run) for line in run.lines],
        "channels": {
            channel.name: _channel(recipe, channel, run, run.channels[channel.name], stored[channel.name])
            for channel in signals
        },
        "tachos": {
            name: {
                "pulses": int(pulses.rising_s.size),
                "missing_s": pulses.missing_s.tolist(),
                "double_s": pulses.double_s.tolist(),
            }
            for name, pulses in run.tachos.items()
        },
    }


def doubts_of(recipe: Recipe, run: SyntheticRun, stored: dict[str, StoredChannel]) -> list[str]:
    """Return what a reader of the logs may not see as the recipe says it, one sentence each."""
    doubts = []
    low, high = recipe.band_hz
    frequency = np.geomspace(low, high, 60)
    for channel in recipe.signal_channels:
        density = run.channels[channel.name].density(recipe, channel, frequency)
        margin = 10.0 * np.log10(density / stored[channel.name].quantisation_density)
        worst = int(np.argmin(margin))
        if margin[worst] < _QUANTISATION_MARGIN_DB:
            doubts.append(
                f"run {run.plan.name!r}, channel {channel.name!r}: the scatter of {stored[channel.name].bits} bits "
                f"lies {-margin[worst]:+.1f} dB against the floor at {frequency[worst]:.0f} Hz; raise bits"
            )
    return doubts


def _span(values: NDArray) -> dict[str, float]:
    return {"mean": float(values.mean()), "min": float(values.min()), "max": float(values.max())}


def _line(line: PlacedLine, carrier_hz: float | None, run: SyntheticRun) -> dict[str, Any]:
    fixed, order = run.motion.fixed_and_order(line.recipe, carrier_hz)
    return {
        "line": line.name,
        "source": line.recipe.source,
        "fixed_hz": fixed,
        "motor_order": order,
        "mesh": line.recipe.mesh,
        "carrier": line.recipe.carrier,
        "frequency_hz": _span(line.frequency_hz),
    }


def _channel(
    recipe: Recipe, channel: ChannelRecipe, run: SyntheticRun, signal: ChannelSignal, stored: StoredChannel
) -> dict[str, Any]:
    def level(rms: float) -> float | None:
        return 20.0 * float(np.log10(rms / channel.reference)) if rms > 0.0 else None

    grid = np.geomspace(10.0, 0.45 * recipe.sample_rate_hz, 25)
    density = signal.density(recipe, channel, grid)
    by_name = {line.name: line for line in run.lines}
    lines = []
    for held in signal.lines:
        frequency = by_name[held.line].frequency_hz
        around = float(signal.density(recipe, channel, np.array([frequency.mean()]))[0]) + stored.quantisation_density
        steady = float(np.ptp(frequency)) <= 0.02 * float(frequency.mean())
        held_level = level(held.rms)
        floor_level = level(float(np.sqrt(around * recipe.prominence_bandwidth_hz)))
        prominent = steady and held_level is not None and floor_level is not None
        lines.append(
            {
                "line": held.line,
                "source": by_name[held.line].recipe.source,
                "via": held.via,
                "frequency_hz": float(frequency.mean()),
                "level_db": held_level,
                "prominence_db": held_level - floor_level if prominent else None,  # type: ignore[operator]
            }
        )
    return {
        "component": channel.component,
        "level_db": level(signal.overall_rms),
        "broadband_level_db": level(signal.broadband_rms),
        "lines_level_db": level(signal.lines_rms),
        "line_fraction": (signal.lines_rms / signal.overall_rms) ** 2 if signal.overall_rms > 0.0 else None,
        "scale": stored.scale,
        "bits": stored.bits,
        "quantisation_db_per_hz": level(float(np.sqrt(stored.quantisation_density))),
        "broadband_db_per_hz": [[float(f), level(float(np.sqrt(d)))] for f, d in zip(grid, density, strict=True)],
        "lines": lines,
    }

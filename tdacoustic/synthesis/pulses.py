"""Tacho pulses of finite rise, with the faults that real ones have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import RecipeError
from tdacoustic.synthesis.motion import Motion
from tdacoustic.synthesis.recipe import ChannelRecipe

__all__ = ["TachoPulses", "tacho_pulses"]


@dataclass(frozen=True)
class TachoPulses:
    """A tacho's voltage and the truth about its pulses.

    Parameters
    ----------
    voltage_v : ndarray, shape (n,)
    rising_s : ndarray
        Instants of the true rising edges (at half height), those of missing pulses included.
    missing_s, double_s : ndarray
        Instants of the pulses that were left out and of the extra ones.
    """

    voltage_v: NDArray[np.float64]
    rising_s: NDArray[np.float64]
    missing_s: NDArray[np.float64]
    double_s: NDArray[np.float64]


def tacho_pulses(
    channel: ChannelRecipe, motion: Motion, sample_rate_hz: float, rng: np.random.Generator
) -> TachoPulses:
    """Make the pulse train of a tacho channel.

    Pulses are trapezoids: straight edges of `pulse_rise_s` (default two samples) centred on the instants at which the
    shaft passes the marks.

    Raises
    ------
    RecipeError
        The pulses are too short for the rise time, or more faults are wanted than there are pulses.
    """
    pulses_per_rev = channel.pulses_per_rev or 1
    phase = motion.motor_turns * motion.shaft_ratio(channel.shaft) * pulses_per_rev + rng.uniform(0.0, 1.0)
    rise_s = channel.pulse_rise_s or 2.0 / sample_rate_hz
    duty = channel.pulse_duty
    top_hz = float(motion.motor_speed_hz.max()) * motion.shaft_ratio(channel.shaft) * pulses_per_rev
    shortest = min(duty, 1.0 - duty) * (0.3 if channel.double_pulses else 1.0)
    if top_hz * rise_s > shortest:
        raise RecipeError(
            f"pulses_per_rev = {pulses_per_rev} gives {top_hz:.0f} pulses/s (channel {channel.name!r}), too short for "
            f"a rise of {rise_s * 1e3:.3g} ms: lower pulses_per_rev or raise sample_rate_hz"
        )
    marks = np.arange(np.floor(phase[0]) - 1.0, np.ceil(phase[-1]) + 2.0)
    inside = np.flatnonzero((marks > phase[0]) & (marks < phase[-1]))
    n_missing, n_double = (channel.missing_pulses, channel.double_pulses) if top_hz > 0.0 else (0, 0)
    n_faults = n_missing + n_double
    if n_faults > max(inside.size - 4, 0):
        raise RecipeError(f"{n_faults} faulty pulses wanted of {inside.size} in all (channel {channel.name!r})")
    faulty = rng.choice(inside[2:-2], n_faults, replace=False) if n_faults else np.array([], dtype=int)
    missing, double = faulty[:n_missing], faulty[n_missing:]
    kept = np.delete(marks, missing)
    extra_rise = marks[double] + duty + 0.35 * (1.0 - duty)
    extra_fall = marks[double] + duty + 0.65 * (1.0 - duty)
    if top_hz > 0.0:
        rises = _instants(np.concatenate([kept, extra_rise]), phase, motion.time_s)
        falls = _instants(np.concatenate([kept + duty, extra_fall]), phase, motion.time_s)
        voltage = channel.pulse_height_v * _trapezoids(motion.time_s, rises, falls, rise_s)
    else:
        voltage = np.zeros_like(motion.time_s)
    return TachoPulses(
        voltage_v=voltage,
        rising_s=_instants(marks[inside], phase, motion.time_s),
        missing_s=np.sort(_instants(marks[missing], phase, motion.time_s)),
        double_s=np.sort(_instants(extra_rise, phase, motion.time_s)),
    )


def _instants(marks: NDArray, phase: NDArray, time_s: NDArray) -> NDArray[np.float64]:
    """Instants at which the phase passes the marks, continued beyond both ends at the speed found there."""
    step = time_s[1] - time_s[0]
    first, last = max(phase[1] - phase[0], 1e-9), max(phase[-1] - phase[-2], 1e-9)
    instants = np.interp(marks, phase, time_s)
    instants = np.where(marks < phase[0], time_s[0] - (phase[0] - marks) / first * step, instants)
    return np.where(marks > phase[-1], time_s[-1] + (marks - phase[-1]) / last * step, instants)


def _trapezoids(time_s: NDArray, rises: NDArray, falls: NDArray, rise_s: float) -> NDArray[np.float64]:
    half = 0.5 * rise_s
    knots = np.concatenate([rises - half, rises + half, falls - half, falls + half])
    heights = np.repeat([0.0, 1.0, 1.0, 0.0], [rises.size, rises.size, falls.size, falls.size])
    order = np.argsort(knots, kind="stable")
    return np.interp(time_s, knots[order], heights[order])

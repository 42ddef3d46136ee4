"""Lines: in which channels each one stands, how strong, by which way, and its waveform."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import RecipeError
from tdacoustic.synthesis.chance import generator
from tdacoustic.synthesis.floors import floor_density
from tdacoustic.synthesis.motion import Motion, slow_noise
from tdacoustic.synthesis.recipe import LineRecipe, PathRecipe, Recipe

__all__ = ["LinePart", "PlacedLine", "line_frequency", "place_line", "waveform"]

_HIGHEST_PART_OF_RATE = 0.49


@dataclass(frozen=True)
class LinePart:
    """One line in one channel by one way.

    Parameters
    ----------
    channel : str
    rms : float
        In the channel's SI unit, before the sensor's gain and before scaling to a prescribed overall level.
    phase_rad : float
    follows_floor : bool
        Whether its level was prescribed over the floor, so that it is scaled with the floor.
    path : PathRecipe or None
        The way it came by; None where the recipe itself puts it there.
    """

    channel: str
    rms: float
    phase_rad: float
    follows_floor: bool = False
    path: PathRecipe | None = None


@dataclass(frozen=True)
class PlacedLine:
    """One line of a recipe in one run.

    Parameters
    ----------
    name : str
        Unique within the run.
    recipe : LineRecipe
    frequency_hz : ndarray, shape (n,)
        Instantaneous frequency.
    turns : ndarray, shape (n,)
        Instantaneous phase in revolutions, the integral of the frequency.
    parts : tuple of LinePart
    """

    name: str
    recipe: LineRecipe
    frequency_hz: NDArray[np.float64]
    turns: NDArray[np.float64]
    parts: tuple[LinePart, ...]


def line_frequency(
    line: LineRecipe, motion: Motion, carrier_hz: float | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the instantaneous frequency in Hz and phase in revolutions of a line, each of shape (n,)."""
    fixed, order = motion.fixed_and_order(line, carrier_hz)
    return fixed + order * motion.motor_speed_hz, fixed * motion.time_s + order * motion.motor_turns


def place_line(
    recipe: Recipe,
    line: LineRecipe,
    name: str,
    motion: Motion,
    *,
    run: str,
    seed: int,
    carrier_hz: float | None,
    floor_gain_db: Mapping[str, float],
    offset_db: float,
) -> PlacedLine:
    """Find the channels a line stands in: those the recipe names, and those the paths lead to.

    A path leads on what the component's first channel holds of the line. A channel that the line itself names gets
    what the line says and nothing by path.

    Parameters
    ----------
    recipe : Recipe
    line : LineRecipe
    name : str
        What to call it.
    motion : Motion
    run : str
        Name of the run, for the random phases.
    seed : int
    carrier_hz : float or None
        The condition's carrier frequency.
    floor_gain_db : mapping
        Shift of each channel's floor in this run.
    offset_db : float
        Scatter of this line's level in this run.

    Raises
    ------
    RecipeError
        The line leaves the band from 0 Hz to 0.49 of the sampling rate.
    """
    frequency, turns = line_frequency(line, motion, carrier_hz)
    low, high = float(frequency.min()), float(frequency.max())
    if low < 0.0 or high > _HIGHEST_PART_OF_RATE * recipe.sample_rate_hz:
        raise RecipeError(
            f"line {name!r} runs from {low:.6g} to {high:.6g} Hz in run {run!r}; with sample_rate_hz = "
            f"{recipe.sample_rate_hz:g} it must stay within 0 and {_HIGHEST_PART_OF_RATE * recipe.sample_rate_hz:g} Hz"
        )
    channels = {channel.name: channel for channel in recipe.signal_channels}
    rng = generator(seed, run, name, "phase")
    common = 0.0 if line.phase_deg is None else np.deg2rad(line.phase_deg)
    parts = []
    for channel_name, value in recipe.channel_levels(line).items():
        channel = channels[channel_name]
        amplitude = channel.reference
        if line.prominence_db is not None:
            gain = 10.0 ** (floor_gain_db.get(channel_name, 0.0) / 10.0)
            density = gain * float(floor_density(channel, np.array([frequency.mean()]))[0])
            amplitude = np.sqrt(density * recipe.prominence_bandwidth_hz)
        phase = common if line.phase_deg is not None else rng.uniform(0.0, 2.0 * np.pi)
        parts.append(
            LinePart(
                channel=channel_name,
                rms=float(amplitude * 10.0 ** ((value + offset_db) / 20.0)),
                phase_rad=float(phase),
                follows_floor=line.prominence_db is not None,
            )
        )
    own = {part.channel: part for part in parts}
    for path in recipe.path:
        sources = recipe.targets(path.source)
        if path.source != line.source or sources[0].name not in own:
            continue
        start = own[sources[0].name]
        for channel in recipe.targets(path.to):
            if channel.name in own or channel in sources:
                continue
            turn = generator(seed, "path", path.source, channel.name, name).uniform(0.0, 2.0 * np.pi)
            turn = 0.0 if path.phase == "path" else turn
            gain = 10.0 ** (path.gain_db / 20.0) * channel.reference / sources[0].reference
            parts.append(LinePart(channel.name, start.rms * gain, start.phase_rad + turn, False, path))
    return PlacedLine(name, line, frequency, turns, tuple(parts))


def waveform(
    placed: PlacedLine, part: LinePart, unit_phasor: NDArray[np.complex128], sample_rate_hz: float, rng_key: tuple
) -> NDArray[np.float64]:
    """Return a line's part in a channel, of shape (n,), in the channel's SI unit.

    Parameters
    ----------
    placed : PlacedLine
    part : LinePart
    unit_phasor : ndarray of complex, shape (n,)
        exp(2πj turns) of the line.
    sample_rate_hz : float
    rng_key : tuple
        Arguments of `chance.generator` for the incoherent rest of a path.
    """
    factor: NDArray[np.complex128] = np.array(np.exp(1j * part.phase_rad))
    path = part.path
    if path is not None:
        if path.delay_s > 0.0:
            factor = factor * np.exp(-2j * np.pi * placed.frequency_hz * path.delay_s)
        if path.coherence < 1.0:
            rest = slow_noise(
                generator(*rng_key), unit_phasor.size, sample_rate_hz, path.coherence_bandwidth_hz
            ) * np.sqrt(1.0 - path.coherence)
            varying = np.sqrt(path.coherence) + rest
            factor = factor * varying / np.sqrt(np.mean(np.abs(varying) ** 2))
    return np.sqrt(2.0) * part.rms * np.real(unit_phasor * factor)

"""Random run-ups of a traction drive, as its accelerometers hear them; numpy alone, nothing of the analysis.

A seed gives one drive, one run and two channels. Everything is drawn as the README of this folder says.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

RATE_HZ = 8192.0


@dataclass(frozen=True)
class RunUp:
    """A run-up and what is true of it.

    Parameters
    ----------
    signals : ndarray, shape (2, n)
        Gearbox, motor; m/s².
    times_s, motor_hz, train_m_s : ndarray, shape (n,)
    teeth : list of (int, int)
    wheel_m : float
    ratio : float
        Turns of the motor for one of the wheelset.
    pole_pairs : int
    slots : int
    about : dict
        What was drawn.
    """

    signals: np.ndarray
    times_s: np.ndarray
    motor_hz: np.ndarray
    train_m_s: np.ndarray
    teeth: list[tuple[int, int]]
    wheel_m: float
    ratio: float
    pole_pairs: int
    slots: int
    about: dict[str, Any]


def train_speed(rng: np.random.Generator, t: np.ndarray) -> tuple[np.ndarray, str]:
    """Train speed in m/s: full acceleration that falls with the speed, with a wander of the driver's hand."""
    kind = str(rng.choice(["up", "up", "up", "down", "hold"]))
    start, acceleration = rng.uniform(3.0, 9.0), rng.uniform(0.3, 1.1)
    knee = rng.uniform(0.4, 1.0) * t[-1]
    push = np.where(t < knee, 1.0, np.maximum(knee / np.maximum(t, 1e-9), 0.3))
    if kind == "hold":
        push = push * (1.0 - ((t > 0.4 * t[-1]) & (t < 0.6 * t[-1])))
    smooth = np.hanning(int(1.0 * RATE_HZ))
    push = np.convolve(np.pad(push, smooth.size // 2, mode="edge"), smooth / smooth.sum(), "same")
    push = push[smooth.size // 2 : smooth.size // 2 + t.size]
    push = push + 0.15 * np.sin(2.0 * np.pi * rng.uniform(0.05, 0.3) * t + rng.uniform(0.0, 6.0))
    speed = start + acceleration * np.cumsum(push) / RATE_HZ
    return (speed[::-1].copy(), kind) if kind == "down" else (speed, kind)


def wheel_slip(rng: np.random.Generator, t: np.ndarray) -> tuple[np.ndarray, int]:
    """Relative slip: creep of up to 1 %, and in a third of the runs one or two spins of 3 to 10 % over 1 to 2.5 s."""
    slip = np.full(t.size, rng.uniform(0.0, 0.01))
    spins = int(rng.integers(1, 3)) if rng.random() < 1 / 3 else 0
    for _ in range(spins):
        middle, width = rng.uniform(0.15, 0.85) * t[-1], rng.uniform(1.0, 2.5)
        share = np.clip(np.abs(t - middle) / width, 0.0, 1.0)
        slip += rng.uniform(0.03, 0.10) * (0.5 + 0.5 * np.cos(np.pi * share))
    return slip, spins


class Resonances:
    """A channel's transmission: modes fixed in Hz over a level floor."""

    def __init__(self, rng: np.random.Generator) -> None:
        count = int(rng.integers(3, 7))
        self.modes_hz = np.exp(rng.uniform(np.log(120.0), np.log(3200.0), count))
        self.loss = rng.uniform(0.01, 0.06, count)
        self.weight = 10.0 ** (rng.uniform(-18.0, 4.0, count) / 20.0)
        self.sign = rng.choice([-1.0, 1.0], count)

    def at(self, frequency_hz: np.ndarray) -> np.ndarray:
        """Complex amplification; 1 far from every mode."""
        f = np.asarray(frequency_hz, dtype=float)[..., None]
        modes = self.sign * self.weight * self.modes_hz**2 * self.loss
        return 1.0 + np.sum(modes * 4.0 / (self.modes_hz**2 - f**2 + 1j * self.loss * self.modes_hz**2), axis=-1)


def floor(rng: np.random.Generator, n: int, resonances: Resonances) -> tuple[np.ndarray, np.ndarray]:
    """Noise and its density over frequency (n // 2 + 1): a slope, and the resonances at half their strength in dB."""
    f = np.fft.rfftfreq(n, 1.0 / RATE_HZ)
    shape = np.sqrt(np.abs(resonances.at(f))) * (1.0 + f / 200.0) ** rng.uniform(-0.6, 0.3)
    white = np.fft.rfft(rng.standard_normal(n))
    noise = np.fft.irfft(white * shape, n)
    density = 2.0 * shape**2 / RATE_HZ
    return noise, density


def run_up(seed: int, prominence_db: tuple[float, float] = (6.0, 24.0), duration_s: float | None = None) -> RunUp:
    """Return the run-up of a seed; `prominence_db` is the range of the first mesh over the floor in 10 Hz."""
    rng = np.random.default_rng([2026, seed])
    duration = rng.uniform(14.0, 24.0) if duration_s is None else duration_s
    t = np.arange(int(duration * RATE_HZ)) / RATE_HZ
    stages = 2 if rng.random() < 0.3 else 1
    if stages == 1:
        teeth = [(int(rng.integers(17, 36)), int(rng.integers(60, 111)))]
    else:
        teeth = [(int(rng.integers(20, 31)), int(rng.integers(38, 60))) for _ in range(2)]
    wheel = rng.uniform(0.85, 1.25)
    ratio = float(np.prod([b / a for a, b in teeth]))
    train, kind = train_speed(rng, t)
    slip, spins = wheel_slip(rng, t)
    motor = train * (1.0 + slip) / (np.pi * wheel) * ratio
    turns = np.cumsum(motor) / RATE_HZ
    pole_pairs, slots = int(rng.integers(2, 4)), int(rng.integers(36, 61))
    rotor_slip = rng.uniform(0.0, 0.03) * (1.0 + 0.3 * np.sin(2.0 * np.pi * 0.1 * t))
    supply_turns = np.cumsum(pole_pairs * motor / (1.0 - rotor_slip)) / RATE_HZ
    level = rng.uniform(*prominence_db)
    lines: list[tuple[float, float, int]] = []  # order, prominence in 10 Hz, component (0 gearbox, 1 motor)
    order = 1.0
    for a, b in teeth:
        fall = rng.uniform(0.0, 6.0)
        for harmonic in range(1, 7):
            lines.append((a * order * harmonic, level - fall * (harmonic - 1) + rng.normal(0.0, 5.0), 0))
        for side in (-1.0, 1.0):
            lines.append((a * order + side * order, level - rng.uniform(6.0, 20.0), 0))
        order *= a / b
        level -= rng.uniform(0.0, 6.0)
    lines += [(float(h), level - rng.uniform(0.0, 15.0), 1) for h in (1, 2, 3, 4)]
    lines.append((float(slots), level + rng.uniform(-10.0, 6.0), 1))
    strange = [
        (float(rng.uniform(3.0, 150.0)), level - rng.uniform(-4.0, 10.0), int(rng.integers(2)))
        for _ in range(int(rng.integers(0, 4)))
    ]
    tones = [
        (float(np.exp(rng.uniform(np.log(80.0), np.log(3000.0)))), rng.uniform(5.0, 30.0))
        for _ in range(int(rng.integers(0, 4)))
    ]
    carrier = float(rng.uniform(300.0, 900.0)) if rng.random() < 0.5 else None
    if carrier is not None:
        tones += [(carrier * k, rng.uniform(5.0, 25.0)) for k in range(1, 5)]
    signals = np.zeros((2, t.size))
    for channel in range(2):
        resonances = Resonances(rng)
        signals[channel], density = floor(rng, t.size, resonances)
        bins = np.fft.rfftfreq(t.size, 1.0 / RATE_HZ)
        quiet = float(np.median(density[(bins > 50.0) & (bins < 3500.0)]))
        for line_order, prominence, component in [*lines, *strange]:
            cross = 0.0 if component == channel else -rng.uniform(3.0, 20.0)
            amplitude = np.sqrt(2.0 * 10.0 * quiet * 10.0 ** ((prominence + cross) / 10.0))
            f = line_order * motor
            grid = np.linspace(0.0, f.max(), 4000)
            response = np.interp(f, grid, np.abs(resonances.at(grid)))
            swell = 1.0 + 0.3 * np.sin(2.0 * np.pi * rng.uniform(0.02, 0.3) * t + rng.uniform(0.0, 6.0))
            grows = (motor / motor.max()) ** rng.uniform(0.0, 1.5)
            heard = f < 0.47 * RATE_HZ
            phase = 2.0 * np.pi * line_order * turns + rng.uniform(0.0, 6.28)
            signals[channel] += heard * amplitude * response * swell * grows * np.cos(phase)
        twice = np.sqrt(2.0 * 10.0 * quiet * 10.0 ** ((level + rng.uniform(-10.0, 6.0)) / 10.0))
        signals[channel] += twice * np.cos(4.0 * np.pi * supply_turns)
        for tone_hz, prominence in tones:
            if tone_hz < 0.47 * RATE_HZ:
                amplitude = np.sqrt(2.0 * 10.0 * quiet * 10.0 ** (prominence / 10.0))
                signals[channel] += amplitude * np.cos(2.0 * np.pi * tone_hz * t + rng.uniform(0.0, 6.28))
    about = {"kind": kind, "spins": spins, "stages": stages, "tones": len(tones), "first_mesh_db": float(lines[0][1])}
    return RunUp(signals, t, motor, train, teeth, wheel, ratio, pole_pairs, slots, about)

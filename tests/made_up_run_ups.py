"""Run-ups with orders of known amplitude and phase, made from formulas alone; nothing here knows of the analysis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class RunUp:
    """A speed that changes evenly from one value to another, in turns per second."""

    first_hz: float
    last_hz: float
    duration_s: float
    rate_hz: float = 8192.0

    @property
    def times(self):
        return np.arange(round(self.duration_s * self.rate_hz)) / self.rate_hz

    @property
    def sweep(self):
        return (self.last_hz - self.first_hz) / self.duration_s

    def speed(self, times):
        return self.first_hz + self.sweep * times

    def turns(self, times):
        return self.first_hz * times + 0.5 * self.sweep * times**2

    def nodes(self, step_s=0.05):
        """Times and turns of an angle's nodes."""
        times = np.arange(0.0, self.duration_s + 0.5 * step_s, step_s)
        return times, self.turns(times)

    def order(self, order, rms=1.0, phase=0.0, ratio=1.0):
        """The samples of an order; rms and phase may be functions of time."""
        times = self.times
        rms = rms(times) if callable(rms) else rms
        phase = phase(times) if callable(phase) else phase
        return np.sqrt(2.0) * rms * np.cos(2.0 * np.pi * order * ratio * self.turns(times) + phase)

    def noise(self, density, seed=1):
        """White noise of a mean-square density in unit² per Hz."""
        samples = np.random.default_rng(seed).standard_normal(self.times.size)
        return np.sqrt(density * 0.5 * self.rate_hz) * samples


def db(ratio):
    """Of an amplitude ratio."""
    return 20.0 * np.log10(np.abs(ratio))

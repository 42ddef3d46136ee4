"""Sinusoids in noise of known density; imports nothing of the analysis."""

import math

import numpy as np

DENSITY = 1e-8
"""Mean-square density of the noise, Pa²/Hz."""


def width_hz(frequency_hz):
    """Critical bandwidth, written out again."""
    return 25.0 + 75.0 * (1.0 + 1.4e-6 * frequency_hz**2) ** 0.69


def tones_in_noise(tones, seconds=40.0, rate=25600.0, density=DENSITY, seed=1):
    """Pressure of tones, each a frequency and a tone-to-noise ratio in dB, in white noise."""
    n = int(seconds * rate)
    t = np.arange(n) / rate
    x = np.random.default_rng(seed).standard_normal(n) * math.sqrt(0.5 * density * rate)
    for number, (frequency, ratio_db) in enumerate(tones):
        mean_square = (density or DENSITY) * width_hz(frequency) * 10.0 ** (0.1 * ratio_db)
        x += math.sqrt(2.0 * mean_square) * np.sin(2.0 * np.pi * frequency * t + number)
    return x

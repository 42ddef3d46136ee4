"""Two recorders of one signal, made exactly: sums of sinusoids evaluated at each recorder's own instants.

Nothing of the program is used, and nothing is interpolated: a sample of the second recorder is the signal at
``offset + n / (rate (1 + drift))``.
"""

import numpy as np

COLUMNS = 4096


def sinusoids(frequencies_hz, amplitudes, phases, start_s, step_s, n):
    """Sum of sinusoids at ``start_s + k step_s``, by products of two rotations."""
    fine = np.exp(2j * np.pi * np.outer(frequencies_hz, np.arange(COLUMNS) * step_s))
    rows = -(-n // COLUMNS)
    out = np.empty(rows * COLUMNS)
    for first in range(0, rows, 64):
        begins = start_s + np.arange(first, min(rows, first + 64)) * COLUMNS * step_s
        coarse = amplitudes * np.exp(2j * np.pi * (np.outer(begins, frequencies_hz) % 1.0) + 1j * phases)
        out[first * COLUMNS : (first + begins.size) * COLUMNS] = (coarse @ fine).real.ravel()
    return out[:n]


def two_recorders(seed, seconds, rates_hz, offset_s, drift_ppm, noise_db, gain=-0.3, n_tones=300, top=0.4):
    """Samples of both; `noise_db` is the noise of each against the signal."""
    random = np.random.default_rng(seed)
    frequencies = np.exp(random.uniform(np.log(20.0), np.log(top * min(rates_hz)), n_tones))
    signal = frequencies, np.full(n_tones, np.sqrt(2.0 / n_tones)), random.uniform(0.0, 2.0 * np.pi, n_tones)
    level = 10.0 ** (noise_db / 20.0)
    n_one, n_two = round(seconds * rates_hz[0]), round((seconds - 1.0) * rates_hz[1])
    one = sinusoids(*signal, 0.0, 1.0 / rates_hz[0], n_one) + level * random.standard_normal(n_one)
    two = sinusoids(*signal, offset_s, 1.0 / (rates_hz[1] * (1.0 + 1e-6 * drift_ppm)), n_two)
    return one, gain * (two + level * random.standard_normal(n_two))

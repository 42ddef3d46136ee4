"""The stated error of a line's frequency where the speed wanders: honest for lines that follow it, small for others."""

from __future__ import annotations

import numpy as np
import pytest

from tdacoustic.lines import find_lines
from tdacoustic.spectra import FramePowerMeter, average_spectrum, plan_frames

RATE_HZ, DURATION_S = 8192, 10.0


def wander(rng: np.random.Generator, n: int, rms: float) -> np.ndarray:
    """Slow relative speed variation below 0.5 Hz, of a given rms and mean zero."""
    spectrum = np.zeros(n // 2 + 1, dtype=complex)
    count = int(0.5 * DURATION_S) + 1
    spectrum[1:count] = rng.standard_normal(count - 1) + 1j * rng.standard_normal(count - 1)
    values = np.fft.irfft(spectrum, n)
    return rms * values / values.std()


def found(rng: np.random.Generator, rms: float, scatter: float) -> list[tuple[float, float]]:
    """Error and stated error of lines at 525 Hz and 1050 Hz that follow the speed and at 926 Hz that does not."""
    n = int(RATE_HZ * DURATION_S)
    time_s = np.arange(n) / RATE_HZ
    turn = np.cumsum(1.0 + wander(rng, n, rms)) / RATE_HZ
    signal = 0.3 * rng.standard_normal(n)
    for frequency, clock in ((525.0, turn), (1050.0, turn), (926.0, time_s)):
        signal += 0.2 * np.sin(2 * np.pi * frequency * clock + rng.uniform(0, 2 * np.pi))
    meter = FramePowerMeter(plan_frames(RATE_HZ, n), 1)
    meter.take(signal[np.newaxis])
    lines = find_lines(average_spectrum(meter.result(), 0, "acceleration", "m/s^2"), speed_scatter=scatter)
    pairs = []
    for frequency in (525.0, 1050.0, 926.0):
        near = [line for line in lines if abs(line.frequency_hz - frequency) < 3.0]
        assert len(near) == 1, (frequency, lines)
        pairs.append((near[0].frequency_hz - frequency, near[0].frequency_error_hz))
    return pairs


@pytest.mark.parametrize("rms", [0.0003, 0.0005, 0.001])
def test_the_stated_error_covers_the_wander(rms):
    """Over 40 seeds the errors of moving lines are 0.5 to 1.6 of what is stated, fixed ones stay within 0.02 Hz."""
    rng = np.random.default_rng(8)
    pairs = np.array([found(rng, rms, rms) for _ in range(40)])
    ratio = np.sqrt(np.mean((pairs[:, :2, 0] / pairs[:, :2, 1]) ** 2))
    assert 0.5 < ratio < 1.6
    fixed = np.sqrt(np.mean(pairs[:, 2, 0] ** 2))
    assert fixed < 0.02


def test_without_wander_nothing_is_added():
    rng = np.random.default_rng(9)
    pairs = np.array([found(rng, 0.0, 0.0) for _ in range(30)])
    assert np.median(pairs[:, :, 1]) < 0.02
    assert 0.7 < np.sqrt(np.mean((pairs[:, :, 0] / pairs[:, :, 1]) ** 2)) < 1.4

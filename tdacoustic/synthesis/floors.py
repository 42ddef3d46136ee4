"""Broadband: densities from a recipe's points, and Gaussian noise that has them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tdacoustic.synthesis.recipe import ChannelRecipe

__all__ = ["coloured_noise", "delayed", "floor_density"]


def floor_density(channel: ChannelRecipe, frequency_hz: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the one-sided density of a channel's own floor, in its SI unit squared per Hz.

    Between the recipe's points the level is a straight line over log frequency, beyond them it is the last point's;
    each hump multiplies by 1 + (10^(height/10) - 1) / (1 + ((f - f0) / (width/2))²). The sensor's `gain_db` is not
    in it. At 0 Hz and below the density is zero.

    Parameters
    ----------
    channel : ChannelRecipe
    frequency_hz : ndarray
    """
    frequency = np.asarray(frequency_hz, dtype=float)
    positive = np.maximum(frequency, 1e-9)
    points = np.array(channel.floor, dtype=float)
    level = np.interp(np.log(positive), np.log(points[:, 0]), points[:, 1])
    density = channel.reference**2 * 10.0 ** (level / 10.0)
    for hump in channel.hump:
        offset = (frequency - hump.frequency_hz) / (0.5 * hump.width_hz)
        density = density * (1.0 + (10.0 ** (hump.height_db / 10.0) - 1.0) / (1.0 + offset**2))
    return np.where(frequency > 0.0, density, 0.0)


def coloured_noise(
    rng: np.random.Generator, channel: ChannelRecipe, n_samples: int, sample_rate_hz: float
) -> NDArray[np.float64]:
    """Return Gaussian noise of shape (n_samples,) whose expected density is `floor_density`.

    White noise is shaped in the frequency domain over the whole run, so the density is exact at every frequency and
    the run's end joins its beginning.
    """
    white = np.fft.rfft(rng.standard_normal(n_samples))
    frequency = np.asarray(np.fft.rfftfreq(n_samples, 1.0 / sample_rate_hz), dtype=np.float64)
    density = floor_density(channel, frequency)
    return np.fft.irfft(white * np.sqrt(0.5 * sample_rate_hz * density), n_samples)


def delayed(signal: NDArray[np.float64], sample_rate_hz: float, delay_s: float) -> NDArray[np.float64]:
    """Shift a signal by a delay, a fraction of a sample too; what leaves at the end enters at the beginning."""
    if delay_s == 0.0:
        return signal
    frequency = np.fft.rfftfreq(signal.size, 1.0 / sample_rate_hz)
    return np.fft.irfft(np.fft.rfft(signal) * np.exp(-2j * np.pi * frequency * delay_s), signal.size)

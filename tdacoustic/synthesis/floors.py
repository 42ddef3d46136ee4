"""Broadband: densities from a recipe's points, and Gaussian noise that has them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tdacoustic.synthesis.recipe import ChannelRecipe, Resonance

__all__ = ["coloured_noise", "delayed", "floor_density", "resonance_gain", "resonant"]


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


def resonance_gain(resonances: Sequence[Resonance], frequency_hz: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Return the factor of a channel's resonances, one after the other: 1 + (g - 1) j w f / (f0² - f² + j w f)."""
    factor = np.ones(np.shape(frequency_hz), dtype=np.complex128)
    for item in resonances:
        damped = 1j * item.width_hz * frequency_hz
        top = 10.0 ** (item.height_db / 20.0) - 1.0
        factor *= 1.0 + top * damped / (item.frequency_hz**2 - frequency_hz**2 + damped)
    return factor


def resonant(
    signal: NDArray[np.float64], resonances: Sequence[Resonance], sample_rate_hz: float
) -> NDArray[np.float64]:
    """Send a signal of shape (n,) through a channel's resonances; its end rings on into its beginning."""
    if not resonances:
        return signal
    frequency = np.asarray(np.fft.rfftfreq(signal.size, 1.0 / sample_rate_hz), dtype=np.float64)
    return np.fft.irfft(np.fft.rfft(signal) * resonance_gain(resonances, frequency), signal.size)


def delayed(signal: NDArray[np.float64], sample_rate_hz: float, delay_s: float) -> NDArray[np.float64]:
    """Shift a signal by a delay, a fraction of a sample too; what leaves at the end enters at the beginning."""
    if delay_s == 0.0:
        return signal
    frequency = np.fft.rfftfreq(signal.size, 1.0 / sample_rate_hz)
    return np.fft.irfft(np.fft.rfft(signal) * np.exp(-2j * np.pi * frequency * delay_s), signal.size)

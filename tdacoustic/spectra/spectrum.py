"""A spectrum with named scalings and the interval of its density."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from tdacoustic.errors import AnalysisError
from tdacoustic.spectra.frames import FramePlan
from tdacoustic.spectra.powers import SegmentPowers, hann
from tdacoustic.units import REFERENCES

__all__ = ["Scaling", "Spectrum", "average_spectrum", "effective_averages"]

Array = NDArray[np.float64]
Scaling = Literal["density", "rms"]


def effective_averages(plan: FramePlan, n_frames: int) -> float:
    """Return the number of independent averages that `n_frames` overlapping frames are worth.

    ``n / (1 + 2 sum_j (1 - j/n) rho_j²)`` with the window's autocorrelation
    rho at j hops (P. D. Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70).
    """
    if n_frames <= 1:
        return float(n_frames)
    window = hann(plan.frame_length)
    energy = float(window @ window)
    total = 1.0
    for step in range(1, n_frames):
        shift = step * plan.hop
        if shift >= plan.frame_length:
            break
        rho = float(window[shift:] @ window[:-shift]) / energy
        total += 2.0 * (1.0 - step / n_frames) * rho**2
    return n_frames / total


@dataclass(frozen=True)
class Spectrum:
    """Averaged one-sided spectrum of one channel.

    Parameters
    ----------
    frequencies_hz : ndarray, shape (n,)
    density : ndarray, shape (n,)
        Mean-square density in unit² / Hz.
    resolution_hz : float
        Line spacing.
    noise_bandwidth_hz : float
        Equivalent noise bandwidth of the window.
    averages : float
        Independent averages (see `effective_averages`).
    duration_s : float
        Length of a frame.
    quantity, si_symbol : str
    name : str

    Examples
    --------
    ``spectrum.values("rms")`` is the rms of a sinusoid at each line: exact for
    one on a line. ``spectrum.values("density")`` is exact for white noise.
    """

    frequencies_hz: Array
    density: Array
    resolution_hz: float
    noise_bandwidth_hz: float
    averages: float
    duration_s: float
    quantity: str
    si_symbol: str
    name: str = ""

    def values(self, scaling: Scaling = "density") -> Array:
        """Return the spectrum in a named scaling, shape (n,).

        Parameters
        ----------
        scaling : "density" or "rms"
            ``density``: mean-square density, unit²/Hz, for noise.
            ``rms``: rms in one noise bandwidth, unit, for sinusoids.
        """
        if scaling == "density":
            return self.density
        if scaling == "rms":
            return np.sqrt(self.density * self.noise_bandwidth_hz)
        raise AnalysisError(f"scaling must be 'density' or 'rms', got {scaling!r}")

    def levels_db(self, scaling: Scaling = "rms") -> Array:
        """Return levels, re the quantity's reference squared (per Hz for a density).

        Raises
        ------
        AnalysisError
            The quantity has no reference.
        """
        reference = REFERENCES.get(self.quantity)
        if reference is None:
            raise AnalysisError(f"{self.quantity} has no level; levels exist for {', '.join(REFERENCES)}")
        power = self.density * (self.noise_bandwidth_hz if scaling == "rms" else 1.0)
        with np.errstate(divide="ignore"):
            return np.asarray(10.0 * np.log10(power / reference**2))

    def interval(self, probability: float = 0.95) -> tuple[float, float]:
        """Return the factors between which true over estimated density lies.

        Chi-squared with ``2 * averages`` degrees of freedom; holds where the
        spectrum is smooth over one bandwidth, not for sinusoids.
        """
        freedom = 2.0 * self.averages
        tail = 0.5 * (1.0 - probability)
        return freedom / stats.chi2.ppf(1.0 - tail, freedom), freedom / stats.chi2.ppf(tail, freedom)

    def mean_square(self, from_hz: float = 0.0, to_hz: float = np.inf) -> float:
        """Return the mean square between two frequencies; lines at the edges count by their part inside."""
        edges_low = np.maximum(self.frequencies_hz - 0.5 * self.resolution_hz, 0.0)
        edges_high = np.minimum(self.frequencies_hz + 0.5 * self.resolution_hz, self.frequencies_hz[-1])
        width = np.clip(np.minimum(edges_high, to_hz) - np.maximum(edges_low, from_hz), 0.0, None)
        full = edges_high - edges_low
        part = np.divide(width, full, out=np.zeros_like(width), where=full > 0.0)
        return float(np.sum(self.density * part) * self.resolution_hz)


def average_spectrum(powers: SegmentPowers, channel: int, quantity: str, si_symbol: str, name: str = "") -> Spectrum:
    """Average a channel's segments, each by its number of frames.

    Raises
    ------
    AnalysisError
        No frame of the channel holds numbers throughout.
    """
    frames = powers.frames[channel]
    total = int(frames.sum())
    if total == 0:
        raise AnalysisError(f"channel {name!r}: no frame without missing values")
    plan = powers.plan
    density = np.zeros(plan.n_frequencies)
    for weight, segment in zip(frames, powers.density[channel], strict=True):
        if weight:
            density += np.float64(weight) * segment
    density /= total
    window = hann(plan.frame_length)
    noise_bandwidth_hz = plan.sample_rate_hz * float(np.sum(window**2)) / float(np.sum(window)) ** 2
    return Spectrum(
        frequencies_hz=np.arange(plan.n_frequencies, dtype=np.float64) * plan.resolution_hz,
        density=density,
        resolution_hz=plan.resolution_hz,
        noise_bandwidth_hz=noise_bandwidth_hz,
        averages=effective_averages(plan, total),
        duration_s=plan.frame_length / plan.sample_rate_hz,
        quantity=quantity,
        si_symbol=si_symbol,
        name=name,
    )

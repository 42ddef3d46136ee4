"""Spectra in a band with tones and colour taken out, and their correlation over lag."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import fft, ndimage

__all__ = ["LagFrame", "lag_correlation", "local_energy", "whitened"]

Array = NDArray[np.float64]

SMOOTHING_HZ: Final = 1.5
"""Width over which a power spectrum is averaged before the spectrum is divided by it: narrower than the distance of
most lines, so that a tone counts no more than the noise beside it."""
OVERSAMPLING: Final = 2
LEAKAGE: Final = 1e-6
"""Power below which, relative to the strongest, a line may be what leaks from that one: it is not raised further."""


@dataclass(frozen=True)
class LagFrame:
    """A frame of a record, the band looked at, and the lags on which a window may lie in it.

    Parameters
    ----------
    duration_s : float
    band_hz : (float, float)
    """

    duration_s: float
    band_hz: tuple[float, float]

    @property
    def first(self) -> int:
        """Lowest line of the band."""
        return max(1, int(np.ceil(self.band_hz[0] * self.duration_s)))

    @property
    def last(self) -> int:
        """Highest line of the band."""
        return int(self.band_hz[1] * self.duration_s)

    @property
    def n_lags(self) -> int:
        """Lags over the whole frame."""
        return int(fft.next_fast_len(2 * OVERSAMPLING * (self.last + 1), real=True))

    @property
    def step_s(self) -> float:
        """Distance of two lags."""
        return self.duration_s / self.n_lags


def whitened(samples: Array, n: int, frame: LagFrame, ramp: int) -> NDArray[np.complex128]:
    """Return the lines of a band, each divided by the mean magnitude around it.

    Parameters
    ----------
    samples : ndarray, shape (m,)
        Filled up with zeros to `n`.
    n : int
        Samples of the frame at the record's rate.
    frame : LagFrame
    ramp : int
        Samples over which both ends rise from zero: a sharp end is a click, and clicks correlate.
    """
    ramp = min(ramp, samples.size // 2)
    rise = np.sin(0.5 * np.pi * (np.arange(ramp) + 0.5) / max(1, ramp)) ** 2
    tapered = samples - samples.mean()
    tapered[:ramp] *= rise
    tapered[tapered.size - ramp :] *= rise[::-1]
    lines = fft.rfft(tapered, n)[frame.first : frame.last + 1]
    power = ndimage.uniform_filter1d(np.abs(lines) ** 2, max(3, round(SMOOTHING_HZ * frame.duration_s)))
    top = float(power.max(initial=0.0))
    if top <= 0.0:
        return np.zeros_like(lines)
    out: NDArray[np.complex128] = lines / np.sqrt(np.maximum(power, LEAKAGE * top))
    return out


def lag_correlation(
    window: NDArray[np.complex128], block: NDArray[np.complex128], local: Array, frame: LagFrame
) -> Array:
    """Return the correlation coefficient of a window with a block, by the lag of the window's start in the block.

    Parameters
    ----------
    window, block : ndarray, complex, shape (n_lines,)
    local : ndarray, shape (n_lags,)
        Energy of the block under a window at each lag, as `local_energy` gives it.
    frame : LagFrame
    """
    lines = np.zeros(frame.n_lags // 2 + 1, dtype=np.complex128)
    lines[frame.first : frame.last + 1] = block * np.conj(window)
    over_lag = fft.irfft(lines, frame.n_lags) * frame.n_lags
    own = 2.0 * float(np.sum(np.abs(window) ** 2))
    with np.errstate(invalid="ignore", divide="ignore"):
        found = over_lag / np.sqrt(own * local)
    return np.clip(np.where(local > 0.0, found, 0.0), -1.0, 1.0)


def local_energy(block: NDArray[np.complex128], window_s: float, frame: LagFrame) -> Array:
    """Return the energy of a whitened block under a window, by the lag of its start; same scale as a window's own."""
    lines = np.zeros(frame.n_lags // 2 + 1, dtype=np.complex128)
    lines[frame.first : frame.last + 1] = block
    over_time = fft.irfft(lines, frame.n_lags)
    width = max(1, round(window_s / frame.step_s))
    running = np.concatenate(([0.0], np.cumsum(np.concatenate((over_time**2, over_time[:width] ** 2)))))
    energy: Array = (running[width:] - running[:-width])[: frame.n_lags] * frame.n_lags
    return np.maximum(energy, 1e-9 * float(energy.max(initial=0.0)))

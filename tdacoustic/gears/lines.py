"""Spectral lines of a mesh force: harmonics of a motion that repeats, and lines of a record of one that does not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

__all__ = ["Lines", "lines_of_harmonics", "lines_of_record", "lines_of_repeat"]

WEAKEST_LINE: Final = 0.01
"""Amplitude of a line of a record over the strongest one's, below which it is left out."""

MOST_LINES: Final = 200
"""Lines of a record: the strongest; a motion without a period has a broadband part that no lines hold."""

_LOBE: Final = 3
"""Bins on both sides of a Hann window's main lobe, over which a line is the largest and its energy is gathered."""


@dataclass(frozen=True)
class Lines:
    """Sinusoids of the mesh force: F(t) = mean + Σ Re(F_n exp(i 2π f_n t)).

    Parameters
    ----------
    frequency_hz : ndarray, shape (n,)
        Above zero, ascending.
    harmonic : ndarray, shape (n,)
        Of the mesh; NaN of a line that is none of its harmonics.
    force_n : ndarray of complex, shape (n,)
        Peak amplitudes.
    """

    frequency_hz: NDArray[np.float64]
    harmonic: NDArray[np.float64]
    force_n: NDArray[np.complex128]


def lines_of_harmonics(mesh_hz: float, force_n: NDArray[np.complex128]) -> Lines:
    """Return the lines of harmonics 0, 1, ... of a complex series."""
    harmonics = np.arange(1, force_n.size, dtype=np.float64)
    return Lines(mesh_hz * harmonics, harmonics, 2.0 * force_n[1:])


def lines_of_repeat(mesh_hz: float, force_n: NDArray[np.float64]) -> Lines:
    """Return the lines of a motion that repeats after several mesh periods.

    Parameters
    ----------
    mesh_hz : float
    force_n : ndarray, shape (periods, samples)
    """
    periods, samples = force_n.shape
    series = np.fft.rfft(force_n.ravel(), norm="forward")[1 : periods * (samples // 4)]
    number = np.arange(1, series.size + 1)
    harmonic = np.where(number % periods == 0, number / periods, np.nan)
    return Lines(mesh_hz * number / periods, harmonic, 2.0 * series)


def lines_of_record(mesh_hz: float, force_n: NDArray[np.float64]) -> Lines:
    """Return the mesh harmonics and the strongest other lines of a record that does not repeat.

    Under a Hann window; a line's amplitude is from the energy in its main lobe, its phase that of the largest bin.

    Parameters
    ----------
    mesh_hz : float
    force_n : ndarray, shape (periods, samples)
    """
    periods, samples = force_n.shape
    signal = force_n.ravel() - force_n.mean()
    window = np.hanning(signal.size + 1)[:-1]
    series = np.fft.rfft(signal * window)[: periods * (samples // 4)]
    power = np.abs(series) ** 2
    padded = np.pad(power, _LOBE)
    around = np.lib.stride_tricks.sliding_window_view(padded, 2 * _LOBE + 1)
    amplitude = 2.0 * np.sqrt(around.sum(axis=1) / (signal.size * (window**2).sum()))
    is_peak = (power == around.max(axis=1)) & (amplitude >= WEAKEST_LINE * amplitude.max())
    number = np.arange(series.size)
    of_mesh = number % periods == 0
    is_peak &= np.abs(number - periods * np.round(number / periods)) > _LOBE
    others = np.flatnonzero(is_peak)
    strongest = others[np.argsort(-amplitude[others])][:MOST_LINES]
    kept = np.sort(np.concatenate([np.flatnonzero(of_mesh & (number > 0)), strongest]))
    phase = np.exp(1j * np.angle(series[kept]))
    harmonic = np.where(kept % periods == 0, kept / periods, np.nan)
    return Lines(mesh_hz * kept / periods, harmonic, amplitude[kept] * phase)

"""Delays of windows from their cross-spectra: weights by coherence, a common line first, then each window's own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from tdacoustic.clocks.windows import WindowSpectra

__all__ = ["Delays", "Stack", "cell_weights", "coherence_of", "stack_line", "window_delays", "windows_to_join"]

Array = NDArray[np.float64]

MOST_COHERENCE: Final = 0.999
SIGNIFICANT: Final = 4.0
"""Standard deviations above nothing from which on a cell's coherence counts."""
SEEN: Final = 6.0
"""The same of a window's correlation."""
CLEAR: Final = 16.0
"""The same from which on no other peak is taken for the right one; fainter windows are joined."""
FEWEST_JOINED: Final = 10
"""Joined windows that are left, at least."""
REACH_S: Final = 1.5e-3
"""How far a delay may lie from the relation that was taken out."""
LAGS_PER_PERIOD: Final = 4
NEWTON_STEPS: Final = 4
USUAL_CELLS: Final = 20.0
"""Cells that the scatter of the other windows counts for in a window's error."""
PULL: Final = 0.15
"""How much a peak at the far end of the reach has to be higher than one on the line, as part of the highest."""


@dataclass(frozen=True)
class Stack:
    """The line ``delay(t) = delay_s + slope (t - time_s)`` on which the windows' correlations sum to most.

    Parameters
    ----------
    time_s, delay_s, slope : float
    ratio : float
        The sum over that of the next peak beside it.
    """

    time_s: float
    delay_s: float
    slope: float
    ratio: float

    def at(self, times_s: Array) -> Array:
        """Return the delays on the line."""
        return self.delay_s + self.slope * (times_s - self.time_s)


@dataclass(frozen=True)
class Delays:
    """Delays of the windows that tell one.

    Parameters
    ----------
    times_s, delays_s, errors_s : ndarray, shape (n,)
    """

    times_s: Array
    delays_s: Array
    errors_s: Array


def coherence_of(spectra: WindowSpectra) -> Array:
    """Return the magnitude-squared coherence of each cell, over all windows, its bias taken off."""
    used = np.any(spectra.cross != 0.0, axis=1)
    mean: Array = np.mean(np.abs(spectra.cross[used]) ** 2, axis=0)
    bias = 1.0 / spectra.lines_per_cell
    return np.clip((mean - bias) / (1.0 - bias), 0.0, MOST_COHERENCE)


def cell_weights(spectra: WindowSpectra) -> Array:
    """Return the weight of each cell's cosine, after Hannan and Thomson; zero where the coherence may be none."""
    used = int(np.count_nonzero(np.any(spectra.cross != 0.0, axis=1)))
    squared = coherence_of(spectra)
    least = SIGNIFICANT / (spectra.lines_per_cell * np.sqrt(max(1, used)))
    return np.where(squared > least, np.sqrt(squared) / (1.0 - squared), 0.0)


def _over_lag(spectra: WindowSpectra, weights: Array, sign: float, reach_s: float) -> tuple[Array, Array]:
    """Weighted correlation of each window over lags, shape (n_windows, n_lags), and the lags."""
    spacing = float(spectra.frequencies_hz[1] - spectra.frequencies_hz[0])
    top = float(spectra.frequencies_hz[np.flatnonzero(weights)[-1]])
    n = int(fft.next_fast_len(int(LAGS_PER_PERIOD * top / spacing) + 1))
    reach_s = min(reach_s, 0.45 / spacing)
    step = 1.0 / (n * spacing)
    half = max(2, int(reach_s / step))
    turned = np.zeros((spectra.cross.shape[0], n), dtype=np.complex128)
    used = min(n, weights.size)
    turned[:, :used] = sign * (spectra.cross * weights)[:, :used]
    lags: NDArray[Any] = np.arange(-half, half + 1)
    found = fft.ifft(turned, axis=1)[:, lags] * n
    carrier = np.exp(2j * np.pi * spectra.frequencies_hz[0] * lags * step)
    return np.real(found * carrier), lags * step


def stack_line(spectra: WindowSpectra, weights: Array, sign: float, reach_s: float = REACH_S) -> Stack:
    """Return the line of most correlation.

    Parameters
    ----------
    spectra : WindowSpectra
    weights : ndarray, shape (n_cells,)
    sign : float
    reach_s : float
    """
    over_lag, lags = _over_lag(spectra, weights, sign, reach_s)
    times = spectra.times_s
    middle = float(times.mean())
    half_length = max(1e-9, 0.5 * float(np.ptp(times)))
    n_lags, half = lags.size, lags.size // 2
    best = (-np.inf, 0, 0)
    sums = []
    for shift in range(-half, half + 1):
        moved = np.round(shift * (times - middle) / half_length).astype(int)
        place = np.arange(n_lags)[None, :] + moved[:, None]
        inside = (place >= 0) & (place < n_lags)
        rows = np.take_along_axis(over_lag, np.clip(place, 0, n_lags - 1), axis=1)
        total = np.where(inside, rows, 0.0).sum(axis=0)
        sums.append(total)
        if total.max() > best[0]:
            best = (float(total.max()), shift, int(total.argmax()))
    top, shift, place_of = best
    step = float(lags[1] - lags[0])
    return Stack(middle, float(lags[place_of]), shift * step / half_length, _ratio(sums[shift + half], place_of, top))


def _ratio(total: Array, place: int, top: float) -> float:
    """Highest value over that of the next local maximum."""
    inner = total[1:-1]
    peaks = np.flatnonzero((inner >= total[:-2]) & (inner > total[2:])) + 1
    others = total[peaks[np.abs(peaks - place) > 1]]
    runner_up = float(others.max(initial=0.0))
    return top / runner_up if runner_up > 0.0 else np.inf


def window_delays(spectra: WindowSpectra, weights: Array, sign: float, line: Stack, reach_s: float = REACH_S) -> Delays:
    """Return each window's delay and its standard error, where its correlation stands out.

    Parameters
    ----------
    spectra : WindowSpectra
    weights : ndarray, shape (n_cells,)
    sign : float
    line : Stack
        Near which the delays are.
    reach_s : float
    """
    over_lag, lags = _over_lag(spectra, weights, sign, reach_s)
    away = (lags[None, :] - line.at(spectra.times_s)[:, None]) / lags[-1]
    top = over_lag.max(axis=1, keepdims=True)
    start = lags[np.argmax(over_lag - PULL * top * away**2, axis=1)]
    delays, errors = _refined(spectra, weights, sign, start)
    seen = (over_lag.max(axis=1) > SEEN * _floor(spectra, weights)) & np.isfinite(errors) & (errors > 0.0)
    rows = np.flatnonzero(seen)
    return Delays(spectra.times_s[rows], delays[rows], errors[rows])


def _floor(spectra: WindowSpectra, weights: Array) -> float:
    """Standard deviation of a window's weighted correlation where nothing is shared."""
    return float(np.sqrt(np.sum(weights**2) / (2.0 * spectra.lines_per_cell)))


def windows_to_join(spectra: WindowSpectra, weights: Array, sign: float, line: Stack) -> int:
    """Return how many neighbouring windows have to be joined for a delay to stand well clear of chance."""
    turned = np.exp(2j * np.pi * spectra.frequencies_hz * line.at(spectra.times_s)[:, None])
    height = float(np.median(np.real(sign * spectra.cross * turned) @ weights)) / _floor(spectra, weights)
    most = max(1, spectra.times_s.size // FEWEST_JOINED)
    return int(np.clip(np.ceil((CLEAR / max(height, 1e-3)) ** 2), 1, most))


def _refined(spectra: WindowSpectra, weights: Array, sign: float, start: Array) -> tuple[Array, Array]:
    """Newton's steps on the weighted cosine, and the scatter of what is left as standard error."""
    used = weights > 0.0
    omega = 2.0 * np.pi * spectra.frequencies_hz[used]
    cross = sign * spectra.cross[:, used] * weights[used]
    delays = start.copy()
    largest = 0.25 * 2.0 * np.pi / omega[-1]
    for _ in range(NEWTON_STEPS):
        turned = cross * np.exp(1j * omega * delays[:, None])
        slope = turned.imag @ omega
        bend = np.sum(turned.real * omega**2, axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            step = np.where(bend > 0.0, slope / bend, 0.0)
        delays -= np.clip(step, -largest, largest)
    turned = cross * np.exp(1j * omega * delays[:, None])
    bend = np.sum(turned.real * omega**2, axis=1)
    spread = np.sum((turned.imag * omega) ** 2, axis=1)
    share = np.sum(np.abs(cross) * omega**2, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        cells = share**2 / np.sum((np.abs(cross) * omega**2) ** 2, axis=1)
        squared = spread * cells / np.maximum(cells - 1.0, 0.5) / bend**2
    squared = np.where((bend > 0.0) & np.isfinite(squared), squared, np.nan)
    if np.isnan(squared).all():
        return delays, squared
    # the scatter of a few cells is itself uncertain: it is held against that of all windows, or the windows that
    # happen to show little would count too much
    usual = float(np.nanmedian(squared))
    return delays, np.sqrt((cells * squared + USUAL_CELLS * usual) / (cells + USUAL_CELLS))

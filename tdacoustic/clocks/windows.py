"""Cross-spectra of many short windows along two records that are aligned within a millisecond or so."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import fft, signal

from tdacoustic.clocks.records import SharedRecord, own_span, windows_of
from tdacoustic.clocks.relation import Relation

__all__ = ["WindowSpectra", "overlap_of", "window_spectra"]

Array = NDArray[np.float64]

LINES_PER_CELL: Final = 32
"""Lines of a window's spectrum that are averaged: a cell is narrow against the inverse of the delays that are left."""
WINDOW_S: Final = 1.28
"""Length of a window; shorter where the overlap is."""
LEAST_WINDOWS: Final = 24
MOST_WINDOWS: Final = 1024
TAPER: Final = 0.5
RATE_PART: Final = 0.46
"""Of the lower sampling rate, up to which lines are used."""
LOWEST_LINE: Final = 4
LEAKAGE: Final = 1e-7
"""Power of a line, relative to the window's strongest, below which it may be what the taper leaks from that one."""


@dataclass(frozen=True)
class WindowSpectra:
    """Normalised cross-spectra, with the delays that a relation states taken out.

    Parameters
    ----------
    times_s : ndarray, shape (n_windows,)
        Middles in the reference's time.
    frequencies_hz : ndarray, shape (n_cells,)
        By the reference's clock.
    cross : ndarray, complex, shape (n_windows, n_cells)
        Cross-spectrum over the root of both powers; the other record's delay d turns it by ``exp(-2j pi f d)``.
        Zero where a window is silent.
    lines_per_cell : float
        Independent values that were averaged.
    shape : ndarray
        How the cross-power of each cell spreads over its lines, mean over the windows.
    """

    times_s: Array
    frequencies_hz: Array
    cross: NDArray[np.complex128]
    lines_per_cell: float = float(LINES_PER_CELL)
    shape: Array = field(default_factory=lambda: np.zeros(0))

    def repetition(self, coherence: Array, longest_s: float) -> tuple[float, float]:
        """Return how much the coherent part repeats itself, 0 to 1, and after which time.

        Parameters
        ----------
        coherence : ndarray, shape (n_cells,)
        longest_s : float
            Times looked at; no more than a third of a window.
        """
        spacing = float(self.frequencies_hz[1] - self.frequencies_hz[0]) / LINES_PER_CELL
        power = np.concatenate((np.zeros(LOWEST_LINE), self.shape * np.repeat(coherence, LINES_PER_CELL)))
        n = 4 * power.size
        over_lag = fft.irfft(power, n)
        lags = np.arange(n // 2) / (n * spacing)
        taper = np.interp(lags, *_taper_correlation(1.0 / spacing))
        held = np.abs(over_lag[: n // 2]) / (over_lag[0] * np.maximum(taper, 0.2))
        # the main lobe ends where the correlation has first fallen low
        low = np.flatnonzero(held < 0.3)
        last = int(np.searchsorted(lags, min(longest_s, 1.0 / (3.0 * spacing))))
        if low.size == 0 or low[0] >= last:
            return 0.0, 0.0
        place = int(low[0]) + int(np.argmax(held[low[0] : last]))
        return float(held[place]), float(lags[place])

    def joined(self, number: int, delays_s: Array) -> WindowSpectra:
        """Return the means of `number` neighbouring windows each, with delays of the windows taken out first."""
        turned = self.cross * np.exp(2j * np.pi * self.frequencies_hz * delays_s[:, None])
        parts = np.array_split(np.arange(self.times_s.size), max(1, self.times_s.size // number))
        return WindowSpectra(
            np.array([self.times_s[part].mean() for part in parts]),
            self.frequencies_hz,
            np.array([turned[part].mean(axis=0) for part in parts]),
            self.lines_per_cell * number,
        )


def overlap_of(reference: SharedRecord, other: SharedRecord, relation: Relation) -> tuple[float, float]:
    """Return from when to when both records run, in the reference's time; the end may be before the start."""
    first, last = own_span(reference)
    own = own_span(other)
    return max(first, float(relation.to_reference(own[0]))), min(last, float(relation.to_reference(own[1])))


def window_spectra(reference: SharedRecord, other: SharedRecord, relation: Relation) -> WindowSpectra | None:
    """Return the cross-spectra of windows along the overlap, in one pass over both records; None of no overlap.

    Parameters
    ----------
    reference, other : SharedRecord
    relation : Relation
    """
    begin_s, end_s = overlap_of(reference, other, relation)
    window_s = min(WINDOW_S, (end_s - begin_s) / LEAST_WINDOWS)
    rate = reference.sample_rate_hz
    n_reference = int(fft.next_fast_len(max(1, int(window_s * rate)), real=True))
    other_rate = other.sample_rate_hz * (1.0 + relation.drift)
    n_other = round(n_reference / rate * other_rate)
    n_lines = int(RATE_PART * min(n_reference, n_other))
    n_cells = n_lines // LINES_PER_CELL
    if n_cells < 2:
        return None
    starts, other_starts = _starts(reference, other, relation, n_reference, n_other)
    if starts.size == 0:
        return None
    used = n_cells * LINES_PER_CELL
    lines = np.arange(LOWEST_LINE, LOWEST_LINE + used)
    frequencies = lines * (rate / n_reference)
    tapers = signal.windows.tukey(n_reference, TAPER), signal.windows.tukey(n_other, TAPER)
    cross = np.zeros((starts.size, n_cells), dtype=np.complex128)
    pairs = zip(windows_of(reference, starts, n_reference), windows_of(other, other_starts, n_other), strict=True)
    middles: NDArray[Any] = (starts + 0.5 * n_reference) / rate + reference.start_s
    own_middles = (other_starts + 0.5 * n_other) / other.sample_rate_hz + other.start_s
    late = np.asarray(relation.to_reference(own_middles)) - middles
    shape = np.zeros(used)
    for index, (one, two) in enumerate(pairs):
        first = fft.rfft(tapers[0] * (one - one.mean()))[lines]
        second = fft.rfft(tapers[1] * (two - two.mean()))[lines]
        if not (np.any(first) and np.any(second)):
            continue
        # each window's phase counts from its own start; the middles lie `late` apart on the reference's axis
        product = second * np.conj(first) * np.exp(-2j * np.pi * frequencies * late[index])
        shape += _shape(product)
        power = _power(first) * _power(second)
        with np.errstate(invalid="ignore", divide="ignore"):
            cross[index] = np.where(power > 0.0, _cells(product) / np.sqrt(power), 0.0)
    return WindowSpectra(middles, _cells(frequencies) / LINES_PER_CELL, cross, shape=shape)


def _shape(product: NDArray[np.complex128]) -> Array:
    """Cross-power of the lines over that of their cell."""
    power = np.abs(product).reshape(-1, LINES_PER_CELL)
    total = power.sum(axis=1, keepdims=True)
    return np.asarray(np.divide(power, total, out=np.zeros_like(power), where=total > 0.0).ravel())


def _taper_correlation(window_s: float) -> tuple[Array, Array]:
    """Lags, and how far a taper that is moved by them still covers itself."""
    taper = signal.windows.tukey(512, TAPER)
    own = np.correlate(taper, taper, "full")[511:]
    return np.arange(512) * window_s / 512, own / own[0]


def _power(lines: NDArray[np.complex128]) -> Array:
    """Power of the cells, what may have leaked from the strongest line added: it then shows no coherence."""
    power = np.abs(lines) ** 2
    return np.asarray(_cells(power) + LEAKAGE * LINES_PER_CELL * power.max())


def _cells(lines: NDArray[Any]) -> NDArray[Any]:
    return lines.reshape(-1, LINES_PER_CELL).sum(axis=1)


def _starts(
    reference: SharedRecord, other: SharedRecord, relation: Relation, n_reference: int, n_other: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First samples of the windows in both records."""
    begin_s, end_s = overlap_of(reference, other, relation)
    rate = reference.sample_rate_hz
    first = max(0, int(np.ceil((begin_s - reference.start_s) * rate)))
    last = min(reference.n_samples, int((end_s - reference.start_s) * rate)) - n_reference
    if last < first:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    count = min(MOST_WINDOWS, 1 + (last - first) // n_reference)
    starts = first + np.round(np.linspace(0, last - first, count)).astype(np.int64)
    middles_s = reference.start_s + (starts + 0.5 * n_reference) / rate
    own_s = np.asarray(relation.to_own(middles_s)) - other.start_s
    own = np.round(own_s * other.sample_rate_hz - 0.5 * n_other).astype(np.int64)
    inside = (own >= 0) & (own + n_other <= other.n_samples)
    return starts[inside], own[inside]

"""Overlapping frames over the angle (or time), their transforms, and the rows of a map that they belong to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Literal, Protocol

import numpy as np
import scipy.fft
from numpy.typing import ArrayLike, NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.orders.resampling import EvenBlock

__all__ = [
    "EachFrame",
    "FrameReader",
    "FrameTransforms",
    "Frames",
    "LineFrames",
    "Rows",
    "SpeedRows",
    "TimeRows",
    "WindowName",
    "plan_line_frames",
]

Array = NDArray[np.float64]
WindowName = Literal["hann", "flattop"]

COSINES: Final[dict[str, tuple[float, ...]]] = {
    "hann": (0.5, 0.5),
    "flattop": (0.21557895, 0.41663158, 0.277263158, 0.083578947, 0.006947368),
}
"""Terms of the windows; flat-top: the five of G. D'Antona and A. Ferrero, *Digital Signal Processing for Measurement
Systems* (2006), which MATLAB and SciPy use too."""
BATCH_VALUES: Final = 1 << 21
"""Complex values that are transformed at once at most: 32 MiB."""


@dataclass(frozen=True)
class LineFrames:
    """Frames of equal length over an even axis.

    Parameters
    ----------
    per_unit : float
        Samples per turn (lines are orders), or per second (lines are frequencies).
    length, hop : int
        In samples.
    window : {"hann", "flattop"}
        Hann for everything; flat-top where a line's level must not depend on where it falls between two.
    requested_resolution : float
        Line spacing that was asked for; the actual one is `resolution`.
    """

    per_unit: float
    length: int
    hop: int
    window: WindowName
    requested_resolution: float

    @property
    def resolution(self) -> float:
        """Line spacing in orders, or Hz."""
        return self.per_unit / self.length

    @property
    def n_lines(self) -> int:
        """Lines from 0 to half the density of the samples."""
        return self.length // 2 + 1

    @property
    def window_values(self) -> Array:
        """The window, periodic, shape (length,)."""
        return _window(self.window, self.length)

    @property
    def noise_lines(self) -> float:
        """Equivalent noise bandwidth of the window, in lines: 1.5 for Hann, 3.77 for flat-top."""
        terms = COSINES[self.window]
        return float(1.0 + 0.5 * sum(term**2 for term in terms[1:]) / terms[0] ** 2)

    @property
    def main_lobe_lines(self) -> float:
        """Half width of the window's main lobe, in lines."""
        return float(len(COSINES[self.window]))

    def independent(self, n_frames: ArrayLike) -> Array:
        """Return how many independent averages numbers of consecutive frames are worth, at least 1 where there is one.

        ``n / (1 + 2 Σ (1 - j/n) rho_j²)`` with the window's autocorrelation rho at j hops (P. D. Welch, IEEE Trans.
        Audio Electroacoust. 15 (1967) 70).
        """
        counts = np.maximum(np.asarray(n_frames, dtype=np.float64), 1.0)
        total = np.ones(counts.shape)
        for step, rho in enumerate(_autocorrelation(self.window, self.length, self.hop), start=1):
            total += 2.0 * np.clip(1.0 - step / counts, 0.0, None) * rho**2
        return np.where(np.asarray(n_frames) > 0, np.maximum(counts / total, 1.0), 0.0)

    def line_transform(self, offsets: ArrayLike) -> NDArray[np.complex128]:
        """Return what a line of rms 1 and phase 0 at a frame's start gives at so many lines above it, same shape."""
        terms, at = COSINES[self.window], np.asarray(offsets, dtype=np.float64)
        values = terms[0] * self._even_sum(at)
        for k, term in enumerate(terms[1:], start=1):
            values = values + 0.5 * (-1) ** k * term * (self._even_sum(at - k) + self._even_sum(at + k))
        return np.asarray(values / terms[0])

    def _even_sum(self, offsets: Array) -> NDArray[np.complex128]:
        """Mean of exp(-2πi d n / N) over the N samples of a frame."""
        turn = np.exp(-2j * np.pi * offsets / self.length)
        whole = np.abs(turn - 1.0) < 1e-12
        with np.errstate(invalid="ignore", divide="ignore"):
            mean = (1.0 - np.exp(-2j * np.pi * offsets)) / (self.length * (1.0 - turn))
        return np.asarray(np.where(whole, 1.0, mean))


@lru_cache(maxsize=16)
def _window(name: WindowName, length: int) -> Array:
    angle = 2.0 * np.pi * np.arange(length) / length
    values = np.asarray(sum((-1) ** k * term * np.cos(k * angle) for k, term in enumerate(COSINES[name])))
    values.setflags(write=False)
    return values


@lru_cache(maxsize=16)
def _autocorrelation(name: WindowName, length: int, hop: int) -> tuple[float, ...]:
    """Of a window at 1, 2, ... hops, over that at none."""
    window = _window(name, length)
    steps = range(hop, length, hop)
    return tuple(float(window[step:] @ window[:-step]) / float(window @ window) for step in steps)


def plan_line_frames(
    per_unit: float, resolution: float, window: WindowName = "hann", overlap: float = 0.75
) -> LineFrames:
    """Choose frames for a line spacing, as near below it as a quick transform length allows.

    Parameters
    ----------
    per_unit : float
        Samples per turn, or per second.
    resolution : float
        Line spacing asked for, in orders or Hz.
    window : {"hann", "flattop"}
    overlap : float
        Fraction of a frame shared with the next, 0 <= overlap < 1.

    Raises
    ------
    AnalysisError
        Settings out of range.

    Examples
    --------
    >>> frames = plan_line_frames(250.0, 0.1)
    >>> frames.length, frames.resolution, frames.noise_lines
    (2500, 0.1, 1.5)
    """
    if window not in COSINES:
        raise AnalysisError(f"window must be one of {', '.join(COSINES)}, got {window!r}")
    if not 0.0 <= overlap < 1.0:
        raise AnalysisError(f"overlap must be in [0, 1), got {overlap}")
    if not 0.0 < resolution <= per_unit / 16.0:
        raise AnalysisError(f"resolution must be > 0 and at most a 16th of {per_unit:g}, got {resolution}")
    length = math.ceil(per_unit / resolution - 1e-9)
    length = int(scipy.fft.next_fast_len(length + length % 2, real=True))
    while length % 2:
        length = int(scipy.fft.next_fast_len(length + 1, real=True))
    return LineFrames(per_unit, length, max(1, round(length * (1.0 - overlap))), window, resolution)


@dataclass(frozen=True)
class FrameTransforms:
    """Transforms of consecutive frames.

    Parameters
    ----------
    plan : LineFrames
    first : int
        Number of the first frame.
    starts : ndarray, shape (n_frames,)
        Where each frame begins, in turns (or seconds).
    times_s, speeds_hz : ndarray, shape (n_frames,)
        Middle, and mean speed; NaN where it is not known.
    fastest_hz : ndarray, shape (n_frames,)
    lines : ndarray of complex, shape (n_frames, n_channels, n_lines)
        Scaled so that a line's magnitude is its rms; the phase is that of a cosine at the frame's start. NaN where a
        frame held samples that are no numbers.
    """

    plan: LineFrames
    first: int
    starts: Array
    times_s: Array
    speeds_hz: Array
    fastest_hz: Array
    lines: NDArray[np.complex128]


class FrameReader(Protocol):
    """Takes the transforms of frames, in order."""

    def take(self, frames: FrameTransforms) -> None:
        """Add frames."""


class Frames:
    """Cuts blocks of even samples into frames, transforms them and hands them to readers.

    Parameters
    ----------
    plan : LineFrames
    readers : sequence of FrameReader
    """

    def __init__(self, plan: LineFrames, readers: Sequence[FrameReader]) -> None:
        self.plan, self._readers = plan, tuple(readers)
        self._window = plan.window_values * (math.sqrt(2.0) / plan.window_values.sum())
        self._pending: EvenBlock | None = None
        self._count = 0

    def take(self, block: EvenBlock) -> None:
        """Add samples, in order."""
        if not block.times_s.size:
            return
        joined = block if self._pending is None else _joined(self._pending, block)
        plan, size = self.plan, joined.times_s.size
        n_frames = max(0, (size - plan.length) // plan.hop + 1) if size >= plan.length else 0
        batch = max(1, BATCH_VALUES // (joined.values.shape[0] * plan.length))
        for begin in range(0, n_frames, batch):
            self._transform(joined, begin * plan.hop, min(batch, n_frames - begin))
        self._pending = _after(joined, n_frames * plan.hop)

    def _transform(self, joined: EvenBlock, offset: int, count: int) -> None:
        plan = self.plan
        span = slice(offset, offset + (count - 1) * plan.hop + plan.length)

        def framed(values: Array) -> Array:
            windows = np.lib.stride_tricks.sliding_window_view(values[..., span], plan.length, axis=-1)
            return windows[..., :: plan.hop, :]

        with np.errstate(invalid="ignore"):
            values = framed(joined.values) * self._window
            lines = scipy.fft.rfft(values, axis=-1, overwrite_x=True)
            lines[..., [0, -1]] *= math.sqrt(0.5)
        probes = np.linspace(0, plan.length - 1, 9).astype(int)
        speeds, times = framed(joined.speeds_hz)[:, probes], framed(joined.times_s)
        frames = FrameTransforms(
            plan=plan,
            first=self._count,
            starts=(joined.first + offset + np.arange(count) * plan.hop) / plan.per_unit,
            times_s=0.5 * (times[:, 0] + times[:, -1]),
            speeds_hz=speeds.mean(axis=1),
            fastest_hz=speeds.max(axis=1),
            lines=np.moveaxis(lines, 0, 1),
        )
        self._count += count
        for reader in self._readers:
            reader.take(frames)


def _joined(held: EvenBlock, block: EvenBlock) -> EvenBlock:
    if block.first != held.first + held.times_s.size:
        last = held.first + held.times_s.size - 1
        raise AnalysisError(f"sample {block.first} follows sample {last}: blocks are not in order")
    return EvenBlock(
        held.first,
        held.per_unit,
        np.concatenate((held.values, block.values), axis=1),
        np.concatenate((held.times_s, block.times_s)),
        np.concatenate((held.speeds_hz, block.speeds_hz)),
    )


def _after(block: EvenBlock, offset: int) -> EvenBlock:
    return EvenBlock(
        block.first + offset,
        block.per_unit,
        block.values[:, offset:].copy(),
        block.times_s[offset:].copy(),
        block.speeds_hz[offset:].copy(),
    )


@dataclass(frozen=True)
class SpeedRows:
    """Frames gathered by their mean speed.

    Parameters
    ----------
    edges_hz : tuple of float
        Of the classes, increasing; frames beside them, and of unknown speed, are left out.
    """

    edges_hz: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.edges_hz) < 2 or np.any(np.diff(self.edges_hz) <= 0.0):
            raise AnalysisError(f"edges of speed classes must increase, got {self.edges_hz}")

    @classmethod
    def even(cls, lowest_hz: float, highest_hz: float, count: int) -> SpeedRows:
        """Return so many classes of equal width."""
        return cls(tuple(np.linspace(lowest_hz, highest_hz, count + 1).tolist()))

    @property
    def count(self) -> int:
        """Number of rows."""
        return len(self.edges_hz) - 1

    def row_of(self, frames: FrameTransforms) -> NDArray[np.intp]:
        """Return the row of each frame, -1 where it has none."""
        row = np.searchsorted(self.edges_hz, frames.speeds_hz, side="right") - 1
        outside = ~np.isfinite(frames.speeds_hz) | (row < 0) | (row >= self.count)
        return np.where(outside, -1, row)


@dataclass(frozen=True)
class TimeRows:
    """Frames gathered by the instant of their middle, in even steps of time.

    Parameters
    ----------
    start_s, step_s : float
    count : int
    """

    start_s: float
    step_s: float
    count: int

    def row_of(self, frames: FrameTransforms) -> NDArray[np.intp]:
        """Return the row of each frame, -1 where it has none."""
        row = np.floor((frames.times_s - self.start_s) / self.step_s).astype(np.intp)
        return np.where((row < 0) | (row >= self.count), -1, row)


@dataclass(frozen=True)
class EachFrame:
    """Each frame a row of its own.

    Parameters
    ----------
    count : int
        Frames at most, so that memory is bounded; those beyond are left out.
    """

    count: int = 4096

    def row_of(self, frames: FrameTransforms) -> NDArray[np.intp]:
        """Return the row of each frame, -1 where it has none."""
        row = frames.first + np.arange(frames.starts.size)
        return np.where(row >= self.count, -1, row)


Rows = SpeedRows | TimeRows | EachFrame

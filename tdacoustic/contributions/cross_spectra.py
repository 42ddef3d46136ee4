"""Cross-spectral matrices of references and receivers: one pass over the samples, kept segment by segment.

Between references and receivers phase counts, so all channels have to be sampled by one clock: one log, one rate, one
start. Channels of several rasters are refused, they are not resampled.

Frames have to be long against the delay from a reference to a receiver: a delay of x frames takes the path's power down
by rho(x)², rho the window's autocorrelation (Hann: 0.1 dB at x = 0.04, 0.4 dB at 0.08), and it shows as residual. At
4 Hz a frame is 250 ms; sound takes 12 ms for 4 m.

Memory does not depend on the record's length: lines above `max_frequency_hz` are dropped, and the number of segments is
what `SEGMENT_BYTES` allows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from tdacoustic.contributions.matrices import CrossMatrices
from tdacoustic.errors import AnalysisError
from tdacoustic.recording import Recording
from tdacoustic.spectra import FramePlan, plan_frames
from tdacoustic.spectra.powers import hann
from tdacoustic.spectra.spectrum import effective_averages

__all__ = ["CrossPlan", "CrossSpectra", "CrossSpectrumMeter", "measure_cross_spectra", "plan_cross_spectra"]

Array = NDArray[np.float64]

SEGMENT_BYTES: Final = 256 * 2**20
"""Memory that the matrices of all segments may take."""
MIN_SEGMENTS: Final = 8
"""Fewer say nothing of their own scatter."""
MAX_SEGMENTS: Final = 64
BATCH: Final = 8
"""Frames multiplied together."""
BLOCK_BYTES: Final = 8 * 2**20
DEAD: Final = 1e-20
"""Mean square without the mean, over the square of the mean: below it a channel is a constant to rounding."""


@dataclass(frozen=True)
class CrossPlan:
    """Frames, lines and segments of a cross-spectral measurement.

    Parameters
    ----------
    frames : FramePlan
    n_lines : int
        Lines kept, from 0 Hz on.
    n_references, n_receivers : int
    """

    frames: FramePlan
    n_lines: int
    n_references: int
    n_receivers: int

    @property
    def frequencies_hz(self) -> Array:
        """Lines, shape (n_lines,)."""
        return np.arange(self.n_lines, dtype=np.float64) * self.frames.resolution_hz

    @property
    def segment_times_s(self) -> Array:
        """Middle of each segment after the record's start, shape (n_segments,)."""
        frames = self.frames
        number = np.arange(frames.n_frames)
        segment = number * frames.n_segments // frames.n_frames
        middle = (number * frames.hop + 0.5 * frames.frame_length) / frames.sample_rate_hz
        return np.bincount(segment, weights=middle) / np.bincount(segment)

    @property
    def segment_bytes(self) -> int:
        """Memory of one segment's matrices."""
        return _segment_bytes(self.n_lines, self.n_references, self.n_receivers)


def _segment_bytes(n_lines: int, n_references: int, n_receivers: int) -> int:
    return n_lines * (8 * n_references * (n_references + n_receivers) + 4 * n_receivers)


def plan_cross_spectra(
    sample_rate_hz: float,
    n_samples: int,
    n_references: int,
    n_receivers: int,
    resolution_hz: float = 4.0,
    overlap: float = 0.5,
    max_frequency_hz: float = np.inf,
    max_segments: int = MAX_SEGMENTS,
) -> CrossPlan:
    """Choose frames, lines and segments so that the matrices stay within `SEGMENT_BYTES`.

    Parameters
    ----------
    sample_rate_hz : float
    n_samples : int
    n_references, n_receivers : int
        At least one of each.
    resolution_hz, overlap : float
        See `tdacoustic.spectra.plan_frames`.
    max_frequency_hz : float
        Lines above are dropped.
    max_segments : int
        Segments at most.

    Raises
    ------
    AnalysisError
        No reference or receiver, a record too short, or more lines and channels than memory for 8 segments.

    Examples
    --------
    >>> plan = plan_cross_spectra(51200.0, 51200 * 60, 6, 2, max_frequency_hz=5000.0)
    >>> plan.n_lines, plan.frames.n_segments, plan.segment_bytes // 1000
    (1251, 64, 490)
    """
    if n_references < 1 or n_receivers < 1:
        raise AnalysisError(f"cross spectra take a reference and a receiver, got {n_references} and {n_receivers}")
    if not max_frequency_hz > 0.0:
        raise AnalysisError(f"max_frequency_hz must be > 0, got {max_frequency_hz}")
    frames = plan_frames(sample_rate_hz, n_samples, resolution_hz, overlap, max_segments=max_segments)
    n_lines = frames.n_frequencies
    if max_frequency_hz < frames.resolution_hz * (n_lines - 1):
        n_lines = max(3, int(max_frequency_hz / frames.resolution_hz) + 1)
    room = SEGMENT_BYTES // _segment_bytes(n_lines, n_references, n_receivers)
    if room < min(MIN_SEGMENTS, frames.n_frames):
        raise AnalysisError(
            f"{n_lines} lines of {n_references} references and {n_receivers} receivers leave memory for {room} of "
            f"{MIN_SEGMENTS} segments; take a lower max_frequency_hz, a coarser resolution_hz or fewer channels"
        )
    frames = replace(frames, n_segments=min(frames.n_segments, room))
    return CrossPlan(frames, n_lines, n_references, n_receivers)


@dataclass(frozen=True)
class CrossSpectra:
    """Cross-spectral densities of a record's segments.

    ``density[s, i, j]`` is the mean of ``X_i conj(X_j)``, one-sided, per Hz; Hann window, mean of each frame removed.

    Parameters
    ----------
    plan : CrossPlan
    references, receivers : tuple of str
    density : ndarray of complex64, shape (n_segments, n_references, n_references + n_receivers, n_lines)
        Each reference against all references, then all receivers.
    receiver_density : ndarray of float32, shape (n_segments, n_receivers, n_lines)
    frames : ndarray of int, shape (n_segments,)
        Frames averaged.
    frames_lost : tuple of (str, int)
        Channels with samples that are no numbers, and in how many frames: such a frame counts for no channel.
    dead : tuple of str
        Channels that are a constant.
    """

    plan: CrossPlan
    references: tuple[str, ...]
    receivers: tuple[str, ...]
    density: NDArray[np.complex64]
    receiver_density: NDArray[np.float32]
    frames: NDArray[np.int64]
    frames_lost: tuple[tuple[str, int], ...] = ()
    dead: tuple[str, ...] = ()

    @property
    def frequencies_hz(self) -> Array:
        """Lines, shape (n_lines,)."""
        return self.plan.frequencies_hz

    @property
    def averages(self) -> float:
        """Independent averages of all segments together."""
        return effective_averages(self.plan.frames, int(self.frames.sum()))

    @property
    def segment_times_s(self) -> Array:
        """Middle of each segment after the record's start, shape (n_segments,) of the plan."""
        return self.plan.segment_times_s

    def select(self, segments: NDArray[np.bool_] | Sequence[int]) -> CrossSpectra:
        """Return the spectra of some segments alone, as those of one speed of a run-up.

        Raises
        ------
        AnalysisError
            None of them holds a frame.
        """
        chosen = np.asarray(segments)
        frames = self.frames[chosen]
        if not frames.sum():
            raise AnalysisError("none of the chosen segments holds a frame without missing values")
        return replace(
            self, density=self.density[chosen], receiver_density=self.receiver_density[chosen], frames=frames
        )

    def mean(self) -> CrossMatrices:
        """Return the mean over the segments, each by its frames."""
        weights = self.frames / self.frames.sum()
        q = len(self.references)
        rows = np.einsum("s,sijf->fij", weights, self.density, dtype=np.complex128)
        autos = np.einsum("s,sjf->fj", weights, self.receiver_density, dtype=np.float64)
        return CrossMatrices(
            self.frequencies_hz, self.references, self.receivers, rows[..., :q], rows[..., q:], autos, self.averages
        )


class CrossSpectrumMeter:
    """Takes blocks of samples and gathers cross spectra of overlapping frames.

    Parameters
    ----------
    plan : CrossPlan
    references, receivers : sequence of str
        Names, in the order of a block's channels: references first.
    """

    def __init__(self, plan: CrossPlan, references: Sequence[str], receivers: Sequence[str]) -> None:
        if (len(references), len(receivers)) != (plan.n_references, plan.n_receivers):
            raise AnalysisError(
                f"the plan is of {plan.n_references} references and {plan.n_receivers} receivers, "
                f"got {len(references)} and {len(receivers)}"
            )
        names = (*references, *receivers)
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise AnalysisError(f"channel {twice[0]!r} is named twice among references and receivers")
        self.plan = plan
        self._references, self._receivers, self._names = tuple(references), tuple(receivers), names
        q, n, frames = plan.n_references, len(names), plan.frames
        self._density = np.zeros((frames.n_segments, q, n, plan.n_lines), dtype=np.complex64)
        self._autos = np.zeros((frames.n_segments, n - q, plan.n_lines), dtype=np.float32)
        self._frames = np.zeros(frames.n_segments, dtype=np.int64)
        self._rows = np.zeros((plan.n_lines, q, n), dtype=np.complex128)  # of the segment in hand
        self._squares = np.zeros((plan.n_lines, n - q))
        self._batch = np.empty((plan.n_lines, n, BATCH), dtype=np.complex128)
        self._in_batch = 0
        self._segment = 0
        self._next_frame = 0
        self._window = hann(frames.frame_length)
        self._pending = np.empty((n, 0))
        self._lost = np.zeros(n, dtype=np.int64)
        self._power, self._offset = np.zeros(n), np.zeros(n)

    def take(self, block: Array) -> None:
        """Add samples, shape (n_references + n_receivers, n), in order.

        Raises
        ------
        AnalysisError
            Another number of channels.
        """
        if block.ndim != 2 or len(block) != len(self._names):
            raise AnalysisError(f"a block of {len(self._names)} channels is due, got shape {block.shape}")
        frames = self.plan.frames
        data = np.concatenate((self._pending, block), axis=1)
        start = 0
        while self._next_frame < frames.n_frames and start + frames.frame_length <= data.shape[1]:
            self._take_frame(data[:, start : start + frames.frame_length])
            start += frames.hop
        self._pending = data[:, start:].copy() if self._next_frame < frames.n_frames else data[:, :0].copy()

    def _take_frame(self, frame: Array) -> None:
        segment = self.plan.frames.segment_of(self._next_frame)
        self._next_frame += 1
        if segment != self._segment:
            self._close_segment()
            self._segment = segment
        whole = np.isfinite(frame).all(axis=1)
        if not whole.all():
            self._lost += ~whole
            return
        means = frame.mean(axis=1)
        transforms = scipy.fft.rfft(frame * self._window, axis=1)[:, : self.plan.n_lines]
        half = 0.5 * self.plan.frames.frame_length
        transforms[:, 0] -= half * means
        transforms[:, 1] += 0.5 * half * means
        self._power += np.einsum("ij,ij->i", frame - means[:, None], frame - means[:, None]) / frame.shape[1]
        self._offset += means**2
        self._batch[:, :, self._in_batch] = transforms.T
        self._in_batch += 1
        self._frames[segment] += 1
        if self._in_batch == BATCH:
            self._multiply()

    def _multiply(self) -> None:
        q = self.plan.n_references
        held = self._batch[:, :, : self._in_batch]
        self._rows += held[:, :q] @ held.conj().swapaxes(1, 2)
        self._squares += (held[:, q:].real ** 2 + held[:, q:].imag ** 2).sum(axis=2)
        self._in_batch = 0

    def _close_segment(self) -> None:
        if self._in_batch:
            self._multiply()
        count = self._frames[self._segment]
        if count:
            scale = self._one_sided() / (self.plan.frames.sample_rate_hz * float(np.sum(self._window**2)) * count)
            self._density[self._segment] = np.moveaxis(self._rows, 0, -1) * scale
            self._autos[self._segment] = self._squares.T * scale
            self._rows[:] = 0.0
            self._squares[:] = 0.0

    def _one_sided(self) -> Array:
        factor = np.full(self.plan.n_lines, 2.0)
        factor[0] = 1.0
        if self.plan.n_lines == self.plan.frames.n_frequencies and self.plan.frames.frame_length % 2 == 0:
            factor[-1] = 1.0
        return factor

    def result(self) -> CrossSpectra:
        """Return the spectra of all frames taken; nothing can be taken after.

        Raises
        ------
        AnalysisError
            No frame is without missing values; it names the channels that miss them.
        """
        self._close_segment()
        lost = tuple((name, int(count)) for name, count in zip(self._names, self._lost, strict=True) if count)
        if not self._frames.sum():
            why = ", ".join(f"{name!r} ({count} frames)" for name, count in lost) or "fewer samples than one frame"
            raise AnalysisError(f"no frame of all channels without missing values: {why}")
        still = self._power <= DEAD * self._offset
        dead = tuple(name for name, constant in zip(self._names, still, strict=True) if constant)
        return CrossSpectra(
            self.plan, self._references, self._receivers, self._density, self._autos, self._frames, lost, dead
        )


def measure_cross_spectra(
    recording: Recording,
    references: Sequence[str],
    receivers: Sequence[str],
    resolution_hz: float = 4.0,
    overlap: float = 0.5,
    max_frequency_hz: float = np.inf,
    max_segments: int = MAX_SEGMENTS,
) -> CrossSpectra:
    """Measure the cross spectra of a recording's channels in one pass.

    Parameters
    ----------
    recording : Recording
    references, receivers : sequence of str
        Channels; all of one raster.
    resolution_hz, overlap, max_frequency_hz, max_segments
        See `plan_cross_spectra`.

    Raises
    ------
    AnalysisError
        Channels of different logs, rates, lengths or starts; it says which and in what they differ.
    """
    names = (*references, *receivers)
    if not references or not receivers:
        raise AnalysisError(f"cross spectra of {recording.name} take a reference and a receiver")
    first = recording[names[0]]
    for name in names[1:]:
        other = recording[name]
        differs = [
            f"{word} {a:g} and {b:g}"
            for word, a, b in (
                ("log", first.log_index + 1, other.log_index + 1),
                ("sampling rate", first.sample_rate_hz, other.sample_rate_hz),
                ("first sample", first.start_sample, other.start_sample),
                ("number of samples", first.n_samples, other.n_samples),
                ("start", first.start_s, other.start_s),
            )
            if a != b
        ]
        if differs:
            raise AnalysisError(
                f"channels {first.name!r} and {name!r} of {recording.name} differ ({'; '.join(differs)}): cross "
                "spectra need the phase between channels, so one clock and one raster; they are not resampled"
            )
    plan = plan_cross_spectra(
        first.sample_rate_hz,
        first.n_samples,
        len(references),
        len(receivers),
        resolution_hz,
        overlap,
        max_frequency_hz,
        max_segments,
    )
    meter = CrossSpectrumMeter(plan, references, receivers)
    for block in recording.blocks(names, max(1024, BLOCK_BYTES // (8 * len(names)))):
        meter.take(block)
    return meter.result()

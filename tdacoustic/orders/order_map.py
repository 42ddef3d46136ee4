"""Maps of levels over order and speed, over order and time, and over frequency and speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.orders.frames import FrameTransforms, LineFrames, Rows
from tdacoustic.orders.resampling import PASS_SHARE

__all__ = ["MapMeter", "OrderMap", "RowSums"]

Array = NDArray[np.float64]

MAP_BYTES: Final = 512 * 2**20
"""Memory that one map may take."""


@dataclass(frozen=True)
class OrderMap:
    """Mean squares over lines and rows; rows without frames are left out.

    Parameters
    ----------
    domain : {"order", "frequency"}
        What `axis` holds: orders of the shaft, or Hz.
    frames : LineFrames
        Window, requested and actual resolution.
    axis : ndarray, shape (n_lines,)
    times_s, speeds_hz : ndarray, shape (n_rows,)
        Means over the frames of a row.
    n_frames : ndarray of int, shape (n_channels, n_rows)
        Frames averaged; fewer where frames held samples that were no numbers, and 0 leaves NaN in the row.
    averages : ndarray, shape (n_channels, n_rows)
        Independent averages that they are worth.
    mean_square : ndarray of float32, shape (n_channels, n_rows, n_lines)
        Of a line, unit²: a tone on a line reads its mean square. A density is this over `noise_bandwidth`.
    error : ndarray of float32, same shape
        Standard error of the mean from the scatter of the frames; 0 of one alone, NaN where nobody asked for it.
    highest : ndarray, shape (n_rows,)
        Order (or Hz) up to which the row is flat: beyond, the sampling rate does not hold it.
    """

    domain: Literal["order", "frequency"]
    frames: LineFrames
    axis: Array
    times_s: Array
    speeds_hz: Array
    n_frames: NDArray[np.int64]
    averages: Array
    mean_square: NDArray[np.float32]
    error: NDArray[np.float32]
    highest: Array

    @property
    def resolution(self) -> float:
        """Line spacing in orders, or Hz."""
        return self.frames.resolution

    @property
    def noise_bandwidth(self) -> float:
        """Equivalent noise bandwidth of the window, in orders or Hz."""
        return self.frames.resolution * self.frames.noise_lines

    def band(self, low: Array | float, high: Array | float) -> Array:
        """Return the mean square in a band, corrected for the window's noise bandwidth, shape (n_channels, n_rows).

        A line stands for half a spacing on each side; lines partly in the band count in part. NaN where the band
        leaves the axis.

        Parameters
        ----------
        low, high : float or ndarray, shape (n_rows,)
            In orders, or Hz.
        """
        rows = self.speeds_hz.size
        ends = np.array([np.broadcast_to(low, rows), np.broadcast_to(high, rows)], dtype=np.float64)
        result = np.full(self.mean_square.shape[:2], np.nan)
        for row in range(rows):
            share = line_shares(self.axis.size, self.resolution, ends[0, row], ends[1, row])
            if share is not None:
                first, weights = share
                result[:, row] = self.mean_square[:, row, first : first + weights.size] @ weights
        return result / self.frames.noise_lines


def line_shares(n_lines: int, resolution: float, low: float, high: float) -> tuple[int, Array] | None:
    """Return the first line of a band and how much of each line lies in it; None where the band leaves the axis."""
    begin, end = low / resolution + 0.5, high / resolution + 0.5
    if not (begin >= 0.5 and end <= n_lines - 0.5 and end > begin):
        return None
    first, last = int(np.floor(begin)), int(np.ceil(end))
    weights = np.ones(last - first)
    weights[0] -= begin - first
    weights[-1] -= last - end
    return first, weights


class RowSums:
    """Counts, times and speeds of the frames of each row.

    Parameters
    ----------
    rows : Rows
    n_channels : int
    """

    def __init__(self, rows: Rows, n_channels: int) -> None:
        self.rows = rows
        self.count = np.zeros(rows.count, dtype=np.int64)
        self.valid = np.zeros((n_channels, rows.count), dtype=np.int64)
        self._times, self._speeds = np.zeros(rows.count), np.zeros(rows.count)
        self.fastest_hz = np.zeros(rows.count)

    def take(self, frames: FrameTransforms) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
        """Add frames; return the row of each (-1: none), and whether each is good, shape (n_frames, n_channels)."""
        row = self.rows.row_of(frames)
        good = np.isfinite(frames.lines[:, :, 1].real)
        for index in np.flatnonzero(row >= 0):
            at = row[index]
            self.count[at] += 1
            self.valid[:, at] += good[index]
            self._times[at] += frames.times_s[index]
            self._speeds[at] += frames.speeds_hz[index]
            self.fastest_hz[at] = max(self.fastest_hz[at], frames.fastest_hz[index])
        return row, good

    @property
    def filled(self) -> NDArray[np.intp]:
        """Rows that have frames."""
        return np.flatnonzero(self.count)

    def means(self) -> tuple[Array, Array]:
        """Return mean times and speeds of the filled rows."""
        filled = self.filled
        return self._times[filled] / self.count[filled], self._speeds[filled] / self.count[filled]


class MapMeter:
    """Gathers the transforms of frames in the rows of a map.

    Parameters
    ----------
    plan : LineFrames
    rows : SpeedRows, TimeRows or EachFrame
    n_channels : int
    domain : {"order", "frequency"}
    highest : float
        Order, or Hz, up to which lines are kept.
    sample_rate_hz : float
        Of the time signal: says what it cannot hold.
    errors : bool
        Whether the scatter of the frames is kept: it takes as much memory as the map, and time.

    Raises
    ------
    AnalysisError
        The map would take more than `MAP_BYTES`.

    Examples
    --------
    ``frames = Frames(plan, [meter])``, and for each block ``frames.take(resampler.take(block))``; at the end
    ``meter.result()``.
    """

    def __init__(
        self,
        plan: LineFrames,
        rows: Rows,
        n_channels: int,
        domain: Literal["order", "frequency"],
        highest: float,
        sample_rate_hz: float,
        errors: bool = True,
    ) -> None:
        self.plan, self.domain, self._rate_hz, self._limit = plan, domain, sample_rate_hz, highest
        self._n_lines = min(plan.n_lines, int(np.floor(highest / plan.resolution + 1e-9)) + 1)
        shape = (rows.count, n_channels, self._n_lines)
        if 8 * int(np.prod(shape)) > MAP_BYTES:
            raise AnalysisError(
                f"a map of {rows.count} rows, {n_channels} channels and {self._n_lines} lines takes more than "
                f"{MAP_BYTES >> 20} MiB; take fewer rows or a coarser resolution"
            )
        self._sums = RowSums(rows, n_channels)
        self._mean = np.zeros(shape, dtype=np.float32)
        self._spread = np.zeros(shape, dtype=np.float32) if errors else None

    def take(self, frames: FrameTransforms) -> None:
        """Add frames, in order: mean and squared deviations by the steps of B. P. Welford (Technometrics 4 (1962))."""
        before = self._sums.valid.copy()
        row, good = self._sums.take(frames)
        alone = self._alone(row, before, good)
        if alone.size:
            lines = frames.lines[alone, :, : self._n_lines]
            self._mean[row[alone]] = lines.real**2 + lines.imag**2
        others = np.delete(row, alone)
        for at in np.unique(others[others >= 0]):
            chosen = np.flatnonzero(row == at)
            lines = frames.lines[chosen, :, : self._n_lines]
            power = (lines.real**2 + lines.imag**2).astype(np.float32)
            if good[chosen].all():
                self._merge(at, before[:, at], power)
                continue
            for channel in range(power.shape[1]):
                kept = power[good[chosen, channel], channel]
                if kept.shape[0]:
                    self._merge(at, before[channel : channel + 1, at], kept[:, None], slice(channel, channel + 1))

    def _alone(self, row: NDArray[np.intp], before: NDArray[np.int64], good: NDArray[np.bool_]) -> NDArray[np.intp]:
        """Frames that are the only ones of their rows so far."""
        inside = np.flatnonzero(row >= 0)
        count = np.bincount(row[inside], minlength=1)
        return inside[(count[row[inside]] == 1) & ~before[:, row[inside]].any(axis=0) & good[inside].all(axis=1)]

    def _merge(
        self, row: int, before: NDArray[np.int64], power: NDArray[np.float32], channels: slice = slice(None)
    ) -> None:
        """Join frames, shape (n, channels, lines), with the `before` frames that a row has."""
        mean = self._mean[row, channels]
        number = power.shape[0]
        if number == 1 and not before.any():
            mean[:] = power[0]
            return
        fresh = power.mean(axis=0)
        total = (before + number)[:, None]
        apart = fresh - mean
        if self._spread is not None:
            spread, weight = self._spread[row, channels], (before[:, None] * number / total).astype(np.float32)
            spread += ((power - fresh) ** 2).sum(axis=0) + apart**2 * weight
        mean += apart * (number / total).astype(np.float32)

    def result(self) -> OrderMap:
        """Return the map.

        Raises
        ------
        AnalysisError
            No frame belongs to any row.
        """
        filled = self._sums.filled
        if not filled.size:
            raise AnalysisError(
                f"no frame of {1.0 / self.plan.resolution:g} {'turns' if self.domain == 'order' else 's'} lies in the "
                "rows of the map: the record is too short, its speed is outside the classes, or the angle is not known"
            )
        times, speeds = self._sums.means()
        n_frames = self._sums.valid[:, filled]
        averages = self.plan.independent(n_frames)
        mean = np.moveaxis(self._mean[filled], 0, 1)
        mean[n_frames == 0] = np.nan
        flat = PASS_SHARE * self._rate_hz
        with np.errstate(divide="ignore", invalid="ignore"):
            highest = flat / self._sums.fastest_hz[filled] if self.domain == "order" else np.full(filled.size, flat)
        return OrderMap(
            domain=self.domain,
            frames=self.plan,
            axis=np.arange(self._n_lines, dtype=np.float64) * self.plan.resolution,
            times_s=times,
            speeds_hz=speeds,
            n_frames=n_frames,
            averages=averages,
            mean_square=mean,
            error=self._error(filled, n_frames, averages),
            highest=np.minimum(highest, self._limit),
        )

    def _error(self, filled: NDArray[np.intp], n_frames: NDArray[np.int64], averages: Array) -> NDArray[np.float32]:
        """Standard errors, in single precision and in place: maps are large."""
        if self._spread is None:
            return np.broadcast_to(np.float32(np.nan), (*n_frames.shape, self._n_lines))
        held = n_frames > 0
        share = np.where(held, 1.0 / (np.maximum(n_frames - 1, 1) * np.where(held, averages, 1.0)), np.nan)
        error = np.moveaxis(self._spread[filled], 0, 1)
        error *= share[:, :, None].astype(np.float32)
        return np.asarray(np.sqrt(error, out=error))

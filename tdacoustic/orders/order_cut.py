"""Cuts along orders: level, phase, floor and error of each order in each row, with the reasons where there is none."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.orders.frames import FrameTransforms, LineFrames, Rows
from tdacoustic.orders.order_map import MAP_BYTES, RowSums, line_shares
from tdacoustic.orders.resampling import PASS_SHARE
from tdacoustic.speed.angle import ShaftAngle

__all__ = ["CutMeter", "Neighbour", "OrderCut"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

SIDE_LINES: Final = 12
"""Lines on each side of the band from which the floor is taken."""
FEWEST_SIDE_LINES: Final = 4
PROMINENCE_DB: Final = 6.0
"""Band over floor from which on the floor can be taken off, as ISO 3744 has it for background noise."""
STEADY: Final = 0.5
"""Coherence of the frames' phases from which on a mean phase is stated (assumed; then its error is below 0.5 rad from 2
independent frames on)."""


@dataclass(frozen=True)
class Neighbour:
    """An order that may come near the one that is cut.

    Parameters
    ----------
    angle : ShaftAngle
        Of its own shaft.
    order : float
    name : str
    """

    angle: ShaftAngle
    order: float
    name: str


@dataclass(frozen=True)
class OrderCut:
    """One order in one channel over the rows.

    Parameters
    ----------
    order : float
        Of the shaft over whose angle the frames lie.
    channel : int
    requested_bandwidth, bandwidth : float
        In orders; the actual one is no narrower than the window's main lobe.
    resolution : float
        Line spacing in orders.
    times_s, speeds_hz : ndarray, shape (n_rows,)
    n_frames : ndarray of int, shape (n_rows,)
    mean_square : ndarray, shape (n_rows,)
        In the band, noise bandwidth corrected, the floor in it included; unit².
    floor : ndarray, shape (n_rows,)
        What the floor has in the band, from the lines beside it.
    error : ndarray, shape (n_rows,)
        Standard error of `mean_square` from the scatter of the frames; of one frame alone, that of the floor.
    amplitude : ndarray of complex, shape (n_rows,)
        Mean over the frames: magnitude in rms, phase of a cosine against the angle's zero, or against the reference
        channel's same order. A line of unsteady phase averages away; see `steadiness`.
    steadiness : ndarray, shape (n_rows,)
        Coherence of the frames' phases, 0 to 1: |mean amplitude|² over mean square (angle's zero), or the ordinary
        coherence with the reference. Of one frame alone it is 1 and says nothing.
    phase_error_rad : ndarray, shape (n_rows,)
        Standard error from the steadiness, ``sqrt((1 - γ²) / (2 γ² n))``; of one frame from band over floor.
    reasons : tuple of str, one a row
        Empty, or why a value is missing or doubtful; a value is NaN only with a reason.
    """

    order: float
    channel: int
    requested_bandwidth: float
    bandwidth: float
    resolution: float
    times_s: Array
    speeds_hz: Array
    n_frames: NDArray[np.int64]
    mean_square: Array
    floor: Array
    error: Array
    amplitude: Complex
    steadiness: Array
    phase_error_rad: Array
    reasons: tuple[str, ...]

    @property
    def stands_out(self) -> NDArray[np.bool_]:
        """Whether the band is 6 dB or more above the floor in it."""
        with np.errstate(invalid="ignore"):
            return np.asarray(self.mean_square >= 10.0 ** (0.1 * PROMINENCE_DB) * self.floor)

    @property
    def line_mean_square(self) -> Array:
        """Mean square less the floor, not below zero."""
        return np.maximum(self.mean_square - self.floor, 0.0)


class CutMeter:
    """Cuts orders out of the transforms of frames.

    Parameters
    ----------
    plan : LineFrames
        Over the angle of the shaft whose orders are cut.
    orders : sequence of float
    rows : SpeedRows, TimeRows or EachFrame
    n_channels : int
    sample_rate_hz : float
        Of the time signal: says which orders it cannot hold.
    bandwidth : float or None
        In orders; None takes the window's main lobe.
    reference : int or None
        Channel that phases refer to; None takes the angle's zero.
    neighbours : sequence of Neighbour
        Further orders, of other shafts too, whose coming into a band is stated. The `orders` know of each other.

    Raises
    ------
    AnalysisError
        An order that is not above zero, or a reference that is not there.
    """

    def __init__(
        self,
        plan: LineFrames,
        orders: Sequence[float],
        rows: Rows,
        n_channels: int,
        sample_rate_hz: float,
        bandwidth: float | None = None,
        reference: int | None = None,
        neighbours: Sequence[Neighbour] = (),
    ) -> None:
        if not all(math.isfinite(order) and order > 0.0 for order in orders):
            raise AnalysisError(f"orders must be > 0, got {list(orders)}")
        if reference is not None and not 0 <= reference < n_channels:
            raise AnalysisError(f"the reference must be one of {n_channels} channels, got {reference}")
        if bandwidth is not None and not bandwidth > 0.0:
            raise AnalysisError(f"the bandwidth of a cut must be > 0 orders, got {bandwidth}")
        lobe = 2.0 * plan.main_lobe_lines * plan.resolution
        self.plan, self.orders, self._rate_hz = plan, tuple(orders), sample_rate_hz
        self.requested = lobe if bandwidth is None else bandwidth
        self.bandwidth = max(self.requested, lobe)
        self._reference, self._neighbours = reference, tuple(neighbours)
        self._sums = RowSums(rows, n_channels)
        self._bands = [_Band(plan, order, self.bandwidth, self.orders) for order in self.orders]
        shape = (len(self.orders), n_channels, rows.count)
        if 8 * int(np.prod(shape)) * (2 * SIDE_LINES + 6) > MAP_BYTES:
            raise AnalysisError(
                f"cuts along {shape[0]} orders in {n_channels} channels over {rows.count} rows take more than "
                f"{MAP_BYTES >> 20} MiB; take fewer rows"
            )
        self._energy, self._square, self._line = np.zeros(shape), np.zeros(shape), np.zeros(shape)
        self._referred = np.zeros(shape)
        self._amplitude = np.zeros(shape, dtype=np.complex128)
        self._side = np.zeros((*shape, 2 * SIDE_LINES))

    def take(self, frames: FrameTransforms) -> None:
        """Add frames, in order."""
        row, good = self._sums.take(frames)
        chosen = row >= 0
        if not chosen.any():
            return
        at, starts = row[chosen], frames.starts[chosen]
        fit = good[chosen] if self._reference is None else good[chosen] & good[chosen, self._reference, None]
        for index, band in enumerate(self._bands):
            if not band.on_axis:
                continue
            lines = np.where(fit[:, :, None], frames.lines[chosen, :, band.first : band.last], 0.0)
            power = lines.real**2 + lines.imag**2
            energy = power[:, :, band.inner] @ band.shares / self.plan.noise_lines
            amplitude = lines[:, :, band.near] @ band.matched
            amplitude = amplitude * np.exp(-2j * np.pi * band.order * starts)[:, None]
            weight = np.abs(amplitude) ** 2
            referred = weight
            if self._reference is not None:
                root = amplitude[:, self._reference, None]
                amplitude, referred = amplitude * np.conj(root), np.abs(root) ** 2 + np.zeros(weight.shape)
            for sums, values in (
                (self._energy, energy),
                (self._square, energy**2),
                (self._line, weight),
                (self._referred, referred),
                (self._amplitude, amplitude),
                (self._side, power[:, :, band.side]),
            ):
                taken = sums[index].swapaxes(0, 1)  # rows first; a view
                if sums is self._side:
                    np.add.at(taken[:, :, : len(band.side)], at, values)
                else:
                    np.add.at(taken, at, values)

    def result(self) -> tuple[OrderCut, ...]:
        """Return a cut for each order and channel, channels running fastest."""
        filled = self._sums.filled
        times, speeds = self._sums.means()
        return tuple(
            self._cut(index, channel, filled, times, speeds)
            for index in range(len(self.orders))
            for channel in range(self._sums.valid.shape[0])
        )

    def _cut(self, index: int, channel: int, filled: NDArray[np.intp], times: Array, speeds: Array) -> OrderCut:
        band = self._bands[index]
        valid = self._sums.valid[channel, filled]
        if self._reference is not None:
            valid = np.minimum(valid, self._sums.valid[self._reference, filled])
        reasons = self._reasons(band, filled, times, speeds, valid)
        usable = np.array([not any(reason.startswith("no value") for reason in row) for row in reasons], dtype=bool)
        usable &= valid > 0
        count = np.where(usable, valid, 1).astype(np.float64)
        worth = np.maximum(self.plan.independent(valid), 1.0)

        def mean(sums: NDArray) -> NDArray:
            return np.where(usable, sums[index, channel, filled] / count, np.nan)

        energy, line, referred = mean(self._energy), mean(self._line), mean(self._referred)
        amplitude = mean(self._amplitude)
        with np.errstate(invalid="ignore", divide="ignore"):
            spread = np.clip(mean(self._square) - energy**2, 0.0, None) * count / np.maximum(count - 1.0, 1.0)
            floor = self._floor(index, channel, filled, count, usable)
            error = np.where(count > 1, np.sqrt(spread / worth), np.sqrt(2.0 * energy * floor))
            steadiness = np.clip(np.abs(amplitude) ** 2 / (line * referred), 0.0, 1.0)
            if self._reference is None:
                steadiness = np.clip(np.abs(amplitude) ** 2 / line, 0.0, 1.0)
            else:
                amplitude = amplitude / np.sqrt(referred)
            phase_error = np.sqrt((1.0 - steadiness) / (2.0 * steadiness * worth))
            phase_error = np.where(count > 1, phase_error, np.sqrt(0.5 * floor / energy))
        for row in np.flatnonzero(usable):
            if not energy[row] >= 10.0 ** (0.1 * PROMINENCE_DB) * floor[row]:
                reasons[row].append(f"less than {PROMINENCE_DB:g} dB above the floor")
            elif count[row] > 1 and steadiness[row] < STEADY:
                reasons[row].append("unsteady phase")
        return OrderCut(
            order=band.order,
            channel=channel,
            requested_bandwidth=self.requested,
            bandwidth=self.bandwidth,
            resolution=self.plan.resolution,
            times_s=times,
            speeds_hz=speeds,
            n_frames=valid,
            mean_square=energy,
            floor=floor,
            error=error,
            amplitude=amplitude,
            steadiness=steadiness,
            phase_error_rad=phase_error,
            reasons=tuple("; ".join(row) for row in reasons),
        )

    def _floor(self, index: int, channel: int, filled: NDArray[np.intp], count: Array, usable: NDArray) -> Array:
        """Floor in the band: median of the lines beside it, put on the scale of the mean of so many frames."""
        from scipy import special

        band = self._bands[index]
        if len(band.side) < FEWEST_SIDE_LINES:
            return np.where(usable, 0.0, np.nan)
        side = self._side[index, channel, filled][:, : len(band.side)] / count[:, None]
        freedom = 2.0 * np.maximum(self.plan.independent(count), 1.0)
        wide = self.bandwidth / self.plan.resolution / self.plan.noise_lines
        median = 2.0 * special.gammaincinv(0.5 * freedom, 0.5)  # of chi squared
        return np.where(usable, np.median(side, axis=1) * freedom / median * wide, np.nan)

    def _reasons(
        self, band: _Band, filled: NDArray[np.intp], times: Array, speeds: Array, valid: NDArray[np.int64]
    ) -> list[list[str]]:
        reasons: list[list[str]] = [[] for _ in filled]
        general = []
        if self.bandwidth > self.requested * (1.0 + 1e-9):
            general.append(f"bandwidth {self.requested:g} is below the resolution: {self.bandwidth:g} orders taken")
        if not band.on_axis:
            general.append("no value: the band leaves the lines from 0 to half the samples per turn")
        general += [
            f"order {other:g} within the band"
            for other in self.orders
            if other != band.order and abs(other - band.order) < 0.5 * self.bandwidth + band.lobe
        ]
        if band.on_axis and len(band.side) < FEWEST_SIDE_LINES:
            general.append("no lines beside the band for a floor")
        highest = PASS_SHARE * self._rate_hz / np.maximum(self._sums.fastest_hz[filled], 1e-9)
        for row, list_ in enumerate(reasons):
            list_ += general
            if band.order + 0.5 * self.bandwidth > highest[row]:
                list_.append(f"no value: beyond order {highest[row]:.4g}, which the sampling rate holds at this speed")
            if valid[row] == 0:
                list_.append("no value: no frame without gaps")
        for neighbour in self._neighbours:
            at = neighbour.order * neighbour.angle.speed_hz_at(times) / speeds
            near = np.abs(at - band.order) < 0.5 * self.bandwidth + band.lobe
            for row in np.flatnonzero(near).tolist():
                reasons[row].append(f"{neighbour.name} (order {at[row]:.4g}) within the band")
        return reasons


class _Band:
    """The lines that a cut reads: those of the band, those nearest to the order, those beside the band."""

    def __init__(self, plan: LineFrames, order: float, bandwidth: float, others: Sequence[float]) -> None:
        self.order = order
        self.lobe = plan.main_lobe_lines * plan.resolution
        low, high = order - 0.5 * bandwidth, order + 0.5 * bandwidth
        shares = line_shares(plan.n_lines, plan.resolution, low, high)
        lobes = math.ceil(plan.main_lobe_lines)
        self.on_axis = shares is not None and low >= self.lobe  # below, a line meets its own mirror image
        self.side: list[int] = []
        if shares is None or not self.on_axis:
            return
        begin, self.shares = shares
        end = begin + self.shares.size
        middle = round(order / plan.resolution)
        self.first = max(0, min(begin, middle - lobes) - SIDE_LINES)
        self.last = min(plan.n_lines, max(end, middle + lobes + 1) + SIDE_LINES)
        self.inner = slice(begin - self.first, end - self.first)
        near = np.arange(max(0, middle - lobes), min(plan.n_lines, middle + lobes + 1))
        response = plan.line_transform(near - order / plan.resolution)
        self.near = slice(int(near[0]) - self.first, int(near[-1]) + 1 - self.first)
        self.matched = np.conj(response) / np.sum(np.abs(response) ** 2)
        beside = [*range(max(lobes, begin - SIDE_LINES), begin), *range(end, min(plan.n_lines - 1, end + SIDE_LINES))]
        free = [
            line
            for line in beside
            if all(abs(line * plan.resolution - other) >= self.lobe for other in others if other != order)
        ]
        self.side = [line - self.first for line in free]

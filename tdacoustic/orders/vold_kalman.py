"""Vold-Kalman tracking of the second generation: several orders of several shafts jointly, amplitude and phase."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.orders.envelope_splines import Carriers, NodeSystem, alone_inverse, penalty_of, spline_weights
from tdacoustic.speed.angle import ShaftAngle

__all__ = ["REASONS", "OrderTrack", "TrackedOrder", "VoldKalman"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

NODES_A_BANDWIDTH: Final = 16.0
"""Nodes of the envelopes' splines in 1 / (widest bandwidth); the splines then change a gain by 0.002 at most."""
FEWEST_SAMPLES: Final = 4
"""Samples a node interval at least."""
WINDOW_NODES: Final = 4096
"""Node intervals that are solved at once."""
GATHERED: Final = 1 << 16
"""Samples that are taken at once, so that their carriers stay in the cache."""
LAG_NODES: Final = 1024
"""Node intervals at the end of a window that are solved again with the next: 64 / (widest bandwidth) seconds."""
EDGE: Final = {1: 0.6, 2: 1.0, 3: 1.5}
"""Reach of the transient at an end, over 1 / bandwidth, by poles: the filter's memory has decayed to 0.5 %."""
CONTEXT_NODES: Final = 128
"""Node intervals before a window that count for its errors: 8 / (widest bandwidth) seconds."""
MIRROR: Final = 4.0
"""Distance from 0 Hz and from half the sampling rate, in bandwidths, below which a carrier meets its mirror image."""
INFLATED: Final = 4.0
"""Variance over that of the order alone from which on orders count as not separable: twice the standard error."""

REASONS: Final = (
    "",
    "no value: the angle is not known",
    "no value: beyond half the sampling rate",
    "no value: samples that are no numbers",
    "near an end: transient",
    "near 0 Hz or half the sampling rate: mirror image",
    "not separable from another order at this bandwidth",
)
"""What the codes of `OrderTrack.reason` mean; 1 to 3 go with NaN."""


@dataclass(frozen=True)
class TrackedOrder:
    """An order to track.

    Parameters
    ----------
    angle : ShaftAngle
        Of its shaft.
    order : float
        Of that shaft.
    bandwidth_hz : float
        Distance from the carrier at which the filter is 3 dB down; see `advise_bandwidth`.
    name : str
    """

    angle: ShaftAngle
    order: float
    bandwidth_hz: float
    name: str = ""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.order) and self.order > 0.0):
            raise AnalysisError(f"order must be > 0, got {self.order} ({self.name or 'tracked order'})")
        if not (math.isfinite(self.bandwidth_hz) and self.bandwidth_hz > 0.0):
            raise AnalysisError(f"bandwidth_hz must be > 0, got {self.bandwidth_hz} (order {self.order:g} {self.name})")


@dataclass(frozen=True)
class OrderTrack:
    """One order over a span of time.

    Parameters
    ----------
    order : TrackedOrder
    times_s : ndarray, shape (n,)
        Nodes, evenly spaced.
    speeds_hz : ndarray, shape (n,)
        Of the order's shaft; NaN where not known.
    amplitude : ndarray of complex, shape (n_channels, n)
        Magnitude in rms, phase of a cosine against the angle's zero.
    error : ndarray, shape (n_channels, n)
        Standard error of the magnitude, from what is left beside the order within some 8 bandwidths and from how well
        the orders can be told apart there. A smooth change that the bandwidth does not follow is not in it.
    reason : ndarray of int8, shape (n_channels, n)
        Index into `REASONS`; NaN with 1 to 3 alone.
    """

    order: TrackedOrder
    times_s: Array
    speeds_hz: Array
    amplitude: Complex
    error: Array
    reason: NDArray[np.int8]

    def waveform(self, times_s: Array) -> Array:
        """Return what the order contributes to the signal at instants, shape (n_channels, n); NaN where it has none."""
        from scipy import interpolate

        from tdacoustic.orders.kernels import write_waveform

        known = ~np.isnan(self.amplitude)
        result = np.full((self.amplitude.shape[0], times_s.size), np.nan)
        for channel, (amplitude, good) in enumerate(zip(self.amplitude, known, strict=True)):
            for piece in np.split(np.arange(good.size), np.flatnonzero(np.diff(good)) + 1):
                if not good[piece[0]] or piece.size < 4:
                    continue
                nodes, values = self.times_s[piece], amplitude[piece]
                inside = np.flatnonzero((times_s >= nodes[0]) & (times_s <= nodes[-1]))
                rates, out = interpolate.CubicSpline(nodes, values)(nodes, 1), np.empty(inside.size)
                write_waveform(times_s[inside], self.order.order, *_nodes(self.order.angle), nodes, values, rates, out)
                result[channel, inside] = out
        return result


class VoldKalman:
    """Tracks orders jointly, block by block.

    The signal is taken for ``Σ_k Re{√2 a_k(t) exp(2πi o_k turns_k(t))}`` plus the rest; the envelopes a_k minimise the
    rest's energy plus a penalty on their p-th derivative (p poles), jointly for all orders of all shafts. Orders that
    cross are told apart by what they do before and after. The gain at a distance f from a carrier alone is
    ``1 / (1 + (√2 - 1) (f / B)^(2p))``.

    The envelopes are cubic splines with `NODES_A_BANDWIDTH` nodes per 1 / B of the widest band, so that the system has
    as many unknowns as the answer needs and not one a sample; the mirror image of a real signal (twice the carrier
    away) is left out, which a flag states where it matters. Long records are solved in windows: the end of each lags by
    64 / B seconds and its beginning continues the one before exactly. Memory does not depend on the record's length
    when the pieces that `take` returns are used up.

    A node interval begins every 1 / (16 B) s; what is left of a record after the last whole one is not used.

    Parameters
    ----------
    orders : sequence of TrackedOrder
        All that may come near each other.
    sample_rate_hz : float
    n_channels : int
    poles : {1, 2, 3}
        1 follows the quickest, 3 is the steepest filter.
    start_s : float
        Instant of the first sample on the run's time axis.

    Raises
    ------
    AnalysisError
        No order, two that are the same, an unknown number of poles, or a band too wide for the sampling rate.

    Examples
    --------
    >>> angle = ShaftAngle([0.0, 5.0, 10.0], [0.0, 50.0, 100.0])
    >>> t = np.arange(10000) / 1000.0
    >>> tracker = VoldKalman([TrackedOrder(angle, 2.0, 1.0)], 1000.0)
    >>> (track,) = tracker.whole(np.sqrt(2.0) * 3.0 * np.cos(2.0 * np.pi * 20.0 * t + 0.5)[None])
    >>> middle = track.amplitude[0, 80]
    >>> round(float(abs(middle)), 3), round(float(np.angle(middle)), 3)
    (3.0, 0.5)
    """

    def __init__(
        self,
        orders: Sequence[TrackedOrder],
        sample_rate_hz: float,
        n_channels: int = 1,
        poles: int = 2,
        start_s: float = 0.0,
    ) -> None:
        if poles not in EDGE:
            raise AnalysisError(f"poles must be 1, 2 or 3, got {poles}")
        if not orders:
            raise AnalysisError("there is no order to track")
        _refuse_twins(orders)
        widest = max(order.bandwidth_hz for order in orders)
        self.samples = int(sample_rate_hz / (NODES_A_BANDWIDTH * widest))
        if self.samples < FEWEST_SAMPLES:
            raise AnalysisError(
                f"a bandwidth of {widest:g} Hz is too wide for {sample_rate_hz:g} Hz; "
                f"at most {sample_rate_hz / NODES_A_BANDWIDTH / FEWEST_SAMPLES:g} Hz"
            )
        self.orders, self.poles, self.start_s, self.rate_hz = tuple(orders), poles, start_s, sample_rate_hz
        self._shape = (len(orders), n_channels)
        self._weights = spline_weights(np.arange(self.samples) / self.samples)
        self._interval_s = self.samples / sample_rate_hz
        self._strengths = [penalty_of(order.bandwidth_hz, self._interval_s, self.samples, poles) for order in orders]
        self._moments = np.zeros((len(orders), WINDOW_NODES + 3, n_channels), dtype=np.complex128)
        self._bad = np.zeros((n_channels, WINDOW_NODES), dtype=bool)
        self._pending = np.zeros((n_channels, 0))
        self._base = 0  # first node interval of the window
        self._filled = 0  # intervals of the window that have their data
        self._fixed: Complex | None = None  # coefficients before the window

    def take(self, block: Array) -> tuple[tuple[OrderTrack, ...], ...]:
        """Add samples, shape (n_channels, n), in order; return the pieces that are done, one track an order each."""
        data = np.concatenate((self._pending, block), axis=1) if self._pending.size else np.asarray(block)
        pieces, start = [], 0
        while True:
            whole = min((data.shape[1] - start) // self.samples, WINDOW_NODES - self._filled)
            whole = min(whole, max(1, GATHERED // self.samples))
            if whole:
                stop = start + whole * self.samples
                self._gather(data[:, start:stop], whole)
                start = stop
            if self._filled == WINDOW_NODES:
                pieces.append(self._solved(WINDOW_NODES - LAG_NODES))
            elif not whole:
                break
        self._pending = data[:, start:].copy()
        return tuple(pieces)

    def finish(self) -> tuple[tuple[OrderTrack, ...], ...]:
        """Return the last piece, or nothing."""
        if not self._filled:
            return ()
        return (self._solved(self._filled),)

    def whole(self, samples: Array, block_size: int = 1 << 18) -> tuple[OrderTrack, ...]:
        """Return the tracks of a whole signal, shape (n_channels, n), one an order; the tracker is spent after.

        Raises
        ------
        AnalysisError
            The signal is shorter than a node interval.
        """
        pieces = [
            piece
            for start in range(0, samples.shape[1], block_size)
            for piece in self.take(samples[:, start : start + block_size])
        ]
        pieces += self.finish()
        if not pieces:
            raise AnalysisError(f"{samples.shape[1]} samples are too few to track; it takes {self.samples} at least")
        if len(pieces) == 1:
            return pieces[0]
        return tuple(_joined([piece[index] for piece in pieces]) for index in range(len(self.orders)))

    def _gather(self, data: Array, whole: int) -> None:
        """Add the data of so many whole intervals to the moments."""
        from tdacoustic.orders.kernels import gather_envelopes

        data = np.ascontiguousarray(data, dtype=np.float64)
        intervals = slice(self._filled, self._filled + whole)
        finite = np.isfinite(data)
        if not finite.all():
            self._bad[:, intervals] = ~finite.reshape(len(data), whole, self.samples).all(axis=2)
            data = np.where(np.repeat(~self._bad[:, intervals], self.samples, axis=1), data, 0.0)
        first = (self._base + self._filled) * self.samples
        valid = self._valid(self._base + self._filled, whole)
        for index, phasors in enumerate(self._phasors(first, data.shape[1])):
            if not valid[index].all():
                phasors *= np.repeat(valid[index], self.samples)
            start = self._filled * self.samples
            gather_envelopes(data, self._weights, phasors, start, self.samples, self._moments[index])
        self._filled += whole

    def _phasors(self, first: int, count: int) -> list[Complex]:
        """Carriers of all orders at consecutive samples."""
        from tdacoustic.orders.kernels import PHASE_RUN, phasor_grid, turns_on_grid

        result, known = [], {}
        for order in self.orders:
            key = id(order.angle)
            if key not in known:
                known[key] = np.empty(2 * math.ceil(count / PHASE_RUN) + 1)
                start_s = self.start_s + first / self.rate_hz
                turns_on_grid(start_s, 0.5 * PHASE_RUN / self.rate_hz, *_nodes(order.angle), known[key])
            phasors = np.empty(count, dtype=np.complex128)
            phasor_grid(known[key] * order.order, count, phasors)
            result.append(phasors)
        return result

    def _valid(self, first: int, count: int) -> NDArray[np.bool_]:
        """Whether each interval has a carrier that the sampling rate holds, shape (n_orders, count)."""
        return np.array([self._state(order, first, count)[0] == 0 for order in self.orders])

    def _state(self, order: TrackedOrder, first: int, count: int) -> tuple[NDArray[np.int8], Array]:
        """Reason (0, 1, 2 or 5) of each interval, and the carrier's frequency at its beginning."""
        times = self.start_s + (first + np.arange(count + 1)) * self._interval_s
        frequency = order.order * order.angle.speed_hz_at(times)
        lower, higher = np.minimum(frequency[:-1], frequency[1:]), np.maximum(frequency[:-1], frequency[1:])
        half, band = 0.5 * self.rate_hz, order.bandwidth_hz
        with np.errstate(invalid="ignore"):
            reason = np.where((lower < MIRROR * band) | (higher > half - MIRROR * band), 5, 0)
            reason = np.where(higher > half - band, 2, reason)
        return np.where(np.isnan(frequency[:-1]) | np.isnan(frequency[1:]), 1, reason).astype(np.int8), frequency[:-1]

    def _carriers(self, first: int, count: int) -> Carriers:
        from tdacoustic.orders.kernels import turns_on_grid

        shares = Carriers.shares(self.samples)
        begin = self.start_s + (first + shares[0]) * self._interval_s
        shape = (len(self.orders), count, shares.size)
        phasors, rates = np.empty(shape, dtype=np.complex128), np.empty(shape[:2])
        for index, order in enumerate(self.orders):
            turns = np.empty(count * shares.size)
            turns_on_grid(begin, self._interval_s / shares.size, *_nodes(order.angle), turns)
            cycles = (order.order * turns).reshape(shape[1:])
            phasors[index] = np.exp(2j * np.pi * (cycles - np.floor(cycles)))
            rates[index] = (cycles[:, -1] - cycles[:, 0]) / max(1e-9, shares[-1] - shares[0])
            valid = self._state(order, first, count)[0]
            phasors[index, (valid == 1) | (valid == 2)] = 0.0
        strengths = np.repeat(np.array(self._strengths)[:, None], count, axis=1)
        return Carriers(phasors, rates, strengths, self.samples)

    def _solved(self, done: int) -> tuple[OrderTrack, ...]:
        """Solve the window, return its first `done` intervals and move on to the others."""
        before = 0 if self._fixed is None else len(self._fixed)
        system = NodeSystem(self._carriers(self._base - before, self._filled + before), self.poles)
        moments = np.zeros((before + self._filled + 3, *self._shape), dtype=np.complex128)
        moments[before:] = np.moveaxis(self._moments[:, : self._filled + 3], 0, 1)
        coefficients = system.solve(moments, self._fixed)
        last = self._filled == done
        tracks = self._tracks(system, coefficients, before, done, last)
        keep = done + before
        self._fixed = None if last else coefficients[max(0, keep - CONTEXT_NODES) : keep].copy()
        rest = self._filled - done
        self._moments[:, : rest + 3] = self._moments[:, done : self._filled + 3].copy()
        self._moments[:, rest + 3 :] = 0.0
        self._bad[:, :rest] = self._bad[:, done : self._filled].copy()
        self._bad[:, rest:] = False
        self._base, self._filled = self._base + done, rest
        return tracks

    def _tracks(
        self, system: NodeSystem, coefficients: Complex, before: int, done: int, last: bool
    ) -> tuple[OrderTrack, ...]:
        span = slice(before, before + done)
        values = (coefficients[:-2] + 4.0 * coefficients[1:-1] + coefficients[2:])[span] / (6.0 * math.sqrt(2.0))
        left = system.misfit(coefficients)
        inverse = system.inverse_diagonal()
        tracks = []
        for index, order in enumerate(self.orders):
            reason, frequency = self._state(order, self._base, done)
            alone = alone_inverse(self._strengths[index], self.samples, self.poles)
            inflated = inverse[1:-1, index][span] / alone
            error = self._error(left[:, index], inverse[1:-1, index][span], index, span)
            reasons = self._reasons(order, reason, inflated, done, last)
            missing = (reasons >= 1) & (reasons <= 3)
            amplitude = np.where(missing, np.nan, values[:, index].T)
            tracks.append(
                OrderTrack(
                    order=order,
                    times_s=self.start_s
                    + np.arange(self._base, self._base + done, dtype=np.float64) * self._interval_s,
                    speeds_hz=frequency / order.order,
                    amplitude=amplitude,
                    error=np.where(missing, np.nan, error),
                    reason=reasons,
                )
            )
        return tuple(tracks)

    def _error(self, left: Complex, inverse: Array, index: int, span: slice) -> Array:
        """Standard error of the magnitude in rms, shape (n_channels, n)."""
        from scipy import ndimage

        band = self.orders[index].bandwidth_hz * self._interval_s
        seen = 4.0 * self.samples * 0.4793650794 * _left_share(band, self.poles)  # ∫ of the spline's square: 151/315
        width = max(3, round(4.0 / band))
        power = ndimage.uniform_filter1d(left.real**2 + left.imag**2, width, axis=0, mode="nearest")
        variance = power[1:-1][span] / seen * inverse[:, None] * (1.0 - 0.5 / self.poles)
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)).T)  # without any data: rounding of either sign

    def _reasons(
        self, order: TrackedOrder, reason: NDArray[np.int8], inflated: Array, done: int, last: bool
    ) -> NDArray[np.int8]:
        """Reason of each node, shape (n_channels, done)."""
        reach = max(1, math.ceil(EDGE[self.poles] / order.bandwidth_hz / self._interval_s))
        result = np.where((reason == 0) & _spread(reason == 5, reach), 5, reason)
        result = np.where((result == 0) & (inflated > INFLATED), 6, result)
        ends = np.zeros(done, dtype=bool)
        if self._base < reach:
            ends[: reach - self._base] = True
        if last:
            ends[max(0, done - reach) :] = True
        lost = (reason == 1) | (reason == 2)
        ends |= _spread(lost, reach)
        result = np.where(ends & ((result == 0) | (result == 6)), 4, result)
        gaps = np.array([_spread(bad, reach) for bad in self._bad[:, :done]])
        return np.where(gaps, 3, result[None]).astype(np.int8)


def _nodes(angle: ShaftAngle) -> tuple[Array, Array, Array]:
    return angle.times_s, angle.turns, angle.slopes_hz


def _refuse_twins(orders: Sequence[TrackedOrder]) -> None:
    for index, order in enumerate(orders):
        for other in orders[:index]:
            same = other.angle is order.angle and math.isclose(other.order, order.order, rel_tol=1e-9)
            if same:
                raise AnalysisError(f"order {order.order:g} of {order.angle.shaft or 'a shaft'} is there twice")


def _spread(mask: NDArray[np.bool_], reach: int) -> NDArray[np.bool_]:
    """Widen what is true by so many places on both sides."""
    if not mask.any():
        return mask
    count = np.concatenate(([0], np.cumsum(mask)))
    at = np.arange(mask.size)
    return count[np.minimum(at + reach + 1, mask.size)] > count[np.maximum(at - reach, 0)]


def _left_share(band: float, poles: int) -> float:
    """Part of white scatter, as a spline sees it, that the filter leaves beside the order."""
    frequency = np.linspace(-4.0, 4.0, 4001)  # turns an interval
    seen = np.sinc(frequency) ** 8
    gain = 1.0 / (1.0 + (math.sqrt(2.0) - 1.0) * (frequency / band) ** (2 * poles))
    return float(np.sum(seen * (1.0 - gain) ** 2) / np.sum(seen))


def _joined(pieces: list[OrderTrack]) -> OrderTrack:
    return OrderTrack(
        order=pieces[0].order,
        times_s=np.concatenate([piece.times_s for piece in pieces]),
        speeds_hz=np.concatenate([piece.speeds_hz for piece in pieces]),
        amplitude=np.concatenate([piece.amplitude for piece in pieces], axis=1),
        error=np.concatenate([piece.error for piece in pieces], axis=1),
        reason=np.concatenate([piece.reason for piece in pieces], axis=1),
    )

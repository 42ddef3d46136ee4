"""Tracks of orders by Vold-Kalman filter: which orders, how wide, and what comes of them over time and speed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.measured.order_levels import crossings
from tdacoustic.measured.order_pass import RasterSpan
from tdacoustic.measured.order_results import OrderLevels, Track
from tdacoustic.orders import (
    REASONS,
    FrequencyCurve,
    NamedOrder,
    OrderTrack,
    TrackedOrder,
    VoldKalman,
    advise_bandwidth,
)
from tdacoustic.orders.order_cut import PROMINENCE_DB, STEADY
from tdacoustic.orders.vold_kalman import FEWEST_SAMPLES, NODES_A_BANDWIDTH
from tdacoustic.speed import ShaftAngle

__all__ = ["TrackPass", "TrackSums", "chosen_orders"]

Array = NDArray[np.float64]

MOST_TRACKED: Final = 4
"""Orders that are tracked where nobody says which."""
LEAST_STRENGTH: Final = 0.01
"""Of an order that is tracked unasked: share of the energy of all orders [assumed]."""
LOSS_FACTOR: Final = 0.05
"""Of the resonances whose passing a tracked order is to follow [assumed]; narrower ones come out rounded."""
NEAR_SHARE: Final = 0.1
"""Strength over that of a tracked order from which on another one has to be kept out [assumed]."""
MOST_NODES: Final = 2000
"""Nodes of a track that are kept over time."""
DOUBTS: Final = (4, 5, 6)
"""Codes of `REASONS` that go with a value."""
SAME: Final = 1e-6


def chosen_orders(wanted: bool | tuple[float, ...], orders: Sequence[NamedOrder], strengths: Array) -> tuple[int, ...]:
    """Return which orders to track: those that are asked for, else the strongest.

    Parameters
    ----------
    wanted : bool or tuple of float
    orders : sequence of NamedOrder
    strengths : ndarray, shape (n_orders,)
        Shares, see `tdacoustic.orders.order_strengths`.
    """
    if wanted is True:
        ranked = np.argsort(-strengths)[:MOST_TRACKED]
        return tuple(int(index) for index in ranked if strengths[index] >= LEAST_STRENGTH)
    asked = wanted or ()
    return tuple(i for i, order in enumerate(orders) if any(abs(order.order - other) < SAME for other in asked))


@dataclass(frozen=True)
class _Choice:
    """An order to track, the bandwidth that was advised, and what there is to say about it."""

    order: NamedOrder
    tracked: TrackedOrder
    advised_hz: float
    notes: tuple[str, ...]


class TrackPass:
    """Tracks orders of all shafts jointly.

    Parameters
    ----------
    span : RasterSpan
    angle : ShaftAngle
        Of the reference shaft.
    orders : sequence of NamedOrder
        All that there are.
    chosen : sequence of int
        Those that are tracked.
    strengths : ndarray, shape (n_orders,)
    edges_hz : sequence of float
        Of the classes of speed, of the reference shaft.
    """

    def __init__(
        self,
        span: RasterSpan,
        angle: ShaftAngle,
        orders: Sequence[NamedOrder],
        chosen: Sequence[int],
        strengths: Array,
        edges_hz: Sequence[float],
    ) -> None:
        ratios = dict.fromkeys(order.ratio for order in orders)
        angles = {ratio: angle if ratio == 1.0 else angle.at_ratio(ratio) for ratio in ratios}
        choices = [_choice(span, angles, orders, chosen, index, strengths) for index in chosen]
        self._filter: VoldKalman | None = None
        self._sums: list[TrackSums] = []
        if not choices:
            return
        tracked = [choice.tracked for choice in choices]
        self._filter = VoldKalman(tracked, span.sample_rate_hz, span.n_channels, start_s=span.start_s)
        nodes = int(span.duration_s * span.sample_rate_hz / self._filter.samples)
        self._sums = [
            TrackSums(choice.order, choice.notes, edges_hz, span.n_channels, nodes, choice.advised_hz)
            for choice in choices
        ]

    @property
    def active(self) -> bool:
        """Whether there is an order to track."""
        return self._filter is not None

    def take(self, block: Array) -> None:
        """Add samples, shape (n_channels, n), in order."""
        if self._filter is not None:
            self._gather(self._filter.take(block))

    def finish(self) -> None:
        """Solve what is left; after the last block."""
        if self._filter is not None:
            self._gather(self._filter.finish())

    def _gather(self, pieces: Sequence[Sequence[OrderTrack]]) -> None:
        for piece in pieces:
            for sums, track in zip(self._sums, piece, strict=True):
                sums.take(track)

    def results(
        self, channel: int, curves: Sequence[FrequencyCurve]
    ) -> tuple[tuple[OrderLevels, ...], tuple[Track, ...]]:
        """Return levels and tracks of a channel.

        Parameters
        ----------
        channel : int
        curves : sequence of FrequencyCurve
            Whose coming near an order is stated.
        """
        return (
            tuple(sums.levels(channel, curves) for sums in self._sums),
            tuple(sums.track(channel) for sums in self._sums),
        )


def _choice(
    span: RasterSpan,
    angles: dict[float, ShaftAngle],
    orders: Sequence[NamedOrder],
    chosen: Sequence[int],
    index: int,
    strengths: Array,
) -> _Choice:
    """Bandwidth of one order: as wide as following asks for, within what keeps the others out."""

    def pairs(others: Sequence[NamedOrder]) -> list[tuple[ShaftAngle, float]]:
        return [(angles[other.ratio], other.of_shaft) for other in others]

    order = orders[index]
    joint = [orders[other] for other in chosen if other != index]
    strong = [
        other
        for place, other in enumerate(orders)
        if place not in chosen and strengths[place] >= NEAR_SHARE * strengths[index] > 0.0
    ]
    own = angles[order.ratio]
    advice = [
        advise_bandwidth(own, order.of_shaft, pairs(joint), loss_factor=LOSS_FACTOR),
        advise_bandwidth(own, order.of_shaft, pairs(strong), joint=False, loss_factor=LOSS_FACTOR),
    ]
    best = min(advice, key=lambda item: item.bandwidth_hz)
    widest = 0.99 * span.sample_rate_hz / (NODES_A_BANDWIDTH * FEWEST_SAMPLES)
    band = min(max(best.bandwidth_hz, best.shortest_hz), widest)
    notes = best.notes
    if band < 0.999 * best.bandwidth_hz:
        notes = (*notes, f"{best.bandwidth_hz:.3g} Hz were advised, the sampling rate allows {band:.3g} Hz")
    return _Choice(order, TrackedOrder(own, order.of_shaft, band, order.name), best.bandwidth_hz, notes)


class TrackSums:
    """Gathers the pieces of a tracked order in classes of speed, and thins them for keeping.

    Parameters
    ----------
    order : NamedOrder
    notes : tuple of str
        On its bandwidth.
    edges_hz : sequence of float
        Of the classes, of the reference shaft.
    n_channels : int
    nodes : int
        In the whole record, about.
    requested_hz : float
        Bandwidth as advised.
    """

    def __init__(
        self,
        order: NamedOrder,
        notes: tuple[str, ...],
        edges_hz: Sequence[float],
        n_channels: int,
        nodes: int,
        requested_hz: float,
    ) -> None:
        self.order, self.notes, self._requested_hz = order, notes, requested_hz
        self._edges = np.asarray(edges_hz, dtype=np.float64)
        self._stride = max(1, math.ceil(nodes / MOST_NODES))
        self._seen = 0
        rows = self._edges.size - 1
        self._count, self._doubtful = np.zeros((n_channels, rows)), np.zeros((n_channels, rows, len(REASONS)))
        self._power, self._error = np.zeros((n_channels, rows)), np.zeros((n_channels, rows))
        self._sum = np.zeros((n_channels, rows), dtype=np.complex128)
        self._nodes, self._speed = np.zeros(rows), np.zeros(rows)
        self._kept: list[OrderTrack] = []

    def take(self, piece: OrderTrack) -> None:
        """Add a piece, in order."""
        speeds = piece.speeds_hz / self.order.ratio
        with np.errstate(invalid="ignore"):
            row = np.searchsorted(self._edges, speeds, side="right") - 1
        inside = np.isfinite(speeds) & (row >= 0) & (row < self._edges.size - 1)
        np.add.at(self._nodes, row[inside], 1.0)
        np.add.at(self._speed, row[inside], speeds[inside])
        for channel, (amplitude, reason) in enumerate(zip(piece.amplitude, piece.reason, strict=True)):
            np.add.at(self._doubtful[channel], (row[inside], reason[inside]), 1.0)
            good = inside & np.isfinite(amplitude) & np.isin(reason, (0, 5, 6))
            at = row[good]
            np.add.at(self._count[channel], at, 1.0)
            np.add.at(self._power[channel], at, np.abs(amplitude[good]) ** 2)
            # of the magnitude: what is in phase with the order, half of the noise that the filter lets through
            np.add.at(self._error[channel], at, 2.0 * piece.error[channel, good] ** 2)
            np.add.at(self._sum[channel], at, amplitude[good])
        skip = (-self._seen) % self._stride
        self._seen += piece.times_s.size
        span = slice(skip, None, self._stride)
        self._kept.append(  # copies: a view would hold all of the piece, and memory would grow with the record
            OrderTrack(
                piece.order,
                piece.times_s[span].copy(),
                piece.speeds_hz[span].copy(),
                piece.amplitude[:, span].copy(),
                piece.error[:, span].copy(),
                piece.reason[:, span].copy(),
            )
        )

    def track(self, channel: int) -> Track:
        """Return what is kept of a channel over time."""
        kept = self._kept
        return Track(
            order=self.order,
            bandwidth_hz=kept[0].order.bandwidth_hz,
            notes=self.notes,
            times_s=np.concatenate([piece.times_s for piece in kept]),
            speeds_hz=np.concatenate([piece.speeds_hz for piece in kept]) / self.order.ratio,
            amplitude=np.concatenate([piece.amplitude[channel] for piece in kept]),
            error=np.concatenate([piece.error[channel] for piece in kept]),
            reason=np.concatenate([piece.reason[channel] for piece in kept]),
        )

    def levels(self, channel: int, curves: Sequence[FrequencyCurve]) -> OrderLevels:
        """Return the levels of a channel over the classes that the run passed.

        A curve within twice the bandwidth is a doubt.
        """
        band_hz = self._kept[0].order.bandwidth_hz
        rows = np.flatnonzero(self._nodes > 0.0)
        count = self._count[channel, rows]
        speeds = self._speed[rows] / self._nodes[rows]
        with np.errstate(invalid="ignore", divide="ignore"):
            power, mean = self._power[channel, rows] / count, self._sum[channel, rows] / count
            scatter = self._error[channel, rows] / count
            worth = np.maximum(1.0, count / 16.0)  # 16 nodes are one independent value
            out = power >= 10.0 ** (0.1 * PROMINENCE_DB) * scatter
            level = np.where(count > 0, np.where(out, power - scatter, power), np.nan)
            error = np.sqrt((2.0 * level * scatter + scatter**2) / worth)
            steadiness = np.clip(np.abs(mean) ** 2 / power, 0.0, 1.0)
            phase_error = np.sqrt(0.5 * scatter / worth / np.maximum(power, 1e-300))
        steady = out & (steadiness >= STEADY)
        half = 2.0 * band_hz / speeds
        crossed = [crossings(curve, self.order, self._edges[rows], self._edges[rows + 1], half) for curve in curves]
        reasons = [
            "; ".join(
                part
                for part in (
                    self._words(channel, int(row), bool(out[index])),
                    "unsteady phase" if out[index] and not steady[index] else "",
                    *(words[index] if count[index] else "" for words in crossed),
                )
                if part
            )
            for index, row in enumerate(rows)
        ]
        return OrderLevels(
            order=self.order,
            method="vold_kalman",
            requested_bandwidth=2.0 * self._requested_hz / float(np.median(speeds)) if speeds.size else math.nan,
            bandwidth=2.0 * band_hz / speeds,
            speeds_hz=speeds,
            mean_square=level,
            error=error,
            floor=np.where(count > 0, scatter, np.nan),
            phase_rad=np.where(steady, np.angle(mean), np.nan),
            phase_error_rad=np.where(steady, phase_error, np.nan),
            steadiness=np.where(count > 0, steadiness, np.nan),
            reasons=tuple(reasons),
        )

    def _words(self, channel: int, row: int, out: bool) -> str:
        codes = self._doubtful[channel, row]
        parts = []
        if not self._count[channel, row]:
            worst = int(np.argmax(codes[1:])) + 1
            return REASONS[worst] if REASONS[worst].startswith("no value") else f"no value: {REASONS[worst]}"
        parts += [REASONS[code] for code in DOUBTS if codes[code] > 0.1 * codes.sum()]
        if not out:
            parts.append(f"less than {PROMINENCE_DB:g} dB above the floor")
        return "; ".join(parts)

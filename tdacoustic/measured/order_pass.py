"""One reading of a raster for its orders: maps, cuts with sidebands, or averages of the turns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.measured.order_levels import levels_of_cut, levels_out_of_reach
from tdacoustic.measured.order_results import Average, ChannelOrders, OrderLevels, Sidebands
from tdacoustic.measured.shaft_frames import ShaftFrames, plan_turn_frames, rows_for
from tdacoustic.orders import (
    CutMeter,
    EvenTime,
    Frames,
    FrequencyCurve,
    LineFrames,
    MapMeter,
    NamedOrder,
    Neighbour,
    OrderCut,
    OrderMap,
    SpeedRows,
    SynchronousMeter,
    TimeRows,
    plan_line_frames,
    sideband_families,
    sideband_orders,
)
from tdacoustic.orders.order_cut import SIDE_LINES
from tdacoustic.speed import ShaftAngle

__all__ = ["AveragePass", "CutPass", "MapPass", "RasterSpan"]

Array = NDArray[np.float64]

LINES_A_BANDWIDTH: Final = 4.0
"""Lines in the bandwidth of a cut: the main lobe of a Hann window."""
MOST_SPEEDS: Final = 40
"""Classes of speed of a cut."""
FINE_SPEEDS: Final = 200
"""Classes for telling resonances from orders."""
MAP_SPEEDS: Final = 100
MAP_TIMES: Final = 150
"""Rows of the maps."""
SIDEBAND_SPEEDS: Final = 8
SIDEBANDS: Final = 3
"""On each side of a carrier."""
SIDEBAND_LINES: Final = 4.5
"""Lines between neighbouring sidebands, so that no band reaches into the next."""


@dataclass(frozen=True)
class RasterSpan:
    """What a raster covers.

    Parameters
    ----------
    names : tuple of str
    n_channels : int
    sample_rate_hz, start_s, duration_s : float
    lowest_hz, highest_hz : float
        Speed of the reference shaft.
    turns : float
        Of it, while its angle is known.
    highest_order : float
    steady : bool
    shaft : str
    """

    names: tuple[str, ...]
    n_channels: int
    sample_rate_hz: float
    start_s: float
    duration_s: float
    lowest_hz: float
    highest_hz: float
    turns: float
    highest_order: float
    steady: bool
    shaft: str

    def speed_rows(self, count: int) -> SpeedRows:
        """Return classes of the speed; one that holds all of a steady run."""
        if self.steady:
            return SpeedRows((0.5 * self.lowest_hz, 2.0 * self.highest_hz))
        return SpeedRows.even(0.998 * self.lowest_hz, 1.002 * self.highest_hz, count)

    def frames_in(self, plan: LineFrames, turns: float) -> float:
        """Return about how many frames so many turns have."""
        return max(1.0, (turns * plan.per_unit - plan.length) / plan.hop + 1.0)


class MapPass:
    """Maps over order and speed, order and time, frequency and speed.

    Parameters
    ----------
    span : RasterSpan
    angle : ShaftAngle
        Of the reference shaft.
    resolution_hz : float
        Of the map over frequency.
    bandwidth : float
        Of the cuts, in orders; lines are a quarter of it apart.
    """

    def __init__(self, span: RasterSpan, angle: ShaftAngle, resolution_hz: float, bandwidth: float) -> None:
        rate, channels = span.sample_rate_hz, span.n_channels
        self.shaft = ShaftFrames(angle, rate, span.start_s, span.highest_order)
        plan = plan_turn_frames(self.shaft.samples_per_turn, bandwidth / LINES_A_BANDWIDTH, span.turns)
        frames = span.frames_in(plan, span.turns)
        speeds = span.speed_rows(rows_for(frames, 1.5, 4, MAP_SPEEDS))
        n_times = rows_for(frames, 1.0, 4, MAP_TIMES)
        times = TimeRows(span.start_s, span.duration_s / n_times, n_times)
        self._by_speed = MapMeter(plan, speeds, channels, "order", span.highest_order, rate, errors=False)
        self._by_time = MapMeter(plan, times, channels, "order", span.highest_order, rate, errors=False)
        self.shaft.read_by(plan, [self._by_speed, self._by_time])
        seconds = plan_line_frames(rate, min(max(resolution_hz, 4.0 / span.duration_s), rate / 16.0), overlap=0.5)
        self._even = EvenTime(angle, rate, span.start_s)
        self._by_frequency = MapMeter(seconds, speeds, channels, "frequency", 0.5 * rate, rate, errors=False)
        self._seconds = Frames(seconds, [self._by_frequency])

    def take(self, block: Array) -> None:
        """Add samples, shape (n_channels, n), in order."""
        self.shaft.take(block)
        self._seconds.take(self._even.take(block))

    def results(self) -> tuple[OrderMap, OrderMap, OrderMap]:
        """Return the maps over order and speed, order and time, frequency and speed."""
        return self._by_speed.result(), self._by_time.result(), self._by_frequency.result()


@dataclass(frozen=True)
class _Cuts:
    """The meters of one shaft's orders."""

    orders: tuple[NamedOrder, ...]
    coarse: CutMeter
    fine: CutMeter | None
    edges_hz: tuple[float, ...]


class CutPass:
    """Cuts along orders of all shafts, and sidebands.

    Parameters
    ----------
    span : RasterSpan
    angle : ShaftAngle
        Of the reference shaft.
    orders : sequence of NamedOrder
    curves : sequence of FrequencyCurve
    bandwidth : float
        In orders of each order's own shaft. What was had is `CutPass.bandwidth`, the classes `CutPass.edges_hz`.
    carriers : sequence of str
        Names of orders.
    spacings : sequence of (str, float)
    shaft : ShaftFrames, optional
        Of the reference shaft, where another pass takes its samples.
    known : sequence of NamedOrder
        Further orders, whose coming into a band is stated.
    edges_hz : sequence of float
        Classes of speed, where another pass has them.
    """

    def __init__(
        self,
        span: RasterSpan,
        angle: ShaftAngle,
        orders: Sequence[NamedOrder],
        curves: Sequence[FrequencyCurve],
        bandwidth: float,
        carriers: Sequence[str],
        spacings: Sequence[tuple[str, float]],
        shaft: ShaftFrames | None = None,
        known: Sequence[NamedOrder] = (),
        edges_hz: Sequence[float] = (),
    ) -> None:
        self._known, self._classes = tuple(known), tuple(edges_hz)
        self._span, self._angle, self._curves, self._requested = span, angle, tuple(curves), bandwidth
        self.bandwidth = 0.0
        self._beyond = tuple(order for order in orders if order.order + 0.5 * bandwidth > span.highest_order)
        self.orders = tuple(order for order in orders if order not in self._beyond)
        self.edges_hz = span.speed_rows(MOST_SPEEDS).edges_hz
        self._fed = shaft is not None
        highest = span.highest_order
        if known and self.orders:  # a few orders by themselves: no more samples a turn than they and their floors take
            beside = bandwidth * (0.5 + (SIDE_LINES + 4) / LINES_A_BANDWIDTH)
            highest = min(highest, max(order.order for order in self.orders) + beside)
        self.shaft = shaft or ShaftFrames(angle, span.sample_rate_hz, span.start_s, highest)
        self._cuts: list[_Cuts] = []
        self._sides: list[tuple[tuple[NamedOrder, ...], str, float, CutMeter]] = []
        self._notes: list[str] = []
        ratios = dict.fromkeys([1.0, *(order.ratio for order in self.orders)])
        for ratio in ratios:
            self._add_cuts(ratio, tuple(order for order in self.orders if order.ratio == ratio))
        self._add_sidebands([order for order in self.orders if order.name in carriers], spacings)

    def _add_cuts(self, ratio: float, orders: tuple[NamedOrder, ...]) -> None:
        """Add meters of the orders of one shaft; their frames hold as many turns of it, whichever it is."""
        if not orders:
            return
        span, requested = self._span, self._requested * ratio
        plan = plan_turn_frames(self.shaft.samples_per_turn, requested / LINES_A_BANDWIDTH, span.turns)
        frames = span.frames_in(plan, span.turns)
        own, reach = [order.order for order in orders], requested + 8.0 * plan.resolution
        others = [
            Neighbour(self._angle, order.order, order.name)
            for order in (*(order for order in self.orders if order.ratio != ratio), *self._known)
            if min(abs(order.order - one) for one in own) < reach
        ]

        def meter(rows: SpeedRows) -> CutMeter:
            return CutMeter(plan, own, rows, span.n_channels, span.sample_rate_hz, requested, neighbours=others)

        rows = SpeedRows(self._classes) if self._classes else span.speed_rows(rows_for(frames, 3.0, 3, MOST_SPEEDS))
        coarse = meter(rows)
        fine = None if span.steady else meter(span.speed_rows(rows_for(frames, 1.0, 8, FINE_SPEEDS)))
        self.shaft.read_by(plan, [coarse] if fine is None else [coarse, fine])
        self._cuts.append(_Cuts(orders, coarse, fine, rows.edges_hz))
        if ratio == 1.0 or not self.bandwidth:
            self.bandwidth = coarse.bandwidth
        if ratio == 1.0:
            self.edges_hz = rows.edges_hz

    def _add_sidebands(self, carriers: Sequence[NamedOrder], spacings: Sequence[tuple[str, float]]) -> None:
        span = self._span
        for name, spacing in spacings if carriers else ():
            held = tuple(item for item in carriers if item.order + SIDEBANDS * spacing < span.highest_order)
            resolution = spacing / SIDEBAND_LINES
            plan = plan_turn_frames(self.shaft.samples_per_turn, resolution, span.turns, overlap=0.5)
            if plan.resolution > 1.05 * resolution or not held:
                self._notes.append(
                    f"sidebands of the {name} are not told apart: its spacing of {spacing:.3g} orders takes "
                    f"{6.0 / resolution:.0f} turns, the run has {span.turns:.0f}"
                    if held
                    else f"sidebands of the {name} lie beyond order {span.highest_order:.4g}"
                )
                continue
            frames = span.frames_in(plan, span.turns)
            rows = span.speed_rows(rows_for(frames, 4.0, 1, SIDEBAND_SPEEDS))
            orders = sideband_orders([item.order for item in held], [spacing], SIDEBANDS)
            meter = CutMeter(plan, orders, rows, span.n_channels, span.sample_rate_hz)
            self.shaft.read_by(plan, [meter])
            self._sides.append((held, name, spacing, meter))

    def take(self, block: Array) -> None:
        """Add samples, shape (n_channels, n), in order; nothing to do where another pass takes them."""
        if not self._fed:
            self.shaft.take(block)

    def fine_cuts(self) -> tuple[OrderCut, ...]:
        """Return the cuts of the reference shaft's orders over fine classes of speed."""
        held = [item.fine for item in self._cuts if item.fine is not None and item.orders[0].ratio == 1.0]
        return tuple(cut for meter in held for cut in meter.result())

    def results(self) -> tuple[ChannelOrders, ...]:
        """Return what was found, by channel."""
        span = self._span
        levels: list[list[OrderLevels]] = [[] for _ in range(span.n_channels)]
        for item in self._cuts:
            cuts = item.coarse.result()
            for index, cut in enumerate(cuts):
                order = item.orders[index // span.n_channels]
                levels[cut.channel].append(levels_of_cut(cut, order, self._curves, item.edges_hz))
        why = f"beyond order {span.highest_order:.4g}, up to which the run's orders were looked for"
        sidebands = self._sidebands()
        names = span.names
        return tuple(
            ChannelOrders(
                names[channel],
                levels=(
                    *levels[channel],
                    *(levels_out_of_reach(order, self._requested, span.lowest_hz, why) for order in self._beyond),
                ),
                sidebands=tuple(sidebands[channel]),
                notes=tuple(self._notes),
            )
            for channel in range(span.n_channels)
        )

    def _sidebands(self) -> list[list[Sidebands]]:
        found: list[list[Sidebands]] = [[] for _ in range(self._span.n_channels)]
        for carriers, name, spacing, meter in self._sides:
            cuts = meter.result()
            for carrier in carriers:
                # orders of a meter are rounded: the carrier's own spelling is that of `sideband_orders`
                for family in sideband_families(cuts, [round(carrier.order, 6)], [spacing], SIDEBANDS):
                    found[family.channel].append(Sidebands(carrier.name, name, family))
        return found


class AveragePass:
    """Time-synchronous averages of the reference shaft and of those that turn with it.

    Parameters
    ----------
    span : RasterSpan
    reference : ShaftFrames
        Of the reference shaft; its samples are taken by who owns it.
    ratios : sequence of (str, float), or None
        Of the other shafts; None where no tacho counts the turns, so that there is nothing to average by.
    """

    def __init__(self, span: RasterSpan, reference: ShaftFrames, ratios: Sequence[tuple[str, float]] | None) -> None:
        self._span = span
        self._held: list[tuple[str, float, SynchronousMeter, ShaftFrames]] = []
        for name, ratio in () if ratios is None else ((span.shaft, 1.0), *ratios):
            shaft = reference
            if ratio != 1.0:
                own = reference.angle.at_ratio(ratio)
                shaft = ShaftFrames(own, span.sample_rate_hz, span.start_s, span.highest_order / ratio)
            meter = SynchronousMeter(shaft.samples_per_turn, span.n_channels)
            shaft.average_with(meter)
            self._held.append((name, ratio, meter, shaft))

    def take(self, block: Array) -> None:
        """Add samples, shape (n_channels, n), in order."""
        for _, ratio, _, shaft in self._held:
            if ratio != 1.0:
                shaft.take(block)

    def results(self) -> list[tuple[tuple[Average, ...], tuple[str, ...]]]:
        """Return averages, and notes on what could not be had, by channel."""
        averages: list[list[Average]] = [[] for _ in range(self._span.n_channels)]
        notes: list[str] = []
        for name, ratio, meter, _ in self._held:
            try:
                held = meter.result()
            except AnalysisError as error:
                notes.append(f"no synchronous average of the {name}: {error}")
                continue
            for channel, found in enumerate(averages):
                found.append(
                    Average(
                        shaft=name,
                        ratio=ratio,
                        periods=int(held.periods[channel]),
                        speed_hz=held.speed_hz,
                        waveform=held.mean[channel],
                        error=held.error[channel],
                        residual_mean_square=float(held.residual_mean_square[channel]),
                    )
                )
        return [(tuple(found), tuple(notes)) for found in averages]

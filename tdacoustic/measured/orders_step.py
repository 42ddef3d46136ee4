"""Step: the orders of a run, over the angle of its shafts.

The log of a run-up is read for the maps, the cuts and the sidebands, and again for what follows from the maps: cuts of
orders that nobody named, and the Vold-Kalman filter on the strongest. That of a steady run is read once: one class of
speed, no maps over it, but the time-synchronous average. Memory does not depend on the log's length.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.formats import scan
from tdacoustic.measured.order_pass import AveragePass, CutPass, MapPass, RasterSpan
from tdacoustic.measured.order_results import ChannelOrders, LevelMap, RunOrders
from tdacoustic.measured.order_tracks import TrackPass, chosen_orders
from tdacoustic.measured.results import RunSpeed
from tdacoustic.measured.shaft_frames import ShaftFrames, turns_within
from tdacoustic.orders import (
    FixedFrequency,
    FrequencyCurve,
    NamedOrder,
    OrderCut,
    OrderMap,
    find_fixed_frequencies,
    find_orders,
    order_strengths,
)
from tdacoustic.orders.resampling import PASS_SHARE
from tdacoustic.recording import Channel, Recording
from tdacoustic.speed import ShaftAngle
from tdacoustic.steps import LogFile, Step
from tdacoustic.steps.progress import tell_progress

__all__ = ["ORDERS", "OrderSettings", "run_orders"]

Array = NDArray[np.float64]

BLOCK_BYTES: Final = 8 * 2**20
"""Samples of all channels read together, as float64."""
FINE_CELLS: Final = 800
"""Lines of a map that are kept one by one; above, each cell holds the strongest of ever more."""
COARSE_CELLS: Final = 600
FEWEST_TURNS: Final = 12.0
"""Below, a run says nothing about its orders [assumed]."""
MOST_FOUND: Final = 12
"""Orders that nobody named, of all channels together."""
SIDEBANDS: Final = 2
"""Sidebands on each side of a carrier that a found order may be; further ones meet by chance [assumed]."""
SAME_ORDER: Final = 0.25
"""Part of the bandwidth by which a found order may miss a sideband and still be it [assumed]."""


@dataclass(frozen=True)
class OrderSettings:
    """What orders of a run are looked for, and how.

    Parameters
    ----------
    channels : tuple of Channel
        Signals in order, as read.
    steady : bool
        Whether the speed is constant.
    teller : str
        Channel whose speed or angle counts.
    turns_per_unit : float
        Turns of the reference shaft for one of the teller's (or for a metre of the train).
    shaft : str
        Reference shaft.
    counted : bool
        Whether the teller is a tacho, so that each turn has its place.
    ratios : tuple of (str, float)
        Turns of the other shafts for one of the reference shaft.
    orders : tuple of NamedOrder
    curves : tuple of FrequencyCurve
    carriers : tuple of str
        Names of the orders whose sidebands are looked for.
    spacings : tuple of (str, float)
        Shafts that may space them, in orders of the reference shaft.
    bandwidth : float
        Of a cut, in orders of the order's own shaft.
    highest_order : float
        Of the reference shaft.
    resolution_hz : float
        Of the map over frequency.
    vold_kalman : bool or tuple of float
        Whether the strongest orders are tracked, or which ones.
    """

    channels: tuple[Channel, ...]
    steady: bool
    teller: str
    turns_per_unit: float
    shaft: str
    counted: bool
    ratios: tuple[tuple[str, float], ...]
    orders: tuple[NamedOrder, ...]
    curves: tuple[FrequencyCurve, ...]
    carriers: tuple[str, ...]
    spacings: tuple[tuple[str, float], ...]
    bandwidth: float
    highest_order: float
    resolution_hz: float
    vold_kalman: bool | tuple[float, ...]


def run_orders(settings: OrderSettings, logs: tuple[LogFile, ...], speed: RunSpeed) -> RunOrders:
    """Step: the orders of a run; a raster that has none stops no other.

    Raises
    ------
    AnalysisError
        The angle of the shaft is nowhere known, or it turns too little while any raster was recorded.
    """
    angle = _reference(settings, speed)
    recording = Recording("run", tuple(scan(log.path) for log in logs), settings.channels)
    names = recording.rasters()
    sizes = [recording[group[0]].n_samples * len(group) for group in names]
    channels: list[ChannelOrders] = []
    spans: list[RasterSpan] = []
    orders: dict[str, NamedOrder] = {order.name: order for order in settings.orders}
    bandwidth = 0.0
    refused: list[AnalysisError] = []
    for number, group in enumerate(names):
        before = sum(sizes[:number]) / sum(sizes)
        share = sizes[number] / sum(sizes)
        try:
            found = _Raster(settings, recording, group, angle).orders(_Teller(before, share))
        except AnalysisError as error:
            refused.append(error)
            channels += [ChannelOrders(name, notes=(f"no orders of {name}: {error}",)) for name in group]
            continue
        channels += found.channels
        spans.append(found.span)
        orders |= {order.name: order for order in found.orders}
        bandwidth = max(bandwidth, found.bandwidth)
    if not spans:
        raise refused[0]
    position = {channel.name: index for index, channel in enumerate(settings.channels)}
    return RunOrders(
        shaft=settings.shaft,
        speed_source=settings.teller,
        steady=settings.steady,
        lowest_hz=min(span.lowest_hz for span in spans),
        highest_hz=max(span.highest_hz for span in spans),
        requested_bandwidth=settings.bandwidth,
        bandwidth=bandwidth,
        highest_order=max(span.highest_order for span in spans),
        orders=tuple(sorted(orders.values(), key=lambda item: item.order)),
        curves=settings.curves,
        channels=tuple(sorted(channels, key=lambda item: position[item.channel])),
        notes=angle.notes,
    )


def _reference(settings: OrderSettings, speed: RunSpeed) -> ShaftAngle:
    """Angle of the reference shaft."""
    held = next((item for item in speed.angles if item.channel == settings.teller), None)
    if held is not None:
        return held.at_ratio(settings.turns_per_unit, settings.shaft)
    profile = next((item for item in speed.profiles if item.channel == settings.teller), None)
    if profile is None:
        raise AnalysisError(f"channel {settings.teller!r} gives no speed")
    return ShaftAngle.from_profile(profile, settings.turns_per_unit, settings.shaft)


@dataclass(frozen=True)
class _Found:
    """What one raster gave."""

    channels: tuple[ChannelOrders, ...]
    span: RasterSpan
    orders: tuple[NamedOrder, ...]
    bandwidth: float


@dataclass(frozen=True)
class _Teller:
    """Tells progress of a part of the work."""

    before: float
    share: float

    def __call__(self, part: float) -> None:
        tell_progress(self.before + self.share * part)


class _Raster:
    """The channels of one raster."""

    def __init__(self, settings: OrderSettings, recording: Recording, names: Sequence[str], angle: ShaftAngle) -> None:
        self.settings, self.recording, self.names, self.angle = settings, recording, tuple(names), angle
        self.span = _span(recording[names[0]], angle, settings, self.names)

    def orders(self, tell: Callable[[float], None]) -> _Found:
        """Read the raster as often as it takes."""
        if self.settings.steady:
            return self._steady(tell)
        maps = MapPass(self.span, self.angle, self.settings.resolution_hz, self.settings.bandwidth)
        cuts = self._cut_pass(self.settings.orders, shaft=maps.shaft)
        self._read(maps.take, lambda part: tell(0.5 * part))
        order_map, time_map, frequency_map = maps.results()
        named = [order.order for order in self.settings.orders]
        apart = max(self.settings.bandwidth, 4.0 * order_map.resolution)
        new = find_orders(order_map, named, apart)[:MOST_FOUND]
        found = _named(new, self.settings)
        further = self._cut_pass(found, known=cuts.orders, edges_hz=cuts.edges_hz if cuts.orders else ())
        edges_hz = (cuts if cuts.orders else further).edges_hz
        tracks = self._track_pass((*cuts.orders, *further.orders), edges_hz, order_map)

        def take(block: Array) -> None:
            further.take(block)
            tracks.take(block)

        if further.orders or tracks.active:
            self._read(take, lambda part: tell(0.5 + 0.5 * part))
            tracks.finish()
        fine = cuts.fine_cuts() + further.fine_cuts()
        channels = []
        for index, (channel, more) in enumerate(zip(cuts.results(), further.results(), strict=True)):
            fixed, notes = _fixed(fine, frequency_map, index)
            levels, tracked = tracks.results(index, self.settings.curves)
            level_maps = (
                _level_map(order_map, "speed", index),
                _level_map(time_map, "time", index),
                _level_map(frequency_map, "speed", index),
            )
            channels.append(
                replace(
                    channel,
                    levels=channel.levels + more.levels + levels,
                    tracks=tracked,
                    maps=level_maps,
                    fixed=fixed,
                    notes=channel.notes + notes,
                )
            )
        return _Found(tuple(channels), self.span, tuple(found), cuts.bandwidth)

    def _track_pass(self, orders: Sequence[NamedOrder], edges_hz: Sequence[float], order_map: OrderMap) -> TrackPass:
        """The filter on the orders that are asked for, or on the strongest in a map."""
        strengths = order_strengths(order_map, [order.order for order in orders], self.settings.bandwidth)
        chosen = chosen_orders(self.settings.vold_kalman, orders, strengths)
        return TrackPass(self.span, self.angle, orders, chosen, strengths, edges_hz)

    def _steady(self, tell: Callable[[float], None]) -> _Found:
        cuts = self._cut_pass(self.settings.orders)
        averages = AveragePass(self.span, cuts.shaft, self.settings.ratios if self.settings.counted else None)

        def take(block: Array) -> None:
            cuts.take(block)
            averages.take(block)

        self._read(take, tell)
        channels = []
        for channel, (average, notes) in zip(cuts.results(), averages.results(), strict=True):
            channels.append(replace(channel, averages=average, notes=channel.notes + notes))
        return _Found(tuple(channels), self.span, (), cuts.bandwidth)

    def _cut_pass(
        self,
        orders: Sequence[NamedOrder],
        shaft: ShaftFrames | None = None,
        known: Sequence[NamedOrder] = (),
        edges_hz: Sequence[float] = (),
    ) -> CutPass:
        own = self.settings
        sides = (own.carriers, own.spacings)
        return CutPass(self.span, self.angle, orders, own.curves, own.bandwidth, *sides, shaft, known, edges_hz)

    def _read(self, take: Callable[[Array], None], tell: Callable[[float], None]) -> None:
        size = max(1024, BLOCK_BYTES // (8 * len(self.names)))
        seen, total = 0, self.recording[self.names[0]].n_samples
        for block in self.recording.blocks(self.names, size):
            take(block)
            seen += block.shape[1]
            tell(seen / total)


def _span(first: Channel, angle: ShaftAngle, settings: OrderSettings, names: tuple[str, ...]) -> RasterSpan:
    """Speeds and turns that a raster covers."""
    start_s, end_s = first.start_s, first.start_s + first.duration_s
    times = np.linspace(max(start_s, angle.first_s), min(end_s, angle.last_s), 4001)
    speeds = angle.speed_hz_at(times) if times[-1] > times[0] else np.zeros(0)
    speeds = speeds[np.isfinite(speeds) & (speeds > 0.0)]
    turns = turns_within(angle, start_s, end_s) if speeds.size else 0.0
    if turns < FEWEST_TURNS:
        raise AnalysisError(
            f"the {settings.shaft or 'shaft'} turns {turns:.3g} times while its angle is known (channel "
            f"{settings.teller!r}, {angle.first_s:.3g} to {angle.last_s:.3g} s of {start_s:.3g} to {end_s:.3g} s); "
            f"orders take {FEWEST_TURNS:g} turns at least"
        )
    low, high = (float(value) for value in np.percentile(speeds, [0.2, 99.8]))
    highest = min(settings.highest_order, PASS_SHARE * first.sample_rate_hz / low)
    return RasterSpan(
        names=names,
        n_channels=len(names),
        sample_rate_hz=first.sample_rate_hz,
        start_s=start_s,
        duration_s=first.duration_s,
        lowest_hz=low,
        highest_hz=high,
        turns=turns,
        highest_order=highest,
        steady=settings.steady,
        shaft=settings.shaft,
    )


def _named(found: Sequence[float], settings: OrderSettings) -> list[NamedOrder]:
    """Orders that nobody named: by the family whose sideband they are, else by their number.

    Two numbers that four digits do not tell apart have more.
    """
    taken = {order.name for order in settings.orders}
    named = []
    for order in found:
        sideband = _sideband(order, settings)
        spellings = [f"order {order:.{digits}g}" for digits in (4, 6, 9)]
        if sideband is not None and sideband[0] not in taken:
            spellings, order = [sideband[0]], sideband[1]
        name = next((text for text in spellings if text not in taken), spellings[-1])
        taken.add(name)
        named.append(NamedOrder(name, "found", order, settings.shaft))
    return named


def _sideband(order: float, settings: OrderSettings) -> tuple[str, float] | None:
    """Name and exact order of the sideband that an order is: the nearest of the lowest number; None of none."""
    carriers = {item.name: item.order for item in settings.orders if item.name in settings.carriers}
    for number in range(1, SIDEBANDS + 1):
        sidebands = [
            (f"{name} {'+' if sign > 0 else '-'} {'' if number == 1 else f'{number} x '}{shaft}", exact)
            for name, carrier in carriers.items()
            for shaft, spacing in settings.spacings
            for sign in (1, -1)
            if (exact := carrier + sign * number * spacing) > 0.0
        ]
        name, exact = min(sidebands, key=lambda item: abs(item[1] - order), default=("", math.inf))
        if abs(exact - order) <= SAME_ORDER * settings.bandwidth:
            return name, exact
    return None


def _level_map(held: OrderMap, over: str, index: int) -> LevelMap:
    """One channel of a map, with no more cells than are of use."""
    power = held.mean_square[index].copy()
    power[held.axis[None] > held.highest[:, None]] = np.nan
    axis = held.axis
    if axis.size > FINE_CELLS + COARSE_CELLS:
        above = np.geomspace(FINE_CELLS, axis.size, COARSE_CELLS + 1).astype(int)[:-1]
        first = np.unique(np.concatenate((np.arange(FINE_CELLS), above)))
        last = np.append(first[1:], axis.size) - 1
        power, axis = np.fmax.reduceat(power, first, axis=1), 0.5 * (axis[first] + axis[last])
    return LevelMap(
        over="time" if over == "time" else "speed",
        domain=held.domain,
        axis=axis,
        times_s=held.times_s,
        speeds_hz=held.speeds_hz,
        mean_square=power,
        resolution=held.resolution,
        noise_bandwidth=held.noise_bandwidth,
    )


def _fixed(
    fine: Sequence[OrderCut], frequency_map: OrderMap, index: int
) -> tuple[tuple[FixedFrequency, ...], tuple[str, ...]]:
    """Resonances and lines of a channel, and why there are none where they could not be looked for."""
    try:
        return find_fixed_frequencies(fine, frequency_map, index), ()
    except AnalysisError as error:
        return (), (f"resonances were not looked for: {error}",)


ORDERS = Step("orders", 3, run_orders, "Orders over the angle of the shafts")

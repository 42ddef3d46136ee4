"""Figures of orders: maps with every order and curve named, cuts over speed, synchronous averages."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.measured.order_results import Average, ChannelOrders, LevelMap, OrderLevels, RunOrders
from tdacoustic.orders import FixedFrequency
from tdacoustic.recording import Channel
from tdacoustic.reporting.figure import Axis, Band, Element, Figure, Heatmap, Line, Markers, Rule
from tdacoustic.reporting.sections.words import pretty_unit, slug
from tdacoustic.units import REFERENCES, reference_label

__all__ = [
    "average_figure",
    "cut_figure",
    "frequency_figure",
    "leading_levels",
    "order_figure",
    "order_words",
    "shaft_words",
    "sure_resonances",
]

Array = NDArray[np.float64]

SLOTS: Final = {"mesh": 1, "motor": 3, "wheelset": 5, "inverter": 6, "asked": 1, "found": 4}
"""Colour of whose order it is, the same on every map; each is seen on the map's colours."""
GROUPS: Final = {
    "mesh": "mesh",
    "motor": "motor",
    "wheelset": "wheelset",
    "inverter": "inverter, not proportional to speed",
    "asked": "asked for by the campaign",
    "found": "found in the map",
}
CUTS: Final = 4
"""Orders drawn in a figure of cuts: the strongest."""
SPAN_DB: Final = 60.0
"""Of the colours of a map at most."""
QUIET_PERCENT: Final = 5.0
"""Of the cells of a map that are as quiet as to share one colour."""
HEAD: Final = 0.14
"""Part of a map's height, or width, left for names."""
SURE: Final = 0.95
"""Confidence of a resonance from which on it is drawn, and a sentence names it."""
OFTEN: Final = 0.15
"""Part of the classes of speed in which an order has to stand out, to be drawn or named as a strong one."""


def shaft_words(orders: RunOrders) -> str:
    """Name of the reference shaft."""
    return f"{orders.shaft} shaft" if orders.shaft else f"shaft of {orders.speed_source}"


def order_words(name: str, order: float) -> str:
    """Name of an order with its number, once.

    Examples
    --------
    >>> order_words("mesh x1", 31.0), order_words("order 17.4", 17.4)
    ('mesh x1 (order 31)', 'order 17.4')
    """
    return name if name.startswith("order ") else f"{name} (order {order:.5g})"


def _level_axis(channel: Channel, label: str = "Level", limits: tuple[float, float] | None = None) -> Axis:
    reference = pretty_unit(reference_label(channel.quantity) or "") or None
    return Axis(label, "dB", reference=reference, limits=limits)


def _db(mean_square: NDArray[np.floating], channel: Channel) -> Array:
    with np.errstate(divide="ignore", invalid="ignore"):
        level = 10.0 * np.log10(np.asarray(mean_square, dtype=np.float64) / REFERENCES[channel.quantity] ** 2)
    return np.where(np.isfinite(level), level, np.nan)


def leading_levels(channel: ChannelOrders) -> list[OrderLevels]:
    """Return the cuts in which an order stands out somewhere, the strongest in energy first."""
    held = [item for item in channel.levels if item.method == "cut" and item.usable.mean() >= OFTEN]

    def strength(item: OrderLevels) -> float:
        return float(np.sum(np.where(item.usable, item.mean_square, 0.0))) / item.speeds_hz.size

    return sorted(held, key=strength, reverse=True)


def sure_resonances(channel: ChannelOrders) -> list[FixedFrequency]:
    """Return the resonances of a channel that are sure enough to be drawn and named."""
    return [item for item in channel.fixed if item.kind == "resonance" and item.confidence >= SURE]


# ------------------------------------------------------------ maps


def frequency_figure(run: str, orders: RunOrders, channel: Channel, held: ChannelOrders) -> Figure | None:
    """Return the map of a channel over frequency and speed, or None where it has none.

    Parameters
    ----------
    run : str
    orders : RunOrders
    channel : Channel
    held : ChannelOrders
    """
    found = held.map_over("speed", "frequency")
    if found is None or found.speeds_hz.size < 2:
        return None
    limit = _highest_hz(orders, held, float(found.axis[-1]))
    kept = (found.axis > 0.0) & (found.axis <= limit)
    speeds = np.linspace(orders.lowest_hz, orders.highest_hz, 60)
    elements: list[Element] = [_heat(found, kept, channel)]
    ends: list[tuple[float, float, str]] = []
    for order in orders.orders:
        elements.append(_trace(order.order * speeds, 60.0 * speeds, limit, order.name, order.kind))
        at_hz = min(order.order * orders.highest_hz, limit)
        ends.append((at_hz, 60.0 * at_hz / order.order, order.name))
    for curve in orders.curves:
        frequencies = curve.frequency_hz_at(speeds)
        inside = np.flatnonzero(np.isfinite(frequencies) & (frequencies <= limit))
        if inside.size:
            elements.append(_trace(frequencies, 60.0 * speeds, limit, curve.name, curve.kind))
            middle = int(inside[inside.size // 2])
            ends.append((float(frequencies[middle]), 60.0 * float(speeds[middle]), curve.name))
    elements.append(_names(ends))
    elements += [
        Rule(item.frequency_hz, f"{item.frequency_hz:.0f} Hz")
        for item in sure_resonances(held)
        if item.frequency_hz <= limit
    ]
    return Figure(
        slug("order-map-hz", run, held.channel),
        f"{held.channel}, run {run}: level over frequency and speed",
        f"Mean over classes of speed; lines {found.resolution:.3g} Hz apart, a cell shows its strongest. Sloping lines "
        "follow the speed and carry the name of their order; dashed white lines are resonances that orders pass.",
        Axis("Frequency", "Hz", limits=(0.0, limit * (1.0 + _room(ends, limit)))),
        _speed_axis(orders, found),
        elements,
        height=500,
    )


def order_figure(run: str, orders: RunOrders, channel: Channel, held: ChannelOrders) -> Figure | None:
    """Return the map of a channel over order and speed, or None where it has none.

    Parameters
    ----------
    run : str
    orders : RunOrders
    channel : Channel
    held : ChannelOrders
    """
    found = held.map_over("speed", "order")
    if found is None or found.speeds_hz.size < 2:
        return None
    limit = _highest_hz(orders, held, math.inf) / orders.highest_hz
    limit = min(limit, float(found.axis[-1]))
    kept = (found.axis > 0.0) & (found.axis <= limit)
    top = 60.0 * orders.highest_hz
    speeds = np.linspace(orders.lowest_hz, orders.highest_hz, 60)
    elements: list[Element] = [_heat(found, kept, channel)]
    ends = [(order.order, top, order.name) for order in orders.orders if order.order <= limit]
    for curve in orders.curves:
        at = curve.frequency_hz_at(speeds) / speeds
        inside = np.flatnonzero(np.isfinite(at) & (at <= limit))
        if inside.size:
            elements.append(_trace(at, 60.0 * speeds, limit, curve.name, curve.kind))
            middle = int(inside[inside.size // 2])
            ends.append((float(at[middle]), 60.0 * float(speeds[middle]), curve.name))
    elements += [
        Line(
            np.where(item.frequency_hz / speeds <= limit, item.frequency_hz / speeds, np.nan),
            60.0 * speeds,
            f"resonance at {item.frequency_hz:.0f} Hz",
            "dashed",
            6,
        )
        for item in sure_resonances(held)
        if item.frequency_hz / orders.highest_hz <= limit
    ]
    elements.append(_names(ends))
    bandwidth = f"{found.noise_bandwidth:.3g}"
    return Figure(
        slug("order-map", run, held.channel),
        f"{held.channel}, run {run}: level over order and speed",
        f"Over the angle of the {shaft_words(orders)}; lines {found.resolution:.3g} orders apart, noise bandwidth "
        f"{bandwidth} orders. What follows the speed stands upright; what is fixed in Hz bends.",
        Axis(f"Order of the {shaft_words(orders)}", limits=(0.0, limit * (1.0 + _room(ends, limit)))),
        _speed_axis(orders, found),
        elements,
        height=500,
    )


def _highest_hz(orders: RunOrders, held: ChannelOrders, end: float) -> float:
    """Upper end of a map: somewhat above the highest order or curve that there is to see."""
    shown = [item.order.order * orders.highest_hz for item in leading_levels(held)]
    shown += [float(np.nanmax(curve.frequencies_hz)) for curve in orders.curves if curve.kind != "found"]
    shown += [item.frequency_hz for item in held.fixed if item.kind == "line" or item.confidence >= SURE]
    return min(end, 1.15 * max(shown, default=end))


def _heat(found: LevelMap, kept: NDArray[np.bool_], channel: Channel) -> Heatmap:
    level = _db(found.mean_square[:, kept], channel)
    known = level[np.isfinite(level)]
    top = float(np.max(known)) if known.size else 0.0
    low = max(top - SPAN_DB, float(np.percentile(known, QUIET_PERCENT)) if known.size else -SPAN_DB)
    axis = _level_axis(channel, limits=(min(low, top - 1.0), top))
    return Heatmap(found.axis[kept], 60.0 * found.speeds_hz, level, channel.name, axis)


def _trace(x: Array, y: Array, limit: float, name: str, kind: str) -> Line:
    return Line(np.where(x <= limit, x, np.nan), y, name, "dotted", SLOTS[kind], 1.2, 0.9, group=GROUPS[kind])


def _names(ends: Sequence[tuple[float, float, str]]) -> Markers:
    """The names of orders and curves where they leave the map."""
    names = [name for *_, name in ends]
    x, y = np.array([x for x, *_ in ends]), np.array([y for _, y, _ in ends])
    return Markers(x, y, "orders and lines, by name", labels=names, texts=names, symbol="triangle", color=7)


def _room(ends: Sequence[tuple[float, float, str]], limit: float) -> float:
    """Part of a map's width left for names at its right edge, where there are any."""
    return HEAD if any(x > 0.97 * limit for x, *_ in ends) else 0.0


def _speed_axis(orders: RunOrders, found: LevelMap) -> Axis:
    """Speed up to somewhat above the map, for the names."""
    step = float(np.median(np.diff(found.speeds_hz)))
    bottom, top = 60.0 * (float(found.speeds_hz[0]) - 0.5 * step), 60.0 * orders.highest_hz
    return Axis(f"Speed of the {shaft_words(orders)}", "rpm", limits=(bottom, top + HEAD * (top - bottom)))


# ------------------------------------------------------------ cuts


def cut_figure(run: str, orders: RunOrders, channel: Channel, held: ChannelOrders) -> Figure | None:
    """Return the levels of the strongest orders of a channel over speed, or None where none stands out.

    Parameters
    ----------
    run : str
    orders : RunOrders
    channel : Channel
    held : ChannelOrders
    """
    leading = [item for item in leading_levels(held) if item.speeds_hz.size >= 2][:CUTS]
    if not leading:
        return None
    tracked = {item.order.name: item for item in held.levels if item.method == "vold_kalman"}
    elements: list[Element] = []
    disturbed: list[tuple[Array, Array]] = []
    for slot, item in enumerate(leading):
        rpm, level = 60.0 * item.speeds_hz, _db(item.mean_square, channel)
        with np.errstate(invalid="ignore", divide="ignore"):
            half = 10.0 / math.log(10.0) * item.error / item.mean_square
        good = item.usable & ~item.disturbed
        half = np.where(good & (half < 6.0), half, np.nan)
        elements.append(Band(rpm, level - half, level + half, f"{item.order.name}, ± standard error", color=slot))
        sure = np.where(good, level, np.nan)
        disturbed.append((rpm[item.usable & item.disturbed], level[item.usable & item.disturbed]))
        elements.append(Line(rpm, sure, order_words(item.order.name, item.order.order), color=slot, points=True))
        floor, name = _db(item.floor, channel), f"floor of {item.order.name}"
        elements.append(Line(rpm, floor, name, "dotted", slot, opacity=0.7, group="floors"))
        other = tracked.get(item.order.name)
        if other is not None:
            sure = np.where(other.usable & ~other.disturbed, _db(other.mean_square, channel), np.nan)
            if np.isfinite(sure).sum() >= 2:
                words = f"{item.order.name} by Vold-Kalman"
                elements.append(Line(60.0 * other.speeds_hz, sure, words, "dashed", slot, group="by Vold-Kalman"))
    x, y = (np.concatenate(values) for values in zip(*disturbed, strict=True))
    if x.size:
        elements.append(Markers(x, y, "another line in the band", symbol="x", color=7))
    return Figure(
        slug("order-cuts", run, held.channel),
        f"{held.channel}, run {run}: orders over speed",
        f"The {len(leading)} strongest orders where they stand 6 dB over their floor, the floor taken off. "
        + _bandwidth_words(orders, held),
        Axis(f"Speed of the {shaft_words(orders)}", "rpm"),
        _level_axis(channel),
        elements,
        height=440,
    )


def _bandwidth_words(orders: RunOrders, held: ChannelOrders) -> str:
    same = math.isclose(orders.bandwidth, orders.requested_bandwidth, rel_tol=1e-6)
    words = f"Bandwidth of the cuts: {orders.bandwidth:.3g} orders" + (
        ", as asked for." if same else f" ({orders.requested_bandwidth:.3g} asked for; the run has too few turns)."
    )
    filters = {f"{item.bandwidth_hz:.3g}" for item in held.tracks}
    if filters:
        words += f" Vold-Kalman filter of 2 poles, ±{' and ±'.join(sorted(filters))} Hz, its orders jointly."
    return words


# ------------------------------------------------------------ averages


def average_figure(run: str, channel: Channel, average: Average) -> Figure:
    """Return the synchronous average of a channel over one turn.

    Parameters
    ----------
    run : str
    channel : Channel
    average : Average
    """
    angle = 360.0 * np.arange(average.waveform.size) / average.waveform.size
    residual = math.sqrt(average.residual_mean_square)
    synchronous = float(np.sqrt(np.mean((average.waveform - average.waveform.mean()) ** 2)))
    unit, error_words = pretty_unit(channel.si_symbol), "± standard error"
    return Figure(
        slug("synchronous", run, channel.name, average.shaft),
        f"{channel.name}, run {run}: what repeats with every turn of the {average.shaft}",
        f"Mean over {average.periods} turns, rms {synchronous:.3g} {unit}; what is left of the signal has "
        f"{residual:.3g} {unit} rms. The band is the mean's standard error.",
        Axis(f"Angle of the {average.shaft}", "degrees"),
        Axis("Mean over the turns", unit),
        [
            Band(angle, average.waveform - average.error, average.waveform + average.error, error_words, color=0),
            Line(angle, average.waveform, "mean over the turns", color=0, width=1.0),
        ],
        height=320,
    )

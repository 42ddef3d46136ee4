"""Maps of orders over the speed, with every order and curve named."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.measured.order_results import ChannelOrders, LevelMap, RunOrders
from tdacoustic.recording import Channel
from tdacoustic.reporting.figure import Axis, Element, Figure, Heatmap, Line, Markers, Rule
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.order_figures import (
    SURE,
    leading_levels,
    level_axis,
    levels_db,
    shaft_words,
    sure_resonances,
)
from tdacoustic.reporting.sections.words import slug

__all__ = ["frequency_figure", "order_figure"]

Array = NDArray[np.float64]

SLOTS: Final = {"mesh": 1, "motor": 3, "wheelset": 5, "inverter": 6, "asked": 1, "found": 4}
"""Colour of whose order it is, the same on every map; each is seen on the map's colours."""
GROUPS: Final = {
    "mesh": mark("mesh"),
    "motor": mark("motor"),
    "wheelset": mark("wheelset"),
    "inverter": mark("inverter, not proportional to speed"),
    "asked": mark("asked for by the campaign"),
    "found": mark("found in the map"),
}
SPAN_DB: Final = 60.0
"""Of the colours of a map at most."""
QUIET_PERCENT: Final = 5.0
"""Of the cells of a map that are as quiet as to share one colour."""
HEAD: Final = 0.14
"""Part of a map's height left for names."""
INSIDE: Final = 0.93
"""Part of a map's width at which an order that leaves it at the side has its name."""


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
    speeds = _speeds(orders)
    sloping = [
        _trace(order.order * speeds, 60.0 * speeds, limit, order.name, order.kind)
        for order in orders.orders
        if order.order * orders.lowest_hz <= limit
    ]
    ends = []
    for order in orders.orders:
        at_hz = order.order * orders.highest_hz
        inside = at_hz if at_hz <= limit else INSIDE * limit  # one that leaves at the side is named inside the map
        if inside / order.order > orders.lowest_hz:
            ends.append((inside, 60.0 * inside / order.order, order.name))
    fixed = [
        Rule(item.frequency_hz, f"{item.frequency_hz:.0f} Hz")
        for item in sure_resonances(held)
        if item.frequency_hz <= limit
    ]
    mean = say(
        "Mean over classes of speed; lines {spacing:.3g} Hz apart, a cell shows its strongest.",
        spacing=found.resolution,
    )
    drawn = (
        say(
            "Dotted: where orders and lines are expected, by name, whether or not they sound; dashed white lines are "
            "resonances that orders pass."
        )
        if fixed
        else say("Dotted: where orders and lines are expected, by name, whether or not they sound.")
    )
    title = say("{channel}, run {run}: level over frequency and speed", channel=held.channel, run=run)
    heading = slug("order-map-hz", run, held.channel), title, f"{mean} {drawn}"
    return _map(
        heading, Axis(say("Frequency"), "Hz", limits=(0.0, limit)), orders, channel, found, (sloping, fixed, ends)
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
    limit = min(_highest_hz(orders, held, math.inf) / orders.highest_hz, float(found.axis[-1]))
    speeds = _speeds(orders)
    bent = [
        Line(
            np.where(item.frequency_hz / speeds <= limit, item.frequency_hz / speeds, np.nan),
            60.0 * speeds,
            say("resonance at {frequency:.0f} Hz", frequency=item.frequency_hz),
            "dashed",
            6,
        )
        for item in sure_resonances(held)
        if item.frequency_hz / orders.highest_hz <= limit
    ]
    ends = [(order.order, 60.0 * orders.highest_hz, order.name) for order in orders.orders if order.order <= limit]
    words = say(
        "Over the angle of the {shaft}; lines {spacing:.3g} orders apart, noise bandwidth {bandwidth:.3g} orders. "
        "What follows the speed stands upright; what is fixed in Hz bends.",
        shaft=shaft_words(orders),
        spacing=found.resolution,
        bandwidth=found.noise_bandwidth,
    )
    heading = (
        slug("order-map", run, held.channel),
        say("{channel}, run {run}: level over order and speed", channel=held.channel, run=run),
        words,
    )
    axis = Axis(say("Order of the {shaft}", shaft=shaft_words(orders)), limits=(0.0, limit))
    return _map(heading, axis, orders, channel, found, ([], bent, ends))


def _map(
    heading: tuple[str, str, str],
    axis: Axis,
    orders: RunOrders,
    channel: Channel,
    found: LevelMap,
    drawn: tuple[Sequence[Element], Sequence[Element], Sequence[tuple[float, float, str]]],
) -> Figure:
    """A map with what is drawn on it: traces of orders, resonances, ends of orders with their names; and the curves."""
    traces, resonances, ends = drawn
    assert axis.limits is not None
    limit, speeds = axis.limits[1], _speeds(orders)
    scale = speeds if found.domain == "order" else 1.0
    elements: list[Element] = [_heat(found, (found.axis > 0.0) & (found.axis <= limit), channel), *traces]
    names = list(ends)
    for curve in orders.curves:
        at = curve.frequency_hz_at(speeds) / scale
        inside = np.flatnonzero(np.isfinite(at) & (at <= limit))
        if inside.size:
            elements.append(_trace(at, 60.0 * speeds, limit, curve.name, curve.kind))
            middle = int(inside[inside.size // 2])
            names.append((float(at[middle]), 60.0 * float(speeds[middle]), curve.name))
    elements += [*resonances, _names(names, {order.name for order in orders.orders if order.kind == "found"})]
    return Figure(*heading, axis, _speed_axis(orders, found), elements, height=500)


def _speeds(orders: RunOrders) -> Array:
    """Speeds at which traces are drawn."""
    return np.linspace(orders.lowest_hz, orders.highest_hz, 60)


def _highest_hz(orders: RunOrders, held: ChannelOrders, end: float) -> float:
    """Upper end of a map: somewhat above the highest order or curve that there is to see."""
    shown = [item.order.order * orders.highest_hz for item in leading_levels(held)]
    shown += [float(np.nanmax(curve.frequencies_hz)) for curve in orders.curves if curve.kind != "found"]
    shown += [item.frequency_hz for item in held.fixed if item.kind == "line" or item.confidence >= SURE]
    return min(end, 1.15 * max(shown, default=end))


def _heat(found: LevelMap, kept: NDArray[np.bool_], channel: Channel) -> Heatmap:
    level = levels_db(found.mean_square[:, kept], channel)
    known = level[np.isfinite(level)]
    top = float(np.max(known)) if known.size else 0.0
    low = max(top - SPAN_DB, float(np.percentile(known, QUIET_PERCENT)) if known.size else -SPAN_DB)
    axis = level_axis(channel, limits=(min(low, top - 1.0), top))
    return Heatmap(found.axis[kept], 60.0 * found.speeds_hz, level, channel.name, axis)


def _trace(x: Array, y: Array, limit: float, name: str, kind: str) -> Line:
    return Line(np.where(x <= limit, x, np.nan), y, name, "dotted", SLOTS[kind], 1.2, 0.9, group=say(GROUPS[kind]))


def _names(ends: Sequence[tuple[float, float, str]], found: Collection[str]) -> Markers:
    """The names of orders and curves where they leave the map."""
    ends = sorted(ends, key=lambda end: end[2] in found)  # names that the fleet gives take the room first
    names = [name for *_, name in ends]
    x, y = np.array([x for x, *_ in ends]), np.array([y for _, y, _ in ends])
    return Markers(x, y, say("orders and lines, by name"), labels=names, texts=names, symbol="triangle", color=7)


def _speed_axis(orders: RunOrders, found: LevelMap) -> Axis:
    """Speed up to somewhat above the map, for the names."""
    step = float(np.median(np.diff(found.speeds_hz)))
    bottom, top = 60.0 * (float(found.speeds_hz[0]) - 0.5 * step), 60.0 * orders.highest_hz
    return Axis(
        say("Speed of the {shaft}", shaft=shaft_words(orders)), "rpm", limits=(bottom, top + HEAD * (top - bottom))
    )

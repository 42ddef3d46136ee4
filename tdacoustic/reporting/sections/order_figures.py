"""Figures of orders: cuts over speed and synchronous averages, and what these share with the maps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.measured.order_results import Average, ChannelOrders, OrderLevels, RunOrders
from tdacoustic.orders import FixedFrequency
from tdacoustic.recording import Channel
from tdacoustic.reporting.figure import Axis, Band, Element, Figure, Line, Markers
from tdacoustic.reporting.language import say, say_count
from tdacoustic.reporting.sections.words import SHAFT_WORDS, joined, pretty_unit, slug
from tdacoustic.units import REFERENCES, reference_label

__all__ = [
    "average_figure",
    "cut_figure",
    "leading_levels",
    "level_axis",
    "levels_db",
    "order_words",
    "shaft_words",
    "sure_resonances",
]

Array = NDArray[np.float64]

CUTS: Final = 4
"""Orders drawn in a figure of cuts: the strongest."""
SURE: Final = 0.95
"""Confidence of a resonance from which on it is drawn, and a sentence names it."""
OFTEN: Final = 0.15
"""Part of the classes of speed in which an order has to stand out, to be drawn or named as a strong one."""


def shaft_words(orders: RunOrders) -> str:
    """Name of the reference shaft."""
    return (
        say("{shaft} shaft", shaft=say(SHAFT_WORDS.get(orders.shaft, orders.shaft)))
        if orders.shaft
        else say("shaft of {channel}", channel=orders.speed_source)
    )


def order_words(name: str, order: float) -> str:
    """Name of an order with its number, once.

    Examples
    --------
    >>> order_words("mesh x1", 31.0), order_words("order 17.4", 17.4)
    ('mesh x1 (order 31)', 'order 17.4')
    """
    return name if name.startswith("order ") else say("{name} (order {order:.5g})", name=name, order=order)


def level_axis(channel: Channel, limits: tuple[float, float] | None = None) -> Axis:
    """Return the axis of a channel's levels."""
    reference = pretty_unit(reference_label(channel.quantity) or "") or None
    return Axis(say("Level"), "dB", reference=reference, limits=limits)


def levels_db(mean_square: NDArray[np.floating], channel: Channel) -> Array:
    """Return mean squares as levels; NaN of none."""
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
    tracked = _tracked(leading, held, channel)
    elements: list[Element] = []
    for slot, item in enumerate(leading):
        elements += [*_cut(slot, item, channel, joined_up=item.order.name not in tracked)]
        elements += [tracked[item.order.name]] if item.order.name in tracked else []
    elements += _disturbed(leading, channel)
    strongest = say_count(
        "The strongest order where it stands 6 dB over the floor, the floor taken off.",
        "The {count} strongest orders where they stand 6 dB over the floor, the floor taken off.",
        len(leading),
    )
    return Figure(
        slug("order-cuts", run, held.channel),
        say("{channel}, run {run}: orders over speed", channel=held.channel, run=run),
        f"{strongest} {_bandwidth_words(leading, held)}",
        Axis(say("Speed of the {shaft}", shaft=shaft_words(orders)), "rpm"),
        level_axis(channel),
        elements,
        height=440,
    )


def _cut(slot: int, item: OrderLevels, channel: Channel, joined_up: bool) -> list[Element]:
    """An order's levels where they are sure, with their standard errors, and its floor."""
    rpm, level = 60.0 * item.speeds_hz, levels_db(item.mean_square, channel)
    with np.errstate(invalid="ignore", divide="ignore"):
        half = 10.0 / math.log(10.0) * item.error / item.mean_square
    good = item.usable & ~item.disturbed & np.isfinite(level)
    half = np.where(good & (half < 6.0), half, np.nan)
    name, words = item.order.name, order_words(item.order.name, item.order.order)
    return [
        Band(rpm, level - half, level + half, say("{name}, ± standard error", name=name), color=slot),
        Line(rpm, np.where(good, level, np.nan), words, color=slot, points=True)
        if joined_up
        else Markers(rpm[good], level[good], words, color=slot),
        Line(
            rpm,
            levels_db(item.floor, channel),
            say("floor of {name}", name=name),
            "dotted",
            slot,
            opacity=0.7,
            group=say("floors"),
        ),
    ]


def _disturbed(leading: Sequence[OrderLevels], channel: Channel) -> list[Element]:
    """Levels to which another line adds, each with the order's name and the other's under the pointer."""
    points = [
        (60.0 * float(item.speeds_hz[index]), level, f"{item.order.name}: {item.reasons[index]}")
        for item in leading
        for index, level in enumerate(levels_db(item.mean_square, channel).tolist())
        if item.usable[index] and item.disturbed[index] and math.isfinite(level)
    ]
    if not points:
        return []
    x, y, texts = zip(*points, strict=True)
    return [Markers(np.array(x), np.array(y), say("another line in the band"), texts=texts, symbol="x", color=7)]


def _tracked(leading: Sequence[OrderLevels], held: ChannelOrders, channel: Channel) -> dict[str, Line]:
    """The same orders by Vold-Kalman, which join the dots of the cuts where both agree."""
    found = {}
    tracked = {item.order.name: item for item in held.levels if item.method == "vold_kalman"}
    for slot, name in enumerate(item.order.name for item in leading):
        item = tracked.get(name)
        if item is None:
            continue
        sure = np.where(item.usable & ~item.disturbed, levels_db(item.mean_square, channel), np.nan)
        if np.isfinite(sure).sum() >= 2:
            words = say("{name} by Vold-Kalman", name=name)
            found[name] = Line(60.0 * item.speeds_hz, sure, words, "dashed", slot, group=say("by Vold-Kalman"))
    return found


def _bandwidth_words(leading: Sequence[OrderLevels], held: ChannelOrders) -> str:
    had = sorted({float(value) for item in leading for value in item.bandwidth if math.isfinite(value)})
    asked = leading[0].requested_bandwidth
    same = all(math.isclose(value, asked, rel_tol=1e-6) for value in had)
    bandwidths = joined([f"{value:.3g}" for value in had])
    sentences = [
        say("Bandwidth of the cuts: {bandwidths} orders, as asked for.", bandwidths=bandwidths)
        if same
        else say(
            "Bandwidth of the cuts: {bandwidths} orders ({asked:.3g} asked for; the run has too few turns).",
            bandwidths=bandwidths,
            asked=asked,
        )
    ]
    filters = dict.fromkeys(f"±{item.bandwidth_hz:.3g}" for item in sorted(held.tracks, key=lambda t: t.bandwidth_hz))
    if filters:
        sentences.append(
            say(
                "Dashed, through the dots where both agree, broken where it is not sure: Vold-Kalman filter of 2 "
                "poles, {bandwidths} Hz, its orders jointly.",
                bandwidths=joined(list(filters)),
            )
        )
    return " ".join(sentences)


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
    unit, error_words = pretty_unit(channel.si_symbol), say("± standard error")
    shaft = say(SHAFT_WORDS.get(average.shaft, average.shaft))
    return Figure(
        slug("synchronous", run, channel.name, average.shaft),
        say(
            "{channel}, run {run}: what repeats with every turn of the {shaft}",
            channel=channel.name,
            run=run,
            shaft=shaft,
        ),
        say(
            "Mean over {turns} turns, rms {mean:.3g} {unit}; what is left of the signal has {rest:.3g} {unit} rms. "
            "The band is the mean's standard error.",
            turns=average.periods,
            mean=synchronous,
            unit=unit,
            rest=residual,
        ),
        Axis(say("Angle of the {shaft}", shaft=shaft), say("degrees")),
        Axis(say("Mean over the turns"), unit),
        [
            Band(angle, average.waveform - average.error, average.waveform + average.error, error_words, color=0),
            Line(angle, average.waveform, say("mean over the turns"), color=0, width=1.0),
        ],
        height=320,
    )

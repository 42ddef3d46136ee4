"""Sentences on the orders of a run-up: which leads at which speeds, which resonances are passed, what stays in Hz."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.measured.order_results import ChannelOrders, RunOrders
from tdacoustic.measured.runs import MeasuredRun
from tdacoustic.orders import FixedFrequency
from tdacoustic.recording import Channel
from tdacoustic.reporting.language import say
from tdacoustic.reporting.sections.order_figures import leading_levels, order_words, sure_resonances
from tdacoustic.reporting.sections.words import joined
from tdacoustic.results import Analysis
from tdacoustic.units import level_db

__all__ = ["fixed_sentences", "leader_sentences", "loudest_order_words"]

SAME_LINE: Final = 0.012
"""Relative distance within which a line that is fixed in Hz is taken for a named one: a carrier is a percent off."""

AHEAD_DB: Final = 1.0
"""By how much one order has to exceed another that led before, to lead from there on: the errors of two cuts."""


def leader_sentences(channel: Channel, held: ChannelOrders) -> list[str]:
    """Which order is the strongest over which speeds."""
    leading = leading_levels(held)
    if not leading:
        return [say("{channel}: no order stands 6 dB over its floor anywhere.", channel=channel.name)]
    size = max(item.speeds_hz.size for item in leading)
    whole = [item for item in leading if item.speeds_hz.size == size]  # of the reference shaft: the same classes
    usable = np.array([np.where(item.usable, item.mean_square, 0.0) for item in whole])
    power = np.where([item.disturbed for item in whole], 0.0, usable)
    rpm = 60.0 * whole[0].speeds_hz
    first = _leaders(usable, power)
    spans: list[tuple[int, int, int]] = []  # of a leader from class to class; classes without one are passed over
    for index, leader in enumerate(first.tolist()):
        if leader >= 0 and spans and spans[-1][0] == leader:
            spans[-1] = (leader, spans[-1][1], index)
        elif leader >= 0:
            spans.append((leader, index, index))
    sentences = []
    counts = {leader: int(np.sum(first == leader)) for leader in set(first.tolist()) if leader >= 0}
    for leader in sorted(counts, key=lambda item: -counts[item])[:2]:
        item, own = whole[leader], [(a, b) for who, a, b in spans if who == leader]
        loudest = int(np.argmax(np.where(first == leader, power[leader], 0.0)))
        level = level_db(math.sqrt(power[leader][loudest]), channel.quantity)
        speeds = joined([_range_words(rpm[a], rpm[b]) for a, b in own][:4])
        sentences.append(
            say(
                "{channel}: {order} is the strongest order {speeds}, with up to {level:.1f} dB at {speed:.0f} rpm.",
                channel=channel.name,
                order=order_words(item.order.name, item.order.order),
                speeds=say("{speeds} and elsewhere", speeds=speeds) if len(own) > 4 else speeds,
                level=level,
                speed=rpm[loudest],
            )
        )
    return sentences


def _leaders(usable: NDArray[np.float64], power: NDArray[np.float64]) -> NDArray[np.int_]:
    """Which order leads in each class; -1 of none, or where the strongest has another line in its band.

    One that leads goes on leading as long as no other is `AHEAD_DB` stronger.
    """
    found = np.full(usable.shape[1], -1)
    for index in range(found.size):
        top = int(np.argmax(usable[:, index]))
        if power[top, index] <= 0.0:
            continue
        before = found[index - 1] if index else -1
        ahead = before < 0 or power[top, index] > 10.0 ** (AHEAD_DB / 10.0) * power[before, index]
        found[index] = top if ahead else before
    return found


def _range_words(low: float, high: float) -> str:
    if low == high:
        return say("at {speed:.0f} rpm", speed=low)
    return say("from {low:.0f} to {high:.0f} rpm", low=low, high=high)


def fixed_sentences(found: RunOrders, channels: Sequence[ChannelOrders]) -> list[str]:
    """Resonances that are passed, and lines that stay in Hz, each with the channels that show it."""
    groups: list[tuple[FixedFrequency, list[str]]] = []
    told = [
        (item, held.channel)
        for held in channels
        for item in held.fixed
        if item.kind != "resonance" or item in sure_resonances(held)
    ]
    for item, channel in sorted(told, key=lambda pair: -pair[0].confidence):  # the surest one's figures are told
        for other, names in groups:
            if other.kind == item.kind and abs(other.frequency_hz / item.frequency_hz - 1.0) < SAME_LINE:
                names.append(channel)
                break
        else:
            groups.append((item, [channel]))
    return [
        _resonance_words(found, item, names) if item.kind == "resonance" else _line_words(found, item, names)
        for item, names in sorted(groups, key=lambda group: group[0].frequency_hz)
    ]


def _resonance_words(found: RunOrders, item: FixedFrequency, names: Sequence[str]) -> str:
    """A resonance, how much it raises what passes it, and which orders pass it where."""
    passing = [
        say(
            "{order} at {speed:.0f} rpm",
            order=order_words(order.name, order.order),
            speed=60.0 * item.frequency_hz / order.order,
        )
        for order in found.orders
        if found.lowest_hz < item.frequency_hz / order.order < found.highest_hz
    ]
    orders = joined(passing[:4])
    orders = say("{orders} and others", orders=orders) if len(passing) > 4 else orders
    if item.loss_factor > 0:
        return say(
            "A resonance near {frequency:.0f} Hz, {width:.0f} Hz wide at most raises what passes it by {rise:.0f} dB "
            "in {channels}: {orders}.",
            frequency=item.frequency_hz,
            width=item.loss_factor * item.frequency_hz,
            rise=item.rise_db,
            channels=_surest(names),
            orders=orders,
        )
    return say(
        "A resonance near {frequency:.0f} Hz raises what passes it by {rise:.0f} dB in {channels}: {orders}.",
        frequency=item.frequency_hz,
        rise=item.rise_db,
        channels=_surest(names),
        orders=orders,
    )


def _line_words(found: RunOrders, item: FixedFrequency, names: Sequence[str]) -> str:
    """A line that stays in Hz, by its name where it has one."""
    own = _curve_name(found, item.frequency_hz)
    at = f"{item.frequency_hz:.1f} Hz"
    return say(
        "A line at {frequency} stays where it is while the speed changes, in {channels}: it is no order of the shaft.",
        frequency=f"{at} ({own})" if own else at,
        channels=joined(names),
    )


def _surest(names: Sequence[str]) -> str:
    """The channel that the figures are of, and the others that show the same."""
    if len(names) == 1:
        return names[0]
    return say("{channel} (seen in {others} too)", channel=names[0], others=joined(names[1:]))


def _curve_name(found: RunOrders, frequency_hz: float) -> str:
    for curve in found.curves:
        known = curve.frequencies_hz[np.isfinite(curve.frequencies_hz)]
        if known.size and np.ptp(known) < 1e-6 * known[0] and abs(known[0] / frequency_hz - 1.0) < SAME_LINE:
            return curve.name
    return ""


def loudest_order_words(analysis: Analysis, run: MeasuredRun, microphones: Sequence[str]) -> str:
    """The order of most energy over a run-up's speeds, at the microphone where it is the loudest; or ``""``."""
    found = analysis.orders.get(run.name)
    if found is None or run.recording is None:
        return ""
    loudest: tuple[float, str] | None = None
    for held in found.channels:
        leading = leading_levels(held) if held.channel in microphones else []
        if not leading:
            continue
        item = leading[0]
        power = np.where(item.usable & ~item.disturbed, item.mean_square, 0.0)
        top = int(np.argmax(power))
        level = level_db(math.sqrt(float(power[top])), run.recording[held.channel].quantity)
        if level is not None and (loudest is None or level > loudest[0]):
            words = say(
                "strongest order: {order}, up to {level:.1f} dB at {speed:.0f} rpm at {channel}",
                order=order_words(item.order.name, item.order.order),
                level=level,
                speed=60.0 * item.speeds_hz[top],
                channel=held.channel,
            )
            loudest = (level, words)
    return "" if loudest is None else loudest[1]

"""The tables of orders: levels over speed, sidebands, what is fixed in Hz, and what repeats every turn."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from tdacoustic.measured.order_results import Average, ChannelOrders, OrderLevels, RunOrders, Sidebands
from tdacoustic.measured.runs import MeasuredRun
from tdacoustic.tables.frames import Row, frame_of
from tdacoustic.units import level_db

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["harmonic_names", "order_tables"]

MOST_HARMONICS: Final = 12
"""Of a synchronous average: the strongest."""
SURE: Final = 3.0
"""Standard errors that a harmonic has to exceed."""
SAME: Final = 1e-3
"""Orders this near are the same, for names."""


def order_tables(runs: Sequence[MeasuredRun], orders: Mapping[str, RunOrders]) -> dict[str, pd.DataFrame]:
    """Return ``orders``, ``sidebands``, ``resonances`` and ``synchronous`` as frames; none where no run has orders.

    ``resonances`` only where there is a run-up, ``synchronous`` only where there is a steady run.

    Parameters
    ----------
    runs : sequence of MeasuredRun
    orders : mapping of str to RunOrders
        By run.
    """
    held = [(run, orders[run.name]) for run in runs if run.name in orders]
    if not held:
        return {}
    rows: dict[str, Iterator[Row]] = {"orders": _order_rows(held), "sidebands": _sideband_rows(held)}
    if any(not found.steady for _, found in held):
        rows["resonances"] = _fixed_rows(held)
    if any(found.steady for _, found in held):
        rows["synchronous"] = _average_rows(held)
    return {name: frame_of(name, table) for name, table in rows.items()}


Held = Sequence[tuple[MeasuredRun, RunOrders]]


def _channels(held: Held) -> Iterator[tuple[Row, RunOrders, ChannelOrders, str]]:
    """First columns, orders, channel and quantity."""
    for run, found in held:
        for channel in found.channels:
            quantity = "other" if run.recording is None else run.recording[channel.channel].quantity
            first = {"run": run.name, "condition": run.run.condition, "channel": channel.channel}
            yield first, found, channel, quantity


def _order_rows(held: Held) -> Iterator[Row]:
    for first, _, channel, quantity in _channels(held):
        for levels in channel.levels:
            for index in range(levels.speeds_hz.size):
                yield first | _order_row(levels, index, quantity)


def _order_row(levels: OrderLevels, index: int, quantity: str) -> Row:
    power, error = float(levels.mean_square[index]), float(levels.error[index])
    order = levels.order
    return {
        "order": order.order,
        "speed_rpm": 60.0 * float(levels.speeds_hz[index]),
        "level_db": _level(power, quantity),
        "name": order.name,
        "kind": order.kind,
        "shaft": order.shaft,
        "bandwidth_orders": _number(levels.bandwidth[index]),
        "requested_bandwidth": _number(levels.requested_bandwidth),
        "level_error_db": 10.0 / math.log(10.0) * error / power if power > 0.0 and math.isfinite(error) else None,
        "floor_db": _level(float(levels.floor[index]), quantity),
        "phase_deg": _number(math.degrees(levels.phase_rad[index])),
        "phase_error_deg": _number(math.degrees(levels.phase_error_rad[index])),
        "steadiness": _number(levels.steadiness[index]),
        "method": levels.method,
        "reason": levels.reasons[index] or None,
    }


def _level(mean_square: float, quantity: str) -> float | None:
    return level_db(math.sqrt(mean_square), quantity) if mean_square > 0.0 else None


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _sideband_rows(held: Held) -> Iterator[Row]:
    for first, _, channel, _ in _channels(held):
        for item in channel.sidebands:
            for index in range(item.family.speeds_hz.size):
                yield first | _sideband_row(item, index)


def _sideband_row(item: Sidebands, index: int) -> Row:
    family = item.family
    ratio = float(family.power_ratio[index])
    return {
        "carrier": item.carrier,
        "carrier_order": family.carrier,
        "spacing": item.spacing,
        "spacing_orders": family.spacing,
        "speed_rpm": 60.0 * float(family.speeds_hz[index]),
        "pairs": float(family.pairs[index]),
        "sidebands_db": 10.0 * math.log10(ratio) if ratio > 0.0 else None,
        "amplitude_depth": _number(family.amplitude_depth[index]),
        "phase_depth_rad": _number(family.phase_depth_rad[index]),
        "reason": _sideband_reason(ratio, family.reasons[index]),
    }


def _sideband_reason(ratio: float, why: str) -> str | None:
    none = "no sideband stands out" if ratio == 0.0 else ""
    return "; ".join(part for part in (none, why) if part) or None


def _fixed_rows(held: Held) -> Iterator[Row]:
    for first, found, channel, _ in _channels(held):
        if found.steady:
            continue
        for item in channel.fixed:
            passing = [
                order.name
                for order in found.orders
                if found.lowest_hz * order.order <= item.frequency_hz <= found.highest_hz * order.order
            ]
            width = item.loss_factor * item.frequency_hz
            yield first | {
                "kind": item.kind,
                "frequency_hz": item.frequency_hz,
                "width_hz": _number(width),
                "rise_db": item.rise_db,
                "raised": float(item.orders_raised),
                "crossing": float(item.orders_crossing),
                "confidence": item.confidence,
                "orders": "; ".join(passing) if item.kind == "resonance" else None,
                "detail": item.evidence,
            }


def harmonic_names(found: RunOrders, average: Average) -> dict[int, str]:
    """Return the names of the harmonics of a synchronous average that a named order lies on, by harmonic.

    Parameters
    ----------
    found : RunOrders
    average : Average
    """
    names: dict[int, str] = {}
    for order in found.orders:
        harmonic = order.order / average.ratio
        if abs(harmonic - round(harmonic)) < SAME * max(1.0, harmonic / 100.0):
            names.setdefault(round(harmonic), order.name)
    return names


def _average_rows(held: Held) -> Iterator[Row]:
    for first, found, channel, quantity in _channels(held):
        for item in channel.averages:
            lines = np.abs(item.amplitudes)
            phases = np.degrees(np.angle(item.amplitudes))
            error = item.amplitude_error
            strongest = [int(order) for order in np.argsort(-lines[1:])[:MOST_HARMONICS] + 1]
            names = harmonic_names(found, item)
            shared = {
                "shaft": item.shaft,
                "turns": float(item.periods),
                "speed_rpm": 60.0 * item.speed_hz / item.ratio,
                "synchronous_db": _level(float(np.sum(lines[1:] ** 2)), quantity),
                "residual_db": _level(item.residual_mean_square, quantity),
            }
            sure = sorted(order for order in strongest if lines[order] > SURE * error)
            for order in sure:
                yield (
                    first
                    | shared
                    | {
                        "harmonic": float(order),
                        "order": order * item.ratio,
                        "name": names.get(order),
                        "level_db": _level(float(lines[order] ** 2), quantity),
                        "level_error_db": 20.0 / math.log(10.0) * error / float(lines[order]),
                        "phase_deg": float(phases[order]),
                        "phase_error_deg": math.degrees(error / float(lines[order])),
                    }
                )
            if not sure:
                yield first | shared | {"reason": f"no harmonic exceeds {SURE:g} standard errors"}

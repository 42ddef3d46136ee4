"""Orders of a campaign's runs: which ones, of which shaft, in which runs, and why not in the others."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from tdacoustic.measured.orders_step import ORDERS, OrderSettings
from tdacoustic.orders import FrequencyCurve, NamedOrder, OrderKind
from tdacoustic.orders.resampling import PASS_SHARE
from tdacoustic.speed.profile import STANDSTILL
from tdacoustic.units import REFERENCES

if TYPE_CHECKING:
    from tdacoustic.campaign.settings import AnalysisSettings
    from tdacoustic.fleet import Kinematics
    from tdacoustic.measured.runs import MeasuredRun
    from tdacoustic.speed import SpeedProfile
    from tdacoustic.steps import Task
    from tdacoustic.workflows.second_pass import FirstPass

__all__ = ["expected_orders", "order_problems", "order_tasks"]

MESH_HARMONICS: Final = 10
"""Of each pair [assumed]."""
HIGHEST_UNNAMED: Final = 300.0
"""Order up to which maps reach where no fleet names a mesh [assumed]."""
ABOVE_MESH: Final = 0.5
"""Part of the highest mesh harmonic's distance to the next by which maps reach beyond it."""
SPEEDS: Final = 65
"""At which the frequency of a line that is no order is taken."""
CARRIERS: Final = 3
"""Harmonics of a mesh whose sidebands are looked for."""
LOWEST_CARRIER: Final = 10.0
"""Order from which on one that no fleet names is taken for a carrier: beside lower ones lie the shaft's harmonics."""
SAME: Final = 1e-6


@dataclass(frozen=True)
class _Teller:
    """What tells the speed of the reference shaft.

    Parameters
    ----------
    profile : SpeedProfile
    turns_per_unit : float
        Turns of the reference shaft for one of the profile's unit.
    shaft : str
    counted : bool
    """

    profile: SpeedProfile
    turns_per_unit: float
    shaft: str
    counted: bool

    def speeds_hz(self) -> tuple[float, float, float]:
        """Lowest, middle and highest speed of the reference shaft while it turns, what reads as a standstill left out.

        Its angle is not known there, and the scatter of a sensor is no speed at which orders lie anywhere.
        """
        speeds = np.abs(self.profile.speed) * self.turns_per_unit
        turning = speeds[speeds >= STANDSTILL["1/s"]]
        low, middle, high = np.percentile(turning if turning.size else speeds[speeds > 0.0], [0.5, 50.0, 99.5])
        return float(low), float(middle), float(high)


def order_tasks(first: FirstPass) -> dict[str, Task]:
    """Return the task of each run whose orders can be had: run-ups, and steady runs with a tacho."""
    return {run.name: _task(first, run, teller) for run, teller in _tellers(first) if isinstance(teller, _Teller)}


def order_problems(first: FirstPass) -> list[str]:
    """Return what of the orders that the campaign asks for cannot be had, one line each."""
    orders = _asked(first.campaign.analysis)
    asked = "orders " + ", ".join(f"{order:g}" for order in orders)
    found: dict[str, list[str]] = {}
    strange: dict[str, list[str]] = {}
    for run, teller in _tellers(first):
        if isinstance(teller, str):
            if orders:
                found.setdefault(f"{asked} are not cut in run{{s}} {{runs}}: {teller}", []).append(run.name)
        elif (words := _of_other_drives(run, teller)) is not None:
            strange.setdefault(words, []).append(run.name)
    return [
        text.format(s="s" if len(runs) > 1 else "", runs=", ".join(runs)) for text, runs in {**found, **strange}.items()
    ]


def _of_other_drives(run: MeasuredRun, teller: _Teller) -> str | None:
    """Sensors whose orders are cut over the angle of another drive's shaft, in words; None where there are none."""
    assert run.recording is not None
    channels = {channel.name: channel for channel in run.recording.channels}
    if teller.profile.channel not in channels or channels[teller.profile.channel].quantity not in ("speed", "tacho"):
        return None
    drive = channels[teller.profile.channel].drive
    others = [name for name in _channels(run) if channels[name].quantity != "sound_pressure"]
    others = [name for name in others if channels[name].drive != drive]
    if not others or teller.profile.si_symbol == "m/s":
        return None
    return (
        f"orders of {', '.join(others)} in run{{s}} {{runs}} are cut over the angle of {teller.profile.channel}, "
        f"a shaft of drive {drive}, which need not turn as fast as their own"
    )


def _tellers(first: FirstPass) -> Iterator[tuple[MeasuredRun, _Teller | str]]:
    """What tells each run's speed over time, or why its orders are not had."""
    for run in first.measured:
        yield run, _teller(run, first.drive(run))


def _teller(run: MeasuredRun, drive: Kinematics | None) -> _Teller | str:
    assert run.measurement is not None and run.recording is not None
    if not _channels(run):
        return "it has no sound or vibration in order"
    quantities = {channel.name: channel.quantity for channel in run.recording.channels}
    found: list[tuple[int, int, _Teller]] = []
    for number, profile in enumerate(run.measurement.speed.profiles):
        counted = quantities.get(profile.channel) == "tacho"
        placed = _placed(profile, drive)
        if placed is not None:
            rank, turns, shaft = placed
            found.append((2 * rank + (not counted), number, _Teller(profile, turns, shaft, counted)))
    if not found:
        return "its speed is not known over time"
    teller = min(found, key=lambda item: item[:2])[2]
    if teller.profile.stands:
        return "nothing turns in it"
    if run.measurement.steady and not teller.counted:
        return "its speed is constant and no tacho counts the turns; its lines have their orders in lines.csv"
    return teller


def _placed(profile: SpeedProfile, drive: Kinematics | None) -> tuple[int, float, str] | None:
    """How much a profile is to be preferred, turns of the reference shaft for its unit, and the reference shaft."""
    if profile.si_symbol == "m/s":
        return None if drive is None else (2, drive.motor_hz(1.0), "motor")
    if profile.shaft == "motor":
        return 0, 1.0, "motor"
    if profile.shaft == "wheelset":
        return (1, 1.0, "wheelset") if drive is None else (1, drive.motor_hz_of_wheel(1.0), "motor")
    return 3, 1.0, profile.shaft or ""


def _channels(run: MeasuredRun) -> tuple[str, ...]:
    """Channels in order that have levels."""
    assert run.recording is not None
    return tuple(name for name in run.usable_channels if run.recording[name].quantity in REFERENCES)


def _task(first: FirstPass, run: MeasuredRun, teller: _Teller) -> Task:
    assert run.measurement is not None and run.recording is not None
    prepared, analysis = first.prepared[run.name], first.campaign.analysis
    assert prepared.measurement is not None
    speed, survey = (prepared.measurement.inputs[name] for name in ("speed", "survey"))
    names = _channels(run)
    as_read = {channel.name: channel for channel in survey.settings.channels}  # type: ignore[union-attr]
    channels = tuple(as_read[name] for name in names)
    rate = max(channel.sample_rate_hz for channel in channels)
    drive = first.drive(run) if teller.shaft == "motor" else None
    low, middle, high = teller.speeds_hz()
    asked = _asked(analysis)
    highest = _highest_order(analysis, asked, drive, PASS_SHARE * rate / middle)
    orders, curves = expected_orders(drive, asked, teller.shaft, (low, high), highest, 0.5 * rate)
    ratios = () if drive is None else (("wheelset", drive.wheelset_order),)
    settings = OrderSettings(
        channels=channels,
        steady=run.measurement.steady,
        teller=teller.profile.channel,
        turns_per_unit=teller.turns_per_unit,
        shaft=teller.shaft,
        counted=teller.counted,
        ratios=ratios,
        orders=orders,
        curves=curves,
        carriers=_carriers(drive, orders),
        spacings=_spacings(drive, teller.shaft),
        bandwidth=analysis.order_bandwidth,
        highest_order=highest,
        resolution_hz=analysis.run_up_resolution_hz,
        vold_kalman=analysis.vold_kalman,
    )
    return ORDERS.task(prepared.measurement.label, settings, logs=prepared.logs, speed=speed)


def _carriers(drive: Kinematics | None, orders: Sequence[NamedOrder]) -> tuple[str, ...]:
    """Names of the orders whose sidebands are looked for: low mesh harmonics, else all that are asked for."""
    if drive is None:
        return tuple(order.name for order in orders if order.order >= LOWEST_CARRIER)
    wanted = [number * mesh for mesh in drive.mesh_orders.values() for number in range(1, CARRIERS + 1)]
    return tuple(o.name for o in orders if any(math.isclose(o.order, order, abs_tol=SAME) for order in wanted))


def _spacings(drive: Kinematics | None, shaft: str) -> tuple[tuple[str, float], ...]:
    """Shafts whose turns may modulate a mesh."""
    if drive is None:
        return ((f"{shaft} shaft".strip(), 1.0),)
    names = ["motor shaft", *(f"shaft {number}" for number in range(2, len(drive.shaft_orders))), "wheelset"]
    return tuple(zip(names, drive.shaft_orders, strict=True))


def _asked(analysis: AnalysisSettings) -> tuple[float, ...]:
    """Orders that the campaign names: to be cut, or to be tracked, which are cut too."""
    tracked = () if isinstance(analysis.vold_kalman, bool) else analysis.vold_kalman
    return tuple(dict.fromkeys((*analysis.orders, *tracked)))


def _highest_order(analysis: AnalysisSettings, orders: Sequence[float], drive: Kinematics | None, held: float) -> float:
    """Order up to which maps reach: as asked, else ten mesh harmonics, as far as the rate holds them at mid speed."""
    if analysis.highest_order is not None:
        return analysis.highest_order
    wanted = HIGHEST_UNNAMED if drive is None else (MESH_HARMONICS + ABOVE_MESH) * max(drive.mesh_orders.values())
    asked = max(orders, default=0.0) + 2.0 * analysis.order_bandwidth
    return max(min(wanted, held), asked)


def expected_orders(
    drive: Kinematics | None,
    asked: Sequence[float],
    shaft: str,
    speeds_hz: tuple[float, float],
    highest_order: float,
    highest_hz: float,
) -> tuple[tuple[NamedOrder, ...], tuple[FrequencyCurve, ...]]:
    """Return the orders that are looked for, by order, and the lines of the fleet that are none, as curves.

    Parameters
    ----------
    drive : Kinematics or None
    asked : sequence of float
        Orders of the reference shaft that the campaign names.
    shaft : str
        Reference shaft.
    speeds_hz : (float, float)
        That the run covers.
    highest_order, highest_hz : float
        Higher ones are left out, but for those that are asked for.
    """
    orders: dict[str, NamedOrder] = {}
    curves: dict[str, tuple[OrderKind, np.ndarray]] = {}
    speeds = np.linspace(0.98 * speeds_hz[0], 1.02 * speeds_hz[1], SPEEDS)
    for index, motor_hz in enumerate(speeds.tolist() if drive is not None else ()):
        assert drive is not None
        for item in drive.excitations(motor_hz, highest_hz):
            if item.order is None:
                held = curves.setdefault(item.name, (item.kind, np.full(SPEEDS, np.nan)))
                held[1][index] = item.frequency_hz
            elif item.order <= highest_order and not (item.pair is not None and item.harmonic > MESH_HARMONICS):
                own = item.kind == "wheelset"
                orders[item.name] = NamedOrder(
                    item.name, item.kind, item.order, "wheelset" if own else shaft, drive.wheelset_order if own else 1.0
                )
    for order in asked:
        known = [name for name, item in orders.items() if math.isclose(item.order, order, abs_tol=SAME)]
        if not known:
            orders[f"order {order:.6g}"] = NamedOrder(f"order {order:.6g}", "asked", float(order), shaft)
    return _each_once(orders.values()), tuple(
        FrequencyCurve(name, kind, speeds, values) for name, (kind, values) in curves.items()
    )


def _each_once(orders: Iterable[NamedOrder]) -> tuple[NamedOrder, ...]:
    """Orders by order; those that coincide as one, with both names."""
    found: list[NamedOrder] = []
    for order in sorted(orders, key=lambda item: item.order):
        if found and math.isclose(found[-1].order, order.order, abs_tol=SAME):
            last = found[-1]
            found[-1] = NamedOrder(f"{last.name} / {order.name}", last.kind, last.order, last.shaft, last.ratio)
        else:
            found.append(order)
    return tuple(found)

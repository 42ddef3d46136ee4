"""What is known before a motor's speed is read from lines: channels, orders and range, from campaign and fleet."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from tdacoustic.errors import MissingFileError
from tdacoustic.measured.line_speed_step import LineSpeedSettings
from tdacoustic.speed import CombOrder

if TYPE_CHECKING:
    from tdacoustic.campaign import Campaign, CampaignRun
    from tdacoustic.fleet import Fleet, Kinematics
    from tdacoustic.recording import Channel, Recording

__all__ = ["fleet_of", "line_orders", "line_speed_settings"]

MESH_HARMONICS: Final = 6
"""As in tests/evidence/tacholess_study.py, like the probabilities below."""
MESH_PRESENCE: Final = (0.7, 0.6, 0.5, 0.4, 0.3, 0.2)
SHAFT_PRESENCE: Final = 0.3
EXCITATION_PRESENCE: Final = 0.4
STATED_PRESENCE: Final = 0.5
"""Of an order that the campaign names without a fleet [assumed]."""
SLIP_REACH: Final = 0.015
"""How far a line of the supply lies beside its order, at least: the rotor's slip over its loads [assumed]."""
LOWEST_M_S: Final = 2.0
"""Train speed from which on lines are looked for, unless a slower one is stated [assumed]."""
MARGIN: Final = 1.25
"""Over the highest speed that the fleet's operation or a run names [assumed]."""
FASTEST_M_S: Final = 40.0
"""Train speed up to which lines are looked for, at least, where the fleet has no speeds of operation [assumed]."""
ACCELERATION_M_S2: Final = 2.5
"""Of a train with a wheel that slips [assumed]."""
PLAIN_HZ: Final = (1.0, 100.0)
PLAIN_ACCELERATION_HZ_S: Final = 8.0
"""Range and change of a motor's speed where there is no fleet [assumed: 60 to 6000 rpm, 480 rpm a second]."""
MOST_CHANNELS: Final = 4
NEARNESS: Final = ("gearbox", "motor", "shaft", "wheelset", "bogie")
"""Components by how clearly their sensors hear the drive."""


def fleet_of(campaign: Campaign) -> Fleet | None:
    """Return the campaign's fleet, or None where it names none or the file is not there."""
    if campaign.fleet is None:
        return None
    from tdacoustic.fleet import load_fleet

    try:
        return load_fleet(campaign.fleet.path)
    except MissingFileError:
        return None


def line_speed_settings(
    campaign: Campaign, run: CampaignRun, recording: Recording, fleet: Fleet | None
) -> LineSpeedSettings | str | None:
    """Return what a run's speed is read from lines with; None where it need not be, or why it cannot be.

    Parameters
    ----------
    campaign : Campaign
    run : CampaignRun
    recording : Recording
    fleet : Fleet or None
    """
    analysis = campaign.analysis
    always = analysis.speed_from == "lines"
    stated = run.train_speed_km_h is not None or run.motor_speed_rpm is not None
    if run.kind != "test" or analysis.speed_from == "channels" or (stated and not always):
        return None
    drive = None if fleet is None else _drive(fleet, run)
    told = any(channel.is_speed for channel in recording.channels)
    orders = line_orders(drive, _range_hz(campaign, fleet, drive)) if drive is not None else _stated_orders(campaign)
    channels = _channels(recording)
    if not orders or not channels:
        if told and not always:
            return None  # a channel is likely to tell it
        return (
            "there is no accelerometer and no microphone to look in"
            if orders
            else "no order of the drive is known: name a fleet, or [analysis] orders"
        )
    low, high = _range_hz(campaign, fleet, drive)
    per_metre = None if drive is None else drive.motor_hz(1.0)
    change = analysis.motor_speed_change_rpm_s
    if change is not None:
        fastest = change / 60.0
    else:
        fastest = PLAIN_ACCELERATION_HZ_S if per_metre is None else ACCELERATION_M_S2 * per_metre
    return LineSpeedSettings(channels, orders, low, high, fastest, always, _start_hz(run, drive), per_metre)


def line_orders(drive: Kinematics, range_hz: tuple[float, float]) -> tuple[CombOrder, ...]:
    """Return the orders of a drive that may be heard: mesh harmonics, the motor's shaft, slots, poles and supply.

    Lines that stand still (an inverter's carrier) tell no speed, and those of the wheelset lie too low.

    Parameters
    ----------
    drive : Kinematics
    range_hz : (float, float)
        Of the motor's speed.
    """
    low, high = range_hz
    found: dict[str, CombOrder] = {}
    for motor_hz in (high, math.sqrt(low * high), low):
        for item in drive.excitations(motor_hz, 1e5):
            if item.order is None or item.order <= 0.0 or item.name in found:
                continue
            if item.kind == "mesh" and item.harmonic <= MESH_HARMONICS:
                found[item.name] = CombOrder(item.name, item.order, MESH_PRESENCE[item.harmonic - 1])
            elif item.kind == "motor":
                shaft = item.name.startswith("motor shaft")
                reach = 0.0 if shaft else _reach(drive, item.name)
                found[item.name] = CombOrder(
                    item.name, item.order, SHAFT_PRESENCE if shaft else EXCITATION_PRESENCE, reach
                )
    motor = drive.motor
    if motor is not None and motor.pole_pairs is not None and not any(item.reach for item in found.values()):
        slip = 0.0 if motor.slip is None else motor.slip.value
        order = 2.0 * motor.pole_pairs.value / (1.0 - slip)
        found["supply x2"] = CombOrder("supply x2", order, EXCITATION_PRESENCE, max(SLIP_REACH, abs(slip)))
    return tuple(found.values())


def _reach(drive: Kinematics, name: str) -> float:
    """How far an excitation of the motor lies beside its order: those of the supply follow the rotor's slip."""
    motor = drive.motor
    terms = next((item.terms for item in motor.excitation if item.name == name), None) if motor is not None else None
    if motor is None or terms is None or not terms[1]:
        return 0.0
    return max(SLIP_REACH, 0.0 if motor.slip is None else abs(motor.slip.value))


def _stated_orders(campaign: Campaign) -> tuple[CombOrder, ...]:
    return tuple(CombOrder(f"order {order:g}", order, STATED_PRESENCE) for order in campaign.analysis.orders)


def _drive(fleet: Fleet, run: CampaignRun) -> Kinematics:
    from tdacoustic.fleet import Kinematics

    return Kinematics.of(fleet, run.wheel_diameter_mm)


def _range_hz(campaign: Campaign, fleet: Fleet | None, drive: Kinematics | None) -> tuple[float, float]:
    given = campaign.analysis.motor_speed_range_rpm
    if given is not None:
        return given[0] / 60.0, given[1] / 60.0
    if drive is None or fleet is None:
        return PLAIN_HZ
    computed = fleet.operation.train_speed_km_h
    km_h = [*(computed.value if computed is not None else (3.6 * FASTEST_M_S / MARGIN,))]
    for run in campaign.runs:
        km_h += [speed for speed in (run.train_speed_km_h, run.start_train_speed_km_h) if speed]
        stated = (run.motor_speed_rpm, run.start_motor_speed_rpm)
        km_h += [drive.train_speed_km_h(rpm / 60.0) for rpm in stated if rpm]
    lowest = min([3.6 * LOWEST_M_S, *(speed / MARGIN for speed in km_h)])
    return drive.motor_hz_at_km_h(lowest), drive.motor_hz_at_km_h(max(MARGIN * max(km_h), 2.0 * lowest))


def _start_hz(run: CampaignRun, drive: Kinematics | None) -> float | None:
    """Motor speed at the start, where a run states it; one that is stated for all of the run is its start's too."""
    for rpm in (run.start_motor_speed_rpm, run.motor_speed_rpm):
        if rpm:
            return rpm / 60.0
    for km_h in (run.start_train_speed_km_h, run.train_speed_km_h):
        if km_h and drive is not None:
            return drive.motor_hz_at_km_h(km_h)
    return None


def _channels(recording: Recording) -> tuple[Channel, ...]:
    """Accelerometers of one drive and one raster, those nearest to the drive first; else the microphones.

    Two drives may turn at two speeds, by their wheels' wear and slip.
    """
    shaken = [channel for channel in recording.channels if channel.quantity == "acceleration"]
    heard = [channel for channel in recording.channels if channel.quantity == "sound_pressure"]
    held = shaken or [channel for channel in heard if channel.role != "receiver"] or heard
    groups: dict[tuple[object, ...], list[Channel]] = {}
    for channel in held:
        groups.setdefault((channel.drive, *channel.raster_key), []).append(channel)
    best = max(groups.values(), key=_worth, default=[])
    return tuple(sorted(best, key=_distance)[:MOST_CHANNELS])


def _distance(channel: Channel) -> int:
    return NEARNESS.index(channel.component) if channel.component in NEARNESS else len(NEARNESS)


def _worth(channels: Sequence[Channel]) -> tuple[int, int]:
    return sum(channel.component in ("gearbox", "motor") for channel in channels), len(channels)

"""The mesh order over a campaign's run-ups as data of a calibration: one condition a speed."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FleetError
from tdacoustic.measured.mean_levels import MeanLevel, RecordedLevels, mean_levels
from tdacoustic.measured.order_cut import OrderCut, OrderLevel, cut_order, level_at, segment_spans_s, speeds_of
from tdacoustic.units import level_db
from tdacoustic.workflows.usable_recordings import SURFACE_M, UsableRecordings

if TYPE_CHECKING:
    from tdacoustic.drive import Condition
    from tdacoustic.fitting.measured_level import MeasuredLevel
    from tdacoustic.fleet import Fleet, Kinematics
    from tdacoustic.measured.runs import MeasuredRun
    from tdacoustic.speed import SpeedProfile

__all__ = ["order_levels"]

LOWEST_HZ: Final = 20.0
INSTANTS: Final = 17
"""At which the speed is looked up in the span of a segment."""

QUIET: Final = "at which the mesh order does not stand 6 dB over its floor"
CROWDED: Final = "at which another line of the fleet lies beside it"
OUTSIDE: Final = "outside of the model's frequencies or of the torque law"
EXCLUDED: Final = "excluded by the campaign"
EMPTY: Final = "that the run-up passes between two segments"

Reasons = Counter[str]


@dataclass(frozen=True)
class _Cut:
    """The mesh order of one run at one microphone."""

    run: MeasuredRun
    channel: str
    drive: Kinematics
    cut: OrderCut


@dataclass(frozen=True)
class _Speed:
    """The mesh order around one speed at 4 m."""

    condition: Condition
    recorded: RecordedLevels
    band_hz: tuple[float, float]
    segments: int


def order_levels(usable: UsableRecordings, fleet: Fleet) -> tuple[list[MeasuredLevel], list[str]]:
    """Return the level of the modelled pair's mesh order at 4 m over the speeds of the campaign's run-ups.

    Ten speeds at most are spread evenly over what the runs of a condition cover; each is a condition of its own, with
    the runs' torque or the fleet's torque law. A speed is left out where the order does not stand out, where another
    line of the fleet is as near as to lie in the same band, or where the model does not reach. Leaving out where the
    order is weak favours what is loud.

    Parameters
    ----------
    usable : UsableRecordings
    fleet : Fleet
    """
    doubts = list(usable.doubts_of(usable.near))
    by_condition: dict[str, list[_Cut]] = {}
    for run in usable.run_ups:
        cuts, problem = _cuts(usable, run, fleet)
        by_condition.setdefault(run.run.condition or "", []).extend(cuts)
        doubts += problem
    if not usable.run_ups:
        doubts.append("no run is a run-up with a known speed: there are no order levels")
    data: list[MeasuredLevel] = []
    for name, cuts in by_condition.items():
        if not cuts:
            continue
        speeds, left_out = _speeds(usable, name, cuts, fleet)
        means = mean_levels({s.condition.name: s.recorded for s in speeds}, usable.level_sigma_db, over_receivers=True)
        data += [_datum(usable, name, speed, means[speed.condition.name]) for speed in speeds]
        if left_out:
            words = ", ".join(f"{count} {reason}" for reason, count in left_out.items())
            total = len(speeds) + left_out.total()
            doubts.append(f"run-up {name}: {left_out.total()} of {total} speeds are not used: {words}")
    return data, doubts


def _datum(usable: UsableRecordings, name: str, speed: _Speed, mean: MeanLevel) -> MeasuredLevel:
    from tdacoustic.drive import Receiver
    from tdacoustic.fitting.measured_level import MeasuredLevel

    return MeasuredLevel(
        condition=speed.condition,
        receiver=Receiver(f"{SURFACE_M:g} m", SURFACE_M),
        level_db=mean.level_db,
        sigma_db=mean.sigma_db,
        weighting="Z",
        origin=usable.campaign.origin,
        source=f"mesh order of a run-up, {speed.segments} segments; {mean.words}",
        what="mesh order",
        band_hz=speed.band_hz,
        group=name,
    )


# ------------------------------------------------------------ one run


def _cuts(usable: UsableRecordings, run: MeasuredRun, fleet: Fleet) -> tuple[list[_Cut], list[str]]:
    """Cut the mesh order out of the powers of a run's microphones near 4 m."""
    from tdacoustic.fleet import Kinematics

    assert run.measurement is not None and run.recording is not None
    drive = Kinematics.of(fleet, run.run.wheel_diameter_mm)
    profile = run.measurement.speed.leading
    motor_hz = None if profile is None else _motor_hz(profile, drive)
    if profile is None or motor_hz is None:
        return [], [f"run {run.name}: its speed is of no shaft that is known, so no order can be cut"]
    channels = [name for name in usable.near if name in run.usable_channels and not usable.is_bad(run.name, name)]
    survey = usable.survey(run.name) if channels else None
    if survey is None:
        why = (
            "its powers are not (any longer) in the store of the analysis"
            if channels
            else "it has no microphone in order near 4 m"
        )
        return [], [f"run-up {run.name} is not used: {why}"]
    found = []
    for name in channels:
        raster, index = survey.of_channel(name)
        if raster.powers is None:
            continue
        plan = raster.powers.plan
        start, end = segment_spans_s(plan)
        instants_s = run.recording[name].start_s + np.linspace(start, end, INSTANTS, axis=1)
        turns_hz = np.interp(instants_s, profile.times_s, motor_hz, left=np.nan, right=np.nan)
        turns_hz = _held_to_the_ends(turns_hz)
        density, frames = raster.powers.density[index], raster.powers.frames[index]
        cut = cut_order(density, frames, plan.resolution_hz, drive.mesh_orders[fleet.modelled_pair.name], turns_hz)
        found.append(_Cut(run, name, drive, cut))
    return found, []


def _motor_hz(profile: SpeedProfile, drive: Kinematics) -> NDArray[np.float64] | None:
    """Turns of the motor per second over the times of a profile; None of a shaft that nobody names."""
    speed = np.abs(profile.speed)
    if profile.si_symbol == "m/s":
        return speed * drive.motor_hz(1.0)
    if profile.shaft == "motor":
        return speed
    return speed * drive.motor_hz_of_wheel(1.0) if profile.shaft == "wheelset" else None


def _held_to_the_ends(turns_hz: NDArray[np.float64]) -> NDArray[np.float64]:
    """Speeds of segments, shape (n_segments, n_instants), without those whose middle lies outside of the profile.

    Half a segment before its first and after its last value the profile is taken as constant.
    """
    known = np.isfinite(turns_hz)
    inside = known[:, turns_hz.shape[1] // 2]
    filled = np.where(known, turns_hz, turns_hz[:, [turns_hz.shape[1] // 2]])
    return np.where(inside[:, None], filled, np.nan)


# ------------------------------------------------------------ over the speeds


def _speeds(usable: UsableRecordings, name: str, cuts: Sequence[_Cut], fleet: Fleet) -> tuple[list[_Speed], Reasons]:
    """Gather the runs and microphones of a condition speed by speed."""
    covered = np.concatenate([item.cut.speed_hz[np.isfinite(item.cut.mean_square)] for item in cuts])
    if not covered.size or not covered.max() > covered.min():
        return [], Counter()
    found, left_out = [], Counter[str]()
    for speed_hz, reach_hz in zip(*speeds_of(float(covered.min()), float(covered.max())), strict=True):
        at = [(item, level_at(item.cut, float(speed_hz), float(reach_hz))) for item in cuts]
        held = [(item, level) for item, level in at if level is not None]
        speed = _speed(usable, name, held, fleet)
        if isinstance(speed, str):
            left_out[speed] += 1
        else:
            found.append(speed)
    return found, left_out


def _speed(usable: UsableRecordings, name: str, held: Sequence[tuple[_Cut, OrderLevel]], fleet: Fleet) -> _Speed | str:
    """Return the order around a speed, or why it is not used."""
    if not held:
        return EMPTY
    drive = held[0][0].drive
    motor_hz = float(np.mean([level.speed_hz for _, level in held]))
    order_hz = drive.mesh_orders[fleet.modelled_pair.name] * motor_hz
    half_hz = max(level.half_width_hz for _, level in held)
    if order_hz - half_hz < LOWEST_HZ or order_hz + half_hz > fleet.number("radiation.max_frequency_hz"):
        return OUTSIDE
    if _is_crowded(drive, fleet.modelled_pair.name, held, half_hz):
        return CROWDED
    if not all(level.stands_out for _, level in held):
        return QUIET
    band_hz = (order_hz - half_hz, order_hz + half_hz)
    if any(usable.is_excluded(name, item.channel, band_hz) for item, _ in held):
        return EXCLUDED
    try:
        condition = _condition(name, [item for item, _ in held], motor_hz, fleet)
    except FleetError:
        return OUTSIDE
    return _Speed(condition, _recorded(held), band_hz, sum(level.segments for _, level in held))


def _recorded(held: Sequence[tuple[_Cut, OrderLevel]]) -> RecordedLevels:
    levels, sigmas = {}, {}
    for item, level in held:
        place = (item.run.name, item.channel)
        value_db = level_db(math.sqrt(level.mean_square), "sound_pressure")
        if value_db is not None:
            levels[place] = value_db
        if level.segments > 1:
            sigmas[place] = 10.0 / math.log(10.0) * level.error / level.mean_square
    return RecordedLevels(levels, sigmas)


def _is_crowded(drive: Kinematics, pair: str, held: Sequence[tuple[_Cut, OrderLevel]], half_hz: float) -> bool:
    """Whether another line that the fleet knows lies in the band at the lowest, the mean or the highest speed."""
    order = drive.mesh_orders[pair]
    speeds = [level.speed_hz for _, level in held]
    for motor_hz in {min(speeds), sum(speeds) / len(speeds), max(speeds)}:
        mesh_hz = order * motor_hz
        for line in drive.excitations(motor_hz, mesh_hz + half_hz):
            own = line.kind == "mesh" and line.pair == pair and line.harmonic == 1
            if not own and abs(line.frequency_hz - mesh_hz) <= half_hz:
                return True
    return False


def _condition(name: str, cuts: Sequence[_Cut], motor_hz: float, fleet: Fleet) -> Condition:
    from tdacoustic.drive import Condition, torque_at

    train_speed_km_h = cuts[0].drive.train_speed_km_h(motor_hz)
    stated = [item.run.run.torque_n_m for item in cuts if item.run.run.torque_n_m is not None]
    torque_n_m = sum(stated) / len(stated) if stated else torque_at(fleet, train_speed_km_h)
    label = f"{name} at {60.0 * motor_hz:.0f} rpm"
    return Condition(label, train_speed_km_h, motor_hz, torque_n_m, fleet.operation.mode.value)

"""From an analysis and a campaign's known levels to the data of a calibration."""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

from tdacoustic.errors import FittingError

if TYPE_CHECKING:
    from tdacoustic.campaign import Campaign
    from tdacoustic.drive import Condition
    from tdacoustic.fitting.levels import MeasuredLevel
    from tdacoustic.fleet import Fleet
    from tdacoustic.results import Analysis

__all__ = ["measured_levels"]

SURFACE_M: Final = 4.0
NEAR: Final = 0.05
"""A receiver whose distance differs by no more from 4 m belongs to the 4 m level; others are not moved there."""

RECORDING_SIGMA_DB: Final = 0.3
STATED_SIGMA_DB: Final = 1.0
"""Standard deviations of a recorded level and of a stated one where nothing says them [assumed]."""


def measured_levels(
    campaign: Campaign, analysis: Analysis | None, fleet: Fleet
) -> tuple[list[MeasuredLevel], list[str]]:
    """Return the 4 m levels of a campaign, and what could not be used in words.

    The measured 4 m level of a condition is the energy mean of ``level_db`` (of the whole record, corrected for
    background where that is recorded) over its runs and over the receivers within 5 % of 4 m; levels of ``[[level]]``
    are taken as they stand, at their own distance.

    Parameters
    ----------
    campaign : Campaign
    analysis : Analysis or None
        None of a campaign without runs.
    fleet : Fleet

    Raises
    ------
    FittingError
        There is nothing to calibrate with.
    """
    from tdacoustic.drive import Receiver
    from tdacoustic.fitting.levels import MeasuredLevel

    doubts: list[str] = []
    conditions, problems = _conditions(campaign, analysis, fleet)
    doubts += problems
    surface = Receiver(f"{SURFACE_M:g} m", SURFACE_M)
    data = []
    for name, level_db, sigma_db in _recorded(campaign, analysis):
        if name in conditions:
            data.append(
                MeasuredLevel(conditions[name], surface, level_db, sigma_db, "Z", campaign.origin, "recordings")
            )
    for known in campaign.levels:
        if known.weighting == "C":
            doubts.append(f"the C-weighted level of condition {known.condition} is not used")
        elif known.condition in conditions:
            near = abs(known.distance_m - SURFACE_M) <= NEAR * SURFACE_M
            place = surface if near else Receiver(f"{known.distance_m:g} m", known.distance_m)
            sigma_db = STATED_SIGMA_DB if known.sigma_db is None else known.sigma_db
            source = known.origin or "stated in the campaign"
            condition = conditions[known.condition]
            data.append(MeasuredLevel(condition, place, known.level_db, sigma_db, known.weighting, "printed", source))
    if not data:
        raise FittingError(
            f"{campaign.path}: no level to calibrate with: no receiver within 5 % of 4 m (role, distance_m) in a "
            "usable run, and no [[level]]"
        )
    return data, doubts


def _recorded(campaign: Campaign, analysis: Analysis | None) -> Iterator[tuple[str, float, float]]:
    """Yield condition, level and standard deviation of the 4 m level from recordings."""
    from tdacoustic.measured.levels import energy_mean_db

    if analysis is None:
        return
    near = {
        channel.name
        for channel in campaign.channels
        if channel.quantity == "sound_pressure"
        and channel.distance_m is not None
        and abs(channel.distance_m - SURFACE_M) <= NEAR * SURFACE_M
    }
    table = analysis.tables["levels"]
    tested = {run.name for run in analysis.runs if run.run.kind == "test" and run.run.valid}
    held = table[table["channel"].isin(near) & table["run"].isin(tested) & table["level_db"].notna()]
    for name, rows in held.groupby("condition", sort=False):
        level_db = energy_mean_db(rows["level_db"])
        by_run = [energy_mean_db(of_run["level_db"]) for _, of_run in rows.groupby("run")]
        found = [level for level in by_run if level is not None]
        spread = statistics.stdev(found) / len(found) ** 0.5 if len(found) > 1 else 0.0
        if level_db is not None:
            yield str(name), level_db, max(RECORDING_SIGMA_DB, spread)


def _conditions(campaign: Campaign, analysis: Analysis | None, fleet: Fleet) -> tuple[dict[str, Condition], list[str]]:
    """Conditions with their speed and torque: the runs', else the fleet's of that name."""
    from tdacoustic.drive import Condition, conditions_of, torque_at
    from tdacoustic.fleet import Kinematics

    of_fleet: Mapping[str, Any] = {}
    if fleet.operation.train_speed_km_h is not None:
        of_fleet = {condition.name: condition for condition in conditions_of(fleet)}
    found: dict[str, Condition] = {}
    doubts = []
    modes = set()
    for name in campaign.conditions():
        runs = [run for run in campaign.test_runs() if run.condition == name and run.valid]
        speeds = [run.train_speed_km_h for run in runs if run.train_speed_km_h is not None]
        if not speeds and analysis is not None:
            speeds = [analysis.kinematics[run.name].train_speed_km_h for run in runs if run.name in analysis.kinematics]
        if not speeds:
            if name in of_fleet:
                found[name] = of_fleet[name]
            else:
                doubts.append(f"condition {name} has no speed, neither in its runs nor in the fleet: it is left out")
            continue
        speed = statistics.fmean(speeds)
        torques = [run.torque_n_m for run in runs if run.torque_n_m is not None]
        torque = statistics.fmean(torques) if torques else torque_at(fleet, speed)
        stated = {run.mode for run in runs if run.mode is not None}
        if not torques and stated and stated != {fleet.operation.mode.value}:
            modes |= stated
        motor_hz = Kinematics.of(fleet).motor_hz_at_km_h(speed)
        found[name] = Condition(name, speed, motor_hz, torque, fleet.operation.mode.value)
    if modes:
        doubts.append(
            f"the runs were {', '.join(sorted(modes))} and state no torque: the model computes the fleet's "
            f"{fleet.operation.mode.value} at its torque law, another load than that of the test"
        )
    return found, doubts

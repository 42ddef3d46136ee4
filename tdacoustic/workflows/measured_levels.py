"""From an analysis and a campaign's known levels to the data of a calibration."""

from __future__ import annotations

import statistics
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Final

from tdacoustic.errors import FittingError
from tdacoustic.workflows.usable_recordings import NEAR, SURFACE_M, UsableRecordings

if TYPE_CHECKING:
    from tdacoustic.campaign import Campaign, CampaignRun
    from tdacoustic.drive import Condition
    from tdacoustic.fitting.measured_level import MeasuredLevel
    from tdacoustic.fleet import Fleet
    from tdacoustic.results import Analysis
    from tdacoustic.steps import Store

__all__ = ["DATA", "campaign_conditions", "measured_levels", "more_conditions"]

DATA: Final = ("surface", "receivers", "bands", "orders")
"""What a model can be held against."""

LEVEL_SIGMA_DB: Final = 0.3
STATED_SIGMA_DB: Final = 1.0
"""Standard deviations of what instruments leave open and of a stated level where nothing says them [assumed]."""


def measured_levels(
    campaign: Campaign,
    analysis: Analysis | None,
    fleet: Fleet,
    data: Collection[str] = ("surface",),
    level_sigma_db: float = LEVEL_SIGMA_DB,
    store: Store | None = None,
) -> tuple[list[MeasuredLevel], list[str]]:
    """Return the levels of a campaign that a model can be held against, and what could not be used in words.

    Levels of ``[[level]]`` are taken as they stand, at their own distance. From recordings come, as `data` asks:

    - ``"surface"``: the 4 m level of a condition, the energy mean of ``level_db`` (of the whole record, corrected for
      background where that is recorded) over its runs and over the receivers within 5 % of 4 m;
    - ``"receivers"``: the level at each microphone of role receiver whose place is known, over the condition's runs;
    - ``"bands"``: the third-octave levels at 4 m, from 20 Hz to the model's upper limit;
    - ``"orders"``: the level of the modelled pair's mesh order at 4 m over run-ups, each speed a condition of its own.

    Channels that are bad do not enter. Standard deviations: see `tdacoustic.measured.mean_levels`.

    Parameters
    ----------
    campaign : Campaign
    analysis : Analysis or None
        None of a campaign without runs.
    fleet : Fleet
    data : collection of str
        Out of `DATA`.
    level_sigma_db : float
        Standard deviation of a recorded level that instruments and their calibration leave open.
    store : Store, optional
        In which the analysis was made. Without it no run-up can be used, and nobody asks what a record that was made
        once shows of its own scatter.

    Raises
    ------
    FittingError
        There is nothing to calibrate with, or `data` asks for what there is not.
    CampaignError
        A microphone's place cannot be.
    """
    unknown = [name for name in data if name not in DATA]
    if unknown or not data:
        raise FittingError(f"data must be out of {', '.join(DATA)}, got {', '.join(unknown) or 'nothing'}")
    conditions, doubts = campaign_conditions(campaign, analysis, fleet)
    found: list[MeasuredLevel] = []
    if analysis is not None:
        usable = UsableRecordings(campaign, analysis, store, level_sigma_db)
        for levels, problems in _recorded(usable, conditions, fleet, data):
            found += levels
            doubts += problems
        doubts += _not_there(campaign, found, data)
        if "surface" in data and not {"receivers", "bands"}.isdisjoint(data):
            others = " and ".join(name for name in ("receivers", "bands") if name in data)
            doubts.append(f"the 4 m level and its {others} are of the same recordings, which count more than once")
    elif set(data) != {"surface"}:
        doubts.append(f"data: there are no recordings to take {' and '.join(data)} from; stated levels alone are used")
    levels, problems = _stated(campaign, conditions)
    found += levels
    doubts += problems
    if not found:
        said = "; ".join(dict.fromkeys(doubts))
        raise FittingError(
            f"{campaign.path}: no level to calibrate with: no receiver within 5 % of 4 m (role, distance_m) in a "
            f"usable run, and no [[level]] (data: {', '.join(data)}{'; ' + said if said else ''})"
        )
    return found, list(dict.fromkeys(doubts))


def _not_there(campaign: Campaign, found: Sequence[MeasuredLevel], data: Collection[str]) -> list[str]:
    """Say which kind of level was asked for and is not there."""
    held = {
        "receivers": any(datum.receiver.name in {channel.name for channel in campaign.channels} for datum in found),
        "bands": any(datum.what.startswith("1/3 octave") for datum in found),
        "orders": any(datum.what == "mesh order" for datum in found),
    }
    return [f"data: no levels of {kind} are there" for kind in data if not held.get(kind, True)]


def _recorded(
    usable: UsableRecordings, conditions: Mapping[str, Condition], fleet: Fleet, data: Collection[str]
) -> Iterator[tuple[list[MeasuredLevel], list[str]]]:
    from tdacoustic.workflows.microphones import microphone_doubts, microphones
    from tdacoustic.workflows.recorded_levels import band_levels, receiver_levels, surface_levels
    from tdacoustic.workflows.run_up_levels import order_levels

    if "surface" in data:
        yield surface_levels(usable, conditions)
    if "receivers" in data:
        yield receiver_levels(usable, conditions, microphones(usable.campaign, fleet))
        yield [], list(microphone_doubts(usable.campaign, fleet))
    if "bands" in data:
        yield band_levels(usable, conditions, fleet.number("radiation.max_frequency_hz"))
    if "orders" in data:
        yield order_levels(usable, fleet)
    yield [], list(usable.calibrator_doubts(_microphones(usable, data)))


def _microphones(usable: UsableRecordings, data: Collection[str]) -> set[str]:
    """Microphones whose levels feed the calibration."""
    found = set() if set(data) == {"receivers"} else set(usable.near)
    if "receivers" in data:
        found |= {name for name, channel in usable.microphones.items() if channel.role == "receiver"}
    return found


def _stated(campaign: Campaign, conditions: Mapping[str, Condition]) -> tuple[list[MeasuredLevel], list[str]]:
    """Levels of ``[[level]]``."""
    from tdacoustic.drive import Receiver
    from tdacoustic.fitting.measured_level import MeasuredLevel

    found, doubts = [], []
    standing = "measured" if campaign.origin == "measured" else "printed"  # a synthetic campaign makes no levels
    for known in campaign.levels:
        if known.weighting == "C":
            doubts.append(f"the C-weighted level of condition {known.condition} is not used")
        elif known.condition in conditions:
            near = abs(known.distance_m - SURFACE_M) <= NEAR * SURFACE_M
            distance_m = SURFACE_M if near else known.distance_m
            found.append(
                MeasuredLevel(
                    condition=conditions[known.condition],
                    receiver=Receiver(f"{distance_m:g} m", distance_m),
                    level_db=known.level_db,
                    sigma_db=STATED_SIGMA_DB if known.sigma_db is None else known.sigma_db,
                    weighting=known.weighting,
                    origin=standing,
                    source=known.origin or "stated in the campaign",
                )
            )
    return found, doubts


# ---------------------------------------------------------------- conditions


def campaign_conditions(
    campaign: Campaign, analysis: Analysis | None, fleet: Fleet
) -> tuple[dict[str, Condition], list[str]]:
    """Return the conditions of a campaign by name, and what is doubtful about them.

    Speed and torque are those of the runs, else those of the fleet's condition of that name; the torque of a run that
    states none is the fleet's torque law at its speed. A run-up has no one speed and makes no condition.

    Parameters
    ----------
    campaign : Campaign
    analysis : Analysis or None
        For speeds that no run states, and for what is a run-up; None of a campaign without runs.
    fleet : Fleet
    """
    from tdacoustic.drive import Condition, conditions_of, torque_at

    tested = [run for run in campaign.test_runs() if run.valid]
    run_ups = _run_ups(analysis)
    found: dict[str, Condition] = {}
    doubts = [_run_up_doubt(run) for run in tested if run.name in run_ups]
    for name in campaign.conditions():
        runs = [run for run in tested if run.condition == name and run.name not in run_ups]
        speeds = list(_speeds(runs, analysis, fleet))
        if not speeds:
            if any(run.condition == name for run in tested if run.name in run_ups):
                continue
            if name in fleet.operation.names:
                found[name] = next(condition for condition in conditions_of(fleet) if condition.name == name)
            else:
                doubts.append(f"condition {name} has no speed, neither in its runs nor in the fleet: it is left out")
            continue
        speed_km_h = statistics.fmean(train for train, _ in speeds)
        motor_hz = statistics.fmean(motor for _, motor in speeds)
        if not motor_hz > 0.0:
            doubts.append(f"condition {name} stands still, where the model has no sound: it is left out")
            continue
        torques = [run.torque_n_m for run in runs if run.torque_n_m is not None]
        torque = statistics.fmean(torques) if torques else torque_at(fleet, speed_km_h)
        found[name] = Condition(name, speed_km_h, motor_hz, torque, fleet.operation.mode.value)
    return found, [*doubts, *_other_modes(campaign, tested, fleet)]


def more_conditions(fleet: Fleet, held: Collection[str]) -> dict[str, Condition]:
    """Return the conditions of the fleet's ``[operation]`` whose names a campaign does not have, by name."""
    from tdacoustic.drive import conditions_of

    if fleet.operation.train_speed_km_h is None:
        return {}
    return {condition.name: condition for condition in conditions_of(fleet) if condition.name not in held}


def _run_ups(analysis: Analysis | None) -> set[str]:
    """Names of the runs whose speed is not constant."""
    runs = () if analysis is None else analysis.runs
    return {run.name for run in runs if run.measurement is not None and not run.measurement.steady}


def _run_up_doubt(run: CampaignRun) -> str:
    return f"run {run.name} of condition {run.condition} is a run-up: it has no one speed, and no level of its own"


def _speeds(runs: Iterable[CampaignRun], analysis: Analysis | None, fleet: Fleet) -> Iterator[tuple[float, float]]:
    """Train speed in km/h and turns of the motor per second of each run: as stated, else as measured."""
    from tdacoustic.fleet import Kinematics

    for run in runs:
        drive = Kinematics.of(fleet, run.wheel_diameter_mm)
        if run.train_speed_km_h is not None:
            yield run.train_speed_km_h, drive.motor_hz_at_km_h(run.train_speed_km_h)
        elif run.motor_speed_rpm is not None:
            yield drive.train_speed_km_h(run.motor_speed_rpm / 60.0), run.motor_speed_rpm / 60.0
        elif analysis is not None and run.name in analysis.kinematics:
            measured = analysis.kinematics[run.name]
            yield measured.train_speed_km_h, measured.motor_hz


def _other_modes(campaign: Campaign, tested: Iterable[CampaignRun], fleet: Fleet) -> Iterator[str]:
    """Say where runs were in another mode than the fleet's and state no torque."""
    stated = fleet.operation.mode.value
    tested = list(tested)
    modes: set[str] = set()
    for name in campaign.conditions():
        runs = [run for run in tested if run.condition == name]
        held = {run.mode for run in runs if run.mode is not None}
        if held and held != {stated} and all(run.torque_n_m is None for run in runs):
            modes |= held
    if modes:
        yield (
            f"the runs were {', '.join(sorted(modes))} and state no torque: the model computes the fleet's "
            f"{stated} at its torque law, another load than that of the test"
        )

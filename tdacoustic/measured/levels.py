"""Levels of runs and conditions, corrected for background."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from tdacoustic.campaign import CampaignRun
from tdacoustic.measured.results import ChannelResult
from tdacoustic.measured.run_sensors import CALIBRATION
from tdacoustic.measured.runs import MeasuredRun
from tdacoustic.recording import Channel
from tdacoustic.spectra import correct_for_background
from tdacoustic.units import level_db, reference_label

__all__ = ["ConditionLevels", "RunLevel", "background_laeq_db", "condition_levels", "energy_mean_db"]


def energy_mean_db(levels_db: Iterable[float]) -> float | None:
    """Return the energy mean of levels, or None of none.

    Examples
    --------
    >>> round(energy_mean_db([80.0, 83.0]), 2)
    81.75
    """
    held = list(levels_db)
    return 10.0 * math.log10(sum(10.0 ** (0.1 * level) for level in held) / len(held)) if held else None


@dataclass(frozen=True)
class RunLevel:
    """One row of ``levels.csv``: a channel of a run.

    Levels are None where the quantity has none or the channel is not usable;
    `level_db`, `laeq_db` and `level_band_db` are corrected for background, each
    by its own; `rms` is as measured. `calibration` is what calibrators before and
    after say of the channel: ``"ok"`` or ``"doubtful"``, empty where there were none.
    `distance_m` and `role` are of a microphone, as the campaign says.
    """

    run: str
    condition: str | None
    train_speed_km_h: float | None
    channel: str
    component: str | None
    quantity: str
    rms: float | None
    level_db: float | None
    reference: str | None
    laeq_db: float | None
    background_db: float | None
    correction: str
    si_unit: str
    level_band_db: float | None
    level_band_from_hz: float
    level_band_to_hz: float
    calibration: str = ""
    distance_m: float | None = None
    role: str | None = None


@dataclass(frozen=True)
class ConditionLevels:
    """Levels of all runs, and the speed of each condition.

    Parameters
    ----------
    runs : tuple of RunLevel
    train_speed_km_h : mapping of str to float or None
        By condition: the mean over its runs.
    """

    runs: tuple[RunLevel, ...]
    train_speed_km_h: Mapping[str, float | None]

    def spread_db(self, condition: str, channels: Sequence[str]) -> float | None:
        """Return the largest difference of a channel's level between the runs of a condition, or None of one run."""
        spreads = []
        for channel in channels:
            held = [row.level_db for row in self.runs if (row.condition, row.channel) == (condition, channel)]
            known = [level for level in held if level is not None]
            if len(known) > 1:
                spreads.append(max(known) - min(known))
        return max(spreads, default=None)


def condition_levels(
    runs: Sequence[MeasuredRun], train_speeds_km_h: Mapping[str, float] | None = None
) -> ConditionLevels:
    """Return the levels of the test runs, corrected for the campaign's background runs.

    A background run with a condition is that condition's alone, one without is
    everybody's; several are averaged in energy.

    Parameters
    ----------
    runs : sequence of MeasuredRun
    train_speeds_km_h : mapping of str to float, optional
        By run, from the fleet's kinematics, where the run itself states none.
    """
    rows = []
    speeds: dict[str, list[float]] = {}
    for run in runs:
        if run.run.kind != "test":
            continue
        condition = run.run.condition or ""
        speeds.setdefault(condition, [])
        train_speed_km_h = run.train_speed_km_h
        if train_speed_km_h is None:
            train_speed_km_h = (train_speeds_km_h or {}).get(run.name)
        if train_speed_km_h is not None:
            speeds[condition].append(train_speed_km_h)
        if run.measurement is None or run.recording is None:
            continue
        background = _backgrounds(runs, run.run)
        rows += [
            _run_level(run, run.recording[result.channel], result, background, train_speed_km_h)
            for result in run.measurement.channels
        ]
    return ConditionLevels(
        tuple(rows),
        {name: sum(values) / len(values) if values else None for name, values in speeds.items()},
    )


def background_laeq_db(runs: Sequence[MeasuredRun], of_run: CampaignRun) -> dict[str, float]:
    """Return the A-weighted level of the background that holds for a run, by channel; none without background runs.

    Parameters
    ----------
    runs : sequence of MeasuredRun
        All of the campaign.
    of_run : CampaignRun
    """
    return {name: level for name, (_, level, _) in _backgrounds(runs, of_run).items() if level is not None}


Background = tuple[float | None, float | None, float | None]
"""Level, A-weighted level and level in the band of a channel's background."""


def _backgrounds(runs: Sequence[MeasuredRun], of_run: CampaignRun) -> Mapping[str, Background]:
    """Background of each channel, the energy mean of the runs that hold for a run."""
    held = [
        run
        for run in runs
        if run.run.kind == "background"
        and run.measurement is not None
        and run.run.condition in (None, of_run.condition)
    ]
    own = [run for run in held if run.run.condition is not None]
    levels: dict[str, list[ChannelResult]] = {}
    quantities: dict[str, str] = {}
    for run in own or held:
        assert run.measurement is not None and run.recording is not None
        for result in run.measurement.channels:
            if result.usable:
                levels.setdefault(result.channel, []).append(result)
                quantities[result.channel] = run.recording[result.channel].quantity
    return {
        name: (
            energy_mean_db(level for r in results if (level := level_db(r.rms, quantities[name])) is not None),
            energy_mean_db(r.laeq_db for r in results if r.laeq_db is not None),
            energy_mean_db(
                level for r in results if (level := level_db(r.band_rms or 0.0, quantities[name])) is not None
            ),
        )
        for name, results in levels.items()
    }


def _run_level(
    run: MeasuredRun,
    channel: Channel,
    result: ChannelResult,
    backgrounds: Mapping[str, Background],
    train_speed_km_h: float | None,
) -> RunLevel:
    background_db, background_a_db, background_band_db = backgrounds.get(channel.name, (None, None, None))
    level = level_db(result.rms, channel.quantity) if result.usable else None
    corrected, laeq_db, correction = level, result.laeq_db if result.usable else None, "none"
    if level is not None:
        outcome = correct_for_background(level, background_db)
        corrected, correction = outcome.level_db, outcome.kind
    if laeq_db is not None:
        laeq_db = correct_for_background(laeq_db, background_a_db).level_db
    band = None if result.band_rms is None or not result.usable else level_db(result.band_rms, channel.quantity)
    if band is not None:
        band = correct_for_background(band, background_band_db).level_db
    return RunLevel(
        run=run.name,
        condition=run.run.condition,
        train_speed_km_h=train_speed_km_h,
        channel=channel.name,
        component=channel.component,
        quantity=channel.quantity,
        rms=result.rms if result.usable else None,
        level_db=corrected,
        reference=reference_label(channel.quantity),
        laeq_db=laeq_db,
        background_db=background_db if level is not None else None,
        correction=correction,
        si_unit=channel.si_symbol,
        level_band_db=band,
        level_band_from_hz=result.level_band_hz[0],
        level_band_to_hz=result.level_band_hz[1],
        calibration=_calibration(run, channel.name),
        distance_m=channel.distance_m,
        role=channel.role,
    )


def _calibration(run: MeasuredRun, channel: str) -> str:
    held = [item.verdict for item in run.verdicts if (item.channel, item.check) == (channel, CALIBRATION)]
    return "" if not held else "ok" if set(held) == {"ok"} else "doubtful"

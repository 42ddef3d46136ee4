"""Runs in traction, braking and coasting: their bands over time, and their comparison at one speed each."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from tdacoustic.attribution import run_speeds, steady_speeds
from tdacoustic.attribution.contribution_spans import third_octaves
from tdacoustic.attribution.mode_comparison import FREE, LOADED, ModeRecord, SpeedModes, compare_at_speeds
from tdacoustic.contributions import Span
from tdacoustic.measured.receiver_bands_step import RECEIVER_BANDS, ReceiverBands, ReceiverBandsSettings, ReceiverPowers
from tdacoustic.measured.runs import MeasuredRun, receivers
from tdacoustic.steps import Task

if TYPE_CHECKING:
    from tdacoustic.workflows.second_pass import FirstPass, SecondPass

__all__ = ["KIND", "campaign_modes", "mode_tasks"]

KIND: Final = "bands of the modes"
LOWEST_HZ: Final = 20.0
RATE_PART: Final = 0.4
HIGHEST_HZ: Final = 10000.0


def _runs(first: FirstPass) -> list[MeasuredRun]:
    """Runs with a mode, where there are both loaded ones and others; else none."""
    held = [run for run in first.measured if run.run.mode is not None]
    modes = {run.run.mode for run in held}
    return held if modes & set(FREE) and modes & set(LOADED) else []


def _bands(first: FirstPass, runs: list[MeasuredRun]) -> tuple[Span, ...]:
    """Third octaves that the coarsest lines of the runs resolve, and one band below them."""
    analysis = first.campaign.analysis
    steady = all(run.measurement is not None and run.measurement.steady for run in runs)
    step_hz = analysis.frequency_resolution_hz
    step_hz = step_hz if steady else max(step_hz, analysis.run_up_resolution_hz)
    rates = [c.sample_rate_hz for run in runs if run.recording is not None for c in run.recording.channels if _heard(c)]
    low_hz, high_hz = analysis.level_band_hz or (LOWEST_HZ, HIGHEST_HZ)
    low_hz, high_hz = max(low_hz, 2.0 * step_hz), min(high_hz, RATE_PART * min(rates, default=0.0))
    octaves = third_octaves(low_hz, high_hz, step_hz)
    if octaves and octaves[0].low_hz > 1.1 * low_hz:
        first_hz = octaves[0].low_hz
        octaves.insert(0, Span(f"{low_hz:.3g} to {first_hz:.3g} Hz", low_hz, first_hz))
    return tuple(octaves)


def _heard(channel: object) -> bool:
    return getattr(channel, "quantity", "") == "sound_pressure"


def mode_tasks(first: FirstPass) -> dict[str, Task]:
    """Return the task of each run that is to be compared; none where no speed can have two modes."""
    runs, tasks = _runs(first), {}
    bands = _bands(first, runs) if runs else ()
    for run in runs:
        heard = tuple(name for name in receivers(first.runs) if name in run.usable_channels)
        measurement = first.prepared[run.name].measurement
        if heard and bands and measurement is not None:
            survey = measurement.inputs["survey"]
            assert isinstance(survey, Task)
            tasks[run.name] = RECEIVER_BANDS.task(f"run {run.name}", ReceiverBandsSettings(heard, bands), survey=survey)
    return tasks


def campaign_modes(first: FirstPass, second: SecondPass) -> tuple[SpeedModes, ...] | None:
    """Return the comparisons by receiver and speed; None where the campaign has no runs to compare."""
    results = second.of_kind(KIND)
    runs = [run for run in _runs(first) if run.name in results]
    if not runs:
        return None
    bands = [band.name for band in _bands(first, _runs(first))]
    found: list[SpeedModes] = []
    for channel in receivers(first.runs):
        records: dict[str, list[ModeRecord]] = {"km/h": [], "1/s": []}
        for run in runs:
            bands_of_run: ReceiverBands = results[run.name]
            for powers in bands_of_run.powers:
                if powers.channel == channel:
                    for unit, record in _record(first, run, powers).items():
                        records[unit].append(record)
        unit = "km/h" if len(records["km/h"]) >= len(records["1/s"]) else "1/s"
        found += compare_at_speeds(channel, records[unit], unit, bands)
    return tuple(found)


def _record(first: FirstPass, run: MeasuredRun, powers: ReceiverPowers) -> dict[str, ModeRecord]:
    """The record of a run by the unit that its speed is known in."""
    assert run.measurement is not None and run.recording is not None
    drive, count = first.drive(run), powers.weights.size
    speeds: dict[str, np.ndarray] = {}
    if run.measurement.steady:
        motor_hz, km_h = steady_speeds(run, drive)
        of_units = {"km/h": km_h, "1/s": motor_hz}
        speeds = {unit: np.full(count, value) for unit, value in of_units.items() if value is not None}
    else:
        over_time = run_speeds(run, drive, powers.times_s + run.recording[powers.channel].start_s)
        if over_time is not None:
            told = {"km/h": over_time.train_km_h, "1/s": over_time.motor_hz}
            speeds = {unit: value for unit, value in told.items() if value is not None}
    mode, torque = str(run.run.mode), run.run.torque_n_m
    return {
        unit: ModeRecord(run.name, mode, run.measurement.steady, speed, powers.mean_square, powers.weights, torque)
        for unit, speed in speeds.items()
    }

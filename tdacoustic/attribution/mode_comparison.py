"""Traction, braking and coasting of a campaign at one speed each: which runs, or which parts of them, and the outcome.

A steady run stands for its speed as a whole; of a run-up or a coast-down the segments within 1.5 % of the speed do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.contributions import ModeComparison, ModeRun, compare_modes
from tdacoustic.errors import AnalysisError

__all__ = ["FREE", "LOADED", "ModeRecord", "SpeedModes", "compare_at_speeds"]

Array = NDArray[np.float64]

FREE: Final = ("coast", "hauled")
LOADED: Final = ("traction", "brake")
ONE_SPEED: Final = 0.03
"""Relative difference of speeds that are one, as in `tdacoustic.contributions.compare_modes`."""
SEGMENTS: Final = 2
"""Of a run-up about a speed, at least."""
BETWEEN: Final = 1.2
"""Ratio of speeds at which a run-up and a coast-down are held against each other."""
MOST_SPEEDS: Final = 8


@dataclass(frozen=True)
class ModeRecord:
    """A receiver in a run whose mode is stated.

    Parameters
    ----------
    run, mode : str
    steady : bool
    speed : ndarray, shape (n_segments,)
        All of one unit; NaN where not known.
    mean_square : ndarray, shape (n_segments, n_bands)
    weights : ndarray, shape (n_segments,)
    torque_n_m : float or None
    """

    run: str
    mode: str
    steady: bool
    speed: Array
    mean_square: Array
    weights: Array
    torque_n_m: float | None


@dataclass(frozen=True)
class SpeedModes:
    """What was compared at one speed.

    Parameters
    ----------
    channel : str
    speed : float
        Mean of the runs.
    unit : str
        ``km/h`` of the train, or ``1/s`` of the motor where the train's is not known.
    runs : tuple of (str, str)
        Mode and run.
    comparison : ModeComparison or None
    reason : str
        Why there is none.
    """

    channel: str
    speed: float
    unit: str
    runs: tuple[tuple[str, str], ...]
    comparison: ModeComparison | None
    reason: str = ""


def compare_at_speeds(
    channel: str, records: Sequence[ModeRecord], unit: str, bands: Sequence[str]
) -> tuple[SpeedModes, ...]:
    """Compare the modes at every speed that a coasting or hauled run shares with a loaded one.

    Parameters
    ----------
    channel : str
    records : sequence of ModeRecord
    unit : str
        Of their speeds.
    bands : sequence of str
    """
    found = []
    for speed in _speeds(records):
        runs = [run for record in records if (run := _at(record, speed)) is not None]
        modes = {run.mode for run in runs}
        if not (modes & set(FREE) and modes & set(LOADED)):
            continue
        mean = float(np.mean([run.speed for run in runs]))
        names = tuple((run.mode, run.name) for run in runs)
        try:
            found.append(SpeedModes(channel, mean, unit, names, compare_modes(runs, bands)))
        except AnalysisError as error:
            found.append(SpeedModes(channel, mean, unit, names, None, str(error)))
    return tuple(found)


def _mean_speed(record: ModeRecord) -> float | None:
    known = record.speed[np.isfinite(record.speed) & (record.weights > 0.0)]
    return float(known.mean()) if known.size and known.mean() > 0.0 else None


def _speeds(records: Sequence[ModeRecord]) -> list[float]:
    """Speeds of steady runs, those within reach of each other once, then some between where runs move through."""
    steady = sorted(speed for record in records if record.steady and (speed := _mean_speed(record)) is not None)
    found: list[float] = []
    group: list[float] = []
    for speed in [*steady, np.inf]:
        if group and speed > group[0] * (1.0 + ONE_SPEED):
            found.append(float(np.mean(group)))
            group = []
        group.append(speed)
    moving = [record for record in records if not record.steady]
    ends = []
    for modes in (FREE, LOADED):
        spans = [_ends(record) for record in moving if record.mode in modes]
        known = [span for span in spans if span is not None]
        if not known:
            return found
        ends.append((min(low for low, _ in known), max(high for _, high in known)))
    low, high = max(a for a, _ in ends) * (1.0 + ONE_SPEED), min(b for _, b in ends) / (1.0 + ONE_SPEED)
    if not high > low > 0.0:
        return found
    count = min(MOST_SPEEDS, 1 + int(np.log(high / low) / np.log(BETWEEN)))
    between = np.geomspace(low, high, count) if count > 1 else np.array([np.sqrt(low * high)])
    found += [float(s) for s in between if all(abs(s - other) > 2.0 * ONE_SPEED * other for other in found)]
    return sorted(found)


def _ends(record: ModeRecord) -> tuple[float, float] | None:
    known = record.speed[np.isfinite(record.speed) & (record.speed > 0.0)]
    return (float(known.min()), float(known.max())) if known.size else None


def _at(record: ModeRecord, speed: float) -> ModeRun | None:
    """The record at a speed; None where it was not there."""
    if record.steady:
        mean = _mean_speed(record)
        if mean is None or abs(mean - speed) > 0.5 * ONE_SPEED * speed:
            return None
        chosen = record.weights > 0.0
    else:
        near = np.abs(np.where(np.isfinite(record.speed), record.speed, np.inf) - speed) <= 0.5 * ONE_SPEED * speed
        chosen = near & (record.weights > 0.0)
        if chosen.sum() < SEGMENTS:
            return None
        mean = float(record.speed[chosen].mean())
    return ModeRun(
        record.run, record.mode, float(mean), record.mean_square[chosen], record.weights[chosen], record.torque_n_m
    )

"""The lines of one channel over all runs of a condition."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from tdacoustic.measured.runs import MeasuredRun

__all__ = ["ConditionLine", "lines_of_condition"]

SPREAD = 0.005
"""Relative distance up to which lines of two runs are one line: the speeds of two runs differ."""


@dataclass(frozen=True)
class ConditionLine:
    """A line of a channel in a condition.

    Parameters
    ----------
    condition, channel : str
    frequency_hz : float
        Mean over the runs that show it.
    frequency_error_hz : float
        One standard deviation of that mean.
    mean_square : float
        Energy mean over the runs; a run that does not show it counts as none.
    prominence_db : float
        The highest of the runs.
    shown_by : tuple of str
        Runs that show it.
    n_runs : int
        Runs averaged.
    """

    condition: str
    channel: str
    frequency_hz: float
    frequency_error_hz: float
    mean_square: float
    prominence_db: float
    shown_by: tuple[str, ...]
    n_runs: int


def lines_of_condition(condition: str, channel: str, runs: Sequence[MeasuredRun]) -> tuple[ConditionLine, ...]:
    """Gather a channel's lines over the steady runs of a condition.

    Lines of two runs within their errors, one line spacing or 0.5 % are one.
    """
    found = []
    n_runs = 0
    for run in runs:
        result = run.measurement.channel(channel) if run.measurement is not None else None
        if result is None or not result.usable or result.spectrum is None:
            continue
        n_runs += 1
        found += [(line, run.name, result.spectrum.resolution_hz) for line in result.lines]
    found.sort(key=lambda item: item[0].frequency_hz)
    groups: list[list[int]] = []
    for index, (line, name, resolution_hz) in enumerate(found):
        if groups:
            last, _, _ = found[groups[-1][-1]]
            apart = line.frequency_hz - last.frequency_hz
            near = max(resolution_hz, 3.0 * math.hypot(line.frequency_error_hz, last.frequency_error_hz))
            known = {found[member][1] for member in groups[-1]}
            if apart <= max(near, SPREAD * line.frequency_hz) and name not in known:
                groups[-1].append(index)
                continue
        groups.append([index])
    lines = []
    for members in groups:
        held = [found[index][0] for index in members]
        lines.append(
            ConditionLine(
                condition=condition,
                channel=channel,
                frequency_hz=sum(line.frequency_hz for line in held) / len(held),
                frequency_error_hz=math.sqrt(sum(line.frequency_error_hz**2 for line in held)) / len(held),
                mean_square=sum(line.rms**2 for line in held) / n_runs,
                prominence_db=max(line.prominence_db for line in held),
                shown_by=tuple(found[index][1] for index in members),
                n_runs=n_runs,
            )
        )
    return tuple(lines)

"""The noise lines of one receiver over all runs of a condition."""

from __future__ import annotations

import math
from collections.abc import Sequence

from tdacoustic.attribution.evidence import LineEvidence
from tdacoustic.attribution.judgement import ConditionLine

__all__ = ["lines_of_condition"]

Member = tuple[str, float | None, LineEvidence]
"""Run, turns of its motor per second, and a line of it."""

LEAST_DISTANCE_HZ = 1.0
"""Lines of two runs this near are one line, whatever their errors [assumed: a line spacing]."""


def lines_of_condition(
    condition: str, receiver: str, runs: Sequence[tuple[str, float | None, Sequence[LineEvidence]]]
) -> tuple[ConditionLine, ...]:
    """Gather a receiver's lines over the steady runs of a condition.

    Lines of two runs are one line where they have the same frequency, or the
    same order: the speeds of two runs differ.

    Parameters
    ----------
    condition, receiver : str
    runs : sequence of (str, float or None, sequence of LineEvidence)
        Name, motor turns per second and evidence of each steady run.
    """
    groups: list[list[Member]] = []
    for name, motor_hz, lines in runs:
        for evidence in lines:
            if evidence.receiver != receiver:
                continue
            member = (name, motor_hz, evidence)
            group = _group_of(member, groups)
            if group is None:
                groups.append([member])
            else:
                group.append(member)
    return tuple(
        sorted((_line(condition, receiver, group, len(runs)) for group in groups), key=lambda line: line.frequency_hz)
    )


def _group_of(member: Member, groups: Sequence[list[Member]]) -> list[Member] | None:
    name, motor_hz, evidence = member
    best, nearest = None, math.inf
    for group in groups:
        if any(other == name for other, _, _ in group):
            continue
        _, other_hz, other = group[-1]
        line, known = evidence.line, other.line
        allowed = max(LEAST_DISTANCE_HZ, 3.0 * math.hypot(line.frequency_error_hz, known.frequency_error_hz))
        distance = abs(line.frequency_hz - known.frequency_hz)
        if motor_hz and other_hz:
            distance = min(distance, abs(line.frequency_hz - known.frequency_hz * motor_hz / other_hz))
        if distance <= allowed and distance < nearest:
            best, nearest = group, distance
    return best


def _line(condition: str, receiver: str, group: Sequence[Member], n_runs: int) -> ConditionLine:
    held = [evidence.line for _, _, evidence in group]
    return ConditionLine(
        condition=condition,
        channel=receiver,
        frequency_hz=sum(line.frequency_hz for line in held) / len(held),
        frequency_error_hz=math.sqrt(sum(line.frequency_error_hz**2 for line in held)) / len(held),
        members=tuple((name, evidence) for name, _, evidence in group),
        n_runs=n_runs,
    )

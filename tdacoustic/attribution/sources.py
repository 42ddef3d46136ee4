"""The sources of a condition's noise lines: judged, excluded, overridden."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from tdacoustic.attribution.condition_lines import lines_of_condition
from tdacoustic.attribution.evidence import RunEvidence
from tdacoustic.attribution.excitation import Match, owner_of
from tdacoustic.attribution.judgement import ConditionLine, Draws, JudgedLine, draw, evidence_words, judge
from tdacoustic.attribution.kinematic import RunKinematics
from tdacoustic.campaign import Exclude, Override

__all__ = ["ConditionEvidence", "SourceLine", "attribute", "means_line"]

OVERRIDE_SPREAD = 0.005
"""Relative distance at which an override still means a line."""
OVERRIDE_HZ = 2.0

NO_FLEET = "No fleet file: whose order a line is, is not known, so it stays unassigned."


@dataclass(frozen=True)
class ConditionEvidence:
    """What is known of a condition before its lines are judged.

    Parameters
    ----------
    condition : str
    receivers : tuple of str
    evidence : mapping of str to RunEvidence
        By run, the steady ones.
    kinematics : mapping of str to RunKinematics
        By run, where the speed is known; empty without a fleet.
    components : tuple of str
        Those with sensors.
    with_fleet : bool
    """

    condition: str
    receivers: tuple[str, ...]
    evidence: Mapping[str, RunEvidence]
    kinematics: Mapping[str, RunKinematics]
    components: tuple[str, ...]
    with_fleet: bool


@dataclass(frozen=True)
class SourceLine:
    """A noise line with its source and the evidence for it.

    Parameters
    ----------
    line : ConditionLine
    radiator : str or None
        ``motor``, ``gearbox``, ``both``, ``neither`` or another component; None where it was not asked.
    excitation : str
    excitation_name : str or None
        The excitation in words, ``mesh x2``.
    source : str
    conflict : bool
    confidence : float or None
        How often the source is the same on resampled segments; 1 for an override.
    evidence : str
        One sentence.
    """

    line: ConditionLine
    radiator: str | None
    excitation: str
    excitation_name: str | None
    source: str
    conflict: bool
    confidence: float | None
    evidence: str


def attribute(
    held: ConditionEvidence, excludes: Sequence[Exclude], overrides: Sequence[Override], seed: int
) -> tuple[tuple[SourceLine, ...], Draws | None]:
    """Judge the noise lines of a condition.

    Parameters
    ----------
    held : ConditionEvidence
    excludes, overrides : sequences
        Of the campaign.
    seed : int
        Of the resampling.

    Returns
    -------
    sources : tuple of SourceLine
        One a line that is not excluded.
    draws : Draws or None
        The resampled judgements in the same order; None without a fleet or lines.
    """
    lines = [line for line in _lines(held) if not _excluded(line, excludes)]
    if not held.with_fleet:
        return tuple(_unjudged(line, _override_of(line, overrides)) for line in lines), None
    judged = [judge(line, *_match(line, held.kinematics)) for line in lines]
    if not judged:
        return (), None
    draws = draw(judged, held.components, seed)
    sources = []
    for index, item in enumerate(judged):
        override = _override_of(item.line, overrides)
        if override is None:
            sources.append(_source(item, draws, index))
        else:
            words = f"Override by the engineer: {override.reason}. Without it: {item.source}. {evidence_words(item)}"
            sources.append(replace(_source(item, draws, index), source=override.source, confidence=1.0, evidence=words))
            draws = draws.overridden(index, override.source)
    return tuple(sources), draws


def _lines(held: ConditionEvidence) -> list[ConditionLine]:
    runs = []
    for name, evidence in held.evidence.items():
        kinematics = held.kinematics.get(name)
        runs.append((name, None if kinematics is None else kinematics.motor_hz, evidence.lines))
    return [line for receiver in held.receivers for line in lines_of_condition(held.condition, receiver, runs)]


def _match(line: ConditionLine, kinematics: Mapping[str, RunKinematics]) -> tuple[Match | None, Match | None]:
    """Match a line in each run that shows it; the run with the smallest error decides."""
    found = []
    for run, evidence in line.members:
        if run in kinematics:
            pair = owner_of(evidence.line.frequency_hz, evidence.line.frequency_error_hz, kinematics[run].expected)
            found.append((evidence.line.frequency_error_hz, pair))
    return min(found, key=lambda item: item[0])[1] if found else (None, None)


def _source(item: JudgedLine, draws: Draws, index: int) -> SourceLine:
    return SourceLine(
        line=item.line,
        radiator=item.radiator or None,
        excitation=item.excitation,
        excitation_name=None if item.match is None else item.match.expected.name,
        source=item.source,
        conflict=item.conflict,
        confidence=draws.agreement(index, item.source),
        evidence=evidence_words(item),
    )


def _unjudged(line: ConditionLine, override: Override | None) -> SourceLine:
    if override is None:
        return SourceLine(line, None, "unknown", None, "unassigned", False, None, NO_FLEET)
    words = f"Override by the engineer: {override.reason}"
    return SourceLine(line, None, "unknown", None, override.source, False, 1.0, words)


def _excluded(line: ConditionLine, excludes: Sequence[Exclude]) -> bool:
    return any(
        exclude.condition == line.condition
        and exclude.channel in (None, line.channel)
        and exclude.frequency_hz[0] <= line.frequency_hz <= exclude.frequency_hz[1]
        for exclude in excludes
    )


def means_line(override: Override, line: ConditionLine) -> bool:
    """Whether an override means a line: its condition, and its frequency within 2 Hz or 0.5 %."""
    near_hz = max(OVERRIDE_HZ, OVERRIDE_SPREAD * line.frequency_hz)
    return override.condition == line.condition and abs(override.frequency_hz - line.frequency_hz) <= near_hz


def _override_of(line: ConditionLine, overrides: Sequence[Override]) -> Override | None:
    near = [override for override in overrides if means_line(override, line)]
    return min(near, key=lambda override: abs(override.frequency_hz - line.frequency_hz), default=None)

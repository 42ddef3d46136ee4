"""The source of each noise line.

Without a fleet file neither orders nor gear teeth are known, and no line is
ascribed to a source; the engineer's overrides still are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tdacoustic.attribution.condition_lines import ConditionLine
from tdacoustic.campaign import Exclude, Override

__all__ = ["SourceLine", "attribute"]

OVERRIDE_SPREAD = 0.005
"""Relative distance at which an override still means a line."""
OVERRIDE_HZ = 2.0


@dataclass(frozen=True)
class SourceLine:
    """A noise line with its source and the evidence for it.

    Parameters
    ----------
    line : ConditionLine
    radiator : str or None
        Which component's sensors show it; None where that was not asked.
    excitation : str
    source : str
    conflict : bool
    confidence : float or None
    evidence : str
        One sentence.
    """

    line: ConditionLine
    radiator: str | None
    excitation: str
    source: str
    conflict: bool
    confidence: float | None
    evidence: str


def _excluded(line: ConditionLine, excludes: Sequence[Exclude]) -> bool:
    return any(
        exclude.condition == line.condition
        and exclude.channel in (None, line.channel)
        and exclude.frequency_hz[0] <= line.frequency_hz <= exclude.frequency_hz[1]
        for exclude in excludes
    )


def _override_of(line: ConditionLine, overrides: Sequence[Override]) -> Override | None:
    near = [
        override
        for override in overrides
        if override.condition == line.condition
        and abs(override.frequency_hz - line.frequency_hz) <= max(OVERRIDE_HZ, OVERRIDE_SPREAD * line.frequency_hz)
    ]
    return min(near, key=lambda override: abs(override.frequency_hz - line.frequency_hz), default=None)


def attribute(
    lines: Sequence[ConditionLine], excludes: Sequence[Exclude], overrides: Sequence[Override], why_not: str
) -> tuple[SourceLine, ...]:
    """Return each line that is not excluded with its source.

    Parameters
    ----------
    lines : sequence of ConditionLine
    excludes, overrides : sequences
        Of the campaign.
    why_not : str
        Why a line is unassigned, as a sentence: its evidence.
    """
    found = []
    for line in lines:
        if _excluded(line, excludes):
            continue
        override = _override_of(line, overrides)
        if override is None:
            found.append(SourceLine(line, None, "unknown", "unassigned", False, None, why_not))
        else:
            words = f"Override by the engineer: {override.reason}"
            found.append(SourceLine(line, None, "unknown", override.source, False, None, words))
    return tuple(found)

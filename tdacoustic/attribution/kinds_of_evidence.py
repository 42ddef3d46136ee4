"""Three kinds of evidence on the dominant source of a condition, and how far they agree.

*Sensor*: the noise lines judged by whose accelerometers show them, their orders not known. *Order*: the same lines
judged by whose orders they are, the sensors not seen. Each is resampled as the verdict itself is, and gives the
probability of each source to be the largest. *Contribution*: the largest part of the tones' sound (of the whole, where
there are none) by operational transfer paths; it speaks where the largest part is known, and is silent where that is
flagged, refused, or no sensor explains it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from tdacoustic.attribution.contribution_spans import TONES, WHOLE
from tdacoustic.attribution.contribution_step import paths_changed
from tdacoustic.attribution.contributions import CampaignContributions, ContributionState
from tdacoustic.attribution.dominance import DECIDED, largest_sources
from tdacoustic.attribution.evidence import RunEvidence
from tdacoustic.attribution.sources import ConditionEvidence, attribute
from tdacoustic.campaign import Exclude
from tdacoustic.contributions import RESIDUAL, Agreement, SpanContributions, agreement_of_evidence

__all__ = ["ConditionAgreement", "agreement_of_condition"]

UNEXPLAINED: Final = "unexplained"
"""Word for what no sensor explains, where it is the largest part."""


@dataclass(frozen=True)
class ConditionAgreement:
    """The kinds of evidence on one condition.

    Parameters
    ----------
    condition : str
    sensor, order, contribution : mapping of str to float, or None
        Probability of each source to be the largest; None where the kind is silent.
    agreement : Agreement
    contribution_words : str
        Why the contributions are silent, or how loud the largest part is; empty without any.
    """

    condition: str
    sensor: Mapping[str, float] | None
    order: Mapping[str, float] | None
    contribution: Mapping[str, float] | None
    agreement: Agreement
    contribution_words: str

    @staticmethod
    def _leading(given: Mapping[str, float] | None) -> tuple[str | None, float | None]:
        if not given:
            return None, None
        return max(given.items(), key=lambda item: item[1])

    def leading(self, kind: str) -> tuple[str | None, float | None]:
        """Return the likeliest source by a kind and its probability; None where it is silent."""
        given = {"sensor": self.sensor, "order": self.order, "contribution": self.contribution}[kind]
        return self._leading(given)

    @property
    def contribution_dominant(self) -> str | None:
        """The largest part: a component, ``unexplained``, or ``undecided``; None where the contributions are silent."""
        name, probability = self.leading("contribution")
        if name is None or probability is None:
            return None
        return "undecided" if probability < DECIDED else UNEXPLAINED if name == RESIDUAL else name


def agreement_of_condition(
    held: ConditionEvidence,
    excludes: Sequence[Exclude],
    seed: int,
    contributions: CampaignContributions | None,
) -> ConditionAgreement:
    """Judge a condition by each kind alone, and join them.

    Parameters
    ----------
    held : ConditionEvidence
    excludes : sequence of Exclude
    seed : int
        Of the resampling.
    contributions : CampaignContributions or None
    """
    blind = {
        run: RunEvidence(tuple(replace(line, sensors=()) for line in evidence.lines))
        for run, evidence in held.evidence.items()
    }
    sensor = _alone(replace(held, kinematics={}, with_fleet=True), excludes, seed) if held.components else None
    order = _alone(replace(held, evidence=blind, components=()), excludes, seed) if held.kinematics else None
    contribution, words = _contribution(held.condition, contributions)
    agreement = agreement_of_evidence({"sensor": sensor, "order": order, "contribution": contribution})
    return ConditionAgreement(held.condition, sensor, order, contribution, agreement, words)


def _alone(held: ConditionEvidence, excludes: Sequence[Exclude], seed: int) -> dict[str, float] | None:
    """Probability of each source to be the largest."""
    sources, draws = attribute(held, excludes, (), seed)
    if draws is None:
        return None
    return {name: share for name, share in largest_sources(sources, draws).items() if share > 0.0}


def _contribution(condition: str, found: CampaignContributions | None) -> tuple[dict[str, float] | None, str]:
    """What the contributions of a condition's states and receivers say together, and in words."""
    if found is None:
        return None, ""
    of_span: dict[str, list[tuple[ContributionState, SpanContributions]]] = {TONES: [], WHOLE: []}
    for state, span, parts in found.rows():
        if state.condition == condition and span.kind in ("tones", "total"):
            of_span[TONES if span.kind == "tones" else WHOLE].append((state, parts))
    rows = of_span[TONES] or of_span[WHOLE]
    if not rows:
        return None, "no operating state of it is among the contributions"
    what = "tones" if of_span[TONES] else "sound"
    names = [*found.components, RESIDUAL]
    together = {name: float(np.mean([parts.largest.get(name, 0.0) for _, parts in rows])) for name in names}
    leading = max(together, key=lambda name: together[name])
    if leading == RESIDUAL:
        changed = [parts for _, parts in rows if paths_changed(parts)]
        if 2 * len(changed) >= len(rows):  # what the paths of all states leave says nothing here
            return None, f"flagged, {next(iter(changed[0].groups.values())).reason}"
        return together, f"most of the {what} is explained by no sensor"
    doubts = [(state, part) for state, parts in rows if (part := parts.groups[leading]).verdict != "ok"]
    if not doubts:
        return together, ""
    state, part = doubts[0]
    coherent = found.coherent(state.name)
    beside = "" if coherent is None else f" (references coherent, {coherent.coherence:.2f})"
    return None, f"{part.verdict}, {part.reason}{beside}"

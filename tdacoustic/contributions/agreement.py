"""How far three kinds of evidence on the dominant source agree.

*Sensor*: whose accelerometers show the noise's lines. *Order*: whose orders the lines are. *Contribution*: whose
references explain the noise. Each gives a distribution over sources. Kinds are joined as independent witnesses (Bayes,
no source preferred beforehand): ``p(s) ~ prod_k (r p_k(s) + (1 - r) / m)`` over m sources, where r is how often a kind
of evidence is sound at all, so that no single one can settle the matter or veto it for good.

Sensor and contribution look at the same accelerometers: a mislabelled one misleads both. They are independent in
method, not in cables, and the joint probability does not know that.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from tdacoustic.errors import AnalysisError

__all__ = ["Agreement", "agreement_of_evidence"]

Word = Literal["agree", "disagree", "single", "silent"]

RELIABILITY: Final = 0.9
"""How often a kind of evidence is sound [assumed]."""
SURE: Final = 0.7
"""Probability from which on a kind of evidence is taken to name its source [assumed]."""
NOBODY: Final = ("unassigned", "ambiguous", "undecided", "residual")
"""Words that name no source; where they hold more than half, the kind is silent."""


@dataclass(frozen=True)
class Agreement:
    """The kinds of evidence together.

    Parameters
    ----------
    word : str
        ``agree``: no two that are sure lead to different sources (unsure ones may); ``disagree``: two do;
        ``single``: one alone speaks; ``silent``: none.
    source : str or None
        Most probable by all that speak; None where they disagree or are silent.
    probability : float or None
        Joint probability of it.
    joint : mapping of str to float
        Joint distribution; empty where they disagree or are silent.
    leads : mapping of str to (str, float)
        Each speaking kind's source and probability.
    silent : tuple of str
        Kinds that name no source.
    words : str
        One sentence.
    """

    word: Word
    source: str | None
    probability: float | None
    joint: Mapping[str, float]
    leads: Mapping[str, tuple[str, float]]
    silent: tuple[str, ...]
    words: str


def agreement_of_evidence(
    evidence: Mapping[str, Mapping[str, float] | None], reliability: float = RELIABILITY
) -> Agreement:
    """Join kinds of evidence.

    Parameters
    ----------
    evidence : mapping of str to (mapping of str to float) or None
        Kind -> source -> probability, such as ``{"sensor": {...}, "order": {...}, "contribution": None}``. None, or no
        entry above 0, is silent. Distributions are scaled to one.
    reliability : float
        0 to 1.

    Raises
    ------
    AnalysisError
        Probabilities below 0 or no numbers, or a reliability out of range.

    Examples
    --------
    >>> found = agreement_of_evidence(
    ...     {"sensor": {"motor": 0.9, "gearbox": 0.1}, "order": {"motor": 0.8, "gearbox": 0.2}, "contribution": None}
    ... )
    >>> found.word, found.source, round(found.probability, 2)
    ('agree', 'motor', 0.95)
    """
    if not 0.0 <= reliability <= 1.0:
        raise AnalysisError(f"reliability must be in [0, 1], got {reliability}")
    speaking: dict[str, dict[str, float]] = {}
    for kind, given in evidence.items():
        if given is not None and any(not (np.isfinite(value) and value >= 0.0) for value in given.values()):
            raise AnalysisError(f"evidence {kind!r} must hold probabilities >= 0, got {dict(given)}")
        named = _named(given)
        if named:
            speaking[kind] = named
    silent = tuple(kind for kind in evidence if kind not in speaking)
    aside = f" ({' and '.join(silent)} silent)" if silent else ""
    if not speaking:
        return Agreement("silent", None, None, {}, {}, silent, "no kind of evidence names a source")
    leads = {kind: max(named.items(), key=lambda item: item[1]) for kind, named in speaking.items()}
    told = "; ".join(f"{kind}: {source} {_percent(value)}" for kind, (source, value) in leads.items())
    sure = {source for source, value in leads.values() if value >= SURE}
    if len(sure) > 1:
        return Agreement("disagree", None, None, {}, leads, silent, f"they disagree: {told}{aside}")
    joint = _joint(speaking, reliability)
    source, probability = max(joint.items(), key=lambda item: item[1])
    word: Word = "single" if len(speaking) == 1 else "agree"
    if word == "agree" and any(lead != source for lead, _ in leads.values()):
        opening = f"mostly {source}, {_percent(probability)} together, one is not sure"
    elif word == "agree":
        opening = f"they agree on {source}, {_percent(probability)} together"
    else:
        opening = f"one kind alone names {source}"
    return Agreement(word, source, probability, joint, leads, silent, f"{opening}: {told}{aside}")


def _percent(probability: float) -> str:
    """A probability in words; none from resampling is certain."""
    return "> 99 %" if probability > 0.994 else f"{100.0 * probability:.0f} %"


def _named(given: Mapping[str, float] | None) -> dict[str, float]:
    """Distribution over real sources, what names nobody spread over them; empty where that is more than half."""
    total = 0.0 if given is None else sum(given.values())
    if given is None or total <= 0.0:
        return {}
    named = {source: value / total for source, value in given.items() if source not in NOBODY}
    left = 1.0 - sum(named.values())
    if not named or left > 0.5:
        return {}
    return {source: value + left / len(named) for source, value in named.items()}


def _joint(speaking: Mapping[str, Mapping[str, float]], reliability: float) -> dict[str, float]:
    sources = list(dict.fromkeys(source for named in speaking.values() for source in named))
    blind = (1.0 - reliability) / len(sources)
    logs = np.array(
        [
            sum(np.log(max(reliability * named.get(source, 0.0) + blind, 1e-300)) for named in speaking.values())
            for source in sources
        ]
    )
    weights = np.exp(logs - logs.max())
    return {source: float(weight / weights.sum()) for source, weight in zip(sources, weights, strict=True)}

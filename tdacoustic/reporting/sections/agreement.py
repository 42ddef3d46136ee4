"""Whether the kinds of evidence on a condition agree: sensors, orders and contributions."""

from __future__ import annotations

from typing import Final

from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.gear_words import sentence
from tdacoustic.reporting.sections.words import joined, source_word
from tdacoustic.results import Analysis

__all__ = ["agreement_words"]

KIND_WORDS: Final = {"sensor": mark("sensors"), "order": mark("orders"), "contribution": mark("contributions")}
"""Kinds of evidence."""
OPENINGS: Final = {"agree": mark("The kinds of evidence agree"), "disagree": mark("The kinds of evidence disagree")}
ONE_ALONE: Final = mark("One kind of evidence alone")
NOT_SURE: Final = mark("The kinds of evidence name different sources, and at most one of them is sure")
"""Where the word is ``agree``, because no two that are sure contradict each other, but the sources differ."""


def agreement_words(analysis: Analysis, condition: str) -> str:
    """Return whether the kinds of evidence on a condition agree, as one sentence; empty where there is nothing to say.

    Parameters
    ----------
    analysis : Analysis
    condition : str
    """
    found = analysis.agreements.get(condition)
    if found is None:
        return ""
    doubt = ""
    if "contribution" in found.agreement.silent and found.contribution_words:
        doubt = say("contributions: {reason}", reason=found.contribution_words)
    if found.agreement.word == "silent":
        return sentence(doubt) if doubt else ""
    by_source: dict[str, list[str]] = {}
    for kind, (source, _) in found.agreement.leads.items():
        by_source.setdefault(source, []).append(say(KIND_WORDS[kind]))
    said = [
        say("{kinds} say {source}", kinds=joined(kinds), source=source_word(source))
        for source, kinds in by_source.items()
    ]
    silent = [say(KIND_WORDS[kind]) for kind in found.agreement.silent if kind != "contribution"]
    said += [say("{kinds} name no source", kinds=joined(silent))] if silent else []
    said += [doubt] if doubt else []
    differ = found.agreement.word == "agree" and len(by_source) > 1
    opening = NOT_SURE if differ else OPENINGS.get(found.agreement.word, ONE_ALONE)
    return f"{say(opening)}: {'; '.join(said)}."

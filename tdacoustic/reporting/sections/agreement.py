"""Whether the kinds of evidence on a condition agree: sensors, orders and contributions."""

from __future__ import annotations

import re
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
_CROSS_TALK: Final = re.compile(
    r"flagged, (?P<states>.+ (?:does|do)) not tell cross-talk with (?P<rival>.+?): "
    r"(?:(?P<low>[0-9.]+) dB lower|no lower bound), (?P<high>[0-9.]+) dB higher at most"
    r"(?: \(references coherent, (?P<coherence>[0-9.]+)\))?"
)
_COHERENT: Final = re.compile(
    r"refused, its references are coherent with those of (?P<rival>.+?): (?P<own>[0-9.]+) % (?:of it )?is its own"
    r"(?: \(references coherent, (?P<coherence>[0-9.]+)\))?"
)
_PLAIN: Final = {
    "flagged, what no reference explains": mark(
        "what no sensor explains is as loud as the loudest part or louder, so a source without a sensor may be in it"
    ),
    "flagged, paths differ from state to state": mark("the paths to the microphone differ from state to state"),
    "below, ": mark("no component's part stands above its own scatter"),
}
"""By the beginning of what the analysis says."""


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
        doubt = say("contributions name no source: {reason}", reason=_contribution_doubt(found.contribution_words))
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


def _contribution_doubt(words: str) -> str:
    """Why the contributions name no source, as a clause; what the analysis says in other words stays as it is."""
    if found := _CROSS_TALK.fullmatch(words):
        return _cross_talk_words(found)
    if found := _COHERENT.fullmatch(words):
        return say(
            "the sensors of the loudest part show what those of the {rival} show too; only {own} % of it is its own",
            rival=source_word(found["rival"]),
            own=found["own"],
        )
    plain = next((text for start, text in _PLAIN.items() if words.startswith(start)), None)
    return words if plain is None else say(plain)


def _cross_talk_words(found: re.Match[str]) -> str:
    """How far cross-talk may have moved the loudest part."""
    values = {"rival": source_word(found["rival"]), "low": found["low"], "high": found["high"]}
    if found["states"].startswith("one "):
        why = say(
            "from a single operating state the loudest part cannot be told from cross-talk with the {rival}", **values
        )
    else:
        why = say(
            "the operating states are too alike to tell the loudest part from cross-talk with the {rival}", **values
        )
    if found["low"] is None:
        open_ = say("it may be up to {high} dB higher, and has no lower bound", **values)
    else:
        open_ = say("it may be up to {low} dB lower or {high} dB higher", **values)
    said = say("{why}, so {open}", why=why, open=open_)
    if found["coherence"] is None:
        return said
    return say("{said} (the sensors of the two are coherent by {coherence})", said=said, coherence=found["coherence"])

"""The answer first: what was found at each speed, and what could not be done."""

from __future__ import annotations

import math

from tdacoustic.measured.levels import energy_mean_db
from tdacoustic.measured.runs import receivers
from tdacoustic.reporting.document import Block, Notice, Sentences
from tdacoustic.reporting.sections.words import condition_words
from tdacoustic.results import Analysis
from tdacoustic.units import level_db

__all__ = ["answer"]


def answer(analysis: Analysis) -> list[Block]:
    """Return the summary: one sentence a condition, then what could not be done."""
    sentences = [_of_condition(analysis, condition) for condition in analysis.campaign.conditions()]
    blocks: list[Block] = [Sentences(sentences)] if sentences else []
    blocks += [Notice("warning", f"Not done: {problem}") for problem in analysis.problems]
    return blocks


def _of_condition(analysis: Analysis, condition: str) -> str:
    words = condition_words(analysis, condition)
    level = _level_words(analysis, condition)
    if not level:
        return f"{words}: no noise level."
    runs = [run for run in analysis.runs if run.run.condition == condition and run.measurement is not None]
    if runs and all(run.measurement is not None and not run.measurement.steady for run in runs):
        return f"{words}: {level}; a run-up, so no lines and no dominant source."
    verdict = next((v for v in analysis.dominance if v.condition == condition), None)
    strongest = sorted(
        (source.line for source in analysis.sources if source.line.condition == condition),
        key=lambda line: -line.mean_square,
    )
    named: list[str] = []
    for line in strongest:
        text = f"{line.frequency_hz:.0f} Hz ({level_db(math.sqrt(line.mean_square), 'sound_pressure'):.1f} dB)"
        if text.split(" (")[0] not in {name.split(" (")[0] for name in named}:
            named.append(text)
    parts = [f"{words}: {level}"]
    if named:
        parts.append(f"strongest noise lines {', '.join(named[:3])}")
    elif runs:
        parts.append("no noise lines")
    if verdict is not None and verdict.line_fraction is not None and named:
        parts.append(f"the lines carry {100 * verdict.line_fraction:.0f} % of the sound energy")
    if verdict is not None:
        parts.append(f"dominant source {verdict.dominant}")
    return "; ".join(parts) + "."


def _level_words(analysis: Analysis, condition: str) -> str:
    microphones = receivers(analysis.runs)
    table = analysis.tables["levels"]
    held = table[(table["condition"] == condition) & (table["quantity"] == "sound_pressure")]
    measured = held[held["channel"].isin(microphones)] if microphones else held
    chosen = measured if len(measured) else held
    level = energy_mean_db(chosen["level_db"].dropna())
    weighted = energy_mean_db(chosen["laeq_db"].dropna())
    words = [f"{level:.1f} dB"] if level is not None else []
    if weighted is not None:
        words.append(f"{weighted:.1f} dB(A)")
    if not words:
        return ""
    where = (
        f"energy mean of {len(microphones)} microphones"
        if len(microphones) > 1
        else "at " + str(chosen["channel"].iloc[0])
    )
    return f"{' or '.join(words)} re 20 µPa, {where}"

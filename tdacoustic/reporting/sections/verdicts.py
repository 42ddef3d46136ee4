"""The verdicts side by side: whose the energy of the noise lines is, in a table and as bars."""

from __future__ import annotations

import numpy as np

from tdacoustic.attribution import Dominance
from tdacoustic.attribution.dominance import DECIDED
from tdacoustic.reporting.document import Block, Cell, Column, FigureBlock, Paragraph, Shown, Table
from tdacoustic.reporting.figure import Axis, Bars, Figure
from tdacoustic.reporting.language import say
from tdacoustic.reporting.sections.words import OWNER_HATCHES, OWNER_SLOTS, probability_words, source_word
from tdacoustic.results import Analysis

__all__ = ["verdicts_answer"]


def verdicts_answer(analysis: Analysis) -> list[Block]:
    """Return the verdicts in a table and as bars; nothing without a fleet, or where no condition has lines."""
    if analysis.fleet is None:
        return []
    judged = [verdict for verdict in analysis.dominance if verdict.shares]
    if not judged:
        return []
    blocks: list[Block] = [_table(analysis)]
    method = say(
        "Shares are of the unweighted sound energy in the lines, averaged over the receivers, "
        "and not of the whole sound: the column beside them says how much of it the lines are. P "
        "is the probability that the leading source is the largest when segments are resampled "
        "and cross-talk is in doubt; below {decided:g} the verdict is undecided.",
        decided=DECIDED,
    )
    single = all(verdict.n_runs <= 1 for verdict in judged)
    repeats = [say("Every condition rests on a single run, so how well it repeats is not known.")] if single else []
    blocks.append(Paragraph(" ".join([method, *repeats])))
    categories = [f"{verdict.condition}: {source_word(verdict.dominant)}" for verdict in judged]
    shares = {name: np.array([100.0 * verdict.shares.get(name, 0.0) for verdict in judged]) for name in OWNER_SLOTS}
    bars = [
        Bars(categories, shares[name], source_word(name), color=slot, hatch=OWNER_HATCHES.get(name))
        for name, slot in OWNER_SLOTS.items()
        if np.any(shares[name] > 0.0)
    ]
    figure = Figure(
        "source-shares",
        say("Whose the energy of the noise lines is"),
        say("Below each bar the condition and its verdict. The bars fill up to 100 % of the lines, not of the sound."),
        Axis(say("Condition and verdict")),
        Axis(say("Share of the lines' energy"), "%", limits=(0.0, 100.0)),
        bars,
        height=320,
        bar_mode="stack",
    )
    return [*blocks, FigureBlock(figure, analysis.campaign.origin)]


def _table(analysis: Analysis) -> Table:
    speeds = analysis.tables["dominance"].set_index("condition")["train_speed_km_h"]
    repeated = any(verdict.n_runs > 1 for verdict in analysis.dominance)
    digits = 0 if all(float(speed).is_integer() for speed in speeds.dropna()) else 1
    columns = [
        Column("condition", say("Condition")),
        Column("train_speed_km_h", say("Speed"), "km/h", digits, "number"),
        Column("dominant", say("Verdict"), kind="verdict"),
        Column("confidence", "P", kind="number"),
        Column("motor_percent", say("Motor"), "%", 0, "number"),
        Column("gearbox_percent", say("Gearbox"), "%", 0, "number"),
        Column("ambiguous_percent", say("Either"), source_word("ambiguous"), 0, "number"),
        Column("unassigned_percent", say("Neither"), source_word("unassigned"), 0, "number"),
        Column("line_percent", say("Lines"), say("% of sound"), 0, "number"),
        Column("dominant_excitation", say("Excitation")),
        *([Column("n_runs", say("Runs"), "", 0, "number")] if repeated else []),
        *([Column("spread_db", say("Spread"), "dB", 1, "number")] if repeated else []),
    ]
    rows = []
    for verdict in analysis.dominance:
        cells: dict[str, Cell] = {
            f"{name}_percent": None if not verdict.shares else 100.0 * verdict.shares.get(name, 0.0)
            for name in OWNER_SLOTS
        }
        cells |= {
            "condition": verdict.condition,
            "train_speed_km_h": speeds.get(verdict.condition),
            "dominant": verdict.dominant,
            "confidence": _probability_cell(verdict),
            "line_percent": None if verdict.line_fraction is None else 100.0 * verdict.line_fraction,
            "dominant_excitation": verdict.dominant_excitation or "",
            "n_runs": verdict.n_runs,
            "spread_db": verdict.spread_db,
        }
        rows.append([cells[column.key] for column in columns])
    return Table(
        "dominance",
        say("Dominance by speed: shares of the lines' energy in %, and of the lines in all sound"),
        columns,
        rows,
        origin=analysis.campaign.origin,
    )


def _probability_cell(verdict: Dominance) -> Shown | None:
    """The probability, and of what it is where that is not the verdict."""
    if verdict.confidence is None:
        return None
    words = probability_words(verdict.confidence)
    if verdict.dominant == "undecided" and verdict.leading is not None:
        words = f"{words} {source_word(verdict.leading)}"
    return Shown(words, verdict.confidence)

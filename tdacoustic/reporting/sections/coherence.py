"""How coherent the sensors of two components are, and what all explain together, at the loudest lines."""

from __future__ import annotations

from typing import Final

from tdacoustic.attribution import CampaignContributions, ContributionState
from tdacoustic.attribution.line_coherence import LineCoherence
from tdacoustic.reporting.document import Block, Column, Paragraph, Section, Table
from tdacoustic.reporting.language import say
from tdacoustic.reporting.sections.folding import in_sight
from tdacoustic.results import Analysis

__all__ = ["coherence", "state_speed", "state_words"]

LINES: Final = 5
"""Lines of a run whose coherence the report shows; the table has all."""


def state_speed(state: ContributionState) -> tuple[str, str] | None:
    """Speed of an operating state with its unit, of the train or the motor; None where it is not known."""
    if state.train_speed_km_h is not None:
        return f"{state.train_speed_km_h:.3g}", "km/h"
    return None if state.motor_hz is None else (f"{60.0 * state.motor_hz:.4g}", "rpm")


def state_words(state: ContributionState) -> str:
    """Speed of an operating state in words; empty where it is not known."""
    if state.train_speed_km_h is not None:
        return f"{state.train_speed_km_h:.3g} km/h"
    return "" if state.motor_hz is None else say("motor {speed:.4g} rpm", speed=60.0 * state.motor_hz)


def coherence(analysis: Analysis, found: CampaignContributions, receiver: str) -> Section:
    """Return the section on coherence at one microphone.

    Parameters
    ----------
    analysis : Analysis
    found : CampaignContributions
    receiver : str
    """
    rows = []
    for state in found.states:
        held = [item for s, item in found.coherences() if s.name == state.name]
        lines = list(dict.fromkeys(item.frequency_hz for item in held))[:LINES]
        for hz in lines:
            at = [item for item in held if item.frequency_hz == hz]
            between = max((i for i in at if i.kind == "references"), key=lambda i: i.corrected, default=None)
            together = next((i for i in at if i.kind == "multiple" and i.other == receiver), None)
            own = max(
                (i for i in at if i.kind == "ordinary" and i.other == receiver), key=lambda i: i.corrected, default=None
            )
            rows.append(
                (
                    state.run,
                    state_words(state),
                    hz,
                    "" if together is None else _coherence_words(together),
                    "" if own is None else f"{own.reference} {own.corrected:.2f}",
                    "" if between is None else f"{between.reference}, {between.other}",
                    "" if between is None else _coherence_words(between),
                )
            )
    columns = (
        Column("run", say("Run")),
        Column("speed", say("Speed"), align="right"),
        Column("frequency_hz", say("Line"), "Hz", 0, "number"),
        Column("multiple", say("All sensors"), say("with the microphone")),
        Column("best", say("Best sensor")),
        Column("pair", say("Sensors of two components"), say("the most coherent")),
        Column("between", say("Coherence"), say("of these")),
    )
    words = say(
        "Squared coherences, corrected for their bias. What all sensors together leave to one is noise of the "
        "microphone or a source without a sensor. Where sensors of two components are coherent, one of them hears the "
        "other, and contributions rest on how far the runs tell them apart."
    )
    blocks: list[Block] = [Paragraph(f"{_coherent_words(found)} {words}")]
    if rows:
        title = say("Squared coherence at the loudest lines, {receiver} (95 %)", receiver=receiver)
        table = Table("coherence-lines", title, columns, rows, origin=analysis.campaign.origin)
        blocks.append(in_sight(table, say("Coherence at the loudest lines")))
    return Section("coherence", say("Coherence of sensors and microphones"), blocks)


def _coherence_words(item: LineCoherence) -> str:
    return say("{corrected:.2f} ({low:.2f} to {high:.2f})", corrected=item.corrected, low=item.low, high=item.high)


def _coherent_words(found: CampaignContributions) -> str:
    worst = max(found.result.coherent, key=lambda item: item.coherence, default=None)
    if worst is None:
        return say("One component alone has sensors, so nothing is coherent with another's.")
    state = next(state for state in found.states if state.name == worst.state)
    return say(
        "The most coherent sensors of two components are {first} and {second} in run {run}, "
        "{coherence:.2f} over its loudest lines.",
        first=worst.first,
        second=worst.second,
        run=state.run,
        coherence=worst.coherence,
    )

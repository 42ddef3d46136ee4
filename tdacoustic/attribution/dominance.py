"""Which source dominates a condition."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from tdacoustic.attribution.sources import SourceLine

__all__ = ["Dominance", "dominance_of_condition"]

_NAMED = ("motor", "gearbox", "ambiguous", "unassigned")


@dataclass(frozen=True)
class Dominance:
    """The verdict on one condition.

    Parameters
    ----------
    condition : str
    dominant : str
        A source, or ``undecided``.
    shares : mapping of str to float
        Of unweighted sound energy in the lines, averaged over receivers, summing
        to 1; empty for a condition without lines.
    line_fraction : float or None
        The lines' part of the level, averaged over receivers.
    dominant_excitation : str or None
    confidence : float or None
    """

    condition: str
    dominant: str
    shares: Mapping[str, float]
    line_fraction: float | None
    dominant_excitation: str | None
    confidence: float | None


def dominance_of_condition(
    condition: str, sources: Sequence[SourceLine], level_mean_square: Mapping[str, float]
) -> Dominance:
    """Weigh the sources of a condition's noise lines.

    Parameters
    ----------
    condition : str
    sources : sequence of SourceLine
        Of this condition, all receivers.
    level_mean_square : mapping of str to float
        Mean square of each receiver in the level band, Pa².
    """
    per_receiver: dict[str, dict[str, float]] = {}
    for source in sources:
        energies = per_receiver.setdefault(source.line.channel, {})
        name = source.source if source.source in _NAMED else "unassigned"
        energies[name] = energies.get(name, 0.0) + source.line.mean_square
    shares: dict[str, float] = {}
    for energies in per_receiver.values():
        total = sum(energies.values())
        for name in _NAMED:
            shares[name] = shares.get(name, 0.0) + energies.get(name, 0.0) / total / len(per_receiver)
    fractions = [
        min(1.0, sum(per_receiver.get(channel, {}).values()) / power)
        for channel, power in level_mean_square.items()
        if power > 0.0
    ]
    line_fraction = sum(fractions) / len(fractions) if fractions else None
    return Dominance(condition, "undecided", shares, line_fraction, None, None)

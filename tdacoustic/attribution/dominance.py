"""Which source dominates a condition, and how sure the data make it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tdacoustic.attribution.judgement import Draws
from tdacoustic.attribution.sources import SourceLine

__all__ = ["DECIDED", "Dominance", "dominance_of_condition", "largest_sources"]

DECIDED = 0.9
"""Confidence below which the word is ``undecided``."""

_SHARES = ("motor", "gearbox", "ambiguous", "unassigned")


@dataclass(frozen=True)
class Dominance:
    """The verdict on one condition.

    Parameters
    ----------
    condition : str
    dominant : str
        A source, or ``undecided``.
    leading : str or None
        The source that is most often the largest, decided or not.
    shares : mapping of str to float
        Of unweighted sound energy in the lines, averaged over receivers, summing
        to 1; empty for a condition without lines. What another component than
        motor and gearbox radiates counts as ``unassigned`` here.
    line_fraction : float or None
        The lines' part of the level, averaged over receivers.
    dominant_excitation : str or None
        The kind of excitation with the most energy.
    confidence : float or None
        Probability that the leading source is the largest.
    n_runs : int
        Steady runs that were averaged.
    spread_db : float or None
        Largest difference of the receivers' level between these runs.
    """

    condition: str
    dominant: str
    leading: str | None
    shares: Mapping[str, float]
    line_fraction: float | None
    dominant_excitation: str | None
    confidence: float | None
    n_runs: int
    spread_db: float | None


def dominance_of_condition(
    condition: str,
    sources: Sequence[SourceLine],
    draws: Draws | None,
    level_mean_square: Mapping[str, float],
    n_runs: int,
    spread_db: float | None,
) -> Dominance:
    """Weigh the sources of a condition's noise lines.

    Parameters
    ----------
    condition : str
    sources : sequence of SourceLine
        All receivers.
    draws : Draws or None
        Resampled judgements of the same lines.
    level_mean_square : mapping of str to float
        Mean square of each receiver in the level band, Pa².
    n_runs : int
    spread_db : float or None
    """
    shares = _shares(sources)
    fractions = [
        min(1.0, sum(source.line.mean_square for source in sources if source.line.channel == channel) / power)
        for channel, power in level_mean_square.items()
        if power > 0.0
    ]
    line_fraction = sum(fractions) / len(fractions) if fractions else None
    leading, confidence = (None, None) if draws is None else _leading(sources, draws)
    decided = confidence is not None and confidence >= DECIDED and leading not in (None, "unassigned")
    return Dominance(
        condition=condition,
        dominant=str(leading) if decided else "undecided",
        leading=leading,
        shares=shares,
        line_fraction=line_fraction,
        dominant_excitation=_excitation(sources) if draws is not None else None,
        confidence=confidence,
        n_runs=n_runs,
        spread_db=spread_db,
    )


def _shares(sources: Sequence[SourceLine]) -> dict[str, float]:
    per_receiver: dict[str, dict[str, float]] = {}
    for source in sources:
        energies = per_receiver.setdefault(source.line.channel, {})
        name = source.source if source.source in _SHARES else "unassigned"
        energies[name] = energies.get(name, 0.0) + source.line.mean_square
    shares: dict[str, float] = {}
    for energies in per_receiver.values():
        total = sum(energies.values())
        for name in _SHARES:
            shares[name] = shares.get(name, 0.0) + energies.get(name, 0.0) / total / len(per_receiver)
    return shares


def _excitation(sources: Sequence[SourceLine]) -> str | None:
    energies: dict[str, float] = {}
    for source in sources:
        energies[source.excitation] = energies.get(source.excitation, 0.0) + source.line.mean_square
    return max(energies, key=lambda kind: energies[kind]) if energies else None


def _leading(sources: Sequence[SourceLine], draws: Draws) -> tuple[str | None, float | None]:
    """Return the source that is largest most often, and how often."""
    return max(largest_sources(sources, draws).items(), key=lambda item: item[1])


def largest_sources(sources: Sequence[SourceLine], draws: Draws) -> dict[str, float]:
    """Return how often each source is the largest; shares averaged over receivers in each draw.

    Parameters
    ----------
    sources : sequence of SourceLine
    draws : Draws
        Of the same lines.
    """
    totals = np.zeros((len(draws.sources), draws.energy.shape[1]))
    for receiver in dict.fromkeys(source.line.channel for source in sources):
        rows = [index for index, source in enumerate(sources) if source.line.channel == receiver]
        energy = draws.energy[rows]
        whole = np.maximum(energy.sum(axis=0), np.finfo(float).tiny)
        for number in range(len(draws.sources)):
            totals[number] += np.where(draws.source[rows] == number, energy, 0.0).sum(axis=0) / whole
    largest = np.bincount(totals.argmax(axis=0), minlength=len(draws.sources))
    return {name: float(count / largest.sum()) for name, count in zip(draws.sources, largest, strict=True)}

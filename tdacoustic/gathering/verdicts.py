"""Dominant sources over the train's speed, counted; no probability of ours is made from those of others."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from tdacoustic.gathering.overview import ConditionRow, Origin
from tdacoustic.gathering.result import GatheredResult
from tdacoustic.gathering.speed_bands import SpeedBand, band_at

__all__ = ["Matrix", "Row", "Tally", "has_verdict", "tallies", "verdict_rows"]


@dataclass(frozen=True)
class Row:
    """A row of the matrix: a train (or a campaign whose train is not known) of one origin and one fleet."""

    train: str
    is_train: bool
    origin: Origin
    fleet: str


@dataclass(frozen=True)
class Tally:
    """The verdicts of some conditions.

    Parameters
    ----------
    words : mapping of str to int
        How often each word was the verdict, the most frequent first.
    confidence : (float, float) or None
        Smallest and largest probability of the named sources; of undecided ones where nothing is named.
    leading : str
        What leads where a single verdict is undecided.
    """

    words: tuple[tuple[str, int], ...]
    confidence: tuple[float, float] | None
    leading: str = ""

    @property
    def n(self) -> int:
        """How many verdicts."""
        return sum(count for _, count in self.words)

    @property
    def majority(self) -> str:
        """The source that more than half of the verdicts name; empty where none does."""
        word, count = self.words[0] if self.words else ("", 0)
        return word if 2 * count > self.n and word != "undecided" else ""


Matrix: TypeAlias = dict[Row, tuple[list[GatheredResult], dict[SpeedBand, Tally]]]
"""By row its results, and its verdicts by speed band."""


def has_verdict(row: ConditionRow) -> bool:
    """Whether anything speaks for a source; a condition without lines or without a fleet has no verdict."""
    return row.dominant not in ("", "undecided") or row.confidence is not None


def tally(rows: Iterable[ConditionRow]) -> Tally:
    """Count the verdicts of conditions."""
    held = [row for row in rows if has_verdict(row)]
    counts = Counter(row.dominant for row in held)
    named = [row.confidence for row in held if row.dominant != "undecided" and row.confidence is not None]
    other = [row.confidence for row in held if row.confidence is not None]
    sure = named or other
    return Tally(
        tuple(sorted(counts.items(), key=lambda item: (-item[1], item[0]))),
        (min(sure), max(sure)) if sure else None,
        held[0].leading if len(held) == 1 else "",
    )


def verdict_rows(results: Sequence[GatheredResult], width_km_h: float) -> Matrix:
    """Return the matrix of trains and speed bands; conditions without a speed are in none.

    Parameters
    ----------
    results : sequence of GatheredResult
    width_km_h : float
        Of the bands.
    """
    cells: dict[Row, dict[SpeedBand, list[ConditionRow]]] = {}
    whose: dict[Row, list[GatheredResult]] = {}
    for result in results:
        row = Row(result.train, bool(result.identity.train), result.origin, result.fleet)
        for condition in result.conditions:
            if condition.train_speed_km_h is None or not has_verdict(condition):
                continue
            band = band_at(condition.train_speed_km_h, width_km_h)
            cells.setdefault(row, {}).setdefault(band, []).append(condition)
            if result not in whose.setdefault(row, [])[-1:]:
                whose[row].append(result)
    return {row: (whose[row], {band: tally(held) for band, held in bands.items()}) for row, bands in cells.items()}


def tallies(results: Iterable[GatheredResult], width_km_h: float) -> dict[SpeedBand, Tally]:
    """Return the verdicts of all these results by speed band, slowest first."""
    held: dict[SpeedBand, list[ConditionRow]] = {}
    for result in results:
        for row in result.conditions:
            if row.train_speed_km_h is not None and has_verdict(row):
                held.setdefault(band_at(row.train_speed_km_h, width_km_h), []).append(row)
    return {band: tally(rows) for band, rows in sorted(held.items())}

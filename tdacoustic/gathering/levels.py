"""Levels at 4 m over speed and over years: medians of what is alike."""

from __future__ import annotations

import datetime
import statistics
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from tdacoustic.gathering.overview import ConditionRow, Origin
from tdacoustic.gathering.result import GatheredResult
from tdacoustic.gathering.speed_bands import SpeedBand, band_at

__all__ = ["BandMedian", "LevelPoint", "band_medians", "grouped", "level_points", "year_medians"]

FEW: int = 5
"""Values of a band below which their range is not drawn."""

Key = TypeVar("Key", bound=Hashable)


@dataclass(frozen=True)
class LevelPoint:
    """A level at 4 m of a condition of a campaign.

    Parameters
    ----------
    result : GatheredResult
    row : ConditionRow
    speed_km_h, level_db : float
    """

    result: GatheredResult
    row: ConditionRow
    speed_km_h: float
    level_db: float

    @property
    def year(self) -> float | None:
        """When, as a number: a day in its year, the year's middle where the day is not known."""
        found = self.result.identity
        if found.date is not None:
            start = datetime.date(found.date.year, 1, 1)
            return found.date.year + (found.date - start).days / 365.25
        return None if found.year is None else found.year + 0.5


@dataclass(frozen=True)
class BandMedian:
    """The levels of a speed band together.

    Parameters
    ----------
    band : SpeedBand
    speed_km_h, level_db : float
        Medians.
    low_db, high_db : float or None
        Tenth and ninetieth percentile, of five values and more.
    n : int
    """

    band: SpeedBand
    speed_km_h: float
    level_db: float
    low_db: float | None
    high_db: float | None
    n: int


def level_points(results: Iterable[GatheredResult], origin: Origin) -> list[LevelPoint]:
    """Return every unweighted level at 4 m of one origin whose speed is known."""
    return [
        LevelPoint(result, row, row.train_speed_km_h, row.level_4m_db)
        for result in results
        for row in result.conditions
        if row.level_origin == origin and row.level_4m_db is not None and row.train_speed_km_h is not None
    ]


def grouped(points: Iterable[LevelPoint], key: Callable[[LevelPoint], Key]) -> dict[Key, list[LevelPoint]]:
    """Return the points by a key, in order of appearance."""
    found: dict[Key, list[LevelPoint]] = {}
    for point in points:
        found.setdefault(key(point), []).append(point)
    return found


def band_medians(points: Iterable[LevelPoint], width_km_h: float) -> list[BandMedian]:
    """Return the medians of the levels by speed band, slowest first."""
    held = grouped(points, lambda point: band_at(point.speed_km_h, width_km_h))
    return [_median(band, inside) for band, inside in sorted(held.items())]


def _median(band: SpeedBand, points: Sequence[LevelPoint]) -> BandMedian:
    levels = [point.level_db for point in points]
    tenths = statistics.quantiles(levels, n=10, method="inclusive") if len(levels) >= FEW else None
    return BandMedian(
        band,
        statistics.median(point.speed_km_h for point in points),
        statistics.median(levels),
        None if tenths is None else tenths[0],
        None if tenths is None else tenths[-1],
        len(points),
    )


def year_medians(points: Iterable[LevelPoint]) -> list[tuple[float, float]]:
    """Return the median instant and the median level of each year; points without a year are in none."""
    held: dict[int, list[tuple[float, float]]] = {}
    for point in points:
        if point.year is not None:
            held.setdefault(int(point.year), []).append((point.year, point.level_db))
    return [
        (statistics.median(when for when, _ in year), statistics.median(level for _, level in year))
        for _, year in sorted(held.items())
    ]

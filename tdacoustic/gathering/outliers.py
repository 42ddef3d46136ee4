"""Campaigns whose level or parameter stands out from the others of the same kind."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from tdacoustic.gathering.overview import ConditionRow, Origin, energy_mean_db
from tdacoustic.gathering.result import GatheredResult
from tdacoustic.gathering.robust import FEWEST, Spread, spread_of
from tdacoustic.gathering.speed_bands import band_at

__all__ = ["BAND_KM_H", "LEVEL_FLOOR_DB", "PARAMETER_FLOOR", "Comparison", "Group", "Outlier", "compared"]

BAND_KM_H: Final = 5.0
"""Width of the speed bands within which levels are compared: over 10 km/h the speed alone makes several decibels."""

LEVEL_FLOOR_DB: Final = 0.3
"""Smallest scatter of levels: what instruments and their calibration leave open [assumed]."""

PARAMETER_FLOOR: Final = 0.001
"""Smallest scatter of a parameter over its median [assumed]."""


@dataclass(frozen=True)
class Group:
    """Values that may be held against each other: one origin, one fleet, one quantity.

    Parameters
    ----------
    kind : {"level", "parameter"}
    origin, fleet : str
    what : str
        The speed band in words, or the parameter.
    mode : str
        Of the conditions, empty of parameters and where it is not known.
    """

    kind: Literal["level", "parameter"]
    origin: Origin
    fleet: str
    what: str
    mode: str = ""


@dataclass(frozen=True)
class Outlier:
    """A value that stands out from its group.

    Parameters
    ----------
    result : GatheredResult
    group : Group
    value : float
    spread : Spread
        Of the whole group, the value among it.
    interval : (float or None, float or None), optional
        Of 95 %, of a parameter.
    """

    result: GatheredResult
    group: Group
    value: float
    spread: Spread
    interval: tuple[float | None, float | None] | None = None

    @property
    def distance(self) -> float:
        """From the median, in scatters."""
        return self.spread.distance(self.value)


@dataclass(frozen=True)
class Comparison:
    """What was held against each other, and what stands out.

    Parameters
    ----------
    outliers : tuple of Outlier
        The farthest first.
    groups : int
        Groups of at least five values.
    values : int
        Values in these.
    small_groups : int
        Groups with fewer, in which nothing is said.
    without_fleet : int
        Results without a fleet's name, which are held against nothing.
    left_out_parameters : int
        Parameters on a bound or not determined, whose values mean nothing.
    """

    outliers: tuple[Outlier, ...]
    groups: int
    values: int
    small_groups: int
    without_fleet: int
    left_out_parameters: int


_Entry = tuple[GatheredResult, float, tuple[float | None, float | None] | None]


def compared(results: Sequence[GatheredResult]) -> Comparison:
    """Hold levels at 4 m and calibrated parameters of the same fleet and origin against each other.

    Levels are compared within bands of 5 km/h and one mode, recorded and uncorrectable ones apart: one value a result
    and band, the energy mean of its conditions. Of a parameter only determined values count, and one stands out only if
    its own interval of 95 % does not hold the group's median.

    Parameters
    ----------
    results : sequence of GatheredResult
    """
    groups: dict[Group, list[_Entry]] = {}
    for result in results:
        if result.fleet:
            for group, entry in (*_levels(result), *_parameters(result)):
                groups.setdefault(group, []).append(entry)
    large = {group: entries for group, entries in groups.items() if len(entries) >= FEWEST}
    found = [outlier for group, entries in large.items() for outlier in _outliers(group, entries)]
    unclear = (v for r in results if r.fleet for v in r.parameters if v.state in ("on a bound", "undetermined"))
    return Comparison(
        tuple(sorted(found, key=lambda each: -abs(each.distance))),
        groups=len(large),
        values=sum(map(len, large.values())),
        small_groups=len(groups) - len(large),
        without_fleet=sum(not result.fleet for result in results),
        left_out_parameters=sum(1 for _ in unclear),
    )


def _levels(result: GatheredResult) -> Iterator[tuple[Group, _Entry]]:
    held: dict[Group, list[ConditionRow]] = {}
    for row in result.conditions:
        usable = row.level_from == "recorded" and row.correction != "impossible"
        if usable and row.level_4m_db is not None and row.train_speed_km_h is not None:
            band = band_at(row.train_speed_km_h, BAND_KM_H)
            group = Group("level", row.level_origin, result.fleet, f"{band.words} km/h", row.mode)
            held.setdefault(group, []).append(row)
    for group, rows in held.items():
        level = energy_mean_db(row.level_4m_db for row in rows)
        if level is not None:
            yield group, (result, level, None)


def _parameters(result: GatheredResult) -> Iterator[tuple[Group, _Entry]]:
    for fitted in result.parameters:
        if fitted.state == "determined" and fitted.value is not None:
            yield (
                Group("parameter", result.origin, result.fleet, fitted.parameter),
                (result, fitted.value, fitted.ci95),
            )


def _outliers(group: Group, entries: Iterable[_Entry]) -> Iterator[Outlier]:
    held = list(entries)
    values = [value for _, value, _ in held]
    spread = spread_of(values, LEVEL_FLOOR_DB if group.kind == "level" else 0.0)
    if group.kind == "parameter":
        spread = spread_of(values, PARAMETER_FLOOR * abs(spread.median))
    for result, value, interval in held:
        if spread.stands_out(value) and not _holds(interval, spread.median):
            yield Outlier(result, group, value, spread, interval)


def _holds(interval: tuple[float | None, float | None] | None, value: float) -> bool:
    if interval is None:
        return False
    low, high = interval
    return (low is None or low <= value) and (high is None or value <= high)

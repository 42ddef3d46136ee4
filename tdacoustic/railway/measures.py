"""What a campaign's runs give by the railway standards: each run's quantities, their repetition, the unit's level."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from tdacoustic.railway.conditions import State
from tdacoustic.railway.quantities import Quantity
from tdacoustic.railway.repetition import Repetition, decisive, repetition, rounded_db, unit_level_db
from tdacoustic.railway.rules import STANDARDS

__all__ = ["PositionResult", "RailwayMeasures", "RunQuantity", "UnitResult", "repeated", "unit_results"]


@dataclass(frozen=True)
class RunQuantity:
    """A quantity of one microphone in one run; its instants count from the run's common start."""

    run: str
    condition: str
    channel: str
    quantity: Quantity


@dataclass(frozen=True)
class PositionResult:
    """The runs of one condition at one microphone.

    Parameters
    ----------
    condition, channel, standard, test, symbol : str
    repetition : Repetition
    state : "met", "broken" or "unknown"
        The worst of its runs: a broken requirement before one that nobody knows of.
    decisive : bool
        Whether it is the highest reported level of all positions.
    """

    condition: str
    channel: str
    standard: str
    test: str
    symbol: str
    repetition: Repetition
    state: State
    decisive: bool = False


@dataclass(frozen=True)
class UnitResult:
    """The level of a standing unit over its positions, or why there is none."""

    condition: str
    standard: str
    level_db: float | None
    reported_db: int | None
    reason: str | None


@dataclass(frozen=True)
class RailwayMeasures:
    """All that was found by the railway standards.

    Parameters
    ----------
    quantities : tuple of RunQuantity
    positions : tuple of PositionResult
    units : tuple of UnitResult
    standards : tuple of str
        Those that were asked for.
    """

    quantities: tuple[RunQuantity, ...] = ()
    positions: tuple[PositionResult, ...] = ()
    units: tuple[UnitResult, ...] = ()
    standards: tuple[str, ...] = ()


def repeated(quantities: Sequence[RunQuantity]) -> tuple[PositionResult, ...]:
    """Judge the runs of each condition and microphone by the repetition rule, and name the decisive position.

    A run without a level does not count; a quantity that no run has is left out.

    Parameters
    ----------
    quantities : sequence of RunQuantity
        Of a standard that is not in `STANDARDS` (an older edition's) there is no rule and no result.
    """
    groups: dict[tuple[str, str, str, str], dict[str, list[Quantity]]] = {}
    for item in quantities:
        quantity = item.quantity
        if quantity.level_db is not None and quantity.standard in STANDARDS:
            key = (item.condition, quantity.standard, quantity.test, quantity.symbol)
            groups.setdefault(key, {}).setdefault(item.channel, []).append(quantity)
    found = []
    for (condition, standard, test, symbol), positions in groups.items():
        rule = STANDARDS[standard]
        runs = {name: repetition([q.level_db for q in held if q.level_db is not None], rule)
                for name, held in positions.items()}  # fmt: skip
        best = decisive(runs)
        for name, judged in runs.items():
            state = _worst(quantity.state for quantity in positions[name])
            of_all = best is not None and best[0] == name
            found.append(PositionResult(condition, name, standard, test, symbol, judged, state, of_all))
    return tuple(found)


def _worst(states: Iterator[State]) -> State:
    held = set(states)
    return "broken" if "broken" in held else "unknown" if "unknown" in held else "met"


def unit_results(positions: Sequence[PositionResult], lengths_m: Mapping[str, float]) -> tuple[UnitResult, ...]:
    """Return the level of the standing unit by condition and standard (ISO 3095:2013, 5.7).

    Parameters
    ----------
    positions : sequence of PositionResult
    lengths_m : mapping of str to float
        Length of the unit that each wayside microphone stands for.
    """
    groups: dict[tuple[str, str], list[PositionResult]] = {}
    for position in positions:
        if position.test == "stationary" and not STANDARDS[position.standard].inside:
            groups.setdefault((position.condition, position.standard), []).append(position)
    return tuple(_unit(condition, standard, held, lengths_m) for (condition, standard), held in groups.items())


def _unit(condition: str, standard: str, held: Sequence[PositionResult], lengths_m: Mapping[str, float]) -> UnitResult:
    without = [position.channel for position in held if position.channel not in lengths_m]
    if without:
        reason = f"the length of the unit that a position stands for is not stated: {', '.join(without)}"
        return UnitResult(condition, standard, None, None, reason)
    absent = sorted(set(lengths_m) - {position.channel for position in held})
    if absent:
        return UnitResult(condition, standard, None, None, f"no level at {', '.join(absent)}")
    levels = [position.repetition.mean_db for position in held if position.repetition.mean_db is not None]
    level = unit_level_db(levels, [lengths_m[position.channel] for position in held])
    invalid = [f"{position.channel}: {position.repetition.reason}" for position in held if position.repetition.reason]
    reported = None if invalid else rounded_db(level)
    return UnitResult(condition, standard, level, reported, "; ".join(invalid) or None)

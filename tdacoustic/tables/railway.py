"""``railway.csv`` as a view of what was found by the railway standards."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from tdacoustic.railway import Finding, PositionResult, RailwayMeasures, RunQuantity, UnitResult
from tdacoustic.tables.frames import Row, frame_of

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["findings_words", "railway_table"]

_OF_QUANTITY = ("standard", "test", "symbol", "level_db", "corrected_db", "reason", "state")
_OF_POSITION = ("condition", "channel", "standard", "test", "symbol", "state", "decisive")
_ORDER = {"broken": 0, "unknown": 1, "met": 2}


def railway_table(found: RailwayMeasures | None) -> dict[str, pd.DataFrame]:
    """Return ``railway`` as a frame; none of a campaign that does not ask for it.

    First the quantities of each run; then, without a run, the runs of each position together; then, without a
    channel, the unit.

    Parameters
    ----------
    found : RailwayMeasures or None
    """
    if found is None:
        return {}
    rows: list[Row] = [*_quantities(found.quantities), *_positions(found.positions), *_units(found.units)]
    return {"railway": frame_of("railway", rows)}


def findings_words(findings: Sequence[Finding], states: Sequence[str] = ("broken", "unknown", "met")) -> str:
    """Return findings in words, what is broken first.

    Parameters
    ----------
    findings : sequence of Finding
    states : sequence of str
        Which are said.
    """
    held = sorted((finding for finding in findings if finding.state in states), key=lambda f: _ORDER[f.state])
    return "; ".join(f"{f.state}: {f.requirement} ({f.detail}; {f.origin})" for f in held)


def _quantities(quantities: Sequence[RunQuantity]) -> Iterator[Row]:
    for item in quantities:
        quantity = item.quantity
        yield {
            "run": item.run,
            "condition": item.condition,
            "channel": item.channel,
            **{key: getattr(quantity, key) for key in _OF_QUANTITY},
            "findings": findings_words(quantity.findings),
            "start_s": quantity.start_s,
            "end_s": quantity.end_s,
        }


def _positions(positions: Sequence[PositionResult]) -> Iterator[Row]:
    for position in positions:
        runs = position.repetition
        yield {
            "run": "",
            **{key: getattr(position, key) for key in _OF_POSITION},
            "level_db": runs.mean_db,
            "reason": runs.reason,
            "findings": "",
            "n_runs": float(len(runs.levels_db)),
            "spread_db": runs.spread_db,
            "reported_db": None if runs.reported_db is None else float(runs.reported_db),
        }


def _units(units: Sequence[UnitResult]) -> Iterator[Row]:
    for unit in units:
        yield {
            "run": "",
            "condition": unit.condition,
            "channel": "",
            "standard": unit.standard,
            "test": "stationary",
            "symbol": "LpAeq,T,unit",
            "level_db": unit.level_db,
            "reason": unit.reason,
            "state": "",
            "findings": "",
            "reported_db": None if unit.reported_db is None else float(unit.reported_db),
        }

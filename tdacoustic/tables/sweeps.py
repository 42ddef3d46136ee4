"""The tables of design sweeps, column by column: a study may have a hundred thousand points."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from tdacoustic.studies import LevelInStudy, SweepResult, SweepSensitivity
from tdacoustic.tables.frames import Row, frame_of
from tdacoustic.tables.schema import COLUMNS

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["sweep_tables"]

SWEPT: Final = (
    *("structure_spl_4m_db", "mesh_spl_4m_db", "motor_spl_4m_db", "spl_4m_db", "masuda_spl_1m_db", "dte_pp_um"),
    *("range_12m_db", "loudest_deg"),
)
"""Quantities of a sweep's table."""

RATTLES: Final = "the harmonic balance finds no stable motion, and a study integrates none in time"
"""Why a point of a study has no values in a condition."""


def sweep_tables(sweeps: Sequence[SweepResult], studies: Sequence[SweepSensitivity]) -> dict[str, pd.DataFrame]:
    """Return ``sweep_points`` and ``sweeps``, and ``sweep_sensitivity`` where a sweep goes over ranges.

    Parameters
    ----------
    sweeps : sequence of SweepResult
        One at least.
    studies : sequence of SweepSensitivity
    """
    import pandas as pd

    held = {
        "sweep_points": pd.concat([_points_frame(found) for found in sweeps], ignore_index=True),
        "sweeps": pd.concat([_levels_frame(found) for found in sweeps], ignore_index=True),
    }
    if studies:
        rows = (row for study in studies for level in study.levels for row in _sensitivity_rows(study, level))
        held["sweep_sensitivity"] = frame_of("sweep_sensitivity", rows)
    return held


def _points_frame(found: SweepResult) -> pd.DataFrame:
    keys, n = found.sweep.keys, len(found.points)
    values = [value for point in found.points for _, value in point]
    numbers = [_number(value) for value in values]
    words = [None if number is not None else _text(value) for number, value in zip(numbers, values, strict=True)]
    columns = {
        "sweep": _text_series([found.sweep.name] * len(values)),
        "point": np.repeat(np.arange(1.0, n + 1.0), len(keys)),
        "parameter": _text_series(list(keys) * n),
        "value": np.array(numbers, dtype=np.float64),
        "words": _text_series(words),
        "reason": _text_series([reason for reason in found.reasons for _ in keys]),
    }
    return _frame("sweep_points", columns)


def _levels_frame(found: SweepResult) -> pd.DataFrame:
    n, conditions = len(found.points), found.conditions
    size = n * len(conditions)
    words = [", ".join(f"{key} = {_text(value)}" for key, value in point) for point in found.points]
    rattles = found.rattles
    reasons = [
        RATTLES if rattling else reason
        for reason, row in zip(found.reasons, rattles.tolist(), strict=True)
        for rattling in row
    ]
    columns: dict[str, Any] = {
        "sweep": _text_series([found.sweep.name] * size),
        "point": np.repeat(np.arange(1.0, n + 1.0), len(conditions)),
        "condition": _text_series(list(conditions) * n),
        "train_speed_km_h": _finite(found.speed_km_h),
        "parameters": _text_series([one for one in words for _ in conditions]),
        **{name: _finite(found.of(name)) for name in SWEPT},
        "reason": _text_series(reasons),
    }
    return _frame("sweeps", columns)


def _frame(name: str, columns: dict[str, Any]) -> pd.DataFrame:
    import pandas as pd

    return pd.DataFrame(columns)[COLUMNS[name].split()]


def _text_series(values: Sequence[str | None]) -> pd.Series:
    import pandas as pd

    return pd.Series(values, dtype="str")


def _finite(values: np.ndarray) -> np.ndarray:
    """Values in the order of the rows; what is not finite is not determined."""
    flat = values.ravel()
    return np.where(np.isfinite(flat), flat, np.nan)


def _number(value: Any) -> float | None:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return float(value) if is_number else None


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, tuple):
        return f"[{', '.join(_text(one) for one in value)}]"
    return f"{value:.9g}" if isinstance(value, int | float) else str(value)


def _sensitivity_rows(study: SweepSensitivity, level: LevelInStudy) -> Iterator[Row]:
    """One row a parameter and measure; where nothing can be said, one a parameter with the numbers of points."""
    regression = level.regression
    measures = {
        "first_order_index": level.first_order,
        "total_index": level.total,
        "standardised_regression": None if regression is None else regression.standardised,
        "rank_correlation": None if regression is None else regression.rank,
        "change_over_range_db": None if regression is None else regression.slope,
    }
    common: Row = {
        "sweep": study.found.sweep.name,
        "condition": level.condition or "",
        "level_of": "energy_mean" if level.condition is None else "condition",
        "explained": None if regression is None else regression.explained,
        "explained_ranks": None if regression is None else regression.explained_ranks,
        "n_used": float(level.n_used),
        "n_rattling": float(level.n_rattling),
        "n_silent": float(level.n_silent),
        "n_refused": float(study.n_refused),
    }
    for place, (key, held) in enumerate(zip(study.keys, study.found.sweep.ranges, strict=True)):
        at = {**common, "parameter": key, "range_from": held.low, "range_to": held.high, "scale": held.scale}
        known = {name: one for name, one in measures.items() if one is not None}
        for name, one in known.items():
            numbers = {"value": one.value[place], "low": one.low[place], "high": one.high[place]}
            yield {**at, "measure": name, **{column: float(number) for column, number in numbers.items()}}
        if not known:
            yield at

"""Rows to frames with the columns of the contracts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

from tdacoustic.tables.schema import COLUMNS, TEXT_COLUMNS

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Row", "frame_of"]

Row: TypeAlias = dict[str, Any]
"""A row by column; what it lacks is not determined."""


def frame_of(name: str, rows: Iterable[Row]) -> pd.DataFrame:
    """Return a table as a frame with its columns in their order.

    Parameters
    ----------
    name : str
        Of the table, as in `COLUMNS`.
    rows : iterable of Row
    """
    import pandas as pd

    columns = COLUMNS[name].split()
    held = list(rows)
    data = {column: [row.get(column) for row in held] for column in columns}
    frame = pd.DataFrame({column: pd.Series(values, dtype=_dtype(column, values)) for column, values in data.items()})
    return frame[columns]


def _dtype(column: str, values: Sequence[Any]) -> str:
    if column in TEXT_COLUMNS:
        return "str"
    if any(isinstance(value, bool) for value in values):
        return "boolean" if any(value is None for value in values) else "bool"
    return "float64"

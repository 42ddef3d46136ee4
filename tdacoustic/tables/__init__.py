"""The CSV contracts: their columns, how they are written, and their rows as views of results."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tdacoustic.tables.measured import measured_tables
    from tdacoustic.tables.predicted import predicted_tables
    from tdacoustic.tables.schema import COLUMNS
    from tdacoustic.tables.what_if import what_if_table
    from tdacoustic.tables.writing import csv_text

__all__ = ["COLUMNS", "csv_text", "measured_tables", "predicted_tables", "what_if_table"]

_WHERE = {
    "COLUMNS": "tdacoustic.tables.schema",
    "csv_text": "tdacoustic.tables.writing",
    "measured_tables": "tdacoustic.tables.measured",
    "predicted_tables": "tdacoustic.tables.predicted",
    "what_if_table": "tdacoustic.tables.what_if",
}
"""Each is imported when it is first used: who only writes a table needs none of what tables are views of."""


def __getattr__(name: str) -> Any:
    if name in _WHERE:
        return getattr(import_module(_WHERE[name]), name)
    raise AttributeError(f"module 'tdacoustic.tables' has no attribute {name!r}")

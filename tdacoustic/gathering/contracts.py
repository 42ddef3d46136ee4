"""The tables of a dataset: their columns, types, units and references."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from tdacoustic.tables.schema import COLUMNS, TEXT_COLUMNS

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["COPIED", "DATASET_SCHEMA", "DATASET_TABLES", "DERIVED", "IDENTITY", "TableColumn", "arrow_schema"]

DATASET_SCHEMA: Final = "tdacoustic-dataset/1"

COPIED: Final = ("levels", "bands", "lines", "sources", "dominance", "conditions", "predictions")
"""Tables of a result that a dataset holds row by row."""

_FLAGS: Final = frozenset({"conflict", "filter_dependent", "periodic"})
"""Columns of `COPIED` that are true or false."""

_UNITS: Final = MappingProxyType(
    {
        **{"_km_h": "km/h", "_rpm": "1/min", "_hz": "Hz", "_db": "dB", "_kw": "kW", "_n_m": "N m", "_um": "um"},
        **{"_m": "m", "_rad": "rad", "_deg": "deg", "_s": "s"},
    }
)
_SOUND: Final = "20 uPa"
_BY_QUANTITY: Final = "20 uPa of a sound pressure, 1 um/s^2 of an acceleration"
_DIFFERENCE: Final = "none: a difference of levels"
_REFERENCES: Final = MappingProxyType(
    {
        **{f"levels.{column}": "as the column reference says" for column in ("level_db", "background_db")},
        "levels.level_band_db": "as the column reference says",
        **{f"{table}.level_db": _BY_QUANTITY for table in ("bands", "lines")},
        **dict.fromkeys(("prominence_db", "spread_db", "sigma_db"), _DIFFERENCE),
        **{"motor_sound_power_level_db": "1 pW", "structure_sound_power_level_db": "1 pW"},
    }
)
"""References of levels, by table and column or by column; of all others 20 uPa."""


@dataclass(frozen=True)
class TableColumn:
    """A column of a dataset's table.

    Parameters
    ----------
    name : str
        With its unit as suffix.
    kind : str
        ``text`` (dictionary-encoded), ``number`` (float64), ``flag`` (bool), ``count`` (int64), ``day`` (date32) or
        ``time`` (timestamp in UTC).
    """

    name: str
    kind: str

    @property
    def unit(self) -> str:
        """Its unit, empty for a text or a number without one."""
        if self.kind != "number":
            return ""
        if self.name == "rms":
            return "as the column si_unit says"
        return next((unit for suffix, unit in _UNITS.items() if self.name.endswith(suffix)), "")

    def reference(self, table: str) -> str:
        """Return what a level is relative to, empty of what is no level."""
        if self.unit != "dB":
            return ""
        return _REFERENCES.get(f"{table}.{self.name}", _REFERENCES.get(self.name, _SOUND))


def _columns(text: str) -> tuple[TableColumn, ...]:
    """Columns written as ``name:kind``; numbers without a kind."""
    parts = (entry.partition(":") for entry in text.split())
    return tuple(TableColumn(name, kind or "number") for name, _, kind in parts)


IDENTITY: Final = _columns("result:text campaign:text train:text date:day year:count origin:text fleet:text")
"""What stands before every row: whose it is."""

DERIVED: Final = MappingProxyType(
    {
        "results": _columns(
            "folder:text command:text started:time started_text:text date_from:text conditions:count runs:count "
            "runs_bad:count runs_warned:count problems:count first_problem:text inputs:count input_bytes:count "
            "version:text"
        ),
        "overview": _columns(
            "condition:text train_speed_km_h speed_from:text mode:text level_4m_db laeq_4m_db level_from:text "
            "level_origin:text correction:text levels:count model_4m_db dominant:text confidence leading:text "
            "dominant_excitation:text line_fraction"
        ),
        "parameters": _columns("parameter:text value initial min max stderr ci95_low ci95_high state:text doubt:text"),
        "residuals": _columns(
            "condition:text receiver:text what:text measured_db predicted_db before_db sigma_db weighting:text "
            "level_origin:text source:text of_campaign:text"
        ),
        "quality": _columns("check:text verdict:text checks:count runs:count channels:count first_detail:text"),
    }
)
"""Tables of a dataset that are made from several files of a result, without `IDENTITY`."""


def _copied(name: str) -> tuple[TableColumn, ...]:
    return tuple(
        TableColumn(column, "text" if column in TEXT_COLUMNS else "flag" if column in _FLAGS else "number")
        for column in COLUMNS[name].split()
    )


DATASET_TABLES: Final = MappingProxyType({**DERIVED, **{name: _copied(name) for name in COPIED}})
"""Columns of every table of a dataset by its name, without `IDENTITY`."""


def arrow_schema(table: str, version: str) -> pa.Schema:
    """Return the schema of a table with its units: ``IDENTITY`` first, then its own columns.

    Parameters
    ----------
    table : str
        Out of `DATASET_TABLES`.
    version : str
        Of tdacoustic.
    """
    import pyarrow as pa

    types = {
        "text": pa.dictionary(pa.int32(), pa.string()),
        "number": pa.float64(),
        "flag": pa.bool_(),
        "count": pa.int64(),
        "day": pa.date32(),
        "time": pa.timestamp("us", tz="UTC"),
    }
    fields = []
    for column in (*IDENTITY, *DATASET_TABLES[table]):
        said = {"unit": column.unit, "reference": column.reference(table)}
        fields.append(pa.field(column.name, types[column.kind], metadata={k: v for k, v in said.items() if v} or None))
    return pa.schema(fields, metadata={"schema": DATASET_SCHEMA, "table": table, "tdacoustic": version})

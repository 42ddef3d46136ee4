"""The dataset: one Parquet file a table, written in groups of rows, so that memory does not grow with the results."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final

from tdacoustic.errors import MissingPackageError
from tdacoustic.gathering.contracts import DATASET_TABLES, DERIVED, IDENTITY, arrow_schema
from tdacoustic.gathering.result import ReadResult

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["DatasetWriter", "check_pyarrow"]

ROWS_A_GROUP: Final = 65_536
"""Rows that wait in memory at most, and one result's more; a group is what a query reads or skips at once."""

TABLES_APART: Final = 256
"""Tables that wait one by one: each costs some 20 kB, whatever its rows."""


def check_pyarrow() -> None:
    """Raise `MissingPackageError` where pyarrow is not installed."""
    try:
        import pyarrow  # noqa: F401
    except ImportError as error:
        raise MissingPackageError(
            'the fleet view needs the package pyarrow, which is not installed: pip install "tdacoustic[fleet]"'
        ) from error


class _TableWriter:
    """One Parquet file; rows wait until there are enough for a group."""

    def __init__(self, path: Path, table: str, version: str) -> None:
        import pyarrow.parquet as pq

        self.schema = arrow_schema(table, version)
        self.rows = 0
        self._waiting: list[pa.Table] = []
        self._n_waiting = 0
        self._writer = pq.ParquetWriter(path, self.schema, compression="zstd")

    def add(self, table: pa.Table) -> None:
        import pyarrow as pa

        if table.num_rows:
            self._waiting.append(table)
        self._n_waiting += table.num_rows
        self.rows += table.num_rows
        if self._n_waiting >= ROWS_A_GROUP:
            self.flush()
        elif len(self._waiting) >= TABLES_APART:
            self._waiting = [pa.concat_tables(self._waiting).combine_chunks()]

    def flush(self) -> None:
        import pyarrow as pa

        if self._n_waiting:
            whole = pa.concat_tables(self._waiting).combine_chunks()
            columns = [_encoded(whole.column(field.name), field.type) for field in self.schema]
            self._writer.write_table(pa.Table.from_arrays(columns, schema=self.schema), row_group_size=ROWS_A_GROUP)
        self._waiting, self._n_waiting = [], 0

    def close(self) -> None:
        self.flush()
        self._writer.close()


def _encoded(values: pa.ChunkedArray, wanted: pa.DataType) -> pa.ChunkedArray:
    import pyarrow as pa

    return values.dictionary_encode() if pa.types.is_dictionary(wanted) else values.cast(wanted)


class DatasetWriter:
    """Writes results one after the other into the tables of a dataset, used as a context.

    Every table is there afterwards, with its columns, even where no result has a row for it.

    Parameters
    ----------
    folder : Path
        Made where it is not there.
    version : str
        Of tdacoustic, for the files' metadata.
    """

    def __init__(self, folder: Path, version: str) -> None:
        self.folder = folder
        self._version = version
        self._writers: dict[str, _TableWriter] = {}
        self._plain: dict[str, pa.Schema] = {}

    def __enter__(self) -> DatasetWriter:
        self.folder.mkdir(parents=True, exist_ok=True)
        for name in DATASET_TABLES:
            self._writers[name] = _TableWriter(self.folder / f"{name}.parquet", name, self._version)
            self._plain[name] = _plain_schema(self._writers[name].schema)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for writer in self._writers.values():
            writer.close()

    @property
    def rows(self) -> dict[str, int]:
        """Rows of each table so far."""
        return {name: writer.rows for name, writer in self._writers.items()}

    def add(self, result: ReadResult, folder: str) -> None:
        """Add all of a result.

        Parameters
        ----------
        result : ReadResult
        folder : str
            Where it lies, as ``results`` says it.
        """
        import pyarrow as pa

        kept = result.kept
        whose = kept.whose()
        rows: dict[str, Iterable[Mapping[str, Any]]] = {
            "results": [kept.row(folder)],
            "overview": [row.row() for row in kept.conditions],
            "parameters": [value.row() for value in kept.parameters],
            "residuals": result.residuals,
            "quality": [asdict(count) for count in kept.quality],
        }
        for name in DERIVED:
            held = [{**whose, **{key: None if cell == "" else cell for key, cell in row.items()}} for row in rows[name]]
            self._writers[name].add(pa.Table.from_pylist(held, schema=self._plain[name]))
        for name, table in result.tables.items():
            self._writers[name].add(self._with_identity(table, name, whose))

    def _with_identity(self, table: pa.Table, name: str, whose: Mapping[str, Any]) -> pa.Table:
        import pyarrow as pa

        schema = self._plain[name]
        before = [
            pa.repeat(pa.scalar(whose[column.name], schema.field(column.name).type), table.num_rows)
            for column in IDENTITY
        ]
        return pa.Table.from_arrays([*before, *table.columns], schema=schema)


def _plain_schema(schema: pa.Schema) -> pa.Schema:
    """The schema with plain strings: rows are encoded once a group is full."""
    import pyarrow as pa

    return pa.schema(
        [pa.field(field.name, pa.string() if pa.types.is_dictionary(field.type) else field.type) for field in schema]
    )

"""CSV tables of a result as typed columns, strictly by their contract."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from tdacoustic.errors import GatheringError
from tdacoustic.gathering.contracts import TableColumn
from tdacoustic.gathering.texts import FORBIDDEN, LARGEST, LONGEST

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["parsed_table"]

_LONGEST_HEAD: Final = 20_000


def parsed_table(data: bytes, what: str, columns: tuple[TableColumn, ...]) -> pa.Table:
    """Return the rows of a CSV file under the columns of its contract.

    A contract only ever grows at its end: a file of an older version lacks the last columns, which are empty then; one
    of a newer version has more, which are passed by.

    Parameters
    ----------
    data : bytes
    what : str
        Name of the file.
    columns : tuple of TableColumn
        Of kinds ``text``, ``number`` and ``flag``; texts are plain strings in what is returned.

    Raises
    ------
    GatheringError
        The columns are others, or a cell is not of its type, is not finite, is too long or has a control character.
    """
    import pyarrow as pa
    import pyarrow.csv

    types = {"text": pa.string(), "number": pa.float64(), "flag": pa.bool_()}
    head = _head(data, what)
    names = [column.name for column in columns]
    held = min(len(head), len(names))
    if head[:held] != names[:held]:
        wrong = next(i for i in range(held) if head[i] != names[i])
        raise GatheringError(f"{what}: column {wrong + 1} is {head[wrong][:40]!r}, expected {names[wrong]!r}")
    try:
        table = pyarrow.csv.read_csv(
            io.BytesIO(data),
            read_options=pyarrow.csv.ReadOptions(use_threads=False),  # the tables are small
            parse_options=pyarrow.csv.ParseOptions(newlines_in_values=False),
            convert_options=pyarrow.csv.ConvertOptions(
                column_types={column.name: types[column.kind] for column in columns[:held]},
                include_columns=names[:held],
                null_values=[""],
                true_values=["true"],
                false_values=["false"],
                strings_can_be_null=True,
            ),
        )
    except (pa.ArrowInvalid, pa.ArrowKeyError) as error:
        raise GatheringError(f"{what}: {_words(error, head)}") from error
    for column in columns[:held]:
        _check(table.column(column.name), column, what)
    for column in columns[held:]:
        table = table.append_column(column.name, pa.nulls(table.num_rows, types[column.kind]))
    return table


def _head(data: bytes, what: str) -> list[str]:
    line = data[:_LONGEST_HEAD].partition(b"\n")[0]
    try:
        head = next(csv.reader([line.decode("utf-8").rstrip("\r")], strict=True), [])
    except (UnicodeDecodeError, csv.Error) as error:
        raise GatheringError(f"{what}: its first line is no header") from error
    if not head or len(set(head)) < len(head):
        raise GatheringError(f"{what}: its first line is no header")
    return head


def _words(error: Exception, head: Sequence[str]) -> str:
    """An error of the parser on one line, with the column's name where it counts columns from 0."""
    said = str(error).partition("\n")[0].removeprefix("CSV parse error: ")
    found = re.match(r"In CSV column #(\d+): Row #(\d+): (?:CSV conversion error to )?", said)
    if found is not None and int(found[1]) < len(head):
        said = f"{head[int(found[1])]}, line {found[2]}: {said[found.end() :]}"
    return said.encode("ascii", "replace").decode("ascii")[:160]


def _check(values: pa.ChunkedArray, column: TableColumn, what: str) -> None:
    import pyarrow.compute as pc

    if column.kind == "number":
        if pc.any(pc.invert(pc.is_finite(values))).as_py():
            raise GatheringError(f"{what}: {column.name} has a value that is not finite")
        if (pc.max(pc.abs(values)).as_py() or 0.0) > LARGEST:
            raise GatheringError(f"{what}: {column.name} has a value above {LARGEST:g}, which nothing measured is")
    if column.kind == "text":
        if (pc.max(pc.utf8_length(values)).as_py() or 0) > LONGEST:
            raise GatheringError(f"{what}: {column.name} has a text of more than {LONGEST} characters")
        if pc.any(pc.match_substring_regex(values, FORBIDDEN)).as_py():
            raise GatheringError(f"{what}: {column.name} has a control character")

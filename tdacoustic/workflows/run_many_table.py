"""What became of many campaigns: a table as CSV and as lines."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

from tdacoustic.errors import OutputError
from tdacoustic.tables.writing import csv_rows
from tdacoustic.workflows.output import partial_name
from tdacoustic.workflows.run_many_work import Told

if TYPE_CHECKING:
    from rich.table import Table

__all__ = ["TABLE", "CampaignRow", "check_table", "plain_lines", "rich_table", "write_table"]

TABLE: Final = "campaigns.csv"

COLUMNS: Final = (
    *("campaign", "name", "out", "status", "n_runs", "n_conditions", "n_problems"),
    *("steps_computed", "steps_found", "error"),
)


@dataclass(frozen=True)
class CampaignRow:
    """One campaign of several.

    Parameters
    ----------
    campaign : str
        As the user wrote it.
    out : Path
        The result folder.
    told : Told
        What became of it.
    """

    campaign: str
    out: Path
    told: Told = field(default_factory=Told)

    def cells(self) -> tuple[str | int | None, ...]:
        """Return the cells of its row in the CSV: no time it took, so that the same work gives the same table."""
        told = self.told
        return (
            *(self.campaign, told.name, self.out.as_posix(), told.status),
            *(told.n_runs, told.n_conditions, told.n_problems, told.steps_computed, told.steps_found, told.error),
        )


def check_table(root: Path, overwrite: bool) -> None:
    """Raise where the table could not be written into a root folder.

    Raises
    ------
    OutputError
        A file is in the folder's way, or a table of somebody else in the table's.
    """
    if root.exists() and not root.is_dir():
        raise OutputError(f"{root}: a file is in the way of the output folder")
    path = root / TABLE
    if overwrite or not path.exists():
        return
    try:
        with path.open(encoding="utf-8") as stream:
            head = stream.readline(1000)
    except (OSError, ValueError):
        head = ""
    if head.strip() != ",".join(COLUMNS):
        raise OutputError(f"{path}: is in the way and not of tdacoustic; give --overwrite or another -o")


def write_table(root: Path, rows: Sequence[CampaignRow]) -> Path:
    """Write the table of all campaigns into their root folder, whole or not at all.

    Raises
    ------
    OutputError
        It cannot be written.
    """
    path = root / TABLE
    temporary = root / partial_name(TABLE)
    try:
        root.mkdir(parents=True, exist_ok=True)
        try:
            temporary.write_bytes(csv_rows(COLUMNS, [row.cells() for row in rows]).encode())
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"{path}: cannot be written ({error.strerror})") from error
    return path


SHOWN: Final = ("campaign", "status", "runs", "problems", "computed", "found", "s")
"""Headings of the printed table; the last five are numbers."""


def _shown_cells(row: CampaignRow) -> tuple[str, ...]:
    """Return what is printed of a row."""
    told = row.told
    numbers = (told.n_runs, told.n_problems, told.steps_computed, told.steps_found)
    took = "" if told.wall_s is None else f"{told.wall_s:.1f}"
    return (row.campaign, told.status, *("" if number is None else str(number) for number in numbers), took)


def plain_lines(rows: Sequence[CampaignRow]) -> list[str]:
    """Return the table as aligned lines, for a pipe."""
    table = [SHOWN, *map(_shown_cells, rows)]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    lines = []
    for cells in table:
        first = (cell.ljust(width) for cell, width in zip(cells[:2], widths[:2], strict=True))
        rest = (cell.rjust(width) for cell, width in zip(cells[2:], widths[2:], strict=True))
        lines.append("  ".join((*first, *rest)).rstrip())
    return lines


def rich_table(rows: Sequence[CampaignRow], inert: Callable[[str], str]) -> Table:
    """Return the table for a terminal.

    Parameters
    ----------
    rows : sequence of CampaignRow
    inert : callable
        Takes what steers a terminal out of a text: names come from outside.
    """
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False)
    for place, heading in enumerate(SHOWN):
        table.add_column(heading, justify="left" if place < 2 else "right", overflow="fold")
    for row in rows:
        table.add_row(
            *(Text(inert(cell)) for cell in _shown_cells(row)), style="bold" if row.told.status == "failed" else ""
        )
    return table

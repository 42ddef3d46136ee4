"""``runs.csv``: runs as a table with the keys of ``[[run]]`` as columns."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Any, Final

from tdacoustic.campaign.messages import VOCABULARY
from tdacoustic.campaign.runs import CampaignRun
from tdacoustic.errors import CampaignError, MissingFileError
from tdacoustic.toml_models import small_file, steering_sign

__all__ = ["read_run_table"]

_TEXT_COLUMNS: Final = frozenset(
    {"name", "condition", "kind", "mode", "direction", "test", "reject_reason", "date", "calibrator", "align"}
)
_BOOLEANS: Final = {"true": True, "false": False}


def _cell(column: str, text: str) -> Any:
    if column in _TEXT_COLUMNS:
        return text
    if column in ("logs", "calibrated", "align_on"):
        return tuple(part.strip() for part in text.replace(";", "|").split("|") if part.strip())
    if column == "valid":
        return _BOOLEANS.get(text.lower(), text)
    try:
        return float(text)
    except ValueError:
        return text  # the model then says that it must be a number, and what it got


def _columns(path: Path, header: list[str]) -> list[str]:
    columns = [cell.strip() for cell in header]
    for number, column in enumerate(columns, 1):
        if not column:
            raise CampaignError(f"{path}: column {number} has no name in line 1")
        if column not in CampaignRun.model_fields:
            raise CampaignError(f"{path}: column {number}: {VOCABULARY.unknown_key(column, '[[run]]')}")
        if column in columns[: number - 1]:
            raise CampaignError(f"{path}: column {column!r} stands twice")
    if "logs" not in columns:
        raise CampaignError(f"{path}: column 'logs' is missing; there are {', '.join(columns)}")
    return columns


def read_run_table(path: Path) -> tuple[tuple[dict[str, Any], ...], dict[int, str]]:
    """Read a table of runs, unchecked but for its form.

    UTF-8, with or without a byte order mark; separated by ``,`` or ``;``, whichever
    is more frequent in the header row. An empty cell is an absent key. Several logs
    of a run are separated by ``|`` or ``;`` within their cell; their paths are
    relative to the campaign file, like those of ``[[run]]``.

    Parameters
    ----------
    path : Path

    Returns
    -------
    rows : tuple of dict
        As ``[[run]]`` would give them.
    labels : dict of int to str
        Where each row stands, for messages.

    Raises
    ------
    MissingFileError
        There is no such file.
    CampaignError
        Not UTF-8, no header, an unknown or doubled column, a row of another length, no row.
    """
    if not path.is_file():
        raise MissingFileError(f"{path}: no such file (runs = ... in the campaign file names it)")
    try:
        text = small_file(path, CampaignError).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise CampaignError(f"{path}: is not UTF-8 (byte {error.start}); save it as CSV UTF-8") from error
    sign = steering_sign(text)
    if sign is not None:
        line = text[: text.index(sign)].count("\n") + 1
        raise CampaignError(f"{path}: line {line} has the sign {sign!a}, which no text here may have")
    first = text.split("\n", 1)[0]
    delimiter = ";" if first.count(";") > first.count(",") else ","
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    rows: list[dict[str, Any]] = []
    labels: dict[int, str] = {}
    columns: list[str] | None = None
    try:
        for cells in reader:
            if not any(cell.strip() for cell in cells):
                continue
            if columns is None:
                columns = _columns(path, cells)
                continue
            place = f"{path.name} line {reader.line_num}"
            if len(cells) != len(columns):
                raise CampaignError(f"{path}: line {reader.line_num} has {len(cells)} cells, the header {len(columns)}")
            labels[len(rows)] = place
            filled = {column: cell.strip() for column, cell in zip(columns, cells, strict=True) if cell.strip()}
            rows.append({column: _cell(column, cell) for column, cell in filled.items()})
    except csv.Error as error:
        raise CampaignError(f"{path}: line {reader.line_num}: {error}") from error
    if not rows:
        raise CampaignError(f"{path}: no run in it")
    return tuple(rows), labels

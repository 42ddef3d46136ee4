"""One result, read whole and checked before anything of it is kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from tdacoustic.errors import GatheringError
from tdacoustic.gathering.contracts import COPIED, DATASET_TABLES, TableColumn
from tdacoustic.gathering.csv_tables import parsed_table
from tdacoustic.gathering.fits import FittedValue, parsed_fit
from tdacoustic.gathering.identity import Identity, identified
from tdacoustic.gathering.manifest import ResultFolder
from tdacoustic.gathering.overview import ConditionRow, Origin, condition_rows

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["GatheredResult", "QualityCount", "ReadResult", "read_result"]

QUALITY: Final = tuple(TableColumn(name, "text") for name in ("run", "channel", "check", "verdict", "detail"))
VERDICTS: Final = frozenset({"ok", "warning", "bad"})

REPORT: Final = "report.html"


@dataclass(frozen=True)
class QualityCount:
    """How often a check of a campaign had a verdict.

    Parameters
    ----------
    check, verdict : str
    checks, runs, channels : int
    first_detail : str
    """

    check: str
    verdict: str
    checks: int
    runs: int
    channels: int
    first_detail: str


@dataclass(frozen=True)
class GatheredResult:
    """What of one result is kept in memory: enough for the page, however many there are.

    Parameters
    ----------
    result : str
        Its id.
    campaign, origin, fleet, command : str
    identity : Identity
    path : Path
    has_report : bool
    conditions : tuple of ConditionRow
    parameters : tuple of FittedValue
    quality : tuple of QualityCount
    runs, runs_bad, runs_warned : int
        Runs that were checked; those with a bad verdict; those without one, but with a warning.
    problems : tuple of str
    inputs : tuple of (str, int)
        sha256 and bytes.
    version : str
    """

    result: str
    campaign: str
    origin: Origin
    fleet: str
    command: str
    identity: Identity
    path: Path
    has_report: bool
    conditions: tuple[ConditionRow, ...] = ()
    parameters: tuple[FittedValue, ...] = ()
    quality: tuple[QualityCount, ...] = ()
    runs: int = 0
    runs_bad: int = 0
    runs_warned: int = 0
    problems: tuple[str, ...] = ()
    inputs: tuple[tuple[str, int], ...] = ()
    version: str = ""

    @property
    def train(self) -> str:
        """The train; the campaign where nothing says the train."""
        return self.identity.train or self.campaign

    @property
    def n_conditions(self) -> int:
        """How many conditions it has."""
        return len({row.condition for row in self.conditions})

    @property
    def loudest(self) -> ConditionRow | None:
        """The condition with the highest level at 4 m, None without any."""
        held = [(row.level_4m_db, number) for number, row in enumerate(self.conditions) if row.level_4m_db is not None]
        return self.conditions[max(held)[1]] if held else None

    def whose(self) -> dict[str, Any]:
        """The columns that stand before every row of it."""
        found = self.identity
        return {
            **{"result": self.result, "campaign": self.campaign, "train": found.train or None, "date": found.date},
            **{"year": found.year, "origin": self.origin, "fleet": self.fleet or None},
        }

    def row(self, folder: str) -> dict[str, Any]:
        """The row of ``results``; `folder` is where it lies, as it is written."""
        found = self.identity
        return {
            "folder": folder,
            "command": self.command,
            "started": found.started,
            "started_text": found.started_text or None,
            "date_from": found.date_from or None,
            "conditions": self.n_conditions,
            "runs": self.runs,
            "runs_bad": self.runs_bad,
            "runs_warned": self.runs_warned,
            "problems": len(self.problems),
            "first_problem": self.problems[0] if self.problems else None,
            "inputs": len(self.inputs),
            "input_bytes": sum(size for _, size in self.inputs),
            "version": self.version or None,
        }


@dataclass(frozen=True)
class ReadResult:
    """A result as it was read: what is kept of it, its tables, and rows made of several files.

    Parameters
    ----------
    kept : GatheredResult
    tables : mapping of str to pyarrow.Table
        Out of `COPIED`, without whose they are.
    residuals : sequence of rows
    """

    kept: GatheredResult
    tables: Mapping[str, pa.Table]
    residuals: Sequence[dict[str, Any]] = field(default_factory=tuple)


def read_result(folder: ResultFolder, train_key: str | None = None, date_key: str | None = None) -> ReadResult:
    """Read the tables of a result; nothing of it is kept where one is damaged.

    Parameters
    ----------
    folder : ResultFolder
    train_key, date_key : str, optional
        See `tdacoustic.gathering.identity.identified`.

    Raises
    ------
    GatheringError
        A file is not what the manifest says, or does not keep to its contract.
    """
    tables = {}
    for name in COPIED:
        data = folder.read(f"{name}.csv")
        if data is not None:
            tables[name] = parsed_table(data, f"{name}.csv", DATASET_TABLES[name])
    quality = _quality(folder)
    fit = folder.read("calibration.json")
    parameters, residuals = ((), []) if fit is None else parsed_fit(fit)
    rows = {name: tables[name].to_pylist() if name in tables else [] for name in ("levels", "dominance", "conditions")}
    runs = {row["run"] for row in quality if row["run"]}
    bad = {row["run"] for row in quality if row["run"] and row["verdict"] == "bad"}
    warned = {row["run"] for row in quality if row["run"] and row["verdict"] == "warning"} - bad
    kept = GatheredResult(
        result=folder.result,
        campaign=folder.campaign,
        origin=folder.origin,
        fleet=folder.fleet,
        command=folder.command,
        identity=identified(folder.meta, folder.started, train_key, date_key),
        path=folder.path,
        has_report=REPORT in folder.files,
        conditions=condition_rows(folder.origin, rows["levels"], quality, rows["dominance"], rows["conditions"]),
        parameters=parameters,
        quality=_counts(quality),
        runs=len(runs),
        runs_bad=len(bad),
        runs_warned=len(warned),
        problems=folder.problems,
        inputs=folder.inputs,
        version=folder.version,
    )
    return ReadResult(kept, tables, residuals)


def _quality(folder: ResultFolder) -> list[dict[str, Any]]:
    data = folder.read("quality.csv")
    rows = [] if data is None else parsed_table(data, "quality.csv", QUALITY).to_pylist()
    odd = next((row["verdict"] for row in rows if row["verdict"] not in VERDICTS), None)
    if odd is not None:
        raise GatheringError(f"quality.csv: verdict {odd[:40]!r} is none of ok, warning, bad")
    return rows


def _counts(quality: Sequence[Mapping[str, Any]]) -> tuple[QualityCount, ...]:
    groups: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for row in quality:
        groups.setdefault((row["check"] or "", row["verdict"]), []).append(row)
    return tuple(
        QualityCount(
            check,
            verdict,
            checks=len(rows),
            runs=len({row["run"] for row in rows if row["run"]}),
            channels=len({row["channel"] for row in rows if row["channel"]}),
            first_detail=(rows[0]["detail"] or "")[:300],
        )
        for (check, verdict), rows in groups.items()
    )

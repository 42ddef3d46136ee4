"""What pydantic found wrong, each in one line that names the thing, the value and what is allowed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from pydantic import BaseModel
from pydantic_core import ErrorDetails

from tdacoustic.campaign.calibration import CalibrationParameter, CalibrationSettings
from tdacoustic.campaign.channels import CampaignChannel
from tdacoustic.campaign.judgements import Exclude, Level, Override
from tdacoustic.campaign.model import CampaignFile
from tdacoustic.campaign.railway import RailwaySettings
from tdacoustic.campaign.runs import CampaignRun
from tdacoustic.campaign.settings import AnalysisSettings
from tdacoustic.errors import CampaignError
from tdacoustic.toml_models import TOP_LEVEL, Vocabulary, file_error, joined, problem_words, shown

__all__ = ["VOCABULARY", "campaign_error", "problem_line"]

_ARRAYS: Final[Mapping[str, type[BaseModel]]] = MappingProxyType(
    {"channel": CampaignChannel, "run": CampaignRun, "level": Level, "exclude": Exclude, "override": Override}
)
_TABLES: Final[Mapping[str, type[BaseModel]]] = MappingProxyType(
    {"analysis": AnalysisSettings, "calibration": CalibrationSettings, "railway": RailwaySettings}
)

_PARAMETER: Final = "[[calibration.parameter]]"

VOCABULARY: Final = Vocabulary(
    MappingProxyType(
        {
            TOP_LEVEL: ("schema", *CampaignFile.model_fields),
            **{f"[[{name}]]": tuple(model.model_fields) for name, model in _ARRAYS.items()},
            **{f"[{name}]": tuple(model.model_fields) for name, model in _TABLES.items()},
            _PARAMETER: tuple(CalibrationParameter.model_fields),
        }
    )
)
"""The keys of ``campaign.toml``."""


def _place(raw: Mapping[str, Any], loc: Sequence[int | str], labels: Mapping[int, str]) -> tuple[str, str, list[Any]]:
    """Return where a location stands in words, its table, and what of it is inside the table."""
    head = loc[0] if loc else ""
    if head in _ARRAYS and len(loc) >= 2 and isinstance(loc[1], int):
        index = loc[1]
        entry = raw[str(head)][index]
        entry = entry if isinstance(entry, dict) else {}
        name, condition = entry.get("name"), entry.get("condition")
        if head in ("channel", "run") and isinstance(name, str | int):
            where = f"{head} {shown(str(name))}"
        elif condition is not None:
            where = f"{head} {index + 1} (condition {shown(condition)})"
        else:
            where = f"{head} {index + 1}"
        if head == "run" and index in labels:
            where = f"{labels[index]} ({where})" if name is not None else labels[index]
        return where, f"[[{head}]]", list(loc[2:])
    if head == "calibration" and len(loc) >= 3 and loc[1] == "parameter" and isinstance(loc[2], int):
        entry = raw["calibration"]["parameter"][loc[2]]
        name = entry.get("name") if isinstance(entry, dict) else None
        label = shown(name) if isinstance(name, str) else str(loc[2] + 1)
        return f"{_PARAMETER} {label}", _PARAMETER, list(loc[3:])
    if head in _TABLES and len(loc) >= 2:
        return f"[{head}]", f"[{head}]", list(loc[1:])
    return "", TOP_LEVEL, list(loc)


def problem_line(error: ErrorDetails, raw: Mapping[str, Any], labels: Mapping[int, str]) -> str:
    """Return one problem in one line.

    Parameters
    ----------
    error : ErrorDetails
        From pydantic.
    raw : mapping
        What was validated.
    labels : mapping of int to str
        Where a run stands in ``runs.csv``, by its index.
    """
    where, table, inside = _place(raw, error["loc"], labels)
    key = str(inside[0]) if inside else ""
    if len(inside) > 1 and isinstance(inside[1], int):
        if error["type"] == "missing":
            return joined(where, f"{key} has too few entries, {inside[1]}")
        key = f"{key}, entry {inside[1] + 1},"
    return joined(where, problem_words(error, key, table, VOCABULARY))


def campaign_error(path: Path, problems: Sequence[str]) -> CampaignError:
    """Return the error for a campaign file; see `file_error`."""
    return file_error(CampaignError, path, problems)

"""From ``campaign.toml`` to a `Campaign`, or to one message that says what is wrong."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from tdacoustic.campaign.contradictions import contradictions
from tdacoustic.campaign.messages import campaign_error, problem_line, shown, unknown_key
from tdacoustic.campaign.model import SCHEMA, Campaign, CampaignFile
from tdacoustic.campaign.run_table import read_run_table
from tdacoustic.campaign.runs import with_names
from tdacoustic.campaign.values import WrittenPath
from tdacoustic.errors import CampaignError, MissingFileError

__all__ = ["load_campaign"]


def _campaign_file(path: Path) -> Path:
    if path.is_dir():
        inside = path / "campaign.toml"
        if not inside.is_file():
            raise MissingFileError(f"{path}: the folder holds no campaign.toml")
        return inside
    if not path.is_file():
        raise MissingFileError(f"{path}: {'is not a file' if path.exists() else 'no such file'}")
    return path


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        text = path.read_bytes().decode("utf-8-sig")  # Windows editors put a byte order mark
    except UnicodeDecodeError as error:
        raise CampaignError(f"{path}: is not UTF-8 (byte {error.start}: {error.reason})") from error
    except OSError as error:
        raise CampaignError(f"{path}: cannot be read ({error.strerror})") from error
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        found = re.search(r"\(at line (\d+), column (\d+)\)", str(error))
        reason = re.sub(r"\s*\(at .*\)$", "", str(error))
        if found is None:
            raise CampaignError(f"{path}: no valid TOML: {reason}") from error
        line, column = int(found[1]), int(found[2])
        written = text.splitlines()[line - 1].strip() if line <= len(text.splitlines()) else ""
        raise CampaignError(
            f"{path}: line {line}, column {column}: no valid TOML: {reason}: {shown(written)}"
        ) from error
    except (RecursionError, ValueError) as error:  # nested a thousand deep, a number of 5000 digits, a 13th month
        raise CampaignError(f"{path}: no valid TOML: {error}") from error


def _frozen(value: Any) -> Any:
    if isinstance(value, list):
        return tuple(_frozen(item) for item in value)
    if isinstance(value, dict):
        return {key: _frozen(item) for key, item in value.items()}
    return value


def _meta_lines(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    for key, value in table.items():
        if isinstance(value, dict):
            yield from _meta_lines(value, f"{prefix}{key}.")
        elif isinstance(value, tuple):
            yield f"{prefix}{key}", ", ".join(str(item) for item in value)
        else:
            yield f"{prefix}{key}", str(value)


def _check_schema(path: Path, raw: dict[str, Any]) -> None:
    if "schema" not in raw:
        near = next((key for key in raw if key.lower() == "schema"), None)
        also = f"; {unknown_key(near, 'the top level')}" if near else ""
        raise CampaignError(f'{path}: schema is missing, the file has to begin with schema = "{SCHEMA}"{also}')
    schema = raw.pop("schema")
    if schema != SCHEMA:
        hint = ""
        if isinstance(schema, str) and schema.startswith(("tdacoustic-fleet/", "tdacoustic-synthesis/")):
            hint = f"; this is a {schema.partition('-')[2].partition('/')[0]} file"
        raise CampaignError(f"{path}: schema must be {SCHEMA!r}, got {shown(schema)}{hint}")


def _validated(path: Path, raw: dict[str, Any], labels: Mapping[int, str]) -> CampaignFile:
    try:
        return CampaignFile.model_validate(raw, context={"folder": path.parent})
    except ValidationError as error:
        problems = [problem_line(detail, raw, labels) for detail in error.errors(include_url=False)]
        raise campaign_error(path, list(dict.fromkeys(problems))) from None


def load_campaign(path: str | Path) -> Campaign:
    """Read and check a campaign.

    Parameters
    ----------
    path : str or Path
        ``campaign.toml``, or the folder that holds it.

    Returns
    -------
    Campaign
        Complete: every run has its name, every channel its source. Neither the
        logs nor the fleet need exist.

    Raises
    ------
    MissingFileError
        The file, or the ``runs.csv`` that it names, does not exist.
    CampaignError
        No valid TOML, another schema, an unknown key, a bad value or a contradiction.
        The first line names the first problem and how many more there are.
    """
    path = _campaign_file(Path(path)).absolute()
    raw = _frozen(_read_toml(path))
    _check_schema(path, raw)
    labels: dict[int, str] = {}
    table = raw.get("runs")
    if isinstance(table, str) and table.strip() and "\0" not in table:
        if raw.get("run"):
            raise CampaignError(f"{path}: runs = {table!r} and [[run]] both stand in the file; leave one out")
        raw["run"], labels = read_run_table(WrittenPath.of(table, path.parent).path)
    file = _validated(path, raw, labels)
    campaign = Campaign(
        path=path,
        name=file.name or path.parent.name or path.stem,
        origin=file.origin,
        fleet=file.fleet,
        meta=tuple(_meta_lines(file.meta)),
        channels=file.channel,
        runs=with_names(file.run),
        levels=file.level,
        excludes=file.exclude,
        overrides=file.override,
        analysis=file.analysis,
        calibration=file.calibration,
    )
    problems = contradictions(campaign)
    if problems:
        raise campaign_error(path, problems)
    return campaign

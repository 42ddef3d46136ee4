"""From ``campaign.toml`` to a `Campaign`, or to one message that says what is wrong."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from tdacoustic.campaign.contradictions import contradictions
from tdacoustic.campaign.messages import VOCABULARY, campaign_error, problem_line
from tdacoustic.campaign.model import SCHEMA, Campaign, CampaignFile
from tdacoustic.campaign.run_table import read_run_table
from tdacoustic.campaign.runs import with_names
from tdacoustic.campaign.sensor_table import read_sensor_table, with_sensors
from tdacoustic.campaign.values import WrittenPath
from tdacoustic.errors import CampaignError
from tdacoustic.toml_models import check_schema, file_or_inside, meta_lines, path_problem, read_toml
from tdacoustic.toml_models import frozen as _frozen

__all__ = ["load_campaign"]


def _check_schema(path: Path, raw: dict[str, Any]) -> None:
    check_schema(path, raw, SCHEMA, VOCABULARY, CampaignError)


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
    path = file_or_inside(Path(path), "campaign.toml").absolute()
    raw = _frozen(read_toml(path, CampaignError))
    _check_schema(path, raw)
    labels: dict[int, str] = {}
    table = raw.get("runs")
    if isinstance(table, str) and path_problem(table) is None:
        if raw.get("run"):
            raise CampaignError(f"{path}: runs = {table!r} and [[run]] both stand in the file; leave one out")
        raw["run"], labels = read_run_table(WrittenPath.of(table, path.parent).path)
    file = _validated(path, raw, labels)
    sensors = () if file.sensors is None else read_sensor_table(file.sensors.path)
    campaign = Campaign(
        path=path,
        name=file.name or path.parent.name or path.stem,
        origin=file.origin,
        fleet=file.fleet,
        meta=tuple(meta_lines(file.meta)),
        channels=with_sensors(path, file.channel, sensors, file.sensors),
        run_table=file.runs,
        runs=with_names(file.run),
        levels=file.level,
        excludes=file.exclude,
        overrides=file.override,
        analysis=file.analysis,
        calibration=file.calibration,
        railway=file.railway,
        sensor_table=file.sensors,
        sensors=sensors,
        template=file.template,
    )
    problems = contradictions(campaign)
    if problems:
        raise campaign_error(path, problems)
    return campaign

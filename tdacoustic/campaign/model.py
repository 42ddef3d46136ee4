"""A campaign, checked and complete."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal

from pydantic import Field

from tdacoustic.campaign.calibration import CalibrationSettings
from tdacoustic.campaign.channels import CampaignChannel
from tdacoustic.campaign.judgements import Exclude, Level, Override
from tdacoustic.campaign.railway import RailwaySettings
from tdacoustic.campaign.runs import CampaignRun
from tdacoustic.campaign.settings import AnalysisSettings
from tdacoustic.campaign.values import StatedPath, WrittenPath
from tdacoustic.errors import CampaignError
from tdacoustic.sensors import SensorEntry
from tdacoustic.toml_models import Table, Text

__all__ = ["SCHEMA", "Campaign", "CampaignFile", "Origin"]

SCHEMA: Final = "tdacoustic-campaign/1"
"""What ``schema`` has to say."""

Origin = Literal["measured", "synthetic", "printed"]
"""Where a campaign's numbers come from."""


class CampaignFile(Table):
    """``campaign.toml`` table by table, under the file's own keys (``schema`` is checked before)."""

    name: Text | None = None
    origin: Origin
    fleet: StatedPath | None = None
    runs: StatedPath | None = None
    sensors: StatedPath | None = None
    template: StatedPath | None = None
    meta: dict[str, Any] = Field(default_factory=dict)
    channel: tuple[CampaignChannel, ...] = ()
    run: tuple[CampaignRun, ...] = ()
    level: tuple[Level, ...] = ()
    exclude: tuple[Exclude, ...] = ()
    override: tuple[Override, ...] = ()
    analysis: AnalysisSettings = AnalysisSettings()
    calibration: CalibrationSettings = CalibrationSettings()
    railway: RailwaySettings | None = None


@dataclass(frozen=True)
class Campaign:
    """A campaign: channels, runs, known levels, judgements and settings.

    Parameters
    ----------
    path : Path
        Of ``campaign.toml``, absolute.
    name : str
        Default: the folder's name.
    origin : str
        One of `Origin`.
    fleet : WrittenPath or None
        It need not exist.
    run_table : WrittenPath or None
        The ``runs.csv`` that the runs stand in.
    meta : tuple of (str, str)
        ``[meta]`` in words; keys of nested tables joined by a dot.
    channels : tuple of CampaignChannel
    runs : tuple of CampaignRun
        Of every kind, each with its name.
    levels : tuple of Level
    excludes : tuple of Exclude
    overrides : tuple of Override
    analysis : AnalysisSettings
    calibration : CalibrationSettings
    railway : RailwaySettings or None
        None where the file has no such table.
    sensor_table : WrittenPath or None
        The ``sensors.csv`` that the sensitivities stand in.
    sensors : tuple of SensorEntry
        What it holds.
    template : WrittenPath or None
        Of the report. It need not exist.
    """

    path: Path
    name: str
    origin: Origin
    fleet: WrittenPath | None = None
    run_table: WrittenPath | None = None
    meta: tuple[tuple[str, str], ...] = ()
    channels: tuple[CampaignChannel, ...] = ()
    runs: tuple[CampaignRun, ...] = ()
    levels: tuple[Level, ...] = ()
    excludes: tuple[Exclude, ...] = ()
    overrides: tuple[Override, ...] = ()
    analysis: AnalysisSettings = field(default_factory=AnalysisSettings)
    calibration: CalibrationSettings = field(default_factory=CalibrationSettings)
    railway: RailwaySettings | None = None
    sensor_table: WrittenPath | None = None
    sensors: tuple[SensorEntry, ...] = ()
    template: WrittenPath | None = None

    @property
    def folder(self) -> Path:
        """The folder that paths of the campaign are relative to."""
        return self.path.parent

    @property
    def asks_for_railway(self) -> bool:
        """Whether a key of the railway standards stands in the file; without any, nothing is done about them."""
        placed = any(channel.place is not None for channel in self.channels)
        return self.railway is not None or placed or any(run.test is not None for run in self.runs)

    def test_runs(self) -> tuple[CampaignRun, ...]:
        """Runs of kind ``test``, rejected ones too."""
        return tuple(run for run in self.runs if run.kind == "test")

    def background_runs(self) -> tuple[CampaignRun, ...]:
        """Runs of kind ``background``, rejected ones too."""
        return tuple(run for run in self.runs if run.kind == "background")

    def conditions(self) -> tuple[str, ...]:
        """Conditions in order of appearance: those of test runs, then those that only ``[[level]]`` names."""
        of_runs = [run.condition for run in self.test_runs() if run.condition is not None]
        return tuple(dict.fromkeys([*of_runs, *(level.condition for level in self.levels)]))

    def channel(self, name: str) -> CampaignChannel:
        """Return the channel of that name.

        Raises
        ------
        CampaignError
            There is none.
        """
        for channel in self.channels:
            if channel.name == name:
                return channel
        names = ", ".join(channel.name for channel in self.channels) or "none"
        raise CampaignError(f"{self.path}: no channel {name!r}; there are {names}")

    def run(self, name: str) -> CampaignRun:
        """Return the run of that name.

        Raises
        ------
        CampaignError
            There is none.
        """
        for run in self.runs:
            if run.name == name:
                return run
        raise CampaignError(f"{self.path}: no run {name!r}; there are {', '.join(r.name for r in self.runs) or 'none'}")

    @property
    def settings(self) -> dict[str, Any]:
        """Every setting with its value, under keys such as ``analysis.overlap``, for the report."""
        tables: dict[str, Table] = {"analysis": self.analysis, "calibration": self.calibration}
        if self.asks_for_railway:
            tables["railway"] = self.railway or RailwaySettings()
        return {f"{name}.{key}": _plain(value) for name, table in tables.items() for key, value in table}


def _plain(value: Any) -> Any:
    """A setting as numbers and texts; a table in words."""
    if isinstance(value, tuple):
        return tuple(_plain(entry) for entry in value)
    if isinstance(value, Table):
        return ", ".join(f"{key} = {entry}" for key, entry in value if entry is not None)
    return str(value) if isinstance(value, WrittenPath) else value

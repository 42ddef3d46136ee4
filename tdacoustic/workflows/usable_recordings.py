"""Which recordings of a campaign may feed a calibration, and how well each knows its own level."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Final, TypeAlias

if TYPE_CHECKING:
    from tdacoustic.campaign import Campaign
    from tdacoustic.measured import Survey
    from tdacoustic.measured.runs import MeasuredRun
    from tdacoustic.recording import Channel
    from tdacoustic.results import Analysis
    from tdacoustic.steps import Store, Task

__all__ = ["NEAR", "SURFACE_M", "UsableRecordings", "WantedScatter"]

SURFACE_M: Final = 4.0
NEAR: Final = 0.05
"""A receiver whose distance differs by no more from 4 m belongs to the 4 m level; others are not moved there."""

WantedScatter: TypeAlias = "tuple[str, str, tuple[float, float] | None]"
"""Run, channel and band (all of the record where None) of a level."""


@dataclass(frozen=True)
class UsableRecordings:
    """The valid test runs of an analysed campaign, and their microphones that are in order.

    Parameters
    ----------
    campaign : Campaign
    analysis : Analysis
    store : Store or None
        In which the analysis was made: it holds the powers of the runs' segments.
    level_sigma_db : float
        Standard deviation of a level that instruments and their calibration leave open.
    """

    campaign: Campaign
    analysis: Analysis
    store: Store | None
    level_sigma_db: float
    _kept: dict[str, Survey | None] = field(default_factory=dict, compare=False, repr=False)

    @cached_property
    def runs(self) -> tuple[MeasuredRun, ...]:
        """Valid test runs that were measured."""
        held = (run for run in self.analysis.runs if run.run.kind == "test" and run.run.valid)
        return tuple(run for run in held if run.measurement is not None and run.recording is not None)

    @property
    def steady(self) -> dict[str, MeasuredRun]:
        """Runs at one speed, by name."""
        return {run.name: run for run in self.runs if run.measurement is not None and run.measurement.steady}

    @property
    def run_ups(self) -> tuple[MeasuredRun, ...]:
        """Runs whose speed is known and not constant."""
        return tuple(run for run in self.runs if run.measurement is not None and not run.measurement.steady)

    @cached_property
    def bad(self) -> Mapping[tuple[str, str], str]:
        """What is bad, in words, by run and channel; the whole run where the channel is empty."""
        table = self.analysis.tables["quality"]
        rows = table[table["verdict"] == "bad"]
        names = {run.name for run in self.runs}
        found: dict[tuple[str, str], str] = {}
        for row in rows.itertuples():
            if row.run in names:
                found.setdefault((row.run, row.channel or ""), f"{row.check}, {row.detail}")
        return found

    def is_bad(self, run: str, channel: str) -> bool:
        """Whether a verdict of ``quality.csv`` is against a channel of a run."""
        return (run, channel) in self.bad or (run, "") in self.bad

    def is_excluded(self, condition: str, channel: str, band_hz: tuple[float, float]) -> bool:
        """Whether an ``[[exclude]]`` of the campaign touches a band of a channel in a condition."""
        return any(
            exclude.condition == condition
            and exclude.channel in (None, channel)
            and exclude.frequency_hz[0] < band_hz[1]
            and exclude.frequency_hz[1] > band_hz[0]
            for exclude in self.campaign.excludes
        )

    def doubts_of(self, channels: Iterable[str]) -> Iterator[str]:
        """Yield what is bad about channels that would have fed the calibration."""
        wanted = {"", *channels}
        for (run, channel), words in self.bad.items():
            if channel in wanted:
                what = f"channel {channel}" if channel else "all of it"
                yield f"run {run}, {what}: bad ({words}); its levels do not feed the calibration"

    def calibrator_doubts(self, channels: Iterable[str]) -> Iterator[str]:
        """Yield what calibrators find doubtful about channels whose levels feed the calibration all the same."""
        from tdacoustic.measured.run_sensors import CALIBRATION

        wanted = set(channels)
        said = {
            (verdict.channel, verdict.detail): None
            for run in self.runs
            for verdict in run.verdicts
            if verdict.check == CALIBRATION and verdict.verdict != "ok" and not self.is_bad(run.name, verdict.channel)
        }
        for channel, words in said:
            if channel in wanted:
                yield f"channel {channel}: doubtful by calibrator ({words}); its levels feed the calibration"

    @property
    def microphones(self) -> dict[str, Channel]:
        """Microphones for the noise (of role receiver, or of none), by name."""
        channels = [channel for run in self.runs if run.recording is not None for channel in run.recording.channels]
        return {
            channel.name: channel
            for channel in channels
            if channel.quantity == "sound_pressure" and channel.role in (None, "receiver")
        }

    @property
    def near(self) -> tuple[str, ...]:
        """Microphones within 5 % of 4 m."""

        def is_near(channel: Channel) -> bool:
            distance_m = channel.distance_m
            if distance_m is None and channel.position_m is not None:
                distance_m = math.hypot(*channel.position_m)
            return distance_m is not None and abs(distance_m - SURFACE_M) <= NEAR * SURFACE_M

        return tuple(name for name, channel in self.microphones.items() if is_near(channel))

    @cached_property
    def _tasks(self) -> Mapping[str, Task]:
        """The survey of each run that could be read."""
        from tdacoustic.steps import Task
        from tdacoustic.workflows.runs import prepare_runs

        prepared = prepare_runs(self.campaign, self.store) if self.runs and self.store is not None else ()
        surveys = {item.run.name: item.measurement.inputs["survey"] for item in prepared if item.measurement}
        return {name: survey for name, survey in surveys.items() if isinstance(survey, Task)}

    def survey(self, run: str) -> Survey | None:
        """Return the survey of a run, or None where no store (any longer) has it; the last one is kept."""
        from tdacoustic.measured import Survey

        if run not in self._kept:
            self._kept.clear()
            task = self._tasks.get(run)
            try:
                found = None if task is None or self.store is None else self.store.load(task.key)
            except KeyError:
                found = None
            self._kept[run] = found if isinstance(found, Survey) else None
        return self._kept[run]

    def record_sigmas_db(self, wanted: Iterable[WantedScatter]) -> dict[WantedScatter, float]:
        """Return the standard errors of levels that their own records show, where they do.

        Parameters
        ----------
        wanted : iterable of (str, str, (float, float) or None)
        """
        from tdacoustic.measured.record_scatter import record_sigma_db

        found = {}
        for item in sorted(wanted, key=lambda item: item[0]):
            run, channel, band_hz = item
            survey = self.survey(run)
            raster, index = survey.of_channel(channel) if survey is not None else (None, 0)
            if raster is not None and raster.powers is not None:
                powers = raster.powers
                resolution_hz = powers.plan.resolution_hz
                sigma_db = record_sigma_db(powers.density[index], powers.frames[index], resolution_hz, band_hz)
                if sigma_db is not None:
                    found[item] = sigma_db
        return found

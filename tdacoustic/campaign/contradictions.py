"""Where the tables of a campaign, each right in itself, contradict each other."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from tdacoustic.campaign.channels import CampaignChannel
from tdacoustic.campaign.model import Campaign
from tdacoustic.campaign.railway import railway_contradictions
from tdacoustic.campaign.runs import CampaignRun
from tdacoustic.toml_models import nearest

__all__ = ["MAX_SPEED_RATIO", "contradictions"]

MAX_SPEED_RATIO: Final = 1.05
"""Speeds of the runs of one condition may differ by this factor."""

_SPEED_KEYS: Final = ("train_speed_km_h", "motor_speed_rpm")


def contradictions(campaign: Campaign) -> tuple[str, ...]:
    """Return every contradiction of a campaign, one line each; none is good.

    Parameters
    ----------
    campaign : Campaign

    Returns
    -------
    tuple of str
        In the order of the file's tables.
    """
    return (
        *_emptiness(campaign),
        *_channel_contradictions(campaign.channels),
        *_run_contradictions(campaign.runs),
        *_calibrated_contradictions(campaign),
        *_speed_contradictions(campaign),
        *railway_contradictions(campaign.channels, campaign.runs, campaign.railway),
        *_level_contradictions(campaign),
        *_judgement_contradictions(campaign),
    )


def _emptiness(campaign: Campaign) -> Iterator[str]:
    if not campaign.levels and not campaign.test_runs():
        kinds = ", ".join(dict.fromkeys(run.kind for run in campaign.runs))
        found = f"all runs are of kind {kinds}" if campaign.runs else "there is no [[run]], no runs = ..., no [[level]]"
        yield f"nothing was measured: {found}; add a [[run]] of kind 'test' or a [[level]]"
    if campaign.runs and not campaign.channels:
        yield "there are runs but no [[channel]]; add one for each signal that is of use"


def _channel_contradictions(channels: Sequence[CampaignChannel]) -> Iterator[str]:
    for index, channel in enumerate(channels):
        for other_index, other in enumerate(channels[:index]):
            if channel.name == other.name:
                yield f"channel {channel.name!r}: the name stands twice, [[channel]] {other_index + 1} and {index + 1}"
            elif (channel.source, channel.log, channel.drive) == (other.source, other.log, other.drive):
                yield f"channels {other.name!r} and {channel.name!r} have the same source {channel.source!r}"


def _cut_in_words(run: CampaignRun) -> str:
    end = "the end" if run.end_s is None else f"{run.end_s:g} s"
    return f"{run.start_s or 0.0:g} s to {end}"


def _run_contradictions(runs: Sequence[CampaignRun]) -> Iterator[str]:
    for index, run in enumerate(runs):
        for other_index, other in enumerate(runs[:index]):
            if run.name == other.name:
                yield f"run {run.name!r}: the name stands twice, in run {other_index + 1} and {index + 1}"
            elif run.valid and other.valid and _same_data(run, other):
                logs = ", ".join(log.text for log in run.logs)
                yield f"runs {other.name!r} and {run.name!r} have the same data: {logs}, {_cut_in_words(run)}"


def _calibrated_contradictions(campaign: Campaign) -> Iterator[str]:
    names = [channel.name for channel in campaign.channels]
    for run in campaign.runs:
        for name in run.calibrated:
            if name not in names:
                said = f"run {run.name!r}: calibrated names channel {name!r}, which is not there"
                yield f"{said}; the nearest is {nearest(name, names)!r}"


def _same_data(run: CampaignRun, other: CampaignRun) -> bool:
    paths, other_paths = ({log.path for log in r.logs} for r in (run, other))
    return paths == other_paths and (run.start_s or 0.0, run.end_s) == (other.start_s or 0.0, other.end_s)


def _speed_contradictions(campaign: Campaign) -> Iterator[str]:
    for condition in campaign.conditions():
        runs = [run for run in campaign.test_runs() if run.condition == condition and run.valid]
        for key in _SPEED_KEYS:
            speeds = sorted((getattr(run, key), run.name) for run in runs if getattr(run, key) is not None)
            if not speeds:
                continue
            (low, slow), (high, fast) = speeds[0], speeds[-1]
            if high > low * MAX_SPEED_RATIO * (1.0 + 1e-9):
                yield (
                    f"condition {condition!r}: runs {slow!r} and {fast!r} differ in {key} by more than 5 %: "
                    f"{low:g} and {high:g}; give them conditions of their own"
                )


def _level_contradictions(campaign: Campaign) -> Iterator[str]:
    for index, level in enumerate(campaign.levels):
        for other_index, other in enumerate(campaign.levels[:index]):
            if level.model_dump(exclude={"origin"}) == other.model_dump(exclude={"origin"}):
                yield f"level {index + 1} (condition {level.condition!r}): the same as level {other_index + 1}"


def _judgement_contradictions(campaign: Campaign) -> Iterator[str]:
    conditions = campaign.conditions()
    known = ", ".join(conditions) or "none"
    channels = [channel.name for channel in campaign.channels]
    for index, exclude in enumerate(campaign.excludes, 1):
        if exclude.condition not in conditions:
            yield f"exclude {index}: no condition {exclude.condition!r}; there are {known}"
        if exclude.channel is not None and exclude.channel not in channels:
            yield f"exclude {index}: no channel {exclude.channel!r}; there are {', '.join(channels) or 'none'}"
    for index, override in enumerate(campaign.overrides, 1):
        if override.condition not in conditions:
            yield f"override {index}: no condition {override.condition!r}; there are {known}"
        for other in campaign.overrides[: index - 1]:
            same_line = (other.condition, other.frequency_hz) == (override.condition, override.frequency_hz)
            if same_line and other.source != override.source:
                yield (
                    f"override {index}: {override.frequency_hz:g} Hz of condition {override.condition!r} "
                    f"is given to {other.source!r} and to {override.source!r}"
                )

"""What the railway standards ask of a campaign: ``[railway]``, and the keys of channels and runs that belong to it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Final, Literal

from pydantic import AfterValidator, Field

from tdacoustic.toml_models import Positive, Table, each_once

if TYPE_CHECKING:
    from tdacoustic.campaign.channels import CampaignChannel
    from tdacoustic.campaign.runs import CampaignRun

__all__ = [
    "Place",
    "RailwaySettings",
    "RailwayStandard",
    "RailwayTest",
    "passage_problem",
    "place_problem",
    "railway_contradictions",
]

Place = Literal["wayside", "vehicle", "interior"]
"""Where a microphone is: beside the track, outside on the vehicle, inside."""

RailwayTest = Literal["pass-by", "stationary", "starting", "braking", "constant-speed"]
"""What a run is a test of."""

RailwayStandard = Literal["ISO 3095:2013", "ISO 3095:2025", "ISO 3381:2021"]
"""Editions whose quantities can be had."""

INSIDE: Final = frozenset({"ISO 3381:2021"})
"""Standards whose microphones are in the vehicle."""

MIDWAY: Final = 0.1
"""Part of the passage by which its middle may lie beside the mean of front and rear: at 5 % of speed a train's middle
is off by less [assumed]."""


class RailwaySettings(Table):
    """``[railway]``.

    Parameters
    ----------
    standards : tuple of str
        Out of `RailwayStandard`.
    unit_length_m : float or None
        Of the unit under test, over buffers: with one instant and the speed it gives the time of passing.
    reference_track : bool or None
        Whether rail roughness and decay rates were shown to meet the reference track's.
    """

    standards: Annotated[tuple[RailwayStandard, ...], AfterValidator(each_once), Field(min_length=1)] = (
        "ISO 3095:2013",
        "ISO 3381:2021",
    )
    unit_length_m: Positive | None = None
    reference_track: bool | None = None


def place_problem(channel: CampaignChannel, quantity: str | None) -> str | None:
    """Return what contradicts itself in a channel's keys, or None.

    Parameters
    ----------
    channel : CampaignChannel
    quantity : str or None
        As stated or implied.
    """
    keys = ("place", "height_above_floor_m", "stands_for_m")
    given = next((key for key in keys if getattr(channel, key) is not None), None)
    if given is not None and quantity not in (None, "sound_pressure"):
        return f"{given} = {getattr(channel, given)!r} is of a microphone, but quantity is {quantity!r}"
    if channel.height_above_floor_m is not None and channel.place != "interior":
        return f"height_above_floor_m is of place = 'interior', but place is {_said(channel.place)}"
    if channel.stands_for_m is not None and channel.place != "wayside":
        return f"stands_for_m is of place = 'wayside', but place is {_said(channel.place)}"
    return None


def _said(value: str | None) -> str:
    return "missing" if value is None else repr(value)


def passage_problem(run: CampaignRun) -> str | None:
    """Return what contradicts itself in a run's keys, or None."""
    if run.test is not None and run.kind != "test":
        return f"test = {run.test!r} is of a run of kind 'test', but kind is {run.kind!r}"
    given = [(key, getattr(run, key)) for key in ("front_s", "middle_s", "rear_s") if getattr(run, key) is not None]
    if given and run.test != "pass-by":
        return f"{given[0][0]} is of test = 'pass-by', but test is {_said(run.test)}"
    for (key, instant), (later, after) in pairwise(given):
        if not instant < after:
            return f"{later} must be > {key} = {instant:g}, got {after:g}"
    for key, instant in given:
        if run.start_s is not None and instant < run.start_s:
            return f"{key} = {instant:g} lies before start_s = {run.start_s:g}, which cuts it off"
        if run.end_s is not None and instant > run.end_s:
            return f"{key} = {instant:g} lies behind end_s = {run.end_s:g}, which cuts it off"
    if run.front_s is not None and run.middle_s is not None and run.rear_s is not None:
        midway = 0.5 * (run.front_s + run.rear_s)
        if abs(run.middle_s - midway) > MIDWAY * (run.rear_s - run.front_s):
            return (
                f"middle_s = {run.middle_s:g} does not lie midway between front_s = {run.front_s:g} and "
                f"rear_s = {run.rear_s:g}, which is {midway:g}"
            )
    return _speed_problem(run)


def _speed_problem(run: CampaignRun) -> str | None:
    for key in ("train_speed_km_h", "motor_speed_rpm"):
        speed = getattr(run, key)
        if speed is None or run.test is None:
            continue
        if run.test == "stationary" and speed > 0.0:
            return f"test = 'stationary' contradicts {key} = {speed:g}"
        if run.test in ("pass-by", "constant-speed") and speed == 0.0:
            return f"test = {run.test!r} contradicts {key} = 0"
    return None


def railway_contradictions(
    channels: Sequence[CampaignChannel], runs: Sequence[CampaignRun], settings: RailwaySettings | None
) -> Iterator[str]:
    """Yield what contradicts itself among the tables."""
    standards = (settings or RailwaySettings()).standards
    outside, inside = bool(set(standards) - INSIDE), bool(set(standards) & INSIDE)
    named = f"but [railway] standards names {', '.join(standards)} alone"
    for run in runs:
        if run.test == "pass-by" and not outside:
            yield f"run {run.name!r}: test = 'pass-by' is of ISO 3095, {named}"
        if run.test == "constant-speed" and not inside:
            yield f"run {run.name!r}: test = 'constant-speed' is of ISO 3381, {named}"
    for channel in channels:
        if channel.place == "interior" and not inside:
            yield f"channel {channel.name!r}: place = 'interior' is of ISO 3381, {named}"
        if channel.place == "wayside" and not outside:
            yield f"channel {channel.name!r}: place = 'wayside' is of ISO 3095, {named}"

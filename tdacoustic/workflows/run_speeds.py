"""The speeds of a campaign's runs against each other: verdicts, slip, tables, and what could not be had."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd

    from tdacoustic.attribution import RunSlip
    from tdacoustic.campaign import Campaign
    from tdacoustic.fleet import Fleet, Kinematics
    from tdacoustic.measured.runs import MeasuredRun
    from tdacoustic.workflows.runs import PreparedRun

__all__ = ["check_speeds", "drives_of", "slips_of", "speed_frames", "speed_problems"]


def drives_of(runs: Sequence[MeasuredRun], fleet: Fleet | None) -> dict[str, Kinematics]:
    """Return the kinematics of each run, its wheels as worn as it states; empty without a fleet."""
    if fleet is None:
        return {}
    from tdacoustic.fleet import Kinematics

    return {run.name: Kinematics.of(fleet, run.run.wheel_diameter_mm) for run in runs}


def check_speeds(runs: Sequence[MeasuredRun], fleet: Fleet | None) -> tuple[MeasuredRun, ...]:
    """Return the runs with a verdict on each speed that another one contradicts."""
    from tdacoustic.attribution import check_tachos

    drives = drives_of(runs, fleet)
    return tuple(
        replace(run, verdicts=(*run.verdicts, *check_tachos(run, drives.get(run.name))))
        if run.measurement is not None
        else run
        for run in runs
    )


def slips_of(runs: Sequence[MeasuredRun], fleet: Fleet | None) -> dict[str, tuple[RunSlip, ...]]:
    """Return the slip of the test runs that have several speeds."""
    from tdacoustic.attribution import run_slips

    drives = drives_of(runs, fleet)
    tested = (run for run in runs if run.run.kind == "test" and run.measurement is not None)
    found = {run.name: run_slips(run, drives.get(run.name)) for run in tested}
    return {name: items for name, items in found.items() if items}


def speed_frames(
    runs: Sequence[MeasuredRun], fleet: Fleet | None, slips: Mapping[str, tuple[RunSlip, ...]]
) -> dict[str, pd.DataFrame]:
    """Return the tables on speed."""
    from tdacoustic.tables.speeds import speed_tables

    return speed_tables(runs, slips, drives_of(runs, fleet))


def speed_problems(campaign: Campaign, prepared: Sequence[PreparedRun], runs: Sequence[MeasuredRun]) -> tuple[str, ...]:
    """Return the runs whose speed was sought in lines and not found, one line each."""
    found = []
    if campaign.analysis.speed_from == "lines":
        found += [
            f"run {item.run.name!r}: its speed is not read from lines: {item.no_lines}"
            for item in prepared
            if item.no_lines is not None
        ]
    for run in runs:
        lines = None if run.measurement is None else run.measurement.speed.lines
        if run.measurement is not None and lines is not None and lines.reason is not None:
            known = (
                "is not known" if not run.measurement.speed.profiles else "was not found in lines beside its channels"
            )
            found.append(f"run {run.name!r}: its speed {known}: {lines.reason}")
    return tuple(found)

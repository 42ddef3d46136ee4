"""Scales of channels from a sensor database and from calibrators recorded before and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from tdacoustic.measured.run_sensors import CALIBRATION, CampaignSensors, DatabaseUse
from tdacoustic.quality import Verdict
from tdacoustic.sensors import series_of
from tdacoustic.units import QUANTITY_SI_SYMBOL

if TYPE_CHECKING:
    from tdacoustic.campaign import Campaign
    from tdacoustic.sensors.calibrator_check import CalibratorCheck
    from tdacoustic.sensors.channel_calibration import ChannelCalibration
    from tdacoustic.steps import Jobs, Progress, Record, Store
    from tdacoustic.workflows.calibrator_readings import Scales
    from tdacoustic.workflows.clocks import CampaignClocks
    from tdacoustic.workflows.scanned_runs import ScannedRun

__all__ = ["campaign_sensors"]


def campaign_sensors(
    campaign: Campaign,
    scanned: Sequence[ScannedRun],
    clocks: CampaignClocks,
    store: Store,
    n_jobs: Jobs | None = None,
    progress: Progress | None = None,
) -> tuple[CampaignSensors, Mapping[str, Record]]:
    """Find out the scales that do not stand in the campaign, and check those that do.

    Parameters
    ----------
    campaign : Campaign
    scanned : sequence of ScannedRun
        All its valid runs: series of calibrations are counted over them.
    clocks : CampaignClocks
        How the logs of its runs lie on one axis: calibrators are read on it.
    store : Store
    n_jobs : int or Executor, optional
        Processes; default 1.
    progress : callable, optional

    Returns
    -------
    CampaignSensors
        Empty where the campaign has neither calibrator runs nor sensors of a database.
    mapping of str to Record
        By key, of the steps that were needed.
    """
    asked = any(item.run.is_calibration for item in scanned) or any(channel.sensor for channel in campaign.channels)
    if not asked:
        return CampaignSensors(), {}
    from tdacoustic.workflows.calibrator_readings import read_calibrators
    from tdacoustic.workflows.sensor_database import database_scales

    series = series_of([item.run.kind for item in scanned])
    of_runs = {item.run.name: number for item, number in zip(scanned, series, strict=True)}
    database, scales = database_scales(campaign, scanned)
    read = read_calibrators(campaign, scanned, of_runs, clocks, scales, store, (n_jobs or 1, progress))
    calibrations = _calibrations(read.checks, campaign.analysis.calibrators == "set")
    problems = [problem for item in scanned for problem in item.problems]
    found = CampaignSensors(
        scales=_with_calibrated(scales, calibrations, of_runs),
        calibrations=calibrations,
        database=database,
        verdicts=_verdicts(scanned, database, calibrations, of_runs),
        problems=(*problems, *read.problems, *_warnings(calibrations)),
    )
    return found, read.records


def _calibrations(checks: Sequence[CalibratorCheck], override: bool) -> tuple[ChannelCalibration, ...]:
    from tdacoustic.sensors.channel_calibration import calibrate_channel

    groups: dict[tuple[int, str], list[CalibratorCheck]] = {}
    for check in checks:
        groups.setdefault((check.run.series, check.scale.channel), []).append(check)
    return tuple(calibrate_channel(group, override) for group in groups.values())


def _with_calibrated(scales: Scales, found: Sequence[ChannelCalibration], of_runs: Mapping[str, int]) -> Scales:
    """Add the scales that calibrators set, in the runs of their series."""
    from tdacoustic.ingest.known_scale import CalibratedScale, KnownScale

    made = {run: dict(held) for run, held in scales.items()}
    for item in found:
        calibrator = next((check.run.calibrator for check in item.checks if check.counts), None)
        if item.action != "set" or calibrator is None or item.scale.si_per_unit is None:
            continue
        quantity = calibrator.quantity
        scale = CalibratedScale(quantity, QUANTITY_SI_SYMBOL[quantity], item.scale.unit, item.scale.si_per_unit)
        for run, series in of_runs.items():
            if series == item.series:
                made.setdefault(run, {})[item.channel] = KnownScale(item.scale.words, calibrated=scale)
    return made


def _verdicts(
    scanned: Sequence[ScannedRun],
    database: Sequence[DatabaseUse],
    calibrations: Sequence[ChannelCalibration],
    of_runs: Mapping[str, int],
) -> dict[str, tuple[Verdict, ...]]:
    """Verdicts by run: of each reading in its own run, of the channel in every run of the series."""
    found: dict[str, list[Verdict]] = {}
    for use in database:
        for run in use.runs:
            for doubt in use.doubts:
                found.setdefault(run, []).append(Verdict(use.channel, "sensor", "warning", doubt))
    for item in calibrations:
        for check in item.checks:
            verdict = Verdict(item.channel, "calibrator", check.verdict, check.reason)
            found.setdefault(check.run.name, []).append(verdict)
        if item.action == "reported" and item.verdict == "ok":
            continue  # nothing was stated that could be checked
        for scan in scanned:
            if of_runs[scan.run.name] == item.series and not scan.run.is_calibration:
                found.setdefault(scan.run.name, []).append(
                    Verdict(item.channel, CALIBRATION, item.verdict, item.reason)
                )
    return {run: tuple(verdicts) for run, verdicts in found.items()}


def _warnings(calibrations: Sequence[ChannelCalibration]) -> list[str]:
    several = len({item.series for item in calibrations}) > 1
    return [
        f"channel {item.channel!r}{f', series {item.series}' if several else ''}: {item.reason}"
        for item in calibrations
        if item.verdict != "ok" or item.action == "reported"
    ]

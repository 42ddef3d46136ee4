"""Scales of channels from a sensor database and from calibrators recorded before and after."""

from __future__ import annotations

import datetime
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

from tdacoustic.errors import CampaignError, TdacousticError, UnitError
from tdacoustic.measured.run_sensors import CALIBRATION, CampaignSensors, DatabaseUse
from tdacoustic.quality import Verdict
from tdacoustic.sensors import USUAL_FREQUENCIES_HZ, parse_calibrator, series_of
from tdacoustic.units import QUANTITY_SI_SYMBOL, quantity_of_unit

if TYPE_CHECKING:
    from tdacoustic.campaign import Campaign, CampaignChannel, CampaignRun
    from tdacoustic.ingest.known_scale import KnownScale
    from tdacoustic.measured.calibrator_step import CalibratorReadings
    from tdacoustic.recording import Channel, Log, LogChannel
    from tdacoustic.sensors.checking import CalibratorCheck, CalibratorRun, ChannelCalibration, ChannelScale
    from tdacoustic.steps import Jobs, Progress, Record, Store, Task

__all__ = ["campaign_sensors"]


@dataclass(frozen=True)
class Scanned:
    """A run with its logs, scanned."""

    run: CampaignRun
    logs: tuple[Log, ...]

    def source(self, channel: CampaignChannel) -> tuple[int, int, LogChannel] | None:
        """Return log, column and source of a channel; None where the run does not have it."""
        from tdacoustic.ingest.sources import NotFoundError, find_source

        try:
            found = find_source(channel, self.logs)
        except (NotFoundError, CampaignError):
            return None  # said where the run is bound
        return found.log_index, found.column, self.logs[found.log_index].channels[found.column]

    @property
    def date(self) -> datetime.date | None:
        """Day of the run: as the campaign says, else the first of its logs' starts."""
        if self.run.date is not None:
            return datetime.date.fromisoformat(self.run.date)
        starts = sorted(log.start_time[:10] for log in self.logs if log.start_time)
        try:
            return datetime.date.fromisoformat(starts[0]) if starts else None
        except ValueError:
            return None


PASSING_S: Final = 0.5
"""For how long a calibrator's tone has to stand out for being said to be too short [assumed]."""

Scales = Mapping[str, Mapping[str, "KnownScale"]]
"""By run, then by channel."""


def campaign_sensors(
    campaign: Campaign, store: Store, n_jobs: Jobs | None = None, progress: Progress | None = None
) -> tuple[CampaignSensors, Mapping[str, Record]]:
    """Find out the scales that do not stand in the campaign, and check those that do.

    Parameters
    ----------
    campaign : Campaign
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
    runs = [run for run in campaign.runs if run.valid]
    asked = any(run.is_calibration for run in runs) or any(channel.sensor for channel in campaign.channels)
    if not asked:
        return CampaignSensors(), {}
    from tdacoustic.workflows.sensor_database import database_scales

    scanned = _scanned(runs)
    database, scales = database_scales(campaign, scanned)
    tasks = _tasks(campaign, scanned, store)
    checks, records, problems = _checks(campaign, scanned, tasks, scales, store, (n_jobs or 1, progress))
    calibrations = _calibrations(checks, campaign.analysis.calibrators == "set")
    series = series_of([item.run.kind for item in scanned])
    of_runs = {item.run.name: number for item, number in zip(scanned, series, strict=True)}
    found = CampaignSensors(
        scales=_with_calibrated(scales, calibrations, of_runs),
        calibrations=calibrations,
        database=database,
        verdicts=_verdicts(scanned, database, calibrations, of_runs),
        problems=(*problems, *_warnings(calibrations)),
    )
    return found, records


def _scanned(runs: Sequence[CampaignRun]) -> list[Scanned]:
    from tdacoustic.formats import scan

    found = []
    for run in runs:
        try:
            found.append(Scanned(run, tuple(scan(log.path) for log in run.logs)))
        except TdacousticError:
            continue  # said where the run is bound
    return found


# ---------------------------------------------------------------- reading


def _calibrator_run(run: CampaignRun, series: int) -> CalibratorRun:
    from tdacoustic.sensors.checking import CalibratorRun

    calibrator = None if run.calibrator is None else parse_calibrator(run.calibrator)
    kind: Literal["before", "after"] = "before" if run.kind == "calibration_before" else "after"
    return CalibratorRun(run.name, kind, series, calibrator, run.calibrator_frequency_hz)


def _tasks(campaign: Campaign, scanned: Sequence[Scanned], store: Store) -> dict[str, Task]:
    """By calibrator run, the task that reads its tone in every channel that the calibrator may have been put on."""
    from tdacoustic.measured.calibrator_step import CALIBRATOR, CalibratorSettings
    from tdacoustic.workflows.fetched_logs import hashed_logs

    found = {}
    for item in scanned:
        if not item.run.is_calibration:
            continue
        channels = tuple(_candidates(campaign, item))
        wanted = _calibrator_run(item.run, 1).wanted_hz or tuple(sorted({*sum(USUAL_FREQUENCIES_HZ.values(), ())}))
        if channels:
            settings = CalibratorSettings(channels, wanted)
            found[item.run.name] = CALIBRATOR.task(
                f"run {item.run.name}", settings, logs=hashed_logs(item.run, item.logs, store)
            )
    return found


def _candidates(campaign: Campaign, item: Scanned) -> Iterator[Channel]:
    from tdacoustic.ingest.cut import cut_raster
    from tdacoustic.recording import Channel

    run = item.run
    calibrator = None if run.calibrator is None else parse_calibrator(run.calibrator)
    possible = tuple(USUAL_FREQUENCIES_HZ) if calibrator is None else (calibrator.quantity,)
    for channel in campaign.channels:
        place = item.source(channel)
        if place is None or (run.calibrated and channel.name not in run.calibrated):
            continue
        log_index, column, source = place
        if not run.calibrated and _quantity(channel, source) not in possible:
            continue
        rate = source.raster.sample_rate_hz or run.sample_rate_hz
        if rate is None:
            continue
        cut = cut_raster(source.raster, rate, run.start_s, run.end_s)
        yield Channel(
            name=channel.name,
            quantity="other",
            si_symbol="1",
            log_index=log_index,
            column=column,
            sample_rate_hz=rate,
            start_sample=cut.start_sample,
            n_samples=cut.n_samples,
            start_s=cut.start_s,
            limits=source.limits,
        )


def _quantity(channel: CampaignChannel, source: LogChannel) -> str | None:
    return channel.scale.stated_quantity() or source.quantity or quantity_of_unit(source.unit)


Execution = tuple["Jobs", "Progress | None"]


def _checks(
    campaign: Campaign,
    scanned: Sequence[Scanned],
    tasks: Mapping[str, Task],
    scales: Scales,
    store: Store,
    execution: Execution,
) -> tuple[list[CalibratorCheck], dict[str, Record], list[str]]:
    """What each calibrator run says of each of its channels."""
    from tdacoustic.steps import execute, lineage, result_of

    outcome = execute(list(tasks.values()), store, *execution)
    series = series_of([item.run.kind for item in scanned])
    checks: list[CalibratorCheck] = []
    records: dict[str, Record] = {}
    problems: list[str] = []
    for item, number in zip(scanned, series, strict=True):
        if not item.run.is_calibration:
            continue
        task = tasks.get(item.run.name)
        if task is None:
            problems.append(f"calibrator run {item.run.name!r}: none of its channels can have been calibrated")
            continue
        if task.key in outcome.failed:
            problems.append(f"calibrator run {item.run.name!r} cannot be read: {outcome.failed[task.key]}")
            continue
        readings: CalibratorReadings = result_of(task, store)
        records.update(lineage(task, store))
        run = _calibrator_run(item.run, number)
        made, unheard = _channel_checks(campaign, item, run, readings, scales)
        problems += unheard
        if not made:
            problems.append(f"calibrator run {item.run.name!r}: in none of its channels does a steady tone stand out")
        checks += made
    return checks, records, problems


def _channel_checks(
    campaign: Campaign, item: Scanned, run: CalibratorRun, readings: CalibratorReadings, scales: Scales
) -> tuple[list[CalibratorCheck], list[str]]:
    """What a run says of each channel that the calibrator was on, and which channels only heard it."""
    from tdacoustic.sensors.checking import check_tone
    from tdacoustic.sensors.crosstalk import own_tones

    held = [
        (_stated_scale(campaign.channel(reading.channel), item, run, scales), reading) for reading in readings.readings
    ]
    own, heard = own_tones(held)
    checks, said = [], []
    for (scale, reading), left in zip(held, own, strict=True):
        if scale.channel not in heard or item.run.calibrated:
            used = reading if scale.channel in heard else left
            if item.run.calibrated or used.plateaus or used.stood_out_s >= PASSING_S:
                checks.append(check_tone(run, scale, used))
            continue
        other, weaker_db = heard[scale.channel]
        said.append(
            f"calibrator run {run.name!r}: {scale.channel!r} shows the tone of {other!r} at the same time, "
            f"{weaker_db:.0f} dB weaker: it is taken only to hear it; if not, name it in calibrated = [...]"
        )
    return checks if item.run.calibrated else _of_calibrator(checks), said


def _stated_scale(channel: CampaignChannel, item: Scanned, run: CalibratorRun, scales: Scales) -> ChannelScale:
    """What the channel's numbers are, as far as campaign, log and sensor database say."""
    from tdacoustic.ingest.conversion import convert
    from tdacoustic.ingest.known_scale import number_unit
    from tdacoustic.sensors.checking import ChannelScale

    place = item.source(channel)
    assert place is not None
    source = place[2]
    known = scales.get(item.run.name, {}).get(channel.name)
    numbers = number_unit(source, channel.scale)
    possible = tuple(USUAL_FREQUENCIES_HZ) if run.calibrator is None else (run.calibrator.quantity,)
    try:
        found = convert(source, channel.scale) if known is None else known.convert(source, channel.scale)
    except UnitError:
        return ChannelScale(channel.name, numbers.unit, numbers.factor)
    if found.quantity not in possible or found.si_symbol != QUANTITY_SI_SYMBOL[found.quantity]:
        return ChannelScale(channel.name, numbers.unit, numbers.factor)
    return ChannelScale(channel.name, numbers.unit, numbers.factor, found.gain / numbers.factor, found.scaling)


def _of_calibrator(checks: Sequence[CalibratorCheck]) -> list[CalibratorCheck]:
    """Leave out channels whose tone is another one, as hum, where some channel has that of the calibrator."""
    from tdacoustic.sensors.checking import is_wanted

    has_it = [check.plateau and is_wanted(check.plateau.frequency_hz, check.run.wanted_hz) for check in checks]
    if not any(has_it):
        return list(checks)
    return [check for check, own in zip(checks, has_it, strict=True) if own or check.plateau is None]


# ---------------------------------------------------------------- what follows


def _calibrations(checks: Sequence[CalibratorCheck], override: bool) -> tuple[ChannelCalibration, ...]:
    from tdacoustic.sensors.checking import calibrate_channel

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
    scanned: Sequence[Scanned],
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

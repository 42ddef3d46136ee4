"""What the calibrator runs of a campaign say of its channels, each run read on its own time axis."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

from tdacoustic.errors import UnitError
from tdacoustic.ingest.axes import LogAxis
from tdacoustic.sensors import USUAL_FREQUENCIES_HZ, parse_calibrator
from tdacoustic.units import QUANTITY_SI_SYMBOL, quantity_of_unit

if TYPE_CHECKING:
    from tdacoustic.campaign import Campaign, CampaignChannel, CampaignRun
    from tdacoustic.ingest.axes import RunAxes
    from tdacoustic.ingest.known_scale import KnownScale
    from tdacoustic.measured.calibrator_step import CalibratorReadings
    from tdacoustic.recording import Channel, LogChannel
    from tdacoustic.sensors.calibrator_check import CalibratorCheck, CalibratorRun, ChannelScale
    from tdacoustic.steps import Jobs, Progress, Record, Store, Task
    from tdacoustic.workflows.clocks import CampaignClocks
    from tdacoustic.workflows.scanned_runs import ScannedRun

__all__ = ["ReadCalibrators", "Scales", "read_calibrators"]

PASSING_S: Final = 0.5
"""For how long a calibrator's tone has to stand out for being said to be too short [assumed]."""

Scales = Mapping[str, Mapping[str, "KnownScale"]]
"""By run, then by channel."""

Execution = tuple["Jobs", "Progress | None"]
"""Processes, and who is told of progress."""


@dataclass(frozen=True)
class ReadCalibrators:
    """What the calibrator runs show.

    Parameters
    ----------
    checks : tuple of CalibratorCheck
        By run and channel.
    records : mapping of str to Record
        By key, of the steps that read them.
    problems : tuple of str
        What they could not tell, one line each.
    """

    checks: tuple[CalibratorCheck, ...]
    records: Mapping[str, Record]
    problems: tuple[str, ...]


def read_calibrators(
    campaign: Campaign,
    scanned: Sequence[ScannedRun],
    series: Mapping[str, int],
    clocks: CampaignClocks,
    scales: Scales,
    store: Store,
    execution: Execution,
) -> ReadCalibrators:
    """Return what each calibrator run says of each of its channels.

    A cut counts on the axis of all its logs. Where that could not be found, a run with a cut is not read, and one
    without is read as though its logs had started together, which no level depends on.

    Parameters
    ----------
    campaign : Campaign
    scanned : sequence of ScannedRun
    series : mapping of str to int
        By run.
    clocks : CampaignClocks
    scales : mapping of str to mapping of str to KnownScale
        From the sensor database, by run and channel.
    store : Store
    execution : tuple of (int or Executor, callable or None)
        Processes and progress.
    """
    from tdacoustic.steps import execute, lineage, result_of

    held = [item for item in scanned if item.run.is_calibration and item.error is None]
    tasks = {item.run.name: task for item in held if (task := _task(campaign, item, clocks, store)) is not None}
    failed = execute(list(tasks.values()), store, *execution).failed
    checks: list[CalibratorCheck] = []
    records: dict[str, Record] = {}
    problems: list[str] = []
    for item in held:
        name, task = item.run.name, tasks.get(item.run.name)
        if task is None:
            problems += () if item.problems else (_why_not(item, clocks),)
            continue
        if task.key in failed:
            problems.append(f"calibrator run {name!r} cannot be read: {failed[task.key]}")
            continue
        readings: CalibratorReadings = result_of(task, store)
        records.update(lineage(task, store))
        if name in clocks.failed:
            problems.append(f"calibrator run {name!r} is read with its logs taken as started together")
        made, unheard = _channel_checks(campaign, item, _calibrator_run(item.run, series[name]), readings, scales)
        problems += unheard
        if not made:
            problems.append(f"calibrator run {name!r}: in none of its channels does a steady tone stand out")
        checks += made
    return ReadCalibrators(tuple(checks), records, tuple(problems))


def _calibrator_run(run: CampaignRun, series: int) -> CalibratorRun:
    from tdacoustic.sensors.calibrator_check import CalibratorRun

    calibrator = None if run.calibrator is None else parse_calibrator(run.calibrator)
    kind: Literal["before", "after"] = "before" if run.kind == "calibration_before" else "after"
    return CalibratorRun(run.name, kind, series, calibrator, run.calibrator_frequency_hz)


# ---------------------------------------------------------------- what is read


def _task(campaign: Campaign, item: ScannedRun, clocks: CampaignClocks, store: Store) -> Task | None:
    """The task that reads the tone in every channel that the calibrator may have been put on; None of no channel."""
    from tdacoustic.measured.calibrator_step import CALIBRATOR, CalibratorSettings
    from tdacoustic.workflows.fetched_logs import hashed_logs

    if _is_cut_nowhere(item, clocks):
        return None
    known = clocks.runs.get(item.run.name)
    channels = tuple(_candidates(campaign, item, None if known is None else known.axes))
    if not channels:
        return None
    wanted = _calibrator_run(item.run, 1).wanted_hz or tuple(sorted({*sum(USUAL_FREQUENCIES_HZ.values(), ())}))
    logs = hashed_logs(item.run, item.logs, store)
    return CALIBRATOR.task(f"run {item.run.name}", CalibratorSettings(channels, wanted), logs=logs)


def _is_cut_nowhere(item: ScannedRun, clocks: CampaignClocks) -> bool:
    """Whether a run has a cut on an axis that is not known."""
    return item.run.name in clocks.failed and not (item.run.start_s is None and item.run.end_s is None)


def _why_not(item: ScannedRun, clocks: CampaignClocks) -> str:
    said = f"calibrator run {item.run.name!r}"
    if _is_cut_nowhere(item, clocks):
        return f"{said} is not read: start_s and end_s count on the axis of all its logs, which is not known"
    return f"{said}: none of its channels can have been calibrated"


def _candidates(campaign: Campaign, item: ScannedRun, axes: RunAxes | None) -> Iterator[Channel]:
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
        stated = source.raster.sample_rate_hz or run.sample_rate_hz
        if stated is None:
            continue
        axis = LogAxis() if axes is None else axes.axes[log_index]
        raster, rate = axis.raster(source.raster, stated)
        cut = cut_raster(raster, rate, run.start_s, run.end_s)
        if cut.n_samples == 0:
            continue  # the calibrator was on another recorder then
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


# ---------------------------------------------------------------- what it says


def _channel_checks(
    campaign: Campaign, item: ScannedRun, run: CalibratorRun, readings: CalibratorReadings, scales: Scales
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


def _stated_scale(channel: CampaignChannel, item: ScannedRun, run: CalibratorRun, scales: Scales) -> ChannelScale:
    """What the channel's numbers are, as far as campaign, log and sensor database say."""
    from tdacoustic.ingest.conversion import convert
    from tdacoustic.ingest.known_scale import number_unit
    from tdacoustic.sensors.calibrator_check import ChannelScale

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

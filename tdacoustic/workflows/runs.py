"""The runs of a campaign: logs scanned, channels bound, tasks made, measurements gathered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from tdacoustic.attribution import EVIDENCE, EvidenceSettings
from tdacoustic.campaign import Campaign, CampaignRun, WrittenPath
from tdacoustic.errors import CampaignError, TdacousticError
from tdacoustic.ingest import Bound, bind_run, check_coverage
from tdacoustic.measured import FrameSettings, MeasurementSettings, measurement_task
from tdacoustic.measured.runs import MeasuredRun, receivers_of
from tdacoustic.quality import Verdict
from tdacoustic.recording import Channel, Log, Recording
from tdacoustic.reporting.template import TEMPLATE
from tdacoustic.results import LogInput
from tdacoustic.steps import LogFile, Store, Task, log_file, result_of
from tdacoustic.toml_models import file_or_inside
from tdacoustic.workflows.fetched_logs import hashed_logs
from tdacoustic.workflows.groundwork import Groundwork, lay_groundwork
from tdacoustic.workflows.line_speed import fleet_of, line_speed_settings

if TYPE_CHECKING:
    from tdacoustic.fleet import Fleet
    from tdacoustic.workflows.scanned_runs import ScannedRun

__all__ = [
    "PreparedRun",
    "fleet_input",
    "gather_run",
    "log_inputs",
    "prepare_runs",
    "run_problems",
    "written_inputs",
]


@dataclass(frozen=True)
class PreparedRun:
    """A run before anything is computed.

    Parameters
    ----------
    run : CampaignRun
    bound : Bound or None
        None where its logs cannot be read.
    measurement, evidence : Task or None
        Evidence only of a test run with a microphone.
    logs : tuple of LogFile
        None where its logs cannot be read.
    scanned : tuple of Log
        The same, scanned.
    error : TdacousticError or None
        Why its logs cannot be read.
    flags : tuple of str
        What is odd about its logs.
    no_lines : str or None
        Why its speed cannot be read from lines, where it would have to be.
    verdicts : tuple of Verdict
        What is known of it and its channels before anything is computed.
    """

    run: CampaignRun
    bound: Bound | None = None
    measurement: Task | None = None
    evidence: Task | None = None
    logs: tuple[LogFile, ...] = ()
    scanned: tuple[Log, ...] = ()
    error: TdacousticError | None = None
    flags: tuple[str, ...] = ()
    no_lines: str | None = None
    verdicts: tuple[Verdict, ...] = ()

    @property
    def task(self) -> Task | None:
        """The last of its tasks."""
        return self.evidence or self.measurement


def prepare_runs(
    campaign: Campaign, store: Store, without_runs: bool = False, groundwork: Groundwork | None = None
) -> tuple[PreparedRun, ...]:
    """Hash the logs of all valid runs, bind their channels and make their tasks.

    Parameters
    ----------
    campaign : Campaign
    store : Store
    without_runs : bool
        Go on where no run can be read.
    groundwork : Groundwork, optional
        Default: it is laid here.

    Raises
    ------
    TdacousticError
        No run can be read (unless `without_runs`), or a channel can be used in no run.
    """
    fleet = fleet_of(campaign) if campaign.analysis.speed_from != "channels" else None
    ground = groundwork or lay_groundwork(campaign, store)
    prepared = [_prepare(campaign, item, store, fleet, ground) for item in ground.scanned]
    _check_coverage(campaign, prepared, without_runs, ground.sensors.problems)
    bound = [item.bound.recording for item in prepared if item.bound is not None]
    microphones = receivers_of(bound)
    return tuple(replace(item, evidence=_evidence(item, microphones)) for item in prepared)


def _evidence(item: PreparedRun, microphones: tuple[str, ...]) -> Task | None:
    if item.bound is None or item.measurement is None or item.run.kind != "test" or not microphones:
        return None
    survey = item.measurement.inputs["survey"]
    settings = EvidenceSettings(microphones, _sensors(item.bound.recording))
    return EVIDENCE.task(item.measurement.label, settings, survey=survey, measurement=item.measurement)


def _sensors(recording: Recording) -> tuple[tuple[str, str], ...]:
    """Vibration sensors and their components; a component is asked where it has an accelerometer."""

    def is_sensor(channel: Channel) -> bool:
        return channel.quantity == "acceleration" and channel.component is not None

    return tuple((channel.name, str(channel.component)) for channel in recording.channels if is_sensor(channel))


def _prepare(
    campaign: Campaign, item: ScannedRun, store: Store, fleet: Fleet | None, ground: Groundwork
) -> PreparedRun:
    """Hash a run's logs, bind its channels, make its task."""
    run = item.run
    if item.error is not None:
        return PreparedRun(run, error=ground.failed.get(run.name, item.error))
    logs: tuple[LogFile, ...] = ()
    try:
        logs = hashed_logs(run, item.logs, store)
        if run.name in ground.failed:
            raise ground.failed[run.name]
        clocks = ground.clocks.get(run.name)
        axes = None if clocks is None else clocks.axes
        bound = bind_run(item.channels, run, item.logs, ground.sensors.of_run(run.name), axes)
        held = {channel.name for channel in item.channels}
        bound = replace(bound, absent=tuple(c.name for c in campaign.channels if c.name not in held))
    except TdacousticError as error:
        return PreparedRun(run, logs=logs, scanned=item.logs if logs else (), error=error)
    analysis = campaign.analysis
    settings = MeasurementSettings(
        channels=bound.recording.channels,
        refused=tuple((refusal.channel, refusal.reason) for refusal in bound.refused),
        line_prominence_db=analysis.line_prominence_db,
        speed_tolerance=analysis.speed_tolerance,
        mains_hz=analysis.mains_hz,
        level_band_hz=analysis.level_band_hz,
        stated=_stated_speeds(run),
    )
    frames = FrameSettings(analysis.frequency_resolution_hz, analysis.overlap, analysis.run_up_resolution_hz)
    lines = line_speed_settings(campaign, run, bound.recording, fleet)
    no_lines = lines if isinstance(lines, str) else None
    task = measurement_task(f"run {run.name}", settings, frames, logs, None if isinstance(lines, str) else lines)
    flags = [f"{name}: {flag}" for name, log in zip(item.names, item.logs, strict=True) for flag in log.flags]
    flags += [warning for warning in bound.warnings if not warning.startswith("channel ")]
    verdicts = (*ground.sensors.verdicts.get(run.name, ()), *(clocks.verdicts if clocks is not None else ()))
    return PreparedRun(
        run, bound, task, logs=logs, scanned=item.logs, flags=tuple(flags), no_lines=no_lines, verdicts=verdicts
    )


def _stated_speeds(run: CampaignRun) -> tuple[tuple[str, float], ...]:
    stated = []
    if run.motor_speed_rpm is not None:
        stated.append(("motor", run.motor_speed_rpm / 60.0))
    if run.train_speed_km_h is not None:
        stated.append(("train", run.train_speed_km_h / 3.6))
    return tuple(stated)


def _check_coverage(
    campaign: Campaign, prepared: Sequence[PreparedRun], without_runs: bool, problems: Sequence[str]
) -> None:
    """Raise where nothing can be used, or where a channel can be used in no run; with what calibrators did not tell."""
    if not prepared:
        return
    errors = [item.error for item in prepared if item.error is not None]
    if len(errors) == len(prepared):
        if without_runs:
            return
        first = errors[0]
        raise type(first)("\n".join(dict.fromkeys(str(error) for error in errors))) from first
    try:
        check_coverage([item.bound for item in prepared if item.bound is not None], campaign.channels)
    except CampaignError as error:
        raise CampaignError("\n".join((str(error), *problems))) from error


def gather_run(
    run: CampaignRun,
    prepared: PreparedRun | None,
    failures: Mapping[str, TdacousticError],
    store: Store,
) -> MeasuredRun:
    """Return a run with its measurement, or with the reason why it has none."""
    if prepared is None:
        return MeasuredRun(run, None, None, (Verdict("", "run", "warning", f"rejected: {run.reject_reason}"),))
    error = prepared.error or failures.get(run.name)
    if error is not None or prepared.bound is None or prepared.measurement is None:
        return MeasuredRun(run, None, None, (Verdict("", "run", "bad", f"cannot be used: {_words(run, error)}"),))
    measurement = result_of(prepared.measurement, store)
    verdicts = [*prepared.verdicts, *(Verdict("", "log", "warning", flag) for flag in prepared.flags)]
    if prepared.no_lines is not None:
        verdicts.append(Verdict("", "speed", "warning", f"not read from lines: {prepared.no_lines}"))
    measured = MeasuredRun(run, prepared.bound.recording, measurement, tuple(verdicts))
    if not measured.usable_channels:
        unusable = Verdict("", "run", "bad", "cannot be used: no signal channel is in order")
        measured = replace(measured, verdicts=(*verdicts, unusable))
    return measured


def _words(run: CampaignRun, error: TdacousticError | None) -> str:
    """Return an error with the run's logs as the campaign writes them: a copied campaign gives the same result."""
    text = str(error)
    for log in run.logs:
        text = text.replace(str(log.path), log.text)
    return text


def run_problems(prepared: Sequence[PreparedRun], failures: Mapping[str, TdacousticError]) -> list[str]:
    """Return what of the runs could not be used, one line each."""
    found = []
    for item in prepared:
        error = item.error or failures.get(item.run.name)
        if error is not None:
            found.append(f"run {item.run.name!r} is left out: {_words(item.run, error)}")
        elif item.bound is not None:
            found += [refusal.reason for refusal in item.bound.refused]
    return found


def written_inputs(campaign: Campaign, with_fleet: bool) -> tuple[LogInput, ...]:
    """Return the files that people wrote: the campaign, its table of runs, its fleet."""
    files = [(campaign.path.name, campaign.path, "campaign")]
    if campaign.run_table is not None:
        files.append((campaign.run_table.text, campaign.run_table.path, "runs"))
    if campaign.sensor_table is not None:
        files.append((campaign.sensor_table.text, campaign.sensor_table.path, "sensors"))
    if campaign.template is not None:
        files.append((campaign.template.text, file_or_inside(campaign.template.path, TEMPLATE), "template"))
    found = [_input(*file) for file in files]
    if campaign.fleet is not None and with_fleet:
        found.append(fleet_input(campaign.fleet, "fleet"))
    return tuple(found)


def fleet_input(fleet: WrittenPath, kind: str) -> LogInput:
    """Return a fleet file as an input; its folder may be named in its stead."""
    return _input(fleet.text, fleet.path / "fleet.toml" if fleet.path.is_dir() else fleet.path, kind)


def _input(text: str, path: Path, kind: str) -> LogInput:
    file = log_file(path)
    return LogInput(text, file.sha256, file.n_bytes, kind)


def log_inputs(prepared: Sequence[PreparedRun]) -> tuple[LogInput, ...]:
    """Return the logs that were read, each once; a run that is left out may still have told of clocks or sensors."""
    found: dict[str, LogInput] = {}
    for item in prepared:
        held = zip(item.run.logs, item.scanned, item.logs, strict=True) if item.logs else ()
        for written, log, file in held:
            found[written.text] = LogInput(written.text, file.sha256, file.n_bytes, log.format)
            for companion in file.companions:
                text = _beside(written.text, companion.path.relative_to(log.path.parent).as_posix())
                found[text] = LogInput(text, companion.sha256, companion.n_bytes, log.format)
    return tuple(found.values())


def _beside(written: str, name: str) -> str:
    """Write a file of a log's folder as the campaign writes the log.

    >>> _beside("logs/a.atfx", "a.bin")
    'logs/a.bin'
    """
    return written[: max(written.rfind("/"), written.rfind("\\")) + 1] + name

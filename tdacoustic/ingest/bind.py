"""A run's logs and the campaign's channels -> the run's recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from tdacoustic.campaign import CampaignChannel, CampaignRun
from tdacoustic.errors import CampaignError, UnitError
from tdacoustic.ingest.axes import LogAxis, RunAxes
from tdacoustic.ingest.bound import Bound, Refusal
from tdacoustic.ingest.conversion import convert
from tdacoustic.ingest.cut import cut_raster
from tdacoustic.ingest.known_scale import KnownScale
from tdacoustic.ingest.sources import NotFoundError, find_source, log_names
from tdacoustic.recording import Channel, Log, LogChannel, Recording

__all__ = ["MAX_RATE_DIFFERENCE", "bind_run"]

MAX_RATE_DIFFERENCE = 1e-4
"""Relative difference of a stated rate from the log's above which they contradict each other."""


class _RefusedError(Exception):
    """Why a channel cannot be used."""


def bind_run(
    channels: Sequence[CampaignChannel],
    run: CampaignRun,
    logs: Sequence[Log],
    scales: Mapping[str, KnownScale] | None = None,
    axes: RunAxes | None = None,
) -> Bound:
    """Bind a run's logs to the campaign's channels.

    Times count from the start of the reference log. Without `axes` the first instants of all logs are taken as the
    same, which is warned of where the logs state otherwise. A cut keeps that axis.

    Parameters
    ----------
    channels : sequence of CampaignChannel
    run : CampaignRun
    logs : sequence of Log
        Scanned, in the order of ``run.logs``.
    scales : mapping of str to KnownScale, optional
        By channel, where the scale is not, or not only, that of its ``[[channel]]``.
    axes : RunAxes, optional
        Where the logs' own times lie on the run's: starts are moved and rates corrected, nothing is resampled.

    Returns
    -------
    Bound
        A channel that cannot be used does not stop the others.

    Raises
    ------
    CampaignError
        A source is in two logs, or the run's rate contradicts the log's: faults of the
        campaign that no channel can be blamed for.
    """
    if len(logs) != len(run.logs):
        raise CampaignError(f"run {run.name!r} has {len(run.logs)} logs, got {len(logs)}")
    _check_rate(run, logs)
    bound: list[Channel] = []
    refused: list[Refusal] = []
    warnings = list(axes.warnings) if axes is not None else _start_warnings(run, logs)
    for channel in channels:
        try:
            held = _in_the_reference(channel, run, logs, axes)
            found, doubts, file = _bind_channel(held, run, logs, (scales or {}).get(channel.name), axes)
        except _RefusedError as error:
            refused.append(Refusal(run.name, channel.name, str(error)))
            continue
        bound.append(found)
        warnings += [f"channel {channel.name!r} (run {run.name}, {file}): {doubt}" for doubt in doubts]
    return Bound(Recording(run.name, tuple(logs), tuple(bound)), tuple(refused), tuple(warnings))


def _check_rate(run: CampaignRun, logs: Sequence[Log]) -> None:
    stated = run.sample_rate_hz
    names = log_names(run, logs)
    rates = [(name, c.raster.sample_rate_hz) for name, log in zip(names, logs, strict=True) for c in log.channels]
    if stated is None or any(rate is None for _, rate in rates):
        return  # where one log is silent, the stated rate is that one's
    for name, rate in rates:
        if rate is not None and abs(stated - rate) > MAX_RATE_DIFFERENCE * rate:
            raise CampaignError(
                f"run {run.name!r}: sample_rate_hz = {stated:g}, but {name} says {rate:g}; leave it out"
            )


def _start_warnings(run: CampaignRun, logs: Sequence[Log]) -> list[str]:
    names = log_names(run, logs)
    starts = {name: log.start_time for name, log in zip(names, logs, strict=True) if log.start_time is not None}
    if len(set(starts.values())) < 2:
        return []
    said = ", ".join(f"{name} at {start}" for name, start in starts.items())
    return [
        f"run {run.name}: its logs say that they start at different times ({said}); they are taken as started together"
    ]


def _in_the_reference(
    channel: CampaignChannel, run: CampaignRun, logs: Sequence[Log], axes: RunAxes | None
) -> CampaignChannel:
    """Take the shared channel that all logs hold from the reference log."""
    if axes is None or run.align_on != (channel.name,) or channel.log is not None:
        return channel
    return channel.model_copy(update={"log": axes.reference + 1})


def _bind_channel(
    channel: CampaignChannel,
    run: CampaignRun,
    logs: Sequence[Log],
    known: KnownScale | None,
    axes: RunAxes | None,
) -> tuple[Channel, tuple[str, ...], str]:
    names = log_names(run, logs)
    try:
        place = find_source(channel, logs, names)
    except NotFoundError as error:
        raise _RefusedError(f"channel {channel.name!r} (run {run.name}, {', '.join(names)}): {error}") from None
    except CampaignError as error:
        raise CampaignError(f"run {run.name!r}: {error}") from None
    file = names[place.log_index]
    source = logs[place.log_index].channels[place.column]
    try:
        axis = LogAxis() if axes is None else axes.axes[place.log_index]
        found, doubts = _scaled(channel, run, source, (place.log_index, place.column), known, axis)
    except UnitError as error:
        raise _RefusedError(f"channel {channel.name!r} (run {run.name}, {file}): {error}") from None
    return found, (*place.warnings, *doubts), file


def _scaled(
    channel: CampaignChannel,
    run: CampaignRun,
    source: LogChannel,
    place: tuple[int, int],
    known: KnownScale | None,
    axis: LogAxis,
) -> tuple[Channel, tuple[str, ...]]:
    conversion = convert(source, channel.scale) if known is None else known.convert(source, channel.scale)
    if conversion.quantity == "tacho" and channel.pulses_per_rev is None:
        raise UnitError("a tacho needs its pulses per revolution, add pulses_per_rev = ... to its [[channel]]")
    rate = source.raster.sample_rate_hz or run.sample_rate_hz
    if rate is None:
        raise UnitError("the log states no sampling rate, add sample_rate_hz = ... to its [[run]]")
    raster, rate = axis.raster(source.raster, rate)
    cut = cut_raster(raster, rate, run.start_s, run.end_s)
    if cut.n_samples == 0:
        length_s = source.raster.n_samples / rate
        end = "the end" if run.end_s is None else f"{run.end_s:g} s"
        begins = "" if raster is source.raster else f", from {raster.start_s:g} s on"
        raise UnitError(
            f"no sample between {run.start_s or 0.0:g} s and {end}; the log holds {length_s:g} s of it{begins}"
        )
    component = channel.component
    if component is None and conversion.quantity == "sound_pressure":
        component = "air"
    doubts = (*conversion.warnings, *cut.warnings)
    found = Channel(
        name=channel.name,
        quantity=conversion.quantity,
        si_symbol=conversion.si_symbol,
        log_index=place[0],
        column=place[1],
        sample_rate_hz=rate,
        start_sample=cut.start_sample,
        n_samples=cut.n_samples,
        start_s=cut.start_s,
        gain=conversion.gain,
        offset=conversion.offset,
        scaling="; ".join(part for part in (conversion.scaling, axis.words) if part),
        limits=conversion.limits(source.limits),
        component=component,
        drive=channel.drive,
        role=channel.role,
        direction=channel.direction,
        shaft=channel.shaft,
        position_m=channel.position_m,
        distance_m=channel.distance_m,
        pulses_per_rev=channel.pulses_per_rev,
        flags=(*source.flags, *doubts),
    )
    return found, doubts

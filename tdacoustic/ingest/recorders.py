"""Which of a campaign's channels the logs of a calibrator run hold, where they may be those of some recorders alone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from tdacoustic.campaign import CampaignChannel, CampaignRun
from tdacoustic.errors import CampaignError
from tdacoustic.ingest.sources import NotFoundError, find_source, log_names
from tdacoustic.recording import Log

__all__ = ["HeldChannels", "held_channels"]


@dataclass(frozen=True)
class HeldChannels:
    """The channels that a run may have, with the run's own numbers of logs.

    Parameters
    ----------
    channels : tuple of CampaignChannel
        In the campaign's order.
    problems : tuple of str
        Why some that it may hold are not among them.
    """

    channels: tuple[CampaignChannel, ...]
    problems: tuple[str, ...] = ()


def held_channels(
    channels: Sequence[CampaignChannel], run: CampaignRun, logs: Sequence[Log], recorders: int
) -> HeldChannels:
    """Return a run's channels; of a calibrator run those that its logs hold, or that its `calibrated` names.

    A calibrator run may hold fewer logs than the campaign has recorders. The `log` of a ``[[channel]]`` then says
    nothing of a place in it: whose its logs are is told by the channels that `calibrated` names, else by the names in
    the logs. Where neither tells it, no channel that states a `log` is taken.

    Parameters
    ----------
    channels : sequence of CampaignChannel
    run : CampaignRun
    logs : sequence of Log
        Scanned, in the order of ``run.logs``.
    recorders : int
        The most logs that a run without a calibrator has, or that the channels count.
    """
    if not run.is_calibration:
        return HeldChannels(tuple(channels))
    problems: tuple[str, ...] = ()
    if len(logs) < recorders:
        channels, problems = _placed(channels, run, logs, recorders)
    held = [item for item in channels if item.name in run.calibrated or _is_there(item, logs)]
    return HeldChannels(tuple(held), problems)


def _is_there(channel: CampaignChannel, logs: Sequence[Log]) -> bool:
    try:
        find_source(channel, logs)
    except NotFoundError:
        return False
    except CampaignError:
        return True  # in two logs: said where the run is bound
    return True


def _placed(
    channels: Sequence[CampaignChannel], run: CampaignRun, logs: Sequence[Log], recorders: int
) -> tuple[list[CampaignChannel], tuple[str, ...]]:
    """Turn each stated `log` from the number of a recorder into that of a log of the run."""
    named = [item for item in channels if item.name in run.calibrated]
    stated = sorted({item.log for item in named if item.log is not None})
    places: Mapping[int, int] = {}
    alone: Mapping[str, int] = {}
    problems: list[str] = []
    if len(stated) == len(logs):
        places = {number: place for place, number in enumerate(stated, 1)}
    elif run.calibrated:
        alone, problems = _by_source(named, run, logs)
    else:
        found, problem = _by_names(channels, run, logs, recorders)
        places, problems = found, [problem] if problem else []
    kept = []
    for item in channels:
        place = alone.get(item.name) or (None if item.log is None else places.get(item.log))
        if item.log is None:
            kept.append(item)
        elif place is not None:
            kept.append(item.model_copy(update={"log": place}))
    return kept, tuple(problems)


def _by_source(
    named: Sequence[CampaignChannel], run: CampaignRun, logs: Sequence[Log]
) -> tuple[dict[str, int], list[str]]:
    """Places of the channels that `calibrated` names, each by its source in whichever log holds it alone."""
    files, found, problems = log_names(run, logs), {}, []
    for item in named:
        if item.log is None:
            continue
        try:
            place = find_source(item.model_copy(update={"log": None}), logs, files)
        except (NotFoundError, CampaignError) as error:
            problems.append(f"calibrator run {run.name!r}: calibrated names {item.name!r}: {error}")
            continue
        found[item.name] = (place.log_index, place.column)
    times = Counter(found.values())
    for name, place_of in found.items():
        if times[place_of] > 1:
            problems.append(
                f"calibrator run {run.name!r}: calibrated names {name!r} and another channel of the same source in "
                f"{files[place_of[0]]}; name those of the recorder that the log is of"
            )
    return {name: at[0] + 1 for name, at in found.items() if times[at] == 1}, problems


def _by_names(
    channels: Sequence[CampaignChannel], run: CampaignRun, logs: Sequence[Log], recorders: int
) -> tuple[dict[int, int], str]:
    """Place in the run by recorder, as far as the names in the logs tell it, and what to say where they do not."""
    fits = [tuple(_fitting(channels, log)) for log in logs]
    told = [of_log[0] for of_log in fits if len(of_log) == 1]
    if len(set(told)) == len(logs):
        return {number: place for place, number in enumerate(told, 1)}, ""
    if not any(fits):
        return {}, ""
    numbers = " or ".join(str(number) for number in sorted({number for of_log in fits for number in of_log}))
    return {}, (
        f"calibrator run {run.name!r} holds {len(logs)} of {recorders} logs ({', '.join(log_names(run, logs))}), and "
        f"whether of log {numbers} cannot be told: name the channels that the calibrator was on, calibrated = [...]"
    )


def _fitting(channels: Sequence[CampaignChannel], log: Log) -> Iterator[int]:
    """Recorders all of whose channels a log holds; where there is none, those with some in it."""
    held: dict[int, list[bool]] = {}
    for item in channels:
        if item.log is not None:
            is_there = _is_there(item.model_copy(update={"log": None}), (log,))
            held.setdefault(item.log, []).append(is_there)
    whole = [number for number, there in held.items() if all(there)]
    yield from whole or [number for number, there in held.items() if any(there)]

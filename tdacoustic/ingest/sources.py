"""Which channel of which log a campaign's channel is."""

from __future__ import annotations

import difflib
import unicodedata
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from tdacoustic.campaign import CampaignChannel, CampaignRun
from tdacoustic.errors import CampaignError
from tdacoustic.recording import Log

__all__ = ["Found", "NotFoundError", "find_source", "log_names"]


class NotFoundError(LookupError):
    """A source is in none of the logs; the message says what is."""


@dataclass(frozen=True)
class Found:
    """Where a source is.

    Parameters
    ----------
    log_index, column : int
        From 0.
    warnings : tuple of str
    """

    log_index: int
    column: int
    warnings: tuple[str, ...] = ()


def _exact(name: str) -> str:
    return name.removeprefix("/")  # HDF5 paths with and without the root


def _loose(name: str) -> str:
    return "".join(unicodedata.normalize("NFKC", _exact(name)).casefold().split())


def _names(log: Log) -> list[str]:
    return [channel.name for channel in log.channels]


def log_names(run: CampaignRun, logs: Sequence[Log]) -> tuple[str, ...]:
    """Return what the logs of a run are called: the file name, or where two share it, the path as the campaign has it.

    Parameters
    ----------
    run : CampaignRun
    logs : sequence of Log
        In the order of ``run.logs``.
    """
    files = [log.path.name for log in logs]
    times = Counter(files)
    return tuple(file if times[file] == 1 else written.text for file, written in zip(files, run.logs, strict=True))


def find_source(channel: CampaignChannel, logs: Sequence[Log], names: Sequence[str] | None = None) -> Found:
    """Find a channel's source in the logs of a run.

    A name is looked for as it is (a leading ``/`` does not count), then without
    regard to case and spaces, which has to be unique and is warned of. A number
    counts from 1 in the log that ``log`` names, or in the only one.

    Parameters
    ----------
    channel : CampaignChannel
    logs : sequence of Log
        In the order of the run.
    names : sequence of str, optional
        Of the logs, for messages. Default: their file names.

    Returns
    -------
    Found

    Raises
    ------
    NotFoundError
        It is not there, or a name stands for several channels of one log.
    CampaignError
        It is in two logs and ``log`` is not stated.
    """
    if channel.log is not None and channel.log > len(logs):
        raise NotFoundError(f"log = {channel.log}, but the run has {len(logs)} log{'s' if len(logs) != 1 else ''}")
    within = range(len(logs)) if channel.log is None else range(channel.log - 1, channel.log)
    files = [log.path.name for log in logs] if names is None else names
    if isinstance(channel.source, int):
        return _by_index(channel.source, channel, logs, files, within)
    return _by_name(channel.source, channel, logs, files, within)


def _by_index(source: int, channel: CampaignChannel, logs: Sequence[Log], files: Sequence[str], within: range) -> Found:
    if len(within) > 1:
        raise CampaignError(
            f"channel {channel.name!r}: source = {source} could be in any of {', '.join(files)}; "
            f"add log = 1 ... {len(logs)} to its [[channel]]"
        )
    log = logs[within[0]]
    if source > len(log.channels):
        raise NotFoundError(f"source = {source}, but {files[within[0]]} has {len(log.channels)} channels")
    return Found(within[0], source - 1)


def _by_name(source: str, channel: CampaignChannel, logs: Sequence[Log], files: Sequence[str], within: range) -> Found:
    for form, loose in ((_exact, False), (_loose, True)):
        hits = [(i, c) for i in within for c, name in enumerate(_names(logs[i])) if form(name) == form(source)]
        if not hits:
            continue
        index, column = hits[0]
        numbers = list(dict.fromkeys(i for i, _ in hits))
        if len(numbers) > 1:
            raise CampaignError(
                f"channel {channel.name!r}: source {source!r} is in {' and in '.join(files[i] for i in numbers)}; "
                f"add log = {numbers[0] + 1} or log = {numbers[1] + 1} to its [[channel]]"
            )
        if len(hits) > 1:
            which = ", ".join(str(c + 1) for _, c in hits)
            raise NotFoundError(
                f"{len(hits)} channels of {files[index]} could be source {source!r}; say which by number, "
                f"source = {which}"
            )
        if not loose:
            return Found(index, column)
        name = logs[index].channels[column].name
        return Found(index, column, (f"source {source!r} is not in the log, {name!r} is taken",))
    names = [name for i in within for name in _names(logs[i])]
    near = difflib.get_close_matches(source, names, n=3, cutoff=0.5)
    said = f"the nearest are {', '.join(map(repr, near))}" if near else f"there are {', '.join(map(repr, names[:8]))}"
    if not near and len(names) > 8:
        said += f" and {len(names) - 8} more"
    where = ", ".join(files[i] for i in within) or "any log"
    raise NotFoundError(f"source {source!r} is not in {where}; {said}")

"""Times that count from a date: the start of a log out of them, and its channels' own times after that start.

A time column or a time vector may begin at 0, at some instant of the recording, or at seconds since 1970 or another
date. Whatever the format, that is told apart here, by the first instant alone: `from_the_start`.
"""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import Final

from tdacoustic.recording import Log, LogChannel

__all__ = ["from_the_start"]

LATEST_START_S: Final = 3.2e7
"""Times that begin later than a year after zero count from a date, not from the start of the log [assumed]."""

UNIX_FROM_S: Final = 1e9
"""September 2001: seconds since 1970 of any recording are more, and of a device no program counts as many [assumed]."""

SAME_START_S: Final = 86400.0
"""A start that the log states beside such times is believed to be of the same recording within a day [assumed]."""


def from_the_start(log: Log) -> Log:
    """Return a log whose channels' times count from its start, where they count from a date in the file.

    Seconds since 1970 (Unix) become the log's start, in UTC, and each channel's own time what is left after it; the
    first instant is then 0. Where others of its channels count from a start that the log states with a zone, that
    stays the start. Other times that begin later than `LATEST_START_S` are counted from the first of them. Either is
    flagged.

    Parameters
    ----------
    log : Log

    Returns
    -------
    Log
        The same one where all its times count from its start.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tdacoustic.recording import Raster
    >>> mic = LogChannel("mic", Raster(8192.0, 10, 1700000000.25))
    >>> log = from_the_start(Log(Path("a.csv"), "delimited", (mic,), None))
    >>> log.start_time, log.channels[0].raster.start_s
    ('2023-11-14T22:13:20.250000+00:00', 0.0)
    """
    starts = {channel.raster.start_s for channel in log.channels if math.isfinite(channel.raster.start_s)}
    latest = (datetime.now(UTC) + timedelta(days=1)).timestamp()
    unix = {start for start in starts if UNIX_FROM_S <= start <= latest}
    dated = {start for start in starts if abs(start) > LATEST_START_S} - unix
    if not (unix or dated):
        return log
    flags: list[str] = []
    start_time, zero = log.start_time, dict.fromkeys(starts, 0.0)
    if dated:
        zero |= dict.fromkeys(dated, min(dated))
        flags.append(_unknown_date(min(dated), latest))
    if unix:
        start_time, begin = _begin(log.start_time, min(unix), unix == starts, flags)
        zero |= dict.fromkeys(unix, begin)
    undated = starts - unix - dated if start_time != log.start_time else set()
    return replace(
        log,
        start_time=start_time,
        channels=tuple(_counted_from(zero, channel, undated) for channel in log.channels),
        flags=(*log.flags, *flags),
    )


def _unknown_date(begin: float, latest: float) -> str:
    labview = begin > latest and begin - 2_082_844_800.0 <= latest
    since = "which may be since 1904; since what date" if labview else "since what date"
    return (
        f"its times begin at {begin:.12g} s, {since} is not known: they are counted from the first of them, and no "
        "start is taken from them"
    )


def _begin(stated: str | None, unix: float, alone: bool, flags: list[str]) -> tuple[str, float]:
    """The log's start, and that start in seconds since 1970, where some or all of its channels' times are of that kind.

    Parameters
    ----------
    stated : str or None
        What the log says of its start.
    unix : float
        Earliest instant, in seconds since 1970.
    alone : bool
        All of its times are such.
    flags : list of str
        What is to be said is added.
    """
    found = datetime.fromtimestamp(unix, UTC).isoformat(timespec="microseconds")
    words = f"its times are seconds since 1970 (Unix) and begin at {unix:.17g}"
    zoned = _instant(stated)
    if stated is not None and zoned is not None and not alone and abs(unix - zoned) <= SAME_START_S:
        flags.append(f"{words}: they are counted from the start that it states, {stated}")
        return stated, zoned
    contradiction = ""
    if stated is not None and (zoned is None or abs(unix - zoned) > 1.0):
        contradiction = f", not {stated}, which it states{' without a time zone' if zoned is None else ''}"
    flags.append(f"{words}: its start is {found}{contradiction}")
    return found, unix


def _instant(stated: str | None) -> float | None:
    """Seconds since 1970 of an ISO 8601 instant; None where it is none or has no zone."""
    try:
        moment = None if stated is None else datetime.fromisoformat(stated)
    except ValueError:
        return None
    return None if moment is None or moment.tzinfo is None else moment.timestamp()


def _counted_from(zero: dict[float, float], channel: LogChannel, undated: set[float]) -> LogChannel:
    raster = channel.raster
    flags = channel.flags
    if raster.start_s in undated:
        flags = (*flags, "its times say no date and those of others do: it is taken to start with the first of them")
    return replace(channel, raster=replace(raster, start_s=raster.start_s - zero.get(raster.start_s, 0.0)), flags=flags)

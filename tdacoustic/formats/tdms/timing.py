"""When a TDMS channel was sampled: increment, start, and what contradicts them.

LabVIEW's properties: ``wf_increment`` (s), ``wf_start_time`` (an instant, UTC) and
``wf_start_offset`` (s), on the channel or on the group above it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.formats.rates import snap_rate
from tdacoustic.formats.tdms.metadata import Instant, PropertyValue
from tdacoustic.formats.tdms.structure import Starts, Structure

__all__ = ["Timing", "instant_text", "timing_of"]

EPOCH: Final = datetime(1904, 1, 1, tzinfo=UTC)
SECONDS: Final = {"s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0, "sek": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6}
TICK: Final = 1 << 64
SAME_INCREMENT: Final = 1e-6
"""Relative difference of two increments below which they are one and the same [assumed]."""

GAP_SAMPLES: Final = 2.0
"""A start time written anew that is further than this off an unbroken recording may be a gap [assumed]."""

RECIPROCAL: Final = 1e-12
"""Relative error of an increment that is the reciprocal of a whole rate in double precision: nothing worth a note."""

MAX_OFFSET_S: Final = 1e9


@dataclass(frozen=True)
class Timing:
    """Rate and start of a channel.

    Parameters
    ----------
    rate_hz, raw_hz : float or None
        As in `tdacoustic.recording.Raster`.
    start : int or None
        In 2**-64 s after 1904-01-01 UTC; None where no date is known.
    offset_s : float
        Already in `start`.
    bad_date : Instant or None
        A start time that is no date of a recording.
    flags : tuple of str
    left_out : str or None
        Why it cannot be a channel.
    """

    rate_hz: float | None = None
    raw_hz: float | None = None
    start: int | None = None
    offset_s: float = 0.0
    bad_date: Instant | None = None
    flags: tuple[str, ...] = ()
    left_out: str | None = None


Before = Callable[[NDArray[np.int64]], NDArray[np.int64]]
"""How many values of a channel lie before each of some stretches."""

Events = Sequence[tuple[int, PropertyValue]]


def timing_of(structure: Structure, levels: Sequence[str], first: int, last: int, values_before: Before) -> Timing:
    """Read when a channel was sampled.

    Parameters
    ----------
    structure : Structure
    levels : sequence of str
        Paths of the channel, of its group and of the file.
    first, last : int
        Numbers of the first and the last stretch in which it has values.
    values_before : callable
    """
    axis = _axis(structure, levels[0])
    if isinstance(axis, str):
        return Timing(left_out=axis)
    flags: list[str] = []
    increments = _events(structure, levels, "wf_increment")
    rate, raw, left_out = _rate(increments, axis, first, last, values_before, flags)
    if left_out is not None:
        return Timing(left_out=left_out)
    offset = _first_valid(_events(structure, levels, "wf_start_offset"), first, _is_offset)
    offset_s = float(offset) * axis if isinstance(offset, int | float) else 0.0
    starts = next((structure.starts[path] for path in levels if path in structure.starts), None)
    date, bad, is_date = _dates(starts, first)
    start = None if date is None else date.ticks + round(offset_s * TICK)
    if starts is not None and date is not None and rate is not None:
        flags.extend(_gaps(starts, is_date, date, rate, first, last, values_before))
    return Timing(rate, raw, start, offset_s, bad, tuple(flags))


def _axis(structure: Structure, path: str) -> float | str:
    """Seconds a unit of the x axis, or why it is no time."""
    properties = structure.properties.get(path, {})
    unit, name = properties.get("wf_xunit_string"), properties.get("wf_xname")
    if isinstance(name, str) and name.strip().lower() in ("frequency", "frequenz", "order", "ordnung"):
        return f"its x axis is called {name.strip()!r}: no time signal"
    if not isinstance(unit, str) or not unit.strip():
        return 1.0
    seconds = SECONDS.get(unit.strip().lower())
    return f"its x axis is in {unit.strip()[:20]!r}, not a time" if seconds is None else seconds


def _events(structure: Structure, levels: Sequence[str], name: str) -> Events:
    return next((events for path in levels if (events := structure.events.get((path, name)))), ())


def _first_valid(events: Events, first: int, is_valid: Callable[[PropertyValue], bool]) -> PropertyValue:
    """The value in force when the first values were written, else the first one written after."""
    valid = [(number, value) for number, value in events if is_valid(value)]
    before = [value for number, value in valid if number <= first]
    return before[-1] if before else (valid[0][1] if valid else None)


def _is_number(value: PropertyValue) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _is_increment(value: PropertyValue) -> bool:
    return isinstance(value, int | float) and _is_number(value) and 1e-12 < value < 1e9


def _is_offset(value: PropertyValue) -> bool:
    return isinstance(value, int | float) and _is_number(value) and abs(value) < MAX_OFFSET_S


def _dates(starts: Starts | None, first: int) -> tuple[Instant | None, Instant | None, NDArray[np.bool_]]:
    """The start time, or one that is no date of a recording, and which of those written are dates."""
    if starts is None:
        return None, None, np.zeros(0, dtype=bool)
    seconds = np.asarray(starts.seconds, dtype=np.int64)
    earliest = (datetime(1970, 1, 1, tzinfo=UTC) - EPOCH).total_seconds()
    latest = (datetime.now(UTC) + timedelta(days=1) - EPOCH).total_seconds()
    is_date = (seconds >= earliest) & (seconds <= latest)
    candidates = np.flatnonzero(is_date) if is_date.any() else np.arange(len(seconds))
    before = candidates[np.asarray(starts.numbers, dtype=np.int64)[candidates] <= first]
    chosen = int(before[-1] if len(before) else candidates[0])
    instant = Instant(starts.seconds[chosen], starts.fractions[chosen])
    return (instant, None, is_date) if is_date.any() else (None, instant, is_date)


def _rate(
    events: Events,
    axis: float,
    first: int,
    last: int,
    values_before: Before,
    flags: list[str],
) -> tuple[float | None, float | None, str | None]:
    """Rate, rate as stored, and why the channel is left out."""
    increment = _first_valid(events, first, _is_increment)
    if not isinstance(increment, int | float):
        if events:
            flags.append(f"wf_increment is {str(events[-1][1])[:40]}: the sampling rate is not known")
        return None, None, None
    for number, value in events:
        if number <= first or not isinstance(value, int | float):
            continue
        if math.isfinite(value) and abs(value - increment) <= SAME_INCREMENT * abs(increment):
            continue
        if number <= last:
            return (
                None,
                None,
                (
                    f"its wf_increment changes from {increment:.9g} to {value:.9g} "
                    f"after {int(values_before(np.array([number]))[0])} values: it is not evenly sampled"
                ),
            )
        flags.append(
            f"wf_increment was {increment:.9g} while its values were written and {value:.9g} after: "
            "the sampling rate is not known"
        )
        return None, None, None
    rate, raw = snap_rate(1.0 / (increment * axis))
    if raw is not None and abs(raw - rate) <= RECIPROCAL * rate:
        raw = None
    return rate, raw, None


def _gaps(
    starts: Starts,
    is_date: NDArray[np.bool_],
    start: Instant,
    rate: float,
    first: int,
    last: int,
    values_before: Before,
) -> list[str]:
    """Compare start times that are written anew with an unbroken recording."""
    numbers = np.asarray(starts.numbers, dtype=np.int64)
    later = is_date & (numbers > first) & (numbers <= last)
    if not later.any():
        return []
    seconds = np.asarray(starts.seconds, dtype=np.int64)[later] - start.seconds
    fractions = (np.asarray(starts.fractions, dtype=np.uint64)[later].astype(np.float64) - start.fraction) / TICK
    before = values_before(numbers[later])
    off = seconds + fractions - before / rate
    worst = int(np.argmax(np.abs(off)))
    if abs(off[worst]) * rate <= GAP_SAMPLES:
        return []
    return [
        f"its start time was set {int(later.sum()) + 1} times; at value {int(before[worst])} it is "
        f"{off[worst]:.6g} s off an unbroken recording: it may have gaps, and its values are read without them"
    ]


def instant_text(ticks: int) -> str:
    """ISO 8601 of an instant in 2**-64 s after 1904-01-01 UTC.

    Examples
    --------
    >>> instant_text(3564686121 << 64)
    '2016-12-15T22:35:21+00:00'
    """
    microseconds = (ticks * 1_000_000 + TICK // 2) // TICK
    try:
        return (EPOCH + timedelta(microseconds=microseconds)).isoformat()
    except OverflowError:
        return f"{ticks / TICK:.9g} s after 1904-01-01"

"""The axis of a submatrix: from its independent column to a sampling rate."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tdacoustic.formats.atfx.columns import Column, Source
from tdacoustic.formats.atfx.values import Component, Implicit
from tdacoustic.formats.rates import snap_rate

__all__ = ["Axis", "NoTimeSignalError", "axis_of"]

SECONDS = {
    **{"s": 1.0, "sec": 1.0, "sek": 1.0, "second": 1.0, "seconds": 1.0, "sekunden": 1.0},
    **{"ms": 1e-3, "msec": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
}
TIME_NAMES = frozenset({"time", "zeit", "t", "temps", "zeitachse", "timeaxis", "zeitkanal", "timechannel"})
INDEX_NAMES = frozenset({"index", "sample", "samples", "number", "nr", "no", "row", "x"})
WINDOWS = 64
WINDOW_VALUES = 1024
WHOLE_VALUES = 1 << 17
"""A written time of this length is looked at as a whole, a longer one in `WINDOWS` places and at its ends."""
TOLERANCE = 0.05
"""Part of a step by which an instant may be off the grid of an evenly sampled time [assumed]."""

Read = Callable[[int, int], NDArray[np.float64]]


class NoTimeSignalError(Exception):
    """What is measured over this axis is no evenly sampled time signal; the text says why."""


@dataclass(frozen=True)
class Axis:
    """Rate and start of what is measured over an axis.

    Parameters
    ----------
    column : Column or None
        The axis itself, None where there is none.
    sample_rate_hz, sample_rate_raw_hz : float or None
    start_s : float
    flags : tuple of str
    """

    column: Column | None
    sample_rate_hz: float | None = None
    sample_rate_raw_hz: float | None = None
    start_s: float = 0.0
    flags: tuple[str, ...] = ()


def _seconds(column: Column) -> float | None:
    """Seconds of the column's unit, None where it is no time."""
    known = None if column.unit.name is None else SECONDS.get(column.unit.name.strip().lower())
    return known if known is not None or not column.unit.is_time else column.unit.factor


def _is_called_time(column: Column) -> bool:
    return column.name.strip().lower() in TIME_NAMES


def axis_of(columns: Sequence[Column], reading: Callable[[Source], Read]) -> Axis:
    """Return the axis of the columns of one submatrix.

    Parameters
    ----------
    columns : sequence of Column
    reading : callable
        Given a source, returns a function that reads its values from a first to a last.

    Raises
    ------
    NoTimeSignalError
        They are measured over something else, or over times that are not even.
    """
    marked = [column for column in columns if column.independent]
    times = [column for column in marked if _seconds(column) is not None]
    flags: list[str] = []
    if not marked:
        times = [column for column in columns if _seconds(column) is not None and _is_called_time(column)]
        if len(times) != 1:
            return Axis(None)
        flags.append(f"no column is marked as its axis: {times[0].name!r} is taken")
    if len(times) > 1:
        names = ", ".join(repr(column.name) for column in times[:4])
        raise NoTimeSignalError(f"several columns are marked as its time axis: {names}")
    if not times:
        return _without_time_unit(marked, reading)
    return _timed(times[0], _seconds(times[0]) or 1.0, flags, reading)


def _without_time_unit(marked: Sequence[Column], reading: Callable[[Source], Read]) -> Axis:
    column = marked[0]
    if column.unit.name is None and _is_called_time(column):
        return _timed(column, 1.0, [f"its axis {column.name!r} states no unit: seconds are taken"], reading)
    if column.unit.name in (None, "-", "1"):
        word = "an index" if column.name.strip().lower() in INDEX_NAMES else "not a time"
        flag = f"its axis {column.name!r} has no unit, {word}: the sampling rate is not known"
        return Axis(column, flags=(flag,))
    raise NoTimeSignalError(f"its axis {column.name!r} is in {column.unit.name!r}, not a time")


def _timed(column: Column, seconds: float, flags: list[str], reading: Callable[[Source], Read]) -> Axis:
    source = column.source
    if source is None:
        return Axis(column, flags=(*flags, f"its axis {column.name!r} is not read: {column.reason}"))
    part = source.parts[0]
    if source.n_values < 2 and not isinstance(part, Implicit):
        return Axis(column, flags=(*flags, f"its axis {column.name!r} has fewer than two values"))
    if isinstance(part, Implicit):
        first, step, rounding = part.first, part.step, 0.0
    else:
        first, step, rounding = _step_of(column.name, source, reading(source))
    if not (np.isfinite(first) and np.isfinite(step) and step > 0.0 and np.isfinite(1.0 / (step * seconds))):
        return Axis(column, flags=(*flags, f"the increment of its axis {column.name!r} is {step:g}: no sampling rate"))
    rate, raw = snap_rate(1.0 / (step * seconds), rounding)
    return Axis(column, rate, raw, first * seconds, tuple(flags))


def _step_of(name: str, source: Source, read: Read) -> tuple[float, float, float]:
    """First instant, step and relative rounding of a written time.

    Raises
    ------
    NoTimeSignalError
        It is uneven.
    """
    n_values = source.n_values
    places = [(0, n_values)]
    if n_values > WHOLE_VALUES:
        starts = np.linspace(0, n_values - WINDOW_VALUES, WINDOWS).astype(np.int64)
        places = [(int(start), int(start) + WINDOW_VALUES) for start in starts]
    index = np.concatenate([np.arange(*place) for place in places])
    instants = np.concatenate([read(*place) for place in places])
    if not np.isfinite(instants).all():
        raise NoTimeSignalError(f"its axis {name!r} holds values that are no numbers")
    step = float(instants[-1] - instants[0]) / (n_values - 1)
    joined = np.diff(index) == 1
    if (np.diff(instants)[joined] < 0.0).any() or step < 0.0:
        raise NoTimeSignalError(f"its axis {name!r} goes back in time")
    largest = float(np.abs(instants).max())
    rounding = largest * max(
        float(np.finfo(np.dtype(part.dtype)).eps)
        for part in [*source.parts, Component("", "<f8", 0, 0, 0, 1)]
        if isinstance(part, Component) and np.dtype(part.dtype).kind == "f"
    )
    off_grid = np.abs(instants - (instants[0] + step * index)).max()
    if step > 0.0 and off_grid > TOLERANCE * step + rounding:
        raise NoTimeSignalError(
            f"its axis {name!r} is unevenly spaced (up to {off_grid / step:.3g} steps off); it is not resampled "
            "silently"
        )
    span = float(instants[-1] - instants[0])
    return float(instants[0]), step, rounding / span if span > 0.0 else 0.0

"""The sampling rate of an array: from a number beside it, or from an equidistant time vector.

A MAT-file has no place for a sampling rate; people and programs save one under
names of their own. The structure nearest to the array counts; where two things
there disagree, neither is taken.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from tdacoustic.formats.hdf5.attributes import INTERVAL_NAMES, RATE_NAMES
from tdacoustic.formats.hdf5.tree import TIME_NAMES, raster_of_time_vector
from tdacoustic.formats.matlab.workspace import Array, Struct
from tdacoustic.formats.rates import number_in, snap_rate, thousands_doubt

__all__ = ["Sampling", "TimeVectors", "plain", "rises_evenly"]

RATES = RATE_NAMES | frozenset(
    {"sr", "fsamp", "fsample", "fsampling", "sampfreq", "samprate", "samplespersecond", "sps"}
)
INTERVALS = INTERVAL_NAMES | frozenset({"xinc", "tinc", "tsample", "sampletime"})
SAMPLE_TIME = "Ts"
"""MATLAB's own name of an interval; in any other spelling (``t_s``) the letters are a time in seconds."""
AXES = frozenset({"x", "xvalues", "xaxis", "xdata", "timeaxis", "abscissa"})
"""Structures that describe the axis of an array beside them."""

LOWEST_HZ, HIGHEST_HZ = 1e-3, 1e8
"""Outside of this a number is no sampling rate, whatever it is called [assumed]."""

SAME = 1e-4
FIRST = 8
DATE_NUMBERS = (693_962.0, 767_376.0)
"""MATLAB's day numbers of the years 1900 and 2101."""


def plain(name: str) -> str:
    """A name without case and without anything but letters and digits."""
    return "".join(character for character in name.lower() if character.isalnum())


@dataclass(frozen=True)
class Sampling:
    """What is known of an array's sampling.

    Parameters
    ----------
    rate_hz, raw_hz : float or None
        As `tdacoustic.recording.Raster` has them.
    start_s : float
    source : str or None
        Where the rate is from, in words.
    flags : tuple of str
    uneven : bool
        A time vector says that the samples are not evenly spaced.
    """

    rate_hz: float | None = None
    raw_hz: float | None = None
    start_s: float = 0.0
    source: str | None = None
    flags: tuple[str, ...] = ()
    uneven: bool = False


@dataclass(frozen=True)
class _Vector:
    """An array in the shape of a one-dimensional dataset, as `raster_of_time_vector` wants it."""

    array: Array

    @property
    def dtype(self) -> np.dtype[Any]:
        return self.array.dtype

    @property
    def attrs(self) -> dict[str, Any]:
        return {}

    def __len__(self) -> int:
        return max(self.array.shape)

    def __getitem__(self, index: int) -> float:
        return self.array.sample(index)


@dataclass(frozen=True)
class _Time:
    """What a vector called a time gives: a rate, or why it gives none."""

    array: Array
    path: str
    rate_hz: float | None = None
    raw_hz: float | None = None
    start_s: float = 0.0
    reason: str | None = None
    uneven: bool = False


class TimeVectors:
    """The time vectors of a workspace, and the sampling of its arrays."""

    def __init__(self) -> None:
        self._times: dict[int, _Time] = {}
        self._used: set[int] = set()

    def is_used(self, array: Array) -> bool:
        """Whether a vector is another array's time, and therefore no channel."""
        return id(array) in self._used

    def sampling(self, owner: Struct, array: Array) -> Sampling:
        """What is known of the sampling of one of a structure's arrays."""
        numbers, odd = _nearest_numbers(owner)
        time = self._nearest_time(owner, array)
        rates = [rate for rate, _ in numbers]
        if time is not None and time.rate_hz is not None:
            rates.append(time.rate_hz)
            numbers.append((time.rate_hz, f"{time.path!r}"))
        if time is not None and time.reason is not None:
            if time.uneven and not rates:
                self._used.add(id(time.array))
                return Sampling(flags=(time.reason,), uneven=True)
            odd.append(time.reason)
            if time.uneven:
                self._used.add(id(time.array))
                odd.append(f"{numbers[0][1]} says {numbers[0][0]:.9g} Hz: neither is taken, no sampling rate is known")
                return Sampling(flags=tuple(odd))
        if not rates:
            return Sampling(flags=tuple(odd))
        if time is not None and time.rate_hz is not None:
            self._used.add(id(time.array))
        if max(rates) - min(rates) > SAME * min(rates):
            said = ", ".join(f"{source} says {rate:.9g} Hz" for rate, source in numbers)
            odd.append(f"{said}: none is taken, no sampling rate is known")
            return Sampling(flags=tuple(odd))
        start_s = 0.0 if time is None else time.start_s
        if time is not None and len(rates) == 1 and time.rate_hz is not None:
            return Sampling(time.rate_hz, time.raw_hz, start_s, numbers[0][1], tuple(odd))
        rate, raw = snap_rate(rates[0])
        return Sampling(rate, raw, start_s, numbers[0][1], tuple(odd))

    def _nearest_time(self, owner: Struct, array: Array) -> _Time | None:
        length = array.shape[array.time_axis]
        for struct in _upwards(owner):
            for other in struct.arrays:
                if other is array or not _is_called_time(other) or max(other.shape) != length:
                    continue
                if id(other) not in self._times:
                    self._times[id(other)] = _time_of(struct, other)
                return self._times[id(other)]
        return None


def _is_called_time(array: Array) -> bool:
    """Whether a vector has the name of a time; a capital T alone is a period or a temperature."""
    named = array.name.lower() in TIME_NAMES and array.name != "T"
    return named and array.is_vector and array.dtype.kind == "f" and max(array.shape) > 2


def rises_evenly(array: Array) -> float | None:
    """Rate that an array's first column would give, were it a time."""
    if array.time_axis != 0 or array.dtype.kind != "f" or array.shape[0] <= FIRST:
        return None
    steps = np.diff([array.sample(index) for index in range(FIRST)])
    if not (steps[0] > 0.0 and np.abs(steps - steps[0]).max() < 0.5 * steps[0]):
        return None  # as a rule known without unpacking more
    raster = raster_of_time_vector("time", _Vector(array))
    return raster[0] if isinstance(raster, tuple) and LOWEST_HZ <= raster[0] <= HIGHEST_HZ else None


def _upwards(struct: Struct | None) -> Iterator[Struct]:
    while struct is not None:
        yield struct
        struct = struct.parent


def _says_rate(name: str) -> bool:
    """Whether a number of that name is a sampling rate or interval."""
    return plain(name) in RATES | INTERVALS or name == SAMPLE_TIME


def _nearest_numbers(owner: Struct) -> tuple[list[tuple[float, str]], list[str]]:
    """Rates that numbers of the nearest structure give, and what is odd about them."""
    odd: list[str] = []
    for struct in _upwards(owner):
        found: list[tuple[float, str]] = []
        for place in (struct, *(below for below in struct.structs if plain(below.name) in AXES)):
            for name, text in place.texts:
                if _says_rate(name) and (doubt := thousands_doubt(text)) is not None:
                    odd.append(f"{place.path(name)!r}: {doubt}")
            texts = [(name, number_in(text)) for name, text in place.texts if thousands_doubt(text) is None]
            for name, number in [*place.numbers, *texts]:
                if number is None or not _says_rate(name):
                    continue
                rate = number if plain(name) in RATES else 1.0 / number if number > 0.0 else 0.0
                if LOWEST_HZ <= rate <= HIGHEST_HZ:
                    found.append((rate, f"{place.path(name)!r}"))
                else:
                    odd.append(f"{place.path(name)!r} is {number:.9g}: no sampling rate is taken from it")
        if found or odd:
            return found, odd
    return [], odd


def _time_of(struct: Struct, array: Array) -> _Time:
    path = struct.path(array.name)
    first, last = array.sample(0), array.sample(max(array.shape) - 1)
    if DATE_NUMBERS[0] < first < DATE_NUMBERS[1] and last - first < 1000.0:
        return _Time(array, path, reason=f"{path!r} looks like MATLAB's day numbers: no sampling rate is taken from it")
    raster = raster_of_time_vector(array.name, _Vector(array))
    if raster is None:
        return _Time(
            array,
            path,
            reason=f"{path!r} is called a time but does not rise, or is not finite: it gives no sampling rate",
        )
    if isinstance(raster, str):
        return _Time(array, path, reason=f"{path!r} is called a time but is not equidistant", uneven=True)
    rate, start_s, raw = float(raster[0]), float(raster[1]), None if raster[2] is None else float(raster[2])
    if not LOWEST_HZ <= rate <= HIGHEST_HZ:
        return _Time(array, path, reason=f"{path!r} would give {rate:.9g} Hz: it gives no sampling rate")
    return _Time(array, path, rate, raw, start_s)

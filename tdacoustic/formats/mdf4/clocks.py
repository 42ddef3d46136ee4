"""When the records of a group were sampled: its master channel against a straight line.

The ends of the master and places between them are looked at when a file is scanned, all of it where it is short;
whoever reads samples has every instant checked on the way.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.formats.mdf4.fields import Field
from tdacoustic.formats.mdf4.records import RecordReader
from tdacoustic.formats.rates import snap_rate
from tdacoustic.recording import Raster

__all__ = ["SECONDS", "Clock", "clock_of", "virtual_raster"]

Real = NDArray[np.float64]

SECONDS: Final = {"": 1.0, "s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}

EVEN: Final = 0.25
"""Part of a step by which an instant may be off the line [assumed]: well below half a step, beyond which order and
number of samples are in doubt."""

NOTABLE: Final = 0.01
"""Part of a step above which it is said."""

BREAKS: Final = 0.5
"""Part of a step by which an instant that was not looked at before may be off: beyond it reading ends."""

LATEST_S: Final = 1e11
"""Of an instant [assumed]: three thousand years, more than any clock counts from."""

WHOLE_BYTES: Final = 16 << 20
UNPACKED_BYTES: Final = 64 << 20
"""Unpacked at most for places between the ends: fewer are looked at where the packed blocks are long."""

PLACES: Final = 17
AROUND: Final = 64


@dataclass(frozen=True)
class Clock:
    """The line that a master channel follows.

    Parameters
    ----------
    field : Field
    factor : float
        From the master's unit to seconds.
    start_s, step_s : float
    rounding_s : float
        Of the stored instants.
    """

    field: Field
    factor: float
    start_s: float
    step_s: float
    rounding_s: float

    def first_break(self, first: int, times_s: Real) -> int | None:
        """Return the first sample that is off the line by more than `BREAKS` of a step, None where none is."""
        off = np.abs(times_s - (self.start_s + self.step_s * np.arange(first, first + len(times_s))))
        beyond = np.flatnonzero(~(off <= BREAKS * self.step_s + self.rounding_s))
        return first + int(beyond[0]) if len(beyond) else None

    def times_s(self, records: NDArray[np.uint8]) -> Real:
        """Return the instants of records."""
        return _scaled(self.field.values(records, None), self.factor)


def clock_of(reader: RecordReader, field: Field, unit: str | None) -> tuple[Clock, Raster, str | None] | str:
    """Return the clock of a group, its raster and what is odd about it.

    Returns
    -------
    (Clock, Raster, str or None) or str
        Why there is no raster, where that is so: words that follow "its instants".
    """
    factor = SECONDS.get((unit or "").strip().lower())
    if factor is None:
        return f"are in {unit!r}, not in seconds"
    n_records = reader.records.n_records
    at, times = _looked_at(reader, field, factor)
    start, end = float(times[0]), float(times[-1])
    if not np.isfinite(times).all():
        return "are no numbers"
    if float(np.abs(times).max()) > LATEST_S:
        return f"reach from {start:.3g} s to {end:.3g} s"
    if n_records == 1:
        return Clock(field, factor, start, 1.0, 1.0), Raster(None, 1, start), "one sample: it has no sampling rate"
    step = (end - start) / (n_records - 1)
    if not step > 1e-12:
        return f"do not increase: from {start:.9g} s to {end:.9g} s over {n_records} samples"
    off = float(np.abs(times - (start + step * at)).max())
    if off > NOTABLE * step:
        start, step, off = _fitted(at, times, start, step)
    rounding = min(_rounding(field, factor, times), step)
    if off > EVEN * step + rounding:
        return _spread(at, times, step, off)
    if step <= 4.0 * np.spacing(max(abs(start), abs(end))):
        return f"are a step of {step:.3g} s apart, which cannot be told from their rounding"
    rate, raw = snap_rate(1.0 / step, min(1e-4, (2.0 * off + rounding) / (step * n_records)))
    flag = "two samples: whether they are of an even raster cannot be told" if n_records == 2 else None
    if off > NOTABLE * step:
        flag = f"its instants are off an even raster by up to {off:.3g} s, {off / step:.2f} of a step: taken as even"
    return Clock(field, factor, start, step, rounding), Raster(rate, n_records, start, raw), flag


def _fitted(at: NDArray[np.int64], times_s: Real, start_s: float, step_s: float) -> tuple[float, float, float]:
    """Return start, step and largest distance of the line that fits best: the ends jitter as the others do."""
    rest = times_s - (start_s + step_s * at)
    middle = at - at.mean()
    square = float(middle @ middle)
    more = float(middle @ rest) / square if square > 0.0 else 0.0
    start, step = start_s + float(rest.mean()) - more * float(at.mean()), step_s + more
    return start, step, float(np.abs(times_s - (start + step * at)).max())


def _scaled(times: Real, factor: float) -> Real:
    with np.errstate(all="ignore"):  # whatever a damaged master holds is refused later
        return times * factor


def _looked_at(reader: RecordReader, field: Field, factor: float) -> tuple[NDArray[np.int64], Real]:
    """Return the numbers of some samples, the first and the last among them, and their instants."""
    n_records = reader.records.n_records
    step = max(1, WHOLE_BYTES // 4 // reader.records.record_bytes)
    if n_records * reader.records.record_bytes <= WHOLE_BYTES:
        spans = [(first, min(first + step, n_records)) for first in range(0, n_records, step)]
    else:
        around = max(1, min(AROUND, step))
        n_places = max(3, min(PLACES, UNPACKED_BYTES // max(1, reader.records.longest_packed)))
        spans = [
            (int(first), int(first) + around)
            for first in np.unique(np.linspace(0, n_records - around, n_places).astype(np.int64))
        ]
    times = [_scaled(field.values(reader.read(first, last)[0], None), factor) for first, last in spans]
    at = np.concatenate([np.arange(first, last) for first, last in spans])
    return at, np.concatenate(times)


def _rounding(field: Field, factor: float, times_s: Real) -> float:
    """Half the distance of neighbouring numbers that the master can hold, in seconds."""
    line = field.conversion.line
    largest = float(np.abs(times_s).max())
    rounding = float(np.spacing(largest))
    if line is not None:
        scale = abs(line[0]) * factor
        held = (
            float(np.spacing(np.dtype(f"f{field.bit_count // 8}").type(largest / scale))) if field.kind == "f" else 1.0
        )
        rounding = max(rounding, scale * held)
    return 0.5 * rounding


def _spread(at: NDArray[np.int64], times_s: Real, step_s: float, off_s: float) -> str:
    steps = np.diff(times_s)[np.diff(at) == 1]
    if not len(steps):
        return f"are off an even raster by up to {off_s:.3g} s"
    return (
        f"are not even: steps from {steps.min():.3g} s to {steps.max():.3g} s, {step_s:.3g} s in the mean, off an even "
        f"raster by up to {off_s:.3g} s; they are not resampled silently"
    )


def virtual_raster(field: Field, unit: str | None, n_records: int) -> Raster | str:
    """Return the raster of a master that is computed from the number of the record.

    Returns
    -------
    Raster or str
        As `clock_of`.
    """
    factor = SECONDS.get((unit or "").strip().lower())
    if factor is None:
        return f"are in {unit!r}, not in seconds"
    line = field.conversion.line
    if line is None:
        return "are computed from the number of the sample by a conversion that is not linear"
    step, start = line[0] * factor, line[1] * factor
    if not (1e-12 < step < LATEST_S and abs(start) < LATEST_S):
        return f"do not increase: a step of {step:.9g} s"
    rate, raw = snap_rate(1.0 / step)
    return Raster(rate, n_records, start, raw)

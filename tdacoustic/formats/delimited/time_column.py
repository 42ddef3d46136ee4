"""The time column of a text, and the sampling rates that its heading states."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FormatError
from tdacoustic.formats.delimited.layout import Layout
from tdacoustic.formats.rates import thousands_doubt

__all__ = [
    "TimeAxis",
    "TimeCheck",
    "claimed_rows",
    "find_time_field",
    "is_counter",
    "nanoseconds_of",
    "seconds_of",
    "stated_rate_hz",
    "stated_start",
    "written_resolution",
]

TIME_NAMES = frozenset(
    {
        *("time", "zeit", "t", "temps", "tiempo", "tempo", "timestamp", "zeitstempel", "elapsedtime", "timeaxis"),
        *("zeitachse", "reltime", "relativetime", "datetime", "dateandtime", "datumzeit", "datumuhrzeit", "date"),
        *("datum", "testtime", "sampletime"),
    }
)
WEAK_TIME_NAMES = frozenset({"x", "xvalue", "xvalues", "xaxis", "abscissa"})
COUNTER_NAMES = frozenset(
    {"index", "sample", "samples", "sampleno", "samplenumber", "nr", "no", "n", "row", "zeile", "point", "lfdnr"}
)
TIME_UNITS = {
    "s": 1.0,
    "sec": 1.0,
    "sek": 1.0,
    "seconds": 1.0,
    "ms": 1e-3,
    "us": 1e-6,
    "µs": 1e-6,
    "μs": 1e-6,
    "min": 60.0,
    "h": 3600.0,
}
ISO_MOMENT = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(?::\d\d(?:[.,]\d+)?)?(?:Z|[+-]\d\d:?\d\d)?")
RATE_KEYS = re.compile(
    r"(sampl(?:e|ing)(?:rate|frequency|freq)|abtast(?:rate|frequenz)|fs|samplespersecond|frequencesampling)(hz|khz)?"
)
INTERVAL_KEYS = re.compile(
    r"(sampl(?:e|ing)(?:interval|period)|dt|deltat|deltax|timestep|(?:wf|x)?increment|abtastintervall)(s|ms|us)?"
)
"""What can mean nothing else: a sampling time may be that of the whole measurement, ``t_s`` any time in seconds."""
ROW_KEYS = re.compile(r"(?:number|no|num|n|anzahl)?(?:of|der)?(?:samples|datapoints|messwerte|rows)")
START_KEYS = re.compile(
    r"(?:start|date|datum|recorded|measured|trigger|begin)(?:time|date|datetime|zeit)?|datetime|timestamp|acquisitiontime"
)
RATE_UNITS = {
    "": 1.0,
    "hz": 1.0,
    "khz": 1e3,
    "s/s": 1.0,
    "sps": 1.0,
    "1/s": 1.0,
    "samples/s": 1.0,
    "ks/s": 1e3,
    "mhz": 1e6,
}


def _plain(name: str | None) -> str:
    return re.sub(r"[\W_]", "", (name or "").lower())


def find_time_field(layout: Layout) -> tuple[int, float, str, bool] | None:
    """Which field is a time.

    Returns
    -------
    (int, float, str, bool) or None
        Field, seconds per unit, ``"number"`` or ``"moment"``, and whether the name leaves no doubt.
    """
    for field, name in enumerate(layout.names):
        plain, unit = _plain(name), (layout.units[field] or "").strip().lower()
        if unit == "" and (match := re.fullmatch(r"(time|zeit|t)(s|ms|us)", plain)) and name != plain:
            plain, unit = match[1], match[2]
        strong = plain in TIME_NAMES
        if not strong and plain not in WEAK_TIME_NAMES:
            continue
        if _is_moment(layout, field):
            return field, 1.0, "moment", True
        if layout.numeric[field] and (unit in TIME_UNITS or unit in ("", "-")):
            return field, TIME_UNITS.get(unit, 1.0), "number", strong and plain not in ("date", "datum")
    for field in range(layout.n_fields):
        if _is_moment(layout, field):
            return field, 1.0, "moment", True
    return None


def _is_moment(layout: Layout, field: int) -> bool:
    cells = [row[field] for row in layout.first_cells]
    return not layout.numeric[field] and all(ISO_MOMENT.fullmatch(cell.strip('"')) for cell in cells)


def is_counter(layout: Layout, field: int) -> bool:
    """Whether a column only counts the rows: called an index, and rising by one."""
    if _plain(layout.names[field]) not in COUNTER_NAMES and layout.names[field] != "#":
        return False
    cells = [row[field] for row in layout.first_cells]
    if len(cells) < 2 or not all(cell.isdigit() for cell in cells):
        return False
    return all(int(after) - int(before) == 1 for before, after in pairwise(cells))


def nanoseconds_of(cells: Iterable[str]) -> NDArray[np.datetime64]:
    """Moments (UTC where they carry an offset) of ISO 8601 texts; NaT where a cell is none."""
    import pandas

    text = pandas.Series(list(cells), dtype="str").str.strip('" ').str.replace(",", ".", regex=False)
    moments = pandas.to_datetime(text, format="ISO8601", utc=True, errors="coerce")
    return moments.dt.tz_localize(None).to_numpy().astype("datetime64[ns]")


def seconds_of(cells: Iterable[str], origin: np.datetime64) -> NDArray[np.float64]:
    """Seconds from a moment to those of ISO 8601 texts; NaN where a cell is none."""
    return np.asarray((nanoseconds_of(cells) - origin) / np.timedelta64(1, "s"), dtype=np.float64)


def written_resolution(cells: Sequence[str]) -> float:
    """Half a unit of the last digit with which the finest of some numbers is written.

    Examples
    --------
    >>> written_resolution(["0.0", "0.125"])
    0.0005
    """
    finest = 1.0
    for cell in cells:
        moment = ISO_MOMENT.fullmatch(cell.strip('"'))
        text = re.sub(r"^.*:\d\d", "", re.sub(r"(Z|[+-]\d\d:?\d\d)$", "", cell)) if moment else cell
        match = re.fullmatch(r"[^.,]*(?:[.,](\d*))?(?:[eE]([+-]?\d+))?", text.strip('" '))
        if match is not None:
            finest = min(finest, 10.0 ** (int(match[2] or 0) - len(match[1] or "")))
    return 0.5 * finest


@dataclass(frozen=True)
class TimeAxis:
    """An equidistant time column: ``time = start + step * row``, in its own unit.

    Parameters
    ----------
    field : int
    kind : str
        ``"number"`` or ``"moment"``.
    start, step : float
        Moments in seconds after `origin`.
    resolution : float
        Half a unit of the last digit written.
    origin : datetime64 or None
    """

    field: int
    kind: str
    start: float
    step: float
    resolution: float
    origin: np.datetime64 | None = None


class TimeCheck:
    """Checks the time column while rows are read.

    Parameters
    ----------
    path : Path
    axis : TimeAxis
    first_line : int
        Line of row 0.
    by_step_only : bool
        Compare neighbours alone, not the distance to the straight line.
    """

    def __init__(self, path: Path, axis: TimeAxis, first_line: int, by_step_only: bool = False) -> None:
        self.path, self.axis, self.first_line, self.by_step_only = path, axis, first_line, by_step_only
        self._last: float | None = None

    def __call__(self, row: int, times: NDArray[np.float64]) -> None:
        """Check the times of the rows from `row` on.

        Raises
        ------
        FormatError
            A step differs from the column's by more than half a sample; names the line.
        """
        axis = self.axis
        expected = axis.start + axis.step * np.arange(row, row + len(times))
        float_rounding = 4 * np.finfo(np.float64).eps * float(np.abs(expected).max(initial=0.0))
        room = 0.5 * axis.step + 1.001 * axis.resolution + float_rounding
        before = times[0] - axis.step if self._last is None else self._last
        steps = np.diff(times, prepend=before)
        bad = ~(np.abs(steps - axis.step) <= room + axis.resolution + float_rounding)
        if not self.by_step_only:
            bad |= ~(np.abs(times - expected) <= room)
        if bad.any():
            at = int(np.argmax(bad))
            raise FormatError(
                f"{self.path}: line {self.first_line + row + at}: the time column is not equidistant: "
                f"{times[at]:.9g} follows {times[at] - steps[at]:.9g}, "
                f"the step elsewhere is {axis.step:.9g}"
            )
        self._last = float(times[-1]) if len(times) else self._last


def _stated(layout: Layout, keys: re.Pattern[str]) -> list[tuple[str, str]]:
    """(unit in the key, value) of the lines of the heading whose key is one of `keys`."""
    found = []
    for key, value in layout.metadata:
        match = keys.fullmatch(_plain(key))
        if match is not None:
            found.append(((match.groups() or ("",))[-1] or "", value))
    return found


def _number_and_unit(value: str) -> tuple[float, str] | None:
    cells = [cell for cell in re.split(r"[\t;]|,(?=\s)", value) if cell.strip()]
    if not cells or any(cell.strip() != cells[0].strip() for cell in cells[1:] if re.match(r"\s*[\d.]", cell)):
        return None
    unit_cell = cells[1].strip() if len(cells) > 1 and not re.match(r"\s*[\d.]", cells[1]) else ""
    match = re.fullmatch(r"([+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)\s*\[?([^\d\]]*[^\]]*?)\]?", cells[0].strip())
    if match is None:
        return None
    return float(match[1].replace(",", ".")), (match[2] or unit_cell).strip("[] ").lower()


def stated_rate_hz(layout: Layout) -> tuple[float | None, tuple[str, ...]]:
    """Sampling rate that the lines above the heading state, and what is odd about them."""
    rates: list[float] = []
    for keys, units in ((RATE_KEYS, RATE_UNITS), (INTERVAL_KEYS, {"": 1.0, **TIME_UNITS})):
        for unit_in_key, value in _stated(layout, keys):
            doubt = thousands_doubt(f"{value} {unit_in_key}")
            if doubt is not None:
                return None, (f"the heading states a sampling rate: {doubt}",)
            parsed = _number_and_unit(value)
            factor = None if parsed is None else units.get(parsed[1] or unit_in_key)
            if parsed is None or factor is None or not parsed[0] > 0.0:
                return None, (f"the heading states a sampling rate that is not understood: {value!r}",)
            number = parsed[0] * factor
            rates.append(number if keys is RATE_KEYS else 1.0 / number)
    if not rates:
        return None, ()
    if max(rates) - min(rates) > 1e-5 * max(rates):
        shown = ", ".join(f"{rate:.9g}" for rate in rates)
        return None, (f"the heading states several sampling rates ({shown} Hz): none is taken",)
    return rates[0], ()


def claimed_rows(layout: Layout) -> int | None:
    """Number of rows that the lines above the heading claim, None where they do not or differ."""
    claims = {value.split()[0] for _, value in _stated(layout, ROW_KEYS)}
    claim = claims.pop() if len(claims) == 1 else ""
    return int(claim) if claim.isdigit() else None


def stated_start(layout: Layout) -> str | None:
    """Date and time of the start that the lines above the heading state, as ISO 8601."""
    for _, value in _stated(layout, START_KEYS):
        if ISO_MOMENT.fullmatch(value):
            try:
                return datetime.fromisoformat(value).isoformat()
            except ValueError:
                continue
    return None

"""Reduced copies that loggers write beside a channel, for quick views: they are no channels.

LabVIEW SignalExpress writes each signal into a group ``... - All Data`` and copies of
it into ``... - Decimated Data_Level1``, ``_Level2`` (a file of its own in npTDMS's
tests: 20000, 400 and 8 values). Other programs say ``reduced``, ``preview``,
``envelope`` and the like [assumed]. A name alone proves nothing: rate, length and the
first values are compared with those of the original.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FormatError
from tdacoustic.formats.tdms.channels import Found, Inventory

__all__ = ["leave_out_copies"]

Read = Callable[[Found, int, int], NDArray[np.float64]]

MARK: Final = re.compile(
    r"[\s_\-.(\[]*\b(?:decimated|decimation|dezimiert|downsampled|down-sampled|subsampled|reduced|reduziert|preview"
    r"|overview|envelope|min[ /_-]?max)(?:[ _-]?data)?(?:[ _-]?level[ _-]?\d*|[ _-]?\d+)?(?!\w)[)\]]*",
    re.IGNORECASE,
)
"""What makes a group's or a channel's name that of a copy; underscores are taken for blanks before."""

CLEAR: Final = re.compile(r"\b(?:decimated|downsampled|down-sampled|subsampled|preview)(?!\w)", re.IGNORECASE)
"""Words that say so even where no original is in the file."""

WHOLE: Final = re.compile(r"[\s_\-.(\[]*\b(?:all|full|raw|original)(?:[ _-]?data)?\b[)\]]*", re.IGNORECASE)
"""What the original's name has in its place."""

MISSING_ORIGINAL: Final = "its name says that it is a reduced copy; what it was taken from is not in the file"
COMPARED: Final = 32
MAX_READ: Final = 1 << 16
"""Values of the original that are read for one copy."""

MAX_READ_IN_ALL: Final = 1 << 22
"""Beyond it name, rate and length have to do [assumed]: a scan stays quick."""

SLACK: Final = 1e-6
"""Of the range of the original's values: rounding of a copy in single precision [assumed]."""


def leave_out_copies(inventory: Inventory, read: Read) -> None:
    """Leave out what is called a reduced copy and is one; flag what is only called so.

    Parameters
    ----------
    inventory : Inventory
        Changed in place.
    read : callable
        Values of a channel, from one to another; a few thousand are asked for.
    """
    called = [item for item in inventory.found if _is_called_copy(item)]
    originals: dict[tuple[str, str], list[Found]] = {}
    for item in inventory.found:
        originals.setdefault(_stem(item), []).append(item)
    gone: set[int] = set()
    budget = [MAX_READ_IN_ALL]
    for item in called:
        candidates = [other for other in originals[_stem(item)] if other is not item and not _is_called_copy(other)]
        if not candidates:
            if CLEAR.search(_parted(f"{item.group} {item.channel}")):
                item.flags.append(MISSING_ORIGINAL)
            continue
        reasons = []
        for other in candidates:
            times, reason = _compare(item, other, read, budget)
            if reason is None:
                inventory.left_out.setdefault(
                    f"a copy of {other.label} reduced {times} times, not a channel", []
                ).append(f"{item.group}/{item.channel}")
                gone.add(id(item))
                break
            reasons.append(f"it is not one of {other.label}: {reason}")
        else:
            item.flags.append(f"its name says that it is a reduced copy, but {reasons[0]}")
    inventory.found = [item for item in inventory.found if id(item) not in gone]


def _parted(name: str) -> str:
    return name.replace("_", " ")


def _is_called_copy(item: Found) -> bool:
    return MARK.search(_parted(item.group)) is not None or MARK.search(_parted(item.channel)) is not None


def _stem(item: Found) -> tuple[str, str]:
    """Group and channel without the words that tell copies and originals apart."""
    group, channel = (WHOLE.sub("", MARK.sub("", _parted(name))).strip().lower() for name in (item.group, item.channel))
    return group, channel


def _compare(copy: Found, original: Found, read: Read, budget: list[int]) -> tuple[int, str | None]:
    """How many times a copy is reduced, and why it is no copy, None if it is one."""
    rate, whole = copy.timing.rate_hz, original.timing.rate_hz
    options = [round(original.n_values / copy.n_values)]
    if rate is not None and whole is not None:
        ratio = whole / rate
        if ratio < 1.5 or abs(ratio - round(ratio)) > 1e-4 * ratio:
            return 0, f"its rate {rate:.9g} Hz is no whole part of {whole:.9g} Hz"
        # the two extremes of an interval may be stamped with the interval
        options = [round(ratio), *([round(ratio) // 2] if round(ratio) % 2 == 0 else [])]
    fitting = [times for times in options if times > 1 and _length_fits(copy.n_values, original.n_values, times)]
    if not fitting:
        return 0, f"it has {copy.n_values} values where {original.label} has {original.n_values}"
    times = fitting[0]
    n = min(copy.n_values, COMPARED, max(2, MAX_READ // (2 * times)))
    stop = min(original.n_values, (n + n % 2) * times)
    budget[0] -= stop
    if stop > MAX_READ or budget[0] < 0:
        return times, None
    try:
        low, high, spread = _ranges(read(original, 0, stop), times)
        values = read(copy, 0, n)
    except FormatError as error:
        return 0, f"their values cannot be compared ({error})"[:300]
    intervals = np.minimum(np.arange(n) // 2, len(low) - 1)  # two neighbours may be the extremes of one interval
    outside = ~((values >= low[intervals] - SLACK * spread) & (values <= high[intervals] + SLACK * spread))
    if outside.any():
        at = int(np.argmax(outside))
        where = f"{low[intervals[at]]:.6g} to {high[intervals[at]]:.6g}"
        return 0, f"its value {at} is {values[at]:.6g}, those of the other there are {where}"
    return times, None


def _length_fits(n_copy: int, n_original: int, times: int) -> bool:
    """Whether a copy has one value for each so many of the original; two more or less at the end."""
    return abs(n_copy - n_original / times) <= 2.0 + 0.001 * n_copy


def _ranges(values: NDArray[np.float64], times: int) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Smallest and largest value of each interval of two reductions, and of all together."""
    starts = np.arange(0, len(values), 2 * times)
    low, high = np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)
    return low, high, float(high.max() - low.min())

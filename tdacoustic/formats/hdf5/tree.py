"""Which datasets of an HDF5 file can be channels; nothing outside the file is touched."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from tdacoustic.formats.hdf5.attributes import Attributes
from tdacoustic.formats.rates import snap_rate

__all__ = [
    "MAX_COLUMNS",
    "NOT_RISING",
    "TIME_NAMES",
    "Tree",
    "is_called_time",
    "raster_of_time_vector",
    "read_tree",
    "reason_to_skip",
    "skipped_flags",
]

MAX_COLUMNS = 1024
MAX_OBJECTS = 100_000
MAX_DEPTH = 32
MAX_CHUNK_BYTES = 256 << 20
"""A chunk is unpacked whole, whatever is asked of it."""

MAX_UNPACKING = 2000
"""Bytes that a stored byte may stand for; deflate makes at most 1032 of one."""

ALWAYS_ALLOWED_BYTES = 64 << 20
"""A dataset of no more than this is read however little of it is stored."""

NAMES_IN_A_FLAG = 5
TIME_NAMES = frozenset({"time", "t", "times", "time_s", "t_s", "zeit", "temps", "timestamps", "time_axis"})
SECONDS = {"s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6}
PROBES = 64
NOT_RISING = "is called a time but does not rise, or is not finite: it gives no sampling rate"


@dataclass(frozen=True)
class Tree:
    """Names of the datasets that can be channels, in the file's order, and what was left out."""

    datasets: tuple[str, ...]
    flags: tuple[str, ...]


def read_tree(file: Any, leave_out: Callable[[str, Any], str | None] | None = None) -> Tree:
    """Walk a file's hard links.

    Parameters
    ----------
    file : h5py.File
    leave_out : callable, optional
        Given the name and the object of a group or a dataset: why it is left out, "" where that is not worth a flag,
        None where it is not. Without it, `reason_to_skip` of datasets.

    Returns
    -------
    Tree
    """
    import h5py

    datasets: list[str] = []
    skipped: dict[str, list[str]] = {}
    seen: set[Any] = {h5py.h5o.get_info(file.id).addr}
    pending = [("", file["/"])]
    count = 0
    while pending:
        prefix, group = pending.pop()
        below = []
        for key in group:
            name = f"{prefix}{key}"
            count += 1
            if count > MAX_OBJECTS:
                return Tree(
                    tuple(datasets), (*skipped_flags(skipped), f"more than {MAX_OBJECTS} objects: the rest is not read")
                )
            if not isinstance(group.get(key, getlink=True), h5py.HardLink):
                skipped.setdefault("are links and were not followed", []).append(name)
                continue
            item = group[key]
            address = h5py.h5o.get_info(item.id).addr
            if address in seen:
                skipped.setdefault("are second names of what was read already", []).append(name)
                continue
            seen.add(address)
            left_out = None if leave_out is None else leave_out(name, item)
            if left_out is not None:
                if left_out:
                    skipped.setdefault(left_out, []).append(name)
            elif isinstance(item, h5py.Group):
                if name.count("/") >= MAX_DEPTH:
                    skipped.setdefault(f"are nested more than {MAX_DEPTH} deep", []).append(name)
                else:
                    below.append((f"{name}/", item))
            elif isinstance(item, h5py.Dataset):
                reason = reason_to_skip(item) if leave_out is None else None
                if reason is None:
                    datasets.append(name)
                else:
                    skipped.setdefault(reason, []).append(name)
        pending.extend(reversed(below))
    return Tree(tuple(datasets), skipped_flags(skipped))


def skipped_flags(skipped: dict[str, list[str]]) -> tuple[str, ...]:
    """One sentence for each reason why something was left out: reason -> names."""
    flags = []
    for reason, names in skipped.items():
        shown = ", ".join(names[:NAMES_IN_A_FLAG]) + (", ..." if len(names) > NAMES_IN_A_FLAG else "")
        flags.append(f"{len(names)} skipped, they {reason}: {shown}")
    return tuple(flags)


def reason_to_skip(dataset: Any) -> str | None:
    """Why a dataset can be no channel, None if it can."""
    if dataset.is_virtual:
        return "are virtual: their data lie in other files"
    if dataset.external:
        return "have their data in other files"
    if dataset.dtype.kind not in "iufb" or dataset.dtype.metadata:
        return "are not numeric"
    if dataset.shape is None or dataset.ndim == 0:
        return "are single values"
    if dataset.ndim > 2:
        return "have more than two dimensions"
    if max(dataset.shape) < 2 or min(dataset.shape) < 1:
        return "have fewer than two samples"
    if dataset.ndim == 2 and min(dataset.shape) > MAX_COLUMNS:
        return f"are matrices of more than {MAX_COLUMNS} columns"
    return _reason_of_packing(dataset)


def _reason_of_packing(dataset: Any) -> str | None:
    """Why a dataset cannot be unpacked within bounds and with what HDF5 itself has, None if it can."""
    import h5py

    layout = dataset.id.get_create_plist()
    for index in range(layout.get_nfilters()):
        code = layout.get_filter(index)[0]
        if not h5py.h5z.filter_avail(code):
            return (
                f"are packed with filter {code}, which is not part of HDF5, and no program is loaded for it; "
                "repack them with h5repack -f GZIP=4"
            )
    if dataset.chunks and math.prod(dataset.chunks) * dataset.dtype.itemsize > MAX_CHUNK_BYTES:
        return f"have chunks of more than {MAX_CHUNK_BYTES >> 20} MiB"
    claimed = math.prod(dataset.shape) * dataset.dtype.itemsize
    if claimed > max(ALWAYS_ALLOWED_BYTES, MAX_UNPACKING * int(dataset.id.get_storage_size())):
        return "claim more than the bytes stored for them can hold"
    return None


def is_called_time(name: str, dataset: Any) -> bool:
    """Whether a dataset has the name of a time and is not in another unit; a capital T alone is a temperature."""
    own = name.rpartition("/")[2]
    return own.lower() in TIME_NAMES and own != "T" and dataset.dtype.kind == "f" and _seconds(dataset) is not None


def _seconds(dataset: Any) -> float | None:
    """Seconds of the unit, None where it is no time."""
    return SECONDS.get((Attributes(dataset).text("unit", "units", "wf_yunit") or "s").lower())


def raster_of_time_vector(name: str, dataset: Any) -> tuple[float, float, float | None] | str | None:
    """Rate, start and raw rate that a vector gives which `is_called_time`.

    Only its ends and `PROBES` places between them are read.

    Returns
    -------
    (float, float, float or None), str or None
        A sentence where it is not equidistant; None where it does not rise, or is not finite.
    """
    factor = _seconds(dataset) or 1.0
    n_samples = len(dataset)
    at = np.unique(np.linspace(0, n_samples - 1, min(PROBES, n_samples)).round().astype(np.int64))
    ends = np.arange(min(PROBES, n_samples))
    at = np.unique(np.concatenate([ends, at, n_samples - 1 - ends]))
    probes = np.array([dataset[int(index)] for index in at], dtype=np.float64)
    step = (probes[-1] - probes[0]) / (n_samples - 1)
    if not np.isfinite(probes).all() or not step > 0.0:
        return None
    deviation = np.abs(probes - (probes[0] + step * at))
    neighbours = np.diff(at) == 1
    jump = np.abs(np.diff(probes)[neighbours] - step)
    if deviation.max() > 0.5 * step or (jump.size and jump.max() > 0.5 * step):
        if name.rpartition("/")[2].lower() == "temps" and np.diff(probes).min() < 0.0:
            return None  # not the French time, but temperatures
        return f"{name!r} is called a time but is not equidistant: it gives no sampling rate"
    rounding = float(np.finfo(dataset.dtype).eps) * float(np.abs(probes).max()) / (probes[-1] - probes[0])
    rate, raw = snap_rate(1.0 / (step * factor), rounding)
    return rate, float(probes[0]) * factor, raw

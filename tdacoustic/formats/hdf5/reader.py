"""HDF5: our own layout, and any other file of numeric datasets.

The documented layout, ``tdacoustic-log/1``:

* root attributes ``schema = "tdacoustic-log/1"`` and optionally ``start_time`` (ISO 8601);
* each channel a one-dimensional dataset anywhere in the file, its name the path
  without the leading slash, with the attributes ``unit``, ``sample_rate_hz`` and
  optionally ``quantity`` (one of `tdacoustic.units.QUANTITIES`), ``start_s``,
  ``scale`` and ``offset`` (value in `unit` = stored * scale + offset), ``description``.

In any other file every numeric dataset of one dimension is a channel, and every
one of two dimensions one channel per column, ``path[1]``, ``path[2]``, ..., with
time along the longer axis (or along the axis that an attribute ``time_axis``, 0
or 1, names). Rate and unit come from attributes under the usual names, on the
dataset or on the groups above it. An equidistant dataset called ``time`` or ``t``
gives its neighbours of the same length their rate.

Nothing is read from outside the file: soft and external links, virtual datasets
and external storage are skipped with a flag. No filter is loaded from a folder of
plugins, and what a dataset claims is held against what is stored for it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FormatError
from tdacoustic.formats.blocks import check_request, rebuffered
from tdacoustic.formats.bounds import MAX_CHANNELS
from tdacoustic.formats.hdf5 import guard
from tdacoustic.formats.hdf5.attributes import Attributes
from tdacoustic.formats.hdf5.tree import Tree, read_tree
from tdacoustic.recording import Log, LogChannel, Raster
from tdacoustic.units import QUANTITIES, quantity_of_unit

__all__ = ["Hdf5Reader", "Source", "forbid_plugins", "opened", "scan_file", "scan_here"]

SCHEMA = "tdacoustic-log/1"
SLAB_BYTES = 8 << 20
"""What is read at a time from all datasets together, so that no packed chunk is unpacked twice."""

MAX_SLAB_BYTES = 192 << 20
"""Where packed chunks are so long that one of each would exceed this, they are unpacked more than once."""


@dataclass(frozen=True)
class Source:
    """Where a channel's samples lie, and ``value = stored * scale + offset``.

    Parameters
    ----------
    dataset : str
        Path in the file.
    n_samples : int
    time_axis : int
    column : int or None
        None for a one-dimensional dataset.
    scale, offset : float
    """

    dataset: str
    n_samples: int
    time_axis: int = 0
    column: int | None = None
    scale: float = 1.0
    offset: float = 0.0


def forbid_plugins() -> None:
    """Take away the folders in which HDF5 looks for filters: what a file names there would be loaded and run.

    For the whole process; a filter that its program has registered with the library itself is still used.
    """
    import h5py

    while h5py.h5pl.size():
        h5py.h5pl.remove(0)


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    """Open the file, and turn what h5py raises into one clear error."""
    import h5py

    forbid_plugins()
    try:
        with h5py.File(path, "r", locking="best-effort") as file:
            yield file
    except FormatError:
        raise
    except (OSError, RuntimeError, KeyError, ValueError) as error:
        text = " ".join(str(error).split())
        word = "truncated" if "truncated" in text else "damaged"
        raise FormatError(f"{path}: {word} HDF5 file ({text})") from error


@dataclass(frozen=True)
class Hdf5Reader:
    """Reads blocks of datasets."""

    path: Path
    sources: tuple[Source, ...]

    def blocks(self, columns: Sequence[int], start: int, stop: int, block_size: int) -> Iterator[NDArray[np.float64]]:
        """Yield float64 arrays of shape (len(columns), n); see `tdacoustic.recording.log.Reader`.

        Raises
        ------
        FormatError
            A dataset ends before `stop`, or cannot be read.
        """
        chosen = [self.sources[column] for column in columns]
        check_request(self.path, min((source.n_samples for source in chosen), default=0), start, stop, block_size)
        rows: dict[str, list[int]] = {}
        for row, source in enumerate(chosen):
            rows.setdefault(source.dataset, []).append(row)
        with opened(self.path) as file:
            parts = [
                rebuffered(self._slabs(file, [chosen[row] for row in members], start, stop, len(rows)), block_size)
                for members in rows.values()
            ]
            if len(parts) == 1:
                yield from parts[0]
                return
            order = np.argsort([row for members in rows.values() for row in members])
            as_asked = bool((order == np.arange(order.size)).all())
            for pieces in zip(*parts, strict=True):
                joined = np.concatenate(pieces)
                yield joined if as_asked else joined[order]

    def _slabs(
        self, file: Any, sources: Sequence[Source], start: int, stop: int, n_datasets: int
    ) -> Iterator[NDArray[np.float64]]:
        """Yield the values of one dataset's channels, in steps of whole chunks."""
        dataset = file.get(sources[0].dataset)
        axis = sources[0].time_axis
        if dataset is None or dataset.ndim <= axis or dataset.shape[axis] < stop:
            held = 0 if dataset is None else dataset.shape[axis]
            raise FormatError(
                f"{self.path}: dataset {sources[0].dataset!r} holds {held} samples, {stop} were asked for: "
                "the file has changed"
            )
        first_column, last_column = _span_of_columns(sources)
        row_bytes = dataset.dtype.itemsize * (last_column - first_column)
        rows = max(1, SLAB_BYTES // (n_datasets * row_bytes))
        if dataset.chunks and dataset.id.get_create_plist().get_nfilters():
            chunk = dataset.chunks[axis]
            rows = min(max(chunk, rows // chunk * chunk), max(1, MAX_SLAB_BYTES // (n_datasets * row_bytes)))
        scale = np.array([[source.scale] for source in sources])
        offset = np.array([[source.offset] for source in sources])
        scaled = bool(np.any(scale != 1.0) or np.any(offset != 0.0))
        position = start
        while position < stop:
            end = min(stop, (position // rows + 1) * rows)
            if sources[0].column is None:
                stored = dataset[position:end][np.newaxis]
                picked = list(range(len(sources))) if len(sources) == 1 else [0] * len(sources)
            else:
                picked = [(source.column or 0) - first_column for source in sources]
                if axis == 0:
                    stored = dataset[position:end, first_column:last_column].T
                else:
                    stored = dataset[first_column:last_column, position:end]
            values = np.array(
                stored[picked] if len(picked) > 1 else stored[picked[0] : picked[0] + 1], dtype=np.float64
            )
            yield values * scale + offset if scaled else values
            position = end


def _span_of_columns(sources: Sequence[Source]) -> tuple[int, int]:
    columns = [source.column for source in sources if source.column is not None]
    return (min(columns), max(columns) + 1) if columns else (0, 1)


def scan_file(path: Path) -> Log:
    """Read the tree and the attributes of an HDF5 file.

    Returns
    -------
    Log

    Raises
    ------
    FormatError
        Truncated, damaged, or without any dataset that could be a channel.
    """
    guard.examine(path, "hdf5")
    return scan_here(path)


def scan_here(path: Path) -> Log:
    """Do what `scan_file` does, in this process and without a guard."""
    with opened(path) as file:
        tree = read_tree(file)
        root = Attributes(file)
        schema = root.text("schema")
        ours = schema == SCHEMA
        flags = list(tree.flags)
        if schema is not None and schema.startswith("tdacoustic-log/") and not ours:
            flags.append(f"schema is {schema!r}; this version knows {SCHEMA!r}")
        times = {} if ours else _time_vectors(file, tree, flags)
        vectors = {vector for vector, _, _, _ in times.values()}
        channels: list[LogChannel] = []
        sources: list[Source] = []
        for name in tree.datasets:
            if name not in vectors:
                _add(path, file, name, times, ours, channels, sources)
            if len(channels) > MAX_CHANNELS:
                raise FormatError(f"{path}: more than {MAX_CHANNELS} channels")
        if not channels:
            reasons = "; ".join(flags) or "no dataset in it"
            raise FormatError(f"{path}: no numeric dataset of one or two dimensions ({reasons})")
        metadata = tuple((key, text) for key in ("description", "title", "comment") if (text := root.text(key)))
        return Log(
            path,
            "hdf5",
            tuple(channels),
            Hdf5Reader(path, tuple(sources)),
            start_time=root.text("start_time", "start", "recording_start", "wf_start_time"),
            flags=tuple(flags),
            metadata=(*((("schema", schema),) if schema else ()), *metadata),
        )


TimeVectors = dict[tuple[str, int], tuple[str, float, float, float | None]]


def _time_vectors(file: Any, tree: Tree, flags: list[str]) -> TimeVectors:
    """Return (group, length) -> (name, rate, start, raw rate) of the equidistant time vectors."""
    from tdacoustic.formats.hdf5.tree import raster_of_time_vector

    found: TimeVectors = {}
    lengths: dict[tuple[str, int], int] = {}
    for name in tree.datasets:
        for length in set(file[name].shape):
            key = (name.rpartition("/")[0], length)
            lengths[key] = lengths.get(key, 0) + 1
    for name in tree.datasets:
        group, dataset = name.rpartition("/")[0], file[name]
        if dataset.ndim != 1 or (group, len(dataset)) in found or lengths[(group, len(dataset))] < 2:
            continue
        raster = raster_of_time_vector(name, dataset)
        if raster is None:
            continue
        if isinstance(raster, str):
            flags.append(raster)
            continue
        found[(group, len(dataset))] = (name, *raster)
    return found


def _add(
    path: Path,
    file: Any,
    name: str,
    times: TimeVectors,
    ours: bool,
    channels: list[LogChannel],
    sources: list[Source],
) -> None:
    """Append the channels of one dataset."""
    dataset = file[name]
    own = Attributes(dataset)
    flags = list(own.storage_flags())
    axis = _time_axis(dataset, own, flags)
    n_samples = int(dataset.shape[axis])
    rate, raw = own.rate(inherited=not ours)
    start_s = own.number("start_s", "wf_start_offset") or 0.0
    time = times.get((name.rpartition("/")[0], n_samples))
    if time is not None:
        vector, time_rate, start_s, time_raw = time
        if rate is None:
            rate, raw = time_rate, time_raw
        elif abs(time_rate - rate) > 1e-4 * rate:
            flags.append(f"an attribute says {rate:.9g} Hz, {vector!r} says {time_rate:.9g} Hz: the attribute is taken")
    try:
        raster = Raster(rate, n_samples, start_s, raw)
    except FormatError as error:
        raise FormatError(f"{path}: dataset {name!r}: {error}") from error
    unit = own.text("unit", "units", "unit_string", "wf_yunit", "yunit") or None
    quantity = own.text("quantity")
    if quantity is not None and quantity not in QUANTITIES:
        flags.append(f"quantity {quantity!r} is not known: {', '.join(QUANTITIES)}")
        quantity = None
    scale, offset = own.number("scale", "scale_factor"), own.number("offset", "add_offset") or 0.0
    full_scale, limits = _full_scale(dataset.dtype, unit, scale, offset)
    common: dict[str, Any] = {
        "unit": unit,
        "quantity": quantity or quantity_of_unit(unit),
        "full_scale": full_scale,
        "limits": limits,
        "flags": tuple(flags),
    }
    factor = 1.0 if scale is None else scale
    if dataset.ndim == 1:
        channels.append(LogChannel(name, raster, **common))
        sources.append(Source(name, n_samples, 0, None, factor, offset))
        return
    for column in range(dataset.shape[1 - axis]):
        channels.append(LogChannel(f"{name}[{column + 1}]", raster, **common))
        sources.append(Source(name, n_samples, axis, column, factor, offset))


def _time_axis(dataset: Any, own: Attributes, flags: list[str]) -> int:
    if dataset.ndim == 1:
        return 0
    said = own.number("time_axis")
    if said in (0.0, 1.0):
        return int(said)
    if dataset.shape[0] == dataset.shape[1]:
        flags.append("as many rows as columns: time is taken along the first axis")
    return 0 if dataset.shape[0] >= dataset.shape[1] else 1


def _full_scale(
    dtype: np.dtype[Any], unit: str | None, scale: float | None, offset: float
) -> tuple[float | None, tuple[float, float] | None]:
    """Full scale where the values have no unit, and the limits of integers."""
    if dtype.kind not in "iu":
        return None, None
    info = np.iinfo(dtype)
    ends = sorted(float(end) * (1.0 if scale is None else scale) + offset for end in (info.min, info.max))
    unscaled = unit is None and scale is None
    return (2.0 ** (info.bits - 1) if unscaled else None), (ends[0], ends[1])

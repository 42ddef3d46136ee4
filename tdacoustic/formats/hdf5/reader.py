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
gives its neighbours of the same length their rate; where it is not equidistant, they
are left out. Datasets of true and false are 0 and 1, without a unit.

In both, stored numbers that ``_FillValue`` or ``missing_value`` names are NaN.

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
from tdacoustic.formats.blocks import by_origin, check_request, in_asked_order
from tdacoustic.formats.bounds import MAX_CHANNELS
from tdacoustic.formats.hdf5 import guard
from tdacoustic.formats.hdf5.attributes import Attributes
from tdacoustic.formats.hdf5.channels import Source, channels_of
from tdacoustic.formats.hdf5.times import TimeVectors, time_vectors
from tdacoustic.formats.hdf5.tree import read_tree, skipped_flags
from tdacoustic.recording import Log, LogChannel

__all__ = ["Hdf5Reader", "Source", "forbid_plugins", "opened", "scan_file", "scan_here"]

SCHEMA = "tdacoustic-log/1"
SLAB_BYTES = 8 << 20
"""What is read at a time from all datasets together, so that no packed chunk is unpacked twice."""

MAX_SLAB_BYTES = 192 << 20
"""Where packed chunks are so long that one of each would exceed this, they are unpacked more than once."""


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
        rows = by_origin(source.dataset for source in chosen)
        with opened(self.path) as file:
            slabs = [
                self._slabs(file, [chosen[row] for row in members], start, stop, len(rows)) for members in rows.values()
            ]
            yield from in_asked_order(slabs, rows.values(), block_size)

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
            values = values * scale + offset if scaled else values
            if sources[0].missing:
                values[sources[0].is_missing(stored[picked])] = np.nan
            yield values
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
        times = TimeVectors() if ours else time_vectors(file, tree.datasets)
        found: list[tuple[LogChannel, Source]] = []
        for name in tree.datasets:
            if name not in times.names:
                found.extend(channels_of(path, file[name], name, times, ours))
            if len(found) > MAX_CHANNELS:
                raise FormatError(f"{path}: more than {MAX_CHANNELS} channels")
        flags += [*times.flags, *skipped_flags(times.left_out)]
        if not found:
            reasons = "; ".join(flags) or "no dataset in it"
            raise FormatError(f"{path}: no numeric dataset of one or two dimensions ({reasons})")
        metadata = tuple((key, text) for key in ("description", "title", "comment") if (text := root.text(key)))
        return Log(
            path,
            "hdf5",
            tuple(channel for channel, _ in found),
            Hdf5Reader(path, tuple(source for _, source in found)),
            start_time=root.text("start_time", "start", "recording_start", "wf_start_time"),
            flags=tuple(flags),
            metadata=(*((("schema", schema),) if schema else ()), *metadata),
        )

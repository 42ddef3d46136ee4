"""From a dataset of an HDF5 file to its channels: rasters, units, scales, missing values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FormatError
from tdacoustic.formats.hdf5.attributes import Attributes
from tdacoustic.formats.hdf5.times import TimeVectors, place_of
from tdacoustic.formats.integers import LOGICAL, full_scale_of
from tdacoustic.recording import LogChannel, Raster
from tdacoustic.units import QUANTITIES, quantity_of_unit

__all__ = ["Source", "channels_of"]

UNIT_NAMES: Final = ("unit", "units", "unit_string", "wf_yunit", "yunit")
COUNTED_BYTES: Final = 16 << 20
"""Of a dataset of which a scan counts the missing values."""


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
    missing : tuple of float
        Stored numbers that stand for a missing value.
    """

    dataset: str
    n_samples: int
    time_axis: int = 0
    column: int | None = None
    scale: float = 1.0
    offset: float = 0.0
    missing: tuple[float, ...] = ()

    def is_missing(self, stored: NDArray[Any]) -> NDArray[np.bool_]:
        """Which stored numbers stand for a missing value."""
        return np.isin(stored, np.array(self.missing, dtype=stored.dtype))


def channels_of(
    path: Path, dataset: Any, name: str, times: TimeVectors, ours: bool
) -> Iterator[tuple[LogChannel, Source]]:
    """Yield the channels of one dataset; none where its samples are not evenly spaced, which `times` says.

    Parameters
    ----------
    path : Path
        For messages.
    dataset : h5py.Dataset
    name : str
        Its path in the file.
    times : TimeVectors
    ours : bool
        The file is of our own layout.

    Raises
    ------
    FormatError
        A sampling rate that cannot be.
    """
    own = Attributes(dataset)
    flags = list(own.storage_flags())
    axis = _time_axis(dataset, own, flags)
    n_samples = int(dataset.shape[axis])
    if times.leave_out(name, n_samples):
        return
    raster = _raster(path, name, own, n_samples, times, ours, flags)
    common, scale, offset = _meaning(dataset, own, flags)
    missing = _missing(dataset, own)
    columns: Sequence[int | None] = [None] if dataset.ndim == 1 else range(dataset.shape[1 - axis])
    notes = _missing_flags(dataset, axis, missing, len(columns))
    for column, note in zip(columns, notes, strict=True):
        label = name if column is None else f"{name}[{column + 1}]"
        source = Source(name, n_samples, axis, column, scale, offset, tuple(missing))
        yield LogChannel(label, raster, **common, flags=(*flags, *note)), source


def _raster(
    path: Path, name: str, own: Attributes, n_samples: int, times: TimeVectors, ours: bool, flags: list[str]
) -> Raster:
    rate, raw, doubts = own.rate(inherited=not ours)
    start_s = own.number("start_s", "wf_start_offset") or 0.0
    time = times.even.get(place_of(name, n_samples))
    if time is not None:
        vector, time_rate, start_s, time_raw = time
        if rate is None:
            rate, raw = time_rate, time_raw
        elif abs(time_rate - rate) > 1e-4 * rate:
            flags.append(f"an attribute says {rate:.9g} Hz, {vector!r} says {time_rate:.9g} Hz: the attribute is taken")
    if rate is None:
        flags.extend(doubts)
    try:
        return Raster(rate, n_samples, start_s, raw)
    except FormatError as error:
        raise FormatError(f"{path}: dataset {name!r}: {error}") from error


def _time_axis(dataset: Any, own: Attributes, flags: list[str]) -> int:
    if dataset.ndim == 1:
        return 0
    said = own.number("time_axis")
    if said in (0.0, 1.0):
        return int(said)
    if dataset.shape[0] == dataset.shape[1]:
        flags.append("as many rows as columns: time is taken along the first axis")
    return 0 if dataset.shape[0] >= dataset.shape[1] else 1


def _meaning(dataset: Any, own: Attributes, flags: list[str]) -> tuple[dict[str, Any], float, float]:
    """Unit, quantity, full scale and limits of a dataset's channels, and the scale and the offset of its numbers."""
    quantity = own.text("quantity")
    if quantity is not None and quantity not in QUANTITIES:
        flags.append(f"quantity {quantity!r} is not known: {', '.join(QUANTITIES)}")
        quantity = None
    if dataset.dtype.kind == "b":
        flags.append(LOGICAL)
        return {"quantity": quantity}, 1.0, 0.0
    unit = own.text(*UNIT_NAMES)
    several = own.several(*UNIT_NAMES) if unit is None else None
    if several is not None:
        flags.append(f"its attribute {several!r} holds several values: the unit is not known")
    scale, offset = own.number("scale", "scale_factor"), own.number("offset", "add_offset") or 0.0
    common: dict[str, Any] = {"unit": unit, "quantity": quantity or quantity_of_unit(unit)}
    if dataset.dtype.kind in "iu":
        info = np.iinfo(dataset.dtype)
        ends = sorted(float(end) * (1.0 if scale is None else scale) + offset for end in (info.min, info.max))
        common["limits"] = (ends[0], ends[1])
        if unit is None and several is None and scale is None:
            common["full_scale"], notes = full_scale_of(info.min, info.max)
            flags.extend(notes)
    return common, 1.0 if scale is None else scale, offset


def _missing(dataset: Any, own: Attributes) -> dict[float, str]:
    """Numbers of the dataset's type that stand for a missing value, and the attribute that says so."""
    return {
        number: name
        for name, numbers in own.missing().items()
        for number in numbers
        if dataset.dtype.kind in "iuf" and _is_held(number, dataset.dtype)
    }


def _is_held(number: float, dtype: np.dtype[Any]) -> bool:
    """Whether a type can hold a finite number."""
    if dtype.kind == "f":
        return abs(number) <= float(np.finfo(dtype).max)
    info = np.iinfo(dtype)
    return bool(info.min <= number <= info.max) and number == int(number)


def _missing_flags(dataset: Any, axis: int, missing: dict[float, str], n_columns: int) -> list[tuple[str, ...]]:
    """Say of each channel how many samples are missing; of a long dataset, that some may be."""
    if not missing:
        return [()] * n_columns
    words = " or ".join(
        f"{name} = {number if isinstance(number, int) else f'{number:.6g}'}" for number, name in missing.items()
    )
    if dataset.size * dataset.dtype.itemsize > COUNTED_BYTES:
        return [(f"samples that are missing ({words}) are read as NaN where there are any",)] * n_columns
    counts = np.atleast_1d(Source("", 0, missing=tuple(missing)).is_missing(dataset[...]).sum(axis=axis))
    n_samples = dataset.shape[axis]
    return [
        (f"{count} of {n_samples} samples are missing ({words}) and read as NaN",) if count else () for count in counts
    ]

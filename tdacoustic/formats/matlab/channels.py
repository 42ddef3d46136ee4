"""From the arrays of a workspace to channels: names, rasters, units."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tdacoustic.formats.blocks import unique_names
from tdacoustic.formats.integers import LOGICAL, full_scale_of
from tdacoustic.formats.matlab.layouts import Described, pulse_channels, testlab_signal
from tdacoustic.formats.matlab.sampling import TimeVectors, plain, rises_evenly
from tdacoustic.formats.matlab.workspace import Array, Struct, Workspace
from tdacoustic.recording import LogChannel, Raster
from tdacoustic.units import quantity_of_unit

__all__ = ["Chosen", "channels_of"]

UNIT_NAMES = frozenset({"unit", "units", "yunit", "yunits"})
EXACT = 2**53


@dataclass(frozen=True)
class Chosen:
    """Which part of an array is a channel.

    Parameters
    ----------
    array : Array
    time_axis : int
    column : int
    scale : float
    """

    array: Array
    time_axis: int
    column: int
    scale: float


def channels_of(workspace: Workspace) -> tuple[tuple[LogChannel, ...], tuple[Chosen, ...]]:
    """Make channels of a workspace's arrays; what is left out, and where rates are from, is noted in the workspace."""
    found: list[tuple[str, LogChannel, Chosen]] = []
    rates: dict[str, float] = {}
    for described in _described(workspace):
        if described.left_out is not None:
            workspace.leave_out(described.left_out, described.names[0])
            continue
        if described.sampling.uneven:
            reason = described.sampling.flags[0]
            workspace.leave_out(f"are not evenly sampled and are not resampled ({reason})", described.names[0])
            continue
        if described.sampling.source is not None:
            rates[described.sampling.source] = described.sampling.rate_hz or 0.0
        found += [(name, channel, chosen) for name, channel, chosen in _parts(described)]
    workspace.metadata += [("sampling rate", f"{rate:.9g} Hz, from {source}") for source, rate in rates.items()]
    names, notes = unique_names([name for name, _, _ in found])
    channels = []
    for (_, channel, _), name, note in zip(found, names, notes, strict=True):
        flags = channel.flags if note is None else (*channel.flags, note)
        channels.append(
            LogChannel(name, channel.raster, channel.unit, channel.quantity, channel.full_scale, channel.limits, flags)
        )
    return tuple(channels), tuple(chosen for _, _, chosen in found)


def _described(workspace: Workspace) -> Iterator[Described]:
    """Describe the arrays, by a layout where there is one."""
    of_pulse, flags = pulse_channels(workspace.root)
    workspace.flags += flags
    taken = {id(described.array) for described in of_pulse}
    yield from of_pulse
    times = TimeVectors()
    plain_ones: list[tuple[Struct, Array]] = []
    layouts: list[Described] = []
    pending = [workspace.root]
    while pending:
        struct = pending.pop()
        signal = testlab_signal(struct)
        if signal is not None:
            layouts.append(signal)
            continue
        plain_ones += [(struct, array) for array in struct.arrays if id(array) not in taken]
        pending += reversed(struct.structs)
    generic = [(array, _generic(struct, array, times)) for struct, array in plain_ones]
    yield from layouts
    yield from (described for array, described in generic if not times.is_used(array))


def _generic(struct: Struct, array: Array, times: TimeVectors) -> Described:
    """Describe an array of no known layout."""
    sampling = times.sampling(struct, array)
    flags: list[str] = []
    if array.shape[0] == array.shape[1]:
        flags.append("as many rows as columns: time is taken along the columns")
    if not array.is_vector and sampling.rate_hz is None and (rate := rises_evenly(array)) is not None:
        flags.append(f"its first column rises evenly: if it is a time in seconds, the sampling rate is {rate:.9g} Hz")
    units = [text for name, text in struct.texts if plain(name) in UNIT_NAMES and text]
    alone = len([other for other in struct.arrays if not times.is_used(other)]) == 1
    unit = units[0] if struct.name and alone and len(units) == 1 else None
    return Described(array, (struct.path(array.name),), sampling, array.time_axis, unit, 1.0, tuple(flags))


def _parts(described: Described) -> Iterator[tuple[str, LogChannel, Chosen]]:
    """Channels of one array."""
    array, sampling, axis = described.array, described.sampling, described.time_axis
    raster = Raster(sampling.rate_hz, array.shape[axis], sampling.start_s, sampling.raw_hz)
    flags = [*described.flags, *sampling.flags, *array.flags]
    full_scale: float | None = None
    limits: tuple[float, float] | None = None
    if array.logical:
        flags.append(LOGICAL)
    elif array.dtype.kind in "iu":
        info = np.iinfo(array.dtype)
        limits = (float(info.min) * described.scale, float(info.max) * described.scale)
        if described.unit is None:
            full_scale, notes = full_scale_of(info.min, info.max)
            flags.extend(notes)
        if info.bits == 64:
            flags.append(f"integers of 64 bits: those beyond {EXACT} are rounded")
    channel = LogChannel("", raster, described.unit, quantity_of_unit(described.unit), full_scale, limits, tuple(flags))
    count = array.shape[1 - axis]
    for column in range(count):
        name = described.names[column] if len(described.names) == count else f"{described.names[0]}[{column + 1}]"
        yield name, channel, Chosen(array, axis, column, described.scale)

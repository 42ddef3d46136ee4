"""The channels of a TDMS file: which objects are one, their names, units, rasters and flags."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import FormatError
from tdacoustic.formats.blocks import unique_names
from tdacoustic.formats.integers import LOGICAL, full_scale_of
from tdacoustic.formats.tdms.metadata import TYPES
from tdacoustic.formats.tdms.paths import path_of, shown, split_path
from tdacoustic.formats.tdms.scalings import Scaling, ScalingError, limits_of, read_scaling
from tdacoustic.formats.tdms.structure import Structure
from tdacoustic.formats.tdms.timing import TICK, Timing, instant_text, timing_of
from tdacoustic.formats.tdms.tracks import Track, tracks_of
from tdacoustic.recording import LogChannel, Raster
from tdacoustic.units import quantity_of_unit

__all__ = [
    "Found",
    "Inventory",
    "flag_joins_and_lengths",
    "flag_time_columns",
    "join_starts",
    "left_out_flags",
    "log_channels",
    "take_inventory",
]

UNIT_NAMES = ("unit_string", "NI_UnitDescription", "unit", "Unit", "units")
NO_UNITS = frozenset({"", "nounit", "no unit", "unknown", "n/a"})
TIME_NAMES = frozenset(
    {"time", "time [s]", "time (s)", "time_s", "timestamp", "datetime", "t", "t [s]", "zeit", "temps"}
)
NAMES_IN_FLAG = 5
MAX_REASONS = 20
SAME_START_TICKS = TICK // 1_000_000_000
"""A nanosecond [assumed]: a thousandth of a sample at 1 MHz."""


@dataclass
class Found:
    """An object that can be a channel.

    Parameters
    ----------
    group, channel : str
    place : (int, int)
        Track, and row in the track.
    n_values : int
    first, last : int
        Numbers of the first and the last stretch in which it has values.
    dtype : str
        Of the stored numbers; of the first scaler where there are several.
    is_bit : bool
        A digital line.
    scaling : Scaling or None
    unit : str or None
    timing : Timing
    flags : list of str
    """

    group: str
    channel: str
    place: tuple[int, int]
    n_values: int
    first: int
    last: int
    dtype: str
    is_bit: bool
    scaling: Scaling | None
    unit: str | None
    timing: Timing
    flags: list[str] = field(default_factory=list)

    @property
    def label(self) -> str:
        """Group and name, as flags show it."""
        return shown(f"{self.group}/{self.channel}")


@dataclass
class Inventory:
    """Objects that can be channels, where their values lie, and what was left out."""

    structure: Structure
    tracks: list[Track]
    stretches: dict[int, NDArray[np.int64]]
    found: list[Found] = field(default_factory=list)
    left_out: dict[str, list[str]] = field(default_factory=dict)
    before: dict[int, NDArray[np.int64]] = field(default_factory=dict)

    def values_before(self, track: int, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
        """How many values of a track lie before stretches of `Structure`; counted when first asked."""
        if track not in self.before:
            self.before[track] = _cumulative(self.structure, self.tracks[track], self.stretches[track])
        values: NDArray[np.int64] = self.before[track][np.searchsorted(self.stretches[track], numbers)]
        return values


def take_inventory(structure: Structure) -> Inventory:
    """Find the objects that can be channels.

    Raises
    ------
    FormatError
        A path cannot be split.
    """
    tracks, places, stretches = tracks_of(structure)
    forms = _forms(structure)
    inventory = Inventory(structure, tracks, stretches)
    for number, path in enumerate(structure.objects):
        try:
            names = split_path(path)
        except ValueError as error:
            raise FormatError(f"{structure.path}: {error}") from error
        if len(names) > 2:
            raise FormatError(f"{structure.path}: object path {shown(path)} has more than a group and a channel")
        if len(names) < 2 and number not in places:
            continue
        group, channel = (*names, "", "")[:2]
        reason = _unreadable(forms.get(number, set()), number in places)
        if reason is None:
            reason = _add(inventory, number, group, channel, places[number])
        if reason is not None:
            inventory.left_out.setdefault(reason, []).append(f"{group}/{channel}")
    return inventory


Form = tuple[int, tuple[tuple[int, str, bool], ...]]


def _forms(structure: Structure) -> dict[int, set[Form]]:
    """Type of each object's values, and of its scalers, in the segments that have some."""
    per_index: list[Form | None] = [
        (
            index.type_code,
            tuple((scaler.scale_id, scaler.dtype, scaler.bit is not None) for scaler in index.scalers),
        )
        if index.n_values
        else None
        for index in structure.indexes
    ]
    forms: dict[int, set[Form]] = {}
    for layout in structure.layouts:
        for channel, index in layout.entries:
            form = per_index[index]
            if form is not None:
                forms.setdefault(channel, set()).add(form)
    return forms


def _unreadable(forms: set[Form], has_place: bool) -> str | None:
    if len(forms) > 1:
        return "the type of their values changes from segment to segment"
    words, _, dtype = TYPES[next(iter(forms))[0]] if forms else ("", None, None)
    if forms and dtype is None and not next(iter(forms))[1]:
        return f"their values are {words}"
    return None if has_place else "they hold no values"


def _add(
    inventory: Inventory,
    number: int,
    group: str,
    channel: str,
    place: tuple[int, int],
) -> str | None:
    """Add an object to what can be channels, or say why it is left out."""
    structure, track = inventory.structure, inventory.tracks[place[0]]
    parts = track.columns[0][place[1]]
    scale_ids = [column.scale_id for column in parts]
    if len(set(scale_ids)) < len(scale_ids):
        return "two of their DAQmx scalers have one number"
    levels = (structure.objects[number], path_of(group), "/")
    try:
        scaling = read_scaling([structure.properties.get(level, {}) for level in levels], frozenset(scale_ids))
    except ScalingError as error:
        return str(error)
    first, last = (int(inventory.stretches[place[0]][end]) for end in (0, -1))
    timing = timing_of(structure, levels, first, last, partial(inventory.values_before, place[0]))
    if timing.left_out is not None:
        return timing.left_out
    found = Found(
        group,
        channel,
        place,
        track.n_values,
        first,
        last,
        parts[0].dtype,
        parts[0].bit is not None,
        scaling,
        _unit(structure, levels[0]),
        timing,
        list(timing.flags),
    )
    if levels[0] in structure.rescaled:
        found.flags.append("its scaling was changed while the file was written: the last one is used for all values")
    inventory.found.append(found)
    return None


def _cumulative(structure: Structure, track: Track, stretches: NDArray[np.int64]) -> NDArray[np.int64]:
    """Values of a track before each of its stretches, and all."""
    positions = np.asarray(structure.positions, dtype=np.int64)[stretches]
    chunks = np.asarray(structure.chunks, dtype=np.int64)[stretches]
    run = np.searchsorted(track.positions, positions, side="right") - 1
    counts = np.array(track.counts, dtype=np.int64)[track.kinds[run]]
    return np.concatenate(([0], np.cumsum(counts * chunks)))


def _unit(structure: Structure, path: str) -> str | None:
    properties = structure.properties.get(path, {})
    for name in UNIT_NAMES:
        value = properties.get(name)
        if isinstance(value, str) and value.strip("\x00 \t\r\n").lower() not in NO_UNITS:
            return value.strip("\x00 \t\r\n")[:100]
    return None


def join_starts(inventory: Inventory) -> None:
    """Give starts that differ by less than a nanosecond one value.

    DAQmx adds a few ticks from channel to channel; the channels of one card would not be on one raster.
    """
    dated = [(item.timing.start, item) for item in inventory.found if item.timing.start is not None]
    begin = previous = None
    for start, item in sorted(dated, key=lambda pair: pair[0]):
        if begin is None or previous is None or start - previous > SAME_START_TICKS:
            begin = start
        previous = start
        item.timing = replace(item.timing, start=begin)


def flag_joins_and_lengths(inventory: Inventory) -> None:
    """Leave out channels that were added later and do not say when; flag those that are shorter than their like."""
    alike: dict[tuple[str, float | None, int | None], list[Found]] = {}
    for item in inventory.found:
        alike.setdefault((item.group, item.timing.rate_hz, item.timing.start), []).append(item)
    late: set[int] = set()
    for items in alike.values():
        longest = max(items, key=lambda item: item.n_values)
        for item in items:
            if item.n_values == longest.n_values:
                continue
            before = _values_before_joining(inventory, longest, item)
            if item.timing.start is None and before > 0:
                late.add(id(item))
                inventory.left_out.setdefault(
                    f"their first values come after {before} values of {longest.label}, and no start time says when",
                    [],
                ).append(f"{item.group}/{item.channel}")
            else:
                item.flags.append(
                    f"holds {item.n_values} values, {longest.label} of the same rate and start {longest.n_values}: "
                    "where the others are missing the file does not say"
                )
    inventory.found = [item for item in inventory.found if id(item) not in late]


def flag_time_columns(inventory: Inventory) -> None:
    """Flag channels without a rate beside a channel of their group that may hold their instants."""
    columns: dict[str, str] = {}
    for name in inventory.left_out.get(f"their values are {TYPES[0x44][0]}", ()):
        columns.setdefault(name.rpartition("/")[0], name)
    for item in inventory.found:
        if item.channel.strip().lower() in TIME_NAMES:
            columns.setdefault(item.group, f"{item.group}/{item.channel}")
    for item in inventory.found:
        column = columns.get(item.group)
        if item.timing.rate_hz is None and column not in (None, f"{item.group}/{item.channel}"):
            item.flags.append(
                f"no rate is given, and {shown(str(column))} may hold its instants: "
                "whether it is evenly sampled is not known"
            )


def _values_before_joining(inventory: Inventory, longest: Found, item: Found) -> int:
    """Values of the longest channel that were written before another one was there, 0 where they began together.

    Programs that write one channel after the other begin together too: only where the longest one has two stretches
    before the other's first, or shares it, was there something before.
    """
    track = longest.place[0]
    stretches = inventory.stretches[track]
    n_before = int(np.searchsorted(stretches, item.first))
    shares = n_before < len(stretches) and int(stretches[n_before]) == item.first
    if n_before < 1 or not (shares or n_before > 1):
        return 0
    return int(inventory.values_before(track, np.array([item.first]))[0])


def log_channels(found: Sequence[Found]) -> tuple[tuple[LogChannel, ...], str | None, list[str]]:
    """Names, rasters and flags of the channels.

    Returns
    -------
    channels : tuple of LogChannel
    start_time : str or None
    flags : list of str
        Of the log.
    """
    begin = min((item.timing.start for item in found if item.timing.start is not None), default=None)
    names, name_flags = unique_names(_names(found))
    channels = tuple(
        _channel(item, name, flag, begin) for item, name, flag in zip(found, names, name_flags, strict=True)
    )
    return channels, None if begin is None else instant_text(begin), _date_flags(found)


def _names(found: Sequence[Found]) -> list[str]:
    """The channel's name, with its group where it does not stand alone."""
    count: dict[str, int] = {}
    for item in found:
        count[item.channel] = count.get(item.channel, 0) + 1
    return [
        item.channel.strip() if count[item.channel] == 1 and item.channel.strip() else f"{item.group}/{item.channel}"
        for item in found
    ]


def _channel(item: Found, name: str, name_flag: str | None, begin: int | None) -> LogChannel:
    flags = [*item.flags, *(() if name_flag is None else (name_flag,))]
    timing = item.timing
    if timing.start is not None and begin is not None:
        start_s = (timing.start - begin) / TICK
    else:
        start_s = timing.offset_s
        if begin is not None:
            flags.append("it states no start time and others do: it is taken to start with the first of them")
    is_integer, is_logical = item.dtype[-2] in "iu", item.dtype[-1] == "?"
    unit = None if is_logical and item.scaling is None else item.unit
    full_scale = None
    if is_logical:
        flags.append(LOGICAL)
    elif is_integer and item.scaling is None and unit is None:
        info = np.iinfo(item.dtype)
        full_scale, notes = (1.0, ()) if item.is_bit else full_scale_of(info.min, info.max)
        flags.extend(notes)
    return LogChannel(
        name,
        Raster(timing.rate_hz, item.n_values, start_s, timing.raw_hz),
        unit=unit,
        quantity=quantity_of_unit(unit),
        full_scale=full_scale,
        limits=limits_of(item.scaling, item.dtype) if is_integer and not item.is_bit else None,
        flags=tuple(flags),
    )


def _date_flags(found: Iterable[Found]) -> list[str]:
    bad = [(item, item.timing.bad_date) for item in found if item.timing.bad_date is not None]
    if not bad:
        return []
    dates = sorted({date for _, date in bad})
    unset = all(date.seconds == 0 for date in dates)
    text = (
        "was never set (1904-01-01)" if unset else f"is {instant_text(dates[0].ticks)}, which is no date of a recording"
    )
    flags = [f"the start time of {listed([item.label for item, _ in bad])} {text}: none is taken"]
    if len(dates) > 1:
        flags.append("these start times differ: whether these channels began together is not known")
    return flags


def listed(labels: Sequence[str]) -> str:
    """The first few of many names.

    Examples
    --------
    >>> listed(["a", "b"])
    'a, b'
    """
    more = len(labels) - NAMES_IN_FLAG
    return ", ".join(labels[:NAMES_IN_FLAG]) + (f" and {more} more" if more > 0 else "")


def left_out_flags(inventory: Inventory) -> list[str]:
    """One sentence for each reason."""
    sentences = [
        f"left out: {listed([shown(name) for name in names])}: {reason}" for reason, names in inventory.left_out.items()
    ]
    more = len(sentences) - MAX_REASONS
    return [*sentences[:MAX_REASONS], *([f"{more} more channels are left out"] if more > 0 else [])]

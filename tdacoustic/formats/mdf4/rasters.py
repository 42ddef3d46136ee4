"""Which channels of an MDF 4 file can be read, on which raster, under which name."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Final

from tdacoustic.errors import FormatError
from tdacoustic.formats.blocks import unique_names
from tdacoustic.formats.mdf4.clocks import Clock, clock_of, virtual_raster
from tdacoustic.formats.mdf4.data import Run, read_run
from tdacoustic.formats.mdf4.fields import Field, field_of
from tdacoustic.formats.mdf4.groups import NO_VALUES, VIRTUAL_MASTER, Channel, Group, read_groups
from tdacoustic.formats.mdf4.header import Header
from tdacoustic.formats.mdf4.records import RecordReader, Records
from tdacoustic.formats.mdf4.walk import Walk
from tdacoustic.recording import LogChannel, Raster
from tdacoustic.units import quantity_of_unit

__all__ = ["Found", "ReadGroup", "read_channels"]

TIME, INDEX = 1, 4
NAMES_IN_A_FLAG: Final = 5
COUNTED_BYTES: Final = 16 << 20
_AXES: Final = {2: "an angle", 3: "a distance"}


@dataclass(frozen=True)
class ReadGroup:
    """A group that can be read.

    Parameters
    ----------
    records : Records
    clock : Clock or None
    master : Records or None
        Where the master lies in another group.
    """

    records: Records
    clock: Clock | None
    master: Records | None


@dataclass
class Found:
    """What can be read, and what was left out."""

    channels: tuple[LogChannel, ...] = ()
    groups: list[ReadGroup] = field(default_factory=list)
    fields: list[tuple[int, Field]] = field(default_factory=list)
    flags: list[str] = field(default_factory=list)
    left_out: dict[str, list[str]] = field(default_factory=dict)


def read_channels(walk: Walk, header: Header) -> Found:
    """Return the channels of a file.

    Raises
    ------
    FormatError
        Damaged, or a group claims more records than there are bytes.
    """
    groups = read_groups(walk, header.first_group, header.counts_missing)
    found = Found()
    by_address = {group.address: group for group in groups}
    runs: dict[int, tuple[Run, Run, bool]] = {}
    records: dict[int, Records] = {}
    made: list[tuple[Group, LogChannel]] = []
    for group in groups:
        if group.reason is not None and not (header.counts_missing and group.reason == NO_VALUES):
            _leave_out(found, group, group.reason)
            continue
        if group.data_address not in runs:
            runs[group.data_address] = read_run(walk, group.data_address, header.length_missing)
        records[group.number] = _records(walk, group, runs[group.data_address], header.counts_missing, found.flags)
        if records[group.number].n_records == 0:
            _leave_out(found, group, NO_VALUES)
            continue
        made += _of_group(walk, group, records, by_address, found)
    found.channels = _named(made)
    found.flags += [_sentence(reason, names) for reason, names in found.left_out.items()]
    return found


def _leave_out(found: Found, group: Group, reason: str) -> None:
    names = [channel.name for channel in group.channels if channel is not group.master] or [group.label]
    found.left_out.setdefault(reason, []).extend(names)


def _sentence(reason: str, names: list[str]) -> str:
    shown = ", ".join(repr(name) for name in names[:NAMES_IN_A_FLAG]) + (
        ", ..." if len(names) > NAMES_IN_A_FLAG else ""
    )
    return f"{len(names)} left out, they {reason}: {shown}"


def _records(walk: Walk, group: Group, runs: tuple[Run, Run, bool], counts_missing: bool, flags: list[str]) -> Records:
    """Return a group's records, their number held against the bytes.

    Raises
    ------
    FormatError
        It claims more than there are.
    """
    values, invalid, apart = runs
    records = Records(
        group.label,
        values,
        invalid,
        apart,
        group.n_records,
        group.id_bytes,
        group.record_id,
        group.data_bytes,
        group.invalid_bytes,
    )
    size = records.record_bytes
    if size == 0:
        raise FormatError(f"{walk.path}: damaged: {group.label!r} claims {group.n_records} records of no bytes")
    held = values.length // size
    if apart and group.invalid_bytes and invalid.length:
        held = min(held, invalid.length // group.invalid_bytes)
    if counts_missing:
        if held != group.n_records:
            flags.append(f"{group.label!r}: {held} records are there, {group.n_records} were noted: {held} are read")
        return replace(records, n_records=held)
    if group.n_records > held:
        raise FormatError(
            f"{walk.path}: {group.label!r} claims {group.n_records} records of {size} bytes, the file holds {held}"
        )
    left = values.length - group.n_records * size
    if left:
        flags.append(f"{group.label!r}: {left} bytes behind its {group.n_records} records are not read")
    return records


def _of_group(
    walk: Walk, group: Group, records: dict[int, Records], by_address: dict[int, Group], found: Found
) -> list[tuple[Group, LogChannel]]:
    """Return the channels of a group, and enter what reads them."""
    timing = _timing(walk, group, records, by_address)
    if isinstance(timing, str):
        _leave_out(found, group, timing)
        return []
    raster, read, flags = timing
    made = []
    index = len(found.groups)
    for channel in group.channels:
        if channel is group.master:
            continue
        if channel.reason is not None:
            found.left_out.setdefault(channel.reason, []).append(channel.name)
            continue
        own = field_of(channel)
        found.fields.append((index, own))
        marks = _invalid_flag(walk, read.records, own)
        made.append((group, _channel(channel, own, raster, (*flags, *marks))))
    if made:
        found.groups.append(read)
    return made


Timing = tuple[Raster, ReadGroup, tuple[str, ...]]


def _timing(walk: Walk, group: Group, records: dict[int, Records], by_address: dict[int, Group]) -> Timing | str:
    """Return when a group was sampled, or why its channels are left out."""
    own = records[group.number]
    holder, held = group, own
    if group.master_address:
        other = by_address.get(group.master_address)
        if other is None or other.number not in records:
            return "follow the instants of another group that cannot be read"
        holder, held = other, records[other.number]
        if held.n_records != own.n_records:
            return f"are {own.n_records} values on the {held.n_records} instants of another group"
    master = holder.master
    if master is None or master.sync in (0, INDEX):
        note = "its group has no time channel: the sampling rate is not known"
        return Raster(None, own.n_records), ReadGroup(own, None, None), (note,)
    if master.sync != TIME:
        return f"were sampled over {_AXES.get(master.sync, 'an unknown axis')}, not over time"
    if master.reason is not None:
        return f"have no instants that can be read: these {master.reason}"
    if master.kind == VIRTUAL_MASTER:
        line = virtual_raster(field_of(master), master.unit, own.n_records)
        if isinstance(line, str):
            return f"have instants that {line}"
        return line, ReadGroup(own, None, None), ()
    timed = clock_of(RecordReader(walk.path, walk.stream, held), field_of(master), master.unit)
    if isinstance(timed, str):
        return f"have instants that {timed}"
    clock, raster, flag = timed
    return raster, ReadGroup(own, clock, None if holder is group else held), () if flag is None else (flag,)


def _invalid_flag(walk: Walk, records: Records, own: Field) -> tuple[str, ...]:
    """Say how many samples are marked invalid; in a long group, that some may be."""
    if own.invalid_bit is None or (records.apart and not records.invalid.length):
        return ()
    if records.n_records * records.record_bytes > COUNTED_BYTES:
        return ("the log marks samples of it as invalid where they are: these are read as NaN",)
    invalid = RecordReader(walk.path, walk.stream, records).read(0, records.n_records)[1]
    count = 0 if invalid is None else int(own.marked(invalid).sum())
    return (f"{count} of {records.n_records} samples are marked invalid and read as NaN",) if count else ()


def _channel(channel: Channel, own: Field, raster: Raster, flags: tuple[str, ...]) -> LogChannel:
    unit = channel.unit
    full_scale, notes = own.full_scale if unit is None else (None, ())
    return LogChannel(
        channel.name,
        raster,
        unit=unit,
        quantity=quantity_of_unit(unit),
        full_scale=full_scale,
        limits=own.limits,
        flags=(*flags, *notes),
    )


def _named(made: list[tuple[Group, LogChannel]]) -> tuple[LogChannel, ...]:
    """Give channels of one name that lie in several groups the group's name in front."""
    groups: dict[str, set[int]] = {}
    for group, channel in made:
        groups.setdefault(channel.name, set()).add(group.number)
        groups.setdefault(f"/{group.label}", set()).add(group.number)
    names = [
        f"{_told(group, groups)}/{channel.name}" if len(groups[channel.name]) > 1 else channel.name or f"ch{number}"
        for number, (group, channel) in enumerate(made, 1)
    ]
    unique, flags = unique_names(names)
    return tuple(
        replace(channel, name=name, flags=channel.flags if flag is None else (*channel.flags, flag))
        for (_, channel), name, flag in zip(made, unique, flags, strict=True)
    )


def _told(group: Group, groups: dict[str, set[int]]) -> str:
    return group.label if len(groups[f"/{group.label}"]) == 1 else f"group {group.number}"

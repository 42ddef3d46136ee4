"""The groups of an MDF 4 file and their channels, as its blocks describe them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from tdacoustic.errors import FormatError
from tdacoustic.formats.bounds import MAX_CHANNELS
from tdacoustic.formats.mdf4.conversions import Conversion, read_conversion
from tdacoustic.formats.mdf4.walk import Block, Walk

__all__ = ["MASTERS", "NO_VALUES", "VIRTUAL_MASTER", "Channel", "Group", "read_groups"]

VALUE, MASTER, VIRTUAL_MASTER = 0, 2, 3
NO_VALUES: Final = "hold no values"
MASTERS: Final = (MASTER, VIRTUAL_MASTER)

MAX_GROUPS: Final = 100_000
"""Of a file [assumed]; what is above is taken for damage."""

MAX_RECORD_BYTES: Final = 4 << 20
"""Of a record [assumed]: half a million channels of 8 bytes."""

_BUS_EVENT, _PLAIN_BUS_EVENT, _REMOTE_MASTER, _EVENTS, _VARIABLE = 2, 4, 8, 16, 1

_OTHER_CHANNELS: Final = {
    1: "are of variable length",
    4: "are of a picture or sound stream",
    5: "are of variable length",
    6: "are virtual: the file holds no values of theirs",
    7: "are of variable length",
}
_OTHER_VALUES: Final = {
    **dict.fromkeys((6, 7, 8, 9, 17), "are texts"),
    **dict.fromkeys((10, 11, 12), "are bytes of no numeric type"),
    **dict.fromkeys((13, 14), "are dates"),
    **dict.fromkeys((15, 16), "are complex"),
}


@dataclass(frozen=True)
class Channel:
    """A channel as its CN block has it.

    Parameters
    ----------
    name : str
    unit : str or None
    kind, sync : int
        cn_type and cn_sync_type of the standard.
    data_type, bit_offset, byte_offset, bit_count : int
    all_invalid : bool
    invalid_bit : int or None
        Of the record's invalidation bits, where the channel has one.
    conversion : Conversion or str
    reason : str or None
        Why its values cannot be read, where that is so: words that follow "they".
    """

    name: str
    unit: str | None
    kind: int
    sync: int
    data_type: int
    bit_offset: int
    byte_offset: int
    bit_count: int
    all_invalid: bool
    invalid_bit: int | None
    conversion: Conversion | str
    reason: str | None


@dataclass(frozen=True)
class Group:
    """A channel group and where its records lie.

    Parameters
    ----------
    number : int
        From 1 over the whole file.
    address : int
    name : str or None
        Of the acquisition.
    data_address : int
        Of the data group's data, 0 for none.
    id_bytes, record_id : int
        Length and value of the number in front of each record.
    n_records : int
        As claimed.
    data_bytes, invalid_bytes : int
        Of a record.
    master_address : int
        Of the group that holds its master channel, 0 for itself.
    channels : tuple of Channel
    reason : str or None
        Why its channels cannot be read, where that is so.
    """

    number: int
    address: int
    name: str | None
    data_address: int
    id_bytes: int
    record_id: int
    n_records: int
    data_bytes: int
    invalid_bytes: int
    master_address: int
    channels: tuple[Channel, ...]
    reason: str | None

    @property
    def label(self) -> str:
        """Name for people."""
        return self.name or f"group {self.number}"

    @property
    def master(self) -> Channel | None:
        """The channel that says when, or where, the others were sampled."""
        return next((channel for channel in self.channels if channel.kind in MASTERS), None)


def read_groups(walk: Walk, first: int, counts_missing: bool) -> list[Group]:
    """Return the channel groups of all data groups.

    Parameters
    ----------
    walk : Walk
    first : int
        Address of the first data group.
    counts_missing : bool
        The numbers of records were not stated: which groups are empty is not known.

    Raises
    ------
    FormatError
        Damaged, or more groups or channels than a log may have.
    """
    groups: list[Group] = []
    n_channels = 0
    for data_group in walk.chain(first, "DG", "data group"):
        (id_bytes,) = data_group.fields("<B")
        if id_bytes not in (0, 1, 2, 4, 8):
            raise FormatError(f"{walk.path}: damaged: record ids of {id_bytes} bytes (0, 1, 2, 4 or 8 are allowed)")
        blocks = []
        for block in walk.chain(data_group.link(1), "CG", "channel group"):
            blocks.append(block)
            if len(groups) + len(blocks) > MAX_GROUPS:
                raise FormatError(f"{walk.path}: more than {MAX_GROUPS} channel groups")
        filled = sum(counts_missing or block.fields("<QQ")[1] > 0 for block in blocks)
        for block in blocks:
            mixed = filled > 1 and (counts_missing or block.fields("<QQ")[1] > 0)
            group = _group(walk, block, len(groups) + 1, data_group.link(2), id_bytes, mixed, n_channels)
            n_channels += len(group.channels)
            groups.append(group)
    return groups


def _group(
    walk: Walk, block: Block, number: int, data_address: int, id_bytes: int, mixed: bool, n_before: int
) -> Group:
    record_id, n_records, flags, _, data_bytes, invalid_bytes = block.fields("<QQHH4xII")
    name = walk.text(block.link(2))
    reason = None
    if flags & _VARIABLE:
        reason = "are of variable length"
    elif flags & (_BUS_EVENT | _PLAIN_BUS_EVENT):
        reason = "are frames of a bus and not decoded"
    elif flags & _EVENTS:
        reason = "are events"
    elif mixed:
        reason = "lie mixed with those of other groups (the file is not sorted: save it anew with the logger's program)"
    elif n_records == 0:
        reason = NO_VALUES
    elif data_bytes + invalid_bytes > MAX_RECORD_BYTES:
        reason = f"lie in records of {data_bytes + invalid_bytes} bytes, {MAX_RECORD_BYTES} at most are read"
    channels = []
    for item in walk.chain(block.link(1), "CN", "channel"):
        channels.append(_channel(walk, item, data_bytes, invalid_bytes))
        if n_before + len(channels) > 2 * MAX_CHANNELS:  # a master and a channel each
            raise FormatError(f"{walk.path}: more than {MAX_CHANNELS} channels")
    master_address = block.link(6) if flags & _REMOTE_MASTER else 0
    return Group(
        number,
        block.address,
        name,
        data_address,
        id_bytes,
        record_id,
        n_records,
        data_bytes,
        invalid_bytes,
        master_address,
        tuple(channels),
        reason,
    )


def _channel(walk: Walk, block: Block, data_bytes: int, invalid_bytes: int) -> Channel:
    kind, sync, data_type, bit_offset, byte_offset, bit_count, flags, invalid_bit = block.fields("<BBBBIIII")
    name = walk.text(block.link(2)) or ""
    conversion, unit = read_conversion(walk, block.link(4))
    unit = walk.text(block.link(6)) or unit
    reason = next(_reasons(walk, block, kind, data_type, bit_offset, bit_count, conversion, bool(flags & 1)), None)
    place = f"channel {name!r}"
    n_bytes = (bit_offset + bit_count + 7) // 8
    if reason is None and kind != VIRTUAL_MASTER and byte_offset + n_bytes > data_bytes:
        raise FormatError(
            f"{walk.path}: damaged: {place} claims bytes {byte_offset} to {byte_offset + n_bytes} of records "
            f"that have {data_bytes}"
        )
    has_bit = bool(flags & 2) and not flags & 1
    if reason is None and has_bit and invalid_bit >= 8 * invalid_bytes:
        raise FormatError(
            f"{walk.path}: damaged: {place} claims invalidation bit {invalid_bit} of records that have "
            f"{8 * invalid_bytes}"
        )
    return Channel(
        name,
        unit,
        kind,
        sync,
        data_type,
        bit_offset,
        byte_offset,
        bit_count,
        bool(flags & 1),
        invalid_bit if has_bit else None,
        conversion,
        reason,
    )


def _reasons(
    walk: Walk,
    block: Block,
    kind: int,
    data_type: int,
    bit_offset: int,
    bit_count: int,
    conversion: Conversion | str,
    all_invalid: bool,
) -> Iterator[str]:
    """Yield why a channel's values cannot be read."""
    if kind in _OTHER_CHANNELS:
        yield _OTHER_CHANNELS[kind]
    if kind not in (VALUE, *MASTERS):
        yield f"are channels of the unknown kind {kind}"
    if block.link(1):
        composition = walk.head(block.link(1), ("CA", "CN", "DS", "CL", "CV", "CU"), "composition")[0]
        yield {"CA": "are arrays", "CN": "are structures"}.get(composition, "are composed of others")
    if data_type in _OTHER_VALUES:
        yield _OTHER_VALUES[data_type]
    if data_type > 5:
        yield f"are of the unknown data type {data_type}"
    if isinstance(conversion, str):
        yield conversion
    if kind == VIRTUAL_MASTER:
        return
    if data_type in (4, 5) and (bit_offset or bit_count not in (16, 32, 64)):
        yield f"are floating-point numbers of {bit_count} bits"
    if data_type < 4 and not (1 <= bit_count <= 64 and bit_offset <= 7 and bit_offset + bit_count <= 64):
        yield f"are integers of {bit_count} bits from bit {bit_offset} on"
    if all_invalid:
        yield "are all marked invalid"

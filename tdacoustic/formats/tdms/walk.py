"""The segments of a TDMS file, from one lead-in to the next; no sample is read.

What a lead-in or a raw data index claims is compared with the file's size and with
each other before it is used. A segment that says the same as the one before it costs
a few microseconds, so that a file of very many small ones is scanned quickly.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import BinaryIO, Final

from tdacoustic.errors import FormatError
from tdacoustic.formats.tdms.lists import IS_BIG_ENDIAN, IS_INTERLEAVED, MAX_EVENTS, Lists, Shape
from tdacoustic.formats.tdms.metadata import DamagedError, ListedObject, OutOfBytesError, Spot, parse_objects
from tdacoustic.formats.tdms.paths import label
from tdacoustic.formats.tdms.structure import Structure

__all__ = ["walk"]

TAG = b"TDSm"
LEAD_IN = 28
HAS_METADATA, NEW_LIST, HAS_RAW = 1 << 1, 1 << 2, 1 << 3
OPEN = 0xFFFFFFFFFFFFFFFF
"""Next segment offset of a segment that was being written when the program stopped."""

VERSIONS: Final = (4712, 4713)
FIRST_READ = 1 << 14
MAX_METADATA = 1 << 25
MAX_CACHED = 1 << 16
MAX_PADDING_READ = 1 << 16
MAX_NOTES = 5


def walk(path: Path) -> Structure:
    """Walk the segments of a TDMS file.

    Returns
    -------
    Structure

    Raises
    ------
    FormatError
        Truncated, or with a segment that contradicts itself or the file.
    """
    with path.open("rb", buffering=0) as stream:
        size = stream.seek(0, 2)
        structure = Structure(path, size)
        walker = _Walker(structure, stream)
        try:
            while walker.position < size:
                walker.step()
        except DamagedError as error:
            raise FormatError(f"{path}: segment {walker.number} at byte {walker.position}: {error}") from error
    structure.flags.extend(walker.summary())
    return structure


class _Walker:
    """Goes from segment to segment."""

    def __init__(self, structure: Structure, stream: BinaryIO) -> None:
        self.structure = structure
        self.stream = stream
        self.lists = Lists(structure)
        self.position = 0
        self.number = 1
        self.shape: Shape | None = None
        self.last_toc = -1
        self.layout = 0
        self.versions: set[int] = set()
        self.empty_claims = 0
        self.stray_bytes = 0
        self.stray_segments = 0
        self.n_notes = 0

    def _read(self, position: int, count: int) -> bytes:
        self.stream.seek(position)
        data = self.stream.read(count)
        while len(data) < count and (more := self.stream.read(count - len(data))):
            data += more
        return data

    def step(self) -> None:
        """Read one lead-in and what it says, and go behind the segment."""
        structure, size, start = self.structure, self.structure.size, self.position
        head = self._read(start, LEAD_IN + (len(self.shape.data) if self.shape is not None else 0))
        if head[:4] != TAG or len(head) < LEAD_IN:
            self._no_segment(head[:LEAD_IN])
            return
        (toc,) = struct.unpack_from("<I", head, 4)
        order = ">" if toc & IS_BIG_ENDIAN else "<"
        version, next_offset, raw_offset = struct.unpack_from(order + "IQQ", head, 8)
        self.versions.add(version)
        data_at = start + LEAD_IN + raw_offset
        end = size if next_offset == OPEN else start + LEAD_IN + next_offset
        if data_at > end and next_offset != OPEN:
            raise DamagedError(f"its values begin at byte {data_at}, behind its end at byte {end}")
        if data_at > size:
            raise FormatError(
                f"{structure.path}: truncated: the list of channels of segment {self.number} goes to byte {data_at}, "
                f"the file has {size}; {len(structure.positions)} stretches of values lie before it"
            )
        self._metadata(toc, order, raw_offset, head[LEAD_IN:])
        self._values(toc, data_at, end, is_open=next_offset == OPEN)
        self.position, self.number, self.last_toc = end, self.number + 1, toc

    def _metadata(self, toc: int, order: str, raw_offset: int, held: bytes) -> None:
        if not toc & HAS_METADATA:
            if self.last_toc < 0:
                raise DamagedError("the first segment lists no channels")
            if toc != self.last_toc:
                self.layout = self.lists.layout(toc)
            return
        layout_bits = HAS_METADATA | NEW_LIST | IS_INTERLEAVED | IS_BIG_ENDIAN
        same_toc = toc & layout_bits == self.last_toc & layout_bits
        if same_toc and self.shape is not None and raw_offset >= len(held) == len(self.shape.data):
            changes = () if held == self.shape.data else self.shape.changes(held)
            if changes is not None:
                for path, name, value in changes:
                    self.lists.set_property(path, name, value)
                self._padding(len(held), raw_offset)
                return
        objects, spots, used = self._parsed(order, raw_offset, held)
        self.shape = None
        self.lists.apply(objects, bool(toc & NEW_LIST))
        self.layout = self.lists.layout(toc)
        if used <= MAX_CACHED:
            data = held[:used] if len(held) >= used else self._read(self.position + LEAD_IN, used)
            self.shape = Shape(data, order, spots)
        self._padding(used, raw_offset)

    def _parsed(
        self, order: str, raw_offset: int, held: bytes
    ) -> tuple[tuple[ListedObject, ...], tuple[Spot, ...], int]:
        """Objects of the segment, their spots, and the bytes they take; the padding behind them is not read."""
        length = min(raw_offset, FIRST_READ)
        while True:
            data = held[:length] if len(held) >= length else self._read(self.position + LEAD_IN, length)
            cached = self.lists.cache.get((order, data))
            if cached is not None:
                return (*cached, len(data))
            try:
                objects, spots, used = parse_objects(data, order)
            except OutOfBytesError:
                if length == raw_offset:
                    raise DamagedError(f"its list of channels does not end within its {raw_offset} bytes") from None
                if length >= MAX_METADATA:
                    raise DamagedError(f"its list of channels is longer than {MAX_METADATA} bytes") from None
                length = min(raw_offset, 4 * length)
                continue
            if used == len(data) <= MAX_CACHED and len(self.lists.cache) < 64:
                self.lists.cache[(order, data)] = (objects, spots)
            return objects, spots, used

    def _padding(self, used: int, raw_offset: int) -> None:
        """Note bytes between the list of channels and the values, unless they are zeros."""
        if raw_offset > used:
            gap = self._read(self.position + LEAD_IN + used, min(raw_offset - used, MAX_PADDING_READ))
            if any(gap):
                self.stray_bytes += raw_offset - used
                self.stray_segments += 1

    def _values(self, toc: int, data_at: int, end: int, is_open: bool) -> None:
        """Note the chunks of the segment."""
        size = self.structure.size
        n_bytes = min(end, size) - data_at
        chunk = self.lists.chunk_bytes[self.layout]
        if end > size:
            self._truncated(n_bytes, end - data_at, chunk)
        if not toc & HAS_RAW:
            if n_bytes:
                self._note(f"segment {self.number} says that it has no values, but holds {n_bytes} bytes: left out")
            return
        if chunk == 0:
            if n_bytes:
                raise DamagedError(f"{n_bytes} bytes of values, and no channel they belong to")
            return
        if n_bytes == 0:
            self.empty_claims += 1
        whole, rest = divmod(n_bytes, chunk)
        if whole:
            self._add(self.layout, data_at, whole)
        if rest:
            self._part(toc, data_at, whole, rest, is_open)
        elif is_open:
            self._note(f"{self._begin(is_open)}its {whole} whole chunks up to the end of the file are read")

    def _begin(self, is_open: bool) -> str:
        if is_open:
            return f"the recording was not closed: the length of its last segment ({self.number}) was never written; "
        return f"segment {self.number} is shorter than its list of channels says: "

    def _note(self, text: str) -> None:
        """Flag the first few of a kind of which there may be one a segment."""
        self.n_notes += 1
        if self.n_notes <= MAX_NOTES:
            self.structure.flags.append(text)

    def _add(self, layout: int, position: int, n_chunks: int) -> None:
        self.structure.segment_layouts.append(layout)
        self.structure.positions.append(position)
        self.structure.chunks.append(n_chunks)

    def _claimed(self, chunk: int, claimed_bytes: int, held_bytes: int) -> str:
        """Values that a segment claims and holds, of the first channel in it."""
        structure = self.structure
        channel, n = structure.layouts[self.layout].counts(structure.indexes)[0]
        before = structure.n_values(channel)
        return (
            f"channel {label(structure.objects[channel])} claims {before + claimed_bytes * n // chunk} values, "
            f"the file holds {before + held_bytes // chunk * n} in whole chunks"
        )

    def _truncated(self, held: int, claimed: int, chunk: int) -> None:
        text = f"; {self._claimed(chunk, claimed, held)}" if chunk else ""
        raise FormatError(
            f"{self.structure.path}: truncated: segment {self.number} claims {claimed} bytes of values, "
            f"the file holds {held}{text}"
        )

    def _part(self, toc: int, data_at: int, whole: int, rest: int, is_open: bool) -> None:
        """Note a last chunk that is shorter than its index says, where its values can be told apart."""
        structure, chunk = self.structure, self.lists.chunk_bytes[self.layout]
        layout = structure.layouts[self.layout]
        taken = layout.split_part(rest, structure.indexes)
        if is_open and not (layout.interleaved or layout.is_daqmx(structure.indexes)):
            taken = None  # its channels follow one another: the first is whole, the last is missing
        if not is_open and taken != rest:
            raise DamagedError(
                f"its {whole * chunk + rest} bytes of values end {rest} bytes into a chunk of {chunk} bytes; "
                + self._claimed(chunk, (whole + 1) * chunk, whole * chunk)
            )
        if not taken:
            self._note(f"{self._begin(is_open)}the last {rest} bytes, less than a chunk of {chunk} bytes, are left out")
            return
        part = self.lists.layout(toc, part_bytes=taken)
        self._add(part, data_at + whole * chunk, 1)
        count = structure.layouts[part].counts(structure.indexes)[0][1]
        full = layout.counts(structure.indexes)[0][1]
        dropped = f"; the last {rest - taken} bytes are left out" if taken != rest else ""
        self._note(
            f"{self._begin(is_open)}its last chunk holds {count} of {full} values a channel, which are read{dropped}"
        )

    def _no_segment(self, head: bytes) -> None:
        """Refuse what stands where a segment has to begin; zeros at the end are only noted."""
        structure, rest = self.structure, self.structure.size - self.position
        if head[:4] == TAG[: len(head[:4])]:
            raise FormatError(
                f"{structure.path}: truncated: segment {self.number} begins at byte {self.position}, "
                f"{rest} bytes before the end of the file"
            )
        if self.number == 1:
            raise FormatError(f"{structure.path}: no TDMS file; it begins with {head[:4]!r}")
        if rest <= MAX_PADDING_READ and not any(self._read(self.position, rest)):
            structure.flags.append(f"the last {rest} bytes are zeros that belong to no segment")
            self.position = structure.size
            return
        raise DamagedError(
            f"no segment begins there (found {head[:4]!r}): {rest} bytes up to the end of the file cannot be read, "
            "or the length of the segment before is wrong"
        )

    def summary(self) -> list[str]:
        """What is odd about many segments, a sentence each."""
        flags = []
        if self.n_notes > MAX_NOTES:
            flags.append(f"{self.n_notes - MAX_NOTES} more segments are shorter than they say, or hold stray bytes")
        if self.lists.n_events >= MAX_EVENTS:
            flags.append(
                f"start times and increments are written anew more than {MAX_EVENTS} times: not all are checked"
            )
        strange = sorted(self.versions - set(VERSIONS))
        if strange:
            flags.append(f"TDMS version {', '.join(map(str, strange[:5]))} is not known; 4712 and 4713 are")
        if self.empty_claims:
            flags.append(f"{self.empty_claims} segments list channels with values and hold none")
        if self.stray_segments:
            flags.append(
                f"{self.stray_bytes} bytes that belong to nothing stand between lists of channels and values "
                f"({self.stray_segments} segments)"
            )
        return flags

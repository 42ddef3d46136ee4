"""Which objects have values, and what their properties are, as the segments so far say."""

from __future__ import annotations

from typing import Final

from tdacoustic.formats.tdms.layouts import Layout
from tdacoustic.formats.tdms.metadata import (
    MAX_PROPERTIES,
    SAME,
    DamagedError,
    Instant,
    ListedObject,
    PropertyValue,
    RawIndex,
    Spot,
    read_value,
)
from tdacoustic.formats.tdms.paths import label
from tdacoustic.formats.tdms.structure import Starts, Structure

__all__ = ["IS_BIG_ENDIAN", "IS_INTERLEAVED", "MAX_EVENTS", "Lists", "Shape"]

IS_INTERLEAVED, IS_BIG_ENDIAN = 1 << 5, 1 << 6
MAX_OBJECTS = 20_000
MAX_ENTRIES = 500_000
"""Channels of all different chunks together."""

MAX_EVENTS = 2_000_000
MAX_NUMBERS = 200_000
TRACKED: Final = frozenset({"wf_increment", "wf_start_offset"})


class Shape:
    """The bytes of a segment's metadata without the values of its properties.

    Programs that state a new start time with every segment change nothing else: then these few values are taken and
    the rest need not be parsed.
    """

    def __init__(self, data: bytes, order: str, spots: tuple[Spot, ...]) -> None:
        self.data = data
        self.order = order
        self.spots = spots
        mask = bytearray(b"\xff" * len(data))
        for spot in spots:
            mask[spot.start + 4 : spot.stop] = bytes(spot.stop - spot.start - 4)
        self.mask = int.from_bytes(mask, "little")
        self.fixed = int.from_bytes(data, "little") & self.mask

    def changes(self, data: bytes) -> list[tuple[str, str, PropertyValue]] | None:
        """Properties that other bytes of this shape set anew; None where they are of another shape."""
        if int.from_bytes(data, "little") & self.mask != self.fixed:
            return None
        before, self.data = self.data, data
        return [
            (path, name, read_value(data, start, self.order)[0])
            for start, stop, path, name in self.spots
            if data[start:stop] != before[start:stop]
        ]


class Lists:
    """Which objects have values now, as the segments so far say."""

    def __init__(self, structure: Structure) -> None:
        self.structure = structure
        self.numbers: dict[str, int] = {}
        self.index_numbers: dict[RawIndex, int] = {}
        self.last_index: dict[int, int] = {}
        self.current: dict[int, int] = {}
        self.layout_numbers: dict[Layout, int] = {}
        self.chunk_bytes: list[int] = []
        self.n_entries = 0
        self.n_properties = 0
        self.n_events = 0
        self.cache: dict[tuple[str, bytes], tuple[tuple[ListedObject, ...], tuple[Spot, ...]]] = {}

    def apply(self, objects: tuple[ListedObject, ...], new_list: bool) -> None:
        """Take over what a segment's metadata says."""
        if new_list:
            self.current = {}
        for listed in objects:
            number = self.numbers.get(listed.path)
            if number is None:
                number = self._new_object(listed.path)
            if listed.raw_index is None:
                self.current[number] = SAME
            elif isinstance(listed.raw_index, RawIndex):
                index = self.index_numbers.get(listed.raw_index)
                if index is None:
                    index = self.index_numbers[listed.raw_index] = len(self.structure.indexes)
                    self.structure.indexes.append(listed.raw_index)
                self.last_index[number] = self.current[number] = index
            elif number in self.last_index:
                self.current[number] = self.last_index[number]
            else:
                raise DamagedError(f"{label(listed.path)} has values laid out as before, and had none before")
            for name, value in listed.properties:
                self.set_property(listed.path, name, value)

    def _new_object(self, path: str) -> int:
        if len(self.numbers) >= MAX_OBJECTS:
            raise DamagedError(f"more than {MAX_OBJECTS} objects")
        number = self.numbers[path] = len(self.structure.objects)
        self.structure.objects.append(path)
        return number

    def set_property(self, path: str, name: str, value: PropertyValue) -> None:
        """Take over a property, and keep what the ones that time the values were before."""
        structure = self.structure
        known = structure.properties.setdefault(path, {})
        if name == "wf_start_time" and isinstance(value, Instant):
            starts = structure.starts.setdefault(path, Starts())
            if self.n_events < MAX_EVENTS:
                self.n_events += starts.add(len(structure.positions), value)
        elif name in TRACKED:
            events = structure.events.setdefault((path, name), [])
            if (not events or events[-1][1] != value) and len(events) < MAX_NUMBERS:
                events.append((len(structure.positions), value))
        if name not in known:
            self.n_properties += 1
            if self.n_properties > MAX_PROPERTIES:
                raise DamagedError(f"more than {MAX_PROPERTIES} properties")
        elif name.startswith("NI_Scal") and known[name] != value:
            structure.rescaled.add(path)
        known[name] = value

    def layout(self, toc: int, part_bytes: int = 0) -> int:
        """Number of the layout that the current list makes."""
        entries = tuple(item for item in self.current.items() if item[1] != SAME)
        order = ">" if toc & IS_BIG_ENDIAN else "<"
        layout = Layout(entries, order, bool(toc & IS_INTERLEAVED), part_bytes)
        number = self.layout_numbers.get(layout)
        if number is None:
            self.n_entries += len(entries)
            if self.n_entries > MAX_ENTRIES:
                raise DamagedError("the list of channels changes too often: write it without fragmentation")
            self.chunk_bytes.append(part_bytes or layout.chunk_bytes(self.structure.indexes))
            number = self.layout_numbers[layout] = len(self.structure.layouts)
            self.structure.layouts.append(layout)
        return number

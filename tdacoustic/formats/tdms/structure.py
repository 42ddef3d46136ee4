"""What is known of a TDMS file before a sample is read: its objects, their properties, and where values lie."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field
from pathlib import Path

from tdacoustic.formats.tdms.layouts import Layout
from tdacoustic.formats.tdms.metadata import Instant, PropertyValue, RawIndex

__all__ = ["Starts", "Structure"]


class Starts:
    """Start times that an object had, each with the number of stretches before it."""

    def __init__(self) -> None:
        self.numbers = array("q")
        self.seconds = array("q")
        self.fractions = array("Q")

    def add(self, number: int, value: Instant) -> bool:
        """Note a start time, unless it is the one before."""
        if self.numbers and self.seconds[-1] == value.seconds and self.fractions[-1] == value.fraction:
            return False
        self.numbers.append(number)
        self.seconds.append(value.seconds)
        self.fractions.append(value.fraction)
        return True


@dataclass
class Structure:
    """What the walk found.

    Parameters
    ----------
    path : Path
    size : int
        Of the file, bytes.
    objects : list of str
        Paths; their numbers are those in `Layout.entries`.
    indexes : list of RawIndex
    layouts : list of Layout
    segment_layouts, positions, chunks : array
        Of each stretch of whole chunks with values: which layout, at which byte, how many.
    properties : dict
        Object path -> name -> last value.
    events : dict
        (object path, name) -> increments and offsets that it had, each with the number of stretches before it.
    starts : dict
        Object path -> start times that it had.
    rescaled : set of str
        Objects whose scaling was changed after it was given.
    flags : list of str
    """

    path: Path
    size: int
    objects: list[str] = field(default_factory=list)
    indexes: list[RawIndex] = field(default_factory=list)
    layouts: list[Layout] = field(default_factory=list)
    segment_layouts: array[int] = field(default_factory=lambda: array("q"))
    positions: array[int] = field(default_factory=lambda: array("q"))
    chunks: array[int] = field(default_factory=lambda: array("q"))
    properties: dict[str, dict[str, PropertyValue]] = field(default_factory=dict)
    events: dict[tuple[str, str], list[tuple[int, PropertyValue]]] = field(default_factory=dict)
    starts: dict[str, Starts] = field(default_factory=dict)
    rescaled: set[str] = field(default_factory=set)
    flags: list[str] = field(default_factory=list)

    def n_values(self, channel: int) -> int:
        """How many values of an object the stretches so far hold."""
        counts = [dict(layout.counts(self.indexes)).get(channel, 0) for layout in self.layouts]
        return sum(counts[layout] * n for layout, n in zip(self.segment_layouts, self.chunks, strict=True))

"""What a MAT-file of any level holds: structures of arrays, numbers and texts."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tdacoustic.formats.hdf5.tree import MAX_COLUMNS, skipped_flags

__all__ = ["LEFT_OUT", "MAX_TEXT", "Array", "Struct", "Workspace", "reason_of_shape"]

MAX_TEXT = 1000
MAX_METADATA = 60

LEFT_OUT = {
    "cell": "are cells: save what is in them as numeric variables (x1 = c{1}; ...)",
    "struct array": "are arrays of structures: save each element as a variable of its own (s1 = s(1); ...)",
    "sparse": "are sparse: save full(x)",
    "complex": "are complex, no time signals: save real(x) if that is what is meant",
    "function_handle": "are function handles: nothing is ever executed",
    "object": "are objects: save their properties as numeric variables",
    "string": "are strings: save char(x)",
    "table": "are tables: save s = table2struct(x, 'ToScalar', true)",
    "timetable": "are timetables: save s = table2struct(timetable2table(x), 'ToScalar', true), time as seconds",
    "timeseries": "are timeseries: save x.Data and x.Time as variables",
    "datetime": "are datetimes: save seconds(x - x(1)) and char(x(1))",
    "duration": "are durations: save seconds(x)",
}
"""Why something is left out, and how to export it."""


@dataclass(frozen=True)
class Array:
    """A real numeric array of one or two dimensions and at least two values.

    Parameters
    ----------
    name : str
        Of the variable or the field.
    shape : (int, int)
        Rows and columns, as MATLAB sees them.
    dtype : numpy.dtype
        Of MATLAB's class, which is not how the values are stored.
    logical : bool
    key : Any
        What the reader finds the values by.
    sample : callable
        Value at an index along a vector; for scanning only.
    flags : tuple of str
    """

    name: str
    shape: tuple[int, int]
    dtype: np.dtype[Any]
    logical: bool
    key: Any
    sample: Callable[[int], float]
    flags: tuple[str, ...] = ()

    @property
    def is_vector(self) -> bool:
        """One row or one column."""
        return min(self.shape) == 1

    @property
    def time_axis(self) -> int:
        """The longer axis; the first where they are equal."""
        return 0 if self.shape[0] >= self.shape[1] else 1


@dataclass(eq=False)
class Struct:
    """A structure, or the workspace itself, which has no name."""

    name: str = ""
    parent: Struct | None = None
    arrays: list[Array] = field(default_factory=list)
    numbers: list[tuple[str, float]] = field(default_factory=list)
    texts: list[tuple[str, str]] = field(default_factory=list)
    lists: list[tuple[str, tuple[str, ...]]] = field(default_factory=list)
    structs: list[Struct] = field(default_factory=list)

    def path(self, name: str = "") -> str:
        """Name of the structure, or of something in it, from the workspace on."""
        parts = [name] if name else []
        owner: Struct | None = self
        while owner is not None:
            if owner.name:
                parts.append(owner.name)
            owner = owner.parent
        return ".".join(reversed(parts))

    def struct(self, name: str) -> Struct | None:
        """The first structure of that name in it."""
        return next((struct for struct in self.structs if struct.name == name), None)

    def array(self, name: str) -> Array | None:
        """The first array of that name in it."""
        return next((array for array in self.arrays if array.name == name), None)

    def number(self, name: str) -> float | None:
        """The first number of that name in it."""
        return next((number for known, number in self.numbers if known == name), None)

    def text(self, name: str) -> str | None:
        """The first text of that name in it."""
        return next((text for known, text in self.texts if known == name), None)

    def below(self) -> Iterator[Struct]:
        """It and all structures in it."""
        yield self
        for struct in self.structs:
            yield from struct.below()


@dataclass
class Workspace:
    """The variables of a file.

    Parameters
    ----------
    root : Struct
    left_out : dict
        Reason -> paths.
    flags : list of str
    metadata : list of (str, str)
        What the file's own header says.
    """

    root: Struct = field(default_factory=Struct)
    left_out: dict[str, list[str]] = field(default_factory=dict)
    flags: list[str] = field(default_factory=list)
    metadata: list[tuple[str, str]] = field(default_factory=list)

    def leave_out(self, kind: str, path: str) -> None:
        """Note that something is left out; `kind` is a key of `LEFT_OUT`, or the reason itself."""
        self.left_out.setdefault(LEFT_OUT.get(kind, kind), []).append(path)

    def all_flags(self) -> tuple[str, ...]:
        """What was left out, and what is odd."""
        return (*skipped_flags(self.left_out), *self.flags)

    def header_fields(self) -> tuple[tuple[str, str], ...]:
        """What the file's header says, and the texts and numbers of its variables."""
        fields = list(self.metadata)
        for struct in self.root.below():
            fields += [(struct.path(name), text) for name, text in struct.texts if text]
            fields += [(struct.path(name), f"{number:.15g}") for name, number in struct.numbers]
            fields += [(struct.path(name), ", ".join(texts)) for name, texts in struct.lists]
        return tuple((name, text[:MAX_TEXT]) for name, text in fields[:MAX_METADATA])


def reason_of_shape(shape: tuple[int, ...]) -> str | None:
    """Why an array of that shape can be no channel, None if it can."""
    if len(shape) > 2:
        return "have more than two dimensions: save x(:, :, 1) and so on as variables"
    if min(shape) > MAX_COLUMNS:
        return f"are matrices of more than {MAX_COLUMNS} columns"
    return None

"""From the stored numbers of a channel to its values: the CC blocks of MDF 4 that end in numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.formats.mdf4.formula import Formula, parse_formula
from tdacoustic.formats.mdf4.walk import Block, Walk

__all__ = ["Conversion", "read_conversion"]

Real = NDArray[np.float64]

NONE, LINEAR, RATIONAL, ALGEBRAIC, INTERPOLATED, NEAREST, RANGES = range(7)
TEXTS: Final = (7, 8, 9, 10, 11)


@dataclass(frozen=True)
class Conversion:
    """A conversion that ends in numbers.

    Parameters
    ----------
    kind : int
        cc_type of the standard: 0 none, 1 linear, 2 rational, 3 algebraic, 4 and 5 tables with and without
        interpolation, 6 a table of ranges.
    values : tuple of float
        Its parameters in the file's order.
    formula : Formula or None
        Of kind 3.
    """

    kind: int = NONE
    values: tuple[float, ...] = ()
    formula: Formula | None = None

    @property
    def line(self) -> tuple[float, float] | None:
        """Factor and offset where ``value = stored * factor + offset``, else None."""
        if self.kind == NONE:
            return 1.0, 0.0
        return (self.values[1], self.values[0]) if self.kind == LINEAR else None

    def __call__(self, stored: Real, is_whole: bool) -> Real:
        """Return values in float64.

        Parameters
        ----------
        stored : ndarray of float64
            May be changed.
        is_whole : bool
            The stored numbers are integers: ranges then include their upper end.
        """
        if self.kind == NONE:
            return stored
        with np.errstate(all="ignore"):
            if self.kind == LINEAR:
                stored *= self.values[1]
                stored += self.values[0]
                return stored
            if self.kind == RATIONAL:
                return np.asarray(np.polyval(self.values[:3], stored) / np.polyval(self.values[3:], stored))
        if self.formula is not None:
            return self.formula(stored)
        table = np.asarray(self.values)
        if self.kind == RANGES:
            return _from_ranges(stored, table, is_whole)
        if self.kind == INTERPOLATED:
            return np.asarray(np.interp(stored, table[0::2], table[1::2]))
        keys = table[0::2]
        found = table[1::2][np.searchsorted(0.5 * (keys[:-1] + keys[1:]), stored)]
        return np.where(np.isnan(stored), np.nan, found)


def _from_ranges(stored: Real, table: Real, is_whole: bool) -> Real:
    low, high, values = table[:-1].reshape(-1, 3).T
    at = np.searchsorted(low, stored, side="right") - 1
    within = (at >= 0) & ((stored <= high[at]) if is_whole else (stored < high[at]))
    return np.where(within, values[at], table[-1])


def read_conversion(walk: Walk, address: int) -> tuple[Conversion | str, str | None]:
    """Return a conversion, and the unit it states.

    Returns
    -------
    conversion : Conversion or str
        Why it cannot be used, where that is so: words that follow "they".
    unit : str or None

    Raises
    ------
    FormatError
        Damaged.
    """
    if not address:
        return Conversion(), None
    block = walk.block(address, ("CC",), "conversion")
    unit = walk.text(block.link(1))
    kind, _, _, n_references, n_values = block.fields("<BBHHH")
    if kind in TEXTS:
        return "are converted to texts", unit
    if kind == ALGEBRAIC:
        text = walk.text(block.link(4)) if n_references else None
        formula = parse_formula(text or "")
        if formula is None:
            return "are converted by a formula that is more than arithmetic, and no code of a file is executed", unit
        return Conversion(ALGEBRAIC, (), formula), unit
    return _checked(kind, _parameters(block, n_values)), unit


def _parameters(block: Block, count: int) -> tuple[float, ...]:
    return tuple(float(value) for value in block.fields(f"<{count}d", 24))


def _checked(kind: int, values: tuple[float, ...]) -> Conversion | str:
    """Return the conversion, or why its parameters make none."""
    if kind == NONE:
        return Conversion()
    if not all(math.isfinite(value) for value in (values[:-1] if kind == RANGES else values)):
        return "are converted with parameters that are no numbers"
    if kind == LINEAR and len(values) == 2:
        return Conversion(kind, values) if values[1] != 0.0 else "are converted with a factor of zero"
    if kind == RATIONAL and len(values) == 6:
        return Conversion(kind, values) if any(values[3:]) else "are converted with a divisor of zero"
    if kind in (INTERPOLATED, NEAREST) and values and len(values) % 2 == 0:
        keys = values[0::2]
        ascends = all(one < other for one, other in pairwise(keys))
        return Conversion(kind, values) if ascends else "are converted with a table whose keys do not ascend"
    if kind == RANGES and len(values) % 3 == 1 and len(values) > 1:
        ends = [end for at in range(0, len(values) - 1, 3) for end in values[at : at + 2]]
        ascends = all(one <= other for one, other in pairwise(ends))
        return Conversion(kind, values) if ascends else "are converted with ranges that do not ascend"
    return f"have a conversion of kind {kind} with {len(values)} parameters"

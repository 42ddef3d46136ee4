"""Numbers out of records: fields of any bits, and which of their samples are marked invalid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tdacoustic.formats.integers import full_scale_of
from tdacoustic.formats.mdf4.conversions import Conversion
from tdacoustic.formats.mdf4.groups import Channel

__all__ = ["Field", "field_of"]

Bytes = NDArray[np.uint8]


@dataclass(frozen=True)
class Field:
    """Where a channel's number stands in a record, and how its value is made of it.

    Parameters
    ----------
    byte_offset : int
        In the record, behind its id.
    bit_offset, bit_count : int
    kind : str
        ``"u"``, ``"i"`` or ``"f"``.
    big_endian : bool
    conversion : Conversion
    invalid_bit : int or None
        Of the record's invalidation bytes.
    """

    byte_offset: int
    bit_offset: int
    bit_count: int
    kind: str
    big_endian: bool
    conversion: Conversion
    invalid_bit: int | None = None

    @property
    def n_bytes(self) -> int:
        """Bytes it reaches over."""
        return (self.bit_offset + self.bit_count + 7) // 8

    @property
    def _whole(self) -> bool:
        return self.bit_offset == 0 and self.bit_count in (8, 16, 32, 64)

    def stored(self, records: Bytes) -> NDArray[Any]:
        """Return the stored numbers of records of shape (n, bytes)."""
        held = records[:, self.byte_offset : self.byte_offset + self.n_bytes]
        order = ">" if self.big_endian else "<"
        if self._whole:
            return held.view(f"{order}{self.kind}{self.n_bytes}")[:, 0]
        number = np.zeros((len(records), 8), dtype=np.uint8)
        if self.big_endian:
            number[:, 8 - self.n_bytes :] = held
        else:
            number[:, : self.n_bytes] = held
        bits = number.view(f"{order}u8")[:, 0].astype(np.uint64) >> np.uint64(self.bit_offset)
        above = np.uint64(64 - self.bit_count)
        if self.kind == "u":
            return bits << above >> above
        return (bits << above).view(np.int64) >> np.int64(64 - self.bit_count)

    def values(self, records: Bytes, invalid: Bytes | None) -> NDArray[np.float64]:
        """Return values in float64, NaN where the record says that they are invalid.

        Parameters
        ----------
        records : ndarray of uint8, shape (n, bytes)
        invalid : ndarray of uint8, shape (n, bytes), or None
            Invalidation bytes.
        """
        found = self.conversion(self.stored(records).astype(np.float64), self.kind != "f")
        if self.invalid_bit is not None and invalid is not None:
            found[self.marked(invalid)] = np.nan
        return found

    def marked(self, invalid: Bytes) -> NDArray[np.bool_]:
        """Return which records say that this value of theirs is invalid."""
        bit = self.invalid_bit or 0
        return (invalid[:, bit // 8] >> np.uint8(bit % 8) & np.uint8(1)).astype(bool)

    @property
    def limits(self) -> tuple[float, float] | None:
        """Smallest and largest value, None for floats and for conversions other than linear ones."""
        line = self.conversion.line
        if self.kind == "f" or line is None:
            return None
        one, other = (end * line[0] + line[1] for end in _ends(self.kind, self.bit_count))
        return min(one, other), max(one, other)

    @property
    def full_scale(self) -> tuple[float | None, tuple[str, ...]]:
        """The number that means full scale, where nothing says what the numbers mean, and what is doubtful about it."""
        if self.kind == "f" or self.conversion.kind != 0:
            return None, ()
        return full_scale_of(*_ends(self.kind, self.bit_count))


def _ends(kind: str, bits: int) -> tuple[int, int]:
    """Smallest and largest integer."""
    return (0, 2**bits - 1) if kind == "u" else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)


def field_of(channel: Channel) -> Field:
    """Return the field of a channel whose values can be read."""
    assert isinstance(channel.conversion, Conversion)
    return Field(
        channel.byte_offset,
        channel.bit_offset,
        channel.bit_count,
        "uif"[channel.data_type // 2],
        bool(channel.data_type % 2),
        channel.conversion,
        channel.invalid_bit,
    )

"""Attributes of HDF5 objects under the names that loggers give them."""

from __future__ import annotations

import math
from itertools import islice
from typing import Any

import numpy as np

from tdacoustic.formats.rates import number_in, snap_rate, thousands_doubt

__all__ = ["Attributes"]

RATE_NAMES = frozenset(
    {
        "sampleratehz",
        "samplerate",
        "samplingrate",
        "samplingratehz",
        "samplingfrequency",
        "samplingfrequencyhz",
        "samplefreq",
        "samplefrequency",
        "samplingfreq",
        "fs",
        "fshz",
        "ratehz",
    }
)
INTERVAL_NAMES = frozenset(
    {
        *("dt", "dts", "deltat", "deltats", "timestep", "timesteps", "wfincrement", "increment", "xincrement"),
        *("sampleinterval", "sampleintervals", "samplinginterval", "samplingintervals", "sampleperiod"),
        *("samplingperiod",),
    }
)
"""Those that can mean nothing else: ``t_s`` may be any time in seconds."""

MAX_TEXT = 1000
MAX_ATTRIBUTE_BYTES = 1 << 20
MAX_ATTRIBUTES = 1000
MAX_MISSING = 16


def _plain(name: str | bytes) -> str:
    """Letters and digits of a name in lower case; none where it is bytes, as h5py has names that are not UTF-8."""
    if isinstance(name, bytes):
        return ""
    return "".join(character for character in name.lower() if character.isalnum())


class Attributes:
    """Attributes of a group or a dataset, read by name and never followed anywhere.

    Parameters
    ----------
    owner : h5py.Group or h5py.Dataset
    """

    def __init__(self, owner: Any) -> None:
        self._owner = owner

    def _length(self, name: str) -> int:
        """How many numbers or texts an attribute holds, 0 where it is not there or holds something else."""
        attributes = self._owner.attrs
        if name not in attributes:
            return 0
        try:
            stored = attributes.get_id(name)
            fits = stored.dtype.kind in "iufSUO" and stored.dtype.itemsize <= MAX_ATTRIBUTE_BYTES
            return math.prod(stored.shape or (1,)) if fits else 0
        except (OSError, TypeError, ValueError, KeyError, RuntimeError):
            return 0

    def _value(self, name: str) -> Any:
        """One scalar value, None where there is none or it is a reference or an array of several."""
        if self._length(name) != 1:
            return None
        try:
            value = self._owner.attrs[name]
        except (OSError, TypeError, ValueError, KeyError, RuntimeError):
            return None
        if isinstance(value, np.ndarray):
            value = value.reshape(-1)[0]
        if isinstance(value, bytes):
            try:
                value = value.decode("utf-8")
            except UnicodeDecodeError:
                value = value.decode("latin-1")
        return value if isinstance(value, str | int | float | np.number) else None

    def text(self, *names: str) -> str | None:
        """First of the attributes that is there and is text."""
        for name in names:
            value = self._value(name)
            if isinstance(value, str) and value.strip("\x00 \t\r\n"):
                return value.strip("\x00 \t\r\n")[:MAX_TEXT]
        return None

    def number(self, *names: str) -> float | None:
        """First of the attributes that is there and is a finite number, be it as text."""
        for name in names:
            number = _number(self._value(name))
            if number is not None:
                return number
        return None

    def several(self, *names: str) -> str | None:
        """Name of the first of the attributes that is there, where it holds several values."""
        name = next((name for name in names if self._length(name)), None)
        return name if name is not None and self._length(name) > 1 else None

    def missing(self) -> dict[str, tuple[float, ...]]:
        """Stored numbers that stand for a missing value, by the attribute that says so (NetCDF's conventions)."""
        found = {}
        for name in ("_FillValue", "missing_value"):
            if not 1 <= self._length(name) <= MAX_MISSING:
                continue
            try:
                numbers = np.atleast_1d(self._owner.attrs[name]).reshape(-1)
            except (OSError, TypeError, ValueError, KeyError, RuntimeError):
                continue
            if numbers.dtype.kind in "iuf":
                found[name] = tuple(number.item() for number in numbers)
        return found

    def rate(self, inherited: bool) -> tuple[float | None, float | None, tuple[str, ...]]:
        """Sampling rate in Hz, as stored where it was snapped, and why one that is stated is not taken.

        Parameters
        ----------
        inherited : bool
            Look at the groups above too.
        """
        owner = self._owner
        doubts: list[str] = []
        while True:
            for name in islice(owner.attrs, MAX_ATTRIBUTES):
                plain = _plain(name)
                value = Attributes(owner)._value(name) if plain in RATE_NAMES | INTERVAL_NAMES else None
                doubt = thousands_doubt(value) if isinstance(value, str) else None
                if doubt is not None:
                    doubts.append(f"{name!r}: {doubt}")
                number = _number(number_in(value) if isinstance(value, str) else value)
                if number is None or doubt is not None:
                    continue
                if plain in RATE_NAMES:
                    return (*snap_rate(number), ())
                if number > 0.0:
                    return (*snap_rate(1.0 / number), ())
            if owner.name in (None, "/"):
                return None, None, tuple(doubts[:1])
            above = owner.parent
            owner = above if inherited else above.file["/"]

    def storage_flags(self) -> tuple[str, ...]:
        """Say what part of a dataset was never written and reads as its fill value."""
        dataset = self._owner
        if dataset.chunks is None:
            if dataset.id.get_storage_size() == 0:
                return ("never written: all its values are the fill value",)
            return ()
        expected = math.prod(-(-size // chunk) for size, chunk in zip(dataset.shape, dataset.chunks, strict=True))
        written = int(dataset.id.get_num_chunks())
        if written < expected:
            return (f"{expected - written} of {expected} chunks were never written: they read as the fill value",)
        return ()


def _number(value: Any) -> float | None:
    if isinstance(value, str):
        value = value.strip().removesuffix("Hz").strip()
    try:
        number = float(value)
    except (TypeError, ValueError):
        return None
    return number if math.isfinite(number) else None

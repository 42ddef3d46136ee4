"""Attributes of HDF5 objects under the names that loggers give them."""

from __future__ import annotations

import math
from itertools import islice
from typing import Any

import numpy as np

from tdacoustic.formats.rates import snap_rate

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
    {"dt", "dts", "deltat", "wfincrement", "samplinginterval", "samplingintervals", "timestep", "timesteps"}
)
MAX_TEXT = 1000
MAX_ATTRIBUTE_BYTES = 1 << 20
MAX_ATTRIBUTES = 1000


def _plain(name: str) -> str:
    return "".join(character for character in name.lower() if character.isalnum())


class Attributes:
    """Attributes of a group or a dataset, read by name and never followed anywhere.

    Parameters
    ----------
    owner : h5py.Group or h5py.Dataset
    """

    def __init__(self, owner: Any) -> None:
        self._owner = owner

    def _value(self, name: str) -> Any:
        """One scalar value, None where there is none or it is a reference or an array."""
        attributes = self._owner.attrs
        if name not in attributes:
            return None
        try:
            stored = attributes.get_id(name)
            if stored.dtype.kind not in "iufSUO" or math.prod(stored.shape or (1,)) != 1:
                return None
            if stored.dtype.itemsize > MAX_ATTRIBUTE_BYTES:
                return None
            value = attributes[name]
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

    def rate(self, inherited: bool) -> tuple[float | None, float | None]:
        """Sampling rate in Hz, and as stored where it was snapped.

        Parameters
        ----------
        inherited : bool
            Look at the groups above too.
        """
        owner = self._owner
        while True:
            for name in islice(owner.attrs, MAX_ATTRIBUTES):
                plain = _plain(name)
                number = _number(Attributes(owner)._value(name)) if plain in RATE_NAMES | INTERVAL_NAMES else None
                if number is None:
                    continue
                if plain in RATE_NAMES:
                    return snap_rate(number)
                if number > 0.0:
                    return snap_rate(1.0 / number)
            if owner.name in (None, "/"):
                return None, None
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

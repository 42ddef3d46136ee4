"""Records: how each result came about."""

from __future__ import annotations

import platform
from dataclasses import dataclass
from functools import cache
from importlib import metadata

__all__ = ["Record", "versions"]

_RECORDED = ("tdacoustic", "numpy", "scipy", "pandas", "h5py", "soundfile", "pyuff", "PyOctaveBand", "numba", "lmfit")


@dataclass(frozen=True)
class Record:
    """What was done to make one result.

    Parameters
    ----------
    step : str
    version : int
    title : str
    label : str
        What it was done to.
    settings : str
        Canonical JSON of the settings.
    inputs : tuple of (str, str)
        Name and key (or ``sha256:...`` of a log) of each input.
    libraries : tuple of (str, str)
        Versions of the libraries in use; recorded, not part of the key.
    wall_s : float
        Time it took.
    """

    step: str
    version: int
    title: str
    label: str
    settings: str
    inputs: tuple[tuple[str, str], ...]
    libraries: tuple[tuple[str, str], ...]
    wall_s: float


@cache
def versions() -> tuple[tuple[str, str], ...]:
    """Versions of Python and of the libraries that make the numbers."""
    found = [("python", platform.python_version())]
    for name in _RECORDED:
        try:
            found.append((name, metadata.version(name)))
        except metadata.PackageNotFoundError:
            continue
    return tuple(found)

"""Time vectors of an HDF5 file: which give their neighbours a rate, and which say that these are uneven."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from tdacoustic.formats.hdf5.tree import NOT_RISING, is_called_time, raster_of_time_vector

__all__ = ["TimeVectors", "place_of", "time_vectors"]

Place = tuple[str, int]
"""Group and length: a vector is the time of the datasets that share both."""


@dataclass
class TimeVectors:
    """The time vectors of a file.

    Parameters
    ----------
    even : dict
        Place -> name, rate, start and raw rate.
    uneven : dict
        Place -> why its samples are not evenly spaced.
    names : set of str
        Of the vectors, which are no channels.
    left_out : dict
        Why datasets are no channels -> their names.
    flags : list of str
    """

    even: dict[Place, tuple[str, float, float, float | None]] = field(default_factory=dict)
    uneven: dict[Place, str] = field(default_factory=dict)
    names: set[str] = field(default_factory=set)
    left_out: dict[str, list[str]] = field(default_factory=dict)
    flags: list[str] = field(default_factory=list)

    def leave_out(self, name: str, n_samples: int) -> bool:
        """Whether a dataset is over a time that is uneven; it is noted among those left out."""
        reason = self.uneven.get(place_of(name, n_samples))
        if reason is not None:
            self.left_out.setdefault(f"are not evenly sampled and are not resampled ({reason})", []).append(name)
        return reason is not None


def place_of(name: str, length: int) -> Place:
    """Group of a dataset, and a length."""
    return name.rpartition("/")[0], length


def time_vectors(file: Any, datasets: Sequence[str]) -> TimeVectors:
    """Look at the ends of what is called a time and has a neighbour of its length.

    Parameters
    ----------
    file : h5py.File
    datasets : sequence of str
        Names of those that can be channels.
    """
    found = TimeVectors()
    held: dict[Place, int] = {}
    for name in datasets:
        for length in set(file[name].shape):
            held[place_of(name, length)] = held.get(place_of(name, length), 0) + 1
    for name in datasets:
        dataset = file[name]
        place = place_of(name, len(dataset))
        if dataset.ndim != 1 or held[place] < 2 or not is_called_time(name, dataset):
            continue
        raster = raster_of_time_vector(name, dataset)
        if raster is None:
            found.flags.append(f"{name!r} {NOT_RISING}")
        elif isinstance(raster, str):
            found.uneven.setdefault(place, raster)
            found.names.add(name)
        elif place not in found.even:
            found.even[place] = (name, *raster)
            found.names.add(name)
    return found

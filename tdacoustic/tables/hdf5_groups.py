"""Groups and arrays of ``result.h5``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import h5py

__all__ = ["SCHEMA", "describe", "group_of", "put"]

SCHEMA = "tdacoustic-result-file/1"


def describe(file: h5py.File, name: str, origin: str) -> None:
    """Write what a file is: its schema, and name and origin of its campaign or fleet."""
    file.attrs["schema"] = SCHEMA
    file.attrs["name"] = name
    file.attrs["origin"] = origin


def group_of(parent: h5py.Group, name: str) -> h5py.Group:
    """Make the group of a run, channel or condition."""
    shown = name.replace("/", "_")
    while shown in parent:
        shown += "_"
    group = parent.create_group(shown)
    group.attrs["name"] = name
    return group


def put(group: h5py.Group, name: str, values: Any, unit: str) -> None:
    """Write an array with its unit."""
    array = np.asarray(values, dtype=np.float64)
    options = {"compression": "gzip", "shuffle": True} if array.size > 1024 else {}
    dataset = group.create_dataset(name, data=array, track_times=False, **options)
    dataset.attrs["unit"] = unit

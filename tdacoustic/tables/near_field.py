"""Maps of the near field as rows, and as arrays in ``result.h5``."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

import numpy as np

from tdacoustic.drive import NearField
from tdacoustic.drive.near_field import INSIDE, OUTSIDE
from tdacoustic.tables.frames import Row
from tdacoustic.tables.hdf5_groups import put

if TYPE_CHECKING:
    import h5py

__all__ = ["near_field_rows", "write_near_field"]

PATHS: Final = ("structure", "mesh", "motor")
PLACES: Final = {OUTSIDE: "outside", INSIDE: "inside"}


def near_field_rows(field: NearField) -> Iterator[Row]:
    """Yield a row for each point outside of the housing, and inside where anything is computed there; in 0.01 dB.

    Parameters
    ----------
    field : NearField
    """
    places = PLACES if field.inside_path is not None else {OUTSIDE: PLACES[OUTSIDE]}
    for held in field.planes:
        points, codes = held.plane.points_m, held.plane.place.ravel()
        levels = {path: np.round(values, 2).ravel() for path, values in held.level_db.items()}
        for number in np.flatnonzero(np.isin(codes, list(places))).tolist():
            x, y, z = points[number].tolist()
            yield {
                "condition": field.condition,
                "plane": held.plane.name,
                "x_m": x,
                "y_m": y,
                "z_m": z,
                "place": places[int(codes[number])],
                "level_db": _known(levels["total"][number]),
                **{f"{path}_level_db": _known(levels[path][number]) for path in PATHS},
            }


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def write_near_field(group: h5py.Group, field: NearField) -> None:
    """Write the maps of a condition into a group, a group a plane.

    In each: ``right`` and ``up``, coordinates along the first and the second axis of the plane's name; ``place`` (0 in
    a wall or below the ground, 1 outside, 2 inside) and a level for each path and the total, rows upwards, NaN where
    there is none. The attribute ``at_m`` is the coordinate along the third axis.

    Parameters
    ----------
    group : h5py.Group
    field : NearField
    """
    for held in field.planes:
        plane = group.create_group(held.plane.name)
        plane.attrs["at_m"] = held.plane.at_m
        put(plane, "right", held.plane.right_m, "m")
        put(plane, "up", held.plane.up_m, "m")
        put(plane, "place", held.plane.place, "1")
        for path, values in held.level_db.items():
            put(plane, f"{path}_level", values, "dB re 20 uPa")

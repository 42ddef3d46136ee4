"""Maps close to a housing with levels put in by hand."""

import dataclasses

import numpy as np

from tdacoustic.drive import NearField
from tdacoustic.drive.near_field import INSIDE, OUTSIDE, MapPlane, PlaneMap

PATHS = ("structure", "mesh", "motor", "total")
LINE = np.linspace(-1.0, 1.0, 21)
SOURCES = (("motor", (0.0, 0.8, 0.0)), ("mesh", (0.0, 0.0, 0.4)))


def by_hand(level_of, adds=("motor",), condition="1"):
    """Maps around a box of 0.6 x 0.4 x 0.4 m with levels from a function of points and the box's places."""
    maps = []
    for name, across in (("XY", 2), ("XZ", 1), ("YZ", 0)):
        plane = MapPlane(name, 0.0, LINE, LINE, np.zeros((21, 21), dtype=np.int8))
        beyond = np.abs(plane.points_m) - [0.3, 0.2, 0.2]
        place = np.where(beyond.max(axis=1) < -1e-9, INSIDE, OUTSIDE).reshape(21, 21).astype(np.int8)
        plane = dataclasses.replace(plane, place=place)
        assert plane.axes[2] == across
        levels = level_of(plane.points_m).reshape(21, 21)
        maps.append(PlaneMap(plane, dict.fromkeys(PATHS, levels)))
    return NearField(condition, tuple(maps), (-0.3, -0.2, -0.2), (0.3, 0.2, 0.2), SOURCES, (100.0,), (), adds)


def bump(place, height=100.0):
    return lambda points: height - 30.0 * np.linalg.norm(points - np.asarray(place), axis=1)

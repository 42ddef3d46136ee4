"""Maps of a drive's sound in three planes around its housing: where their points lie, and what they say.

The planes are parallel to the drive frame's axes and pass through the middle of the housing [the paper does not say
where its own lie]; each is a square around the drive's centre, so that motor and gearbox are both on it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from tdacoustic.drive.levels import Path
from tdacoustic.fleet import Fleet
from tdacoustic.housing import Box
from tdacoustic.radiation.box_in_air import BoxInAir
from tdacoustic.radiation.field_maps import beyond_walls_m

__all__ = [
    "AROUND_HIGHEST_DB",
    "INSIDE",
    "NOWHERE",
    "OUTSIDE",
    "SOURCE_RADIUS_M",
    "LoudestPoint",
    "MapPlane",
    "NearField",
    "PlaneMap",
    "map_planes",
    "pattern_correlation",
]

Real = NDArray[np.float64]
Point = tuple[float, float, float]
PlaneName = Literal["XY", "XZ", "YZ"]
Place = Literal["outside", "inside"]

_AXES: Final[dict[PlaneName, tuple[int, int, int]]] = {"XY": (0, 1, 2), "XZ": (0, 2, 1), "YZ": (1, 2, 0)}
"""Numbers of the axes to the right, upwards and across each plane."""

NOWHERE: Final = 0
OUTSIDE: Final = 1
INSIDE: Final = 2
"""Places of points: in the walls or below the ground, outside of the housing, in its air."""

SOURCE_RADIUS_M: Final = 0.2
"""Points nearer to a point source than this are no part of what is said of a map [assumed]: the level grows without
bound towards the source, where a motor or a gear unit of finite size would be."""

AROUND_HIGHEST_DB: Final = 3.0
"""Below the highest level, down to which a region around it is outlined."""

_ON_THE_WALL_M: Final = 1e-9


@dataclass(frozen=True, eq=False)
class MapPlane:
    """The points of one plane.

    Parameters
    ----------
    name : {"XY", "XZ", "YZ"}
        The first axis runs to the right, the second upwards.
    at_m : float
        Along the third axis.
    right_m, up_m : ndarray, shape (n,) and (m,)
        In the drive frame, ascending, equally far apart.
    place : ndarray of int8, shape (m, n)
        `OUTSIDE`, `INSIDE` or `NOWHERE`.
    """

    name: PlaneName
    at_m: float
    right_m: Real
    up_m: Real
    place: NDArray[np.int8]

    @property
    def axes(self) -> tuple[int, int, int]:
        """Numbers of the axes to the right, upwards and across."""
        return _AXES[self.name]

    @property
    def points_m(self) -> Real:
        """All points in the drive frame: (m * n, 3), row by row."""
        right, up, across = self.axes
        found = np.empty((self.up_m.size, self.right_m.size, 3))
        found[..., right], found[..., up], found[..., across] = self.right_m, self.up_m[:, None], self.at_m
        return found.reshape(-1, 3)


def map_planes(fleet: Fleet, box: Box, body: BoxInAir) -> tuple[MapPlane, ...]:
    """Return the planes of ``[radiation] map_half_width_m`` and ``map_spacing_m``.

    Parameters
    ----------
    fleet : Fleet
    box : Box
        For the thickness of its walls; that of the bearing seats counts as air.
    body : BoxInAir
    """
    spacing = fleet.radiation.map_spacing_m.value
    count = math.floor(fleet.radiation.map_half_width_m.value / spacing + 1e-9)
    line: Real = spacing * np.arange(-count, count + 1, dtype=np.float64)
    found = []
    for name, (_, _, across) in _AXES.items():
        empty = MapPlane(name, body.position_m[across], line, line, np.zeros((line.size, line.size), dtype=np.int8))
        place = _places(box, body, empty.points_m).reshape(line.size, line.size)
        found.append(MapPlane(name, empty.at_m, line, line, place))
    return tuple(found)


def _places(box: Box, body: BoxInAir, points_m: Real) -> NDArray[np.int8]:
    free = 0.5 * np.asarray(box.extent_m) - np.asarray(box.thickness_m)
    found = np.full(len(points_m), NOWHERE, dtype=np.int8)
    found[beyond_walls_m(body, points_m) >= -_ON_THE_WALL_M] = OUTSIDE
    found[(np.abs(points_m - np.asarray(body.position_m)) < free).all(axis=1)] = INSIDE
    if body.ground_m is not None:
        found[points_m[:, 2] < body.ground_m] = NOWHERE
    return found


@dataclass(frozen=True)
class LoudestPoint:
    """The point with the highest level.

    Parameters
    ----------
    plane : {"XY", "XZ", "YZ"}
    position_m : (float, float, float)
    level_db : float
    """

    plane: PlaneName
    position_m: Point
    level_db: float


@dataclass(frozen=True, eq=False)
class PlaneMap:
    """The levels in one plane.

    Parameters
    ----------
    plane : MapPlane
    level_db : mapping of str to ndarray, shape (m, n)
        By path, and ``"total"``: unweighted; NaN where there is no sound or no place for it.
    """

    plane: MapPlane
    level_db: Mapping[Path, Real]


@dataclass(frozen=True, eq=False)
class NearField:
    """The maps of one condition.

    Parameters
    ----------
    condition : str
    planes : tuple of PlaneMap
        XY, XZ and YZ.
    low_m, high_m : (float, float, float)
        Outer corners of the housing.
    sources_m : tuple of (str, (float, float, float))
        Path and place of each point source that sounds, outside of the housing or in it.
    scattered_hz, free_hz : tuple of float
        Frequencies of all lines that are computed with the housing, and of point sources whose lines lie beyond its
        range: these go through it as if it were not there, and are no part of what is inside.
    adds : tuple of str
        Paths that the total adds.
    """

    condition: str
    planes: tuple[PlaneMap, ...]
    low_m: Point
    high_m: Point
    sources_m: tuple[tuple[str, Point], ...]
    scattered_hz: tuple[float, ...]
    free_hz: tuple[float, ...]
    adds: tuple[str, ...]

    @property
    def inside_path(self) -> Path | None:
        """The path whose levels stand for the inside: the total, or the structure alone where the total has none.

        Masuda's free source holds what the structure radiates outside; what that radiates inside is in no total then.
        None of a housing without levels inside.
        """
        paths: tuple[Path, ...] = ("total", "structure")
        return next((path for path in paths if self.highest("inside", path) is not None), None)

    def shown_db(self, held: PlaneMap) -> Real:
        """Return the levels of one of the planes, outside of the total and inside of `inside_path`: shape (m, n)."""
        inside = held.plane.place == INSIDE
        return np.where(inside, held.level_db[self.inside_path or "total"], held.level_db["total"])

    def highest(self, place: Place, path: Path | None = None) -> LoudestPoint | None:
        """Return the highest level of a path outside or inside, `SOURCE_RADIUS_M` away from its point sources.

        None where there is none. Default: the total outside, `inside_path` inside.
        """
        found = None
        for held in self.planes:
            levels = self._counted(held, place, path or self._path_of(place))
            if not np.isfinite(levels).any():
                continue
            row, column = np.unravel_index(int(np.nanargmax(levels)), levels.shape)
            level = float(levels[row, column])
            if found is None or level > found.level_db:
                x, y, z = held.plane.points_m.reshape(*levels.shape, 3)[row, column].tolist()
                found = LoudestPoint(held.plane.name, (x, y, z), level)
        return found

    def lies_between(self, position_m: Point) -> bool:
        """Whether a point is between a source of the motor and the wall of the housing that faces it."""
        for path, source in self.sources_m:
            if path != "motor":
                continue
            beyond = [max(low - x, x - high) for x, low, high in zip(source, self.low_m, self.high_m, strict=True)]
            facing = beyond.index(max(beyond))
            for axis, (x, low, high) in enumerate(zip(position_m, self.low_m, self.high_m, strict=True)):
                ends = (low, high)
                if axis == facing:
                    ends = (high, source[axis]) if source[axis] > high else (source[axis], low)
                if not ends[0] - _ON_THE_WALL_M <= x <= ends[1] + _ON_THE_WALL_M:
                    break
            else:
                return True
        return False

    def _path_of(self, place: Place) -> Path:
        return "total" if place == "outside" else self.inside_path or "total"

    def range_db(self, place: Place) -> tuple[float, float] | None:
        """Return the lowest and highest level that counts outside or inside; None of no sound."""
        path = self._path_of(place)
        held = np.concatenate([self._counted(one, place, path).ravel() for one in self.planes])
        held = held[np.isfinite(held)]
        return (float(held.min()), float(held.max())) if held.size else None

    def outline(self, name: PlaneName, place: Place) -> tuple[Real, Real]:
        """Return the border of the region within `AROUND_HIGHEST_DB` of the highest level of all planes.

        Returns
        -------
        right_m, up_m : ndarray
            Of the cells' edges in a plane, a NaN of `up_m` between the pieces; empty where the region is not in the
            plane.
        """
        loudest = self.highest(place)
        held = next(one for one in self.planes if one.plane.name == name)
        inside = np.zeros(held.plane.place.shape, dtype=bool)
        if loudest is not None:
            levels, there = held.level_db[self._path_of(place)], held.plane.place == _CODES[place]
            inside = there & (np.nan_to_num(levels, nan=-math.inf) >= loudest.level_db - AROUND_HIGHEST_DB)
            inside |= there & np.isnan(levels) & np.roll(inside, 1, axis=1)  # a source itself, as its neighbour
        return _border(inside, held.plane.right_m, held.plane.up_m)

    def _counted(self, held: PlaneMap, place: Place, path: Path = "total") -> Real:
        """Levels of a plane at one place, NaN elsewhere and close to point sources."""
        levels = np.where(held.plane.place == _CODES[place], held.level_db[path], math.nan)
        points = held.plane.points_m
        for of, source in self.sources_m:
            if of == path or (path == "total" and of in self.adds):
                near = np.linalg.norm(points - np.asarray(source), axis=1) < SOURCE_RADIUS_M - _ON_THE_WALL_M
                levels[near.reshape(levels.shape)] = math.nan
        return levels

    def pattern(self) -> Real:
        """Return the total levels outside of all planes in a row, NaN where none counts."""
        return np.concatenate([self._counted(held, "outside").ravel() for held in self.planes])


_CODES: Final[dict[Place, int]] = {"outside": OUTSIDE, "inside": INSIDE}


def pattern_correlation(fields: Sequence[NearField]) -> Real:
    """Return Pearson's correlation of the levels in dB outside the housing, pair by pair, shape (fields, fields).

    Points that count in all of the maps that sound are compared. NaN of maps without sound, or with the same level
    everywhere, with any other.

    Parameters
    ----------
    fields : sequence of NearField
        On the same planes.
    """
    patterns = np.stack([field.pattern() for field in fields])
    found = np.full((len(fields), len(fields)), math.nan)
    heard = np.flatnonzero(np.isfinite(patterns).any(axis=1))
    patterns = patterns[heard]
    patterns = patterns[:, np.isfinite(patterns).all(axis=0)]
    if patterns.shape[1] < 2:
        return found
    shaped = np.ptp(patterns, axis=1) > 0.0
    found[np.ix_(heard[shaped], heard[shaped])] = np.corrcoef(patterns[shaped])
    return found


def _border(inside: NDArray[np.bool_], right_m: Real, up_m: Real) -> tuple[Real, Real]:
    """Return the edges between cells inside and others, each of two corners and a gap."""
    half = 0.5 * float(right_m[1] - right_m[0])
    held = np.pad(inside, 1)
    x: list[float] = []
    y: list[float] = []
    for row, column in zip(*np.nonzero(inside), strict=True):
        right, up = float(right_m[column]), float(up_m[row])
        for side in (-1, 1):
            if not held[row + 1, column + 1 + side]:
                x += [right + side * half, right + side * half, right]
                y += [up - half, up + half, math.nan]
            if not held[row + 1 + side, column + 1]:
                x += [right - half, right + half, right]
                y += [up + side * half, up + side * half, math.nan]
    return np.array(x), np.array(y)

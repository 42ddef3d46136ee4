"""Openings of a hollow body: where the air inside meets the air outside, and how wide.

On a lattice of points with their distance to the surface. Air outside and the air of the hollow are parts of the air
that a ball of some radius reaches; the largest ball that still passes from one to the other is stuck in the opening.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.housing.step_file.triangles import Skin

__all__ = ["Opening", "openings_of", "samples"]

Real = NDArray[np.float64]
Mask = NDArray[np.bool_]

_CELLS: Final = 48
"""Of the lattice along the longest dimension."""

_LEAST: Final = 0.6
"""Smallest ball, in parts of a cell: with it no wall lies between two neighbours that it reaches."""

_HOLLOW: Final = 0.005
"""Least part of the bounding box's volume that makes a hollow [assumed]."""

_MOST: Final = 4
"""Openings that are looked for."""


@dataclass(frozen=True)
class Opening:
    """An opening into the hollow.

    Parameters
    ----------
    place_m : (float, float, float)
        Its middle, to a cell of the lattice.
    width_m : float
        Of the largest ball that passes, about.
    """

    place_m: tuple[float, float, float]
    width_m: float


@dataclass(frozen=True)
class Hollow:
    """The lattice around a body."""

    low_m: Real
    cell_m: float
    clearance_m: Real

    def reached(self, radius_m: float) -> NDArray[np.int32]:
        """Numbers of the connected parts of the air that a ball of a radius reaches; 0 where it does not fit."""
        from scipy.ndimage import label

        return np.asarray(label(self.clearance_m >= radius_m)[0], dtype=np.int32)


def openings_of(skin: Skin) -> tuple[tuple[Opening, ...], bool]:
    """Return the openings of a closed surface that has no void, the widest first, and whether it is hollow at all.

    Parameters
    ----------
    skin : Skin
    """
    hollow = _lattice(skin)
    inside = _deepest(hollow)
    if inside is None:
        return (), False
    found: list[Opening] = []
    clearance = hollow.clearance_m.copy()
    while len(found) < _MOST:
        held = Hollow(hollow.low_m, hollow.cell_m, clearance)
        opening = _widest(held, inside)
        if opening is None:
            break
        found.append(opening)
        apart = np.linalg.norm(_places(held) - np.array(opening.place_m), axis=-1)
        clearance = np.where(apart < 0.75 * opening.width_m + hollow.cell_m, -1.0, clearance)
        if clearance[inside] < 0.0:
            break
    return tuple(found), True


def _places(hollow: Hollow) -> Real:
    """Return the lattice's points, shape (nx, ny, nz, 3)."""
    steps = np.meshgrid(*(np.arange(n) for n in hollow.clearance_m.shape), indexing="ij")
    return np.asarray(hollow.low_m + hollow.cell_m * np.stack(steps, axis=-1))


def _lattice(skin: Skin) -> Hollow:
    from scipy.spatial import KDTree

    low, high = skin.points_m.min(axis=0), skin.points_m.max(axis=0)
    cell = float((high - low).max()) / _CELLS
    low = low - 2.37 * cell  # off the round numbers that drawings are made of
    shape = tuple(int(n) for n in np.ceil((high - low) / cell).astype(int) + 3)
    hollow = Hollow(low, cell, np.zeros(shape))
    places = _places(hollow)
    clearance = KDTree(samples(skin, 0.4 * cell)).query(places.reshape(-1, 3))[0].reshape(shape)
    for i in range(shape[0]):
        for j in range(shape[1]):
            crossings = skin.crossings(places[i, j, 0], 2)
            within = np.searchsorted(crossings, places[i, j, :, 2]) % 2 == 1
            clearance[i, j, within] = -1.0
    ends = skin.points_m.min(axis=0), skin.points_m.max(axis=0)
    beyond = ((places < ends[0]) | (places > ends[1])).any(axis=-1)
    clearance[beyond] = np.linalg.norm(ends[1] - ends[0])  # outside for certain, and all the room there is
    return Hollow(low, cell, clearance)


def samples(skin: Skin, apart_m: float) -> Real:
    """Return points on all triangles, so that none of a triangle's is farther than about a distance from one."""
    corners = skin.corners_m
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    pieces = np.ceil(longest / apart_m).astype(int)
    found = []
    for count in np.unique(pieces):
        i, j = np.meshgrid(np.arange(count + 1), np.arange(count + 1), indexing="ij")
        kept = i + j <= count
        shares = np.stack([i[kept], j[kept], count - i[kept] - j[kept]]) / count
        found.append(np.einsum("kn,mkd->mnd", shares, corners[pieces == count]).reshape(-1, 3))
    return np.concatenate(found)


def _deepest(hollow: Hollow) -> tuple[int, ...] | None:
    """Return the cell of the hollow with most room around it; None of a body that is not hollow."""
    best: tuple[float, tuple[int, ...]] | None = None
    least = max(8.0, _HOLLOW * hollow.clearance_m.size)
    for radius in np.linspace(_LEAST * hollow.cell_m, 0.5 * _CELLS * hollow.cell_m, 20):
        parts = hollow.reached(float(radius))
        sizes = np.bincount(parts.ravel()).astype(float)
        sizes[[0, parts[0, 0, 0]]] = 0.0
        largest = int(np.argmax(sizes))
        if sizes[largest] >= least and (best is None or sizes[largest] > best[0]):
            inside = np.where(parts == largest, hollow.clearance_m, -1.0)
            best = float(sizes[largest]), tuple(int(n) for n in np.unravel_index(int(inside.argmax()), inside.shape))
    return None if best is None else best[1]


def _widest(hollow: Hollow, inside: tuple[int, ...]) -> Opening | None:
    """Return the widest way from outside to a cell inside; None where there is none that the lattice sees."""

    def open_at(radius: float) -> bool:
        parts = hollow.reached(radius)
        return bool(parts[inside] == parts[0, 0, 0] != 0)

    low, high = _LEAST * hollow.cell_m, float(hollow.clearance_m[inside])
    if not open_at(low):
        return None
    while high - low > 0.02 * hollow.cell_m:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if open_at(middle) else (low, middle)
    return Opening(_meeting(hollow, inside, low, high), 2.0 * low)


def _meeting(hollow: Hollow, inside: tuple[int, ...], passes: float, stuck: float) -> tuple[float, float, float]:
    """Return where the air outside and inside meet when both grow through what a ball just passes."""
    from scipy.ndimage import binary_dilation

    way = hollow.clearance_m >= passes
    parts = hollow.reached(stuck)
    one: Any = parts == parts[0, 0, 0]
    other: Any = parts == parts[inside] if parts[inside] else np.zeros_like(one)
    other[inside] = True
    while not (one & other).any():
        grown = binary_dilation(one, mask=way), binary_dilation(other, mask=way)
        if (grown[0] == one).all() and (grown[1] == other).all():
            break
        one, other = grown
    place = _places(hollow)[one & other]
    x, y, z = place.mean(axis=0) if len(place) else _places(hollow)[inside]
    return float(x), float(y), float(z)

"""Mirror planes of an outer surface."""

from __future__ import annotations

from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from tdacoustic.housing.step_file.openings import samples
from tdacoustic.housing.step_file.solid import Planes
from tdacoustic.housing.step_file.triangles import Skin

__all__ = ["mirror_planes"]

SAME_M: Final = 1e-3
"""How far the mirrored surface may be off itself, besides what its triangles are off the faces [assumed]: a tenth of a
wall, far below a panel."""

_SAMPLES_M: Final = 0.03


def mirror_planes(skin: Skin, error_m: float) -> Planes:
    """Return the planes, normal to x, y or z through the middle, that a surface is symmetric to.

    Parameters
    ----------
    skin : Skin
    error_m : float
        How far its triangles are off the true surface.
    """
    low, high = skin.points_m.min(axis=0), skin.points_m.max(axis=0)
    points = np.concatenate([skin.points_m, samples(skin, _SAMPLES_M)])
    fine = Skin(*_cut_small(skin, _SAMPLES_M))
    names: tuple[Literal["x", "y", "z"], ...] = ("x", "y", "z")
    found: list[tuple[Literal["x", "y", "z"], float]] = []
    for axis, name in enumerate(names):
        middle = 0.5 * float(low[axis] + high[axis])
        mirrored = points.copy()
        mirrored[:, axis] = 2.0 * middle - mirrored[:, axis]
        if fine.closest(mirrored)[0].max() <= SAME_M + 2.0 * error_m:
            found.append((name, round(middle, 7)))
    return tuple(found)


def _cut_small(skin: Skin, edge_m: float) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the triangles cut into equal ones of an edge at most, without merging their corners."""
    corners = skin.corners_m
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    pieces = np.maximum(np.ceil(longest / edge_m).astype(int), 1)
    found = []
    for count in np.unique(pieces):
        shares = []
        for i in range(count):
            for j in range(count - i):
                shares.append([(i, j), (i + 1, j), (i, j + 1)])
                if i + j < count - 1:
                    shares.append([(i + 1, j), (i + 1, j + 1), (i, j + 1)])
        of_two = np.array(shares) / count
        three = np.concatenate([1.0 - of_two.sum(axis=2, keepdims=True), of_two], axis=2)
        found.append(np.einsum("tck,mkd->mtcd", three, corners[pieces == count]).reshape(-1, 3, 3))
    every = np.concatenate(found)
    return every.reshape(-1, 3), np.arange(3 * len(every)).reshape(-1, 3)

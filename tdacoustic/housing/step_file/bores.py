"""Bores along the shafts, found on the grid of a solid's surface: round holes in round faces that turn inwards."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.housing.step_file.surface_grid import SurfaceGrid

__all__ = ["Bore", "Step", "bores_of"]

Real = NDArray[np.float64]

_ROUND: Final = 2e-3
"""How far points of a cylinder may be off it, in parts of its radius: its grid's points lie on it."""

_COAXIAL: Final = 1e-4
"""Distance of axes, in metres, up to which cylinders are one bore's."""

_LEAST_RADIUS_M: Final = 0.01
"""Smaller holes are screws' and no bearing's [assumed]."""

_TOUCHING_M: Final = 5e-3
"""Gap along the axis that a chamfer or groove between two cylinders of one bore may make [assumed]."""


@dataclass(frozen=True)
class Step:
    """One cylinder of a bore.

    Parameters
    ----------
    radius_m, from_y_m, to_y_m : float
        Ascending.
    """

    radius_m: float
    from_y_m: float
    to_y_m: float


@dataclass(frozen=True)
class Bore:
    """A round hole along y.

    Parameters
    ----------
    centre_m : (float, float)
        x and z of its axis.
    steps : tuple of Step
        Along y.
    """

    centre_m: tuple[float, float]
    steps: tuple[Step, ...]

    @property
    def radius_m(self) -> float:
        """Of the longest of its cylinders."""
        return max(self.steps, key=lambda step: step.to_y_m - step.from_y_m).radius_m

    @property
    def from_y_m(self) -> float:
        """Lower end."""
        return min(step.from_y_m for step in self.steps)

    @property
    def to_y_m(self) -> float:
        """Upper end."""
        return max(step.to_y_m for step in self.steps)

    @property
    def words(self) -> str:
        """Where it is and how large."""
        x, z = (round(place, 6) + 0.0 for place in self.centre_m)
        return f"x = {x:g}, z = {z:g} m with a radius of {self.radius_m:.3g} m"


def bores_of(grid: SurfaceGrid) -> tuple[Bore, ...]:
    """Return the bores of a solid, of full circles, by y and then by axis.

    Parameters
    ----------
    grid : SurfaceGrid
        Of the whole solid.
    """
    found: list[tuple[tuple[float, float], float, float, float, float]] = []
    cylinders: list[tuple[Real, float, Real, Real]] = []
    for face in np.unique(grid.faces):
        cylinder = _cylinder(grid, int(face))
        if cylinder is not None:
            cylinders.append(cylinder)
    for group in _grouped(cylinders):
        angles = np.concatenate([_angles(points, centre) for centre, _, points, _ in group])
        turns = np.sort(np.mod(angles, 2.0 * math.pi))
        gaps = np.diff(np.append(turns, turns[0] + 2.0 * math.pi))
        if gaps.max() < 1.8:  # a full circle in at least four edges
            centre = np.mean([c for c, _, _, _ in group], axis=0)
            ys = np.concatenate([points[:, 1] for _, _, points, _ in group])
            found.append(
                ((float(centre[0]), float(centre[1])), float(group[0][1]), float(ys.min()), float(ys.max()), 0.0)
            )
    bores: list[Bore] = []
    for centre, radius, low, high, _ in sorted(found, key=lambda f: f[2]):
        step = Step(radius, low, high)
        for number, bore in enumerate(bores):
            if math.dist(bore.centre_m, centre) < _COAXIAL and low - bore.to_y_m < _TOUCHING_M:
                bores[number] = Bore(bore.centre_m, (*bore.steps, step))
                break
        else:
            bores.append(Bore(centre, (step,)))
    return tuple(bores)


def _grouped(cylinders: Sequence[tuple[Real, float, Real, Real]]) -> list[list[tuple[Real, float, Real, Real]]]:
    """Return cylinders' faces by axis, radius and overlap along it: a full cylinder may be of several faces."""
    groups: list[list[tuple[Real, float, Real, Real]]] = []
    for cylinder in cylinders:
        for group in groups:
            centre, radius, points, _ = group[0]
            overlap = min(points[:, 1].max(), cylinder[2][:, 1].max()) - max(
                points[:, 1].min(), cylinder[2][:, 1].min()
            )
            same = np.linalg.norm(centre - cylinder[0]) < _COAXIAL and abs(radius - cylinder[1]) < _COAXIAL
            if same and overlap > 0.0:
                group.append(cylinder)
                break
        else:
            groups.append([cylinder])
    return groups


def _angles(points: Real, centre: Real) -> Real:
    return np.asarray(np.arctan2(points[:, 2] - centre[1], points[:, 0] - centre[0]))


def _cylinder(grid: SurfaceGrid, face: int) -> tuple[Real, float, Real, Real] | None:
    """Return axis (x, z), radius, points and normals of a face that is a hole's wall along y; None of any other."""
    cells = grid.cells[grid.faces == face]
    points = grid.points_m[np.unique(cells[cells >= 0])]
    if len(points) < 6 or np.ptp(points[:, 1]) < 1e-3:
        return None
    flat = points[:, [0, 2]]
    middle = flat.mean(axis=0)
    known = np.column_stack([2.0 * (flat - middle), np.ones(len(flat))])
    solution, _, rank, _ = np.linalg.lstsq(known, ((flat - middle) ** 2).sum(axis=1), rcond=1e-9)
    squared = solution[2] + (solution[:2] ** 2).sum()
    if rank < 3 or not squared > _LEAST_RADIUS_M**2:
        return None
    centre, radius = middle + solution[:2], math.sqrt(squared)
    if np.abs(np.linalg.norm(flat - centre, axis=1) - radius).max() > _ROUND * radius:
        return None
    corners = grid.points_m[cells[:, :3]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    arms = corners.mean(axis=1)[:, [0, 2]] - centre
    if ((normals[:, [0, 2]] * arms).sum(axis=1) >= 0.0).any():  # the material's outward normal points to the axis
        return None
    return centre, radius, points, normals

"""Closed surfaces of flat panels, and their mirror planes."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import RadiationError

__all__ = ["Axis", "Mirrors", "Surface"]

Axis = Literal["x", "y", "z"]
Point = tuple[float, float, float]
Real = NDArray[np.float64]

_FLATNESS = 0.1
"""How far a quadrilateral's corners may be off its mean plane, in parts of the root of its area. Boxes are flat; the
panels of a sphere are off by a quarter of their side over the radius, which costs less than the polyhedron itself."""

_SAME_POINT = 1e-7
"""Corners nearer than this, in parts of the surface's size, are one corner."""


@dataclass(frozen=True)
class Mirrors:
    """Mirror planes through a point, and the group of reflections they make.

    Parameters
    ----------
    planes : tuple of {"x", "y", "z"}
        Each the axis that its plane is normal to; () of a body without symmetry.
    centre_m : (float, float, float)
        On all of the planes.

    Examples
    --------
    >>> Mirrors(("x",), (1.0, 0.0, 0.0)).reflected([[3.0, 5.0, 7.0]]).tolist()
    [[[3.0, 5.0, 7.0]], [[-1.0, 5.0, 7.0]]]
    """

    planes: tuple[Axis, ...] = ()
    centre_m: Point = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if len(set(self.planes)) != len(self.planes) or not set(self.planes) <= set("xyz"):
            raise RadiationError(f"mirror planes must be different ones of x, y, z, got {self.planes!r}")
        if not np.isfinite(self.centre_m).all():
            raise RadiationError(f"the centre of the mirror planes must be finite, got {self.centre_m!r} m")

    @property
    def count(self) -> int:
        """Reflections of the group, the identity with them: 2 to the number of planes."""
        return 2 ** len(self.planes)

    @cached_property
    def signs(self) -> Real:
        """What each reflection does to the directions x, y, z: (reflections, 3) of ±1, the identity first."""
        signs = np.ones((self.count, 3))
        for number, flips in enumerate(itertools.product((1.0, -1.0), repeat=len(self.planes))):
            for axis, flip in zip(self.planes, flips, strict=True):
                signs[number, "xyz".index(axis)] = flip
        return signs

    @cached_property
    def parities(self) -> Real:
        """How a field of each parity changes under each reflection: (parities, reflections) of ±1.

        A parity is symmetric or antisymmetric to each plane; the first is symmetric to all.
        """
        odd = np.array(list(itertools.product((0, 1), repeat=len(self.planes))), dtype=np.int64).reshape(self.count, -1)
        return np.asarray((-1.0) ** (odd @ odd.T))

    def summed(self, fields: NDArray[Any]) -> NDArray[Any]:
        """Return `parities` times fields: (parities, ...) of (reflections, ...), and the other way round.

        Twice is the number of reflections times the same. One sum and one difference a plane, as the matrix is made.
        """
        shape = fields.shape
        for plane in range(len(self.planes)):
            halves = fields.reshape(2**plane, 2, -1)
            fields = np.stack((halves[:, 0] + halves[:, 1], halves[:, 0] - halves[:, 1]), axis=1)
        return fields.reshape(shape)

    def reflected(self, points_m: Real) -> Real:
        """Return each reflection of points (n, 3): (reflections, n, 3)."""
        centre = np.asarray(self.centre_m)
        return np.asarray(centre + self.signs[:, None, :] * (np.asarray(points_m, dtype=np.float64) - centre))


@dataclass(frozen=True, eq=False)
class Surface:
    """A closed surface of flat panels, seen from outside.

    With mirror planes only the part on their positive side is given, and the rest is its reflections. Fields on the
    surface are always of all panels: the given part first, then its reflections in the order of `Mirrors.signs`.

    Parameters
    ----------
    vertices_m : array_like
        (vertices, 3).
    panels : array_like of int
        (panels, 4): the corners' indices, counter-clockwise seen from outside. A triangle repeats its last corner or
        ends with -1.
    mirrors : Mirrors
        The planes that the whole grid is symmetric to.

    Raises
    ------
    RadiationError
        A panel is degenerate or not flat; the surface is not closed, its panels are turned against each other, or it is
        inside out; a part crosses its mirror plane.

    Examples
    --------
    A cube of 2 m from one eighth of it:

    >>> octant = Surface(
    ...     [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
    ...     [[0, 1, 2, 3], [1, 4, 5, 2], [3, 2, 5, 6]],
    ...     Mirrors(("x", "y", "z")),
    ... )
    >>> octant.n_panels, float(octant.areas_m2.sum()), float(octant.volume_m3)
    (24, 24.0, 8.0)
    """

    vertices_m: Real
    panels: NDArray[np.int64]
    mirrors: Mirrors = Mirrors()

    def __post_init__(self) -> None:
        vertices = np.array(self.vertices_m, dtype=np.float64)
        panels = np.array(self.panels, dtype=np.int64)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or not np.isfinite(vertices).all():
            raise RadiationError(f"vertices must be finite and of shape (n, 3), got shape {vertices.shape}")
        if panels.ndim != 2 or panels.shape[1] != 4 or not len(panels):
            raise RadiationError(f"panels must be of shape (n, 4), n > 0, got {panels.shape}")
        panels[:, 3] = np.where(panels[:, 3] == -1, panels[:, 2], panels[:, 3])
        if panels.min() < 0 or panels.max() >= len(vertices):
            raise RadiationError(f"panels name vertices {panels.min()} to {panels.max()}, there are {len(vertices)}")
        vertices = self._on_the_planes(vertices, panels)
        for name, array in (("vertices_m", vertices), ("panels", panels)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        self._check_panels()
        self._check_closed()

    @property
    def n_panels(self) -> int:
        """Of the whole surface."""
        return len(self.panels) * self.mirrors.count

    @cached_property
    def corners_m(self) -> Real:
        """Of all panels, counter-clockwise from outside: (panels, 4, 3)."""
        part = self.vertices_m[self.panels]
        whole = self.mirrors.reflected(part.reshape(-1, 3)).reshape(-1, *part.shape)
        turned = self.mirrors.signs.prod(axis=1) < 0.0
        # reversed so that the last corner of a triangle stays the repeated one: c0 c2 c1 c1 of c0 c1 c2 c2
        triangle = (self.panels[:, 2] == self.panels[:, 3])[:, None]
        order = np.where(triangle, [0, 2, 1, 1], [0, 3, 2, 1])
        flipped = np.take_along_axis(whole, np.broadcast_to(order[None, :, :, None], whole.shape), axis=2)
        return _locked(np.where(turned[:, None, None, None], flipped, whole).reshape(-1, 4, 3))

    @cached_property
    def _area_vectors_m2(self) -> Real:
        corners = self.corners_m
        return np.asarray(0.5 * np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]))

    @cached_property
    def areas_m2(self) -> Real:
        """Of all panels: (panels,)."""
        return _locked(np.linalg.norm(self._area_vectors_m2, axis=1))

    @cached_property
    def normals(self) -> Real:
        """Unit vectors out of the body, of all panels: (panels, 3)."""
        return _locked(self._area_vectors_m2 / self.areas_m2[:, None])

    @cached_property
    def centres_m(self) -> Real:
        """Centres of gravity of all panels: (panels, 3)."""
        weights, triangles = self._weighted_triangles
        return _locked(np.einsum("pt,ptci->pi", weights, triangles) / 3.0)

    @cached_property
    def _weighted_triangles(self) -> tuple[Real, Real]:
        """Each panel cut along both diagonals: parts of its area (panels, 4), and corners (panels, 4, 3, 3).

        Both, so that the centre of a panel that is not quite flat does not hang on which corner is named first.
        """
        corners = self.corners_m
        triangles = np.stack([corners[:, cut] for cut in ([0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3])], axis=1)
        vectors = 0.25 * np.cross(triangles[:, :, 1] - triangles[:, :, 0], triangles[:, :, 2] - triangles[:, :, 0])
        weights = np.einsum("pti,pi->pt", vectors, self.normals) / self.areas_m2[:, None]
        return weights, triangles

    @property
    def triangles_m(self) -> Real:
        """Each panel as two triangles, the second empty where it is one: (panels, 2, 3, 3)."""
        return _locked(self._weighted_triangles[1][:, :2])

    @cached_property
    def diameters_m(self) -> Real:
        """Longest diagonal or side of each panel: (panels,)."""
        pairs = self.corners_m[:, :, None, :] - self.corners_m[:, None, :, :]
        return _locked(np.linalg.norm(pairs, axis=-1).max(axis=(1, 2)))

    @cached_property
    def longest_side_m(self) -> float:
        """Of any panel."""
        return float(np.linalg.norm(self.corners_m - np.roll(self.corners_m, 1, axis=1), axis=-1).max())

    @cached_property
    def volume_m3(self) -> float:
        """Inside the surface."""
        return float((self.centres_m * self._area_vectors_m2).sum() / 3.0)

    def _on_the_planes(self, vertices: Real, panels: NDArray[np.int64]) -> Real:
        """Return the vertices with those on a mirror plane, but for rounding, exactly on it."""
        tolerance = _SAME_POINT * float(np.ptp(vertices[np.unique(panels)], axis=0).max())
        for plane in self.mirrors.planes:
            axis, at = "xyz".index(plane), self.mirrors.centre_m["xyz".index(plane)]
            off = vertices[:, axis] - at
            beyond = np.flatnonzero((off[panels] < -tolerance).any(axis=1))
            if len(beyond):
                raise RadiationError(
                    f"with the mirror plane {plane} = {at:g} m only the panels beyond it are to be given, "
                    f"panel {beyond[0]} reaches to {plane} = {vertices[panels[beyond[0]], axis].min():g} m"
                )
            vertices[np.abs(off) <= tolerance, axis] = at
        return vertices

    def _check_panels(self) -> None:
        corners, n = self.corners_m, len(self.panels)
        small = np.flatnonzero(self.areas_m2[:n] <= 1e-6 * self.diameters_m[:n] ** 2)
        if len(small):
            raise RadiationError(
                f"panel {small[0]} is degenerate: area {self.areas_m2[small[0]]:.3g} m², {_at(corners[small[0]])}"
            )
        weights, _ = self._weighted_triangles
        bent = np.flatnonzero((weights[:n] < -1e-9).any(axis=1))
        if len(bent):
            raise RadiationError(
                f"panel {bent[0]} is not convex, or its corners are not in order, {_at(corners[bent[0]])}"
            )
        off = np.abs(np.einsum("pci,pi->pc", corners - corners.mean(axis=1)[:, None], self.normals)).max(axis=1)
        warped = np.flatnonzero(off[:n] > _FLATNESS * np.sqrt(self.areas_m2[:n]))
        if len(warped):
            raise RadiationError(
                f"panel {warped[0]} is not flat: off by {off[warped[0]]:.3g} m, {_at(corners[warped[0]])}"
            )

    def _check_closed(self) -> None:
        corners = self.corners_m
        low = corners.min(axis=(0, 1))
        grain = _SAME_POINT * float(np.ptp(corners, axis=(0, 1)).max())
        # half a grain off the reflections' own symmetric places, so that rounding does not part two equal corners
        cells = np.floor((corners.reshape(-1, 3) - low) / grain + 0.37).astype(np.int64)
        names = np.unique(cells, axis=0, return_inverse=True)[1].reshape(-1, 4)
        starts, ends = names.ravel(), np.roll(names, -1, axis=1).ravel()
        real = starts != ends
        count = int(names.max()) + 1
        forth, back = starts[real] * count + ends[real], ends[real] * count + starts[real]
        places = np.flatnonzero(real)
        alone = np.flatnonzero(~np.isin(forth, back))
        seen, times = np.unique(forth, return_counts=True)
        if (times > 1).any():
            panel = places[np.flatnonzero(forth == seen[times > 1][0])] // 4
            raise RadiationError(
                f"panels {panel[0]} and {panel[1]} are turned against each other, or a third one shares their edge, "
                f"{_at(corners[panel[0]])}"
            )
        if len(alone):
            panel = places[alone[0]] // 4
            raise RadiationError(
                f"the surface is not closed: {len(alone)} edges belong to one panel only, the first to panel {panel}, "
                f"{_at(corners[panel])}"
            )
        if not self.volume_m3 > 0.0:
            raise RadiationError(
                "the surface is inside out: the corners of its panels must run counter-clockwise seen from outside"
            )


def _locked(array: Real) -> Real:
    array = np.ascontiguousarray(array)
    array.flags.writeable = False
    return array


def _at(corners: Real) -> str:
    return "near ({:.4g}, {:.4g}, {:.4g}) m".format(*corners.mean(axis=0))

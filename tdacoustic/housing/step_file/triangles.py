"""Triangles in space: connected parts, edges, closest points, what is inside, and whether they cut each other."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Skin", "connected", "crossing", "free_edges"]

Real = NDArray[np.float64]
Whole = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Skin:
    """Triangles of a surface, counter-clockwise seen from outside.

    Parameters
    ----------
    points_m : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    """

    points_m: Real
    triangles: Whole

    @cached_property
    def corners_m(self) -> Real:
        """Shape (m, 3, 3)."""
        return self.points_m[self.triangles]

    @cached_property
    def vectors_m2(self) -> Real:
        """Areas times outward normals, shape (m, 3)."""
        a, b, c = self.corners_m.transpose(1, 0, 2)
        return np.asarray(0.5 * np.cross(b - a, c - a))

    @property
    def area_m2(self) -> float:
        """Of all triangles."""
        return float(np.linalg.norm(self.vectors_m2, axis=1).sum())

    @property
    def volume_m3(self) -> float:
        """Inside, of a closed surface; negative where it is seen from inside."""
        return float((self.corners_m.mean(axis=1) * self.vectors_m2).sum() / 3.0)

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import KDTree

        return KDTree(self.corners_m.mean(axis=1))

    @cached_property
    def _reach_m(self) -> float:
        """Largest distance of a corner from its triangle's middle."""
        return float(np.linalg.norm(self.corners_m - self.corners_m.mean(axis=1)[:, None], axis=2).max())

    def closest(self, points_m: Real, most: int = 24) -> tuple[Real, Whole, Real]:
        """Return distances, triangles and barycentric coordinates of the closest points.

        Among the `most` triangles whose middles are nearest: exact for grids whose triangles are of one size, else off
        by less than a triangle.
        """
        points = np.atleast_2d(np.asarray(points_m, dtype=np.float64))
        count = min(most, len(self.triangles))
        near = self._tree.query(points, count)[1].reshape(len(points), count)
        distance, chosen = np.full(len(points), np.inf), np.zeros(len(points), dtype=np.int64)
        shares = np.zeros((len(points), 3))
        for column in near.T:
            held = barycentric(points, self.corners_m[column])
            apart = np.linalg.norm(np.einsum("nc,ncd->nd", held, self.corners_m[column]) - points, axis=1)
            better = apart < distance
            distance[better], chosen[better], shares[better] = apart[better], column[better], held[better]
        return distance, chosen, shares

    def winding(self, points_m: Real) -> Real:
        """Return how often a closed surface winds around points: 1 inside, 0 outside (solid angles over 4π)."""
        points = np.atleast_2d(np.asarray(points_m, dtype=np.float64))
        found = np.empty(len(points))
        for number, point in enumerate(points):
            a, b, c = (self.corners_m - point).transpose(1, 0, 2)
            na, nb, nc = (np.linalg.norm(arm, axis=1) for arm in (a, b, c))
            triple = np.einsum("nd,nd->n", a, np.cross(b, c))
            below = na * nb * nc + (a * b).sum(1) * nc + (b * c).sum(1) * na + (c * a).sum(1) * nb
            found[number] = np.arctan2(triple, below).sum() / (2.0 * np.pi)
        return found

    def crossings(self, origin_m: Real, axis: int) -> Real:
        """Return where the line through a point along an axis meets the triangles, ascending."""
        flat = [(axis + 1) % 3, (axis + 2) % 3]
        a, b, c = self.corners_m.transpose(1, 0, 2)
        p = np.asarray(origin_m, dtype=np.float64)[flat]
        two = [_cross(u[:, flat] - p, v[:, flat] - p) for u, v in ((b, c), (c, a), (a, b))]
        whole = two[0] + two[1] + two[2]
        with np.errstate(divide="ignore", invalid="ignore"):
            shares = np.stack(two) / whole
        hit = (shares >= 0.0).all(axis=0) & (whole != 0.0)
        places = np.einsum("kn,kn->n", shares[:, hit], np.stack([a, b, c])[:, hit, axis])
        return np.sort(places)


def _cross(u: Real, v: Real) -> Real:
    return np.asarray(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])


def barycentric(points: Real, corners: Real) -> Real:
    """Return the barycentric coordinates of the points of triangles (n, 3, 3) closest to points (n, 3).

    C. Ericson, Real-Time Collision Detection (2005), section 5.1.5.
    """
    a, b, c = corners.transpose(1, 0, 2)
    ab, ac = b - a, c - a

    def dots(corner: Real) -> tuple[Real, Real]:
        arm = points - corner
        return (ab * arm).sum(1), (ac * arm).sum(1)

    (d1, d2), (d3, d4), (d5, d6) = dots(a), dots(b), dots(c)
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    tiny = np.finfo(float).tiny
    whole = va + vb + vc
    v, w = vb / np.where(whole == 0.0, tiny, whole), vc / np.where(whole == 0.0, tiny, whole)
    edge_bc = (d4 - d3) / np.maximum((d4 - d3) + (d5 - d6), tiny)
    edge_ac = d2 / np.where(d2 == d6, tiny, d2 - d6)
    edge_ab = d1 / np.where(d1 == d3, tiny, d1 - d3)
    cases = [
        (d1 <= 0.0) & (d2 <= 0.0),
        (d3 >= 0.0) & (d4 <= d3),
        (d6 >= 0.0) & (d5 <= d6),
        (vc <= 0.0) & (d1 >= 0.0) & (d3 <= 0.0),
        (vb <= 0.0) & (d2 >= 0.0) & (d6 <= 0.0),
        (va <= 0.0) & (d4 >= d3) & (d5 >= d6),
    ]
    zero, one = np.zeros(len(points)), np.ones(len(points))
    of_b = np.select(cases, [zero, one, zero, edge_ab, zero, 1.0 - edge_bc], v)
    of_c = np.select(cases, [zero, zero, one, zero, edge_ac, edge_bc], w)
    return np.column_stack([1.0 - of_b - of_c, of_b, of_c])


def connected(cells: Whole, count: int) -> Whole:
    """Return the number of the connected part that each cell belongs to; cells name points, -1 for none."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    rows = np.repeat(cells[:, 0], cells.shape[1])
    ends = np.where(cells < 0, cells[:, :1], cells).ravel()
    links = coo_array((np.ones(len(rows)), (rows, ends)), shape=(count, count))
    of_points = connected_components(links, directed=False)[1]
    return np.unique(of_points[cells[:, 0]], return_inverse=True)[1].astype(np.int64)


def free_edges(triangles: Whole) -> Whole:
    """Return the edges (n, 2) that do not belong to exactly two triangles."""
    every = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    edges, times = np.unique(every, axis=0, return_counts=True)
    return np.asarray(edges[times != 2])


def crossing(skin: Skin) -> Real | None:
    """Return a place where two triangles that share no corner cut each other; None where none do."""
    from scipy.spatial import KDTree

    corners = skin.corners_m
    middle = corners.mean(axis=1)
    reach = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
    tree = KDTree(middle)
    for some in np.array_split(np.arange(len(middle)), max(1, len(middle) // 2000)):
        lists = tree.query_ball_point(middle[some], reach[some] + reach.max())
        first = np.repeat(some, [len(found) for found in lists])
        second = np.concatenate([np.asarray(found, dtype=np.int64) for found in lists])
        kept = np.linalg.norm(middle[first] - middle[second], axis=1) < reach[first] + reach[second]
        kept &= ~(skin.triangles[first][:, :, None] == skin.triangles[second][:, None, :]).any(axis=(1, 2))
        first, second = first[kept], second[kept]
        for one, other in ((0, 1), (1, 2), (2, 0)):
            hit = _cut(corners[first, one], corners[first, other], corners[second])
            if hit.any():
                return np.asarray(middle[first[hit][0]])
    return None


def _cut(starts: Real, ends: Real, corners: Real) -> NDArray[np.bool_]:
    """Whether segments cut triangles, clearly (touching does not count)."""
    a, b, c = corners.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=1)
    slack = 1e-6 * np.sqrt(size) * size
    from_start, from_end = ((normal * (p - a)).sum(1) for p in (starts, ends))
    across = ((from_start > slack) & (from_end < -slack)) | ((from_start < -slack) & (from_end > slack))
    with np.errstate(divide="ignore", invalid="ignore"):
        part = from_start / (from_start - from_end)
    place = starts + np.where(across, part, 0.0)[:, None] * (ends - starts)
    shares = np.stack([(normal * np.cross(v - u, place - u)).sum(1) for u, v in ((a, b), (b, c), (c, a))])
    return np.asarray(across & (shares > 1e-6 * size**2).all(axis=0))

"""Panels for boundary elements from a grid on an outer surface: small ones collapsed, long ones cut, triangles paired.

Netgen's grid on the faces of a drawing has cells as small as its smallest faces; sound needs none smaller than a part
of its wavelength. Short edges are collapsed where that moves the surface by little, corners staying on the true surface
(half-edge collapse; the measure of M. Garland, P. S. Heckbert, SIGGRAPH 97: quadrics of the planes around a corner).
"""

from __future__ import annotations

import heapq
import itertools
import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

__all__ = ["panels_of"]

Real = NDArray[np.float64]
Whole = NDArray[np.int64]
Loop = tuple[int, ...]

SHORT: Final = 0.6
"""Edges below this part of a panel's size are collapsed where the surface allows it."""

MOVED: Final = 0.12
"""How far a collapse may move the surface, in parts of a panel's size: a twentieth of a wavelength at most."""

LONG: Final = 1.25
"""Edges above this are cut."""

_TURNED: Final = 0.3
"""Least cosine between a cell's normal before and after a collapse."""

_FLAT: Final = 0.08
"""How far corners of a quadrilateral may be off its mean plane, in parts of the root of its area."""

_SQUARE: Final = 0.6
"""Least sine at the corners of a pair of triangles that becomes one quadrilateral."""


class _Panels:
    """A grid of triangles and quadrilaterals that is changed step by step."""

    def __init__(self, points_m: Real, cells: Whole, size_m: float, planes: tuple[tuple[int, float], ...]) -> None:
        self.points = [np.array(point) for point in points_m]
        self.loops: dict[int, Loop] = {n: tuple(int(c) for c in row if c >= 0) for n, row in enumerate(cells)}
        self.around: dict[int, set[int]] = {}
        for number, loop in self.loops.items():
            for corner in loop:
                self.around.setdefault(corner, set()).add(number)
        self.size = size_m
        self.on = [
            frozenset(k for k, (axis, at) in enumerate(planes) if abs(point[axis] - at) < 1e-6 * size_m)
            for point in self.points
        ]
        self.quadrics = [np.zeros((4, 4)) for _ in self.points]
        self.weights = [0.0] * len(self.points)
        for loop in self.loops.values():
            self._weigh(loop)

    def _weigh(self, loop: Loop) -> None:
        vector = self.vector(loop)
        area = float(np.linalg.norm(vector))
        if area == 0.0:
            return
        normal = vector / area
        plane = np.append(normal, -normal @ np.mean([self.points[c] for c in loop], axis=0))
        for corner in loop:
            self.quadrics[corner] += area * np.outer(plane, plane)
            self.weights[corner] += area

    def vector(self, loop: Loop) -> Real:
        """Area times normal."""
        held = [self.points[corner] for corner in loop]
        if len(held) == 3:
            return np.asarray(0.5 * np.cross(held[1] - held[0], held[2] - held[0]))
        return np.asarray(0.5 * np.cross(held[2] - held[0], held[3] - held[1]))

    def length(self, one: int, other: int) -> float:
        return float(np.linalg.norm(self.points[one] - self.points[other]))

    def _longest(self, loop: Loop) -> float:
        return max(self.length(*pair) for pair in zip(loop, loop[1:] + loop[:1], strict=True))

    def edges(self) -> set[tuple[int, int]]:
        return {
            (min(pair), max(pair))
            for loop in self.loops.values()
            for pair in zip(loop, loop[1:] + loop[:1], strict=True)
        }

    def collapse_short(self) -> None:
        """Collapse short edges, the shortest first."""
        waiting = [(self.length(*edge), edge) for edge in self.edges()]
        heapq.heapify(waiting)
        while waiting:
            length, (one, other) = heapq.heappop(waiting)
            if length >= SHORT * self.size:
                return
            if one not in self.around or other not in self.around or not self.around[one] & self.around[other]:
                continue
            if abs(self.length(one, other) - length) > 1e-12:
                continue
            ways = [(self._moved(gone, kept), gone, kept) for gone, kept in ((one, other), (other, one))]
            for moved, gone, kept in sorted(ways):
                if moved <= MOVED * self.size and self._collapse(gone, kept):
                    for number in self.around[kept]:
                        for corner in self.loops[number]:
                            if corner != kept:
                                pair = (min(corner, kept), max(corner, kept))
                                heapq.heappush(waiting, (self.length(*pair), pair))
                    break

    def _moved(self, gone: int, kept: int) -> float:
        """How far the surface moves when a corner goes to another, about."""
        if not self.on[gone] <= self.on[kept]:
            return math.inf
        place = np.append(self.points[kept], 1.0)
        return math.sqrt(max(float(place @ self.quadrics[gone] @ place), 0.0) / self.weights[gone])

    def _collapse(self, gone: int, kept: int) -> bool:
        """Move a corner onto another, if the grid stays a surface whose cells are not turned over."""
        before = self.around[gone]
        fresh: dict[int, Loop | None] = {}
        for number in before:
            loop = self.loops[number]
            if kept in loop:
                left = tuple(corner for corner in loop if corner != gone)
                fresh[number] = left if len(left) >= 3 else None
            else:
                fresh[number] = tuple(kept if corner == gone else corner for corner in loop)
        for number, new in fresh.items():
            if new is None:
                continue
            old, turned = self.vector(self.loops[number]), self.vector(new)
            size = float(np.linalg.norm(old) * np.linalg.norm(turned))
            if size == 0.0 or float(old @ turned) < _TURNED * size or not self.is_fair(new):
                return False
            if self._longest(new) > max(LONG * self.size, self._longest(self.loops[number])):
                return False
        if not self._stays_a_surface(before | self.around[kept], fresh, kept):
            return False
        for number, new in fresh.items():
            for corner in self.loops[number]:
                self.around[corner].discard(number)
            if new is None:
                del self.loops[number]
                continue
            self.loops[number] = new
            for corner in new:
                self.around[corner].add(number)
        del self.around[gone]
        self.quadrics[kept] = self.quadrics[kept] + self.quadrics[gone]
        self.weights[kept] += self.weights[gone]
        return True

    def _stays_a_surface(self, numbers: set[int], fresh: dict[int, Loop | None], kept: int) -> bool:
        """Whether the cells around a corner would be one fan, open only along a plane of symmetry."""
        spokes: dict[int, list[int]] = {}
        seen = set()
        for number in numbers:
            loop = fresh.get(number, self.loops[number])
            if loop is None or kept not in loop:
                continue
            corners = frozenset(loop)
            if corners in seen:
                return False
            seen.add(corners)
            at = loop.index(kept)
            for side, corner in ((0, loop[(at + 1) % len(loop)]), (1, loop[at - 1])):
                spokes.setdefault(corner, []).append(side)
        if not seen:
            return False
        open_ends = 0
        for corner, sides in spokes.items():
            if len(sides) > 2 or (len(sides) == 2 and sides[0] == sides[1]):
                return False
            if len(sides) == 1:
                open_ends += 1
                if not self.on[corner] & self.on[kept]:
                    return False
        return open_ends in (0, 2) and len(spokes) == len(seen) + (1 if open_ends else 0)

    def is_fair(self, loop: Loop) -> bool:
        """Whether a cell is convex, flat and not a sliver."""
        held = np.array([self.points[corner] for corner in loop])
        vector = self.vector(loop)
        area = float(np.linalg.norm(vector))
        longest = max(float(np.linalg.norm(a - b)) for a, b in itertools.combinations(held, 2))
        if area < 0.02 * longest**2:
            return False
        if len(loop) == 3:
            return True
        normal = vector / area
        if np.abs((held - held.mean(axis=0)) @ normal).max() > _FLAT * math.sqrt(area):
            return False
        sides = np.roll(held, -1, axis=0) - held
        turns = np.cross(np.roll(sides, 1, axis=0), sides) @ normal
        return bool((turns > 0.1 * area).all())

    def cut_long(self) -> None:
        """Cut edges that are too long in two, the longest first."""
        waiting = [(-self.length(*edge), edge) for edge in self.edges() if self.length(*edge) > LONG * self.size]
        heapq.heapify(waiting)
        while waiting:
            _, (one, other) = heapq.heappop(waiting)
            owners = [
                number
                for number in self.around[one] & self.around[other]
                if abs(self.loops[number].index(one) - self.loops[number].index(other))
                in (1, len(self.loops[number]) - 1)
            ]
            if not owners:
                continue
            middle = len(self.points)
            self.points.append(0.5 * (self.points[one] + self.points[other]))
            self.on.append(self.on[one] & self.on[other])
            self.around[middle] = set()
            for number in owners:
                for pair in self._fanned(number, one, other, middle):
                    if self.length(*pair) > LONG * self.size:
                        heapq.heappush(waiting, (-self.length(*pair), pair))

    def _fanned(self, number: int, one: int, other: int, middle: int) -> list[tuple[int, int]]:
        """Replace a cell by triangles around the middle of one of its edges; return their edges."""
        loop = self.loops.pop(number)
        for corner in loop:
            self.around[corner].discard(number)
        at = loop.index(one)
        if loop[(at + 1) % len(loop)] != other:
            at = loop.index(other)
        rest = loop[at + 1 :] + loop[: at + 1]
        edges = []
        for a, b in itertools.pairwise(rest):
            self._add((a, b, middle))
            edges += [(min(a, b), max(a, b)), (min(a, middle), max(a, middle)), (min(b, middle), max(b, middle))]
        return edges

    def _add(self, loop: Loop) -> None:
        number = max(self.loops, default=-1) + 1 if not hasattr(self, "_next") else self._next
        self._next: int = number + 1
        self.loops[number] = loop
        for corner in loop:
            self.around[corner].add(number)

    def split_unfair(self) -> None:
        """Cut quadrilaterals that are bent or not convex along their shorter diagonal."""
        for number, loop in list(self.loops.items()):
            if len(loop) == 4 and not self.is_fair(loop):
                del self.loops[number]
                for corner in loop:
                    self.around[corner].discard(number)
                a, b, c, d = loop
                two = [(a, b, c), (a, c, d)], [(b, c, d), (b, d, a)]
                worst = [min(float(np.linalg.norm(self.vector(part))) for part in parts) for parts in two]
                for part in two[int(np.argmax(worst))]:
                    self._add(part)

    def pair(self) -> None:
        """Join pairs of triangles into quadrilaterals, the squarest first."""
        owners: dict[tuple[int, int], list[int]] = {}
        for number, loop in self.loops.items():
            if len(loop) == 3:
                for pair in zip(loop, loop[1:] + loop[:1], strict=True):
                    owners.setdefault((min(pair), max(pair)), []).append(number)
        found = []
        for (one, other), two in owners.items():
            if len(two) == 2:
                loop = self._joined(two[0], two[1], one, other)
                sines = self._sines(loop)
                if sines.min() > _SQUARE and self.is_fair(loop):
                    found.append((-float(sines.min()), two[0], two[1], loop))
        for _, one, other, loop in sorted(found):
            if one in self.loops and other in self.loops:
                for number in (one, other):
                    for corner in self.loops[number]:
                        self.around[corner].discard(number)
                    del self.loops[number]
                self._add(loop)

    def _joined(self, first: int, second: int, one: int, other: int) -> Loop:
        loop = self.loops[first]
        at = next(k for k in range(3) if loop[k] not in (one, other))
        far = next(corner for corner in self.loops[second] if corner not in (one, other))
        return loop[at], loop[(at + 1) % 3], far, loop[(at + 2) % 3]

    def _sines(self, loop: Loop) -> Real:
        held = np.array([self.points[corner] for corner in loop])
        sides = np.roll(held, -1, axis=0) - held
        sides /= np.linalg.norm(sides, axis=1)[:, None]
        vector = self.vector(loop)
        normal = vector / max(float(np.linalg.norm(vector)), 1e-300)
        return np.asarray(np.cross(np.roll(sides, 1, axis=0), sides) @ normal)

    def result(self) -> tuple[Real, Whole]:
        used = sorted({corner for loop in self.loops.values() for corner in loop})
        numbers = {corner: number for number, corner in enumerate(used)}
        cells = np.full((len(self.loops), 4), -1, dtype=np.int64)
        for row, loop in zip(cells, self.loops.values(), strict=True):
            row[: len(loop)] = [numbers[corner] for corner in loop]
        return np.array([self.points[corner] for corner in used]), cells


def panels_of(
    points_m: Real, cells: Whole, size_m: float, planes: tuple[tuple[int, float], ...] = ()
) -> tuple[Real, Whole]:
    """Return corners and panels of about a size.

    Parameters
    ----------
    points_m : ndarray, shape (n, 3)
    cells : ndarray of int, shape (m, 4)
        Triangles (-1 in the last column) and quadrilaterals of a surface that is closed, or closed by its reflections.
    size_m : float
        Of a panel's sides; none of them is longer than `LONG` times it.
    planes : tuple of (int, float)
        Axis and place of the planes of symmetry that the surface ends at.

    Returns
    -------
    points_m : ndarray, shape (k, 3)
    panels : ndarray of int, shape (l, 4)
    """
    grid = _Panels(points_m, cells, size_m, planes)
    grid.split_unfair()
    grid.collapse_short()
    grid.cut_long()
    grid.pair()
    return grid.result()

"""Fields on the flat panels of the box: nodes of triangles of high order, and values anywhere between them.

The outward displacement of prism elements on a triangle of the surface is a polynomial of their order, so its values at
the triangle's Lagrange nodes keep it without loss.
"""

from __future__ import annotations

import dataclasses
import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.housing.box import HousingError
from tdacoustic.housing.solid_grid import PANELS

__all__ = ["PanelNodes", "lagrange_at", "lattice", "panel_nodes", "read_only"]

Real = NDArray[np.float64]
Whole = NDArray[np.int64]

_SAME_POINT_M = 1e-7


def read_only(owner: Any) -> None:
    """Make the arrays of a frozen dataclass read-only: copies of those that were not."""
    for field in dataclasses.fields(owner):
        value = getattr(owner, field.name)
        if isinstance(value, np.ndarray) and value.flags.writeable:
            kept = value.copy()
            kept.flags.writeable = False
            object.__setattr__(owner, field.name, kept)


def lattice(order: int) -> Whole:
    """Return the Lagrange nodes of a triangle in steps of 1/order of its three coordinates, shape (nodes, 3)."""
    every = itertools.product(range(order + 1), repeat=2)
    return np.array([(order - i - j, i, j) for i, j in every if i + j <= order], dtype=np.int64)


@dataclass(frozen=True)
class PanelNodes:
    """Triangles of high order on the panels of the box.

    Parameters
    ----------
    order : int
    points_m : ndarray, shape (nodes, 3)
        Where values are kept. Nodes on an edge of the box stand once for each panel.
    panels : ndarray of int, shape (nodes,)
        Their panels' numbers in `PANELS`.
    triangles : ndarray of int, shape (triangles, (order + 1)(order + 2) / 2)
        Their nodes, in the order of `lattice`.
    """

    order: int
    points_m: Real
    panels: Whole
    triangles: Whole

    def __post_init__(self) -> None:
        read_only(self)

    @cached_property
    def normals(self) -> Real:
        """Outward normals at the nodes, shape (nodes, 3)."""
        axes = np.array([np.eye(3)["xyz".index(axis)] * sign for axis, sign in PANELS])
        return np.asarray(axes[self.panels])

    def weights(self, points_m: ArrayLike, normals: ArrayLike) -> tuple[Whole, Real]:
        """Return nodes and weights whose sum of products with values is the field at points.

        Parameters
        ----------
        points_m, normals : array_like, shape (n, 3)
            On the outer surface; the outward normals tell the panel.

        Returns
        -------
        nodes : ndarray of int, shape (n, m)
        weights : ndarray, shape (n, m)

        Raises
        ------
        HousingError
            A point off the surface, or a normal along none of x, y, z.
        """
        points = np.asarray(points_m, dtype=np.float64).reshape(-1, 3)
        given = np.asarray(normals, dtype=np.float64).reshape(-1, 3)
        nodes = np.zeros((len(points), self.triangles.shape[1]), dtype=np.int64)
        weights = np.zeros(nodes.shape)
        done = np.zeros(len(points), dtype=bool)
        for number, (axis, sign) in enumerate(PANELS):
            normal = "xyz".index(axis)
            here = np.nonzero(given[:, normal] * sign > 1.0 - 1e-6)[0]
            if here.size:
                nodes[here], weights[here] = self._on_panel(points[here], number)
                done[here] = True
        if not done.all():
            raise HousingError(f"a normal must be along x, y or z, got {given[~done][0]}")
        return nodes, weights

    def _on_panel(self, points: Real, number: int) -> tuple[Whole, Real]:
        """Return nodes and weights of points on one panel."""
        normal = "xyz".index(PANELS[number][0])
        flat = [axis for axis in range(3) if axis != normal]
        triangles = self.triangles[self.panels[self.triangles[:, 0]] == number]
        corners = self.points_m[triangles[:, self._corners]]
        place = corners[0, 0, normal]
        scale = np.abs(self.points_m).max()
        off = np.abs(points[:, normal] - place) > 1e-6 * scale
        inside = np.linalg.inv(np.concatenate([corners[:, :, flat], np.ones((len(corners), 3, 1))], axis=2))
        within = np.empty((len(points), 3))
        chosen = np.empty(len(points), dtype=np.int64)
        for block in np.array_split(np.arange(len(points)), max(1, len(points) // 1000)):
            known = np.column_stack([points[block][:, flat], np.ones(len(block))])
            shares = np.einsum("pc,tcv->ptv", known, inside)
            chosen[block] = shares.min(axis=2).argmax(axis=1)
            within[block] = shares[np.arange(len(block)), chosen[block]]
        off |= within.min(axis=1) < -1e-4
        if off.any():
            axis, sign = PANELS[number]
            raise HousingError(
                f"the point {points[off][0]} m with its normal along {'-' if sign < 0 else '+'}{axis} is not on that "
                f"panel of the housing, at {axis} = {place:g} m"
            )
        return triangles[chosen], lagrange_at(within, self.order)

    @property
    def _corners(self) -> list[int]:
        """Places of the three corners among a triangle's nodes."""
        nodes = lattice(self.order).tolist()
        return [nodes.index([self.order * (corner == k) for k in range(3)]) for corner in range(3)]


def lagrange_at(shares: Real, order: int) -> Real:
    """Return the Lagrange polynomials of a triangle at barycentric coordinates, shape (points, nodes)."""
    factors = np.ones((*shares.shape, order + 1))
    for degree in range(1, order + 1):
        factors[..., degree] = factors[..., degree - 1] * (order * shares - (degree - 1)) / degree
    nodes = lattice(order)
    return np.asarray(np.prod([factors[:, corner, nodes[:, corner]] for corner in range(3)], axis=0))


def panel_nodes(corners_m: Real, panels: Whole, order: int) -> PanelNodes:
    """Return the nodes of triangles, those that neighbours on a panel share merged.

    Parameters
    ----------
    corners_m : ndarray, shape (triangles, 3, 3)
    panels : ndarray of int, shape (triangles,)
    order : int
    """
    points = np.einsum("nk,tkd->tnd", lattice(order) / order, corners_m)
    of_panel = np.repeat(panels, points.shape[1])
    keys = np.column_stack([of_panel, np.round(points.reshape(-1, 3) / _SAME_POINT_M).astype(np.int64)])
    _, kept, merged = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return PanelNodes(
        order, points.reshape(-1, 3)[kept], of_panel[kept], merged.reshape(points.shape[:2]).astype(np.int64)
    )

"""Values between the nodes of the surface: pure arithmetic."""

import numpy as np
import pytest

from tdacoustic.housing import HousingError
from tdacoustic.housing.surface import lattice, panel_nodes

CORNERS_M = np.array(
    [[[0.0, 0.3, 0.0], [0.0, 0.3, 1.0], [2.0, 0.3, 0.0]], [[2.0, 0.3, 0.0], [0.0, 0.3, 1.0], [2.0, 0.3, 1.0]]]
)
"""Two triangles on the panel with the normal +y."""


def surface(order):
    return panel_nodes(CORNERS_M, np.array([0, 0]), order)


@pytest.mark.parametrize("order", [1, 2, 3, 4, 5])
def test_polynomials_of_the_order_are_kept(order):
    nodes = surface(order)
    assert len(nodes.points_m) == (order + 1) ** 2  # those of the common edge once
    assert nodes.triangles.shape == (2, len(lattice(order)))
    rng = np.random.default_rng(order)
    points = np.column_stack([rng.uniform(0.0, 2.0, 50), np.full(50, 0.3), rng.uniform(0.0, 1.0, 50)])

    def polynomial(at):
        return (1.0 + at[:, 0] - 0.7 * at[:, 2]) ** order

    places, weights = nodes.weights(points, np.tile([0.0, 1.0, 0.0], (50, 1)))
    found = (polynomial(nodes.points_m)[places] * weights).sum(axis=1)
    assert found == pytest.approx(polynomial(points), rel=1e-10)
    assert nodes.normals == pytest.approx(np.tile([0.0, 1.0, 0.0], (len(nodes.points_m), 1)))


def test_points_off_the_surface_are_refused():
    nodes = surface(2)
    with pytest.raises(HousingError, match=r"normal along \+y is not on that panel of the housing, at y = 0.3 m"):
        nodes.weights([[1.0, 0.29, 0.5]], [[0.0, 1.0, 0.0]])
    with pytest.raises(HousingError, match="is not on that panel"):
        nodes.weights([[1.0, 0.3, 1.1]], [[0.0, 1.0, 0.0]])
    with pytest.raises(HousingError, match="a normal must be along x, y or z"):
        nodes.weights([[1.0, 0.3, 0.5]], [[0.0, 0.8, 0.6]])

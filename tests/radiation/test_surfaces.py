"""Surfaces and their grids; the rule of points on a sphere."""

import math
import re

import numpy as np
import pytest

from tdacoustic.errors import RadiationError
from tdacoustic.radiation.grids import box_surface, sphere_surface
from tdacoustic.radiation.sphere_rules import SphereRule
from tdacoustic.radiation.surfaces import Mirrors, Surface

CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
SIDES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])


def test_a_cube():
    cube = Surface(CUBE, SIDES)
    assert cube.volume_m3 == pytest.approx(1.0)
    assert cube.areas_m2 == pytest.approx(np.ones(6))
    assert cube.normals == pytest.approx((cube.centres_m - 0.5) * 2.0)
    assert not cube.vertices_m.flags.writeable
    assert not cube.centres_m.flags.writeable


def test_the_centre_is_that_of_gravity():
    # a trapezium's and a triangle's
    tent = Surface(
        [[0, 0, 0], [4, 0, 0], [4, 2, 0], [0, 2, 0], [1, 1, 1], [3, 1, 1]],
        [[3, 2, 1, 0], [0, 1, 5, 4], [2, 3, 4, 5], [1, 2, 5, -1], [3, 0, 4, -1]],
    )
    assert tent.centres_m[1] == pytest.approx([2.0, 4.0 / 9.0, 4.0 / 9.0])
    assert tent.centres_m[3] == pytest.approx([11.0 / 3.0, 1.0, 1.0 / 3.0])
    # a prism below the ridge, and at each end a pyramid on a base of 1 x 2
    assert tent.volume_m3 == pytest.approx(1.0 * 2.0 + 2.0 * 2.0 / 3.0)


@pytest.mark.parametrize("planes", [(), ("y",), ("z", "x"), ("x", "y", "z")])
@pytest.mark.parametrize("edge_panel", [1.0, 0.4])
def test_boxes_are_the_same_box_with_any_mirror_planes(planes, edge_panel):
    box = box_surface((0.45, 1.0, 0.9), 0.1, planes, (1.0, 2.0, 3.0), edge_panel)
    whole = box_surface((0.45, 1.0, 0.9), 0.1, (), (1.0, 2.0, 3.0), edge_panel)
    assert box.n_panels == whole.n_panels == len(box.panels) * 2 ** len(planes)
    assert box.areas_m2.sum() == pytest.approx(2.0 * (0.45 + 0.9 * 0.45 + 0.9))
    assert box.volume_m3 == pytest.approx(0.405)
    assert box.longest_side_m <= 0.1 + 1e-12
    sort = [np.lexsort(np.round(surface.centres_m, 9).T) for surface in (box, whole)]
    assert box.centres_m[sort[0]] == pytest.approx(whole.centres_m[sort[1]])
    assert box.normals[sort[0]] == pytest.approx(whole.normals[sort[1]])


def test_panels_at_a_graded_box_s_edges_are_smaller():
    box = box_surface((1.0, 1.0, 1.0), 0.1, edge_panel=0.3)
    sides = np.sqrt(box.areas_m2)
    assert sides.max() / sides.min() == pytest.approx(1.0 / 0.3, rel=0.25)


@pytest.mark.parametrize("planes", [(), ("x", "y", "z")])
def test_the_sphere_has_the_volume_of_the_sphere(planes):
    sphere = sphere_surface(0.5, 6, planes, (0.0, 1.0, 0.0))
    assert sphere.n_panels == 6 * 36
    assert sphere.volume_m3 == pytest.approx(4.0 / 3.0 * math.pi * 0.125)


@pytest.mark.parametrize(
    ("vertices", "panels", "why"),
    [
        (CUBE, SIDES[:5], "not closed: 4 edges belong to one panel only"),
        (CUBE, SIDES[:, ::-1], "inside out"),
        (CUBE, np.concatenate((SIDES[:5], SIDES[5:, ::-1])), "turned against each other"),
        (CUBE, np.concatenate((SIDES, [[0, 1, 1, -1]])), "panel 6 is degenerate: area 0"),
        (CUBE, np.concatenate((SIDES[:5], [[1, 5, 3, 7]])), "degenerate|not convex"),
        (CUBE + np.eye(8)[7][:, None] * [0.5, 0.0, 0.0], SIDES, "is not flat: off by"),
        (CUBE, SIDES + 1, "panels name vertices 1 to 8, there are 8"),
        (CUBE[:, :2], SIDES, "vertices must be finite and of shape (n, 3)"),
        (CUBE, SIDES[:, :3], "panels must be of shape (n, 4)"),
    ],
)
def test_surfaces_that_are_none(vertices, panels, why):
    with pytest.raises(RadiationError, match=why if "|" in why else re.escape(why)):
        Surface(vertices, panels)


def test_a_part_that_crosses_its_mirror_plane():
    with pytest.raises(RadiationError, match=re.escape("with the mirror plane x = 0.5 m only the panels beyond it")):
        Surface(CUBE, SIDES, Mirrors(("x",), (0.5, 0.0, 0.0)))
    with pytest.raises(RadiationError, match="must be different ones of x, y, z"):
        Mirrors(("x", "x"))


def test_grids_that_cannot_be_made():
    for size, largest, edge, why in (
        ((1.0, 0.0, 1.0), 0.1, 1.0, "three numbers > 0"),
        ((1.0, 1.0, 1.0), -0.1, 1.0, "largest_panel_m must be > 0"),
        ((1.0, 1.0, 1.0), 0.1, 2.0, "edge_panel must be"),
    ):
        with pytest.raises(RadiationError, match=why):
            box_surface(size, largest, edge_panel=edge)
    with pytest.raises(RadiationError, match="even and > 0, got 7"):
        sphere_surface(1.0, 7)


def test_the_rule_is_exact_to_its_degree(conformance):
    rule = SphereRule(2.0, 9, (1.0, 0.0, -1.0))
    x, y, z = ((rule.points_m - [1.0, 0.0, -1.0]) / 2.0).T
    means = {
        "z^8": (z**8, 1 / 9),
        "x^8": (x**8, 1 / 9),
        "x²y²z⁴": (x**2 * y**2 * z**4, 1 / 315),
        "xy²": (x * y**2, 0.0),
    }
    for name, (found, expected) in means.items():
        source = "analytic: moments of the unit sphere"
        conformance(f"mean of {name} over a sphere", expected, rule.weights @ found, 1e-12, "1", source)
    assert rule.area_m2 == pytest.approx(16.0 * math.pi)
    assert rule.sound_power_w(np.full(len(x), 2.0), 400.0) == pytest.approx(4.0 * 16.0 * math.pi / 400.0)


def test_the_rule_over_ground_is_a_part_of_the_sphere():
    rule = SphereRule(2.0, 9, (0.0, 0.0, 0.5), ground_m=0.0)
    assert rule.points_m[:, 2].min() > 0.0
    assert rule.area_m2 == pytest.approx(2.0 * math.pi * 2.0 * 2.5)
    # the mean height of a sphere's zone is in its middle
    assert rule.weights @ rule.points_m[:, 2] == pytest.approx(1.25)
    with pytest.raises(RadiationError, match="does not meet the ground"):
        SphereRule(2.0, 9, (0.0, 0.0, 5.0), ground_m=0.0)
    with pytest.raises(RadiationError, match="a pressure for each of the 50 points, got 3"):
        SphereRule(2.0, 9, (0.0, 0.0, 0.5)).mean_square(np.ones(3))
    with pytest.raises(RadiationError, match="degree"):
        SphereRule(2.0, 0)

"""What STEP housings are made with: triangles, panels, texts of files, and processes of their own. No NGSolve."""

import itertools
import math
import os
import time

import numpy as np
import pytest

from tdacoustic.housing import HousingError
from tdacoustic.housing.step_file.isolation import run_apart
from tdacoustic.housing.step_file.openings import openings_of
from tdacoustic.housing.step_file.panelling import panels_of
from tdacoustic.housing.step_file.symmetry import mirror_planes
from tdacoustic.housing.step_file.text import check_text
from tdacoustic.housing.step_file.triangles import Skin, crossing, free_edges
from tdacoustic.radiation.grids import box_surface, sphere_surface
from tdacoustic.radiation.surfaces import Mirrors, Surface


def skin_of(surface):
    """A surface of the boundary elements in triangles with merged corners."""
    panels = surface.corners_m.reshape(-1, 3)
    points, names = np.unique(np.round(panels, 9), axis=0, return_inverse=True)
    cells = names.reshape(-1, 4)
    return Skin(points, np.concatenate([cells[:, :3], cells[:, [0, 2, 3]]]))


@pytest.fixture(scope="module")
def ball():
    return skin_of(sphere_surface(0.5, 16))


def test_distances_from_a_sphere(ball):
    """A point at the distance R from the middle is |R - 0.5| off, but for what the polyhedron is off the sphere."""
    points = np.random.default_rng(3).normal(size=(200, 3))
    far = np.linalg.norm(points, axis=1)
    found = ball.closest(points, 60)[0]
    assert found == pytest.approx(np.abs(far - 0.5), abs=5e-3)
    assert ball.winding(points) == pytest.approx((far < 0.495).astype(float), abs=0.03)


def test_closest_points_of_a_triangle_are_no_farther_than_any_other():
    rng = np.random.default_rng(4)
    skin = Skin(rng.normal(size=(3, 3)), np.array([[0, 1, 2]]))
    points = rng.normal(size=(300, 3)) * 2.0
    distance, _, shares = skin.closest(points)
    assert shares.min() >= -1e-12
    assert shares.sum(axis=1) == pytest.approx(1.0)
    others = rng.dirichlet(np.ones(3), size=5000) @ skin.points_m
    least = np.linalg.norm(points[:, None] - others[None], axis=2).min(axis=1)
    assert (distance <= least + 1e-12).all()
    assert distance == pytest.approx(least, abs=0.05)


def test_lines_through_a_box_meet_its_walls(conformance):
    skin = skin_of(box_surface((0.4, 0.6, 0.8), 0.1))
    assert skin.crossings(np.array([0.013, 9.0, 0.021]), 1) == pytest.approx([-0.3, 0.3])
    assert skin.crossings(np.array([0.3, 0.0, 0.0]), 1).size == 0
    conformance("volume of a box by its skin", 0.192, skin.volume_m3, 1e-9, "m³", "analytic: 0.4 x 0.6 x 0.8 m")
    conformance("area of a box by its skin", 2.08, skin.area_m2, 1e-9, "m²", "analytic: 0.4 x 0.6 x 0.8 m")


def test_two_surfaces_that_cut_each_other_are_found(ball):
    shifted = Skin(
        np.concatenate([ball.points_m, ball.points_m + np.array([0.4, 0.05, 0.03])]),
        np.concatenate([ball.triangles, ball.triangles + len(ball.points_m)]),
    )
    place = crossing(shifted)
    assert place is not None
    assert np.linalg.norm(place) == pytest.approx(0.5, abs=0.05)
    assert crossing(ball) is None
    inside = Skin(np.concatenate([ball.points_m, 0.9 * ball.points_m]), shifted.triangles)
    assert crossing(inside) is None


@pytest.mark.parametrize(
    ("extent", "planes"),
    [((0.4, 0.6, 0.8), ("x", "y", "z")), ((0.4, 0.4, 0.4), ("x", "y", "z"))],
)
def test_mirror_planes_of_a_box(extent, planes):
    surface = box_surface(extent, 0.1, centre_m=(0.1, 0.2, 0.3))
    assert mirror_planes(skin_of(surface), 0.0) == tuple(zip(planes, (0.1, 0.2, 0.3), strict=True))


@pytest.mark.parametrize(("dent_m", "planes"), [(0.0005, ("x", "y", "z")), (0.004, ("y", "z"))])
def test_a_dent_takes_a_mirror_plane_away_once_it_is_deep_enough(dent_m, planes):
    skin = skin_of(box_surface((0.4, 0.6, 0.8), 0.05))
    dented = skin.points_m.copy()
    middle = np.argmin(np.linalg.norm(dented - [0.2, 0.0, 0.0], axis=1))
    dented[middle, 0] -= dent_m
    assert tuple(axis for axis, _ in mirror_planes(Skin(dented, skin.triangles), 0.0)) == planes


def hollow(hole_m):
    """A box of 0.4 x 0.5 x 0.6 m with walls of 20 mm, a square hole in the middle of its top, as one surface."""
    size, wall = np.array([0.4, 0.5, 0.6]), 0.02
    ticks = [np.unique([-s / 2, -s / 2 + wall, -hole_m / 2, hole_m / 2, s / 2 - wall, s / 2]) for s in size]
    middles = [0.5 * (t[1:] + t[:-1]) for t in ticks]
    full = {}
    for at in itertools.product(*(range(len(m)) for m in middles)):
        place = np.array([m[i] for m, i in zip(middles, at, strict=True)])
        air = (np.abs(place) < size / 2 - wall).all() or ((np.abs(place[:2]) < hole_m / 2).all() and place[2] > 0.0)
        full[at] = not air
    corners = []
    for at, material in full.items():
        for axis, side in itertools.product(range(3), (1, -1)):
            beside = tuple(n + side * (k == axis) for k, n in enumerate(at))
            if material and not full.get(beside, False):
                first, second = (axis + 1) % 3, (axis + 2) % 3
                square = np.empty((4, 3))
                square[:, axis] = ticks[axis][at[axis] + (side > 0)]
                square[:, first] = ticks[first][[at[first], at[first] + 1, at[first] + 1, at[first]]]
                square[:, second] = ticks[second][[at[second], at[second], at[second] + 1, at[second] + 1]]
                corners.append(square[::side])
    points, names = np.unique(np.round(np.concatenate(corners), 9), axis=0, return_inverse=True)
    cells = names.reshape(-1, 4)
    return Skin(points, np.concatenate([cells[:, :3], cells[:, [0, 2, 3]]]))


@pytest.mark.parametrize("hole_m", [0.06, 0.12])
def test_an_opening_is_found_with_its_place_and_width(hole_m):
    openings, is_hollow = openings_of(hollow(hole_m))
    assert is_hollow
    assert len(openings) == 1
    assert openings[0].place_m == pytest.approx((0.0, 0.0, 0.29), abs=0.02)
    assert openings[0].width_m == pytest.approx(hole_m, rel=0.3)  # a lattice of 12 mm


def test_a_block_is_not_hollow():
    assert openings_of(skin_of(box_surface((0.3, 0.4, 0.5), 0.1))) == ((), False)


def fine_box(pieces):
    """A box of 0.3 m with squares as narrow as 3 mm along its edges."""
    ticks = np.unique(np.concatenate([np.linspace(-0.15, 0.15, pieces + 1), [-0.147, -0.144, 0.144, 0.147]]))
    corners = []
    for axis, side in itertools.product(range(3), (1, -1)):
        first, second = (axis + 1) % 3, (axis + 2) % 3
        for i, j in itertools.product(range(len(ticks) - 1), repeat=2):
            square = np.empty((4, 3))
            square[:, axis] = 0.15 * side
            square[:, first], square[:, second] = ticks[[i, i + 1, i + 1, i]], ticks[[j, j, j + 1, j + 1]]
            corners.append(square[::side])
    points, names = np.unique(np.round(np.concatenate(corners), 9), axis=0, return_inverse=True)
    return points, names.reshape(-1, 4)


def test_panels_are_of_the_size_asked_for_and_the_body_stays():
    points, cells = fine_box(8)
    found = Surface(*panels_of(points, cells, 0.05))
    assert len(cells) > 800
    assert found.n_panels < 6 * 2.2 * (0.3 / 0.05) ** 2
    assert found.longest_side_m <= 1.25 * 0.05 + 1e-12
    assert found.volume_m3 == pytest.approx(0.3**3, rel=1e-3)  # a corner may lose 3 mm
    assert found.areas_m2.sum() == pytest.approx(6 * 0.3**2, rel=3e-3)


def test_panels_of_a_part_end_at_the_mirror_planes():
    points, cells = fine_box(8)
    kept = (points[cells].mean(axis=1)[:, :2] > 0.0).all(axis=1)
    used, names = np.unique(cells[kept], return_inverse=True)
    part = panels_of(points[used], names.reshape(-1, 4), 0.04, ((0, 0.0), (1, 0.0)))
    found = Surface(*part, Mirrors(("x", "y")))
    assert found.volume_m3 == pytest.approx(0.3**3, rel=1e-3)  # a corner may lose 3 mm


def test_panels_of_a_ball_stay_on_it():
    fine = sphere_surface(0.5, 32, ())
    points, names = np.unique(np.round(fine.corners_m.reshape(-1, 3), 9), axis=0, return_inverse=True)
    found = Surface(*panels_of(points, names.reshape(-1, 4), 0.1))
    assert found.n_panels < 0.75 * fine.n_panels
    assert found.volume_m3 == pytest.approx(fine.volume_m3, rel=0.03)
    assert np.linalg.norm(found.centres_m, axis=1).min() > 0.48


def test_free_edges():
    assert len(free_edges(np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]))) == 0
    assert free_edges(np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1]])).tolist() == [[1, 2], [1, 3], [2, 3]]


STEP = b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n%sENDSEC;\nEND-ISO-10303-21;\n"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is no STEP file: it is empty"),
        (b"solid cube\nfacet normal 0 0 1", "is no STEP file: it begins with 'solid cube"),
        (b"PK\x03\x04rest", "is compressed"),
        (b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n#1 = CART", "cut off: its end mark .* '#1 = CART'"),
        (STEP % b"#1 = MANIFOLD_SOLID_BREP('bolt M8',#2);\n" * 21, "21 solid parts .bolt M8, ....*, 20 at most"),
    ],
)
def test_texts_that_are_refused(content, words):
    with pytest.raises(HousingError, match=words):
        check_text(content)


def test_a_text_that_is_taken():
    check_text(b"\xef\xbb\xbf" + STEP % b"#1 = BREP_WITH_VOIDS('house',#2,(#3));\n")


def test_a_process_of_its_own_returns_a_result():
    assert run_apart("math:hypot", (3.0, 4.0), "adding", 60.0, 2**33) == 5.0


@pytest.mark.parametrize(
    ("function", "arguments", "words"),
    [
        ("os:abort", (), r"crashed while reading it \(exit status"),
        ("time:sleep", (60,), "took more than 1 s and was ended"),
        ("math:sqrt", (-1.0,), "failed with .*math domain error|failed with .*nonnegative"),
    ],
)
def test_whatever_happens_in_it_is_answered(function, arguments, words):
    start = time.monotonic()
    with pytest.raises(HousingError, match=words):
        run_apart(function, arguments, "reading it", 1.0 if function == "time:sleep" else 60.0, 2**33)
    assert time.monotonic() - start < 30.0


@pytest.mark.skipif(os.name == "nt", reason="Windows bounds no memory here")
def test_its_memory_is_bounded():
    with pytest.raises(HousingError, match="more than 2 GB of memory"):
        run_apart("builtins:bytearray", (3 * 10**9,), "reading it", 60.0, 2 * 10**9)


def test_its_errors_are_ours():
    with pytest.raises(HousingError, match="it is empty"):
        run_apart("tdacoustic.housing.step_file.text:check_text", (b"",), "reading it", 60.0, 2**33)


def test_angles_of_a_sphere_of_panels_are_fair():
    """No panel is a sliver: the least height of any is a fair part of its longest side."""
    fine = sphere_surface(0.5, 24, ())
    points, names = np.unique(np.round(fine.corners_m.reshape(-1, 3), 9), axis=0, return_inverse=True)
    found = Surface(*panels_of(points, names.reshape(-1, 4), 0.12))
    assert (found.areas_m2 / found.diameters_m**2).min() > 0.02
    assert math.isclose(found.n_panels, len(found.panels))

"""Pressures close to a box: sources inside it, a rigid wall, and boundary elements' own receivers."""

import numpy as np
import pytest

from tdacoustic.radiation.boundary_elements import ExteriorProblem
from tdacoustic.radiation.box_in_air import BoxInAir
from tdacoustic.radiation.field_maps import NEAREST_M, beyond_walls_m, off_the_walls, pressures_outside

IMPEDANCE, SOUND_SPEED = 413.0, 343.2
SIZE = (1.0, 0.45, 0.9)
MIDDLE = (0.0, -0.35, 0.0)
INSIDE = np.array([[0.2, -0.4, 0.25], [-0.3, -0.3, -0.2]])
STRENGTHS = np.array([1.0, 0.7j])
SOURCES = ((0.0, -0.35, 0.55), (0.0, 0.45, 0.0))


@pytest.fixture(scope="module")
def body():
    return BoxInAir(SIZE, MIDDLE, SOUND_SPEED, IMPEDANCE, sources_m=SOURCES)


def field_of(points, wave):
    """Pressure and its gradient of point sources inside the box: exact outside of any shape around them."""
    arms = points[:, None] - INSIDE
    distance = np.linalg.norm(arms, axis=-1)
    parts = STRENGTHS * np.exp(-1j * wave * distance) / distance
    return parts.sum(axis=1), np.einsum("ns,nsi->ni", -parts * (1j * wave + 1.0 / distance) / distance, arms)


def velocities(surface, wave):
    """Mean outward velocity of each panel."""
    ends, shares = np.polynomial.legendre.leggauss(3)
    corners, found = surface.corners_m, 0.0
    first, second = corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]
    for u, of_u in zip(ends, shares, strict=True):
        for v, of_v in zip(ends, shares, strict=True):
            places = corners[:, 0] + 0.5 * (1.0 + u) * first + 0.5 * (1.0 + v) * second
            found = found + 0.25 * of_u * of_v * (field_of(places, wave)[1] * surface.normals).sum(axis=1)
    return (-found / (1j * wave * IMPEDANCE))[:, None]


def points_off(distance_m, count=60):
    """Points at a distance from each of the six walls, at random places on it."""
    scatter, found = np.random.default_rng(3), []
    for axis in range(3):
        for side in (-1.0, 1.0):
            points = (scatter.random((count, 3)) - 0.5) * SIZE
            points[:, axis] = side * (0.5 * SIZE[axis] + distance_m)
            found.append(points + MIDDLE)
    return np.concatenate(found)


@pytest.mark.parametrize("frequency_hz", [525.0, 1000.0, 1500.0])
@pytest.mark.parametrize(("distance_m", "most"), [(0.002, 0.075), (0.01, 0.05), (0.05, 0.04), (0.3, 0.03)])
def test_sources_inside_up_to_the_walls(body, conformance, frequency_hz, distance_m, most):
    surface = body.surface(max(frequency_hz, 1000.0))
    wave, points = body.wave_number_rad_m(frequency_hz), points_off(distance_m)
    found = pressures_outside(body, surface, frequency_hz, points, velocities(surface, wave))[:, 0]
    exact = field_of(points, wave)[0]
    error = np.linalg.norm(found - exact) / np.linalg.norm(exact)
    name = f"sources in a box, {frequency_hz:.0f} Hz, {1e3 * distance_m:.0f} mm off its walls: L2 error"
    near = "near the walls the grid of panels is felt; a map shows differences of 1 dB, which are 12 %"
    conformance(name, 0.0, 100.0 * error, 100.0 * most, "%", "analytic: point sources in free space", near)


def test_a_point_source_before_a_wide_rigid_wall_has_its_image(conformance):
    wide = BoxInAir((0.6, 6.0, 6.0), (-0.3, 0.0, 0.0), SOUND_SPEED, IMPEDANCE, sources_m=((0.3, 0.0, 0.0),))
    frequency, wave = 300.0, wide.wave_number_rad_m(300.0)
    line = np.linspace(0.0, 0.6, 25)
    points = np.stack((line, np.full(25, 0.07), np.zeros(25)), axis=1)
    surface = wide.surface(300.0)
    found = pressures_outside(wide, surface, frequency, points, np.zeros((surface.n_panels, 0)), (0,))[:, 0]
    moved = off_the_walls(wide, points)
    exact = sum(
        np.exp(-1j * wave * distance) / distance
        for distance in (np.linalg.norm(moved - [side * 0.3, 0.0, 0.0], axis=1) for side in (1.0, -1.0))
    )
    worst = np.abs(20.0 * np.log10(np.abs(found / exact))).max()
    # the edges of the wall, 3 m off, send back a hundredth: 0.6 dB of a wall of 4 m, 0.16 dB of 6 m
    conformance(
        "source 0.3 m before a rigid wall: level along the normal",
        0.0,
        worst,
        0.25,
        "dB",
        "analytic: image source of a rigid wall",
    )


def test_away_from_the_walls_it_is_what_boundary_elements_give(body):
    surface, frequency = body.surface(1000.0), 700.0
    points = points_off(0.2, 5)
    problem = ExteriorProblem(surface, body.wave_number_rad_m(frequency), IMPEDANCE)
    moving = np.cos(7.0 * surface.centres_m @ [[1.0, 0.5], [0.3, -1.0], [0.2, 0.4]]).astype(complex)
    found = pressures_outside(body, surface, frequency, points, moving, (1, 0))
    assert found[:, :2] == pytest.approx(problem.transfer(points, moving), rel=1e-3, abs=1e-3)
    assert found[:, 2:] == pytest.approx(problem.scattered([SOURCES[1], SOURCES[0]], points), rel=1e-3, abs=1e-4)


def test_over_ground_it_is_what_boundary_elements_give():
    body = BoxInAir(SIZE, MIDDLE, SOUND_SPEED, IMPEDANCE, -0.5256, SOURCES)
    surface = body.surface(1000.0)
    points = points_off(0.2, 5)
    points = points[points[:, 2] > -0.52]
    problem = ExteriorProblem(surface, body.wave_number_rad_m(700.0), IMPEDANCE, body.ground_m)
    moving = np.cos(7.0 * surface.centres_m @ [[1.0], [0.3], [0.2]]).astype(complex)
    found = pressures_outside(body, surface, 700.0, points, moving, (0, 1))
    assert found[:, :1] == pytest.approx(problem.transfer(points, moving), rel=1e-3, abs=1e-3)
    assert found[:, 1:] == pytest.approx(problem.scattered(SOURCES, points), rel=1e-3, abs=1e-4)


def test_points_on_the_walls_are_moved_off_them(body):
    points = np.array([[0.1, -0.125, 0.2], [0.5, -0.125, 0.0], [0.0, -0.5755, 0.0], [0.0, 0.4, 0.1]])
    moved = off_the_walls(body, points)
    assert beyond_walls_m(body, moved)[:3] == pytest.approx(NEAREST_M)
    assert moved[0] == pytest.approx([0.1, -0.125 + NEAREST_M, 0.2])
    assert moved[2, 1] == pytest.approx(-0.575 - NEAREST_M)
    assert moved[3].tolist() == points[3].tolist()
    assert beyond_walls_m(body, np.array([[0.0, -0.35, 0.0]]))[0] == pytest.approx(-0.225)


def test_at_a_source_there_is_no_level(body):
    surface = body.surface(1000.0)
    found = pressures_outside(body, surface, 300.0, np.array([SOURCES[1]]), np.zeros((surface.n_panels, 0)), (1,))
    assert found.shape == (1, 1)
    assert not np.isfinite(found).any()

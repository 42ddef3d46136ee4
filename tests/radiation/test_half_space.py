"""Boundary elements over rigid ground against image sources, at the height and size of the reference housing."""

import math

import numpy as np
import pytest

from tdacoustic.radiation.boundary_elements import ExteriorProblem
from tdacoustic.radiation.box_in_air import BoxInAir
from tdacoustic.radiation.grids import box_surface, sphere_surface
from tdacoustic.radiation.multipoles import Multipoles
from tdacoustic.radiation.sphere_rules import SphereRule
from tdacoustic.radiation.surfaces import Mirrors, Surface

IMPEDANCE, SOUND_SPEED = 413.0, 343.2
SIZE, MIDDLE, GROUND = (1.0, 0.45, 0.9), (0.0, -0.35, 0.0), -0.52556  # 75 mm of air below the housing


@pytest.mark.parametrize("wave_number", [0.5, 3.0, 9.0])
def test_a_small_body_that_breathes_is_a_source_and_its_image(conformance, wave_number):
    radius, centre = 0.04, np.array([0.2, -0.3, 0.5])
    problem = ExteriorProblem(sphere_surface(radius, 10, ("x", "y"), tuple(centre)), wave_number, IMPEDANCE, 0.0)
    points = np.array([[4.0, 0.0, 0.0], [3.0, 2.0, 1.0], [-1.0, 4.0, 3.0], [0.5, 0.2, 5.0], [-2.0, -2.0, 0.3]])
    found = problem.transfer(points, np.ones((problem.surface.n_panels, 1)))[:, 0]
    turn = 1j * wave_number * radius
    flow = turn * IMPEDANCE * radius * np.exp(turn) / (1.0 + turn)
    exact = np.zeros(len(points), dtype=complex)
    for place in (centre, centre * [1.0, 1.0, -1.0]):
        distance = np.linalg.norm(points - place, axis=1)
        exact += flow * np.exp(-1j * wave_number * distance) / distance
    error = np.linalg.norm(found - exact) / np.linalg.norm(exact)
    # the flat panels 1 %, and what the sphere scatters of its own image
    name = f"breathing sphere over ground, k = {wave_number:g} rad/m: L2 error"
    conformance(name, 0.0, 100.0 * error, 2.0, "%", "analytic: breathing sphere and its image")


def test_the_housing_over_ground_is_two_bodies_with_a_mirror_plane_between():
    """The same body and its image as one grid with the ground as its third mirror plane: fields even in it."""
    over = box_surface(SIZE, 0.075, ("x", "y"), MIDDLE)
    both = Surface(over.vertices_m, over.panels, Mirrors(("x", "y", "z"), (MIDDLE[0], MIDDLE[1], GROUND)))
    wave_number = 2.0 * math.pi * 525.0 / SOUND_SPEED

    def moving(surface):
        x, y, z = surface.centres_m.T
        return (np.cos(5.0 * x + 1.0) * np.cos(4.0 * y) * np.cos(6.0 * np.abs(z - GROUND)))[:, None]

    points = np.array([[4.0, 0.0, 0.1], [0.0, 3.0, 2.0], [0.7, -0.35, -0.4], [0.0, 0.4, 0.0]])
    ground = ExteriorProblem(over, wave_number, IMPEDANCE, GROUND, precision="double")
    free = ExteriorProblem(both, wave_number, IMPEDANCE, precision="double")
    expected = free.transfer(points, moving(both))
    for way in ("direct", "adjoint"):
        assert ground.transfer(points, moving(over), way) == pytest.approx(expected, rel=1e-9)
    source = np.array([[0.0, 0.45, 0.1]])
    twice = np.concatenate((source, source * [1.0, 1.0, -1.0] + [0.0, 0.0, 2.0 * GROUND]))
    assert ground.scattered(source, points)[:, 0] == pytest.approx(free.scattered(twice, points).sum(axis=1), rel=1e-9)


@pytest.fixture(scope="module")
def breathing():
    """Mean squares at 4 m of the housing with all its walls moving out alike, in free space and over ground."""
    found = {}
    for frequency in (20.0, 40.0, 80.0):
        for ground in (None, GROUND):
            body = BoxInAir(SIZE, MIDDLE, SOUND_SPEED, IMPEDANCE, ground)
            surface = body.surface(1000.0)
            problem = ExteriorProblem(surface, body.wave_number_rad_m(frequency), IMPEDANCE, ground)
            velocity = np.ones((surface.n_panels, 1))
            waves = body.waves(frequency)
            assert isinstance(waves, Multipoles)
            carried = waves.of_surface(surface, problem.pressures(velocity), velocity, IMPEDANCE)[:, 0]
            rule = SphereRule(4.0, 24, body.centre_m, ground_m=ground)
            direct = rule.mean_square(problem.transfer(rule.points_m, velocity))[0]
            found[frequency, ground] = (direct, float(waves.mean_weights(4.0) @ np.abs(carried) ** 2))
    return found


@pytest.mark.parametrize("frequency", [20.0, 40.0, 80.0])
def test_the_power_of_a_breathing_housing_is_that_of_a_source_and_its_image(breathing, conformance, frequency):
    half, free = breathing[frequency, GROUND][1], breathing[frequency, None][1]
    path = 2.0 * 2.0 * math.pi * frequency / SOUND_SPEED * (MIDDLE[2] - GROUND)
    wanted = 10.0 * math.log10(1.0 + math.sin(path) / path)  # tends to +3 dB
    got = 10.0 * math.log10(half / (2.0 * free))  # half of the sphere for the same power is twice the mean square
    # at 80 Hz the path to the image is 0.24 wavelengths, and the walls are a fifth of one
    name = f"power of the breathing housing over ground against free space, {frequency:.0f} Hz"
    conformance(name, wanted, got, 0.12, "dB", "analytic: monopole and image: 1 + sin(2kh) / (2kh)")


def test_low_frequencies_gain_six_decibels_on_the_half_sphere(breathing):
    gain = [10.0 * math.log10(breathing[f, GROUND][1] / breathing[f, None][1]) for f in (80.0, 40.0, 20.0)]
    assert gain == sorted(gain)
    assert gain[-1] == pytest.approx(6.02, abs=0.12)  # 6.02 dB at 0 Hz, less 0.06 dB at 20 Hz


def test_multipoles_over_ground_carry_what_boundary_elements_give(breathing):
    for direct, carried in breathing.values():
        assert 10.0 * math.log10(direct / carried) == pytest.approx(0.0, abs=0.02)

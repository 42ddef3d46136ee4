"""Outgoing spherical waves of a body against boundary elements, and what follows for means and sources."""

import math

import numpy as np
import pytest
from scipy.special import sph_harm_y, spherical_jn

from tdacoustic.radiation.boundary_elements import ExteriorProblem
from tdacoustic.radiation.grids import box_surface, sphere_surface
from tdacoustic.radiation.multipole_kernels import real_harmonics
from tdacoustic.radiation.multipoles import Multipoles, degree_for
from tdacoustic.radiation.sphere_rules import SphereRule

IMPEDANCE = 413.0
WAVE = 12.0
CENTRE = (0.0, 0.1, -0.05)


@pytest.fixture(scope="module")
def box():
    surface = box_surface((0.5, 0.22, 0.4), 0.05, centre_m=CENTRE)
    return ExteriorProblem(surface, WAVE, IMPEDANCE)


@pytest.fixture(scope="module")
def waves(box):
    radius = float(np.linalg.norm(box.surface.corners_m, axis=-1).max())
    return Multipoles(WAVE, (0.0, 0.0, 0.0), radius, degree_for(WAVE, radius) + 4)


@pytest.fixture(scope="module")
def velocities(box):
    place, normal = box.surface.centres_m - np.asarray(CENTRE), box.surface.normals
    plate = (normal[:, 1] > 0.5) * np.sin(2 * math.pi * place[:, 0] / 0.5) * np.cos(math.pi * place[:, 2] / 0.4)
    return np.stack([plate, normal[:, 2] * 1.0, np.ones(len(normal))], axis=1)


def places_at(radius_m, count=40, seed=1):
    ways = np.random.default_rng(seed).normal(size=(count, 3))
    return radius_m * ways / np.linalg.norm(ways, axis=1)[:, None]


def test_real_harmonics_are_those_of_scipy(conformance):
    numbers = Multipoles(1.0, (0.0, 0.0, 0.0), 1.0, 40).numbers
    places = places_at(2.0, 6)
    polar, around = np.arccos(places[:, 2] / 2.0), np.arctan2(places[:, 1], places[:, 0])
    worst = 0.0
    for column, (n, m) in zip(real_harmonics(places, numbers).T, numbers, strict=True):
        whole = sph_harm_y(n, abs(m), polar, around) * (-1.0) ** m
        wanted = whole.real if m == 0 else math.sqrt(2.0) * (whole.real if m > 0 else whole.imag)
        worst = max(worst, float(np.abs(column - wanted).max()))
    conformance("real spherical harmonics to degree 40", 0.0, worst, 1e-12, "1", "program: scipy.special.sph_harm_y")


@pytest.mark.parametrize("radius_m", [0.6, 1.0, 4.0, 12.0])
def test_the_field_of_a_body_is_that_of_boundary_elements(box, waves, velocities, radius_m):
    places = places_at(radius_m)
    found = waves.of_surface(box.surface, box.pressures(velocities), velocities, IMPEDANCE)
    wanted = box.transfer(places, velocities)
    error = np.linalg.norm(waves.at(places) @ found - wanted, axis=0) / np.linalg.norm(wanted, axis=0)
    assert error.max() < 0.015  # the panels' integrals are of another order here


def test_a_breathing_sphere_is_one_wave():
    surface = sphere_surface(0.5, 28)
    problem = ExteriorProblem(surface, 6.0, IMPEDANCE)
    unit = np.ones((surface.n_panels, 1))
    waves = Multipoles(6.0, (0.0, 0.0, 0.0), 0.55, 12)
    found = waves.of_surface(surface, problem.pressures(unit), unit, IMPEDANCE)[:, 0]
    at_one = abs(IMPEDANCE * 1j * 3.0 / (1.0 + 1j * 3.0)) * 0.5
    assert abs(waves.at([[1.0, 0.0, 0.0]])[0] @ found) == pytest.approx(at_one, rel=0.015)
    assert np.abs(found[1:]).max() < 0.01 * abs(found[0])


def test_the_mean_over_a_sphere_is_that_of_its_points(box, waves, velocities):
    rule = SphereRule(4.0, 30)
    found = waves.of_surface(box.surface, box.pressures(velocities), velocities, IMPEDANCE)
    means = waves.mean_weights(4.0) @ np.abs(found) ** 2
    assert means == pytest.approx(rule.mean_square(waves.at(rule.points_m) @ found), rel=1e-5)


def test_power_is_the_same_through_every_sphere(box, waves, velocities, conformance):
    found = waves.of_surface(box.surface, box.pressures(velocities), velocities, IMPEDANCE)
    near, far = (radius**2 * (waves.mean_weights(radius) @ np.abs(found) ** 2) for radius in (4.0, 12.0))
    levels = 10.0 * np.log10(near / far)
    conformance(
        "power through 4 m over that through 12 m, worst of three",
        0.0,
        np.abs(levels).max(),
        0.02,
        "dB",
        "law: energy (no absorption); 1/(kR)^2 of the near field is left",
    )


def test_a_point_source_beside_the_box(box, waves):
    source = np.array([0.05, 0.5, 0.1])
    rule = SphereRule(4.0, 40)
    scattered = waves.of_surface(box.surface, box.blocked_pressures(source[None]), 0.0, IMPEDANCE)[:, 0]
    incident = waves.of_point_source(source)
    distance = np.linalg.norm(rule.points_m - source, axis=1)
    direct = np.exp(-1j * WAVE * distance) / distance
    wanted = box.scattered(source[None], rule.points_m)[:, 0]
    assert np.linalg.norm(waves.at(rule.points_m) @ scattered + direct - wanted) < 5e-3 * np.linalg.norm(wanted)
    mean = waves.mean_weights(4.0) @ np.abs(scattered + incident) ** 2 + waves.mean_of_source(source, 4.0)
    assert mean == pytest.approx(float(rule.mean_square(wanted)), rel=5e-3)


def test_what_the_waves_of_a_source_leave_out_is_added():
    source, few = (0.3, 1.1, 0.2), Multipoles(30.0, (0.0, 0.0, 0.0), 0.3, 12)
    mean = few.mean_weights(4.0) @ np.abs(few.of_point_source(source)) ** 2 + few.mean_of_source(source, 4.0)
    distance = math.hypot(*source)
    analytic = math.log((4.0 + distance) / (4.0 - distance)) / (2.0 * 4.0 * distance)
    assert mean == pytest.approx(analytic, rel=1e-9)


@pytest.mark.parametrize("source", [(0.0, 0.3, 0.4), (0.2, -0.1, 0.9)])
def test_over_ground_a_source_and_its_image(source):
    wave = 9.0
    waves = Multipoles(wave, (0.0, 0.0, -0.5), 1.0, 12, over_ground=True)
    rule = SphereRule(4.0, 60, (0.0, 0.0, -0.5), ground_m=-0.5)
    image = (source[0], source[1], -1.0 - source[2])
    pressure = 0.0
    for place in (source, image):
        distance = np.linalg.norm(rule.points_m - place, axis=1)
        pressure = pressure + np.exp(-1j * wave * distance) / distance
    mean = waves.mean_weights(4.0) @ np.abs(waves.of_point_source(source)) ** 2 + waves.mean_of_source(source, 4.0)
    assert mean == pytest.approx(float(rule.mean_square(pressure)), rel=1e-4)
    assert not (waves.numbers.sum(axis=1) % 2).any()


def test_over_ground_a_body_is_that_of_boundary_elements():
    surface = box_surface((0.5, 0.22, 0.4), 0.06, ("x", "y"), (0.0, 0.0, 0.3))
    problem = ExteriorProblem(surface, 8.0, IMPEDANCE, ground_m=0.0)
    velocity = np.stack([surface.normals[:, 0], (surface.normals[:, 1] > 0.5) * 1.0], axis=1)
    radius = float(np.linalg.norm(surface.corners_m, axis=-1).max())
    waves = Multipoles(8.0, (0.0, 0.0, 0.0), radius, degree_for(8.0, radius) + 3, over_ground=True)
    places = np.abs(places_at(3.0)) * [1.0, -1.0, 1.0]
    wanted = problem.transfer(places, velocity)
    found = waves.at(places) @ waves.of_surface(surface, problem.pressures(velocity), velocity, IMPEDANCE)
    assert np.linalg.norm(found - wanted) < 0.015 * np.linalg.norm(wanted)


def test_spherical_bessel_functions_at_high_degrees_and_small_arguments():
    from tdacoustic.radiation.multipole_kernels import panel_waves

    corners = np.array([[[-1e-3, -1e-3, 0.3], [1e-3, -1e-3, 0.3], [1e-3, 1e-3, 0.3], [-1e-3, 1e-3, 0.3]]])
    numbers = np.array([(n, 0) for n in range(31)])
    for wave in (0.5, 20.0, 70.0):
        mean, slope = panel_waves(corners, np.array([[0.0, 0.0, 1.0]]), wave, numbers, np.ones(31))
        on_axis = np.sqrt((2.0 * np.arange(31) + 1.0) / (4.0 * math.pi)) * 4e-6
        values = spherical_jn(np.arange(31), 0.3 * wave) * on_axis
        slopes = wave * spherical_jn(np.arange(31), 0.3 * wave, derivative=True) * on_axis
        assert mean[0] == pytest.approx(values, rel=3e-3, abs=1e-4 * np.abs(values).max())
        assert slope[0] == pytest.approx(slopes, rel=3e-3, abs=1e-3 * np.abs(slopes).max())

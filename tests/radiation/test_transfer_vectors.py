"""Transfer vectors of a small box over frequency: against boundary elements there and then, and what is refused."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from tdacoustic.errors import RadiationError
from tdacoustic.radiation.boundary_elements import ExteriorProblem
from tdacoustic.radiation.box_in_air import BoxInAir
from tdacoustic.radiation.interpolation import frequency_nodes, lagrange, spread_nodes
from tdacoustic.radiation.received import mean_vectors, point_vectors
from tdacoustic.radiation.sphere_rules import SphereRule
from tdacoustic.radiation.transfer_vectors import bands_of, frequencies_of, grid_hz_for, near_band, transfer_band

SPEED, IMPEDANCE = 343.0, 413.0
SOURCES = ((0.0, 0.05, 0.4), (0.1, 0.6, 0.0))
NEAR, FAR = (0.0, -0.25, 0.1), (0.9, 1.1, -0.4)
HIGHEST_HZ = 700.0


def body_of(**changes):
    settings = {"near_m": (NEAR,), "sources_m": SOURCES} | changes
    return BoxInAir((0.5, 0.2, 0.4), (0.0, 0.05, 0.0), SPEED, IMPEDANCE, **settings)


def shapes(surface):
    """Four made-up modes: plates and the whole box."""
    place, normal = surface.centres_m - [0.0, 0.05, 0.0], surface.normals
    left, top = normal[:, 1] > 0.5, normal[:, 2] > 0.5
    plate = left * np.cos(math.pi * place[:, 0] / 0.5) * np.cos(math.pi * place[:, 2] / 0.4)
    halves = left * np.sin(2.0 * math.pi * place[:, 0] / 0.5)
    return np.stack([plate, halves, top * 1.0, normal[:, 0] * 1.0], axis=1)


@pytest.fixture(scope="module")
def body():
    return body_of()


@pytest.fixture(scope="module")
def parts(body):
    return [transfer_band(body, band, shapes) for band in bands_of(body, HIGHEST_HZ)]


@pytest.fixture(scope="module")
def mean(body, parts):
    return mean_vectors(body, parts, 4.0)


@pytest.fixture(scope="module")
def points(body, parts):
    near = [near_band(body, band, shapes) for band in bands_of(body, HIGHEST_HZ)]
    return point_vectors(body, parts, (FAR, NEAR), near)


@pytest.mark.parametrize("frequency_hz", [23.0, 111.0, 333.0, 527.0, 693.0])
def test_levels_between_the_computed_frequencies(body, mean, points, frequency_hz):
    """0.1 dB: far panels enter boundary elements by one point each, the vectors by four."""
    surface = body.surface(1000.0)
    problem = ExteriorProblem(surface, body.wave_number_rad_m(frequency_hz), IMPEDANCE)
    rule = SphereRule(4.0, 24)
    q = np.array([1.0 + 0.5j, -2.0, 0.3j, 0.8])
    velocity = (shapes(surface) @ q)[:, None]
    there = rule.mean_square(problem.transfer(rule.points_m, velocity))[0]
    here = mean.of_modes(frequency_hz, q)
    assert abs(10.0 * math.log10(here / there)) <= 0.1
    direct = np.abs(problem.transfer([FAR, NEAR], velocity)[:, 0]) ** 2
    assert 10.0 * np.log10(points.of_modes(frequency_hz, q) / direct) == pytest.approx([0.0, 0.0], abs=0.2)
    rigid = problem.scattered(SOURCES, rule.points_m)
    for number in range(2):
        wanted = rule.mean_square(rigid[:, number])
        assert 10.0 * math.log10(mean.of_source(frequency_hz, number) / wanted) == pytest.approx(0.0, abs=0.03)
        wanted = np.abs(problem.scattered(SOURCES, [FAR, NEAR])[:, number]) ** 2
        got = points.of_source(body, frequency_hz, number)
        assert 10.0 * np.log10(got / wanted) == pytest.approx([0.0, 0.0], abs=0.1)


def test_reciprocity_of_the_vectors(body, points, conformance):
    """A source at a receiver and the box that vibrates: what either does to the other is the same."""
    frequency = float(points.frequency_hz[20])
    wave = body.wave_number_rad_m(frequency)
    surface = body.surface(1000.0)
    blocked = ExteriorProblem(surface, wave, IMPEDANCE).blocked_pressures([FAR])[:, 0]
    volume_flow = 4.0 * math.pi / (1j * wave * IMPEDANCE)
    for mode, shape in enumerate(shapes(surface).T):
        wanted = abs((surface.areas_m2 * shape) @ blocked / volume_flow) ** 2
        got = points.of_modes(frequency, np.eye(4)[mode])[0]
        name = f"reciprocity of transfer vector {mode + 1} at {frequency:.0f} Hz"
        conformance(
            name,
            0.0,
            10.0 * math.log10(got / wanted),
            0.25,
            "dB",
            "law: reciprocity with a point source's blocked field",
        )


def test_the_means_are_hermitian_and_positive(mean):
    assert np.abs(mean.modal - mean.modal.conj().transpose(0, 2, 1)).max() < 1e-5 * np.abs(mean.modal).max()
    assert (np.linalg.eigvalsh(mean.modal[10].astype(complex)) > -1e-5 * np.abs(mean.modal[10]).max()).all()


def test_power_through_4_m_is_that_through_12_m(body, parts, mean):
    far = mean_vectors(body, parts, 12.0)
    for frequency, mode in itertools.product((100.0, 400.0, 690.0), range(4)):
        q = np.eye(4)[mode]
        level = 10.0 * math.log10(16.0 * mean.of_modes(frequency, q) / (144.0 * far.of_modes(frequency, q)))
        assert abs(level) < (0.25 if frequency < 200.0 else 0.02)  # 1/(kR)² of the near field


def test_over_ground_against_boundary_elements():
    body = body_of(near_m=(), ground_m=-0.4)
    nodes = frequencies_of(body, 260.0)
    parts = [transfer_band(body, band, shapes) for band in bands_of(body, 260.0)]
    frequency = 0.5 * float(nodes[-6] + nodes[-5])
    surface = body.surface(1000.0)
    problem = ExteriorProblem(surface, body.wave_number_rad_m(frequency), IMPEDANCE, ground_m=-0.4)
    rule = SphereRule(4.0, 24, body.centre_m, ground_m=-0.4)
    q = np.array([1.0, 0.4j, 0.7, 0.2])
    wanted = rule.mean_square(problem.transfer(rule.points_m, (shapes(surface) @ q)[:, None]))[0]
    assert 10.0 * math.log10(mean_vectors(body, parts, 4.0).of_modes(frequency, q) / wanted) == pytest.approx(
        0, abs=0.1
    )
    got = point_vectors(body, parts, (FAR,)).of_source(body, frequency, 1)[0]
    wanted = abs(problem.scattered([SOURCES[1]], [FAR])[0, 0]) ** 2
    assert 10.0 * math.log10(got / wanted) == pytest.approx(0.0, abs=0.1)


def test_frequencies_and_grids(body):
    nodes = frequencies_of(body, 3000.0)
    assert nodes[0] == 20.0
    assert nodes[-1] == 3000.0
    assert (np.diff(nodes) > 0.0).all()
    bands = bands_of(body, 3000.0)
    assert [f for band in bands for f in band.frequency_hz] == nodes.tolist()
    panels = [body.surface(band.grid_hz).n_panels for band in bands]
    assert panels == sorted(panels)
    assert panels[0] < 0.2 * panels[-1]  # low frequencies are not paid for at the price of high ones
    for band in bands:
        assert band.grid_hz == grid_hz_for(band.frequency_hz[-1], 3000.0)
        assert band.grid_hz >= band.frequency_hz[-1]


def test_interpolation_is_exact_for_polynomials_and_close_for_waves():
    nodes = frequency_nodes(20.0, 1000.0, 60.0)
    for place in (20.0, 333.3, 985.0, 1000.0):
        some, weights = lagrange(nodes, place)
        assert weights @ (nodes[some] / 1000.0) ** 7 == pytest.approx((place / 1000.0) ** 7, rel=1e-9)
        assert abs(weights @ np.exp(1j * nodes[some] / 60.0) - np.exp(1j * place / 60.0)) < 2e-3
    assert len(spread_nodes(nodes)) == 2 * len(nodes) - 1
    with pytest.raises(RadiationError, match="not between 20 and 1000"):
        lagrange(nodes, 1001.0)


def test_what_is_refused(body, parts):
    with pytest.raises(RadiationError, match="elements_per_wavelength must be at least 5"):
        replace(body, elements_per_wavelength=3.0)
    with pytest.raises(RadiationError, match=r"the ground is at -0\.1 m"):
        replace(body, ground_m=-0.1)
    with pytest.raises(RadiationError, match="more than 6; what the grid can carry ends at about"):
        bands_of(replace(body, extent_m=(1.0, 0.45, 0.9)), 9000.0)
    with pytest.raises(RadiationError, match="must be above 20 Hz"):
        frequencies_of(body, 15.0)
    with pytest.raises(RadiationError, match="does not enclose the housing and the sources with room: it takes"):
        mean_vectors(body, parts, 0.5)


def test_near_and_outside(body):
    assert body.is_near(NEAR)
    assert not body.is_near(FAR)
    assert body.distance_m((0.0, 0.05, 0.0)) == 0.0
    assert body.distance_m((0.25, 0.35, 0.0)) == pytest.approx(0.2)
    assert body.distance_m((0.55, 0.15, 0.6)) == pytest.approx(0.5)

"""The field inside a rigid box against image sources, sums of modes and the equations it must satisfy."""

import itertools
import math

import numpy as np
import pytest
from cavity_walls import DENSITY, SOUND_SPEED, SupportedPlate, steel

from tdacoustic.cavity import (
    CavityError,
    WallModes,
    blocked_forces,
    boundary_layer_loss_factor,
    box_cavity,
    box_interior,
    coupled_velocities,
    field_incidence_db,
    pressure_of_source,
    pressure_of_walls,
    wall_impedance,
)

FIELD_INCIDENCE = (
    "literature: mass law of field incidence, 20 lg(m f) - 47 dB (Fahy and Gardonio, Sound and Structural Vibration)"
)

SIZE = (0.6, 0.4, 0.5)
SOURCE = (0.12, -0.07, 0.03)


@pytest.fixture(scope="module")
def plate():
    return SupportedPlate(SIZE, *steel(0.003), 1500.0)


@pytest.fixture(scope="module")
def interior(plate):
    return box_interior(SIZE, plate.outward, plate.bending_rad_m, 4.0 * plate.bending_rad_m)


def wave_number(frequency, loss):
    return 2.0 * math.pi * frequency / SOUND_SPEED * np.sqrt(1.0 - 1j * loss)


def by_images(points, wave, reach=14):
    """Sum of e^{-jkr}/r over the images of the source in six rigid walls; the losses end it."""
    lines = []
    for size, place in zip(SIZE, SOURCE, strict=True):
        u = place + 0.5 * size
        lines.append(np.sort([2.0 * n * size + sign * u for n in range(-reach, reach + 1) for sign in (1, -1)]))
    images = np.array(np.meshgrid(*lines, indexing="ij")).reshape(3, -1).T
    found = []
    for point in points:
        way = np.linalg.norm(images - (np.asarray(point) + 0.5 * np.asarray(SIZE)), axis=1)
        found.append((np.exp(-1j * wave * way) / way).sum())
    return np.array(found)


def some_points(number, seed=4):
    return (np.random.default_rng(seed).random((number, 3)) - 0.5) * SIZE


@pytest.mark.parametrize("frequency", [60.0, 286.0, 433.0, 1500.0])
def test_a_source_in_a_rigid_box_is_its_images(interior, frequency, conformance):
    """The loss factor is chosen so that 14 reflections off each pair of walls leave 1e-6 of the sound."""
    loss = min(0.9, 2.0 * 14.0 / (2.0 * math.pi * frequency / SOUND_SPEED * 2.0 * 14 * min(SIZE)))
    wave = wave_number(frequency, loss)
    points = np.concatenate([some_points(20), [[0.3, 0.2, 0.25], [0.12, -0.07, -0.25]]])
    found, expected = pressure_of_source(interior, points, SOURCE, wave), by_images(points, wave)
    left = math.exp(wave.imag * 2.0 * 14.0 * min(SIZE)) * 50.0
    worst = (np.abs(found - expected) / np.abs(expected)).max()
    conformance(
        f"pressure of a source in a rigid box, {frequency:g} Hz, worst of {len(points)} points",
        0.0,
        worst,
        max(1e-5, left),
        "1",
        "analytic: image sources of a rigid box",
        "" if left < 0.01 else "the reflections left out of the sum of images, bounded from above",
    )


def test_close_to_the_source_its_own_field_stands_out(interior):
    wave = wave_number(433.0, 0.3)
    away = np.array([1.0, -0.6, 0.3]) / np.linalg.norm([1.0, -0.6, 0.3])
    for distance in (0.0005, 0.004, 0.015, 0.022, 0.03):
        points = np.array(SOURCE) + distance * np.concatenate([[away], -np.eye(3)])
        found, expected = pressure_of_source(interior, points, SOURCE, wave), by_images(points, wave)
        assert np.abs(found - expected).max() < 1e-3 * np.abs(expected).max()
    near = pressure_of_source(interior, [np.array(SOURCE) + 0.0005 * away], SOURCE, wave)[0]
    assert abs(near) == pytest.approx(2000.0, rel=5e-3)


def test_source_and_point_can_be_exchanged(interior):
    wave = wave_number(731.0, 0.01)
    for point in some_points(5):
        there = pressure_of_source(interior, [point], SOURCE, wave)[0]
        back = pressure_of_source(interior, [SOURCE], tuple(point), wave)[0]
        assert there == pytest.approx(back, rel=1e-5)


def test_walls_push_the_air_as_they_move(interior, plate):
    """∂p/∂n = -jωρ v at the plate, 0 at the other walls; ∇²p = -k² p inside; by differences."""
    frequency, step = 433.0, 1e-4
    wave = wave_number(frequency, 0.02)
    moved = np.random.default_rng(1).standard_normal(len(plate.frequency_hz)) * 1j

    def pressure(points):
        return pressure_of_walls(interior, points, moved, frequency, wave, DENSITY)

    x, y = np.array([0.05, -0.13, 0.2]), np.array([0.02, 0.11, -0.09])
    top = np.column_stack([x, y, np.full(3, 0.5 * SIZE[2])])
    deep = [pressure(top - [0.0, 0.0, n * step]) for n in range(3)]
    slope = (1.5 * deep[0] - 2.0 * deep[1] + 0.5 * deep[2]) / step
    expected = -2j * math.pi * frequency * DENSITY * (moved @ plate.shapes(x, y))
    assert np.abs(slope - expected).max() < 2e-2 * np.abs(expected).max()  # the series of the edges' kink ends
    bottom = top * [1.0, 1.0, -1.0]
    low = [pressure(bottom + n * step * np.eye(3)[2]) for n in range(3)]
    assert np.abs(1.5 * low[0] - 2.0 * low[1] + 0.5 * low[2]).max() / step < 1e-3 * np.abs(expected).max()
    points, reach = some_points(4) * 0.6, 2e-3
    sides = sum(pressure(points + sign * reach * axis) for sign in (1, -1) for axis in np.eye(3))
    laplace = (sides - 6.0 * pressure(points)) / reach**2
    assert np.abs(laplace + wave**2 * pressure(points)).max() < 1e-3 * np.abs(wave**2 * pressure(points)).max()


def test_pressure_on_the_wall_is_what_pushes_it(interior, plate):
    """Integrals of the series over the plate are the modal forces of the modal sums."""
    frequency, loss = 433.0, 0.02
    cavity = box_cavity(interior, 1000.0, SOURCE, SOUND_SPEED, DENSITY, kept=3.0)
    wave = np.sqrt(cavity.squared_wave_number(frequency, loss))
    ends, weights = np.polynomial.legendre.leggauss(40)
    x, y = (0.5 * size * ends for size in SIZE[:2])
    points = np.array([(u, v, 0.5 * SIZE[2]) for u, v in itertools.product(x, y)])
    areas = np.outer(0.5 * SIZE[0] * weights, 0.5 * SIZE[1] * weights).ravel()
    shapes = plate.shapes(points[:, 0], points[:, 1])
    pushed = shapes @ (areas * pressure_of_source(interior, points, SOURCE, wave))
    expected = blocked_forces(cavity, frequency, loss)
    assert np.abs(pushed - expected).max() < 1e-4 * np.abs(expected).max()
    moved = coupled_velocities(cavity, WallModes(plate.frequency_hz, 0.02), frequency, loss)
    back = shapes @ (areas * pressure_of_walls(interior, points, moved, frequency, wave, DENSITY))
    free = WallModes(plate.frequency_hz, 0.02).impedance(frequency) * moved
    assert np.abs(pushed + back - free).max() < 1e-3 * np.abs(free).max()


def test_points_outside_and_at_the_source_are_refused(interior):
    with pytest.raises(CavityError, match=r"the point \(0\.31, 0\.0, 0\.0\) m is not in the cavity"):
        pressure_of_source(interior, [(0.31, 0.0, 0.0)], SOURCE, 5.0)
    with pytest.raises(CavityError, match="at the source"):
        pressure_of_source(interior, [SOURCE], SOURCE, 5.0)
    with pytest.raises(CavityError, match="is not in the cavity"):
        pressure_of_walls(interior, [(0.0, 0.0, 0.3)], np.zeros(interior.walls[0].shape[0]), 100.0, 2.0, DENSITY)


def test_mass_law_and_boundary_layers(conformance):
    """20 lg(mf) - 47 dB, the usual rule for field incidence with ρc = 413 Pa s/m; 6 dB an octave and a doubled mass."""
    for mass, frequency in ((94.2, 500.0), (10.0, 1000.0)):
        rule = 20.0 * math.log10(mass * frequency) - 47.0
        found = float(field_incidence_db(frequency, [(1.0, mass)], 413.0))
        conformance(f"mass law, {mass:g} kg/m², {frequency:g} Hz", rule, found, 0.5, "dB", FIELD_INCIDENCE)
    at_500, at_1000 = field_incidence_db([500.0, 1000.0], [(1.0, 94.2), (2.0, 78.5)], 413.0)
    assert at_1000 - at_500 == pytest.approx(6.02, abs=0.01)
    assert field_incidence_db(500.0, [(1.0, 94.2), (2.0, 78.5)], 413.0) < field_incidence_db(
        500.0, [(1.0, 94.2)], 413.0
    )
    one = boundary_layer_loss_factor(500.0, 4.19, 0.362)
    assert boundary_layer_loss_factor(2000.0, 4.19, 0.362) == pytest.approx(0.5 * one)


def bumps(points, normals):
    """One smooth shape on each of the six walls, unlike along its two axes and on opposite walls."""
    u = np.asarray(points) / SIZE + 0.5
    found = np.zeros((6, len(u)))
    for number, (axis, sign) in enumerate(itertools.product(range(3), (1.0, -1.0))):
        first, second = (other for other in range(3) if other != axis)
        here = normals[:, axis] * sign > 0.5
        shape = np.sin(math.pi * u[:, first]) ** 2 * (1.0 + (0.3 + 0.1 * number) * np.cos(math.pi * u[:, second]))
        found[number, here] = shape[here]
    return found


def test_every_wall_feels_every_other_through_the_air():
    """The matrix of modal sums and series, against integrals over the walls of the pressure that each one makes."""
    frequency, loss = 431.0, 0.02
    interior = box_interior(SIZE, bumps, 20.0, 120.0)
    cavity = box_cavity(interior, 500.0, SOURCE, SOUND_SPEED, DENSITY, kept=1.2, terms=6)
    wave = np.sqrt(cavity.squared_wave_number(frequency, loss))
    found = wall_impedance(cavity, frequency, loss)
    ends, weights = np.polynomial.legendre.leggauss(36)
    points, normals, areas = [], [], []
    for axis, sign in itertools.product(range(3), (1.0, -1.0)):
        first, second = (other for other in range(3) if other != axis)
        for (u, of_u), (v, of_v) in itertools.product(zip(ends, weights, strict=True), repeat=2):
            place, normal = np.zeros(3), np.zeros(3)
            place[[first, second, axis]] = 0.5 * u * SIZE[first], 0.5 * v * SIZE[second], 0.5 * sign * SIZE[axis]
            normal[axis] = sign
            points.append(place), normals.append(normal)
            areas.append(0.25 * of_u * of_v * SIZE[first] * SIZE[second])
    shapes = bumps(points, np.array(normals)) * areas
    expected = np.array(
        [-shapes @ pressure_of_walls(interior, points, unit, frequency, wave, DENSITY) for unit in np.eye(6)]
    ).T
    assert np.abs(found - expected).max() < 1e-4 * np.abs(expected).max()
    kept = cavity.walls.T @ (cavity.responses(wave**2)[:, None] * cavity.walls)
    kept = kept * 2j * math.pi * frequency * DENSITY / cavity.volume_m3
    rest = np.abs(expected - kept)
    assert np.abs(found - expected).max() < 0.1 * rest[~np.eye(6, dtype=bool)].min()  # each pair of walls is tested

"""What a housing's modes do to the air inside: rigid bodies that move, where everything is known."""

import math

import numpy as np
import pytest
from made_up_modes import triangles_of

from tdacoustic.cavity import inner_size_m, interior_of, pressure_of_walls, wall_displacements
from tdacoustic.housing import Box, HousingModes, Seat
from tdacoustic.housing.surface import panel_nodes

SOUND_SPEED, DENSITY = 343.0, 1.2
BOX = Box((0.2, 0.5, 0.4), 0.006, 0.008, 0.006, (Seat("pinion", (-0.1, 0.0), 0.05), Seat("wheel", (0.1, 0.0), 0.08)))
PUSH, TURN = np.array([0.3, -0.5, 0.2]), np.array([0.4, 0.7, -0.6])


def rigid(points, push, turn):
    return push + np.cross(turn, points)


@pytest.fixture(scope="module")
def modes():
    """Three shapes: pushed, turned, and growing in all directions like a balloon."""
    surface = panel_nodes(*triangles_of(BOX.extent_m), order=2)
    moved = [rigid(surface.points_m, PUSH, 0.0 * TURN), rigid(surface.points_m, 0.0 * PUSH, TURN), surface.normals]
    outward = np.array([np.einsum("ij,ij->i", one, surface.normals) for one in moved])
    return HousingModes(BOX, 700.0, 3, np.array([1.0, 2.0, 3.0]), np.zeros((3, 4, 3)), surface, outward, BOX.mass_kg)


def test_the_inner_walls_move_as_the_body_does(modes):
    """Outward at each of the six walls, at places that no symmetry maps on one another."""
    size = np.array(inner_size_m(BOX))
    assert size == pytest.approx([0.488, 0.184, 0.388])
    outward = wall_displacements(modes)
    for axis in range(3):
        for sign in (-1.0, 1.0):
            points = np.array([[0.31, -0.17, 0.05], [-0.08, 0.41, 0.29]]) * size
            points[:, axis] = 0.5 * sign * size[axis]
            normals = np.zeros((2, 3))
            normals[:, axis] = sign
            found = outward(points, normals)
            assert found[0] == pytest.approx(sign * PUSH[axis], abs=1e-9)
            assert found[1] == pytest.approx(sign * rigid(points, 0.0 * PUSH, TURN)[:, axis], abs=1e-9)
            assert found[2] == pytest.approx(1.0, abs=1e-9)


def test_the_air_in_a_box_that_moves_has_its_inertia(modes):
    """Below all resonances p = -ρ a·x of a box that is accelerated, and -ρc² ΔV / V of one that grows."""
    interior = interior_of(BOX, modes, SOUND_SPEED)
    frequency = 2.0
    omega = 2.0 * math.pi * frequency
    points = np.array([[0.2, 0.05, -0.1], [-0.1, -0.08, 0.15], [0.05, 0.0, 0.1]])
    wave = omega / SOUND_SPEED
    pushed, grown = (
        pressure_of_walls(interior, points, 1j * omega * shape, frequency, wave, DENSITY)
        for shape in (np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    )
    assert pushed == pytest.approx(DENSITY * omega**2 * points @ PUSH, rel=2e-3)  # the series along walls has an end
    stiffness = DENSITY * SOUND_SPEED**2 * interior.surface_m2 / interior.volume_m3
    assert grown == pytest.approx(np.full(3, -stiffness), rel=1e-3)

"""The modes of a small box against direct solutions, other grids and symmetry; the response as arithmetic."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from reference_housing import reference_box, small_box

from tdacoustic.errors import MissingPackageError
from tdacoustic.housing import HousingError, HousingModes, Seat, housing_modes
from tdacoustic.housing.box_modes import MODES_BEYOND, _sampled, box_structure, edge_for, expected_modes
from tdacoustic.housing.eigenmodes import natural_modes, static_deflections
from tdacoustic.housing.solid_grid import box_grid
from tdacoustic.housing.surface import panel_nodes
from tdacoustic.steps.codec import decode, encode

HIGHEST_HZ = 1500.0
UNDAMPED = 1e-12


def one_mode(natural_hz=100.0):
    corners = np.array([[[0.0, 0.3, 0.0], [0.0, 0.3, 1.0], [2.0, 0.3, 0.0]]])
    surface = panel_nodes(corners, np.array([0]), 1)
    seats = np.zeros((1, 4, 3))
    seats[0, 2, 1] = 0.2
    return HousingModes(small_box(), 500.0, 1, np.array([natural_hz]), seats, surface, np.ones((1, 3)), 50.0)


def test_the_response_of_one_mode_is_that_of_an_oscillator(conformance):
    modes = one_mode()
    frequency = np.array([0.5, 100.0, 400.0])
    forces = np.zeros((4, 3, 3), dtype=complex)
    forces[2, 1] = 3.0
    omega = 2.0 * np.pi * frequency
    expected = 1j * omega * 0.6 / ((200.0 * np.pi) ** 2 * (1.0 + 0.05j) - omega**2)
    off = np.abs(modes.response(frequency, forces, loss_factor=0.05)[0] / expected - 1.0).max()
    source = "analytic: oscillator with a structural loss factor"
    conformance("velocity of one mode under a force, worst of 3 frequencies", 0.0, off, 1e-9, "1", source)
    at_rest = modes.response([100.0], forces[..., 1:2])  # the box's loss factor, 0.02: velocity and force in phase
    assert at_rest[0, 0] == pytest.approx(0.6 / (200.0 * np.pi * 0.02))
    assert np.abs(modes.normal_at([[0.5, 0.3, 0.2]], [[0.0, 1.0, 0.0]])) == pytest.approx(1.0)


def test_a_response_beyond_the_modes_and_forces_of_another_shape_are_refused():
    modes = one_mode()
    for asked_hz in (600.0, -1.0, np.nan):
        said = f"modes are for 0 to 500 Hz, the response is asked for at {asked_hz:g} Hz"
        with pytest.raises(HousingError, match=said):
            modes.response([10.0, asked_hz], np.zeros((4, 3, 2)))
        with pytest.raises(HousingError, match=said):
            modes.seat_compliance([asked_hz])
    for loss in (0.0, -0.02, np.nan):
        with pytest.raises(HousingError, match="loss_factor must be above 0 and at most 1, got"):
            modes.response([10.0], np.zeros((4, 3, 1)), loss)
    with pytest.raises(HousingError, match=r"forces must have the shape \(4, 3, 2\), got \(4, 3, 1\)"):
        modes.response([10.0, 20.0], np.zeros((4, 3, 1)))


def test_arrays_of_the_caller_stay_as_they_are():
    modes = one_mode()
    seats = np.zeros((1, 4, 3))
    again = replace(modes, seats=seats)
    seats[0, 0, 0] = 1.0
    assert again.seats[0, 0, 0] == 0.0


def test_modes_that_cannot_be_are_refused():
    modes = one_mode()
    with pytest.raises(HousingError, match="natural must be from 0 to the number of modes, 1, got 2"):
        replace(modes, natural=2)
    with pytest.raises(HousingError, match="frequency_hz of modes must be > 0"):
        replace(modes, frequency_hz=np.array([0.0]))


def test_arrays_are_read_only_and_can_be_kept():
    modes = one_mode()
    with pytest.raises(ValueError, match="read-only"):
        modes.seats[0] = 0.0
    arrays = []
    again = decode(encode(modes, arrays), arrays)
    assert again.box == modes.box
    assert (again.outward == modes.outward).all()
    assert (again.surface.triangles == modes.surface.triangles).all()


@pytest.fixture(scope="module")
def modes():
    pytest.importorskip("ngsolve", reason="ngsolve (extra housing) is not installed")
    return housing_modes(small_box(), HIGHEST_HZ)


@pytest.fixture(scope="module")
def grid():
    pytest.importorskip("ngsolve", reason="ngsolve (extra housing) is not installed")
    return box_grid(small_box(), edge_for(small_box(), MODES_BEYOND * HIGHEST_HZ))


@pytest.fixture(scope="module")
def structure(grid):
    return box_structure(small_box(), grid)


def natural(modes):
    return modes.frequency_hz[: modes.natural]


def test_the_grid_is_closed_and_weighs_what_the_box_does(grid, structure):
    box = small_box()
    assert structure.mass_kg == pytest.approx(box.mass_kg, rel=1e-9)
    corners = np.concatenate([grid.faces[:, :3], grid.faces[grid.faces[:, 3] >= 0][:, [0, 2, 3]]])
    points = grid.points_m[corners]
    areas = 0.5 * np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    x, y, z = box.extent_m
    assert np.linalg.norm(areas, axis=1).sum() == pytest.approx(2.0 * (x * y + y * z + z * x), rel=1e-9)
    # outward: the divergence theorem gives the volume of the outer box
    assert (areas * points.mean(axis=1)).sum() / 3.0 == pytest.approx(x * y * z, rel=1e-9)


def test_static_deflections_are_those_of_a_direct_solution(modes, structure):
    direct = (structure.loads @ static_deflections(structure).T).reshape(4, 3, 4, 3)
    found = modes.seat_compliance([0.0], UNDAMPED)[..., 0].real
    assert found == pytest.approx(direct, rel=1e-6, abs=1e-6 * np.abs(direct).max())


def test_the_static_correction_is_seen_on_the_surface_too(modes, structure, grid):
    load = 4  # the pinion's right seat along y: panel bending next to the springs
    direct = static_deflections(structure)[load : load + 1]
    _, outward = _sampled(grid, structure, direct, 4)
    forces = np.zeros((4, 3, 1))
    forces[1, 1] = 1.0
    frequency = 1e-3
    velocity = modes.response([frequency], forces, UNDAMPED)[:, 0]
    found = (velocity / (2j * np.pi * frequency)).real @ modes.outward
    largest = np.abs(outward).max()
    assert np.abs(found - outward[0]).max() < 1e-4 * largest
    kept = modes.natural
    without = (velocity[:kept] / (2j * np.pi * frequency)).real @ modes.outward[:kept]
    assert np.abs(without - outward[0]).max() > 0.01 * largest  # the correction matters


@pytest.mark.parametrize(("frequency_hz", "within"), [(300.0, 1e-5), (1300.0, 0.005), (HIGHEST_HZ, 0.03)])
def test_the_response_is_that_of_a_direct_solution(modes, structure, frequency_hz, within):
    # what the static correction neglects grows with the fourth power of the frequency, up to the highest one
    shift = (2.0 * np.pi * frequency_hz) ** 2
    inverse = structure.shifted(shift)
    found = structure.applied(inverse, structure.loads)
    force = structure.applied(structure.stiffness, found) - shift * structure.applied(structure.mass, found)
    found += structure.applied(inverse, structure.loads - force)
    direct = (structure.loads @ found.T).reshape(12, 12)
    ours = modes.seat_compliance([frequency_hz], UNDAMPED).real.reshape(12, 12)
    largest = np.abs(direct).max()
    assert direct == pytest.approx(direct.T, abs=1e-6 * largest)  # reciprocity
    assert np.abs(ours - direct).max() < within * largest


def test_forces_and_displacements_of_seats_are_reciprocal(modes):
    compliance = modes.seat_compliance([300.0, 900.0]).reshape(12, 12, 2)
    assert compliance == pytest.approx(compliance.transpose(1, 0, 2), rel=1e-12)


def test_modes_of_a_symmetric_box_are_symmetric_or_not_at_all(modes):
    # mirrored left to right: x and z of both seats of a shaft agree, y is opposite, or the other way round
    left, right = modes.seats[: modes.natural, ::2], modes.seats[: modes.natural, 1::2]
    mirror = np.array([1.0, -1.0, 1.0])
    size = np.abs(modes.seats[: modes.natural]).max(axis=(1, 2))
    even = np.abs(left - right * mirror).max(axis=(1, 2)) / size
    odd = np.abs(left + right * mirror).max(axis=(1, 2)) / size
    assert np.minimum(even, odd).max() < 0.02


def test_the_box_on_its_springs_moves_as_a_rigid_one_at_first(modes):
    # up along z: all springs along z against the mass; the other five of the six rigid modes lie near
    box = small_box()
    springs = 4.0 * 2e7 + 2e7
    rigid = np.sqrt(springs / box.mass_kg) / (2.0 * np.pi)
    assert natural(modes)[:6].min() < rigid < natural(modes)[:6].max()
    assert natural(modes)[6] > 1.5 * natural(modes)[5]


def test_seats_move_with_the_surface_around_their_middle(modes):
    box = small_box()
    for number, (shaft, side) in enumerate(((0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0))):
        x, z = box.seats[shaft].centre_m
        middle = modes.normal_at([[x, side * 0.1, z]], [[0.0, side, 0.0]])[: modes.natural, 0]
        mean = modes.seats[: modes.natural, number, 1] * side
        assert np.abs(middle - mean).max() < 0.15 * np.abs(mean).max()


def test_the_correction_lies_above_the_modes(modes):
    assert HIGHEST_HZ < natural(modes)[-1] <= MODES_BEYOND * HIGHEST_HZ < modes.frequency_hz[modes.natural :].min()
    assert len(modes.frequency_hz) == modes.natural + 12


@pytest.mark.parametrize(("faces", "order", "factor"), [("quadrilaterals", 4, 1.0), ("triangles", 5, 1.3)])
def test_a_second_discretisation_has_the_same_modes(modes, faces, order, factor):
    box, reach = small_box(), MODES_BEYOND * HIGHEST_HZ
    other = box_structure(box, box_grid(box, factor * edge_for(box, reach), faces), order)
    found, _ = natural_modes(other, reach, expected_modes(box, reach))
    assert len(found) == modes.natural
    off = float(np.abs(natural(modes) / found - 1.0).max())
    assert off <= 0.01


@pytest.mark.parametrize("edge_m", [0.06, 0.1, 0.18])
def test_seats_close_to_each_other_and_to_a_wall_can_be_gridded(edge_m):
    pytest.importorskip("ngsolve", reason="ngsolve (extra housing) is not installed")
    near = (Seat("pinion", (-0.188, -0.13), 0.148), Seat("wheel", (0.274, 0.068), 0.209))  # 5 mm to the wall
    box = reference_box(seats=near)
    grid = box_grid(box, edge_m)
    low, high = grid.points_m.min(axis=0), grid.points_m.max(axis=0)
    assert high - low == pytest.approx(np.array(box.extent_m))
    assert_closed(grid)


def assert_closed(grid):
    """Every side of a surface face is shared by two faces: no panel is cut otherwise than its neighbour."""
    rings = [face[face >= 0] for face in grid.faces]
    sides = np.concatenate([np.column_stack([ring, np.roll(ring, -1)]) for ring in rings])
    _, shared = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    assert (shared == 2).all()


@pytest.mark.parametrize("more_m", [(1e-7, 2e-7, 3e-7), (5e-7, 6e-7, 11e-7)])
def test_sizes_to_a_tenth_of_a_micrometre_cut_no_edge(more_m):
    # half of such a size is where rounding to tenths of a micrometre goes either way
    pytest.importorskip("ngsolve", reason="ngsolve (extra housing) is not installed")
    size_m = tuple(size + more for size, more in zip((0.45, 1.0, 0.9), more_m, strict=True))
    assert_closed(box_grid(reference_box(size_m=size_m), 0.15))


def test_a_band_without_natural_modes_is_stiff():
    pytest.importorskip("ngsolve", reason="ngsolve (extra housing) is not installed")
    box = small_box()
    low = housing_modes(box, 5.0, edge_m=0.15, order=3)
    assert low.natural == 0
    # pushed up by its middle, all springs give way as one
    springs = 4.0 * 2e7 + 2e7
    forces = np.zeros((4, 3, 1))
    forces[:, 2] = 0.25
    moved = low.response([1e-3], forces)[:, 0] / (2e-3j * np.pi)
    assert np.mean((low.seats[:, :, 2].T @ moved).real) == pytest.approx(1.0 / springs, rel=0.3)


def test_without_ngsolve_the_error_says_what_to_install(monkeypatch):
    for name in ("ngsolve", "netgen", "netgen.geom2d", "netgen.meshing"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(
        MissingPackageError, match=r"ngsolve, which is not installed: pip install .*tdacoustic\[housing\]"
    ):
        housing_modes(small_box(), 100.0)


def test_a_frequency_that_is_none_is_refused():
    with pytest.raises(HousingError, match=r"edge_m must be > 0, got -0.1"):
        housing_modes(small_box(), 100.0, edge_m=-0.1)
    with pytest.raises(HousingError, match=r"order must be at least 2, got 1"):
        housing_modes(small_box(), 100.0, order=1)
    with pytest.raises(HousingError, match=r"highest_hz must be > 0, got 0.0"):
        housing_modes(small_box(), 0.0)

"""Boundary elements: symmetry, reciprocity, energy, ground, convergence on a box, and what is refused."""

import re

import numpy as np
import pytest

from tdacoustic.errors import RadiationError
from tdacoustic.radiation.boundary_elements import ExteriorProblem
from tdacoustic.radiation.grids import box_surface, sphere_surface
from tdacoustic.radiation.sphere_rules import SphereRule
from tdacoustic.radiation.surfaces import Surface

IMPEDANCE = 413.0
SIZE = (0.45, 1.0, 0.9)
FAR = np.array([[2.0, 1.0, 0.5], [-1.0, 0.3, 1.5], [0.2, -3.0, -0.4], [0.0, 0.0, 4.0]])


def sides(surface, centre=(0.0, 0.0, 0.0)):
    """Velocities without any symmetry: sines of place on some sides."""
    x = surface.centres_m - np.asarray(centre)
    normals = surface.normals
    return np.stack(
        [
            (normals[:, 0] > 0.5) * np.cos(4.0 * x[:, 1] + 1.0) * np.cos(3.0 * x[:, 2]),
            normals[:, 1] * np.exp(1j * x[:, 0]) + (normals[:, 2] < -0.5),
            np.ones(len(x)),
        ],
        axis=1,
    )


@pytest.mark.parametrize("planes", [("x",), ("z", "y"), ("x", "y", "z")])
@pytest.mark.parametrize("shape", ["box", "sphere"])
def test_with_and_without_mirror_planes_is_the_same(shape, planes):
    centre = (0.3, -0.2, 0.1)
    if shape == "box":
        surfaces = [box_surface(SIZE, 0.12, some, centre) for some in (planes, ())]
    else:
        surfaces = [sphere_surface(0.5, 8, some, centre) for some in (planes, ())]
    found, pressed, rows = [], [], []
    for surface in surfaces:
        problem = ExteriorProblem(surface, 5.0, IMPEDANCE, precision="double")
        found.append(problem.transfer(FAR, sides(surface, centre)))
        order = np.lexsort(np.round(surface.centres_m, 9).T)
        pressed.append(problem.pressures(sides(surface, centre))[order])
        rows.append(problem.panel_transfer(FAR)[:, order])
    for pair in (found, pressed, rows):
        assert np.abs(pair[0] - pair[1]).max() < 1e-9 * np.abs(pair[1]).max()


def test_solving_for_receivers_or_for_velocities_is_the_same():
    surface = box_surface(SIZE, 0.1)
    problem = ExteriorProblem(surface, 6.0, IMPEDANCE, precision="double")
    velocity = sides(surface)
    direct = problem.transfer(FAR, velocity, "direct")
    assert problem.transfer(FAR, velocity, "adjoint") == pytest.approx(direct, rel=1e-9)
    assert problem.panel_transfer(FAR) @ velocity == pytest.approx(direct, rel=1e-9)


def test_many_receivers_in_portions_are_the_same_as_few():
    surface = box_surface(SIZE, 0.15)
    problem = ExteriorProblem(surface, 4.0, IMPEDANCE, precision="double")
    many = SphereRule(3.0, 30).points_m
    assert len(many) > 256
    for way in ("direct", "adjoint"):
        found = problem.transfer(many, sides(surface), way)
        assert found[300:304] == pytest.approx(problem.transfer(many[300:304], sides(surface), way), rel=1e-9)


def test_source_and_receiver_can_be_exchanged():
    places = [(0.6, 0.2, 0.3), (-0.5, -0.9, 0.7), (0.1, 0.8, -1.0), (3.0, 0.0, 0.0)]
    for ground in (None, -1.2):
        planes = ("x", "y", "z") if ground is None else ("x", "y")
        problem = ExteriorProblem(box_surface(SIZE, 0.06, planes), 9.0, IMPEDANCE, ground)
        found = np.array([[0j if r is s else problem.scattered([s], [r])[0, 0] for s in places] for r in places])
        assert found == pytest.approx(found.T, rel=0.01, abs=0.003)


def test_a_panel_sounds_at_a_point_as_a_source_there_sounds_on_the_panel(conformance):
    # p(r) = jkρc ∫ v g dS / 4π of unit velocity, g the field of e^{-jkR}/R at r beside the rigid body
    surface, wave_number = box_surface(SIZE, 0.045), 12.0
    problem = ExteriorProblem(surface, wave_number, IMPEDANCE)
    side = surface.normals[:, 0] > 0.5
    patch = side & (np.abs(surface.centres_m[:, 1]) < 0.3) & (np.abs(surface.centres_m[:, 2]) < 0.3)
    receiver = np.array([[1.5, 0.8, -0.6]])
    sent = problem.panel_transfer(receiver)[0, patch].sum()
    field = problem.blocked_pressures(receiver)[patch, 0]
    received = 1j * wave_number * IMPEDANCE * (field * surface.areas_m2[patch]).sum() / (4.0 * np.pi)
    level = 20.0 * np.log10(abs(sent / received))
    conformance(
        "reciprocity of a panel and a point beside the box", 0.0, level, 0.05, "dB", "law: acoustic reciprocity"
    )
    assert abs(np.angle(sent / received)) < 0.01


def test_as_much_power_through_12_m_as_through_4_m_and_out_of_the_surface(conformance):
    surface = box_surface(SIZE, 0.06)
    problem = ExteriorProblem(surface, 10.0, IMPEDANCE)
    velocity = sides(surface)
    near, far = (
        rule.sound_power_w(problem.transfer(rule.points_m, velocity), IMPEDANCE)
        for rule in (SphereRule(4.0, 24), SphereRule(12.0, 24))
    )
    given = (np.real(problem.pressures(velocity) * velocity.conj()) * surface.areas_m2[:, None]).sum(axis=0)
    for name, one, two, three in zip(("side", "two sides", "all sides"), near, far, given, strict=True):
        level = 10.0 * np.log10(one / two)
        conformance(
            f"power of a box through 4 m over 12 m, {name}", 0.0, level, 0.02, "dB", "law: conservation of energy"
        )
        level = 10.0 * np.log10(two / three)
        conformance(
            f"power of a box through 12 m over that put in, {name}",
            0.0,
            level,
            0.1,
            "dB",
            "law: conservation of energy",
        )


def test_a_body_over_ground_is_the_body_with_its_mirror_image():
    centre, ground, wave_number = (0.1, -0.2, 0.7), -0.1, 4.0
    body = sphere_surface(0.5, 6, ("x", "y"), centre)
    whole = sphere_surface(0.5, 6, (), centre)
    vertices, n = whole.vertices_m, len(whole.vertices_m)
    image = vertices * [1.0, 1.0, -1.0] + [0.0, 0.0, 2.0 * ground]
    both = Surface(np.concatenate((vertices, image)), np.concatenate((whole.panels, whole.panels[:, ::-1] + n)))
    moving = np.cos(3.0 * whole.centres_m @ [1.0, 0.5, -0.7])
    alone = ExteriorProblem(both, wave_number, IMPEDANCE, precision="double")
    expected = alone.transfer(np.abs(FAR), np.tile(moving, 2)[:, None])
    over = ExteriorProblem(body, wave_number, IMPEDANCE, ground, precision="double")
    order = np.cos(3.0 * body.centres_m @ [1.0, 0.5, -0.7])[:, None]
    for way in ("direct", "adjoint"):
        assert over.transfer(np.abs(FAR), order, way) == pytest.approx(expected, rel=1e-6)
    source = np.array([[1.5, 1.0, 0.4]])
    twice = np.concatenate((source, source * [1.0, 1.0, -1.0] + [0.0, 0.0, 2.0 * ground]))
    assert over.scattered(source, np.abs(FAR))[:, 0] == pytest.approx(
        alone.scattered(twice, np.abs(FAR)).sum(axis=1), rel=1e-6
    )


def inside_sources(surface, wave_number, points):
    """Velocities on a surface of point sources within it, and their pressures at points: exact for any shape."""
    places = np.array([[0.0, 0.0, 0.0], [0.1, 0.3, -0.2], [-0.12, -0.35, 0.3]])

    def field(at):
        arms = at[:, None] - places
        distance = np.linalg.norm(arms, axis=-1)
        pressure = np.exp(-1j * wave_number * distance) / distance
        return pressure, -((1j * wave_number + 1.0 / distance) * pressure / distance)[..., None] * arms

    slope = np.einsum("nsi,ni->ns", field(surface.centres_m)[1], surface.normals)
    return slope / (-1j * wave_number * IMPEDANCE), field(points)[0]


def test_a_box_with_sources_inside_converges(conformance):
    wave_number, points = 2.0 * np.pi * 1000.0 / 343.2, SphereRule(4.0, 11).points_m
    found = []
    for density in (6.0, 12.0):
        surface = box_surface(SIZE, 2.0 * np.pi / wave_number / density)
        velocity, exact = inside_sources(surface, wave_number, points)
        problem = ExteriorProblem(surface, wave_number, IMPEDANCE)
        pressures = problem.transfer(points, velocity)
        found.append((np.linalg.norm(pressures - exact, axis=0) / np.linalg.norm(exact, axis=0)).max())
    source = "analytic: fields of point sources inside the box"
    conformance(
        "box at 1 kHz, 6 panels a wavelength: L2 error at 4 m",
        0.0,
        100.0 * found[0],
        4.0,
        "%",
        source,
        "a coarse grid: the next row has the fine one",
    )
    conformance("box at 1 kHz, 12 panels a wavelength: L2 error at 4 m", 0.0, 100.0 * found[1], 1.2, "%", source)
    assert np.log2(found[0] / found[1]) > 1.2


def test_a_graded_box_is_right_too():
    wave_number, points = 10.0, SphereRule(4.0, 11).points_m
    surface = box_surface(SIZE, 0.09, edge_panel=0.4)
    velocity, exact = inside_sources(surface, wave_number, points)
    found = ExteriorProblem(surface, wave_number, IMPEDANCE).transfer(points, velocity)
    assert np.linalg.norm(found - exact) < 0.025 * np.linalg.norm(exact)


@pytest.fixture(scope="module")
def problem():
    return ExteriorProblem(box_surface(SIZE, 0.15), 3.0, IMPEDANCE)


@pytest.mark.parametrize(
    ("point", "why"),
    [
        ((0.1, 0.2, 0.3), "receiver 1 at (0.1, 0.2, 0.3) m is inside the body"),
        ((0.225, 0.1, 0.1), "receiver 1 at (0.225, 0.1, 0.1) m is on the body"),
        ((0.0, 0.51, 0.0), "receiver 1 at (0, 0.51, 0) m is on the body or nearer to it than a panel"),
        ((np.nan, 0.0, 0.0), "receivers must be finite"),
    ],
)
def test_receivers_where_there_is_no_field(problem, point, why):
    velocity = np.ones((problem.surface.n_panels, 1))
    with pytest.raises(RadiationError, match=re.escape(why)):
        problem.transfer([[3.0, 0.0, 0.0], point], velocity)
    with pytest.raises(RadiationError, match=re.escape(why.replace("receiver", "source").replace(" 1 ", " 0 "))):
        problem.scattered([point], [[3.0, 0.0, 0.0]])


def test_a_grid_too_coarse_for_the_frequency():
    with pytest.raises(RadiationError, match=r"the grid has 4\.\d panels a wavelength .* at least 6"):
        ExteriorProblem(box_surface(SIZE, 0.15), 10.0, IMPEDANCE)
    assert ExteriorProblem(box_surface(SIZE, 0.15), 10.0, IMPEDANCE, least_panels_per_wavelength=4.0)


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_wave_number_out_of_range(value):
    with pytest.raises(RadiationError, match="wave_number_rad_m must be > 0"):
        ExteriorProblem(box_surface(SIZE, 0.15), value, IMPEDANCE)


def test_ground_in_the_way():
    with pytest.raises(RadiationError, match=r"reaches down to z = -0\.45 m, it must be above the ground at -0\.4"):
        ExteriorProblem(box_surface(SIZE, 0.15, ("x", "y")), 3.0, IMPEDANCE, ground_m=-0.4)
    with pytest.raises(RadiationError, match="no mirror plane z"):
        ExteriorProblem(box_surface(SIZE, 0.15), 3.0, IMPEDANCE, ground_m=-1.0)
    over = ExteriorProblem(box_surface(SIZE, 0.15, ("x", "y")), 3.0, IMPEDANCE, ground_m=-1.0)
    with pytest.raises(RadiationError, match=r"receiver 0 at \(0, 3, -2\) m is below the ground at z = -1 m"):
        over.transfer([[0.0, 3.0, -2.0]], np.ones((over.surface.n_panels, 1)))


def test_velocities_that_do_not_fit(problem):
    with pytest.raises(RadiationError, match=r"must be of shape \(\d+, n\), a row a panel, got \(3, 1\)"):
        problem.pressures(np.ones((3, 1)))
    with pytest.raises(RadiationError, match="normal velocities must be finite"):
        problem.pressures(np.full((problem.surface.n_panels, 1), np.nan))


def test_a_source_at_a_receiver(problem):
    with pytest.raises(RadiationError, match=r"source 0 is at the place of receiver 0, \(2, 0, 0\) m"):
        problem.scattered([[2.0, 0.0, 0.0]], [[2.0, 0.0, 0.0]])

"""Boundary elements against the series of the sphere: vibrating, with a piston, rigid in a point source's field."""

import numpy as np
import pytest
from scipy.special import eval_legendre, spherical_jn, spherical_yn

from tdacoustic.radiation.boundary_elements import ExteriorProblem
from tdacoustic.radiation.grids import sphere_surface
from tdacoustic.radiation.surfaces import Surface

IMPEDANCE = 413.0
SOURCE = "analytic: series of the sphere in spherical Hankel functions"
RESONANCES = (np.pi, 4.493409, 2.0 * np.pi, 7.725252)  # zeros of j0 and j1: of the space inside with p = 0 on its wall


def hankel(order, x, derivative=False):
    """Spherical, of the second kind: waves going out with e^{+jωt}."""
    return spherical_jn(order, x, derivative) - 1j * spherical_yn(order, x, derivative)


def angles(points):
    return points / np.linalg.norm(points, axis=-1, keepdims=True)


MOTIONS = {
    "pulsating": (0, lambda u: np.ones(len(u))),
    "oscillating along x": (1, lambda u: u[:, 0]),
    "quadrupole, axial": (2, lambda u: 1.5 * u[:, 2] ** 2 - 0.5),
    "quadrupole, lateral": (2, lambda u: 3.0 * u[:, 0] * u[:, 1]),
}


def receivers(count=60, nearest=1.5, farthest=4.0, seed=1):
    scatter = np.random.default_rng(seed)
    return angles(scatter.normal(size=(count, 3))) * scatter.uniform(nearest, farthest, (count, 1))


def vibrating(points, wave_number):
    """Pressures (points, motions) of a sphere of 1 m, of 1 m/s at the most: p = -jρc h_n(kr) / h_n'(ka) Y."""
    distance = np.linalg.norm(points, axis=1)
    return np.stack(
        [
            -1j * IMPEDANCE * hankel(n, wave_number * distance) / hankel(n, wave_number, True) * shape(angles(points))
            for n, shape in MOTIONS.values()
        ],
        axis=1,
    )


def errors(problem, points):
    """L2 error of each motion over the points."""
    velocity = np.stack([shape(angles(problem.surface.centres_m)) for _, shape in MOTIONS.values()], axis=1)
    exact = vibrating(points, problem.wave_number_rad_m)
    return np.linalg.norm(problem.transfer(points, velocity) - exact, axis=0) / np.linalg.norm(exact, axis=0)


@pytest.fixture(scope="module")
def fine():
    return sphere_surface(1.0, 28)


@pytest.mark.parametrize("ka", [0.5, 1.0, 2.0, *RESONANCES, 10.0])
def test_vibrating_spheres_with_4704_panels(fine, conformance, ka):
    assert fine.n_panels == 4704
    for motion, error in zip(MOTIONS, errors(ExteriorProblem(fine, ka, IMPEDANCE), receivers()), strict=True):
        conformance(f"{motion} sphere, ka = {ka:.4g}: L2 error at receivers", 0.0, 100.0 * error, 1.5, "%", SOURCE)


@pytest.mark.parametrize(("ka", "motion", "least"), [(RESONANCES[0], 0, 0.4), (RESONANCES[1], 1, 0.4)])
def test_without_burton_and_miller_the_resonances_of_the_inside_spoil_it(ka, motion, least):
    # the grid's own resonances are a little off those of the sphere
    surface = sphere_surface(1.0, 12)
    near = ka * np.array([1.0, 1.0025])
    plain = [errors(ExteriorProblem(surface, k, IMPEDANCE, formulation="plain"), receivers(20))[motion] for k in near]
    right = [errors(ExteriorProblem(surface, k, IMPEDANCE), receivers(20))[motion] for k in near]
    assert max(plain) > least
    assert max(right) < 0.04


def test_the_error_falls_with_the_panels_size():
    found = [errors(ExteriorProblem(sphere_surface(1.0, m), 2.5, IMPEDANCE), receivers()).max() for m in (6, 12, 24)]
    # flat panels have no curvature of their own: first order (on flat sides it is more, see the box)
    assert np.log2(found[0] / found[2]) / 2.0 > 0.9


@pytest.mark.parametrize("ka", [0.5, np.pi, 5.0])
def test_a_cap_moving_on_a_rigid_sphere(conformance, ka):
    surface, half_angle = sphere_surface(1.0, 20), np.radians(40.0)
    edge = np.cos(half_angle)
    # of a panel that the cap's edge crosses, the part that moves
    u, v = (part.ravel() for part in np.meshgrid(*2 * [(np.arange(20) + 0.5) / 20]))
    weights = np.stack(((1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v))
    moving = (angles(np.einsum("cq,pci->pqi", weights, surface.corners_m))[..., 2] > edge).mean(axis=1)
    points = receivers()
    distance, height = np.linalg.norm(points, axis=1), angles(points)[:, 2]
    exact = np.zeros(len(points), dtype=complex)
    for n in range(40):
        part = 0.5 * (1.0 - edge) if n == 0 else 0.5 * (eval_legendre(n - 1, edge) - eval_legendre(n + 1, edge))
        exact += part * eval_legendre(n, height) * hankel(n, ka * distance) / hankel(n, ka, True)
    exact *= -1j * IMPEDANCE
    found = ExteriorProblem(surface, ka, IMPEDANCE).transfer(points, moving[:, None])[:, 0]
    error = np.linalg.norm(found - exact) / np.linalg.norm(exact)
    conformance(
        f"cap piston on a sphere, ka = {ka:.4g}: L2 error",
        0.0,
        100.0 * error,
        2.5,
        "%",
        SOURCE,
        "the cap's edge, a jump of the velocity, crosses panels",
    )


@pytest.mark.parametrize("ka", [1.0, np.pi, 5.0])
def test_a_rigid_sphere_in_the_field_of_a_point_source(conformance, ka):
    source = np.array([0.3, -1.1, 1.2])
    points = receivers()
    near, far = np.linalg.norm(source), np.linalg.norm(points, axis=1)
    cosine = angles(points) @ angles(source)
    arm = np.linalg.norm(points - source, axis=1)
    exact = np.exp(-1j * ka * arm) / arm
    for n in range(60):
        bounced = spherical_jn(n, ka, True) / hankel(n, ka, True) * hankel(n, ka * near) * hankel(n, ka * far)
        exact += 1j * ka * (2 * n + 1) * bounced * eval_legendre(n, cosine)
    found = ExteriorProblem(sphere_surface(1.0, 20), ka, IMPEDANCE).scattered(source[None], points)[:, 0]
    error = np.linalg.norm(found - exact) / np.linalg.norm(exact)
    conformance(f"point source beside a rigid sphere, ka = {ka:.4g}: L2 error", 0.0, 100.0 * error, 1.5, "%", SOURCE)


def test_triangles_without_any_symmetry():
    quads = sphere_surface(1.0, 8, mirror_planes=())
    panels = np.concatenate(
        [np.column_stack((quads.panels[:, pick], np.full(len(quads.panels), -1))) for pick in SPLIT]
    )
    # turned by some angle, so that nothing falls on an axis
    turn, _ = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    triangles = Surface(quads.vertices_m @ turn.T, panels)
    assert errors(ExteriorProblem(triangles, 2.0, IMPEDANCE), receivers()).max() < 0.05


SPLIT = ([0, 1, 2], [0, 2, 3])


def test_single_precision_is_enough(fine):
    points = receivers(20)
    for surface, wave_number in ((fine, np.pi), (sphere_surface(1.0, 12), 0.2), (sphere_surface(1.0, 12), 0.01)):
        velocity = np.stack([shape(angles(surface.centres_m)) for _, shape in MOTIONS.values()], axis=1)
        single, double = (
            ExteriorProblem(surface, wave_number, IMPEDANCE, precision=precision).transfer(points, velocity)
            for precision in ("single", "double")
        )
        # 1e-3 is 0.009 dB; the worst are the quadrupoles of a sphere that is small against the wavelength
        assert (np.linalg.norm(single - double, axis=0) / np.linalg.norm(double, axis=0)).max() < 1e-3

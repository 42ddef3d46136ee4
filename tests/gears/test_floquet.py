"""Stability of a periodic motion: Meissner's and Mathieu's equations, constant coefficients, Liouville's formula."""

import math
from dataclasses import replace

import numpy as np
import pytest
from printed_equations import BondedTeeth, matrices, mesh_damping
from printed_equations import motion as printed_motion
from reference_drive import RATED_TORQUE_N_M, reference_system, single_mass
from scipy.linalg import expm
from scipy.optimize import brentq, linear_sum_assignment

from tdacoustic.gears import ContactLines
from tdacoustic.gears.floquet import floquet_multipliers, samples_of_period
from tdacoustic.gears.integration import settle

SQUARE_WAVE = ContactLines(1.5, 0.0)
"""Two pairs of teeth in one half of the period, one pair in the other."""

TWO_PI = 2.0 * np.pi


def in_contact(system, mesh_hz):
    """Teeth that touch all the time: what delta does then is of no matter."""
    pressed = 10.0 * system.half_backlash_m
    return floquet_multipliers(system, mesh_hz, np.full((1, samples_of_period(system, mesh_hz)), pressed))


def apart(found, expected):
    """Largest distance of the multipliers from their expected partners."""
    distance = np.abs(np.subtract.outer(expected, found))
    return distance[linear_sum_assignment(distance)].max()


# ------------------------------------------------------------------------------ one mass, in closed form


def meissner_matrix(system, mesh_hz):
    """Monodromy of m q'' + c q' + k(t) q = 0 with k of two pairs of teeth, then of one: two rotations, damped."""
    decay = mesh_damping(system) / (2.0 * system.equivalent_mass_kg)
    half = 0.5 / mesh_hz
    whole = np.eye(2)
    for pairs in (2.0, 1.0):
        squared = system.mesh_stiffness_n_per_m * pairs / 1.5 / system.equivalent_mass_kg
        omega = math.sqrt(squared - decay**2)
        c, s = math.cos(omega * half), math.sin(omega * half)
        part = [[c + decay / omega * s, s / omega], [-squared / omega * s, c - decay / omega * s]]
        whole = math.exp(-decay * half) * np.array(part) @ whole
    return whole


def natural_hz(system):
    return math.sqrt(system.mesh_stiffness_n_per_m / system.equivalent_mass_kg) / TWO_PI


@pytest.mark.parametrize("ratio", [0.3, 0.7, 1.0, 1.5, 2.0, 2.3, 3.5])
@pytest.mark.parametrize("damping_ratio", [0.0, 0.03])
def test_multipliers_of_meissners_equation(ratio, damping_ratio, conformance):
    system = single_mass(damping_ratio, (), SQUARE_WAVE)
    mesh_hz = ratio * natural_hz(system)
    found = in_contact(system, mesh_hz)
    assert found.shape == (14,)
    matrix = meissner_matrix(system, mesh_hz)
    trace, determinant = np.trace(matrix), np.linalg.det(matrix)
    expected = 0.5 * trace + np.array([1, -1]) * np.sqrt(complex(0.25 * trace**2 - determinant))
    # The twelve of the heavy shafts lie at 1 within their turn in a period: 1 rad/s / mesh_hz.
    pair = [found[np.argmin(np.abs(found - value))] for value in expected]
    got = (pair[0] + pair[1]).real if abs(pair[0] - pair[1]) > 1e-3 else 2.0 * pair[0].real
    what = f"trace of the monodromy at {ratio} omega_n, zeta = {damping_ratio}"
    # At most 0.3 rad a step, where the series of the exponential leaves 0.3^7/7! = 4e-8; the masses give way by 1e-7.
    conformance(
        what,
        trace,
        got,
        3e-6,
        "1",
        "analytic: Meissner's equation, a stiffness of two values: product of two transfer matrices",
    )
    # Near a double multiplier its root of that.
    assert np.abs(np.array(pair) - expected).max() < (3e-6 if abs(expected[0] - expected[1]) > 0.1 else 2e-3)


def largest(system, mesh_hz):
    """Largest multiplier of the gears; those of the heavy shafts, which stand at 1, are left out."""
    found = in_contact(system, mesh_hz)
    return np.abs(found[np.argsort(np.abs(found - 1.0))[12:]]).max()


@pytest.mark.parametrize("damping_ratio", [0.0, 0.02, 0.05])
def test_instability_near_twice_the_natural_frequency_has_meissners_limits(damping_ratio, conformance):
    system = single_mass(damping_ratio, (), SQUARE_WAVE)
    unit = natural_hz(system)

    def margin(ratio):
        # A period doubling: the multiplier -1 is passed where the trace is -(1 + determinant).
        matrix = meissner_matrix(system, ratio * unit)
        return np.trace(matrix) + 1.0 + np.linalg.det(matrix)

    # Undamped the multipliers leave the unit circle as a root: 1e-4 above 1 is reached 1e-8 further on.
    above = 1.0 + (1e-9 if damping_ratio else 1e-4)
    for side, bracket in (("lower", (1.6, 1.97)), ("upper", (1.97, 2.4))):
        exact = brentq(margin, *bracket)
        got = brentq(lambda ratio: largest(system, ratio * unit) - above, exact - 0.02, exact + 0.02, xtol=1e-9)
        what = f"{side} limit of instability over omega_n, zeta = {damping_ratio}"
        # As the multipliers; the trace changes by about 2 over a unit of the ratio.
        conformance(
            what,
            exact,
            got,
            5e-7,
            "1",
            "analytic: Meissner's equation, a stiffness of two values: product of two transfer matrices",
        )


@pytest.mark.parametrize(("lines", "damping_ratio"), [
    (ContactLines(1.5, 0.9), 0.0), (ContactLines(1.5, 0.9), 0.005), (ContactLines(1.5, 0.95), 0.0),
])  # fmt: skip
def test_weak_variation_has_mathieus_limits(lines, damping_ratio, conformance):
    # k (1 + h cos Omega t) is unstable for |Omega - 2 omega_n| < sqrt((h omega_n/2)² - (2 zeta omega_n)²).
    alpha, beta = lines.transverse_contact_ratio, lines.overlap_ratio
    h = 2.0 * abs(np.sinc(alpha) * np.sinc(beta))
    system = single_mass(damping_ratio, (), lines)
    half_width = math.sqrt(0.25 * h**2 - (2.0 * damping_ratio) ** 2)
    unit = natural_hz(system)
    limits = [
        brentq(lambda ratio: largest(system, ratio * unit) - 1.0 - 1e-6, 2.0, 2.0 + sign * 3.0 * half_width)
        for sign in (-1.0, 1.0)
    ]
    what = f"half-width of the principal instability over omega_n, h = {h:.4f}, zeta = {damping_ratio}"
    source = "literature: Mathieu's equation, Landau and Lifshitz, Mechanics, section 27"
    # The second order shifts the middle only; the width has the third, from the stiffness's other harmonics too.
    conformance(what, half_width, 0.5 * (limits[1] - limits[0]), h**3, "1", source)
    assert 0.5 * sum(limits) == pytest.approx(2.0, abs=h**2)


def test_damping_above_the_threshold_removes_the_instability():
    # h/2 < 2 zeta.
    lines = ContactLines(1.5, 0.9)
    h = 2.0 * abs(np.sinc(1.5) * np.sinc(0.9))
    for damping_ratio, unstable in ((0.23 * h, True), (0.27 * h, False)):
        system = single_mass(damping_ratio, (), lines)
        speeds = natural_hz(system) * np.linspace(1.98, 2.02, 41)
        assert any(largest(system, mesh_hz) > 1.0 for mesh_hz in speeds) == unstable


# ------------------------------------------------------------------------------ the whole drive


@pytest.mark.parametrize("mesh_hz", [100.0, 524.9, 3000.0])
def test_constant_stiffness_has_the_multipliers_of_its_eigenvalues(mesh_hz, conformance):
    system = replace(reference_system(), contact_lines=ContactLines(2.0, 0.3))
    teeth = BondedTeeth(system, mesh_hz, RATED_TORQUE_N_M)
    values = np.linalg.eigvals(teeth.matrix(system.mesh_stiffness_n_per_m))
    found = in_contact(system, mesh_hz)
    source = "independent: numpy eigenvalues of the equations, the rigid rotation taken out"
    what = f"largest distance of the 14 multipliers from exp(lambda T), {mesh_hz} Hz"
    # At most 0.3 rad a step of the fastest, where the series of the exponential leaves 4e-8.
    conformance(what, 0.0, apart(found, np.exp(values / mesh_hz)), 2e-7, "1", source)


def test_sixteen_equations_have_two_multipliers_more_and_these_are_one():
    # The Jordan block of the rigid rotation, which the reduction takes out.
    system = replace(reference_system(), contact_lines=ContactLines(2.0, 0.3))
    mass, damping, spring = matrices(system)
    v = system.direction_vector
    spring = spring + system.mesh_stiffness_n_per_m * np.outer(v, v)
    damping = damping + mesh_damping(system) * np.outer(v, v)
    below = -np.linalg.inv(mass) @ np.hstack([spring, damping])
    whole = expm(np.vstack([np.hstack([np.zeros((8, 8)), np.eye(8)]), below]) / 524.9)
    found = np.concatenate([in_contact(system, 524.9), [1.0, 1.0]])
    # A double multiplier of a Jordan block splits by the root of round-off.
    assert apart(found, np.linalg.eigvals(whole)) < 1e-5


@pytest.mark.parametrize("mesh_hz", [174.97, 524.9, 1001.3])
def test_varying_stiffness_has_the_multipliers_of_the_integrated_equations(mesh_hz):
    system = reference_system()
    exact = np.linalg.eigvals(BondedTeeth(system, mesh_hz, RATED_TORQUE_N_M).monodromy()[:, :14])
    # Each step has the mean of its stiffness: second order in steps of 1/128 period and less.
    assert apart(in_contact(system, mesh_hz), exact) < 1e-4


@pytest.mark.parametrize("mesh_hz", [174.97, 524.9, 1001.3])
def test_product_of_the_multipliers_is_what_the_dampers_say(mesh_hz):
    # Liouville: det = exp(-T sum of c/m), of the bearings and of the mesh, c_m V² / M.
    system = reference_system()
    mass, damping, _ = matrices(system)
    trace = (np.diag(damping) / np.diag(mass)).sum()
    trace += mesh_damping(system) * (system.direction_vector**2 / np.diag(mass)).sum()
    found = np.prod(in_contact(system, mesh_hz))
    assert found == pytest.approx(math.exp(-trace / mesh_hz), rel=1e-4)


SEPARATING = [
    # mesh_hz, torque in N m, error, ratio and reading of the mesh damping
    (540.0, 300.0, 8e-6, 0.05, "always"),
    (900.0, 1000.0, 20e-6, 0.2, "always"),
    (1150.0, 1000.0, 10e-6, 0.1, "always"),
    (900.0, 1000.0, 20e-6, 0.2, "contact"),
]


def phases_of(motion):
    return np.arange(motion.displacement_m.shape[1]) / motion.displacement_m.shape[1]


def period_map(system, mesh_hz, torque, state):
    """Fourteen reduced states one mesh period later, by the eight printed equations."""
    end = printed_motion(system, mesh_hz, torque, state, np.array([0.0, 1.0 / mesh_hz]))[:, -1]
    r1, r2 = system.base_radii_m
    return np.array([
        part for half in (end[:8], end[8:]) for part in (*half[:3], *half[4:7], r1 * half[3] + r2 * half[7])
    ])  # fmt: skip


@pytest.mark.parametrize("case", SEPARATING)
def test_multipliers_of_teeth_that_separate_are_those_of_the_period_map(case, conformance):
    mesh_hz, torque, error, ratio, reading = case
    system = reference_system(mesh_damping_ratio=ratio, transmission_error_m=(error,), mesh_damping=reading)
    motion = settle(system, mesh_hz, torque)
    touching = np.abs(motion.displacement_m - system.transmission_error_at(phases_of(motion))) > system.half_backlash_m
    assert motion.repeats_after == 1 and not touching.all()
    scale = np.concatenate([np.full(7, 1e-8), np.full(7, 1e-8 * TWO_PI * mesh_hz)])
    columns = []
    for column in range(14):
        step = np.zeros(14)
        step[column] = scale[column]
        ahead, behind = (period_map(system, mesh_hz, torque, motion.state + sign * step) for sign in (1, -1))
        columns.append((ahead - behind) / (2.0 * scale[column]))
    exact = np.linalg.eigvals(np.array(columns).T)
    found = floquet_multipliers(system, mesh_hz, motion.displacement_m)
    source = "independent: period map (DOP853) of equations (1) to (6) of Appl. Sci. 2025, 15, 10597"
    note = "when teeth meet and part is known between two samples, and a double multiplier feels the root of that"
    tolerance = 0.02 if reading == "always" else 0.04
    what = f"{mesh_hz} Hz, {torque} N m, damper {reading}"
    conformance(f"largest multiplier, {what}", np.abs(exact).max(), np.abs(found[0]), 0.005, "1", source)
    conformance(
        f"largest distance of the 14 multipliers, {what}", 0.0, apart(found, exact), tolerance, "1", source, note
    )


@pytest.mark.parametrize("case", SEPARATING)
def test_product_of_the_multipliers_of_teeth_that_separate(case):
    # A damper that needs contact works for part of the period; that it begins and ends changes no volume.
    mesh_hz, torque, error, ratio, reading = case
    system = reference_system(mesh_damping_ratio=ratio, transmission_error_m=(error,), mesh_damping=reading)
    motion = settle(system, mesh_hz, torque)
    gap = np.abs(motion.displacement_m - system.transmission_error_at(phases_of(motion)))
    working = 1.0 if reading == "always" else np.mean(gap > system.half_backlash_m)
    mass, damping, _ = matrices(system)
    trace = (np.diag(damping) / np.diag(mass)).sum()
    trace += working * mesh_damping(system) * (system.direction_vector**2 / np.diag(mass)).sum()
    found = np.prod(floquet_multipliers(system, mesh_hz, motion.displacement_m))
    # The part in contact is known to one of 256 samples.
    assert np.log(found.real) == pytest.approx(-trace / mesh_hz, rel=1e-6 if reading == "always" else 0.01)


def test_multipliers_come_in_descending_order():
    found = np.abs(in_contact(reference_system(), 524.9))
    assert (np.diff(found) <= 0.0).all()


def test_motion_that_repeats_after_two_periods_has_the_squares():
    system = reference_system()
    samples = samples_of_period(system, 524.9)
    one = in_contact(system, 524.9)
    two = floquet_multipliers(system, 524.9, np.full((2, samples), 1e-3))
    assert apart(two, one**2) < 1e-9

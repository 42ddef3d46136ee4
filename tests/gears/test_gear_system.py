"""The gear pair on its bearings: against the eight printed equations, written out in printed_equations.py."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from printed_equations import direction, matrices, mesh_damping, rates
from reference_drive import CENTRE_DISTANCE_M, INERTIAS_KG_M2, reference_geometry, reference_system
from scipy.linalg import eigh

from tdacoustic.errors import GearError
from tdacoustic.gears import FREEDOMS


def coupled_stiffness(system, mesh):
    """M and K of the eight equations with teeth that touch, shape (8, 8)."""
    mass, _, bearing = matrices(system)
    vector = direction(system)
    return mass, bearing + mesh * np.outer(vector, vector)


# ------------------------------------------------------------------------------ the printed equations


def test_matrices_are_the_coefficients_of_the_printed_equations():
    system = reference_system()
    system = replace(system, transmission_error_m=())
    right = rates(system, 500.0, 1000.0)
    # From teeth pressed together by 1 mm, far from the gap, a step of each state changes the rates by them.
    base = np.zeros(16)
    base[3] = 1e-3 / system.base_radii_m[0]
    mass = np.concatenate([system.mass_matrix, system.mass_matrix])
    stiffness = system.mesh_stiffness_n_per_m * float(system.contact_lines.relative(0.25))
    spring = np.diag(system.stiffness_matrix) + stiffness * np.outer(system.direction_vector, system.direction_vector)
    damping = np.diag(system.damping_matrix)
    damping += system.mesh_damping_n_s_per_m * np.outer(system.direction_vector, system.direction_vector)
    for column in range(16):
        step = np.zeros(16)
        step[column] = 1e-6
        changed = (np.array(right(0.25 / 500.0, base + step)) - right(0.25 / 500.0, base))[8:] / 1e-6
        expected = -(spring if column < 8 else damping)[:, column % 8] / mass[:8]
        assert changed == pytest.approx(expected, rel=1e-6, abs=1e-6 * np.abs(expected).max())


def test_rigid_rotation_of_the_whole_pair_leaves_the_teeth_alone():
    # Both gears turned about the pinion's centre, the wheel's centre carried along by a.
    system, a = reference_system(4.0), reference_geometry(4.0).centre_distance_m
    turn = dict.fromkeys(FREEDOMS, 0.0) | {"theta1": 1.0, "y2": a, "theta2": 1.0}
    # The moments cancel to round-off of 0.495 m only at the working pressure angle.
    assert system.direction_vector @ list(turn.values()) == pytest.approx(0.0, abs=1e-15)
    assert a == pytest.approx(CENTRE_DISTANCE_M, abs=1e-6)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_moving_both_gears_together_leaves_the_teeth_alone(axis):
    vector = reference_system().direction_vector
    assert vector[axis] + vector[axis + 4] == 0.0


def test_mesh_force_is_a_unit_vector_on_a_lever_of_the_base_radius():
    system = reference_system(12.0)
    for gear in (0, 1):
        force, moment = system.direction_vector[4 * gear : 4 * gear + 3], system.direction_vector[4 * gear + 3]
        assert np.linalg.norm(force) == pytest.approx(1.0, abs=1e-15)
        assert moment == pytest.approx(system.base_radii_m[gear] * np.hypot(*force[:2]), rel=1e-14)


def test_tangential_part_is_the_largest():
    # Paper, section 4.2: the y direction has the largest force.
    x, y, z = np.abs(reference_system().direction_vector[:3])
    assert y > x > z


# ------------------------------------------------------------------------------ free vibration


@pytest.mark.parametrize("helix_deg", [0.1, None, 12.0])
def test_natural_frequencies_are_those_of_the_eigenproblem_of_the_equations(helix_deg, conformance):
    system = reference_system(helix_deg)
    mass, spring = coupled_stiffness(system, system.mesh_stiffness_n_per_m)
    expected = np.sqrt(np.abs(eigh(spring, mass, eigvals_only=True))) / (2.0 * np.pi)
    found = system.natural_frequencies_hz()
    assert found.shape == (8,)
    for number, (hand, ours) in enumerate(zip(expected[1:], found[1:], strict=True), 1):
        source = "independent: scipy eigh of equations (1) to (6) of Appl. Sci. 2025, 15, 10597"
        conformance(f"natural frequency {number}, helix {helix_deg or 4.0} deg", hand, ours, 1e-9 * hand, "Hz", source)


def test_only_the_rolling_rotation_is_free():
    system = reference_system()
    found = system.natural_frequencies_hz()
    # Round-off of the squares, 1e-16 of 2 kHz squared, leaves 2e-5 Hz.
    assert found[0] < 1e-4
    assert found[1] > 100.0
    mass, spring = coupled_stiffness(system, system.mesh_stiffness_n_per_m)
    r1, r2 = system.base_radii_m
    rolling = np.array([0, 0, 0, r2, 0, 0, 0, -r1])
    assert np.abs(spring @ rolling).max() <= 1e-15 * np.abs(spring).max()
    shape = eigh(spring, mass)[1][:, 0]
    assert shape / shape[3] == pytest.approx(rolling / rolling[3], abs=1e-6)


def test_without_a_mesh_the_bearings_alone_are_left():
    system = reference_system()
    found = system.natural_frequencies_hz(0.0)
    assert found[:2] == pytest.approx(0.0, abs=1e-9)
    mass, _, bearing = matrices(system)
    alone = np.sqrt(np.diag(bearing) / np.diag(mass)) / (2.0 * np.pi)
    assert found == pytest.approx(np.sort(alone), rel=1e-12, abs=1e-9)


def test_reduced_coordinates_keep_all_vibrations():
    system = reference_system()
    reduced = system.reduced
    spring = np.diag(reduced.stiffness) + system.mesh_stiffness_n_per_m * np.outer(reduced.direction, reduced.direction)
    squares = eigh(spring, np.diag(reduced.masses), eigvals_only=True)
    assert np.sqrt(squares) / (2.0 * np.pi) == pytest.approx(system.natural_frequencies_hz()[1:], rel=1e-9)


def test_fastest_is_the_highest_with_the_mesh_at_its_stiffest():
    system = reference_system()
    peak = max(system.contact_lines.relative(np.linspace(0.0, 1.0, 4001)))
    mass, spring = coupled_stiffness(system, peak * system.mesh_stiffness_n_per_m)
    expected = math.sqrt(eigh(spring, mass, eigvals_only=True)[-1]) / (2.0 * math.pi)
    # 65 points of a period may pass by the very peak of a trapezoid's sum.
    assert system.fastest_hz == pytest.approx(expected, rel=5e-3)


@given(st.floats(0.1, 10.0), st.floats(0.1, 10.0))
def test_two_masses_on_a_spring(first, second):
    # Bearings so stiff and heavy that the gears only turn: omega² = k cos²(beta_b) (r1²/J1 + r2²/J2).
    inertias = (first * INERTIAS_KG_M2[0], second * INERTIAS_KG_M2[1])
    system = replace(reference_system(), masses_kg=(1e12, 1e12), inertias_kg_m2=inertias)
    (r1, r2), k = system.base_radii_m, system.mesh_stiffness_n_per_m
    squared = k * math.cos(system.base_helix_angle_rad) ** 2 * (r1**2 / inertias[0] + r2**2 / inertias[1])
    # The masses give way by m_e over 1e12 kg.
    assert system.natural_frequencies_hz()[-1] == pytest.approx(math.sqrt(squared) / (2.0 * math.pi), rel=1e-9)


# ------------------------------------------------------------------------------ forced vibration


@pytest.mark.parametrize("frequency_hz", [1.0, 190.0, 525.0, 1001.3, 5000.0])
def test_receptance_is_the_solution_of_the_eight_equations(frequency_hz):
    system = reference_system()
    mass, damping, spring = matrices(system)
    omega = 2.0 * np.pi * frequency_hz
    vector = direction(system)
    # A mesh force of 1 N: (K - omega² M + i omega C) x = -V, delta = V x = -H.
    x = np.linalg.solve(spring - omega**2 * mass + 1j * omega * damping, -vector)
    found = system.receptance_m_per_n(frequency_hz)
    assert found == pytest.approx(-(vector @ x), rel=1e-12)
    impedance = system.dynamic_stiffness(frequency_hz)
    assert -vector / impedance == pytest.approx(x, rel=1e-12)


def test_receptance_takes_arrays_and_the_power_flows_in():
    system = reference_system()
    frequency = np.geomspace(1.0, 1e4, 400).reshape(20, 20)
    found = system.receptance_m_per_n(frequency)
    assert found.shape == (20, 20)
    # delta = -H F: a force takes power from what it moves, so Im H < 0 at all frequencies.
    assert (found.imag < 0.0).all()


def test_response_of_the_reduced_coordinates_has_the_receptance():
    system = reference_system()
    frequency, forces = np.array([300.0, 600.0]), np.array([2.0 + 1.0j, -0.5j])
    motion = system.reduced.response(forces, frequency)
    expected = -system.receptance_m_per_n(frequency) * forces
    assert motion @ system.reduced.direction == pytest.approx(expected, rel=1e-12)


def test_mesh_force_does_to_both_gears_the_work_that_the_teeth_store():
    # Generalised force -V F on velocities x': power -F V x' = -F delta', whatever the motion.
    system = reference_system()
    rng = np.random.default_rng(1)
    velocity, force = rng.normal(size=(8, 50)), rng.normal(size=50)
    power = ((-system.direction_vector[:, None] * force) * velocity).sum(axis=0)
    assert power == pytest.approx(-force * (direction(system) @ velocity), rel=1e-12)


def test_mesh_damping_and_equivalent_mass_are_those_of_the_rotation():
    system = reference_system(mesh_damping_ratio=0.07)
    assert system.mesh_damping_n_s_per_m == pytest.approx(mesh_damping(system), rel=1e-13)
    (j1, j2), (r1, r2) = system.inertias_kg_m2, system.base_radii_m
    assert 1.0 / system.equivalent_mass_kg == pytest.approx(r1**2 / j1 + r2**2 / j2, rel=1e-14)


def test_mean_force_balances_the_torque():
    system = reference_system()
    force = system.mean_force_n(5913.0)
    assert system.direction_vector[3] * force == pytest.approx(5913.0, rel=1e-14)
    assert system.mean_force_n(-5913.0) == -force


# ------------------------------------------------------------------------------ transmission error


@given(st.lists(st.floats(-2e-6, 2e-6), min_size=1, max_size=6), st.floats(-3.0, 3.0))
def test_transmission_error_is_a_sum_of_sines(amplitudes, time):
    system = reference_system(transmission_error_m=tuple(amplitudes))
    expected = sum(size * math.sin(2.0 * math.pi * n * time) for n, size in enumerate(amplitudes, 1))
    assert float(system.transmission_error_at(np.array(time))) == pytest.approx(expected, abs=1e-20)
    series = system.transmission_error_fourier(8)
    assert series.size == 9
    waves = np.exp(2.0j * np.pi * time * np.arange(1, 9))
    assert series[0].real + 2.0 * (series[1:] @ waves).real == pytest.approx(expected, abs=1e-18)


def test_peak_to_peak_of_the_transmission_error():
    assert reference_system().transmission_error_pp_m == pytest.approx(10e-6, rel=1e-12)
    assert reference_system(transmission_error_m=()).transmission_error_pp_m == 0.0
    two = reference_system(transmission_error_m=(4e-6, 0.0, 2e-6))
    x = np.linspace(0.0, 2.0 * np.pi, 200_001)
    fine = np.ptp(4e-6 * np.sin(x) + 2e-6 * np.sin(3.0 * x))
    # 256 points a period see a third harmonic's peak to 1 - cos(3 pi/256).
    assert two.transmission_error_pp_m == pytest.approx(fine, rel=7e-4)


# ------------------------------------------------------------------------------ refusals


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"masses_kg": (0.0, 280.0)}, r"masses_kg must be > 0, got \(0\.0, 280\.0\)"),
        ({"inertias_kg_m2": (0.35, -1.0)}, r"inertias_kg_m2 must be > 0, got \(0\.35, -1\.0\)"),
        ({"base_radii_m": (math.nan, 0.36)}, "base_radii_m must be > 0, got .nan"),
        ({"bearing_stiffness_n_per_m": (1e9, 1e9, 3e8, -1.2e9, 1.2e9, 4e8)}, "bearing_stiffness_n_per_m must be > 0"),
        ({"bearing_stiffness_n_per_m": (1e9, 1e9, 0.0, 1.2e9, 1.2e9, 4e8)}, "bearing_stiffness_n_per_m must be > 0"),
        (
            {"bearing_damping_n_s_per_m": (0, 0, 0, -1e3, 0, 0)},
            r"bearing_damping_n_s_per_m must be >= 0, got \(0, 0, 0",
        ),
        ({"mesh_stiffness_n_per_m": -2e9}, r"mesh_stiffness_n_per_m must be > 0, got -2000000000\.0"),
        ({"mesh_stiffness_n_per_m": math.inf}, "mesh_stiffness_n_per_m must be > 0, got inf"),
        ({"mesh_damping_ratio": 1.2}, r"mesh_damping_ratio must be from 0 to 1, got 1\.2"),
        ({"mesh_damping_ratio": -0.1}, r"mesh_damping_ratio must be from 0 to 1, got -0\.1"),
        ({"half_backlash_m": -1e-6}, "half_backlash_m must be >= 0, got -1e-06"),
        (
            {"half_backlash_m": 4e-6},
            "transmission error, 10 um peak to peak, is larger than the backlash of 8 um: .* jam",
        ),
        ({"transmission_error_m": (110e-6,)}, "transmission error, 220 um peak to peak, is larger than .* 200 um"),
    ],
)
def test_impossible_system_is_refused_with_the_value(change, message):
    with pytest.raises(GearError, match=message):
        replace(reference_system(), **change)


def test_transmission_error_may_just_fill_the_backlash():
    system = replace(reference_system(), half_backlash_m=5.001e-6)
    assert system.half_backlash_m == 5.001e-6

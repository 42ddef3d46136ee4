"""Forces on the bearings: statics, the eight equations, their time history by scipy, and the paper's sampling."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from printed_equations import direction, matrices, mesh_damping, motion
from reference_drive import RATED_TORQUE_N_M, reference_system

from tdacoustic.errors import GearError
from tdacoustic.gears import ContactLines, bearing_forces, sampling_points, steady_state

PRINTED = "equations (1) to (6) of Appl. Sci. 2025, 15, 10597"

TWO_PI = 2.0 * np.pi
PLACES = [[0, 1, 2], [4, 5, 6]]


@pytest.fixture(scope="module")
def rated():
    """Condition 5 of the paper at the rated torque."""
    return at()[2]


def at(mesh_hz=524.9, torque=RATED_TORQUE_N_M, **change):
    system = reference_system(**change)
    state = steady_state(system, mesh_hz, torque)
    return system, state, bearing_forces(system, state)


# ------------------------------------------------------------------------------ means


@pytest.mark.parametrize("torque", [RATED_TORQUE_N_M, -1500.0])
def test_mean_forces_balance_the_torque(torque, conformance):
    system, _, found = at(torque=torque)
    # Statics: the tooth force T/r_b1 in the transverse plane, at the pressure angle to the tangent, and its axial part.
    transverse = torque / system.base_radii_m[0]
    psi, helix = system.pressure_angle_rad, system.base_helix_angle_rad
    expected = [transverse * math.sin(psi), transverse * math.cos(psi), transverse * math.tan(helix)]
    for name, hand, pinion, wheel in zip("xyz", expected, *found.mean_n, strict=True):
        source = "analytic: statics of the tooth force"
        # The shaft of the pinion presses against the generalised force -V F.
        conformance(f"mean bearing force {name}, {torque} N m", -hand, pinion, 1e-9 * abs(hand), "N", source)
        assert wheel == -pinion


def test_mean_forces_at_the_pitch_circle():
    # The textbook's tangential force T/r_w on the working pitch circle, radial force times tan alpha_wt.
    system, _, found = at()
    pitch_radius = system.base_radii_m[0] / math.cos(system.pressure_angle_rad)
    x, y, _ = found.mean_n[0]
    assert y == pytest.approx(-RATED_TORQUE_N_M / pitch_radius, rel=1e-12)
    assert x / y == pytest.approx(math.tan(system.pressure_angle_rad), rel=1e-12)


# ------------------------------------------------------------------------------ lines


def test_forces_under_a_sine_of_error_are_those_of_the_eight_equations(conformance):
    # Constant stiffness: (K - omega² M + i omega C + (k + i omega c) V V^T) x = V k e, force (K + i omega C) x.
    system = replace(reference_system(transmission_error_m=(4e-6, 2e-6)), contact_lines=ContactLines(2.0, 0.3))
    found = bearing_forces(system, steady_state(system, 524.9, RATED_TORQUE_N_M))
    mass, damping, spring = matrices(system)
    v, k = direction(system), system.mesh_stiffness_n_per_m
    for line, amplitude in enumerate(system.transmission_error_m):
        omega = TWO_PI * 524.9 * (line + 1)
        coupled = spring - omega**2 * mass + 1j * omega * damping
        coupled = coupled + (k + 1j * omega * mesh_damping(system)) * np.outer(v, v)
        x = np.linalg.solve(coupled, v * k * (-1j * amplitude))
        force = (spring + 1j * omega * damping) @ x
        for gear, place in enumerate(PLACES):
            for name, hand, got in zip("xyz", force[place], found.amplitude_n[gear, :, line], strict=True):
                what = f"bearing force {name} of gear {gear + 1} at harmonic {line + 1}"
                source = f"independent: direct solution of {PRINTED}"
                conformance(what, abs(hand), abs(got), 1e-8 * abs(hand), "N", source)
                assert got == pytest.approx(hand, rel=1e-8)


@pytest.mark.parametrize(("mesh_hz", "torque", "error"), [(524.9, RATED_TORQUE_N_M, 5e-6), (540.0, 300.0, 8e-6)])
def test_lines_are_the_spectrum_of_the_forces_in_time(mesh_hz, torque, error, conformance):
    system, state, found = at(mesh_hz, torque, transmission_error_m=(error,))
    assert state.method == "harmonic_balance"
    samples = 1024
    times = np.arange(samples) / samples / mesh_hz
    states = motion(system, mesh_hz, torque, state.state, times)
    _, damping, spring = matrices(system)
    force = spring @ states[:8] + damping @ states[8:]
    spectrum = 2.0 * np.fft.rfft(force, norm="forward")[:, 1:13]
    largest = np.abs(spectrum[[0, 1, 2, 4, 5, 6]]).max()
    # A motion in contact starts 1e-5 of its swing beside the periodic one, one that separates 5e-4.
    tolerance = 2e-5 if error == 5e-6 else 5e-4
    for gear, place in enumerate(PLACES):
        difference = np.abs(found.amplitude_n[gear, :, :12] - spectrum[place]).max() / largest
        what = f"largest difference of bearing force lines of gear {gear + 1}, {mesh_hz} Hz, {torque} N m"
        source = f"independent: spectrum of K x + C x' by scipy DOP853 of {PRINTED}"
        conformance(what, 0.0, difference, tolerance, "1", source)
        assert force[place].mean(axis=1) == pytest.approx(found.mean_n[gear], rel=5e-3)


def test_forces_of_slow_motion_are_opposite_on_both_gears():
    # Far below the bearings' 190 Hz the mesh force passes through: each bearing carries its part of V F.
    system, state, found = at(mesh_hz=10.0)
    low = found.frequency_hz < 15.0
    expected = -direction(system)[PLACES[0]][:, None] * state.lines.force_n[low]
    # (10/356)² of the softest bearing, and its damping.
    assert np.abs(found.amplitude_n[0][:, low] - expected).max() < 6e-3 * np.abs(expected).max()
    assert np.abs(found.amplitude_n[1][:, low] + expected).max() < 6e-3 * np.abs(expected).max()


def test_tangential_force_is_the_largest_as_in_the_paper():
    # Fig. 10: y is the largest of the three directions, on both gears, in every condition.
    for mesh_hz in (174.97, 262.45, 349.94, 437.42, 524.9, 1001.0):
        _, _, found = at(mesh_hz)
        x, y, _ = np.abs(found.mean_n).T
        assert (y > x).all()
        assert (found.rms_n()[:, 1] > found.rms_n()[:, 0]).all()


def test_rms_is_that_of_the_time_history():
    _, _, found = at()
    times = np.arange(4096) / 4096 / 524.9
    waves = np.exp(1j * TWO_PI * np.outer(found.frequency_hz, times))
    history = (found.amplitude_n @ waves).real
    assert found.rms_n() == pytest.approx(np.sqrt((history**2).mean(axis=-1)), rel=1e-9)


def test_gear_at_rest_presses_on_nothing():
    _, state, found = at(torque=0.0)
    assert state.method == "at_rest"
    assert found.amplitude_n.shape == (2, 3, 0)
    assert (found.mean_n == 0.0).all() and (found.rms_n() == 0.0).all()
    assert (found.sampled_n([100.0, 200.0]) == 0.0).all()


def test_doubled_period_has_lines_between_the_harmonics():
    _, state, found = at(525.0, 300.0, transmission_error_m=(8e-6,))
    assert state.repeats_after == 2
    half = np.flatnonzero(np.isnan(found.harmonic))
    assert found.frequency_hz[half] / 525.0 % 1.0 == pytest.approx(0.5)
    assert np.abs(found.amplitude_n[:, :, half]).max() > 0.05 * np.abs(found.amplitude_n).max()
    points = sampling_points(525.0, 2100.0, between=1)
    assert (found.sampled_n(points)[:, :, ::2] > 0.0).all()


# ------------------------------------------------------------------------------ the paper's sampling points


def test_periodic_motion_has_nothing_between_its_harmonics():
    _, state, found = at()
    assert state.is_periodic
    points = sampling_points(524.9, 5.0 * 524.9, between=3)
    sampled = found.sampled_n(points)
    harmonic = np.arange(1, points.size + 1) % 4 == 0
    assert (sampled[:, :, ~harmonic] == 0.0).all()
    assert sampled[:, :, harmonic] == pytest.approx(np.abs(found.amplitude_n[:, :, :5]), rel=1e-12)


@given(st.integers(0, 7), st.floats(0.9, 1.1), st.integers(3, 12))
def test_sampling_keeps_the_energy_of_the_lines(rated, between, shift, harmonics):
    found = rated
    points = shift * sampling_points(524.9, harmonics * 524.9, between)
    sampled = found.sampled_n(points)
    # From half a step below the first point to half a step above the last.
    step = points[1] - points[0]
    inside = (found.frequency_hz >= points[0] - 0.5 * step) & (found.frequency_hz < points[-1] + 0.5 * step)
    kept = (np.abs(found.amplitude_n[:, :, inside]) ** 2).sum(axis=-1)
    assert (sampled**2).sum(axis=-1) == pytest.approx(kept, rel=1e-12)


def test_unequal_points_stand_for_the_band_up_to_half_way():
    _, _, found = at()
    first, second, third = found.frequency_hz[:3]
    # 600 Hz stands for what lies below 900 Hz: one line; 1200 Hz for 900 to 2 x 1200 - 900 = 1500 Hz.
    sampled = found.sampled_n([600.0, 1200.0])
    assert (first, second) == pytest.approx((524.9, 1049.8)) and third > 1500.0
    assert sampled == pytest.approx(np.abs(found.amplitude_n[:, :, :2]), rel=1e-12)


def test_sampling_points_are_harmonics_and_points_between():
    assert sampling_points(500.0, 1999.0, between=0) == pytest.approx([500.0, 1000.0, 1500.0])
    points = sampling_points(524.9, 1049.8, between=3)
    assert points == pytest.approx(524.9 / 4 * np.arange(1, 9))


@pytest.mark.parametrize(("points", "count"), [([500.0], 1), ([500.0, 400.0], 2), ([500.0, 500.0], 2)])
def test_points_that_do_not_ascend_are_refused(rated, points, count):
    with pytest.raises(GearError, match=f"sampling points must ascend and be at least two, got {count}"):
        rated.sampled_n(points)

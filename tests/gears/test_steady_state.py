"""What the gears do at a speed and torque: which motion, found how, whether it is stable, and what else could be."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from printed_equations import direction, motion
from reference_drive import RATED_TORQUE_N_M, reference_system

from tdacoustic.errors import GearError
from tdacoustic.gears import branch_of_sweep, coexisting, steady_state

DOUBLING = 525.0, 300.0, 8e-6
"""Mesh frequency in Hz, torque in N m, amplitude of the transmission error in m."""


def by_scipy(system, mesh_hz, torque, state, periods, samples=256):
    """Displacement along the line of action over mesh periods from a state, shape (periods, samples)."""
    found = motion(system, mesh_hz, torque, state, np.arange(periods * samples) / samples / mesh_hz)
    return (direction(system) @ found[:8]).reshape(periods, samples)


# ------------------------------------------------------------------------------ no torque, little torque, its sign


def test_without_torque_the_teeth_rest():
    found = steady_state(reference_system(), 524.9, 0.0)
    assert found.method == "at_rest"
    assert found.repeats_after == 1 and found.is_periodic and not found.separates
    assert (found.dte_pp_m, found.mean_force_n, found.contact_part) == (0.0, 0.0, 0.0)
    # Wherever in the gap they stand, they stay.
    assert found.floquet_max == 1.0
    assert found.lines.frequency_hz.size == 0
    assert not found.waveform_m.any() and not found.state.any()


@pytest.mark.parametrize("torque", [1e-9, 1e-3, 0.5, -0.5])
@pytest.mark.parametrize("mesh_hz", [262.45, 1001.3])
def test_hardly_any_torque_is_a_case(torque, mesh_hz):
    system = reference_system()
    found = steady_state(system, mesh_hz, torque, most_periods=100)
    assert math.isfinite(found.dte_pp_m) and np.isfinite(found.state).all()
    # The teeth fly nearly all the time and stay in their gap, which the error makes narrower or wider by 10 um.
    assert found.contact_part < 0.1
    assert np.abs(found.waveform_m).max() < system.half_backlash_m + 20e-6


def test_other_sense_of_the_torque_presses_the_other_flanks():
    system = reference_system()
    found, turned = (steady_state(system, 524.9, sign * RATED_TORQUE_N_M) for sign in (1.0, -1.0))
    assert found.mean_displacement_m > system.half_backlash_m and turned.mean_displacement_m < -system.half_backlash_m
    assert turned.mean_force_n == pytest.approx(-found.mean_force_n, rel=1e-12)
    assert turned.static_compression_m == pytest.approx(-found.static_compression_m, rel=1e-12)
    # Not mirrored: the error keeps its sign against the stiffness. Without an error they are.
    plain = reference_system(transmission_error_m=())
    first, second = (steady_state(plain, 524.9, sign * RATED_TORQUE_N_M) for sign in (1.0, -1.0))
    assert second.dte_pp_m == pytest.approx(first.dte_pp_m, rel=1e-12)
    assert turned.dte_pp_m != pytest.approx(found.dte_pp_m, rel=1e-3)


def test_mean_force_is_that_of_the_torque():
    system = reference_system()
    expected = RATED_TORQUE_N_M / (system.base_radii_m[0] * math.cos(system.base_helix_angle_rad))
    found = steady_state(system, 524.9, RATED_TORQUE_N_M)
    assert found.mean_force_n == pytest.approx(expected, rel=1e-12)
    assert found.static_compression_m == pytest.approx(expected / system.mesh_stiffness_n_per_m, rel=1e-12)


# ------------------------------------------------------------------------------ motions that repeat each period


@pytest.mark.parametrize(
    ("mesh_hz", "torque", "error", "tolerance"),
    [
        # The harmonics left out are 3e-5, twice over; with separation the balance's sampling adds 5e-4.
        (174.97, RATED_TORQUE_N_M, 5e-6, 1e-4),
        (524.9, RATED_TORQUE_N_M, 5e-6, 1e-4),
        (1001.3, RATED_TORQUE_N_M, 5e-6, 1e-4),
        (524.9, -RATED_TORQUE_N_M, 5e-6, 1e-4),
        (540.0, 300.0, 8e-6, 2e-3),
    ],
)
def test_periodic_motion_is_a_fixed_point_of_the_printed_equations(mesh_hz, torque, error, tolerance, conformance):
    system = reference_system(transmission_error_m=(error,))
    found = steady_state(system, mesh_hz, torque)
    assert found.method == "harmonic_balance"
    delta = by_scipy(system, mesh_hz, torque, found.state, 2)
    swing = np.ptp(delta)
    source = "independent: scipy DOP853 of equations (1) to (6) of Appl. Sci. 2025, 15, 10597"
    what = f"{mesh_hz} Hz, {torque} N m, error {1e6 * error:g} um"
    repeats = np.abs(delta[1] - delta[0]).max() / swing
    conformance(f"change of delta after a period over its peak to peak, {what}", 0.0, repeats, tolerance, "1", source)
    own = np.abs(found.waveform_m[0, ::2] - delta[0]).max() / swing
    conformance(f"waveform over its peak to peak, {what}", 0.0, own, tolerance, "1", source)
    assert found.dte_pp_m == pytest.approx(swing, rel=5e-3)


@settings(max_examples=60, deadline=None)
@given(
    st.floats(80.0, 1500.0),
    st.sampled_from([-1.0, 1.0]),
    st.floats(2.0, 4.0),
    st.floats(0.5e-6, 15e-6),
    st.floats(0.02, 0.2),
    st.sampled_from([0.1, 4.0, 8.0, 12.0]),
    st.sampled_from(["always", "contact"]),
)
def test_periodic_result_of_the_balance_is_converged_and_stable(
    mesh_hz, sign, lg_torque, error, damping, helix, reading
):
    system = reference_system(helix, damping, (error,), reading)
    found = steady_state(system, mesh_hz, sign * 10.0**lg_torque, most_periods=100)
    assert found.dte_pp_m > 0.0
    assert math.copysign(1.0, found.mean_displacement_m) == sign or found.separates
    if found.method == "harmonic_balance":
        assert found.repeats_after == 1
        assert found.floquet_max <= 1.0 + 1e-6
        assert found.residual <= 1e-10
        assert found.mean_force_n == pytest.approx(system.mean_force_n(sign * 10.0**lg_torque), rel=1e-8)
    else:
        assert found.method == "time_integration"
        assert math.isnan(found.residual)
        # Stable or unknown for the motion itself; beyond 1 of one that repeats each period and that gears leave.
        assert found.repeats_after != 1 or found.separates


def test_lines_are_the_series_of_the_force():
    system = reference_system()
    found = steady_state(system, 524.9, RATED_TORQUE_N_M)
    times = np.arange(512) / 512
    waves = np.exp(2.0j * np.pi * np.outer(found.lines.harmonic, times))
    force = found.mean_force_n + (found.lines.force_n @ waves).real
    speed = np.gradient(np.tile(found.waveform_m[0], 3), 1.0 / 512 / 524.9)[512:1024]
    stiffness = system.mesh_stiffness_n_per_m * system.contact_lines.relative(times)
    compression = found.waveform_m[0] - system.half_backlash_m - system.transmission_error_at(times)
    expected = stiffness * compression + system.mesh_damping_n_s_per_m * speed
    # Harmonics of the force fall as 1/k²: beyond the last of 32 the kinks miss 1/(pi² 32) of their steps in slope.
    assert np.abs(force - expected).max() < 2e-2 * np.ptp(expected)
    assert np.sqrt(np.mean((force - expected) ** 2)) < 2e-3 * np.ptp(expected)


# ------------------------------------------------------------------------------ motions that do not


def test_period_doubling_is_found(conformance):
    mesh_hz, torque, error = DOUBLING
    system = reference_system(transmission_error_m=(error,))
    found = steady_state(system, mesh_hz, torque)
    assert found.method == "time_integration"
    assert found.repeats_after == 2 and not found.is_periodic and found.separates
    # The motion that repeats each period exists and is unstable.
    assert found.floquet_max > 1.0
    assert found.waveform_m.shape[0] == 2
    delta = by_scipy(system, mesh_hz, torque, found.state, 4)
    swing = np.ptp(delta)
    # Integrated from the same state by another method it is as far from its last period, and back after two.
    assert np.abs(delta[1] - delta[0]).max() > 0.1 * swing
    source = "independent: scipy DOP853 of equations (1) to (6) of Appl. Sci. 2025, 15, 10597"
    twice = np.abs(delta[2:] - delta[:2]).max() / swing
    conformance("change of a doubled motion after two periods over its peak to peak", 0.0, twice, 2e-4, "1", source)
    conformance(
        "peak to peak of the doubled motion", 1e6 * swing, 1e6 * found.dte_pp_m, 1e-3 * 1e6 * swing, "um", source
    )


def test_doubling_with_a_damper_that_needs_contact_is_found():
    # Where teeth meet and part the damper's force steps: left out of the multipliers, that makes the motion that
    # repeats each period look stable here (0.81; with it 1.24).
    system = reference_system(None, 0.12, (12e-6,), "contact", 0.1)
    found = steady_state(system, 560.0, 480.0)
    delta = by_scipy(system, 560.0, 480.0, found.state, 40)
    swing = np.ptp(delta)
    # Whatever was found: by the printed equations the gears end in two different periods by turns.
    assert np.abs(delta[-1] - delta[-2]).max() > 0.1 * swing
    assert np.abs(delta[-1] - delta[-3]).max() < 1e-3 * swing
    assert found.repeats_after == 2
    assert not found.is_periodic
    assert found.dte_pp_m == pytest.approx(swing, rel=2e-3)


def test_lines_of_a_doubled_motion_lie_at_halves():
    mesh_hz, torque, error = DOUBLING
    found = steady_state(reference_system(transmission_error_m=(error,)), mesh_hz, torque)
    assert found.lines.frequency_hz[:4] == pytest.approx(mesh_hz * np.array([0.5, 1.0, 1.5, 2.0]))
    assert np.isnan(found.lines.harmonic[[0, 2]]).all()
    assert found.lines.harmonic[[1, 3]] == pytest.approx([1.0, 2.0])
    assert found.contact_part < 0.5


def test_motion_without_a_period_says_so():
    found = steady_state(reference_system(), 525.0, 300.0, most_periods=400)
    assert found.method == "time_integration"
    assert found.repeats_after is None and not found.is_periodic
    assert math.isnan(found.residual)
    # Its lines still hold the mesh harmonics.
    assert {1.0, 2.0, 3.0} <= set(found.lines.harmonic.tolist())


# ------------------------------------------------------------------------------ sweeps


SPEEDS = np.arange(1100.0, 1331.0, 10.0)


def sweeps(system, torque, speeds):
    torques = [torque] * len(speeds)
    return branch_of_sweep(system, speeds, torques), branch_of_sweep(system, speeds[::-1], torques)


def test_sweeps_up_and_down_find_coexisting_motions():
    system = reference_system(transmission_error_m=(10e-6,))
    up, down = sweeps(system, 1500.0, SPEEDS)
    found = SPEEDS[coexisting(up, down)]
    # Of one piece, and in the range where a prototype had found it: 1135 to 1300 Hz.
    assert np.diff(found) == pytest.approx(10.0)
    assert found[0] <= 1140.0 and found[-1] >= 1300.0
    assert found[0] > SPEEDS[0] and found[-1] < SPEEDS[-1]
    # Teeth separate on the way down, from the softened resonance, and stay in contact on the way up.
    at = list(SPEEDS).index(1200.0)
    assert up.contact_part[at] == 1.0 and down.contact_part[::-1][at] < 1.0
    assert (up.floquet_max <= 1.0).all() and (down.floquet_max <= 1.0).all()


def test_both_coexisting_motions_are_motions_of_the_printed_equations(conformance):
    system, torque = reference_system(transmission_error_m=(10e-6,)), 1500.0
    for name, speeds in (("up", np.arange(1120.0, 1201.0, 10.0)), ("down", np.arange(1350.0, 1199.0, -10.0))):
        state = None
        for mesh_hz in speeds:
            state = steady_state(system, mesh_hz, torque, state)
        delta = by_scipy(system, 1200.0, torque, state.state, 10)
        swing = np.ptp(delta[0])
        assert swing == pytest.approx(state.dte_pp_m, rel=5e-3)
        source = "independent: scipy DOP853 of equations (1) to (6) of Appl. Sci. 2025, 15, 10597"
        # Ten periods on it is still the same motion: stable.
        drift = np.abs(delta[-1] - delta[0]).max() / swing
        conformance(f"drift over ten periods of the motion found on the way {name}", 0.0, drift, 1e-4, "1", source)


def test_reference_drive_at_rated_torque_has_one_motion_only():
    speeds = np.arange(150.0, 1401.0, 25.0)
    up, down = sweeps(reference_system(), RATED_TORQUE_N_M, speeds)
    assert not coexisting(up, down).any()
    assert set(up.method) == {"harmonic_balance"} and (up.contact_part == 1.0).all()


def test_branch_tells_what_it_passed():
    seen = []
    torques = [5000.0, 4000.0, 0.0, 3000.0]
    found = branch_of_sweep(reference_system(), [400.0, 410.0, 420.0, 430.0], torques, seen.append)
    assert seen == [1, 2, 3, 4]
    assert found.mesh_hz == pytest.approx([400.0, 410.0, 420.0, 430.0]) and found.torque_n_m == pytest.approx(torques)
    assert found.method == ("harmonic_balance", "harmonic_balance", "at_rest", "harmonic_balance")
    assert found.repeats_after == (1, 1, 1, 1)
    alone = steady_state(reference_system(), 430.0, 3000.0)
    assert found.dte_pp_m[-1] == pytest.approx(alone.dte_pp_m, rel=1e-9)
    with pytest.raises(ValueError, match="zip"):
        branch_of_sweep(reference_system(), [400.0, 410.0], [5000.0])


def test_motions_that_do_not_repeat_are_compared_with_nothing():
    system = reference_system()
    up, down = sweeps(system, 300.0, np.array([515.0, 520.0, 525.0]))
    assert 0 in up.repeats_after + down.repeats_after
    for index, differs in enumerate(coexisting(up, down)):
        if not (up.repeats_after[index] and down.repeats_after[2 - index]):
            assert not differs


# ------------------------------------------------------------------------------ refusals


@pytest.mark.parametrize("mesh_hz", [0.0, -500.0, math.nan, math.inf])
def test_speed_that_is_none_is_refused(mesh_hz):
    with pytest.raises(GearError, match=r"mesh frequency must be > 0 Hz, got"):
        steady_state(reference_system(), mesh_hz, 1000.0)


@pytest.mark.parametrize("torque", [math.nan, math.inf])
def test_torque_that_is_no_number_is_refused(torque):
    with pytest.raises(GearError, match=r"torque must be a number, got"):
        steady_state(reference_system(), 500.0, torque)

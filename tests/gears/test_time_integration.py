"""The equations integrated in time: its order, energy kept, and the eight printed equations by scipy."""

from dataclasses import replace

import numpy as np
import pytest
from printed_equations import BondedTeeth, direction, eight_of_seven, matrices, motion, rates
from reference_drive import RATED_TORQUE_N_M, reference_system, single_mass

from tdacoustic.errors import GearError
from tdacoustic.gears import ContactLines
from tdacoustic.gears.integration import integrate, settle, static_state

TWO_PI = 2.0 * np.pi

ON_THE_GRID = ContactLines(1.5, 0.25)
"""Kinks of the length at quarters of the period, where every number of steps has a step."""


def by_scipy(system, mesh_hz, torque, periods, steps, start):
    """Displacement along the line of action at equal steps and the end, by the eight printed equations."""
    found = motion(system, mesh_hz, torque, start, np.arange(periods * steps + 1) / (steps * mesh_hz))
    return direction(system) @ found[:8, :-1], found[:, -1]


# ------------------------------------------------------------------------------ order of convergence


def observed_order(system, mesh_hz, torque, periods, numbers, exact):
    errors = []
    for steps in numbers:
        found = integrate(system, mesh_hz, torque, periods, steps=steps)
        errors.append(np.linalg.norm(found.state[:7] - exact[:7]) / np.linalg.norm(exact[:7]))
    return -np.polyfit(np.log(numbers), np.log(errors), 1)[0], errors


@pytest.mark.parametrize("mesh_damping", ["always", "contact"])
def test_error_falls_with_the_fourth_power_of_the_step_in_contact(mesh_damping, conformance):
    system = replace(reference_system(mesh_damping=mesh_damping), contact_lines=ON_THE_GRID)
    exact = integrate(system, 525.0, RATED_TORQUE_N_M, 3, steps=16384).state
    order, errors = observed_order(system, 525.0, RATED_TORQUE_N_M, 3, [256, 512, 1024], exact)
    source = "analytic: order of the classical Runge-Kutta method"
    conformance(f"order of convergence of the time integration, damper {mesh_damping}", 4.0, order, 0.15, "1", source)
    assert errors[-1] < 1e-9


def test_error_in_contact_is_that_of_the_exact_solution():
    # From rest at zero compression: the last column of the monodromy matrix is where the forcing brings it.
    system = replace(reference_system(), contact_lines=ON_THE_GRID)
    teeth = BondedTeeth(system, 525.0, RATED_TORQUE_N_M)
    whole = teeth.monodromy()
    start = static_state(system, RATED_TORQUE_N_M)
    exact = whole[:, :14] @ start + whole[:, 14]
    found = integrate(system, 525.0, RATED_TORQUE_N_M, 1, steps=1024)
    assert (np.abs(found.displacement_m - 100e-6) < 100e-6).all()
    assert found.state[:7] == pytest.approx(exact[:7], rel=1e-8, abs=1e-8 * np.abs(exact[:7]).max())


def test_jumps_of_spur_teeth_are_met_by_steps():
    # 1.5: the jump lies at half a period, on a step; the step that ends there reads the stiffness after it, order 1.
    system = replace(reference_system(), contact_lines=ContactLines(1.5, 0.0))
    exact = integrate(system, 525.0, RATED_TORQUE_N_M, 3, steps=16384).state
    order, errors = observed_order(system, 525.0, RATED_TORQUE_N_M, 3, [64, 128, 256, 512], exact)
    assert order > 0.8
    assert errors[-1] < 2e-3


# ------------------------------------------------------------------------------ energy


def energy_j(system, state):
    reduced = system.reduced
    position, velocity = state[:7], state[7:]
    delta = reduced.direction @ position
    compression = max(delta - system.half_backlash_m, 0.0)
    kinetic = 0.5 * (reduced.masses * velocity**2).sum()
    return (
        kinetic + 0.5 * (reduced.stiffness * position**2).sum() + (0.5 * system.mesh_stiffness_n_per_m * compression**2)
    )


def undamped(lines=ContactLines(2.0, 0.3)):  # noqa: B008
    system = reference_system(mesh_damping_ratio=0.0, transmission_error_m=(), bearing_damping_ratio=0.0)
    return replace(system, contact_lines=lines)


def test_energy_is_kept_without_dampers_and_excitation():
    # Constant stiffness, no error, no torque but the constant one: T works on p = r1 theta1 + r2 theta2 with T/r1.
    system, torque = undamped(), 2000.0
    start = static_state(system, torque)
    # A push that stays in contact; the teeth are pressed by 8 um.
    start[7:] = np.array([1.0, -2.0, 0.5, 1.0, 1.0, -1.0, 3.0]) * 1e-3
    found = integrate(system, 500.0, torque, 10, start, steps=1024)
    assert (found.displacement_m > system.half_backlash_m).all()
    work = torque / system.base_radii_m[0] * (found.state[6] - start[6])
    change = energy_j(system, found.state) - energy_j(system, start)
    assert change == pytest.approx(work, abs=1e-7 * energy_j(system, start))


def test_energy_is_kept_through_free_flight_and_impacts():
    system, torque = undamped(), 300.0
    start = static_state(system, torque)
    start[7:] = np.array([2.0, -5.0, 1.0, 1.0, 1.0, -1.0, 30.0]) * 1e-3
    found = integrate(system, 500.0, torque, 10, start, steps=4096)
    gap = found.displacement_m - system.half_backlash_m
    assert gap.min() < -1e-6 and gap.max() > 1e-6 and found.displacement_m.min() > -system.half_backlash_m
    work = torque / system.base_radii_m[0] * (found.state[6] - start[6])
    moving = energy_j(system, start)
    assert energy_j(system, found.state) - moving == pytest.approx(work, abs=1e-5 * moving)


def test_force_at_the_steps_is_that_of_the_law_of_the_mesh():
    system, torque = undamped(), 300.0
    start = static_state(system, torque)
    start[13] = 30e-3
    found = integrate(system, 500.0, torque, 4, start, steps=512)
    q = found.displacement_m
    b, k = system.half_backlash_m, system.mesh_stiffness_n_per_m
    expected = np.where(q > b, k * (q - b), np.where(q < -b, k * (q + b), 0.0))
    assert found.force_n == pytest.approx(expected, abs=1e-9 * k * b)
    assert (found.force_n == 0.0).any() and (found.force_n > 0.0).any()


# ------------------------------------------------------------------------------ by another program


def test_static_state_is_at_rest_in_the_printed_equations():
    system = replace(reference_system(transmission_error_m=()), contact_lines=ContactLines(2.0, 0.3))
    for torque in (RATED_TORQUE_N_M, -300.0):
        rest = np.array(rates(system, 500.0, torque)(0.0, eight_of_seven(system, static_state(system, torque))))
        unbalanced = rest[8:] * np.diag(matrices(system)[0])
        assert np.abs(unbalanced).max() < 1e-9 * abs(torque) / system.base_radii_m[0]


def test_static_state_without_a_torque_is_the_middle_of_the_gap():
    assert static_state(reference_system(), 0.0) == pytest.approx(np.zeros(14))


@pytest.mark.parametrize(
    ("name", "mesh_hz", "torque", "change", "tolerance"),
    [
        # The kinks of the stiffness lie between steps, which makes the order 2 there: 1e-6. Where teeth meet and part
        # lies between steps too, and its error grows from impact to impact.
        ("in contact", 524.9, RATED_TORQUE_N_M, {}, 3e-6),
        ("rated speed", 1001.3, RATED_TORQUE_N_M, {}, 3e-6),
        ("other flanks", 524.9, -2000.0, {}, 3e-6),
        ("separating", 540.0, 300.0, {"transmission_error_m": (8e-6,)}, 1e-4),
        ("reaching the other flanks", 1001.3, 100.0, {"half_backlash_m": 5.5e-6}, 1e-4),
        ("damper needs contact", 900.0, 1000.0,
         {"transmission_error_m": (20e-6,), "mesh_damping": "contact", "mesh_damping_ratio": 0.2}, 2e-3),
    ],
)  # fmt: skip
def test_transient_is_that_of_the_eight_printed_equations(name, mesh_hz, torque, change, tolerance, conformance):
    system, periods, steps = reference_system(**change), 20, 1024
    start = static_state(system, torque)
    found = integrate(system, mesh_hz, torque, periods, start, steps)
    exact, end = by_scipy(system, mesh_hz, torque, periods, steps, start)
    touching = np.abs(exact - np.tile(system.transmission_error_at(np.arange(steps) / steps), periods))
    separates = (touching < system.half_backlash_m).mean()
    assert (separates > 0.05) == (name not in ("in contact", "rated speed", "other flanks"))
    if name == "reaching the other flanks":
        assert exact.min() < -system.half_backlash_m and exact.max() > system.half_backlash_m
    error = np.abs(found.displacement_m.ravel() - exact).max() / np.ptp(exact)
    source = "independent: scipy DOP853 of equations (1) to (6) of Appl. Sci. 2025, 15, 10597"
    conformance(f"20 periods from rest, over the peak to peak, {name}", 0.0, error, tolerance, "1", source)
    # And the rigid rotation of the eight has gone nowhere that matters: p of the seven is r1 theta1 + r2 theta2.
    p = system.base_radii_m[0] * end[3] + system.base_radii_m[1] * end[7]
    assert found.state[6] == pytest.approx(p, abs=tolerance * np.ptp(exact) * 3.0)


def test_default_steps_are_fine_enough():
    system = reference_system()
    default = integrate(system, 524.9, RATED_TORQUE_N_M, 20)
    finer = integrate(system, 524.9, RATED_TORQUE_N_M, 20, steps=8 * default.displacement_m.shape[1])
    swing = np.ptp(finer.displacement_m)
    assert np.abs(default.displacement_m - finer.displacement_m[:, ::8]).max() < 1e-5 * swing


# ------------------------------------------------------------------------------ settling


def test_settled_motion_repeats_and_says_after_how_many_periods():
    system = reference_system()
    found = settle(system, 524.9, RATED_TORQUE_N_M)
    assert found.repeats_after == 1
    assert found.displacement_m.shape[0] == 1
    again = integrate(system, 524.9, RATED_TORQUE_N_M, 1, found.state, found.displacement_m.shape[1])
    swing = np.ptp(found.displacement_m)
    assert np.abs(again.displacement_m - found.displacement_m).max() < 2e-9 * swing
    exact = BondedTeeth(system, 524.9, RATED_TORQUE_N_M).periodic([0.0])[0][0]
    assert found.state[:7] == pytest.approx(exact[:7], abs=1e-5 * swing)


def test_period_doubling_of_meissners_oscillator_is_seen():
    # Unstable at 2 omega_n in closed form; the gap bounds its growth to a motion of two periods.
    system = single_mass(0.15, (), ContactLines(1.5, 0.0))
    mesh_hz = 2.0 * np.sqrt(system.mesh_stiffness_n_per_m / system.equivalent_mass_kg) / TWO_PI
    calm = settle(system, mesh_hz, 1000.0)
    assert calm.repeats_after == 1
    lively = settle(replace(system, mesh_damping_ratio=0.03), mesh_hz, 1000.0)
    assert lively.repeats_after == 2
    assert lively.displacement_m.shape[0] == 2
    first, second = lively.displacement_m
    assert np.abs(first - second).max() > 0.1 * np.ptp(lively.displacement_m)


def test_motion_that_does_not_repeat_in_time_is_recorded_as_such():
    system = reference_system(mesh_damping_ratio=0.001, bearing_damping_ratio=0.0005)
    found = settle(system, 524.9, RATED_TORQUE_N_M, most_periods=64)
    assert found.repeats_after is None
    assert found.displacement_m.shape[0] == 16
    assert found.periods >= 64 + 16


def test_integration_that_leaves_all_bounds_is_refused():
    # Four steps a period of 100 Hz: 31 rad of the fastest natural frequency each.
    with pytest.raises(GearError, match=r"the time integration at 100 Hz left all bounds"):
        integrate(reference_system(), 100.0, RATED_TORQUE_N_M, 400, steps=4)

"""The periodic motion by harmonic balance: against closed forms, exact periodic solutions, the balance of energy."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from printed_equations import BondedTeeth, line_length, matrices, mesh_damping, transmission_error
from reference_drive import RATED_TORQUE_N_M, reference_system, single_mass
from scipy.optimize import brentq

from tdacoustic.gears import ContactLines, harmonic_balance
from tdacoustic.gears.harmonic_balance import TAIL, HarmonicSolution, balance, periodic_solution

CONSTANT = ContactLines(2.0, 0.3)
"""A whole number: the total length of the contact lines does not change."""

TWO_PI = 2.0 * np.pi


def series_at(coefficients, phases):
    """x_0 + 2 Re sum x_k exp(i 2 pi k t), summed term by term."""
    k = np.arange(1, coefficients.size)
    waves = np.exp(1j * TWO_PI * np.outer(k, phases))
    return coefficients[0].real + 2.0 * (coefficients[1:] @ waves).real


# ------------------------------------------------------------------------------ closed forms


@pytest.mark.parametrize("torque", [5913.0, -2000.0, 1.0])
def test_slow_teeth_are_compressed_by_the_force_over_the_stiffness_of_the_moment(torque):
    # Far below the lowest resonance (190 Hz), delta(t) = F0/k(t) + b + e(t) at every moment.
    system, mesh_hz = reference_system(transmission_error_m=(5e-6, 1e-6), half_backlash_m=50e-6), 0.2
    if abs(torque) == 1.0:
        system = replace(system, transmission_error_m=())
    found = balance(system, mesh_hz, system.mean_force_n(torque), 200)
    assert not found.separates
    phases = np.arange(4096) / 4096
    lines = system.contact_lines
    length = [line_length(t, lines.transverse_contact_ratio, lines.overlap_ratio) for t in phases]
    force = torque / (system.base_radii_m[0] * math.cos(system.base_helix_angle_rad))
    expected = force / (system.mesh_stiffness_n_per_m * np.array(length))
    expected += math.copysign(system.half_backlash_m, torque)
    expected += [transmission_error(system, t) for t in phases]
    # Inertia adds (20 x 0.2/190)² to harmonic 20, and harmonics of 1/k beyond 200 are missing.
    series = np.fft.rfft(expected, norm="forward")[:21]
    assert np.abs(found.displacement_m[:21] - series).max() < 1e-4 * np.ptp(expected)


def test_constant_stiffness_answers_each_harmonic_of_the_error_alone(conformance):
    # delta_k = H k e_k / (1 + H (k + i omega c)), k the mesh stiffness and H the receptance of the eight equations.
    amplitudes = (4e-6, 0.0, 1.5e-6, 0.7e-6)
    system, mesh_hz = replace(reference_system(transmission_error_m=amplitudes), contact_lines=CONSTANT), 400.0
    found = periodic_solution(system, mesh_hz, system.mean_force_n(RATED_TORQUE_N_M))
    mass, damping, spring = matrices(system)
    stiffness, c_m = system.mesh_stiffness_n_per_m, mesh_damping(system)
    vector = system.direction_vector
    for k, amplitude in enumerate(amplitudes, 1):
        omega = TWO_PI * k * mesh_hz
        # The eight equations with the teeth in contact, driven by k e along V.
        whole = spring - omega**2 * mass + 1j * omega * damping
        whole = whole + (stiffness + 1j * omega * c_m) * np.outer(vector, vector)
        expected = vector @ np.linalg.solve(whole, vector * stiffness * (-0.5j * amplitude))
        assert found.displacement_m[k] == pytest.approx(expected, rel=1e-10, abs=1e-20)
        h = (vector**2 / np.diag(spring - omega**2 * mass + 1j * omega * damping)).sum()
        closed = h * stiffness * (-0.5j * amplitude) / (1.0 + h * (stiffness + 1j * omega * c_m))
        assert expected == pytest.approx(closed, rel=1e-10, abs=1e-20)
        if amplitude:
            what = f"amplitude of delta at harmonic {k} under a sine of transmission error"
            got, source = (
                2e6 * abs(found.displacement_m[k]),
                "analytic: linear vibration of gears on bearings, mesh stiffness constant",
            )
            conformance(what, 2e6 * abs(closed), got, 1e-9 * 2e6 * abs(closed), "um", source)
    assert np.abs(found.displacement_m[5:]).max() < 1e-20
    assert found.displacement_m[0].real == pytest.approx(
        system.half_backlash_m + system.mean_force_n(RATED_TORQUE_N_M) / stiffness, rel=1e-12
    )


@settings(max_examples=25)
@given(st.lists(st.floats(-3e-6, 3e-6), min_size=1, max_size=4), st.floats(-2.0, 2.0), st.floats(100.0, 2000.0))
def test_motion_of_teeth_in_contact_is_linear_in_the_error(amplitudes, factor, mesh_hz):
    # In contact the equations are linear, with a varying stiffness too; under this load the teeth stay there.
    system = reference_system(transmission_error_m=())
    force = system.mean_force_n(20.0 * RATED_TORQUE_N_M)

    def motion(*errors):
        # The number of harmonics of the solution must not follow that of the error.
        loaded = replace(system, transmission_error_m=errors + (0.0,) * (4 - len(errors)))
        found = balance(loaded, mesh_hz, force, 16)
        assert not found.separates
        return found

    rest, whole = motion().displacement_m, motion(*amplitudes).displacement_m - motion().displacement_m
    parts = sum(
        motion(*[0.0] * n, amplitude).displacement_m - rest for n, amplitude in enumerate(amplitudes) if amplitude
    )
    assert np.abs(whole - parts).max() <= 1e-12 * np.abs(rest).max()
    scaled = motion(*[factor * amplitude for amplitude in amplitudes]).displacement_m - rest
    assert np.abs(scaled - factor * whole).max() <= 1e-12 * np.abs(rest).max()


# ------------------------------------------------------------------------------ teeth in contact, exactly


CASES = [
    ("helical", ContactLines(1.55, 0.4), 525.0, RATED_TORQUE_N_M),
    ("helical", ContactLines(1.55, 0.4), 1001.3, -RATED_TORQUE_N_M),
    ("reference", None, 174.97, RATED_TORQUE_N_M),
    ("reference", None, 524.9, RATED_TORQUE_N_M),
    ("reference", None, 1001.3, RATED_TORQUE_N_M),
    ("overlap larger", ContactLines(1.4, 1.85), 262.45, 3000.0),
]


@pytest.mark.parametrize(("name", "lines", "mesh_hz", "torque"), CASES)
def test_varying_stiffness_gives_the_exact_periodic_motion(name, lines, mesh_hz, torque, conformance):
    system = reference_system()
    system = replace(system, contact_lines=lines or system.contact_lines)
    found = periodic_solution(system, mesh_hz, system.mean_force_n(torque))
    assert found is not None and not found.separates
    phases = (np.arange(300) + 0.3) / 300
    _, exact = BondedTeeth(system, mesh_hz, torque).periodic(phases)
    error = np.abs(series_at(found.displacement_m, phases) - exact).max() / np.ptp(exact)
    what = f"largest difference of delta over its peak to peak, {name}, {mesh_hz} Hz, {torque} N m"
    # As small as the solution claims its error to be.
    conformance(what, 0.0, error, TAIL, "1", "independent: periodic solution from kink to kink")


@pytest.mark.parametrize("mesh_hz", [300.0, 525.0, 700.0])
def test_jumps_of_spur_teeth_are_followed(mesh_hz):
    system = replace(reference_system(), contact_lines=ContactLines(1.6, 0.0))
    found = periodic_solution(system, mesh_hz, system.mean_force_n(RATED_TORQUE_N_M))
    phases = (np.arange(2000) + 0.3) / 2000
    _, exact = BondedTeeth(system, mesh_hz, RATED_TORQUE_N_M).periodic(phases)
    # Harmonics of delta fall as 1/k³ only; what is said of those left out holds.
    assert np.abs(series_at(found.displacement_m, phases) - exact).max() < found.tail * np.ptp(exact)
    assert found.dte_pp_m == pytest.approx(np.ptp(exact), rel=1e-5)


@pytest.mark.parametrize(
    ("name", "lines", "waveform_order", "harmonic_order"),
    [("spur", ContactLines(1.6, 0.0), 2, 3), ("helical", ContactLines(1.55, 0.4), 3, 5)],
)
def test_error_falls_with_the_number_of_harmonics_as_theory_says(
    name, lines, waveform_order, harmonic_order, conformance
):
    # A stiffness whose harmonics fall as 1/k^p gives delta_k as 1/k^(p+2), p = 1 of jumps and 2 of kinks. What is cut
    # off at N is sum 1/k^(p+2), order p + 1; and it comes back to a low harmonic through the stiffness, sum
    # 1/k^(2p+2), order 2p + 1.
    system = replace(reference_system(), contact_lines=lines)
    mesh_hz, force = 525.0, system.mean_force_n(RATED_TORQUE_N_M)
    phases = (np.arange(1000) + 0.3) / 1000
    _, exact = BondedTeeth(system, mesh_hz, RATED_TORQUE_N_M).periodic(phases)
    fine = balance(system, mesh_hz, force, 700).displacement_m
    numbers = np.array([16, 24, 32, 48, 64, 96, 128])
    waveform, low = [], []
    for number in numbers:
        found = balance(system, mesh_hz, force, int(number)).displacement_m
        # Without the harmonics beyond N that follow from the force: the balance itself.
        waveform.append(np.abs(series_at(found[: number + 1], phases) - exact).max())
        low.append(np.abs(found[1:4] - fine[1:4]).max())
    source = "analytic: order at which the Fourier series of the stiffness falls"
    note = "the last harmonics lie anywhere in the lobes of the stiffness series, which scatters the fit"
    for what, errors, order in (("delta", waveform, waveform_order), ("harmonics 1 to 3", low, harmonic_order)):
        observed = -np.polyfit(np.log(numbers), np.log(errors), 1)[0]
        conformance(f"order of convergence of {what}, {name}", order, observed, 0.5, "1", source, note)


def test_tail_is_no_smaller_than_the_error_of_helical_teeth():
    system = replace(reference_system(), contact_lines=ContactLines(1.55, 0.4))
    force = system.mean_force_n(RATED_TORQUE_N_M)
    phases = (np.arange(1000) + 0.3) / 1000
    _, exact = BondedTeeth(system, 525.0, RATED_TORQUE_N_M).periodic(phases)
    for number in (8, 16):
        found = balance(system, 525.0, force, number)
        error = np.abs(series_at(found.displacement_m, phases) - exact).max() / np.ptp(exact)
        # An estimate: within a quarter.
        assert error <= 1.25 * found.tail


# ------------------------------------------------------------------------------ energy


def dissipated_w(system, found):
    """Power that bearings and mesh damping take, from the harmonics of the force on the eight equations."""
    mass, damping, spring = matrices(system)
    power = 0.0
    for k in range(1, found.n_harmonics + 1):
        omega = TWO_PI * k * found.mesh_hz
        impedance = np.diag(spring - omega**2 * mass + 1j * omega * damping)
        x = -system.direction_vector * 2.0 * found.force_n[k] / impedance
        power += 0.5 * omega**2 * (np.diag(damping) * np.abs(x) ** 2).sum()
        if system.mesh_damping == "always":
            power += 0.5 * omega**2 * mesh_damping(system) * abs(2.0 * found.displacement_m[k]) ** 2
    return power


def supplied_w(system, found, samples, stiffness):
    """Mean of -F delta' of the teeth's elastic force, from samples over one period."""
    n = found.n_harmonics
    phases = np.arange(samples) / samples
    delta = series_at(found.displacement_m[: n + 1], phases)
    velocity = found.displacement_m[: n + 1] * 1j * TWO_PI * found.mesh_hz * np.arange(n + 1)
    speed = series_at(velocity, phases)
    q = delta - np.array([transmission_error(system, t) for t in phases])
    b = system.half_backlash_m
    tau = np.where(q > b, q - b, np.where(q < -b, q + b, 0.0))
    force = stiffness(phases) * tau
    if system.mesh_damping == "contact":
        force = force + mesh_damping(system) * speed * (tau != 0.0)
    return -(force * speed).mean()


def stiffness_series(system, highest):
    """k_m(t) summed from its series, not from the trapezoids: what N harmonics of a product need."""
    lines = system.contact_lines
    k = np.arange(highest + 1)
    size = np.sinc(k * lines.transverse_contact_ratio) * np.sinc(k * lines.overlap_ratio)
    series = size * np.exp(-1j * np.pi * k * (lines.transverse_contact_ratio + lines.overlap_ratio))
    return lambda phases: system.mesh_stiffness_n_per_m * series_at(series, phases)


@pytest.mark.parametrize("mesh_hz", [174.97, 524.9, 1001.3])
@pytest.mark.parametrize("mesh_damping", ["always", "contact"])
def test_energy_of_teeth_in_contact_is_balanced_to_round_off(mesh_hz, mesh_damping):
    # The torques do no work on a motion that repeats; what error and stiffness put in, dampers take out.
    system = reference_system(mesh_damping=mesh_damping)
    found = balance(system, mesh_hz, system.mean_force_n(RATED_TORQUE_N_M), 24)
    assert not found.separates
    taken = dissipated_w(system, found)
    if mesh_damping == "contact":
        # Teeth that always touch: the damper is in the elastic force of `supplied_w`'s bookkeeping or in neither.
        taken += sum(
            0.5 * (TWO_PI * k * mesh_hz) ** 2 * system.mesh_damping_n_s_per_m * abs(2.0 * found.displacement_m[k]) ** 2
            for k in range(1, 25)
        )
        system = replace(system, mesh_damping="always")
    given = supplied_w(system, found, 256, stiffness_series(system, 72))
    assert taken > 0.0
    # The mean force moves nothing; its product with the round-off of delta' remains.
    assert given == pytest.approx(taken, rel=1e-9)


SEPARATING = [
    # mesh_hz, torque in N m, error, ratio and reading of the mesh damping
    (540.0, 300.0, 8e-6, 0.05, "always"),
    (900.0, 1000.0, 20e-6, 0.2, "always"),
    (1150.0, 1000.0, 10e-6, 0.1, "always"),
    (550.0, 300.0, 12e-6, 0.2, "contact"),
]


def separating(mesh_hz, torque, error, ratio, reading):
    system = reference_system(mesh_damping_ratio=ratio, transmission_error_m=(error,), mesh_damping=reading)
    found = periodic_solution(system, mesh_hz, system.mean_force_n(torque))
    assert found is not None and found.separates
    return system, found


@pytest.mark.parametrize("case", SEPARATING)
def test_energy_of_teeth_that_separate_is_balanced(case):
    system, found = separating(*case)
    taken, n = dissipated_w(system, found), found.n_harmonics
    assert taken > 0.0
    stiffness = stiffness_series(system, 5 * n)
    # At the balance's own samples, a power of two from 32 times the harmonics, sums are what they are in it.
    own = 2 ** math.ceil(math.log2(32 * n))
    assert supplied_w(system, found, own, stiffness) == pytest.approx(taken, rel=1e-7)
    # Four times finer the kinks (steps, of a damper that needs contact) of the force lie elsewhere between samples.
    finer = 5e-4 if system.mesh_damping == "always" else 0.1
    assert supplied_w(system, found, 4 * own, stiffness) == pytest.approx(taken, rel=finer)


# ------------------------------------------------------------------------------ laws


def mirrored(system, mesh_hz, torque):
    mirror = replace(system, transmission_error_m=tuple(-size for size in system.transmission_error_m))
    return periodic_solution(mirror, mesh_hz, mirror.mean_force_n(-torque))


@pytest.mark.parametrize("mesh_hz", [174.97, 524.9, 1001.3])
@pytest.mark.parametrize("mesh_damping", ["always", "contact"])
def test_other_sense_of_the_torque_mirrors_the_motion_with_the_error(mesh_hz, mesh_damping):
    # x -> -x, T -> -T, e -> -e leaves the equations as they are.
    system = reference_system(transmission_error_m=(5e-6, 1e-6), mesh_damping=mesh_damping)
    found = periodic_solution(system, mesh_hz, system.mean_force_n(RATED_TORQUE_N_M))
    turned = mirrored(system, mesh_hz, RATED_TORQUE_N_M)
    assert not found.separates and not turned.separates
    assert np.abs(found.displacement_m + turned.displacement_m).max() < 1e-15


@pytest.mark.parametrize("case", SEPARATING)
def test_other_sense_of_the_torque_mirrors_teeth_that_separate(case):
    system, found = separating(*case)
    turned = mirrored(system, *case[:2])
    assert turned.separates
    # Both are solved to 1e-10 of the static compression and the error.
    assert np.abs(found.displacement_m + turned.displacement_m).max() < 1e-8 * np.abs(found.displacement_m[1:]).max()
    assert turned.dte_pp_m == pytest.approx(found.dte_pp_m, rel=1e-8)


@pytest.mark.parametrize("mesh_hz", [300.0, 525.0, 1001.3])
def test_without_an_error_only_the_sign_changes_with_the_torque(mesh_hz):
    system = reference_system(transmission_error_m=())
    found = periodic_solution(system, mesh_hz, system.mean_force_n(RATED_TORQUE_N_M))
    turned = periodic_solution(system, mesh_hz, system.mean_force_n(-RATED_TORQUE_N_M))
    assert np.abs(found.displacement_m + turned.displacement_m).max() < 1e-15


def test_without_an_error_the_motion_grows_with_the_torque():
    system = reference_system(transmission_error_m=())
    one = periodic_solution(system, 700.0, system.mean_force_n(100.0))
    ten = periodic_solution(system, 700.0, system.mean_force_n(1000.0))
    assert ten.dte_pp_m == pytest.approx(10.0 * one.dte_pp_m, rel=1e-10)


@pytest.mark.parametrize("mesh_hz", [174.97, 524.9, 1001.3])
def test_readings_of_the_mesh_damping_agree_while_teeth_touch(mesh_hz):
    always, contact = (reference_system(mesh_damping=reading) for reading in ("always", "contact"))
    force = always.mean_force_n(RATED_TORQUE_N_M)
    first, second = periodic_solution(always, mesh_hz, force), periodic_solution(contact, mesh_hz, force)
    assert not first.separates and not second.separates
    assert np.abs(first.displacement_m - second.displacement_m).max() < 1e-15
    assert second.force_n == pytest.approx(first.force_n, rel=1e-9, abs=1e-6)


def test_readings_of_the_mesh_damping_differ_once_teeth_separate():
    (_, always), (_, contact) = (separating(*case) for case in SEPARATING[2:])
    assert abs(always.dte_pp_m - contact.dte_pp_m) > 0.02 * always.dte_pp_m


def test_series_and_waveform_are_one_motion():
    system = reference_system()
    found = periodic_solution(system, 524.9, system.mean_force_n(RATED_TORQUE_N_M))
    assert isinstance(found, HarmonicSolution)
    samples = 4 * found.displacement_m.size
    expected = series_at(found.displacement_m, np.arange(samples) / samples)
    assert found.displacement_at(samples) == pytest.approx(expected, rel=1e-12)
    fine = np.ptp(series_at(found.displacement_m, np.arange(20_000) / 20_000))
    # 1024 points and more see a peak of harmonic k to 1 - cos(pi k / 1024).
    assert found.dte_pp_m == pytest.approx(fine, rel=1e-4)
    # F = k (delta - b - e) + c delta' at these times, with the harmonics that the balance holds.
    assert found.force_n[0].real == pytest.approx(system.mean_force_n(RATED_TORQUE_N_M), rel=1e-12)
    assert found.residual <= 1e-10


@pytest.mark.parametrize("case", SEPARATING)
def test_newtons_method_converges_quadratically(case, monkeypatch):
    # From 1e-4 beside the solution to 1e-8 and below 1e-10: two steps, and one for where a tooth newly touches.
    system, found = separating(*case)
    monkeypatch.setattr(harmonic_balance, "_NEWTON_STEPS", 4)
    start = found.displacement_m[: found.n_harmonics + 1].copy()
    start[1:] *= 1.0 + 1e-4
    again = balance(system, case[0], system.mean_force_n(case[1]), found.n_harmonics, start)
    assert again is not None
    assert np.abs(again.displacement_m - found.displacement_m).max() < 1e-8 * np.abs(found.displacement_m[1:]).max()


# ------------------------------------------------------------------------------ the preloaded gap, in closed form


def backbone(peak_to_peak, static, omega_n):
    """Frequency in Hz of the free vibration with a peak to peak, and the part of it in contact.

    In contact q = q_s (1 + (a/q_s) cos) about the static compression q_s until q = 0 at the angle phi, cos phi =
    -q_s/a; then flight with -a phi' sin phi against the constant force k q_s: up and back in 2 v/(omega_n² q_s), as
    high as v²/(2 omega_n² q_s), v = a omega_n sin phi.
    """

    def swing(a):
        return static + a + (a**2 - static**2) / (2.0 * static)

    a = brentq(lambda a: swing(a) - peak_to_peak, static, 100.0 * static)
    phi = math.acos(-static / a)
    contact, flight = 2.0 * phi / omega_n, 2.0 * a * math.sin(phi) / (omega_n * static)
    return 1.0 / (contact + flight), contact / (contact + flight)


@pytest.mark.parametrize(
    ("damping_ratio", "level"), [(0.005, 0.015), (0.005, 0.03), (0.005, 0.05), (0.01, 0.06), (0.01, 0.1)]
)
def test_resonance_peaks_of_separating_teeth_lie_on_the_backbone(damping_ratio, level, conformance):
    torque = 1000.0
    plain = single_mass(damping_ratio, (), ContactLines(2.0, 0.0))
    static = torque / plain.base_radii_m[0] / plain.mesh_stiffness_n_per_m
    # A gap so wide that the other flanks are never reached.
    system = replace(plain, transmission_error_m=(level * static,), half_backlash_m=30.0 * static)
    omega_n = math.sqrt(system.mesh_stiffness_n_per_m / system.equivalent_mass_kg)
    natural_hz = omega_n / TWO_PI
    step = 1e-3 * natural_hz
    highest, at, contact, start = 0.0, 0.0, 1.0, None
    for mesh_hz in np.arange(1.05 * natural_hz, 0.5 * natural_hz, -step):
        found = periodic_solution(system, mesh_hz, system.mean_force_n(torque), start)
        if found is None or found.dte_pp_m < 0.7 * highest:
            break  # the branch that came down from above has folded back
        if found.dte_pp_m > highest:
            highest, at, contact = found.dte_pp_m, mesh_hz, found.contact_part
        start = found.displacement_m
    else:
        pytest.fail("the branch has no end")
    assert contact < 0.8
    free_hz, in_contact = backbone(highest, static, omega_n)
    what = f"peak over natural frequency, e = {level} q_s, zeta = {damping_ratio}"
    # Two steps of the sweep; damping and error shift it by their squares.
    conformance(
        what,
        free_hz / natural_hz,
        at / natural_hz,
        2e-3,
        "1",
        "analytic: free vibration of one mass with play, half a period of contact and a flight",
    )
    # 128 samples a period, and the error's part in when teeth touch.
    assert contact == pytest.approx(in_contact, abs=0.02)


def test_linear_resonance_lies_at_the_natural_frequency():
    torque = 1000.0
    plain = single_mass(0.01, (), ContactLines(2.0, 0.0))
    static = torque / plain.base_radii_m[0] / plain.mesh_stiffness_n_per_m
    system = replace(plain, transmission_error_m=(0.01 * static,))
    natural_hz = math.sqrt(system.mesh_stiffness_n_per_m / system.equivalent_mass_kg) / TWO_PI
    speeds = natural_hz * np.linspace(0.97, 1.03, 61)
    found = [periodic_solution(system, mesh_hz, system.mean_force_n(torque)) for mesh_hz in speeds]
    assert not any(solution.separates for solution in found)
    sizes = [solution.dte_pp_m for solution in found]
    assert speeds[int(np.argmax(sizes))] == pytest.approx(natural_hz, rel=1.5e-3)
    # k e / (2 zeta k) at resonance.
    assert max(sizes) == pytest.approx(2.0 * 0.01 * static / 0.02, rel=1e-3)

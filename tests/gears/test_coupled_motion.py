"""Gears on a housing that gives way, against one system of gears and modes integrated in time with code of its own."""

import math
from dataclasses import replace

import numpy as np
import pytest
from printed_equations import direction, matrices, mesh_damping
from reference_drive import RATED_TORQUE_N_M, reference_system
from scipy.integrate import solve_ivp

from tdacoustic.errors import GearError
from tdacoustic.gears import Foundation, bearing_forces, steady_state
from tdacoustic.gears.floquet import floquet_multipliers, samples_of_period
from tdacoustic.gears.integration import integrate, settle
from tdacoustic.gears.lines import lines_of_repeat
from tdacoustic.gears.mesh_poles import MeshPoles
from tdacoustic.gears.steady_state import _state_at

MONOLITH = "independent: gears and modes as one system, scipy DOP853"

MODES_HZ = np.array([60.0, 240.0, 530.0, 1210.0])
SHAPES = np.array(
    [
        [0.045, 0.0, 0.002, 0.045, 0.001, 0.0],
        [0.01, 0.08, -0.02, -0.015, -0.06, 0.03],
        [-0.03, 0.04, 0.06, 0.02, 0.05, -0.04],
        [0.05, 0.02, -0.03, -0.04, 0.03, 0.05],
    ]
)
"""Made up, of the size of the reference housing's: a rigid body of 490 kg has 0.045."""


def housing(loss_factor=0.03, damping="viscous", scale=1.0):
    return Foundation(MODES_HZ, scale * SHAPES, loss_factor, damping)


# ------------------------------------------------------------------ the same, as one system in time


class Monolith:
    """Eleven coordinates: x, y, z of both gears, p = r1 θ1 + r2 θ2, four modes of the housing.

    Of the package only input fields are read, and `printed_equations`, which does the same.
    """

    def __init__(self, system):
        shapes, own = system.foundation.shapes, 2.0 * np.pi * system.foundation.frequency_hz
        n, keep = 7 + len(own), [0, 1, 2, 4, 5, 6]
        mass, damper, spring = (matrix[np.ix_(keep, keep)] for matrix in matrices(system))
        (r1, r2), (j1, j2) = system.base_radii_m, system.inertias_kg_m2
        self.n, self.system = n, system
        self.mass = np.concatenate([np.diag(mass), [1.0 / (r1**2 / j1 + r2**2 / j2)], np.ones(len(own))])
        self.against = np.zeros((6, n))  # of a shaft against its seat
        self.against[:, :6], self.against[:, 7:] = np.eye(6), -shapes.T
        self.bearing = np.diag(spring), np.diag(damper)
        self.own = (
            np.concatenate([np.zeros(7), own**2]),
            np.concatenate([np.zeros(7), system.foundation.loss_factor * own]),
        )
        self.v = np.zeros(n)
        self.v[:6], self.v[6] = direction(system)[keep], math.cos(system.base_helix_angle_rad)

    def stiffness_at(self, t):
        """k(t) of the trapezoid, by its own few lines: contact ratios above 1, overlap below the transverse ratio."""
        lines = self.system.contact_lines
        a, b = lines.transverse_contact_ratio, lines.overlap_ratio
        total = 0.0
        for begun in range(4):
            s = t % 1.0 + begun
            total += max(0.0, min(s, a + b - s, b)) / b
        return self.system.mesh_stiffness_n_per_m * total / a

    def rates(self, t, state, mesh_hz, torque):
        x, v = state[: self.n], state[self.n :]
        delta, speed = self.v @ x, self.v @ v
        error = sum(
            size * math.sin(2.0 * math.pi * (k + 1) * mesh_hz * t)
            for k, size in enumerate(self.system.transmission_error_m)
        )
        half = self.system.half_backlash_m
        gap = delta - error
        pressed = gap - max(-half, min(half, gap))
        force = self.stiffness_at(mesh_hz * t) * pressed + mesh_damping(self.system) * speed
        carried = self.bearing[0] * (self.against @ x) + self.bearing[1] * (self.against @ v)
        drive = np.zeros(self.n)
        drive[6] = torque / self.system.base_radii_m[0]
        pull = drive - self.against.T @ carried - self.own[0] * x - self.own[1] * v - self.v * force
        return np.concatenate([v, pull / self.mass])

    def run(self, state, mesh_hz, torque, periods=1, samples=512):
        times = np.arange(periods * samples + 1) / (samples * mesh_hz)
        found = solve_ivp(
            self.rates, (0.0, times[-1]), state, "DOP853", times, rtol=1e-10, atol=1e-14, args=(mesh_hz, torque),
            max_step=1.0 / (64.0 * mesh_hz),
        )  # fmt: skip
        return found.y

    def periodic(self, mesh_hz, torque, state, rounds):
        """Newton's method on the map of one period: a state that comes back, and the multipliers there."""
        matrix = None
        scale = np.concatenate([np.full(self.n, 1e-7), np.full(self.n, 1e-7 * 2.0 * math.pi * 500.0)])
        for _ in range(rounds):
            end = self.run(state, mesh_hz, torque, samples=1)[:, -1]
            columns = [
                self.run(state + np.eye(2 * self.n)[k] * h, mesh_hz, torque, samples=1)[:, -1]
                for k, h in enumerate(scale)
            ]
            matrix = np.stack([(column - end) / h for column, h in zip(columns, scale, strict=True)], axis=1)
            state = state + np.linalg.solve(np.eye(2 * self.n) - matrix, end - state)
        return state, np.linalg.eigvals(matrix)

    def lines(self, series, harmonics=8):
        return 2.0 * np.fft.rfft(series[..., :-1], norm="forward")[..., 1 : harmonics + 1]

    def carried(self, states):
        x, v = states[: self.n], states[self.n :]
        return self.bearing[0][:, None] * (self.against @ x) + self.bearing[1][:, None] * (self.against @ v)


def at_rest(monolith, torque):
    """A start of the shooting: teeth pressed by the torque, at mean stiffness, nothing in motion."""
    system = monolith.system
    force = torque / (system.base_radii_m[0] * math.cos(system.base_helix_angle_rad))
    spring = np.diag(monolith.own[0]) + monolith.against.T @ np.diag(monolith.bearing[0]) @ monolith.against
    k = system.mesh_stiffness_n_per_m
    right = k * math.copysign(system.half_backlash_m, force) * monolith.v
    right[6] += torque / system.base_radii_m[0]
    still = np.linalg.solve(spring + k * np.outer(monolith.v, monolith.v), right)
    return np.concatenate([still, np.zeros(monolith.n)])


def compared(system, mesh_hz, torque, state, multipliers, monolith):
    """Differences of DTE, bearing forces and modal velocities between `steady_state` and the monolith."""
    found = steady_state(system, mesh_hz, torque)
    run = monolith.run(state, mesh_hz, torque, samples=2048)
    delta = monolith.v @ run[: monolith.n, :-1]
    forces = bearing_forces(system, found)
    ours = forces.amplitude_n.reshape(6, -1)[:, :8]
    theirs = monolith.lines(monolith.carried(run))
    modal = 2j * np.pi * forces.frequency_hz[:8] * system.foundation.modal_receptance(forces.frequency_hz[:8]).T
    velocities = modal * (system.foundation.shapes @ ours)
    return {
        "state": found,
        "dte": abs(found.dte_pp_m / np.ptp(delta) - 1.0),
        "waveform": np.abs(found.waveform_m[0] - delta[:: 2048 // found.waveform_m.shape[1]]).max() / np.ptp(delta),
        "forces": np.abs(ours - theirs).max() / np.abs(theirs).max(),
        "velocities": np.abs(velocities - monolith.lines(run[monolith.n + 7 :])).max() / np.abs(velocities).max(),
        "multiplier": abs(found.floquet_max - np.abs(multipliers).max()),
    }


def held(off, found, motion, conformance, what):
    """The balance leaves out harmonics that it estimates at 5e-5 of the swing; Newton's method on finite differences
    of 1e-7 and solve_ivp at 1e-10 leave less.
    """
    for name in ("dte", "waveform", "forces", "velocities"):
        conformance(f"{what}: difference of {name} over its size", 0.0, off[name], motion, "1", MONOLITH)
    # Strang's splitting: of second order in the difference from bonded teeth, 128 steps a period at least.
    conformance(
        f"{what}: largest multiplier",
        0.0,
        off["multiplier"],
        found,
        "1",
        "independent: finite differences of one period of that system",
    )


@pytest.mark.parametrize(("mesh_hz", "helix_angle_deg"), [(175.0, 12.0), (262.0, 0.5), (525.0, 12.0), (1001.0, 4.0)])
def test_the_coupled_motion_in_contact_is_the_monoliths(mesh_hz, helix_angle_deg, conformance):
    gears = reference_system(helix_angle_deg=helix_angle_deg, transmission_error_m=(5e-6, 1e-6))
    system = replace(gears, foundation=housing())
    monolith = Monolith(system)
    state, multipliers = monolith.periodic(mesh_hz, RATED_TORQUE_N_M, at_rest(monolith, RATED_TORQUE_N_M), 2)
    off = compared(system, mesh_hz, RATED_TORQUE_N_M, state, multipliers, monolith)
    assert off["state"].method == "harmonic_balance"
    assert not off["state"].separates
    held(off, 1e-6, 1e-4, conformance, f"coupled, {mesh_hz:g} Hz, in contact")
    one_way = steady_state(gears, mesh_hz, RATED_TORQUE_N_M)
    assert abs(off["state"].dte_pp_m / one_way.dte_pp_m - 1.0) > 5e-4  # so that a coupling left out would be seen


def test_the_coupled_motion_with_separation_is_the_monoliths(conformance):
    system = replace(reference_system(helix_angle_deg=0.1, transmission_error_m=(8e-6,)), foundation=housing())
    mesh_hz, torque = 1200.0, 900.0
    found = steady_state(system, mesh_hz, torque)
    assert found.method == "harmonic_balance"
    assert 0.5 < found.contact_part < 0.8
    monolith = Monolith(system)
    settled = monolith.run(at_rest(monolith, torque), mesh_hz, torque, periods=60, samples=1)[:, -1]
    state, multipliers = monolith.periodic(mesh_hz, torque, settled, 5)
    off = compared(system, mesh_hz, torque, state, multipliers, monolith)
    # Where teeth meet the force has a kink: the bounds of separating motions on seats that stand still.
    held(off, 2e-3, 1e-3, conformance, "coupled, 1200 Hz, with separation")


@pytest.mark.parametrize("mesh_damping", ["always", "contact"])
def test_the_integration_in_time_stays_on_the_balance(mesh_damping):
    """From the balance's state, after as many periods as a wrong one would take to leave it."""
    gears = reference_system(helix_angle_deg=12.0, mesh_damping=mesh_damping)
    system = replace(gears, foundation=housing())
    found = steady_state(system, 525.0, RATED_TORQUE_N_M)
    after = integrate(system, 525.0, RATED_TORQUE_N_M, 30, _state_at(system, found))
    delta = after.displacement_m[-1]
    assert np.ptp(delta) == pytest.approx(found.dte_pp_m, rel=1e-4)  # as in contact on seats that stand still
    assert delta[0] == pytest.approx(found.waveform_m[0, 0], abs=1e-4 * found.dte_pp_m)
    lines = lines_of_repeat(525.0, after.force_n[-1:])
    assert np.abs(lines.force_n[:5] - found.lines.force_n[:5]).max() < 1e-4 * np.abs(found.lines.force_n).max()


def test_from_rest_the_integration_settles_on_the_balance():
    system = replace(reference_system(helix_angle_deg=4.0), foundation=housing(loss_factor=0.1))
    settled = settle(system, 525.0, RATED_TORQUE_N_M)
    assert settled.repeats_after == 1
    found = steady_state(system, 525.0, RATED_TORQUE_N_M)
    assert np.ptp(settled.displacement_m) == pytest.approx(found.dte_pp_m, rel=1e-3)


def test_rattling_from_rest_is_the_monoliths(conformance):
    """Three periods in which teeth part and meet, of a motion that does not settle; both start at rest."""
    system = replace(reference_system(helix_angle_deg=0.1, transmission_error_m=(8e-6,)), foundation=housing())
    monolith, mesh_hz, torque = Monolith(system), 1200.0, 300.0
    steps = 4096
    ours = integrate(system, mesh_hz, torque, 3, steps=steps)
    run = monolith.run(at_rest(monolith, torque), mesh_hz, torque, periods=3, samples=steps)
    theirs = (monolith.v @ run[: monolith.n])[:-1].reshape(3, steps)
    assert (ours.force_n == 0.0).any() or np.abs(ours.displacement_m).min() < 0.9 * system.half_backlash_m
    off = np.abs(ours.displacement_m - theirs).max() / np.ptp(theirs)
    # Steps do not stop where teeth meet: of first order there, 4096 steps a period.
    conformance("coupled, rattling from rest: difference of δ over its swing", 0.0, off, 2e-3, "1", MONOLITH)


def test_structural_and_viscous_losses_differ_little():
    """They agree at each resonance; between, 3 % of a mode's stiffness stands in another place."""
    for mesh_hz in (175.0, 525.0, 1001.0):
        swings = [
            steady_state(
                replace(reference_system(), foundation=housing(damping=law)), mesh_hz, RATED_TORQUE_N_M
            ).dte_pp_m
            for law in ("structural", "viscous")
        ]
        assert swings[0] == pytest.approx(swings[1], rel=2e-3)
        assert swings[0] != swings[1]


def test_without_a_mesh_that_changes_the_multipliers_are_those_of_the_poles():
    """Constant contact lines: each multiplier is exp(λT) of one linear system."""
    gears = reference_system(helix_angle_deg=4.0)
    lines = replace(gears.contact_lines, transverse_contact_ratio=2.0, overlap_ratio=0.0)
    system = replace(gears, contact_lines=lines, foundation=housing())
    monolith, mesh_hz = Monolith(system), 525.0
    spring = np.diag(monolith.own[0]) + monolith.against.T @ np.diag(monolith.bearing[0]) @ monolith.against
    damper = np.diag(monolith.own[1]) + monolith.against.T @ np.diag(monolith.bearing[1]) @ monolith.against
    spring += system.mesh_stiffness_n_per_m * np.outer(monolith.v, monolith.v)
    damper += mesh_damping(system) * np.outer(monolith.v, monolith.v)
    n = monolith.n
    first = np.block(
        [[np.zeros((n, n)), np.eye(n)], [-spring / monolith.mass[:, None], -damper / monolith.mass[:, None]]]
    )
    expected = np.exp(np.linalg.eigvals(first) / mesh_hz)
    pressed = np.full((1, samples_of_period(system, mesh_hz)), 10.0 * system.half_backlash_m)
    found = floquet_multipliers(system, mesh_hz, pressed)
    assert found.size == expected.size == 22
    assert np.sort(np.abs(found)) == pytest.approx(np.sort(np.abs(expected)), rel=1e-6)  # weak modes are on their own
    whole = np.exp(MeshPoles.of(system, 0.0).poles / mesh_hz)
    assert np.abs(np.subtract.outer(whole, expected)).min(axis=1).max() < 1e-9


def test_modes_that_the_mesh_does_not_feel_are_left_out_and_still_ring_down():
    """A mode that no bearing pushes has its own multiplier, and changes no other."""
    shapes = np.vstack([SHAPES, np.zeros(6)])
    more = Foundation(np.append(MODES_HZ, 40.0), shapes, 0.03, "viscous")
    system = replace(reference_system(), foundation=housing())
    wider = replace(system, foundation=more)
    assert wider.main_mesh_poles.poles.size == system.main_mesh_poles.poles.size
    pressed = np.full((1, samples_of_period(system, 525.0)), 10.0 * system.half_backlash_m)
    found = floquet_multipliers(wider, 525.0, pressed)
    alone = math.exp(-0.5 * 0.03 * 2.0 * math.pi * 40.0 / 525.0)
    assert np.abs(np.abs(found) - alone).min() < 1e-9
    assert found.size == floquet_multipliers(system, 525.0, pressed).size + 2


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"frequency_hz": np.array([0.0])}, "frequencies above 0"),
        ({"shapes": np.zeros((1, 5))}, r"need shapes of \(1, 6\)"),
        ({"loss_factor": 0.0}, "loss_factor of a foundation must be above 0"),
        ({"damping": "none"}, "'structural' or 'viscous'"),
    ],
)
def test_what_is_no_foundation_is_refused(values, message):
    with pytest.raises(GearError, match=message):
        Foundation(**({"frequency_hz": np.array([50.0]), "shapes": np.zeros((1, 6)), "loss_factor": 0.02} | values))

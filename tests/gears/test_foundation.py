"""Laws of gears on a housing that gives way: limits, reciprocity, passivity, energy."""

import math
from dataclasses import replace

import numpy as np
import pytest
from reference_drive import RATED_TORQUE_N_M, reference_system

from tdacoustic.gears import Foundation, balanced_state, bearing_forces, steady_state

FREQUENCIES_HZ = np.geomspace(20.0, 6000.0, 200)
TRANSLATIONS = [0, 1, 2, 4, 5, 6]


def random_foundation(seed=5, modes=40, damping="structural", scale=1.0):
    """Modes of about the size of the reference housing's."""
    rng = np.random.default_rng(seed)
    frequency = np.sort(rng.uniform(50.0, 2500.0, modes))
    return Foundation(frequency, scale * 0.03 * rng.standard_normal((modes, 6)), 0.02, damping)


@pytest.mark.parametrize("damping", ["structural", "viscous"])
def test_the_compliance_is_reciprocal_and_passive(damping):
    """Velocity per force iωS: equal both ways, and no force takes power out of it at any frequency."""
    compliance = random_foundation(damping=damping).compliance_m_per_n(FREQUENCIES_HZ)
    assert np.allclose(compliance, compliance.swapaxes(1, 2), rtol=1e-12, atol=0.0)
    mobility = 2j * np.pi * FREQUENCIES_HZ[:, None, None] * compliance
    least = np.linalg.eigvalsh(mobility.real).min(axis=1)
    assert (least >= -1e-12 * np.abs(mobility).max(axis=(1, 2))).all()


def test_a_very_stiff_housing_is_one_way_coupling():
    """A compliance smaller by 1e-8 than the housing's moves a bearing by 1e-8 of what it did."""
    gears = reference_system()
    stiff = replace(gears, foundation=random_foundation(scale=1e-4))
    ratio = stiff.receptance_m_per_n(FREQUENCIES_HZ) / gears.receptance_m_per_n(FREQUENCIES_HZ)
    assert np.abs(ratio - 1.0).max() < 1e-5
    one, two = (steady_state(system, 525.0, RATED_TORQUE_N_M) for system in (gears, stiff))
    assert two.dte_pp_m == pytest.approx(one.dte_pp_m, rel=1e-5)
    forces = [bearing_forces(*pair).amplitude_n[..., :8] for pair in ((gears, one), (stiff, two))]
    assert np.abs(forces[1] - forces[0]).max() < 1e-5 * np.abs(forces[0]).max()
    found = [abs(values) for values in (one.floquet_max,)]
    assert stiff.main_mesh_poles.poles.size < 12
    assert found[0] < two.floquet_max < 1.0  # the housing rings down by itself, and slower than the gears


def test_a_free_mass_as_housing_is_two_masses_on_a_spring():
    """One direction alone: shaft m on K + iωC on a mass M that nothing holds."""
    gears = reference_system(bearing_damping_ratio=0.03)
    mass = 300.0
    shapes = np.zeros((1, 6))
    shapes[0, 1] = 1.0 / math.sqrt(mass)  # along y of the pinion
    system = replace(gears, foundation=Foundation(np.array([0.01]), shapes, 1e-6))
    omega = 2.0 * np.pi * FREQUENCIES_HZ
    spring = gears.bearing_stiffness_n_per_m[1] + 1j * omega * gears.bearing_damping_n_s_per_m[1]
    own = gears.masses_kg[0]
    # [K - ω²m, -K; -K, K - ω²M] x = [f, 0]
    shaft = (spring - omega**2 * mass) / ((spring - omega**2 * own) * (spring - omega**2 * mass) - spring**2)
    carried = spring * (1.0 - spring / (spring - omega**2 * mass)) * shaft
    direction = -gears.direction_vector[1]
    moved, force = system.per_mesh_force(FREQUENCIES_HZ)
    assert moved[:, 1] == pytest.approx(direction * shaft, rel=1e-6)  # the spring to the ground: (0.01 Hz / 20 Hz)²
    assert force[:, 1] == pytest.approx(direction * carried, rel=1e-6)
    other = gears.per_mesh_force(FREQUENCIES_HZ)
    rest = [0, 2, 3, 4, 5]
    assert moved[:, rest] == pytest.approx(other[0][:, rest], rel=1e-12)
    assert force[:, rest] == pytest.approx(other[1][:, rest], rel=1e-12)


def test_the_receptance_is_that_of_the_whole_matrix():
    """δ from all coordinates and modes at once, without the bearings' compliance being inverted anywhere."""
    held = random_foundation(damping="structural")
    system = replace(reference_system(), foundation=held)
    reduced = system.reduced
    count = 7 + held.frequency_hz.size
    against = np.zeros((6, count))
    against[:, :6], against[:, 7:] = np.eye(6), -held.shapes.T
    direction = np.concatenate([reduced.direction, np.zeros(held.frequency_hz.size)])
    own = (2.0 * np.pi * held.frequency_hz) ** 2 * (1.0 + 1j * held.loss_factor)
    for frequency in (60.0, 175.0, 525.0, 1600.0):
        omega = 2.0 * np.pi * frequency
        bearing = reduced.stiffness[:6] + 1j * omega * reduced.damping[:6]
        matrix = against.T @ np.diag(bearing) @ against + np.diag(np.concatenate([np.zeros(7), own]))
        matrix -= omega**2 * np.diag(np.concatenate([reduced.masses, np.ones(held.frequency_hz.size)]))
        answer = np.linalg.solve(matrix, -direction)
        assert system.receptance_m_per_n(frequency) == pytest.approx(-direction @ answer, rel=1e-9)
        _, force = system.per_mesh_force(np.array([frequency]))
        assert force[0] == pytest.approx(bearing * (against @ answer), rel=1e-9)


@pytest.mark.parametrize("damping", ["structural", "viscous"])
@pytest.mark.parametrize("mesh_hz", [262.0, 525.0])
def test_the_power_into_gears_and_housing_is_what_they_lose(damping, mesh_hz, conformance):
    """What the mesh force does on the line of action goes into the bearings' dampers and the housing's losses."""
    held = random_foundation(damping=damping)
    system = replace(reference_system(helix_angle_deg=12.0), foundation=held)
    state = steady_state(system, mesh_hz, RATED_TORQUE_N_M)
    frequency, force = state.lines.frequency_hz, state.lines.force_n
    omega = 2.0 * np.pi * frequency
    delta = -system.receptance_m_per_n(frequency) * force
    into = 0.5 * np.sum((-force * np.conj(1j * omega * delta)).real)
    forces = bearing_forces(system, state).amplitude_n.reshape(6, -1)
    stiffness, damper = (
        np.array(v)[:, None] for v in (system.bearing_stiffness_n_per_m, system.bearing_damping_n_s_per_m)
    )
    deflection = forces / (stiffness + 1j * omega * damper)
    in_bearings = 0.5 * np.sum(damper * omega**2 * np.abs(deflection) ** 2)
    own = 2.0 * np.pi * held.frequency_hz[:, None]
    amplitude = np.abs(
        held.modal_receptance(frequency).T * (held.shapes.T[:, :, None] * forces[:, None, :]).sum(axis=0)
    )
    per_square = held.loss_factor * (own**2 * omega if damping == "structural" else own * omega**2)
    in_housing = 0.5 * np.sum(per_square * amplitude**2)
    assert in_bearings > 0.01 * into
    assert in_housing > 0.01 * into
    what = f"power into gears and housing over what they lose, {damping}, {mesh_hz:g} Hz"
    conformance(what, 1.0, into / (in_bearings + in_housing), 1e-9, "1", "law: conservation of energy")


def test_the_mean_does_not_change():
    gears = reference_system()
    system = replace(gears, foundation=random_foundation())
    one, two = (steady_state(held, 349.9, RATED_TORQUE_N_M) for held in (gears, system))
    assert two.mean_force_n == pytest.approx(one.mean_force_n, rel=1e-9)
    means = [bearing_forces(*pair).mean_n for pair in ((gears, one), (system, two))]
    assert means[1] == pytest.approx(means[0], rel=1e-9)


class _StillBeyond(Foundation):
    """Seats that stand still beyond a frequency."""

    def compliance_m_per_n(self, frequency_hz):
        whole = super().compliance_m_per_n(frequency_hz)
        whole[np.asarray(frequency_hz) > 2500.0] = 0.0
        return whole


@pytest.mark.parametrize("mesh_hz", [175.0, 437.0, 1001.0])
def test_what_stands_for_the_housing_beyond_its_modes_hardly_matters(mesh_hz):
    """Modal sum or rigid seats beyond 2.5 kHz: 0.5 % of the peak to peak, 0.05 dB of the forces up to there."""
    held = random_foundation()
    found = []
    for kind in (Foundation, _StillBeyond):
        system = replace(reference_system(0.5), foundation=kind(held.frequency_hz, held.shapes, held.loss_factor))
        state = balanced_state(system, mesh_hz, RATED_TORQUE_N_M)
        forces = bearing_forces(system, state)
        below = forces.frequency_hz <= 2500.0
        found.append((state.dte_pp_m, np.linalg.norm(forces.amplitude_n[..., below])))
    (swing, force), (other_swing, other_force) = found
    assert other_swing == pytest.approx(swing, rel=5e-3)
    assert 20.0 * abs(math.log10(other_force / force)) < 0.05


def test_a_motion_that_needs_integration_is_found_on_a_housing_too():
    """Rattling gears, for a few periods: the strongest lines of the record, and bearing forces of each of them."""
    system = replace(reference_system(0.1, transmission_error_m=(8e-6,)), foundation=random_foundation(modes=6))
    state = steady_state(system, 1200.0, 300.0, most_periods=128)
    assert state.method == "time_integration"
    assert state.separates
    forces = bearing_forces(system, state)
    assert np.isfinite(forces.amplitude_n).all()
    assert forces.amplitude_n.shape == (2, 3, state.lines.frequency_hz.size)
    assert balanced_state(system, 1200.0, 300.0) is None or not state.is_periodic

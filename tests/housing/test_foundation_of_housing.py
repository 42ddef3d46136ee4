"""The reference drive in a small housing of finite elements, coupled both ways: what the coupling's choices are worth.

The tests of the gears prove the coupled motion for given modes. Here modes are few and end early: what stands for the
housing beyond them, viscous dampers in the multipliers, and modes that these take as ringing down by themselves.
Figures for the reference housing, whose modes take minutes, are at `tdacoustic.gears.foundation.CORRECTION_LOSS`.
"""

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from reference_housing import small_box

from tdacoustic.gears import Foundation, balanced_state, bearing_forces
from tdacoustic.gears.mesh_poles import MeshPoles
from tdacoustic.housing import foundation_of, housing_modes

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "gears"))
from reference_drive import RATED_TORQUE_N_M, reference_system

MESH_HZ = (175.0, 262.5, 349.9, 437.4, 524.9, 800.0)
HIGHEST_HZ = 900.0
EDGE_M = 0.2
"""As coarse as seats allow: both ranges are of one and the same grid."""


@pytest.fixture(scope="module")
def modes():
    pytest.importorskip("ngsolve")
    return housing_modes(small_box(), HIGHEST_HZ, edge_m=EDGE_M, order=3)


@pytest.fixture(scope="module")
def held(modes):
    return foundation_of(modes.box, modes, 0.02)


@pytest.fixture(scope="module")
def more():
    """The same housing with modes to twice the frequency."""
    pytest.importorskip("ngsolve")
    modes = housing_modes(small_box(), 2.0 * HIGHEST_HZ, edge_m=EDGE_M, order=3)
    return foundation_of(modes.box, modes, 0.02)


def motion(foundation, helix_angle_deg, mesh_hz):
    """Peak to peak of δ, and the bearing forces up to the highest frequency."""
    system = replace(reference_system(helix_angle_deg), foundation=foundation)
    state = balanced_state(system, mesh_hz, RATED_TORQUE_N_M)
    forces = bearing_forces(system, state)
    return state.dte_pp_m, float(np.linalg.norm(forces.amplitude_n[..., forces.frequency_hz <= HIGHEST_HZ]))


@pytest.mark.parametrize("helix_angle_deg", [0.1, 4.0])
def test_further_modes_change_little(held, more, helix_angle_deg):
    """The bounds of the reference housing: 2.3 % and 0.3 dB."""
    for mesh_hz in MESH_HZ:
        (swing, force), (finer, finer_force) = (motion(one, helix_angle_deg, mesh_hz) for one in (held, more))
        assert swing == pytest.approx(finer, rel=0.025)
        assert abs(20.0 * math.log10(force / finer_force)) < 0.3


@pytest.mark.parametrize("helix_angle_deg", [0.1, 4.0])
def test_viscous_dampers_change_little(held, helix_angle_deg):
    viscous = replace(held, damping="viscous")
    for mesh_hz in MESH_HZ:
        (swing, force), (other, other_force) = (motion(one, helix_angle_deg, mesh_hz) for one in (held, viscous))
        assert swing == pytest.approx(other, rel=1e-3)
        assert abs(20.0 * math.log10(force / other_force)) < 0.15


def test_corrections_are_no_resonances(modes, held):
    """They are damped by themselves, and below the modes' range they still make the static response exact."""
    count = len(modes.frequency_hz) - modes.natural
    assert held.corrections == count > 0
    assert (held.loss_factors[-count:] == 0.3).all()
    assert (held.loss_factors[:-count] == 0.02).all()
    sharp = Foundation(held.frequency_hz, held.shapes, 0.02)
    static = [one.compliance_m_per_n(0.0)[0].real for one in (held, sharp)]
    assert static[0] == pytest.approx(static[1], rel=1e-3)
    peak = held.frequency_hz[-count]
    loudest = [np.abs(one.compliance_m_per_n(peak)).max() for one in (held, sharp)]
    assert loudest[0] < 0.5 * loudest[1]


def test_the_largest_multiplier_needs_no_weak_modes(held):
    """Modes with less than 1e-4 of the mesh's energy, as ringing down by themselves or in the motion."""
    system = replace(reference_system(0.1), foundation=held)
    every = replace(system)
    every.__dict__["main_mesh_poles"] = MeshPoles.of(every, 0.0)
    assert system.main_mesh_poles.poles.size < every.main_mesh_poles.poles.size
    for mesh_hz in (262.5, 800.0):
        found = [balanced_state(one, mesh_hz, RATED_TORQUE_N_M).floquet_max for one in (system, every)]
        assert found[0] == pytest.approx(found[1], abs=1e-4)


def test_springs_to_the_frame_are_soft_and_the_bearings_are_counted_once(modes, held):
    """The rigid box on its springs makes most of the static compliance: no spring of 1e9 N/m holds the housing."""
    rigid = Foundation(held.frequency_hz[:6], held.shapes[:6], 0.02).compliance_m_per_n(0.0)[0].real
    whole = np.diag(held.compliance_m_per_n(0.0)[0].real)
    assert (np.diag(rigid) > 0.5 * whole).all()
    four_seats_and_hanger = 5.0 * 2e7
    assert (whole > 0.9 / four_seats_and_hanger).all()
    moving = (held.shapes[:6] ** 2).sum(axis=0)
    assert (moving > 0.95 / modes.mass_kg).all()  # a free mass; that it turns too adds

"""Bars and blocks with closed solutions: stiffness at rest, cantilevers, Lamé's modes, and where the power goes."""

import math

import numpy as np
import pytest
from plates import DENSITY_KG_M3, HELD, MODULUS_PA, plate_modes, plate_structure
from reference_housing import small_box

from tdacoustic.housing.box_modes import box_structure, expected_modes
from tdacoustic.housing.eigenmodes import natural_modes, residual_modes, static_deflections
from tdacoustic.housing.plane_grid import rectangle
from tdacoustic.housing.solid_grid import box_grid

pytest.importorskip("ngsolve", reason="ngsolve (extra housing) is not installed")

LENGTH_M, WIDTH_M, HEIGHT_M = 1.0, 0.04, 0.03
SHEAR_PA = MODULUS_PA / 2.6
TIMOSHENKO = "literature: Timoshenko beam, shear factor of Cowper, J. Appl. Mech. 33 (1966) 335"
COWPER = 10.0 / 12.0  # ν = 0


@pytest.fixture(scope="module")
def cantilever():
    """A bar along x, held at its left end; ν = 0, so that what holds it does not hinder its contraction."""

    def left(points):
        return points[:, 0] < -0.499 * LENGTH_M

    outline = rectangle(LENGTH_M, WIDTH_M, 0.04)
    return plate_structure(outline, HEIGHT_M, 0.04, {"rim x": (HELD,) * 3}, poisson=0.0, held=left)


def bending(thickness_m, across_m):
    """E I and κ G A of a bar that bends along its thickness."""
    return MODULUS_PA * across_m * thickness_m**3 / 12.0, COWPER * 0.5 * MODULUS_PA * across_m * thickness_m


def test_a_cantilever_under_a_spread_force_gives_way_as_a_beam(cantilever, conformance):
    # uniformly spread: the mean deflection is L³/(20 E I) + L/(3 κ G A), the mean stretch L/(3 E A)
    found = cantilever.loads @ static_deflections(cantilever).T
    assert np.abs(found - np.diag(np.diag(found))).max() < 1e-3 * found.max()
    expected = [LENGTH_M / (3.0 * MODULUS_PA * WIDTH_M * HEIGHT_M)]
    for thick, wide in ((WIDTH_M, HEIGHT_M), (HEIGHT_M, WIDTH_M)):
        stiffness, shear = bending(thick, wide)
        expected.append(LENGTH_M**3 / (20.0 * stiffness) + LENGTH_M / (3.0 * shear))
    for axis, (one, got) in enumerate(zip(expected, np.diag(found), strict=True)):
        conformance(f"mean compliance of a cantilever along {'xyz'[axis]}", one, got, 0.001 * one, "m/N", TIMOSHENKO)


def test_a_cantilever_swings_as_a_beam(cantilever, conformance):
    found, _ = natural_modes(cantilever, 320.0, 8)
    roots = (1.875104, 4.694091)
    expected = []
    for thick, wide in ((HEIGHT_M, WIDTH_M), (WIDTH_M, HEIGHT_M)):
        speed = math.sqrt(bending(thick, wide)[0] / (DENSITY_KG_M3 * thick * wide))
        expected += [root**2 * speed / (2.0 * math.pi * LENGTH_M**2) for root in roots]
    assert len(found) == 4
    for number, (one, got) in enumerate(zip(sorted(expected), found, strict=True)):
        # Euler and Bernoulli leave out shear and turning, 0.6 % at the second modes here
        conformance(
            f"cantilever, mode {number + 1}",
            one,
            got,
            0.008 * one,
            "Hz",
            "analytic: Euler-Bernoulli beam, clamped and free",
        )


@pytest.mark.parametrize("thickness_m", [0.05, 0.1])
def test_lames_mode_of_a_square_block_is_met(conformance, thickness_m):
    """An isochoric mode that leaves all faces free of traction: f = c_s / (√2 a), whatever thickness and ν."""
    side, soft = 0.2, 1e3
    expected = math.sqrt(SHEAR_PA / DENSITY_KG_M3) / (math.sqrt(2.0) * side)
    found = plate_modes(rectangle(side, side, 0.07), thickness_m, 0.07, 1.1 * expected, {"plate": (soft,) * 3})
    got = found[np.abs(found - expected).argmin()]
    what = f"Lamé's mode of a block of {thickness_m:g} m"
    conformance(
        what, expected, got, 5e-4 * expected, "Hz", "literature: G. Lamé, Leçons sur la théorie de l'élasticité (1852)"
    )


@pytest.fixture(scope="module")
def coarse():
    """A small box on a coarse grid: matrices, natural modes and the static correction."""
    box = small_box()
    structure = box_structure(box, box_grid(box, 0.15), 3)
    frequency, vectors = natural_modes(structure, 900.0, expected_modes(box, 900.0))
    further, residual = residual_modes(structure, frequency, vectors)
    return structure, np.concatenate([frequency, further]), np.vstack([vectors, residual])


def test_modes_are_orthogonal_in_mass_and_stiffness(coarse):
    structure, frequency, modes = coarse
    assert modes @ structure.applied(structure.mass, modes).T == pytest.approx(np.eye(len(modes)), abs=1e-6)
    assert modes @ structure.massed(modes).T == pytest.approx(np.eye(len(modes)), abs=1e-6)
    omega = 2.0 * np.pi * frequency
    stiffness = modes @ structure.applied(structure.stiffness, modes).T / np.outer(omega, omega)
    assert stiffness == pytest.approx(np.eye(len(modes)), abs=1e-3)


def test_what_the_forces_put_in_is_what_the_loss_factor_takes(coarse):
    """P = Re(F* v) / 2 = η ω u* K u / 2, with the matrix and the field of displacement."""
    structure, natural_hz, modes = coarse
    rng = np.random.default_rng(5)
    force = rng.standard_normal(12) + 1j * rng.standard_normal(12)
    for frequency, loss in ((70.0, 0.02), (450.0, 0.02), (800.0, 0.1)):
        omega = 2.0 * np.pi * frequency
        receptance = 1.0 / ((2.0 * np.pi * natural_hz) ** 2 * (1.0 + 1j * loss) - omega**2)
        field = (receptance * (modes @ structure.loads.T @ force)) @ modes
        put_in = 0.5 * (force.conj() @ (1j * omega * (structure.loads @ field))).real
        stretched = sum(
            (part[None] @ structure.applied(structure.stiffness, part[None]).T).item()
            for part in (np.ascontiguousarray(field.real), np.ascontiguousarray(field.imag))
        )
        assert put_in > 0.0
        assert 0.5 * loss * omega * stretched == pytest.approx(put_in, rel=1e-4)

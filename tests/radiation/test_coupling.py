"""Burton and Miller's coupling: the size and the sign it must have with e^{+jωt}, b = +1/k."""

import numpy as np
import pytest
from scipy.special import spherical_jn, spherical_yn

from tdacoustic.radiation.boundary_elements import ExteriorProblem
from tdacoustic.radiation.grids import box_surface, sphere_surface

IMPEDANCE = 413.0
FIRST = np.pi
"""First zero of j0: the pulsating sphere's ka at which the plain equation has no single solution."""


def of_coupling(part):
    """Problems whose b is this part of 1/k."""

    class Changed(ExteriorProblem):
        @property
        def coupling_m(self):
            return part / self.wave_number_rad_m

    return Changed


def eigenvalues(problem):
    """Of the systems ½ - D + jbH of all parities."""
    n = len(problem.surface.panels)
    matrices, _ = problem._assembled(problem.surface.centres_m[:n], problem.surface.normals[:n], True)
    return np.concatenate([np.linalg.eigvals(0.5 * np.eye(n) + matrix) for matrix in matrices])


def worst(kind):
    """Error of the pulsating sphere's pressure at 2 m, at and beside its first irregular wave number."""
    surface, found = sphere_surface(1.0, 12), []
    for k in FIRST * np.array([0.9975, 1.0, 1.0025, 1.005]):
        # the grid's own is a little above that of the sphere
        outgoing = spherical_jn(0, [2.0 * k, k]) - 1j * spherical_yn(0, [2.0 * k, k])
        slope = spherical_jn(0, k, True) - 1j * spherical_yn(0, k, True)
        exact = -1j * IMPEDANCE * outgoing[0] / slope
        pressure = kind(surface, k, IMPEDANCE).transfer([[2.0, 0.0, 0.0]], np.ones((surface.n_panels, 1)))[0, 0]
        found.append(abs(pressure / exact - 1.0))
    return max(found)


def test_the_error_at_an_irregular_wave_number_is_that_of_the_coupling():
    """None fails, a tenth of it is worse than all of it."""
    errors = {part: worst(of_coupling(part)) for part in (0.0, 0.1, 1.0)}
    assert errors[0.0] > 0.3
    assert errors[0.1] < 0.1
    assert errors[1.0] < 0.04


@pytest.mark.parametrize("ka", [FIRST, 5.0, 7.0])
def test_only_the_right_sign_leaves_the_eigenvalues_on_one_side(ka):
    """As in S. Marburg, J. Comput. Acoust. 24 (2016) 1550016.

    Both signs have one solution, and on a sphere the same condition: the eigenvalues are h_n' (j_n ± j j_n') but for a
    common factor. With the right sign the two phases undo each other, and all have a real part near to ½ or above;
    with the other some are turned to the negative side, at ka = 1 not yet (measured), at π already.
    """
    surface = sphere_surface(1.0, 12)
    right, wrong = (eigenvalues(of_coupling(sign)(surface, ka, IMPEDANCE, precision="double")) for sign in (1.0, -1.0))
    assert right.real.min() > 0.45
    assert wrong.real.min() < -0.3
    assert eigenvalues(ExteriorProblem(surface, ka, IMPEDANCE, precision="double")).real.min() > 0.45


def test_the_right_sign_on_the_box():
    surface, wave_number = box_surface((0.45, 1.0, 0.9), 0.07), 2.0 * np.pi * 525.0 / 343.2
    right, wrong = (
        eigenvalues(of_coupling(sign)(surface, wave_number, IMPEDANCE, precision="double")) for sign in (1.0, -1.0)
    )
    assert right.real.min() > 0.35
    assert wrong.real.min() < -0.3

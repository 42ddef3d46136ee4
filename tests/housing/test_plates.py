"""The solid elements on plates with known modes: no locking in thin walls."""

import math

import numpy as np
import pytest
from plates import DENSITY_KG_M3, HELD, MODULUS_PA, hertz, plate_modes

from tdacoustic.housing.plane_grid import circle, rectangle

pytest.importorskip("ngsolve", reason="ngsolve (extra housing) is not installed")

LEISSA = "literature: Leissa, Vibration of Plates, NASA SP-160 (1969) and J. Sound Vib. 31 (1973) 257"
THICKNESS_M = 0.005
ALL = (HELD, HELD, HELD)


def mindlin_hz(width_m, height_m, thickness_m, highest_hz, poisson=0.3):
    """Bending modes of a simply supported Mindlin plate, shear factor 5/(6 - ν)."""
    shear = 5.0 / (6.0 - poisson) * MODULUS_PA / (2.0 * (1.0 + poisson)) * thickness_m
    bending = MODULUS_PA * thickness_m**3 / (12.0 * (1.0 - poisson**2))
    mass, turning = DENSITY_KG_M3 * thickness_m, DENSITY_KG_M3 * thickness_m**3 / 12.0
    found = []
    for m in range(1, 30):
        for n in range(1, 30):
            k2 = (m * math.pi / width_m) ** 2 + (n * math.pi / height_m) ** 2
            b = mass * (bending * k2 + shear) + shear * k2 * turning
            c = shear * k2 * (bending * k2 + shear) - shear**2 * k2
            found.append(math.sqrt((b - math.sqrt(b * b - 4.0 * mass * turning * c)) / (2.0 * mass * turning)))
    frequencies = np.sort(found) / (2.0 * math.pi)
    return frequencies[frequencies < highest_hz]


@pytest.mark.parametrize("faces", ["triangles", "quadrilaterals"])
def test_a_simply_supported_plate_like_a_wall_of_the_housing(conformance, faces):
    # 0.45 m x 0.9 m x 10 mm, edges of ten thicknesses; from the second mode in the plane on (2.9 kHz) orders would mix
    springs = {"rim x": (1e-6, HELD, HELD), "rim y": (HELD, 1e-6, HELD)}
    found = plate_modes(rectangle(0.45, 0.9, 0.1), 0.010, 0.1, 2000.0, springs, faces, expected=26)
    expected = mindlin_hz(0.45, 0.9, 0.010, 2000.0)
    bending = [found[np.abs(found - one).argmin()] for one in expected]
    for number in (0, 4, 9, len(expected) - 1):
        what = f"simply supported plate, mode {number + 1}, {faces}"
        one = expected[number]
        conformance(what, one, bending[number], 0.003 * one, "Hz", "literature: Mindlin, J. Appl. Mech. 18 (1951) 31")
    assert np.abs(np.array(bending) / expected - 1.0).max() < 0.003


def test_a_clamped_square_plate(conformance):
    springs = {"rim x": ALL, "rim y": ALL}
    found = plate_modes(rectangle(1.0, 1.0, 0.125), THICKNESS_M, 0.125, 180.0, springs, band_m=THICKNESS_M)
    for number, parameter in enumerate((35.992, 73.413, 73.413, 108.27, 131.64, 132.24)):
        expected = hertz(parameter, 1.0, THICKNESS_M)
        conformance(f"clamped square plate, mode {number + 1}", expected, found[number], 0.01 * expected, "Hz", LEISSA)


def test_a_free_square_plate(conformance):
    # springs of 0.2 Hz hold it: six modes of the rigid plate come first
    soft = DENSITY_KG_M3 * THICKNESS_M * (2.0 * math.pi * 0.2) ** 2
    found = plate_modes(rectangle(1.0, 1.0, 0.125), THICKNESS_M, 0.125, 100.0, {"plate": (soft,) * 3}, expected=20)
    assert found[5] < 0.5
    # the table's are upper bounds by Ritz, up to 1 % high by later work (19.596 for the second)
    for number, parameter in enumerate((13.489, 19.789, 24.432, 35.024, 35.024, 61.526)):
        expected = hertz(parameter, 1.0, THICKNESS_M)
        conformance(
            f"free square plate, mode {number + 1}", expected, found[6 + number], 0.012 * expected, "Hz", LEISSA
        )


def test_a_clamped_circular_plate(conformance):
    outline = circle(((0.0, 0.0), 0.5), 0.07)
    found = plate_modes(outline, THICKNESS_M, 0.125, 260.0, {"rim x": ALL, "rim y": ALL})
    for number, parameter in enumerate((10.216, 21.26, 21.26, 34.88, 34.88, 39.771)):
        expected = hertz(parameter, 0.5, THICKNESS_M)
        conformance(
            f"clamped circular plate, mode {number + 1}", expected, found[number], 0.01 * expected, "Hz", LEISSA
        )


def test_a_free_circular_plate(conformance):
    poisson = 0.33  # that of the table
    soft = DENSITY_KG_M3 * THICKNESS_M * math.pi / 4.0 * (2.0 * math.pi * 0.2) ** 2
    outline = circle(((0.0, 0.0), 0.5), 0.07)
    found = plate_modes(outline, THICKNESS_M, 0.125, 120.0, {"plate": (soft,) * 3}, poisson=poisson, expected=20)
    for number, parameter in ((0, 5.253), (1, 5.253), (2, 9.084), (3, 12.23), (4, 12.23)):
        expected = hertz(parameter, 0.5, THICKNESS_M, poisson)
        what = f"free circular plate, mode {number + 1}"
        conformance(what, expected, found[6 + number], 0.01 * expected, "Hz", LEISSA)


def test_low_orders_lock_where_order_4_does_not():
    # edges of 50 thicknesses, the fourth mode; order 2 has not even four modes below 1.2 kHz
    springs = {"rim x": ALL, "rim y": ALL}
    expected = hertz(108.27, 1.0, THICKNESS_M)
    outline = rectangle(1.0, 1.0, 0.25)
    found = {
        order: plate_modes(outline, THICKNESS_M, 0.25, 1200.0, springs, order=order, expected=40) for order in (2, 3, 4)
    }
    assert len(found[2]) < 4
    assert found[3][3] > 1.2 * expected
    assert found[4][3] < 1.04 * expected

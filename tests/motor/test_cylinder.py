"""Radiation of a cylinder: limits, an independent computation to many digits, and the forms of the textbooks."""

import math

import numpy as np
import pytest
from scipy.special import jvp, yvp

from tdacoustic.errors import MotorError
from tdacoustic.motor import relative_intensity

LARGE = "analytic: 2 / (pi x |H'|²) for large x, Hankel's expansion of the derivative (DLMF, 10.17.11)"
SMALL = "analytic: 2 / (pi x |H'|²) for small x, limiting forms (DLMF, 10.7(i))"

SIZES = np.logspace(-3, 3, 25)


def exactly(order, x):
    """The same coefficient with 60 digits."""
    mpmath = pytest.importorskip("mpmath")
    with mpmath.workdps(60):
        argument = mpmath.mpf(float(x))
        slope = (mpmath.hankel1(order - 1, argument) - mpmath.hankel1(order + 1, argument)) / 2
        return float(2 / (mpmath.pi * argument * abs(slope) ** 2))


@pytest.mark.parametrize("order", range(13))
def test_no_digit_is_lost_from_order_0_to_12_and_over_six_decades(order, conformance):
    found = relative_intensity(order, SIZES)
    expected = np.array([exactly(order, x) for x in SIZES])
    worst = float(np.abs(found / expected - 1.0).max())
    conformance(
        f"I_c, order {order}: largest relative error",
        0.0,
        worst,
        1e-11,
        "1",
        "program: mpmath, Hankel functions to 60 digits",
    )


@pytest.mark.parametrize("order", range(13))
def test_the_form_with_bessel_functions_is_the_same(order):
    x = np.logspace(-1, 3, 17)
    by_textbook = 2.0 / (math.pi * x * (jvp(order, x) ** 2 + yvp(order, x) ** 2))
    assert relative_intensity(order, x) == pytest.approx(by_textbook, rel=1e-10)


@pytest.mark.parametrize("order", range(13))
def test_a_large_cylinder_radiates_like_a_piston(order, conformance):
    got = float(relative_intensity(order, 1e3))
    # The next term of the asymptotic series is of (order/x)².
    conformance(f"I_c, order {order}, x = 1000", 1.0, got, 1e-6 + (order / 1e3) ** 2, "1", LARGE)


def test_a_small_pulsating_cylinder(conformance):
    got = float(relative_intensity(0, 1e-3)) / (0.5 * math.pi * 1e-3)
    conformance("I_c, order 0, x = 0.001, over πx/2", 1.0, got, 1e-5, "1", SMALL)


@pytest.mark.parametrize("order", range(1, 13))
def test_small_cylinders_of_higher_orders(order, conformance):
    x = 1e-3
    limit = 4.0 * math.pi * (0.5 * x) ** (2 * order + 1) / math.factorial(order) ** 2
    got = float(relative_intensity(order, x)) / limit
    tolerance = 2e-5  # the next term, of x² ln x for order 1
    conformance(f"I_c, order {order}, x = 0.001, over its limit", 1.0, got, tolerance, "1", SMALL)


@pytest.mark.parametrize(("order", "size"), [(-1, 1.0), (61, 1.0), (2, 0.0), (2, -1.0), (2, math.nan)])
def test_what_is_out_of_range_is_refused(order, size):
    with pytest.raises(MotorError, match=r"spatial order must be|k R must be"):
        relative_intensity(order, size)

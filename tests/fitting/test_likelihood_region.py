"""The region that data allow: the ellipse of a straight model, bounds, a bent valley, what nothing holds."""

import math

import numpy as np
import pytest

from tdacoustic.errors import FittingError
from tdacoustic.fitting import FreeParameter, fit
from tdacoustic.fitting.intervals import profile_intervals
from tdacoustic.fitting.likelihood_region import likelihood_region

RISE = 1.959963984540054**2


def straight(matrix, data):
    """Residuals of a model that is linear in a, b, c, ..."""
    return lambda values: matrix @ np.array([values[name] for name in sorted(values)]) - data


def free(n, **changes):
    return [FreeParameter("abcd"[k], 0.3, **{"low": -1000.0, "high": 1000.0, **changes}) for k in range(n)]


@pytest.mark.parametrize("n", [1, 2, 3])
def test_the_range_of_a_straight_number_is_its_normal_interval(n):
    random = np.random.default_rng(n)
    matrix, data = random.standard_normal((8, n)), random.standard_normal(8)
    residuals = straight(matrix, data)
    found = fit(residuals, free(n))
    region = likelihood_region(residuals, found, RISE, most=6000)
    best = np.linalg.lstsq(matrix, data, rcond=None)[0]
    covariance = np.linalg.inv(matrix.T @ matrix)
    for slopes in random.standard_normal((5, n)):
        half = math.sqrt(RISE * slopes @ covariance @ slopes)
        ends = region.inner @ slopes
        # rays in 48 directions of the plane miss the end by 1 - cos(3.75°), 160 in space by some 2 %
        assert ends.max() - slopes @ best == pytest.approx(half, rel=0.03)
        assert slopes @ best - ends.min() == pytest.approx(half, rel=0.03)
    assert region.risen[0] == pytest.approx(0.0, abs=1e-9)
    assert (region.risen <= RISE).all()
    direct = [((matrix @ place - data) ** 2).sum() - ((matrix @ best - data) ** 2).sum() for place in region.inner]
    assert region.risen == pytest.approx(direct, abs=1e-6)


def test_bounds_are_kept_and_an_optimum_on_one_has_a_region():
    matrix, data = np.eye(2), np.array([5.0, 0.0])  # the optimum lies at 5, the bound at 1
    residuals = straight(matrix, data)
    found = fit(residuals, free(2, low=-1.0, high=1.0))
    region = likelihood_region(residuals, found, RISE)
    assert found.values["a"] == pytest.approx(1.0)
    assert np.abs(region.inner).max() <= 1.0
    # beside the bound chi square rises as (5 - a)² - 16
    assert region.inner[:, 0].min() == pytest.approx(5.0 - math.sqrt(16.0 + RISE), abs=0.02)
    assert region.inner[:, 1].max() == pytest.approx(1.0)


def test_what_the_data_do_not_see_reaches_from_bound_to_bound():
    residuals = straight(np.array([[1.0, 0.0]]), np.array([0.0]))
    found = fit(residuals, free(2, low=-50.0, high=70.0))
    region = likelihood_region(residuals, found, RISE)
    assert (region.inner[:, 1].min(), region.inner[:, 1].max()) == (-50.0, 70.0)
    assert region.inner[:, 0].max() == pytest.approx(math.sqrt(RISE), rel=0.01)


def test_a_level_that_is_held_from_above_alone_has_an_open_end():
    # The sum of a known level of 80 dB and one that is silent or not: it may be anything below.
    def residuals(values):
        return np.array([10.0 * math.log10(1e8 + 10.0 ** (0.1 * values["a"])) - 80.0])

    found = fit(residuals, [FreeParameter("a", 60.0, -100.0, 100.0)])
    region = likelihood_region(residuals, found, RISE)
    assert region.inner.min() == -100.0
    assert region.inner.max() == pytest.approx(10.0 * math.log10(10.0 ** (8.0 + 0.1 * math.sqrt(RISE)) - 1e8), abs=0.05)


def test_a_bent_valley():
    # Rosenbrock's valley b = a²; the end of a is where chi square alone in a is risen, with b on the valley's floor.
    def residuals(values):
        return np.array([values["a"] - 1.0, 5.0 * (values["b"] - values["a"] ** 2)])

    found = fit(residuals, [FreeParameter("a", 0.5, -10.0, 10.0), FreeParameter("b", 0.5, -100.0, 100.0)])
    ends = {name: tuple(held) for name, held in profile_intervals(residuals, found).items()}
    region = likelihood_region(residuals, found, RISE, ends)
    assert region.inner[:, 0].max() == pytest.approx(1.0 + math.sqrt(RISE), abs=0.04)
    assert region.inner[:, 0].min() == pytest.approx(1.0 - math.sqrt(RISE), abs=0.04)
    assert region.inner[:, 1].max() == pytest.approx((1.0 + math.sqrt(RISE)) ** 2, rel=0.02)


def test_what_nothing_holds_has_no_region():
    residuals = straight(np.array([[1.0, 1.0]]), np.array([0.0]))
    found = fit(residuals, [FreeParameter("a", 0.0), FreeParameter("b", 0.0)])
    with pytest.raises(FittingError, match="neither the data nor bounds hold a, b"):
        likelihood_region(residuals, found, RISE)


def test_a_fit_that_moves_nothing_is_its_own_region():
    found = fit(lambda values: np.array([1.0]), [FreeParameter("a", 0.0, fixed=True)])
    region = likelihood_region(lambda values: np.array([1.0]), found, RISE)
    assert region.inner.shape == (1, 0)
    assert region.risen.tolist() == [0.0]

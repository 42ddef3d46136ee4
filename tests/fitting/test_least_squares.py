"""The fit beside scipy alone, exact linear algebra and a grid; priors, scales, expressions, and what cannot be told."""

import numpy as np
import pytest
from scipy.optimize import curve_fit

from tdacoustic.errors import FittingError
from tdacoustic.fitting import FreeParameter, fit
from tdacoustic.fitting.intervals import profile_intervals

X = np.linspace(0.0, 5.0, 30)


def decay(values):
    return values["size"] * np.exp(-values["rate"] * X)


@pytest.fixture(scope="module")
def measured():
    return 3.0 * np.exp(-0.7 * X) + 0.05 * np.random.default_rng(0).standard_normal(X.size)


def residuals_of(measured, sigma=0.05):
    return lambda values: (decay(values) - measured) / sigma


FREE = (FreeParameter("size", 1.0, 0.0, 10.0), FreeParameter("rate", 0.1, 1e-3, 10.0))


def test_the_same_as_scipy_alone(measured, conformance):
    found = fit(residuals_of(measured), FREE, starts=8)
    values, covariance = curve_fit(
        lambda x, size, rate: size * np.exp(-rate * x), X, measured, [1.0, 0.1], 0.05, absolute_sigma=True
    )
    errors = found.standard_errors()
    for index, name in enumerate(("size", "rate")):
        conformance(
            f"{name} of a decay", values[index], found.values[name], 1e-6, "1", "program: scipy.optimize.curve_fit"
        )
        error = float(np.sqrt(covariance[index, index]))
        conformance(
            f"standard error of {name}", error, errors[name], 1e-3 * error, "1", "program: scipy.optimize.curve_fit"
        )
    assert found.minima == ()
    assert found.rank == 2


def test_the_same_minimum_and_interval_as_on_a_grid(measured, conformance):
    residuals = residuals_of(measured)
    found = fit(residuals, FREE, starts=4)
    size, rate = np.meshgrid(np.linspace(2.8, 3.25, 451), np.linspace(0.66, 0.77, 441), indexing="ij")
    model = size[..., None] * np.exp(-rate[..., None] * X)
    chi = (((model - measured) / 0.05) ** 2).sum(axis=-1)
    assert found.chi_square <= chi.min()
    interval = profile_intervals(residuals, found)
    for name, grid, axis in (("size", size[:, 0], 1), ("rate", rate[0], 0)):
        profile = chi.min(axis=axis)
        inside = grid[profile <= chi.min() + 3.841459]
        for side, end, expected in zip(("lower", "upper"), interval[name], (inside[0], inside[-1]), strict=True):
            tolerance = 2.0 * float(grid[1] - grid[0])
            conformance(
                f"{side} end of the 95 % interval of {name}",
                expected,
                end,
                tolerance,
                "1",
                "independent: chi square on a grid of two parameters",
            )


def test_a_logarithmic_scale_changes_no_optimum(measured):
    plain = fit(residuals_of(measured), FREE)
    logarithmic = fit(residuals_of(measured), [FREE[0], FreeParameter("rate", 0.1, 1e-3, 10.0, scale="log")])
    assert logarithmic.values["rate"] == pytest.approx(plain.values["rate"], rel=1e-7)
    assert logarithmic.standard_errors()["rate"] == pytest.approx(plain.standard_errors()["rate"], rel=1e-4)


def test_a_prior_is_one_more_datum(conformance):
    # Straight line through the origin with one datum a·2 = 4 ± 0.5 and a prior a = 1 ± 0.5: exact by hand.
    # weights 2²/0.25 = 16 and 4: a = (16·2 + 4·1)/20 = 1.8, sigma 1/√20
    found = fit(lambda v: np.array([(2.0 * v["a"] - 4.0) / 0.5]), [FreeParameter("a", 0.0, prior=(1.0, 0.5))])
    conformance(
        "parameter fitted with a prior",
        1.8,
        found.values["a"],
        1e-9,
        "1",
        "analytic: one datum and a Gaussian prior, by hand",
    )
    conformance(
        "standard error of a parameter fitted with a prior",
        20.0**-0.5,
        found.standard_errors()["a"],
        1e-9,
        "1",
        "analytic: one datum and a Gaussian prior, by hand",
    )


def test_sigma_that_is_not_known_is_taken_from_the_misfit(measured):
    known = fit(residuals_of(measured), FREE)
    unknown = fit(residuals_of(measured, 1.0), FREE, known_sigma=False)
    factor = np.sqrt(known.chi_square / known.n_free)
    assert unknown.standard_errors()["size"] == pytest.approx(factor * known.standard_errors()["size"], rel=1e-5)


def test_an_expression_ties_a_parameter(measured):
    tied = FreeParameter("rate", 0.1, expression="0.25 * size")
    found = fit(residuals_of(measured), [FREE[0], tied])
    assert found.values["rate"] == pytest.approx(0.25 * found.values["size"], rel=1e-9)
    assert set(found.standard_errors()) == {"size"}


def test_a_product_of_two_parameters_is_of_rank_one(measured):
    def residuals(values):
        return (values["size"] * values["rate"] * np.exp(-0.7 * X) - measured) / 0.05

    found = fit(residuals, FREE, starts=6)
    assert found.rank == 1
    assert found.covariance is None
    assert found.standard_errors() is None
    assert len(found.minima) > 0  # each start ends elsewhere in the valley


def test_an_optimum_beyond_a_bound_ends_on_it(measured):
    found = fit(residuals_of(measured), [FreeParameter("size", 1.0, 0.0, 2.0), FREE[1]])
    assert found.values["size"] == pytest.approx(2.0, abs=1e-4)
    _, upper = profile_intervals(residuals_of(measured), found)["size"]
    assert upper is None


def test_a_robust_loss_leaves_an_outlier():
    x = np.arange(20.0)
    y = 2.0 * x
    y[7] += 100.0
    plain = fit(lambda v: v["a"] * x - y, [FreeParameter("a", 1.0)])
    robust = fit(lambda v: v["a"] * x - y, [FreeParameter("a", 1.0)], loss="soft_l1")
    assert abs(robust.values["a"] - 2.0) < 0.1 * abs(plain.values["a"] - 2.0)


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (lambda: FreeParameter("a", 3.0, 0.0, 1.0), "a: the initial value 3 is outside of its bounds, 0 to 1"),
        (lambda: FreeParameter("a", 0.5, 1.0, 0.0), "a: bounds must be ascending"),
        (lambda: FreeParameter("a", 0.5, prior=(0.0, 0.0)), "a: the prior's standard deviation must be > 0, got 0"),
        (lambda: FreeParameter("a", -1.0, scale="log"), 'a: scale = "log" needs values and bounds above 0'),
        (lambda: FreeParameter("a", float("nan")), "a: the initial value must be a number"),
        (lambda: fit(lambda v: np.zeros(0), [FreeParameter("a", 1.0)]), "no data to fit to"),
        (lambda: fit(lambda v: np.array([np.nan]), [FreeParameter("a", 1.0)]), "no number for some of the data"),
        (lambda: fit(lambda v: np.ones(3), [FreeParameter("a", 1.0)] * 2), "parameter 'a' is freed twice"),
        (lambda: fit(lambda v: np.ones(3), [FreeParameter("a", 1.0, expression="b +")]), "a: expression 'b \\+'"),
    ],
)
def test_what_cannot_be_fitted_is_refused(made, message):
    with pytest.raises(FittingError, match=message):
        made()

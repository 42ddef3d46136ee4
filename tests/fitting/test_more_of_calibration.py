"""Expressions, fitted scatter, offsets of campaigns, posterior, the next measurement, and the fleet after it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

import tdacoustic as td
from tdacoustic.drive import Receiver
from tdacoustic.errors import FittingError
from tdacoustic.fitting import FreeParameter, fit
from tdacoustic.fitting.calibration import calibrate_fleet, free_parameter
from tdacoustic.fitting.intervals import profile_intervals
from tdacoustic.fitting.measured_level import offset_name
from tdacoustic.fitting.next_measurement import Candidate
from tdacoustic.fitting.posterior import sample_posterior
from tdacoustic.fitting.settings import FitSettings, PosteriorSettings
from tdacoustic.fitting.transfer import transferred_priors

from .conftest import CONSTANT, DAMPING, GAIN

TRUTH = {CONSTANT: 0.0, DAMPING: 0.06}


def free_of(fleet, *keys, **changes):
    return [free_parameter(fleet, key, **changes) for key in keys]


def test_an_expression_and_an_auxiliary_parameter(shared_fleet, levels_of):
    first, second = (f"motor.excitation.{n}.sound_power_level_db" for n in (1, 2))
    truth = {**TRUTH, first: 101.0, second: 97.0}
    free = [
        *free_of(shared_fleet, CONSTANT, DAMPING),
        free_parameter(shared_fleet, "shift", initial=0.0, low=-20.0, high=20.0),
        free_parameter(shared_fleet, first, expression="104 + shift"),
        free_parameter(shared_fleet, second, expression="100 + shift"),
    ]
    found = calibrate_fleet(shared_fleet, levels_of(truth), free, FitSettings(0.0))
    values = {parameter.key: parameter for parameter in found.parameters}
    assert values["shift"].value == pytest.approx(-3.0, abs=0.01)
    assert values[first].value == pytest.approx(101.0, abs=0.01)
    assert values[first].stderr == pytest.approx(values["shift"].stderr, rel=1e-3)
    assert found.fleet.get(second).value == pytest.approx(97.0, abs=0.01)
    assert [parameter.key for parameter in found.moved] == [CONSTANT, DAMPING, "shift"]


def test_the_models_scatter_is_found_in_the_misfit(shared_fleet, levels_of):
    free = free_of(shared_fleet, CONSTANT)
    found = [
        calibrate_fleet(shared_fleet, levels_of(TRUTH, scatter_db=3.0, seed=seed), free, FitSettings(None))
        for seed in range(24)
    ]
    # 5 degrees of freedom each: the mean square of 24 is known within 13 % (one sigma)
    mean_square = np.mean([held.model_sigma_db**2 + 0.3**2 for held in found])
    assert np.sqrt(mean_square) == pytest.approx(3.0, rel=0.4)
    assert all(held.model_sigma_is_fitted for held in found)
    exact = calibrate_fleet(shared_fleet, levels_of(TRUTH), free, FitSettings(None))
    assert exact.model_sigma_db == 0.0


def test_no_more_levels_than_parameters_leave_no_scatter_to_fit(shared_fleet, levels_of):
    free = free_of(shared_fleet, CONSTANT, DAMPING)
    found = calibrate_fleet(shared_fleet, levels_of(TRUTH, [4, 5]), free, FitSettings(None))
    assert found.model_sigma_db == 4.0
    assert any("the model's scatter cannot be fitted: 2 conditions and 2 parameters" in doubt for doubt in found.doubts)


def test_campaigns_with_offsets_are_fitted_together(shared_fleet, levels_of):
    data = []
    for name, offset in (("first", 0.8), ("second", -0.8)):
        for datum in levels_of(TRUTH):
            condition = replace(datum.condition, name=f"{name}: {datum.condition.name}")
            level = datum.level_db + offset
            data.append(replace(datum, condition=condition, group=condition.name, level_db=level, campaign=name))
    offsets = [FreeParameter(offset_name(name), 0.0, -10.0, 10.0, (0.0, 1.0)) for name in ("first", "second")]
    found = calibrate_fleet(shared_fleet, data, [*free_of(shared_fleet, CONSTANT, DAMPING), *offsets], FitSettings(0.0))
    values = {parameter.key: parameter.value for parameter in found.parameters}
    # of the two offsets the mean stays with the prior, and their difference is found
    assert values[offset_name("first")] == pytest.approx(0.8, abs=0.02)
    assert values[offset_name("second")] == pytest.approx(-0.8, abs=0.02)
    assert values[CONSTANT] == pytest.approx(0.0, abs=0.02)
    assert not any("directions" in doubt or "the same to the model" in doubt for doubt in found.doubts)
    assert not any(parameter.key.startswith("level_offset") for parameter in found.fleet.parameters())


def test_an_earlier_fleet_is_the_prior_at_a_discount(shared_fleet, levels_of):
    free = free_of(shared_fleet, CONSTANT, DAMPING)
    first = calibrate_fleet(shared_fleet, levels_of(TRUTH), free, FitSettings(1.0), origin="calibrated to the first")
    carried, transferred = transferred_priors(free, first.fleet, 2.0)
    held = transferred[0]
    assert (held.key, held.origin) == (CONSTANT, "calibrated to the first")
    assert held.prior_sigma == pytest.approx(2.0 * first.parameters[0].stderr)
    assert carried[0].prior == pytest.approx((held.earlier, held.prior_sigma))
    assert carried[1].prior[0] == pytest.approx(np.log(first.parameters[1].value))
    other = levels_of({CONSTANT: 12.0, DAMPING: 0.06}, [3, 4, 5])
    second = calibrate_fleet(shared_fleet, other, carried, FitSettings(1.0), transferred=transferred)
    apart = second.transferred[0]
    assert apart.alone == pytest.approx(12.0, abs=0.1)
    assert apart.difference > 2.5
    assert held.earlier < second.parameters[0].value < 12.0
    assert any(f"{CONSTANT} is 12" in doubt and "standard deviations apart" in doubt for doubt in second.doubts)
    with pytest.raises(FittingError, match=r"prior_discount must be >= 1, got 0.5"):
        transferred_priors(free, first.fleet, 0.5)
    with pytest.raises(FittingError, match=r"was calibrated there"):
        transferred_priors(free, shared_fleet, 2.0)


def test_the_posterior_of_a_straight_line_is_the_exact_one(conformance):
    # one Gaussian datum and even bounds far away: mean 2, sigma 0.5, by hand
    free = [FreeParameter("a", 1.0, -20.0, 20.0)]

    def residuals(values):
        return np.array([(values["a"] - 2.0) / 0.5])

    posterior = sample_posterior(residuals, fit(residuals, free), PosteriorSettings(16, 3000))
    (held,) = posterior.parameters
    assert posterior.has_converged
    error = 0.5 / np.sqrt(held.effective_samples)
    conformance(
        "median of a Gaussian posterior",
        2.0,
        held.median,
        5.0 * error,
        "1",
        "analytic: Gaussian posterior of one datum",
    )
    for index, sign in ((0, -1.0), (1, 1.0)):
        expected = 2.0 + sign * 0.5 * norm.ppf(0.975)
        conformance(
            f"{'lower' if sign < 0.0 else 'upper'} end of its 95 % interval",
            expected,
            held.ci95[index],
            12.0 * error,
            "1",
            "analytic: Gaussian posterior of one datum",
        )
    again = sample_posterior(residuals, fit(residuals, free), PosteriorSettings(16, 3000))
    assert np.array_equal(again.samples, posterior.samples)


def test_a_posterior_too_short_is_said(shared_fleet, levels_of):
    settings = FitSettings(1.0, posterior=PosteriorSettings(8, 60))
    found = calibrate_fleet(shared_fleet, levels_of(TRUTH), free_of(shared_fleet, CONSTANT, DAMPING), settings)
    assert not found.posterior.has_converged
    assert any("the posterior has not converged: 45 steps are " in doubt for doubt in found.doubts)
    low, high = found.posterior.parameters[0].ci95
    assert low < 0.5 < high + 5.0


def test_the_next_measurement_does_what_was_expected(shared_fleet, levels_of):
    """Make the measurement, and find the standard errors that were announced."""
    data = levels_of(TRUTH, [2, 3, 4])
    free = free_of(shared_fleet, CONSTANT, DAMPING)
    candidates = [Candidate(c, Receiver("4 m", 4.0), 0.3) for c in td.DriveModel(shared_fleet).conditions]
    found = calibrate_fleet(shared_fleet, data, free, FitSettings(0.0), candidates=candidates)
    best, *_, worst = found.next_measurements
    assert best.condition.name == "6"
    assert best.mean_remaining < worst.mean_remaining
    made = calibrate_fleet(shared_fleet, levels_of(TRUTH, [2, 3, 4, 5]), free, FitSettings(0.0))
    for before, after in zip(found.parameters, made.parameters, strict=True):
        assert after.stderr / before.stderr == pytest.approx(best.remaining[before.key], rel=0.1)


def test_intervals_are_those_of_lmfit(shared_fleet, levels_of, conformance):
    import lmfit

    from tdacoustic.fitting.levels import LevelModel
    from tdacoustic.fitting.residuals import LevelResiduals

    data = levels_of(TRUTH, scatter_db=0.3, seed=4)
    model = LevelModel(shared_fleet, data)
    free = free_of(shared_fleet, CONSTANT, DAMPING)
    model.prepare(free)
    residuals = LevelResiduals(model, 0.0)
    found = fit(residuals, free)
    ours = profile_intervals(residuals, found)
    parameters = lmfit.Parameters()
    parameters.add("constant", found.values[CONSTANT])
    parameters.add("damping", np.log(found.values[DAMPING]))

    def of_lmfit(p):
        return residuals({CONSTANT: p["constant"].value, DAMPING: float(np.exp(p["damping"].value))})

    minimizer = lmfit.Minimizer(of_lmfit, parameters, scale_covar=False)
    result = minimizer.minimize()

    def by_chi_square(best, other):  # the data's sigma is known: no F test
        from scipy.stats import chi2

        return chi2.cdf(other.chisqr - best.chisqr, 1)

    theirs = lmfit.conf_interval(minimizer, result, sigmas=[0.95], prob_func=by_chi_square)
    for side, index, end in (("lower", 0, 0), ("upper", 2, 1)):
        expected = theirs["constant"][index][1]
        conformance(
            f"{side} end of the constant's 95 % interval",
            expected,
            ours[CONSTANT][end],
            0.01,
            "dB",
            "program: lmfit.conf_interval",
        )
        expected = float(np.exp(theirs["damping"][index][1]))
        conformance(
            f"{side} end of the damping's 95 % interval",
            expected,
            ours[DAMPING][end],
            2e-3 * expected,
            "1",
            "program: lmfit.conf_interval",
        )


def test_the_motors_gain_is_a_third_parameter(shared_fleet, levels_of):
    truth = {**TRUTH, GAIN: -2.0}
    found = calibrate_fleet(
        shared_fleet, levels_of(truth), free_of(shared_fleet, CONSTANT, DAMPING, GAIN), FitSettings(0.0)
    )
    assert {p.key: p.value for p in found.parameters} == pytest.approx(truth, rel=1e-3, abs=1e-3)

"""Sensitivity estimators against functions whose indices are known, and against scipy's."""

import math

import numpy as np
import pytest
from scipy.stats import qmc, sobol_indices, spearmanr

from tdacoustic.studies.indices import FEWEST_ROWS, regression_of, variance_indices

ISHIGAMI = (7.0, 0.1)


def ishigami(x):
    """T. Ishigami and T. Homma (1990), with the usual a = 7 and b = 0.1."""
    a, b = ISHIGAMI
    angle = np.pi * (2.0 * x - 1.0)
    return np.sin(angle[:, 0]) + a * np.sin(angle[:, 1]) ** 2 + b * angle[:, 2] ** 4 * np.sin(angle[:, 0])


def ishigami_indices():
    """In closed form: T. Ishigami, T. Homma, Proc. ISUMA (1990) 398."""
    a, b = ISHIGAMI
    first = 0.5 * (1.0 + b * np.pi**4 / 5.0) ** 2
    second = a**2 / 8.0
    both = b**2 * np.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    whole = first + second + both
    return np.array([first, second, 0.0]) / whole, np.array([first + both, second, both]) / whole


def evaluated(function, n, d, seed=0):
    """Results at A, B and A with one column of B, made by other code than ours."""
    first, second = np.hsplit(qmc.Sobol(2 * d, rng=np.random.default_rng(seed)).random(n), 2)
    exchanged = []
    for column in range(d):
        rows = first.copy()
        rows[:, column] = second[:, column]
        exchanged.append(function(rows))
    return function(first), function(second), np.array(exchanged)


def test_the_indices_of_ishigamis_function(conformance):
    first, total = ishigami_indices()
    assert first == pytest.approx([0.3139, 0.4424, 0.0], abs=1e-4)  # as printed
    assert total == pytest.approx([0.5576, 0.4424, 0.2437], abs=1e-4)
    own, whole = variance_indices(*evaluated(ishigami, 8192, 3), seed=1)
    source = "literature: Ishigami and Homma, ISUMA 1990, closed form of the variances"
    for index in range(3):
        conformance(
            f"Ishigami's function, first-order index {index + 1}", first[index], own.value[index], 0.005, "1", source
        )
        conformance(
            f"Ishigami's function, total index {index + 1}", total[index], whole.value[index], 0.005, "1", source
        )


def test_the_intervals_hold_the_truth_about_as_often_as_they_say():
    truth = np.concatenate(ishigami_indices())
    held = []
    for seed in range(60):
        own, whole = variance_indices(*evaluated(ishigami, 256, 3, seed), seed=seed)
        low, high = np.concatenate([own.low, whole.low]), np.concatenate([own.high, whole.high])
        held.append((low <= truth) & (truth <= high))
    assert np.mean(held) >= 0.93  # 95 % or more: a Sobol' sequence is spread more evenly than the resampled rows


def test_of_a_sum_each_index_is_its_part_of_the_variance_and_there_is_no_interaction():
    weights = np.array([3.0, -2.0, 0.5, 0.0])
    own, whole = variance_indices(*evaluated(lambda x: x @ weights, 4096, 4), seed=0)
    parts = weights**2 / (weights**2).sum()
    assert own.value == pytest.approx(parts, abs=0.02)
    assert whole.value == pytest.approx(parts, abs=0.01)
    assert whole.high[3] < 1e-12


def test_of_a_product_about_its_mean_all_is_interaction():
    own, whole = variance_indices(*evaluated(lambda x: (x[:, 0] - 0.5) * (x[:, 1] - 0.5), 4096, 2), seed=0)
    assert own.value == pytest.approx(0.0, abs=0.05)
    assert whole.value == pytest.approx(1.0, abs=0.05)
    assert (whole.low > own.high).all()


def test_they_are_those_of_scipy(conformance):
    first, second, exchanged = evaluated(ishigami, 512, 3)
    own, whole = variance_indices(first, second, exchanged, seed=0)
    theirs = sobol_indices(func={"f_A": first[None], "f_B": second[None], "f_AB": exchanged[:, None]}, n=512)
    for name, ours, other in (("first-order", own, theirs.first_order), ("total", whole, theirs.total_order)):
        apart = float(np.abs(ours.value - other).max())
        conformance(f"{name} indices, largest difference", 0.0, apart, 1e-12, "1", "program: scipy.stats.sobol_indices")


def test_a_level_far_from_zero_has_the_same_indices():
    first, second, exchanged = evaluated(ishigami, 256, 3)
    near, far = (variance_indices(first + a, second + a, exchanged + a, seed=0) for a in (0.0, 1e4))
    for one, other in zip(near, far, strict=True):
        assert one.value == pytest.approx(other.value, abs=1e-8)
        assert one.low == pytest.approx(other.low, abs=1e-8)


def hypercube(n, d, seed=0):
    return qmc.LatinHypercube(d, rng=np.random.default_rng(seed)).random(n)


def test_the_regression_of_a_straight_line():
    slopes = np.array([3.0, -2.0, 0.5])
    unit = hypercube(2000, 3)
    found = regression_of(unit, 80.0 + unit @ slopes, seed=0)
    assert found.slope.value == pytest.approx(slopes, abs=1e-10)
    assert found.standardised.value == pytest.approx(slopes / np.linalg.norm(slopes), abs=0.02)
    assert found.explained == pytest.approx(1.0, abs=1e-10)
    assert [found.rank.value[k] for k in range(3)] == pytest.approx(
        [spearmanr(unit[:, k], unit @ slopes).statistic for k in range(3)], abs=1e-12
    )


def test_what_a_straight_line_has_of_the_variance():
    """Of x² over 0..1 its R² is 15/16; between ranks it is 1."""
    unit = hypercube(4000, 1)
    found = regression_of(unit, unit[:, 0] ** 2, seed=0)
    assert found.explained == pytest.approx(15.0 / 16.0, abs=0.003)
    assert found.explained_ranks == pytest.approx(1.0, abs=1e-12)
    middle = regression_of(unit, (unit[:, 0] - 0.5) ** 2, seed=0)
    assert middle.explained == pytest.approx(0.0, abs=0.003)
    assert middle.explained_ranks == pytest.approx(0.0, abs=0.003)


def test_intervals_of_slopes_hold_the_truth_about_as_often_as_they_say():
    held = []
    for seed in range(150):
        rng = np.random.default_rng(seed)
        unit = rng.random((80, 2))
        found = regression_of(unit, unit @ [1.0, 0.3] + 0.3 * rng.normal(size=80), seed=seed)
        held.append((found.slope.low <= [1.0, 0.3]) & (found.slope.high >= [1.0, 0.3]))
    assert 0.90 <= np.mean(held) <= 0.99  # 300 intervals of 95 %: three standard deviations of their share are 4 %


def test_the_same_rows_and_seed_give_the_same_intervals():
    rng = np.random.default_rng(0)
    unit, scatter = rng.random((50, 2)), rng.normal(size=50)
    one, again, other = (regression_of(unit, scatter, seed=seed) for seed in (1, 1, 2))
    assert one.slope.low.tolist() == again.slope.low.tolist()
    assert one.slope.low.tolist() != other.slope.low.tolist()


def test_of_an_input_that_does_not_vary_nothing_is_said_and_the_others_are():
    unit = hypercube(100, 3)
    unit[:, 1] = 0.5
    found = regression_of(unit, unit @ [3.0, 1.0, -2.0], seed=0)
    assert found.slope.value == pytest.approx([3.0, math.nan, -2.0], abs=1e-9, nan_ok=True)
    for held in (found.slope, found.standardised, found.rank):
        assert np.isnan([held.value[1], held.low[1], held.high[1]]).all()
        assert np.isfinite([held.low[[0, 2]], held.high[[0, 2]]]).all()
    assert found.explained == pytest.approx(1.0, abs=1e-9)


def test_too_few_rows_or_no_variation_say_nothing():
    unit = hypercube(FEWEST_ROWS, 2)
    assert regression_of(unit, unit[:, 0], seed=0) is not None
    assert regression_of(unit[:-1], unit[:-1, 0], seed=0) is None
    assert regression_of(hypercube(29, 10), hypercube(29, 10)[:, 0], seed=0) is None
    assert regression_of(unit, np.full(FEWEST_ROWS, 80.0), seed=0) is None
    flat = np.full(64, 80.0)
    assert variance_indices(flat, flat, np.stack([flat, flat]), seed=0) is None
    assert variance_indices(flat[:3], np.arange(3.0), np.ones((2, 3)), seed=0) is None

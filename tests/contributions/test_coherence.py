"""Coherences of cases with analytic values; bias and intervals against drawn Gaussian signals and printed laws."""

import numpy as np
import pytest

from tdacoustic.contributions import (
    CrossMatrices,
    multiple_coherence,
    order_range,
    ordinary_coherence,
    partial_coherence,
    reference_coherence,
    sequential_parts,
)
from tdacoustic.contributions.coherence_statistics import (
    coherence_interval,
    corrected_coherence,
    mean_coherence,
    significant_coherence,
)
from tdacoustic.errors import AnalysisError

MANY = 60.0
"""Averages; the estimate itself does not depend on them."""


def exact(mixing, paths, noise, averages=MANY):
    """Matrices of x = C s, y = h s + noise with unit sources, on one line."""
    mixing, paths = np.atleast_2d(mixing).astype(complex), np.atleast_2d(paths).astype(complex)
    names = tuple("abcdef"[: len(mixing)])
    return CrossMatrices(
        np.array([100.0]),
        names,
        tuple(f"mic_{k}" for k in range(len(paths))),
        (mixing @ mixing.conj().T)[None],
        (mixing @ paths.conj().T)[None],
        np.real(np.sum(np.abs(paths) ** 2, axis=1) + noise)[None],
        averages,
    )


def drawn(true, n, q, count, seed=0):
    """Estimated multiple coherences of complex Gaussian signals: made here, nothing of the package."""
    rng = np.random.default_rng(seed)

    def gauss(*shape):
        return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)

    x = gauss(count, q, n)
    y = np.sqrt(true) * x[:, :1] + np.sqrt(1.0 - true) * gauss(count, 1, n)
    s_xx, s_xy = x @ x.conj().swapaxes(1, 2), x @ y.conj().swapaxes(1, 2)
    found = np.real(np.sum(s_xy.conj() * np.linalg.solve(s_xx, s_xy), axis=(1, 2)))
    return found / np.sum(np.abs(y[:, 0]) ** 2, axis=1)


@pytest.mark.parametrize(("true", "n", "q"), [(0.3, 10, 1), (0.5, 20, 3), (0.0, 8, 2), (0.9, 60, 2), (0.99, 40, 1)])
def test_bias_and_interval_are_those_of_drawn_signals(true, n, q, conformance):
    estimates = drawn(true, n, q, 8000)
    error = float(estimates.std() / np.sqrt(estimates.size))
    what = f"coherence {true:g}, {n} averages, {q} inputs"
    conformance(
        f"{what}: mean",
        estimates.mean(),
        mean_coherence(true, n, q).item(),
        4 * error,
        "1",
        "independent: 8000 drawn cases of Gaussian signals",
    )
    low, high = coherence_interval(estimates, n, q)
    # 2.5 % on each side; 8000 draws leave 0.17 %. Of no coherence the lower end is 0 and cannot miss on that side.
    conformance(
        f"{what}: below the interval",
        0.025,
        float(np.mean(true < low)),
        0.007,
        "1",
        "independent: 8000 drawn cases of Gaussian signals",
        "four times the scatter of 8000 draws",
    )
    missed = 0.0 if true == 0.0 else 0.025
    conformance(
        f"{what}: above the interval",
        missed,
        float(np.mean(true > high)),
        0.007,
        "1",
        "independent: 8000 drawn cases of Gaussian signals",
        "four times the scatter of 8000 draws",
    )


def test_the_corrected_one_has_no_bias_left():
    estimates = drawn(0.4, 16, 2, 8000)
    assert estimates.mean() > 0.44
    # The cut at 0 leaves a little; the law of the estimate is narrow enough here.
    assert corrected_coherence(estimates, 16.0, 2).mean() == pytest.approx(0.4, abs=0.01)
    assert corrected_coherence(np.array([1.0, 0.0]), 16.0, 2).tolist() == [1.0, 0.0]


@pytest.mark.parametrize("averages", [30.0, 40.9, 41.0, 200.0, 3000.0])
def test_the_mean_law_is_the_hypergeometric_one(averages, conformance):
    mpmath = pytest.importorskip("mpmath")
    source = "program: mpmath, mean by the function 2F1 (Carter, Proc. IEEE 75 (1987) 236)"
    for true in (0.0, 0.5, 0.95, 0.9999):
        expected = 1.0 - (averages - 2.0) / averages * (1.0 - true) * float(mpmath.hyp2f1(1, 1, averages + 1, true))
        got, what = (
            mean_coherence(true, averages, 2).item(),
            f"mean coherence of {true:g}, {averages:g} averages, 2 inputs",
        )
        conformance(what, expected, got, 1e-12 * expected, "1", source)


def test_significance_of_none_at_all(conformance):
    """Carter 1987: 1 - level^(1/(n-1)); and signals without coherence exceed it as often."""
    got = significant_coherence(20.0)
    conformance(
        "coherence that noise alone exceeds in 5 %, 20 averages",
        1.0 - 0.05 ** (1.0 / 19.0),
        got,
        1e-12,
        "1",
        "literature: G. C. Carter, Proc. IEEE 75 (1987) 236, exact distribution",
    )
    assert np.mean(drawn(0.0, 20, 1, 8000) > got) == pytest.approx(0.05, abs=0.01)


def test_carters_bias_to_first_order(conformance):
    """Bias of about (1 - g)² / n (1 + 2 g / n), G. C. Carter, C. H. Knapp, A. H. Nuttall 1973, for large n."""
    for true in (0.0, 0.3, 0.7):
        got = mean_coherence(true, 100.0).item() - true
        conformance(
            f"bias of an estimated coherence of {true:g}, 100 averages",
            (1 - true) ** 2 / 100.0 * (1.0 + 2.0 * true / 100.0),
            got,
            1e-5,
            "1",
            "literature: Carter, Knapp, Nuttall, IEEE Trans. Audio Electroacoust. 21 (1973) 337",
        )


def test_two_inputs_with_cross_talk():
    """x1 = s1, x2 = c s1 + s2, y = h1 s1 + h2 s2 + n: coherences by hand."""
    c, h1, h2, noise = 0.5, 1.0, 2.0, 1.5
    found = exact([[1.0, 0.0], [c, 1.0]], [[h1, h2]], noise)
    total = h1**2 + h2**2 + noise
    assert ordinary_coherence(found).value[:, 0, 0] == pytest.approx(
        [h1**2 / total, (c * h1 + h2) ** 2 / ((1 + c**2) * total)]
    )
    assert reference_coherence(found).value[0, 1, 0] == pytest.approx(c**2 / (1 + c**2))
    assert multiple_coherence(found).value[0, 0] == pytest.approx(1.0 - noise / total)
    partial = partial_coherence(found).value[:, 0, 0]
    # Given x1, of x2 is left s2 and of y h2 s2 + n.
    assert partial[1] == pytest.approx(h2**2 / (h2**2 + noise))
    # Given x2, of x1 is left s1 - c/(1+c²) x2 = (s1 - c s2)/(1+c²), with y: (h1 - c h2)/(1+c²).
    left = total - (c * h1 + h2) ** 2 / (1 + c**2)
    assert partial[0] == pytest.approx((h1 - c * h2) ** 2 / (1 + c**2) / left, abs=1e-12)


def test_three_inputs_in_a_chain():
    """x1 = s1, x2 = x1 + s2, x3 = x2 + s3, y = x3 + n: given x3, the others have nothing to say."""
    found = exact([[1, 0, 0], [1, 1, 0], [1, 1, 1]], [[1, 1, 1]], 0.7)
    partial = partial_coherence(found)
    assert partial.value[:, 0, 0] == pytest.approx([0.0, 0.0, 1.0 / 1.7])
    given_first = partial_coherence(found, ["b"], given=["a"])
    assert given_first.value[0, 0, 0] == pytest.approx(1.0 / (3.7 - 1.0))  # of x2 is left s2, of y s2 + s3 + n
    # The order among the conditioning ones plays no part.
    assert partial_coherence(found, ["c"], given=["a", "b"]).value == pytest.approx(
        partial_coherence(found, ["c"], given=["b", "a"]).value
    )


def test_parts_depend_on_the_order_and_their_range_says_so():
    found = exact([[1.0, 0.0], [0.5, 1.0]], [[1.0, 2.0]], 1.5)
    groups = {"motor": ["a"], "gearbox": ["b"]}
    first = sequential_parts(found, groups, ["motor", "gearbox"])[:, 0, 0]
    assert first == pytest.approx([1.0, 4.0])  # the cause is first: the truth
    second = sequential_parts(found, groups, ["gearbox", "motor"])[:, 0, 0]
    assert second == pytest.approx([5.0, 0.0], abs=1e-12)
    low, high = order_range(found, groups)
    assert low[:, 0, 0] == pytest.approx([0.0, 4.0], abs=1e-12)
    assert high[:, 0, 0] == pytest.approx([1.0, 5.0])
    assert sequential_parts(found, groups, ["motor", "gearbox"]).sum() == pytest.approx(5.0)
    with pytest.raises(AnalysisError, match="must hold each of"):
        sequential_parts(found, groups, ["motor"])


def test_multiple_coherence_of_independent_sources_is_one_less_the_noise():
    found = exact(np.eye(4), [[1.0, 0.5, 2.0, 0.1]], 2.0)
    power = 1.0 + 0.25 + 4.0 + 0.01
    assert multiple_coherence(found).value[0, 0] == pytest.approx(power / (power + 2.0))
    assert multiple_coherence(found, ["a", "c"]).value[0, 0] == pytest.approx(5.0 / (power + 2.0))


def test_an_identical_channel_leaves_nothing_to_be_coherent_with():
    found = exact([[1.0, 0.0], [1.0, 0.0]], [[1.0, 1.0]], 0.5)
    assert multiple_coherence(found).value[0, 0] == pytest.approx(1.0 / 2.5)
    partial = partial_coherence(found)
    assert not partial.determined.any()
    assert (partial.low == 0.0).all()
    assert (partial.high == 1.0).all()
    assert np.isfinite(partial.corrected).all()


def test_a_dead_channel_is_not_determined():
    found = exact([[1.0, 0.0], [0.0, 0.0]], [[1.0, 1.0]], 0.5)
    assert ordinary_coherence(found).determined[:, 0, 0].tolist() == [True, False]
    assert partial_coherence(found).determined[:, 0, 0].tolist() == [True, False]
    assert multiple_coherence(found).value[0, 0] == pytest.approx(0.4)
    assert np.isfinite(ordinary_coherence(found).corrected).all()


def test_one_reference_has_one_coherence():
    found = exact([[1.0]], [[1.0]], 1.0, averages=50.0)
    expected = ordinary_coherence(found)
    for got in (multiple_coherence(found), partial_coherence(found)):
        assert got.value.ravel() == pytest.approx(expected.value.ravel())
        assert got.low.ravel() == pytest.approx(expected.low.ravel())


def test_too_few_averages_are_refused():
    found = exact(np.eye(3), [[1.0, 1.0, 1.0]], 1.0, averages=3.0)
    for ask in (multiple_coherence, partial_coherence):
        with pytest.raises(AnalysisError, match="takes more than 3 independent averages, got 3"):
            ask(found)
    with pytest.raises(AnalysisError, match="more than 1 averages"):
        coherence_interval(np.array([0.5]), 1.0)


def test_unknown_names_and_wrong_shapes_are_refused():
    found = exact(np.eye(2), [[1.0, 1.0]], 1.0)
    with pytest.raises(AnalysisError, match="no reference 'x'; there are a, b"):
        multiple_coherence(found, ["x"])
    with pytest.raises(AnalysisError, match="asked for and conditioned on"):
        partial_coherence(found, ["a"], given=["a"])
    with pytest.raises(AnalysisError, match=r"s_yy must have shape \(1, 1\), got \(1, 2\)"):
        CrossMatrices(found.frequencies_hz, ("a", "b"), ("m",), found.s_xx, found.s_xy, np.ones((1, 2)), 9.0)
    with pytest.raises(AnalysisError, match="s_yy holds values that are no numbers"):
        CrossMatrices(found.frequencies_hz, ("a", "b"), ("m",), found.s_xx, found.s_xy, np.full((1, 1), np.nan), 9.0)


def test_conditioning_uses_up_averages(conformance):
    """Two of three references conditioned out: a coherence of none is 1/(n - 2) in the mean, not 1/n."""
    n, count = 12, 3000
    rng = np.random.default_rng(4)
    x = rng.standard_normal((count, 4, n)) + 1j * rng.standard_normal((count, 4, n))
    s = x @ x.conj().swapaxes(1, 2) / n
    power = np.diagonal(s, axis1=1, axis2=2).real[:, 3:]
    found = partial_coherence(
        CrossMatrices(np.arange(float(count)), ("a", "b", "c"), ("mic",), s[:, :3, :3], s[:, :3, 3:], power, float(n))
    )
    assert found.averages == n - 2
    # 3000 draws of an exponential-like law: 0.1 / sqrt(3000) = 0.002 standard error
    conformance(
        "partial coherence of none, 12 averages",
        0.1,
        found.value[0].mean(),
        0.008,
        "1",
        "analytic: 1/(n - k), of drawn Gaussian signals",
    )
    assert np.mean(found.low[0] > 0.0) == pytest.approx(0.025, abs=0.012)

"""Statistics of one pass equal numpy's over the whole, whatever the blocks."""

from itertools import groupby

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tdacoustic.quality import StatisticsMeter

RATE = 1000.0


def statistics_of(data, cuts=(), limits=None):
    data = np.atleast_2d(data)
    meter = StatisticsMeter(RATE, limits or (None,) * len(data))
    for piece in np.split(data, cuts, axis=1):
        meter.take(piece)
    return meter.result()


def sample():
    rng = np.random.default_rng(1)
    x = rng.standard_normal((3, 3000)) + np.array([[1e5], [0.0], [-3.0]])
    x[1, 500:540] = 0.7
    x[1, 1200] = np.nan
    x[2] = np.clip(x[2], -4.5, -1.0)
    return x


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(0, 3000), max_size=10).map(sorted))
def test_equal_to_numpy_whatever_the_blocks(cuts):
    x = sample()
    found = statistics_of(x, cuts, (None, None, (-5.0, -1.0)))
    assert found.n_samples == 3000
    assert found.missing.tolist() == [0, 1, 0]
    assert np.allclose(found.mean, np.nanmean(x, axis=1), rtol=1e-12)
    # The shift is the first block's mean: what is left of the offset costs at most half of the digits.
    assert np.allclose(found.mean_square, np.nanvar(x, axis=1), rtol=1e-6)
    assert np.array_equal(found.minimum, np.nanmin(x, axis=1)) and np.array_equal(found.maximum, np.nanmax(x, axis=1))
    assert found.at_limits.tolist() == [0, 0, np.count_nonzero(x[2] == -1.0)]
    assert (found.flat_samples[1], found.longest_flat[1]) == (40, 40)
    both = np.isfinite(x[1])
    assert np.allclose(found.correlation[0, 2], np.corrcoef(x[0], x[2])[0, 1], atol=1e-6)
    # The variances are over all samples, the covariance over those both have: one of 3000 is missing.
    assert np.allclose(found.correlation[1, 2], np.corrcoef(x[1, both], x[2, both])[0, 1], atol=1e-5)


@given(st.lists(st.integers(1, 60), min_size=1, max_size=12), st.lists(st.integers(0, 400), max_size=6).map(sorted))
def test_flat_stretches_are_found_whatever_the_blocks(lengths, cuts):
    x = np.concatenate([np.full(length, float(k % 3)) for k, length in enumerate(lengths)])
    found = statistics_of(x, [cut for cut in cuts if cut <= x.size])
    long = [length for length in lengths if length >= 16]
    assert found.flat_samples[0] == sum(long)
    assert found.longest_flat[0] == max(long, default=0)


def test_a_plateau_is_at_the_extreme_of_the_record():
    x = np.sin(np.arange(1000) / 7.0)
    assert statistics_of(x).plateau[0] == 0
    y = np.clip(x, -0.9, 0.8)
    runs = [(value, len(list(held))) for value, held in groupby(y)]
    above, below = (sum(n for value, n in runs if value == top) for top in (0.8, -0.9))
    assert statistics_of(y).plateau[0] == above + below
    assert statistics_of(y, [400, 401, 700]).plateau[0] == above + below
    y[0] = 2.0  # one sample beyond: the plateau is no longer the extreme above
    assert statistics_of(y).plateau[0] == below

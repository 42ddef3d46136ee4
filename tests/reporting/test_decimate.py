"""Fewer points, the same picture."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tdacoustic.reporting.decimate import block_max, envelope, minmax_indices


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(9, 5000), st.integers(8, 300), st.booleans(), st.booleans())
def test_extremes_survive(seed: int, n: int, max_points: int, log: bool, gaps: bool) -> None:
    rng = np.random.default_rng(seed)
    x, y = np.cumsum(rng.uniform(0.01, 1.0, n)), rng.standard_normal(n)
    if gaps:
        y[rng.random(n) < 0.1] = np.nan
    kept = minmax_indices(x, y, max_points, log)
    assert kept.size <= max_points
    assert np.all(np.diff(kept) > 0)
    assert kept[0] == 0 and kept[-1] == n - 1
    if np.isfinite(y).any():
        assert np.nanmax(y[kept]) == np.nanmax(y)
        assert np.nanmin(y[kept]) == np.nanmin(y)
    assert np.isnan(y[kept]).any() == np.isnan(y).any()


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_every_bin_keeps_its_peak(seed: int, log: bool) -> None:
    rng = np.random.default_rng(seed)
    x, y = np.linspace(1.0, 1000.0, 4000), rng.standard_normal(4000)
    kept = minmax_indices(x, y, 202, log)
    place = np.log10(x) if log else x
    bins = np.minimum((place - place[0]) / (place[-1] - place[0]) * 100, 99).astype(int)
    for one in np.unique(bins):
        inside = bins == one
        assert y[inside].max() in y[kept] and y[inside].min() in y[kept]


def test_logarithmic_bins_do_not_starve_low_frequencies() -> None:
    x = np.linspace(0.5, 10_000.0, 20_000)
    kept = x[minmax_indices(x, np.sin(x), 1000, log=True)]
    decades = np.histogram(np.log10(kept), [1, 2, 3, 4])[0]
    assert decades[0] > 100 and decades[1] > 150


def test_limits_keep_one_neighbour_each_side_and_zero_frequency_goes() -> None:
    x = np.arange(100.0)
    assert minmax_indices(x, x, 1000, limits=(10.0, 20.0)).tolist() == list(range(9, 22))
    assert minmax_indices(x, x, 1000, log=True)[0] == 1


def test_unsorted_traces_are_reduced_in_their_order() -> None:
    angle = np.linspace(0.0, 20.0 * np.pi, 5000)
    kept = minmax_indices(np.cos(angle), np.sin(angle), 500)
    assert kept.size <= 500 and np.all(np.diff(kept) > 0)


def test_short_traces_are_left_alone_and_tiny_limits_refused() -> None:
    assert minmax_indices(np.arange(5.0), np.zeros(5), 8).tolist() == [0, 1, 2, 3, 4]
    with pytest.raises(ValueError, match="at least 8, got 4"):
        minmax_indices(np.arange(5.0), np.zeros(5), 4)


def test_envelope_contains_the_band() -> None:
    x, rng = np.arange(3000.0), np.random.default_rng(0)
    lower = rng.standard_normal(3000)
    xs, low, high = envelope(x, lower, lower + 1, 100)
    assert xs.size <= 100
    assert low.min() == lower.min() and high.max() == (lower + 1).max()


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 90), st.integers(2, 90), st.integers(1, 30), st.booleans())
def test_maps_keep_their_maximum(seed: int, m: int, n: int, limit: int, log: bool) -> None:
    z = np.random.default_rng(seed).standard_normal((m, n))
    z[0, 0] = np.nan
    x, y, small = block_max(np.arange(1.0, n + 1), np.arange(1.0, m + 1), z, limit, limit, log_x=log)
    assert small.shape == (y.size, x.size) and max(small.shape) <= limit
    assert np.nanmax(small) == np.nanmax(z)
    assert np.all(np.diff(x) > 0) and np.all(np.diff(y) > 0)
